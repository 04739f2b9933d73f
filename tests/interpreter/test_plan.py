"""The plan builds what the questions need, no more, and names the line that asks."""

from __future__ import annotations

from pathlib import Path

import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.planning.run_plan import Task, plan_of

HEAD = """
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 10 mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 10)
model solid_a = fem(tet4, strain = corotational, size = 10 mm)
model solid_b = fem(tet4, strain = finite, size = 10 mm)
model solid_c = fem(tet4, strain = finite, size = 8 mm)
reference theory = elastica(beam)
reference reissner = simo_reissner(beam)
"""
PROBE = "probe tip = point(beam, at = (100, 0, 0) mm)\n"
METRIC = "metric drop = displacement(tip, along = -z)\n"


def tasks(text: str, *only: str) -> list[Task]:
    return list(plan_of(softmark.loads(text).scene, only).tasks)


def names(found: list[Task], kind: str) -> list[str]:
    return [t.name for t in found if t.kind == kind]


def test_nothing_is_built_when_nothing_is_asked() -> None:
    plan = plan_of(softmark.loads(HEAD).scene)
    assert plan.tasks == ()
    assert set(plan.idle) == {"rod", "solid_a", "solid_b", "solid_c", "theory", "reissner"}


def test_a_probe_asks_for_every_model_and_reference_of_its_body() -> None:
    found = tasks(HEAD + PROBE)
    assert names(found, "solve") == ["rod", "solid_a", "solid_b", "solid_c"]
    assert names(found, "reference") == ["theory", "reissner"]


def test_models_that_want_the_same_mesh_share_it() -> None:
    found = [t for t in tasks(HEAD + PROBE) if t.kind == "mesh"]
    assert len(found) == 2
    assert "solid_a, solid_b" in found[0].detail


def test_a_chosen_model_alone_is_built() -> None:
    found = tasks(HEAD + PROBE, "rod")
    assert names(found, "solve") == ["rod"]
    assert names(found, "mesh") == []


def test_a_probe_of_another_body_asks_for_nothing_here() -> None:
    text = HEAD.replace("beam6dof(segments = 10)", "beam6dof(segments = 10, body = beam)")
    for size in ("10 mm", "8 mm"):
        text = text.replace(f"size = {size})", f"size = {size}, body = beam)")
    text += "body other = solid(box(size = (10, 10, 10) mm), gel)\nprobe there = point(other, at = (1, 1, 1) mm)\n"
    assert names(tasks(text), "solve") == []


def test_each_task_names_the_line_that_asks() -> None:
    text = HEAD + PROBE + METRIC + "expect rod.drop > 0 mm\n"
    lines = text.splitlines()
    for task in tasks(text):
        asking = lines[task.asked.span.line - 1]
        assert asking.startswith(("probe", "metric", "expect"))
    solve = next(t for t in tasks(text) if t.kind == "solve")
    assert lines[solve.asked.span.line - 1].startswith("probe")


def test_an_expectation_alone_needs_its_metric_and_model() -> None:
    found = tasks(HEAD + PROBE + METRIC + "expect rod.drop > 0 mm\n")
    (expectation,) = [t for t in found if t.kind == "expect"]
    assert expectation.needs == ("rod",)


SCANNED = (
    HEAD
    + """
reference scan = surface("scan.ply", unit = 1 m, uncertainty = 1 mm)
reference image = virtual_scan(of = rod)
reference beads = markers("beads.csv", unit = 1 mm, uncertainty = 1 mm)
probe skin = surface(beam)
probe inside = markers(beam, of = beads)
metric gap = surface_distance(skin, against = scan)
metric away = mean_error(inside, against = beads)
"""
)


def in_a_folder_with(folder: Path, *names: str) -> softmark.LoadedScene:
    """The scene beside files that it names; of tables a plan reads that they are some, of others nothing."""
    for name in names:
        table = "x0,y0,z0,x1,y1,z1\n0,0,0,0,0,0\n"
        (folder / name).write_text(table if name.endswith(".csv") else "", encoding="utf-8")
    (folder / "beam.scene").write_text(SCANNED, encoding="utf-8")
    return softmark.load(folder / "beam.scene")


def test_measured_references_are_named_with_what_they_are(tmp_path: Path) -> None:
    found = list(plan_of(in_a_folder_with(tmp_path, "scan.ply", "beads.csv").scene).tasks)
    references = {t.name: t.detail for t in found if t.kind == "reference"}
    assert references["scan"] == "surface"
    assert references["image"] == "virtual_scan"
    assert references["beads"] == "markers"
    probes = {t.name: t.detail for t in found if t.kind == "probe"}
    assert probes["skin"].startswith("a surface in")
    assert probes["inside"].startswith("tracked points in")
    metrics = {t.name: t for t in found if t.kind == "metric"}
    assert metrics["gap"].detail == "surface_distance against scan over skin"
    assert set(metrics["away"].needs) == {"inside", "beads"}


@pytest.mark.parametrize(
    ("scene", "measured"),
    [
        ("silicone-beam-as-published", {"scan": "surface"}),
        ("silicone-beam-calibrated", {"scan": "surface"}),
        ("silicone-beam-refined", {"scan": "surface"}),
        ("silicone-beam-scanned", {"image": "virtual_scan"}),
        ("truth-cube", {"beads": "markers"}),
    ],
)
def test_plans_of_the_library_name_what_was_measured(
    scene: str, measured: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    tasks = plan_of(softmark.load(scene).scene).tasks
    kinds = {t.name: t.detail for t in tasks if t.kind == "reference"}
    assert measured.items() <= kinds.items()
    assert main(["plan", scene]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in measured)
