"""Every scene that comes with softmark runs and judges itself."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from library import loaded

import softmark
from softmark.grammar.diagnostic import Source
from softmark.grammar.parser import parse
from softmark.grammar.printer import format_source
from softmark.grammar.tree import Expect
from softmark.interpreter.models.external.external_declaration import ExternalSolver
from softmark.interpreter.planning.run_plan import plan_of
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT
from softmark.scenes import ROOT

ALL = sorted(ROOT.rglob("*.scene"))
LIBRARIES = [f for f in ALL if "materials" in f.parts]
EXPERIMENTS = [f for f in ALL if f not in LIBRARIES]


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda f: f.stem)
def test_scene_meets_its_expectations(file: Path, report_of: Callable[[Path], softmark.Report]) -> None:
    report = report_of(file)
    others = {n for n, m in loaded(file).scene.of_kind("model").items() if isinstance(m.thing, ExternalSolver)}
    left = {n for n in others if report.models[n].status in LEFT_OUT}  # not installed, or said to be unsupported
    assert [(e.text, e.reason) for e in report.expectations if e.passed is not True and not e.left_out] == []
    assert {n: o.message for n, o in report.models.items() if o.status not in ANSWERED and n not in left} == {}
    assert {n: o.message for n, o in report.references.items() if o.status != "converged"} == {}
    assert report.exit_status == 0
    report.dumps()  # every number is finite


ROUNDED = {"single"}  # what single precision leaves of their forces is more


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda f: f.stem)
def test_supports_and_loads_hold_each_other(file: Path, report_of: Callable[[Path], softmark.Report]) -> None:
    """To 1e-8 of the largest load in every state of rest, or to what single precision can be solved."""
    for name, model in report_of(file).models.items():
        if model.status in LEFT_OUT:
            continue
        checks = model.solve["checks"]
        if (found := checks.get("reactions")) is None:  # it moves, or is reduced, and says so
            assert all("force" in r and r["reason"] for r in model.to_json().get("reactions", {}).values()), name
            continue
        bar = found["allowed"] if name in ROUNDED else 1e-8
        assert found["force"] <= bar, name
        assert found["moment"] <= bar or "have a net moment" in found["note"], name  # cells that turn as a whole
        assert found["apart"] is None if found["allowed"] == 0.0 else found["apart"] <= bar, name


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda f: f.stem)
def test_only_a_model_that_asks_for_it_may_be_capped(file: Path) -> None:
    scene = loaded(file).scene
    capped = {n for n, m in scene.of_kind("model").items() if getattr(m.thing, "max_iterations", None) is not None}
    assert capped <= ({"capped"} if file.stem == "silicone-beam-release" else set())


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda f: f.stem)
def test_the_plan_has_every_model_and_reference_and_names_the_line_that_asks(file: Path) -> None:
    scene = loaded(file).scene
    plan = plan_of(scene)
    assert plan.idle == ()
    for kind, name in (("solve", "model"), ("reference", "reference")):
        tasks = {t.name: t for t in plan.tasks if t.kind == kind}
        assert set(tasks) == set(scene.of_kind(name))
        for task in tasks.values():
            line = scene.source.text.splitlines()[task.asked.span.line - 1]
            assert line.split()[0] in ("probe", "metric", "expect")


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
