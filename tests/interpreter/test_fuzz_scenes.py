"""Scenes that hypothesis makes from the vocabulary, sound and nearly so: a scene or errors, and one canonical form."""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softmark.interpreter import schema

FUZZ = Path(__file__).parents[1] / "fuzz"


def target(name: str) -> ModuleType:
    """A module of tests/fuzz, which import each other by their names."""
    sys.path.insert(0, str(FUZZ))
    try:
        return __import__(name)
    finally:
        sys.path.remove(str(FUZZ))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that scenes may name."""
    found: Path = target("scene").stage(tmp_path_factory.mktemp("fuzz"))
    return found


@st.composite
def scenes(draw: Callable[..., Any]) -> str:
    """A scene of choices that hypothesis can make smaller: it starts from the first of each."""

    def pick(options: Sequence[Any]) -> Any:
        return options[draw(st.integers(0, len(options) - 1))]

    text: str = target("generate").scene(pick)
    return text


@settings(
    derandomize=True, deadline=None, max_examples=120, suppress_health_check=list(HealthCheck), database=None
)
@given(text=scenes())
def test_generated_scenes(folder: Path, text: str) -> None:
    target("scene").examine(text, folder)


def test_some_are_sound_and_every_constructor_occurs(folder: Path) -> None:
    """What is made is neither all refused, which would try no check of whole scenes, nor of a few words only."""
    generate, scene = target("generate"), target("scene")
    texts = [generate.scene(random.Random(i).choice) for i in range(150)]
    words = {scene.examine(text, folder) for text in texts[:40]}
    assert words == {"accepted", "refused"}
    known = {name for constructors in schema.tables().values() for name in constructors}
    missing = {name for name in known if not any(f"{name}(" in text for text in texts)}
    assert not missing
