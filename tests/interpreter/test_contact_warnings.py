"""What of its `where` a contact takes: in the report, and as a part of the stated error."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from softmark import loads
from softmark.interpreter.pipeline import run_pipeline
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.verification import contact_error, error_estimate

PRESSED = """softmark 1
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm), gel)
body     tool  = rigid(sphere(radius = 20 mm, origin = (10, 10, 40) mm))
support  floor = fixed(block, where = z <= 0 mm)
support  hand  = displaced(tool, by = (0, 0, -1) mm)
contact  touch = rigid_contact(tool, block, where = z >= 20 mm and x <= {to} mm)
model    hexes = fem(hex8, strain = small, size = 5 mm)
metric   push  = force(touch, along = -z)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("to", "share"), [(15.0, 1.0), (12.0, 1.25)])
def test_facets_may_be_more_than_what_is_selected(to: float, share: float) -> None:
    """Facets are 5 mm wide: those up to x = 15 mm take part for 12 mm, which is a part of the error."""
    loaded = loads(PRESSED.format(to=to))
    report = run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(stated=("hexes",)))
    model = report.models["hexes"]
    touched, metric = model.contacts["touch"], model.metrics["push"]
    assert touched.taken == pytest.approx(share)
    assert ("the facets are 125 % of the selected area" in render(report)) is (share > 1.0)
    parts = model.stated["push"].parts
    assert ("touching" in parts) is (share > 1.0)
    assert (parts.get("touching") or 0.0) <= (metric.value or 0.0)


ROUND = """softmark 1
material gel   = linear_elastic(young = 10 kPa, poisson = 0.45, density = 1000 kg/m^3)
body     block = axisymmetric(quadrilateral((0, -40, 0) mm, (20, -40, 0) mm, (20, 0, 0) mm, (0, 0, 0) mm), gel)
body     ball  = rigid(sphere(radius = 10 mm, origin = (0, 10, 0) mm))
support  floor = fixed(block, where = y <= -40 mm)
support  hand  = displaced(ball, by = (0, -1, 0) mm)
contact  touch = rigid_contact(ball, block, where = y >= 0 mm)
model    quads = fem({how}, strain = small)
metric   push  = force(touch, along = -y)
metric   area  = contact_area(touch)
metric   most  = contact_pressure(touch)
"""
TRUE = {"area": 31.1e-6, "most": 2.6e3}  # of quad8 of 0.5 mm; Hertz has 31.4 mm^2 and 2.5 kPa


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("how", "told"),
    [
        ("quad4, size = 2 mm", ""),
        pytest.param("quad8, size = 4 mm", "W660", marks=pytest.mark.slow),
        pytest.param("quad4, size = 8 mm", "W660", marks=pytest.mark.slow),
    ],
)
def test_a_force_is_no_more_than_area_times_pressure(how: str, told: str) -> None:
    """Beyond it a mesh says so, and states an error of area and pressure that contains the truth, or that it has none.

    Of cells of 8 mm force over area times pressure is 890, of 4 mm 1.2, of 2 mm 0.64 (Hertz: 2/3).
    """
    loaded = loads(ROUND.format(how=how))
    report = run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(stated=("quads",)))
    model, codes = report.models["quads"], [warning.code for warning in report.warnings]
    assert codes.count("W660") == (1 if told else 0)
    for name, true in TRUE.items():
        stated, found = model.stated[name], model.metrics[name].value
        assert found is not None
        assert stated.value is not None or "W301" in codes or not told
        if stated.value is not None:
            assert abs(found - true) <= stated.value
        if told:
            assert "W660" in stated.doubts
            assert stated.value is not None or "times the contact area times the largest pressure" in str(stated.reason)


GLUED = """softmark 1
material foam = linear_elastic(young = 100 kPa, poisson = 0, density = 1000 kg/m^3)
body     both = plane_strain(disjoint(
    quadrilateral((0, 0, 0) mm, (10, 0, 0) mm, (10, 10, 0) mm, (0, 10, 0) mm),
    quadrilateral((0, 10, 0) mm, (10, 10, 0) mm, (10, 20, 0) mm, (0, 20, 0) mm), coarser = 0.7),
    foam, thickness = 10 mm)
support  floor = fixed(both, where = y <= 0 mm)
support  lid   = displaced(both, where = y >= 20 mm, by = (0, -0.5, 0) mm)
contact  joint = tied(both, where = y >= 10 mm and y <= 10 mm, stiffness = {stiff} Pa/m)
model    quads = fem(quad4, strain = small, size = 5 mm)
metric   push  = force(lid, along = -y)
"""


@pytest.mark.parametrize(("stiff", "given"), [(4e7, 1 / 9), (4e9, 1 / 801)])
def test_a_joint_that_gives_way_is_part_of_the_error(stiff: float, given: float) -> None:
    """Of 250 mN, E d / (2 a) a w: springs in line with a column of 5e6 Pa/m take 5e6 / (5e6 + stiffness)."""
    loaded = loads(GLUED.format(stiff=stiff))
    report = run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(stated=("quads",)))
    model = report.models["quads"]
    found, stated = model.metrics["push"].value, model.stated["push"]
    assert found == pytest.approx(0.25 * (1.0 - given), rel=1e-6)
    assert stated.parts["joint"] == pytest.approx(0.25 * given, rel=1e-6)
    assert stated.value is not None
    assert stated.value >= 0.25 * given * (1.0 - 1e-6)


NARROW = """softmark 1
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = plane_strain(
    quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 10, 0) mm, (0, 10, 0) mm), gel, thickness = 10 mm)
body     roll  = rigid(cylinder(radius = 5 mm, length = 50 mm, axis = +z, origin = (10, 15.05, -25) mm))
support  bed   = fixed(block, where = y <= 0 mm)
support  hand  = displaced(roll, by = (0, -0.2, 0) mm)
contact  top   = rigid_contact(roll, block, where = y >= 10 mm)
model    quads = fem(quad4, size = 2.5 mm, strain = small)
metric   area  = contact_area(top)
"""


def test_what_touches_between_nodes_alone_has_an_area() -> None:
    """Of 15.4 mm^2 with cells of a quarter of a millimetre: here no more is known than the facets, 25 mm^2 each."""
    loaded = loads(NARROW)
    model = run_pipeline.run_scene(
        loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False, stated=())
    ).models["quads"]
    found, stated = model.metrics["area"].value, model.stated["area"].value
    assert found is not None
    assert found > 0.0
    assert stated is None or abs(found - 15.4e-6) <= stated


def test_other_meshes_that_agree_do_not_outweigh_a_contradiction(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pressure of 205 Pa was said to be within 31 Pa where the force was 8.5 times what it came to: it was 694 Pa."""
    least: list[float | None] = [None, 5.0, 0.5]
    monkeypatch.setattr(contact_error, "least_error", lambda seen: least.pop(0))
    answer: Any = SimpleNamespace(case=SimpleNamespace(contacts=[None]))
    verifier: Any = SimpleNamespace(discretisation=lambda answer, seen: 1.0)
    assert [error_estimate.ErrorEstimate._mesh_error(answer, verifier, answer) for _ in range(3)] == [1.0, 5.0, 1.0]
