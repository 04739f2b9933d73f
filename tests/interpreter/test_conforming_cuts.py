"""Edges and corners of rigid bodies between the points of facets: nothing cuts in, and the forces are found again."""

from __future__ import annotations

from math import inf
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from octahedra import octahedron

from softmark import load
from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.verification.contact_warnings import _cell_size_remedy
from softmark.solvers.mesh.shapes import Box

SOLID = """softmark 1
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (40, 40, 20) mm, origin = (-20, -20, -20) mm), gel)
body     tool  = rigid({tool})
support  floor = fixed(block, where = z <= -20 mm)
support  hand  = displaced(tool, by = (0, 0, -2) mm, amplitude = per_state)
contact  touch = rigid_contact(tool, block, where = z >= 0 mm, friction = {friction})
analysis press = static(states = [50, 100] %)
model    cells = fem({element}, size = 10 mm, strain = finite)
metric   push  = force(touch, along = -z)
metric   held  = force(floor, along = +z)
"""
PLANE = """softmark 1
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = plane_strain(
    quadrilateral((-20, -20, 0) mm, (20, -20, 0) mm, (20, 0, 0) mm, (-20, 0, 0) mm), gel, thickness = 10 mm)
body     tool  = rigid(box(size = (13, 10, 40) mm, origin = (-6.3, 0, -20) mm))
support  floor = fixed(block, where = y <= -20 mm)
support  hand  = displaced(tool, by = (0, -2, 0) mm, amplitude = per_state)
contact  touch = rigid_contact(tool, block, where = y >= 0 mm, friction = {friction})
analysis press = static(states = [50, 100] %)
model    cells = fem({element}, size = 10 mm, strain = finite)
metric   push  = force(touch, along = -y)
metric   held  = force(floor, along = +y)
"""
# an octahedron of 10 mm, a corner of it down and its axis 12 degrees from upright: it touches within a facet
TIP = octahedron((
    (10.5786, 5.1502, 11.1764), (-6.3786, -2.5502, 8.1878), (-1.7505, 10.5106, 9.1041), (5.9505, -7.9106, 10.2601),
    (0.6057, 1.3, 19.5693), (3.5943, 1.3, 0.0),
))  # fmt: skip
BOX = "box(size = (13, 17, 10) mm, origin = (-6.3, -4.1, 0) mm)"
SLOW = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "tool", "element", "friction"),
    [
        (SOLID, 'tetrahedralized("tip.obj", unit = 1 mm)', "hex8", 0.3),
        (PLANE, BOX, "quad4", 0.3),
        pytest.param(PLANE, BOX, "quad8", 0.0, marks=SLOW),
        *(
            pytest.param(SOLID, tool, element, friction, marks=SLOW)
            for tool in ('tetrahedralized("tip.obj", unit = 1 mm)', BOX)
            for element in ("hex8", "tet4")
            for friction in (0.0, 0.3)
        ),
        *(
            pytest.param(SOLID, 'tetrahedralized("tip.obj", unit = 1 mm)', e, f, marks=SLOW)
            for e in ("hex20", "tet10")
            for f in (0.0, 0.3)
        ),
    ],
)
def test_what_is_sharp_does_not_cut_in(tmp_path: Path, scene: str, tool: str, element: str, friction: float) -> None:
    """Of .4 to 1.8 mm nothing is left: by branch and bound, which shares no code with what looks for cuts, 0.1 um.

    That is the barrier's distance of such a block: contact ends there. Of the flat box on tetrahedra rounds run out
    first, and 4 um of .4 mm are left at a corner, which the table of contacts tells. Forces balance by the own check,
    which is part of the status, and are carried by the floor to the tolerance of a state.
    """
    (tmp_path / "tip.obj").write_text(TIP)
    (tmp_path / "a.scene").write_text(scene.format(tool=tool, element=element, friction=friction))
    found = load(tmp_path / "a.scene").run().models["cells"]
    assert found.status == "converged"
    assert found.solve["joined"] > 0
    left = 5e-6 if (tool, element, friction) == (BOX, "tet4", 0.0) else 1e-7
    assert found.solve["checks"]["contact"]["touch"]["overlap"] < left
    for push, held in zip(found.metrics["push"].states, found.metrics["held"].states, strict=True):
        assert push == pytest.approx(held, rel=1e-6)


@pytest.mark.slow
def test_what_points_suffice_for_is_solved_as_before(tmp_path: Path) -> None:
    """A sphere that is blunter than facets: nothing is looked for, and nothing joins."""
    text = SOLID.format(tool="sphere(radius = 15 mm, origin = (0, 0, 15) mm)", element="hex8", friction=0.0)
    (tmp_path / "a.scene").write_text(text)
    found = load(tmp_path / "a.scene").run().models["cells"]
    assert found.status == "converged"
    assert found.solve["joined"] == 0


@pytest.mark.parametrize(
    ("radius", "said"), [(0.0, "use cells about 4 times smaller"), (inf, "use cells about 2 times smaller")]
)
def test_what_would_follow_an_edge_or_what_is_hollow_is_no_radius(radius: float, said: str) -> None:
    """A facet on an edge is as deep as it is long, on what is bent goes with the square: four times is too deep.

    Neither depends on a scene; what is round has golden messages.
    """
    mesh = Box((0.01, 0.01, 0.01)).mesh("hex8", 0.01)
    case: Any = SimpleNamespace(shape=Box((0.01, 0.01, 0.01)), planar=False)
    touch: Any = SimpleNamespace(thing=SimpleNamespace(where=EVERYWHERE))
    assert _cell_size_remedy(case, touch, mesh, radius, 4.0).startswith(said)
