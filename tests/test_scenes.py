"""Every scene that comes with softmark runs and judges itself."""

from __future__ import annotations

from pathlib import Path

import pytest

import softmark
from softmark.grammar.diagnostic import Source
from softmark.grammar.parse import parse
from softmark.grammar.print import format_source
from softmark.grammar.tree import Expect
from softmark.scenes import ROOT

ALL = sorted(ROOT.rglob("*.scene"))
LIBRARIES = [f for f in ALL if "materials" in f.parts]
EXPERIMENTS = [f for f in ALL if f not in LIBRARIES]


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda f: f.stem)
def test_scene_meets_its_expectations(file: Path) -> None:
    report = softmark.load(file).run()
    assert [e.text for e in report.expectations if e.passed is not True] == []
    assert {n: m.message for n, m in report.models.items() if m.status != "converged"} == {}
    assert report.exit_status == 0


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda f: f.stem)
def test_scene_expects_something(file: Path) -> None:
    tree, problems = parse(Source(file.name, file.read_text(encoding="utf-8")))
    assert not problems
    assert any(isinstance(d, Expect) for d in tree.declarations)


@pytest.mark.parametrize("file", LIBRARIES, ids=lambda f: f.stem)
def test_library_can_be_used(file: Path) -> None:
    inner = file.relative_to(ROOT).as_posix()
    scene = softmark.loads(f'use "std/{inner}" as lib\n')
    assert any(name.startswith("lib.") for name in scene.scene.declared)


@pytest.mark.parametrize("file", ALL, ids=lambda f: f.stem)
def test_scene_is_in_canonical_form(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert format_source(Source(file.name, text)) == text
