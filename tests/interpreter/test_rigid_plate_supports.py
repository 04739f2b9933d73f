"""Rigid plates without friction: `rigid_plate(...)`.

A block on a plane without friction under a level plate is in uniaxial stress wherever it is pressed: it sinks by
F H / (E A), for its stress is the same everywhere and nothing else balances a plate that cannot tilt. The plate's
springs leave some 1e-5 of it uneven.
"""

from __future__ import annotations

import pytest

import softmark
from softmark.interpreter.models.shared import foundation_setup

BLOCK = """
material gum   = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar   = solid(box(size = (20, 10, 10) mm), gum)
support  below = fixed(bar, where = z <= 0 mm, components = z)
support  left  = fixed(bar, where = x <= 0 mm, components = x)
support  front = fixed(bar, where = y <= 0 mm, components = y)
support  plate = rigid_plate(bar, where = z >= 10 mm)
load     push  = traction(bar, where = z >= 10 mm and x <= 5 mm, vector = (0, 0, -1) kPa)
model    cells = fem(ELEMENT, strain = STRAIN, size = 5 mm)
probe    near  = point(bar, at = (0, 0, 10) mm)
probe    far   = point(bar, at = (20, 10, 10) mm)
metric   sunk  = displacement(near, along = -z)
metric   down  = displacement(far, along = -z)
metric   foot  = force(below, along = +z)
"""
RING = """
material gum   = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar   = axisymmetric(quadrilateral(first = (0, 0, 0) mm, second = (20, 0, 0) mm, third = (20, 10, 0) mm,
    fourth = (0, 10, 0) mm), gum)
support  below = fixed(bar, where = y <= 0 mm, components = y)
support  plate = rigid_plate(bar, where = y >= 10 mm)
load     push  = traction(bar, where = y >= 10 mm and x <= 10 mm, vector = (0, -1, 0) kPa)
model    cells = fem(quad8, strain = small, size = 5 mm)
probe    near  = point(bar, at = (0, 10, 0) mm)
probe    far   = point(bar, at = (20, 10, 0) mm)
metric   sunk  = displacement(near, along = -y)
metric   down  = displacement(far, along = -y)
metric   foot  = force(below, along = +y)
"""


def block(element: str = "hex8", strain: str = "small") -> str:
    return BLOCK.replace("ELEMENT", element).replace("STRAIN", strain)


def measured(text: str):
    own = softmark.loads("softmark 1\n" + text).run().models["cells"]
    assert own.status == "converged", own.message
    return own


@pytest.mark.parametrize("element", ["hex8", pytest.param("tet10", marks=pytest.mark.slow)])
def test_a_block_sinks_evenly_wherever_it_is_pressed(element: str) -> None:
    """50 mN over 200 mm^2: 250 Pa, 2.5 um of 10 mm."""
    own = measured(block(element))
    for metric in ("sunk", "down"):
        assert own.metrics[metric].value == pytest.approx(2.5e-6, rel=3e-5)
    assert own.metrics["foot"].value == pytest.approx(50e-3, rel=1e-9)
    assert own.solve["checks"]["residual"] < 1e-8


def test_so_does_a_disc() -> None:
    """A quarter of the section is pressed by 1 kPa: 250 Pa again."""
    own = measured(RING)
    for metric in ("sunk", "down"):
        assert own.metrics[metric].value == pytest.approx(2.5e-6, rel=3e-5)


def test_a_plate_stays_level_at_finite_strain() -> None:
    """200 Pa on a gel of 1 kPa, pressed on one side: neo-Hookean, nearly a fifth; sides alike to 3e-5 of it."""
    text = block("hex8", "finite").replace("linear_elastic(young = 1 MPa", "neo_hookean(young = 1 kPa")
    own = measured(text.replace("(0, 0, -1) kPa", "(0, 0, -0.8) kPa"))
    sunk, down = (own.metrics[m].value for m in ("sunk", "down"))
    assert sunk > 1.5e-3
    assert down == pytest.approx(sunk, rel=3e-5)


def test_the_watchdog_finds_a_plate_whose_springs_are_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    right = foundation_setup.SurfaceSprings.plane_keeping_springs

    def wrong(*given):
        own = right(*given)
        return type(own)(own.facets, 1.01 * own.K, along=own.along)

    monkeypatch.setattr(foundation_setup.SurfaceSprings, "plane_keeping_springs", wrong)
    own = softmark.loads("softmark 1\n" + block()).run().models["cells"]
    assert own.status == "failed"
    assert "independent formulas" in own.message


@pytest.mark.slow
def test_a_disc_of_cartilage_creeps_under_a_plate() -> None:
    """Armstrong's creep, by the theory of the scene: travel and bulge within 2 % of a mesh of 6 by 2 cells."""
    text = """
material soil  = biphasic(linear_elastic(young = 1 MPa, poisson = 0.2, density = 1000 kg/m^3),
    permeability = 1e-13 m^4/(N*s))
body     bar   = axisymmetric(quadrilateral(first = (0, 0, 0) mm, second = (6, 0, 0) mm, third = (6, 2, 0) mm,
    fourth = (0, 2, 0) mm), soil)
support  below = fixed(bar, where = y <= 0 mm, components = y)
support  plate = rigid_plate(bar, where = y >= 2 mm)
support  side  = drained(bar, where = x >= 6 mm)
load     push  = traction(bar, where = y >= 2 mm, vector = (0, -1, 0) kPa)
analysis wait  = quasistatic(duration = 200 s, step = 8 s, times = [40, 100, 200] s)
model    cells = fem(quad9, strain = small, size = 1 mm)
reference told = unconfined(bar)
probe    top   = point(bar, at = (6, 2, 0) mm)
metric   off   = tip_error(top, against = told)
metric   sunk  = displacement(top, along = -y)
metric   left  = outflow(side, against = told)
metric   kept  = strain_energy(bar, against = told)
metric   held  = force(below, along = +y, against = told)
"""
    own = measured(text)
    for off, sunk, left in zip(*(own.curve(m).values for m in ("off", "sunk", "left")), strict=True):
        assert off < 2e-2 * sunk
        assert left < 2e-2
    assert own.metrics["kept"].reason == "`told` has no such value"
    assert own.metrics["held"].value < 1e-9
