"""Members that taper: closed forms that one segment meets, tones by Ritz's method, and sections between two."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

import softmark
from softmark.interpreter.verification.by_model.beam_forces_check import clenshaw_curtis
from softmark.solvers.mesh.cross_sections import Disc, Rectangle
from softmark.solvers.mesh.frame_shapes import Member, Network
from softmark.solvers.mesh.tubes import Annulus

E, G, RHO, L = 1e6, 1e6 / 2.6, 1000.0, 1.0  # Pa, kg/m^3, m
TEXT = """softmark 1
scene "tapers"
material gum = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body pole = network([(0, 0, 0), (1, 0, 0)] m, [(1, 2)], gum, {section})
support wall = fixed(pole, where = x <= 0 m)
probe end = point(pole, at = (1, 0, 0) m)
probe rim = point(pole, at = (1, 0, 0.005) m)
metric longer = displacement(end, along = +x)
metric sag = displacement(end, along = -z)
metric turned = displacement(rim, along = -y)
{more}"""
ROUND = "radius = 20 mm, end_radius = {end} mm"


def run(section: str, more: str) -> Any:
    """The model `m`, whose forces other formulas find as well."""
    model = softmark.loads(TEXT.format(section=section, more=more)).run().models["m"]
    assert model.status == "converged", model.message
    assert model.solve["checks"]["residual"] is not None
    return model


@pytest.mark.parametrize("segments", [1, 3])
@pytest.mark.parametrize("end", [10, 2, 40])
def test_a_cone_that_is_pulled_and_twisted(segments: int, end: int) -> None:
    """P L / (pi E a b) and 2 T L (a^2 + a b + b^2) / (3 pi G a^3 b^3), however few its segments: 1e-5, of second order.

    To a tenth of its width, and to twice that.
    """
    a, b = 0.02, 1e-3 * end
    more = f"""load pull = point_force(pole, at = (1, 0, 0) m, vector = (1, 0, 0) mN)
load turn = torque(pole, where = x >= 1 m, moment = (1e-9, 0, 0) N*m)
model m = frame6dof(segments = {segments})
"""
    probe = TEXT.replace("0.005", f"{0.5 * b:g}")
    model = softmark.loads(probe.format(section=ROUND.format(end=end), more=more)).run().models["m"]
    assert model.status == "converged", model.message
    longer, turn = 1e-3 / (math.pi * E * a * b), 2e-9 * (a * a + a * b + b * b) / (3.0 * math.pi * G * a**3 * b**3)
    assert model.metrics["longer"].value == pytest.approx(longer, rel=1e-5)
    assert model.metrics["turned"].value == pytest.approx(0.5 * b * turn, rel=1e-5)


def test_a_wedge_that_is_pulled() -> None:
    """Sides from 20 x 40 to 10 x 10 mm: P / E times the integral of 1 / ((20 - 10 t) (40 - 30 t)), to 1e-6.

    1 / ((2 - t) (4 - 3 t)) = (3 / (4 - 3 t) - 1 / (2 - t)) / 2, whose integral over (0, 1) is (ln 4 - ln 2) / 2.
    """
    load = "load pull = point_force(pole, at = (1, 0, 0) m, vector = (1, 0, 0) mN)\nmodel m = frame6dof(segments = 2)\n"
    model = run("side = 20 mm, end_side = 10 mm, height = 40 mm, end_height = 10 mm", load)
    assert model.metrics["longer"].value == pytest.approx(1e-3 / E * 1e4 * 0.5 * math.log(2.0), rel=1e-6)


def test_a_cone_that_is_bent() -> None:
    """4 P L^3 / (3 pi E a^3 b), of second order in the length of segments; shear adds 0.04 %."""
    off = []
    for segments in (8, 16, 32):
        load = f"""load push = point_force(pole, at = (1, 0, 0) m, vector = (0, 0, -1) uN)
model m = frame6dof(segments = {segments})
"""
        kappa = 6.0 * 1.3 / (7.0 + 6.0 * 0.3)
        sag = 4e-6 / (3.0 * math.pi * E * 0.02**3 * 0.01) + 1e-6 / (kappa * G * math.pi * 0.02 * 0.01)
        off.append(abs(run(ROUND.format(end=10), load).metrics["sag"].value / sag - 1.0))
    assert off[2] < 1e-3
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)
    assert off[1] / off[2] == pytest.approx(4.0, rel=0.1)


def _ritz(a: float, b: float, count: int = 8) -> np.ndarray:
    """Of Bernoulli's cantilever whose radius goes from a to b, tones in Hz, by x^2 ... x^(count + 1)."""
    x, w = np.polynomial.legendre.leggauss(40)
    t, w = 0.5 * (1.0 + x), 0.5 * w
    r, k = a + (b - a) * t, np.arange(2, 2 + count)
    shapes, bent = t[:, None] ** k, k * (k - 1) * t[:, None] ** (k - 2)
    K = E * (bent.T * (w * math.pi * r**4 / 4.0)) @ bent
    M = RHO * (shapes.T * (w * math.pi * r**2)) @ shapes
    scale = 1.0 / np.sqrt(np.diag(K))
    values = eigh(K * np.outer(scale, scale), M * np.outer(scale, scale), eigvals_only=True)
    return np.asarray(np.sqrt(values) / (2.0 * math.pi))


