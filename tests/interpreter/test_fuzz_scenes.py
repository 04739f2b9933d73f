"""Scenes that hypothesis makes from the vocabulary, sound and nearly so: a scene or errors, and one canonical form."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softmark.interpreter.language.field_schema import Form
from softmark.interpreter.validation.constructor_registry import CATALOGUE


@st.composite
def scenes(draw: Callable[..., Any]) -> str:
    """A scene of choices that hypothesis can make smaller: it starts from the first of each."""

    def pick(options: Sequence[Any]) -> Any:
        return options[draw(st.integers(0, len(options) - 1))]

    text: str = import_module("generate").scene(pick)
    return text


DRAWN = settings(
    derandomize=True, deadline=None, max_examples=30, suppress_health_check=list(HealthCheck), database=None
)


@DRAWN
@given(text=scenes())
def test_generated_scenes(fuzz_folder: Path, text: str) -> None:
    import_module("scene").examine(text, fuzz_folder)


@pytest.mark.long
@pytest.mark.slow
@settings(DRAWN, max_examples=120)
@given(text=scenes())
def test_many_more_generated_scenes(fuzz_folder: Path, text: str) -> None:
    import_module("scene").examine(text, fuzz_folder)


def test_every_form_of_a_field_is_made() -> None:
    """One that is forgotten stops generation where chance comes by it, and not before."""
    maker = import_module("generate").Maker
    assert [form for form in get_args(Form) if not hasattr(maker, f"_{form}")] == []


@pytest.mark.long
@pytest.mark.slow
def test_some_are_sound_and_every_constructor_occurs(fuzz_folder: Path) -> None:
    """What is made is neither all refused, which would try no check of whole scenes, nor of a few words only."""
    generate, scene = import_module("generate"), import_module("scene")
    texts = [generate.scene(random.Random(i).choice) for i in range(600)]
    words = {scene.examine(text, fuzz_folder) for text in texts[:100]}
    assert words == {"accepted", "refused"}
    known = {name for constructors in CATALOGUE.values() for name in constructors}
    missing = {name for name in known if not any(f"{name}(" in text for text in texts)}
    assert not missing
