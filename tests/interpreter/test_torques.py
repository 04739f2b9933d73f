"""Torques, eccentric forces and lines of force in scenes: against closed forms, and found again by other formulas."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import softmark

BAR = """softmark 1
scene "turned by forces"
material gel = neo_hookean(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (200, 10, 10) mm, origin = (0, -5, -5) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
probe tip = point(bar, at = (200, 0, 0) mm)
metric away = displacement(tip, along = +z)
"""
BLOCK = """softmark 1
scene "turned by forces"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid({shape}, gel)
support wall = fixed(bar, where = x <= 0 mm)
load twist = torque(bar, where = {where}, moment = ({moment}) mN*m)
probe tip = point(bar, at = (20, 0, 0) mm)
metric away = displacement(tip, along = +y)
metric root = moment(wall, along = -x, about = (0, 0, 0) mm)
metric pull = force(wall, along = +x)
"""
MORE = """model tets = fem(tet10, strain = corotational, size = 5 mm)
model line = fem(hex20, strain = small, size = 5 mm)
"""
EI = 1e6 * 0.01**4 / 12.0


def run(text: str) -> dict[str, Any]:
    report = softmark.loads(text).run()
    assert {n: m.message for n, m in report.models.items() if m.status != "converged"} == {}
    for name, model in report.models.items():
        balance = model.solve["checks"]["reactions"]
        assert balance["force"] <= 1e-8, name
        assert balance["moment"] <= 1e-8, name
        assert balance["apart"] <= 1e-8, name
        assert model.solve["checks"]["residual"] is not None, name
    return dict(report.models)


def test_an_end_moment_rolls_a_beam_up() -> None:
    """M = 2 pi E I / L: a circle, which a rod of straight segments closes exactly; half of it: (0, 2 L / pi) above."""
    both = BAR + f"load roll = torque(bar, where = x >= 200 mm, moment = (0, {-math.pi * EI / 0.2}, 0) N*m)\n"
    half = run(both + "model rod = beam6dof(segments = 40)")["rod"]
    assert half.probes["tip"].displacement[0] == pytest.approx([-0.2, 0.0, 0.4 / math.pi], rel=1e-3, abs=1e-9)
    assert half.loads["roll"].to_json() == {
        "force": [0.0, 0.0, 0.0], "moment": pytest.approx([0.0, -math.pi * EI / 0.2, 0.0]), "area": pytest.approx(1e-4),
        "exact_force": [0.0, 0.0, 0.0], "share": 1.0, "remainder": 0.0, "leaning": 0.0,
        "exact_moment": pytest.approx([0.0, -math.pi * EI / 0.2, 0.0]),
    }  # fmt: skip
    whole = run(
        both.replace(f"{-math.pi * EI / 0.2}", f"{-2 * math.pi * EI / 0.2}") + "model rod = beam6dof(segments = 20)"
    )
    assert whole["rod"].probes["tip"].displacement[0] == pytest.approx([-0.2, 0.0, 0.0], abs=1e-9)
    back = BAR.replace("x <= 0 mm", "x >= 200 mm").replace("at = (200", "at = (0")
    back += f"load roll = torque(bar, where = x <= 0 mm, moment = (0, {2 * math.pi * EI / 0.2}, 0) N*m)\n"
    there = run(back + "model rod = beam6dof(segments = 20)")["rod"]
    assert there.probes["tip"].displacement[0] == pytest.approx([0.2, 0.0, 0.0], abs=1e-9)


def eccentric(P: float, e: float) -> tuple[float, float]:
    """Where the end of an inextensible strut comes under P along -x at e above its end: phi'' = -k^2 sin phi.

    phi is the slope; M = P (height of the force over a section). Collocation of its own.
    """
    from scipy.integrate import solve_bvp

    k2 = P / EI

    def slopes(s: Any, y: Any) -> Any:
        return np.stack([y[1], -k2 * np.sin(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: Any, b: Any) -> Any:
        return np.array([a[0], a[2], a[3], b[1] - k2 * e * np.cos(b[0])])

    s = np.linspace(0.0, 0.2, 201)
    start = np.stack([2.0 * s, 2.0 + 0.0 * s, s, s**2])
    found = solve_bvp(slopes, ends, s, start, tol=1e-10, max_nodes=100000)
    assert found.success
    return float(found.y[2, -1]) - 0.2, float(found.y[3, -1])


@pytest.mark.slow
def test_an_eccentric_force_turns_with_its_section() -> None:
    """Pressed beside its axis by half of Euler's load and more, an elastica whose end carries an arm.

    The rod is of second order in 60 segments: 0.2 %.
    """
    P = 0.8 * math.pi**2 * EI / (4 * 0.2**2)
    text = BAR + f"load press = point_force(bar, at = (200, 0, 4) mm, vector = ({-P}, 0, 0) N)\n"
    found = run(text + "model rod = beam6dof(segments = 60, shear = no, axial = no)")["rod"]
    along, above = eccentric(P, 4e-3)
    assert above > 0.015
    assert found.probes["tip"].displacement[0] == pytest.approx([along, 0.0, above], rel=2e-3, abs=1e-9)
    assert found.loads["press"].moment == pytest.approx([0.0, -P * 4e-3, 0.0])
    assert found.loads["press"].exact_moment == pytest.approx([0.0, -P * 4e-3, 0.0])


def test_an_arm_gets_a_node_and_a_line_its_exact_share() -> None:
    """A force beside the axis at 77 mm, and a line from 33 to 77 mm: the root carries what statics says."""
    text = (
        BAR.replace("1 MPa", "100 MPa")
        + """load side = point_force(bar, at = (77, 3, -2) mm, vector = (1, 2, 3) mN)
load rain = line_load(bar, from = (77, 0, 0) mm, to = (33, 0, 0) mm, vector = (0, 0, -0.1) N/m)
metric first = moment(wall, along = -x, about = (0, 0, 0) mm)
metric second = moment(wall, along = -y, about = (0, 0, 0) mm)
model rod = beam6dof(segments = 7)
"""
    )
    rod = run(text)["rod"]
    assert rod.loads["rain"].force == pytest.approx([0.0, 0.0, -4.4e-3], abs=1e-18)
    assert rod.loads["rain"].length == pytest.approx(0.044)
    assert rod.loads["rain"].moment == pytest.approx([0.0, 4.4e-3 * 0.055, 0.0], abs=1e-18)
    assert rod.loads["rain"].exact_moment == pytest.approx(rod.loads["rain"].moment, abs=1e-18)
    own = np.cross([0.077, 0.003, -0.002], [1e-3, 2e-3, 3e-3])
    assert rod.loads["side"].moment == pytest.approx(own, abs=1e-18)
    size = float(np.linalg.norm(own))
    assert rod.metrics["first"].value == pytest.approx(own[0], abs=3e-3 * size)  # the section sinks by some um
    assert rod.metrics["second"].value == pytest.approx(own[1] + 4.4e-3 * 0.055, abs=1e-3 * size)


@pytest.mark.parametrize(
    ("shape", "where", "more"),
    [
        ("box(size = (20, 10, 10) mm, origin = (0, -5, -5) mm)", "x >= 20 mm and y + z >= 1 mm", ""),
        pytest.param("cylinder(length = 20 mm, radius = 5 mm)", "x >= 20 mm", MORE, marks=pytest.mark.slow),
    ],
)
def test_a_torque_on_a_solid_stays_what_it_is(shape: str, where: str, more: str) -> None:
    """On a face and on a part of one, straight and curved facets: its moment at the root, and no force.

    To 1e-8, where the part turns by more than 20 degrees; forces and reactions are found again point by point.
    """
    text = BLOCK.format(shape=shape, where=where, moment="1, 0.2, 0.1")
    models = run(f"{text}model hexes = fem(hex8, strain = finite, size = 5 mm)\n{more}")
    for name, model in models.items():
        assert model.metrics["root"].value == pytest.approx(1e-3, rel=1e-7), name
        assert abs(model.metrics["pull"].value) < 1e-9
        assert model.loads["twist"].moment == pytest.approx([1e-3, 2e-4, 1e-4], abs=1e-15)
        assert np.linalg.norm(model.loads["twist"].force) < 1e-15


@pytest.mark.slow
def test_the_twist_of_a_cylinder() -> None:
    """T L / (G J), of small strain exact in three dimensions: of 48 hexahedra 0.3 %; and a beam's."""
    text = BLOCK.format(shape="cylinder(length = 20 mm, radius = 5 mm)", where="x >= 20 mm", moment="0.01, 0, 0")
    text += """probe rim = point(bar, at = (20, 0, 5) mm)
metric side = displacement(rim, along = -y)
model bricks = fem(hex20, strain = small, size = 4 mm)
model rod = beam6dof(segments = 4)
"""
    due = 5e-3 * 1e-5 * 0.02 / (60e3 / 2.6 * 0.5 * math.pi * 5e-3**4)
    for model in run(text).values():
        assert model.metrics["side"].value == pytest.approx(due, rel=3e-3)