def test_the_tones_of_a_cone() -> None:
    """A mast whose end is half as wide: 4.62515 in units of the wall's; shear takes 0.13 %, segments 0.1 %."""
    a = 0.02
    exact = _ritz(a, 0.5 * a)
    unit = math.sqrt(E / RHO) * 0.5 * a / (2.0 * math.pi)
    assert exact[0] / unit == pytest.approx(4.62515, abs=1e-5)  # the number of the scene
    load = "load push = point_force(pole, at = (1, 0, 0) m, vector = (0, 0, -1) uN)\n"
    load += "metric tones = frequency(pole, mode = 4)\n"
    model = run(ROUND.format(end=10), load + "model m = frame6dof(segments = 40)\n")
    found = model.metrics["tones"].details["frequencies_Hz"]
    assert found[0] == pytest.approx(exact[0], rel=3e-3)
    assert found[2] == pytest.approx(exact[1], rel=1e-2)


def test_its_weight_is_that_of_its_volume() -> None:
    """rho g pi L (a^2 + a b + b^2) / 3, and its moment about the wall, exactly."""
    a, b = 0.02, 0.01
    model = run(ROUND.format(end=10), "load weight = gravity(1e-6 m/s^2)\nmodel m = frame6dof(segments = 3)\n")
    load = model.loads["weight"]
    weight = 1e-6 * RHO * math.pi * (a * a + a * b + b * b) / 3.0
    moment = 1e-6 * RHO * math.pi * (a * a / 2.0 + 2.0 * a * (b - a) / 3.0 + (b - a) ** 2 / 4.0)
    np.testing.assert_allclose(load.force, [0.0, 0.0, -weight], rtol=1e-12)
    assert load.share == pytest.approx(1.0, abs=1e-12)
    assert load.moment[1] == pytest.approx(moment, rel=1e-12)  # hat functions add up to x
    assert model.reactions["wall"].reaction.force[2] == pytest.approx(weight, rel=1e-8)


@pytest.mark.parametrize(("ends", "middle"), [
    ((Disc(2.0), Disc(1.0)), Disc(1.5)),
    ((Annulus(2.0, 1.0), Annulus(1.0, 0.5)), Annulus(1.5, 0.75)),
    ((Rectangle(2.0, 1.0), Rectangle(1.0, 3.0)), Rectangle(1.5, 2.0)),
], ids=["disc", "ring", "rectangle"])  # fmt: skip
def test_sections_between_two(ends: Any, middle: Any) -> None:
    """Extents go linearly, bounds hold all of it, and its volume is that of a fine sum."""
    member = Member((0.0, 0.0, 0.0), (0.0, 0.0, 10.0), ends)
    assert member.section_at(5.0) == middle
    fine = np.linspace(0.0, 10.0, 2001)
    areas = [member.section_at(s).area for s in fine.tolist()]
    assert member.volume == pytest.approx(float(np.trapezoid(areas, fine)), rel=1e-6)
    low, high = member.bounds_between(0.0, 10.0)
    for s in (0.0, 3.0, 10.0):
        assert all(a - 1e-12 <= b for a, b in zip(low, member.bounds_between(s, s)[0], strict=True))
        assert all(a + 1e-12 >= b for a, b in zip(high, member.bounds_between(s, s)[1], strict=True))
    u, v = (0.5 * extent for extent in middle.extents)
    _, first, second = member.frame(0.0)
    for way, extent in ((first, u), (second, v)):
        at = [5.0 * (i == 2) for i in range(3)]
        inside, outside = ([p + c * extent * w for p, w in zip(at, way, strict=True)] for c in (0.999, 1.001))
        assert member.contains(tuple(inside))
        assert not member.contains(tuple(outside))


def test_a_square_stays_square() -> None:
    """Without a height both extents are the side's, at both ends."""
    net = Network(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), ((1, 2),), side=(2.0,), end_side=(1.0,))
    assert net.members[0].ends == (Rectangle(2.0, 2.0), Rectangle(1.0, 1.0))


def test_the_other_rule_is_one() -> None:
    """Clenshaw and Curtis: exact for x^16 with 17 places."""
    places, weights = clenshaw_curtis(16)
    assert weights @ places**16 == pytest.approx(1.0 / 17.0, rel=1e-14)
