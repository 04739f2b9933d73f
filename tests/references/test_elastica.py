"""The large-deflection beam against tables, identities and an independent method."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

from softmark.references.beam_centre_line import CentreLine
from softmark.references.elastica import Elastica
from softmark.references.elastica_collocation import NotSolved
from softmark.references.straight_cantilever import Cantilever

Loaded = Callable[..., Cantilever]


def solve(beam: Cantilever) -> CentreLine:
    return Elastica(body=None).solve(beam)


def end_slope(line: CentreLine) -> float:
    """The rotation of the free end's section, rad."""
    return float(line.rotation(np.array([line.cantilever.length]))[0])


def tip(line: CentreLine) -> tuple[float, float]:
    """Where the tip comes to rest, along the axis and along gravity, m."""
    L = np.array([line.cantilever.length])
    return float(L[0] + line.axial(L)[0]), float(line.transverse(L)[0])


# k, x_tip / L, y_tip / L, tip slope (degrees), root curvature times L: REFERENCES 3.4, computed there by
# another program. Tolerances below are half a unit of the last printed digit. The row of the silicone beam
# is printed with k = 10.932374, and was computed, says references.json, at 10.9323737.
TABLE = [
    (0.1, 0.999911, 0.012498, 0.9548, 0.049997),
    (0.5, 0.997779, 0.062306, 4.7634, 0.249611),
    (1, 0.991246, 0.123471, 9.4604, 0.496933),
    (2, 0.966893, 0.238507, 18.4260, 0.976743),
    (5, 0.846657, 0.495905, 39.9354, 2.226893),
    (8, 0.724425, 0.640631, 53.8650, 3.201576),
    (10, 0.656354, 0.700200, 60.3120, 3.742191),
    (10.9323737, 0.628384, 0.721626, 62.7739, 3.972173),
    (15, 0.529566, 0.786043, 70.7501, 4.856057),
    (20, 0.445232, 0.829881, 76.7478, 5.761533),
    (50, 0.245015, 0.907917, 87.4593, 9.528469),
    (100, 0.159223, 0.937524, 89.6167, 13.693239),
]


@pytest.mark.parametrize(("k", "x", "y", "degrees", "curvature"), TABLE)
def test_table_of_the_self_weight_elastica(
    loaded: Loaded, k: float, x: float, y: float, degrees: float, curvature: float
) -> None:
    line = solve(loaded(k))
    assert tip(line) == pytest.approx((x, y), abs=5.1e-7)
    assert math.degrees(end_slope(line)) == pytest.approx(degrees, abs=5.1e-5)
    assert line.root_curvature == pytest.approx(curvature, abs=5.1e-7)


# s, x, down (m), slope (degrees) of the recovered silicone beam: REFERENCES 1.3.
CENTRE_LINE = [
    (0.0, 0.0, 0.0, 0.0),
    (0.0178, 0.017423, 0.003188, 19.7640),
    (0.0356, 0.033185, 0.011356, 34.2377),
    (0.0534, 0.046862, 0.022711, 44.5555),
    (0.0712, 0.058679, 0.036006, 51.7301),
    (0.089, 0.069060, 0.050459, 56.5606),
    (0.1068, 0.078431, 0.065591, 59.6535),
    (0.1246, 0.087154, 0.081106, 61.4730),
    (0.1424, 0.095512, 0.096821, 62.3908),
    (0.1602, 0.103706, 0.112623, 62.7261),
    (0.178, 0.111852, 0.128449, 62.7739),
]


@pytest.mark.parametrize(("s", "x", "down", "degrees"), CENTRE_LINE)
def test_centre_line_of_the_silicone_beam(
    silicone_beam: Cantilever, s: float, x: float, down: float, degrees: float
) -> None:
    # Printed to 1 micrometre and 1e-4 degrees, hence half of that.
    line = solve(silicone_beam)
    u = line.displacement(np.array([[s, 0.0, 0.0]]))[0]
    np.testing.assert_allclose(u, [x - s, 0, -down], atol=5.1e-7)
    assert math.degrees(line.rotation(np.array([s]))[0]) == pytest.approx(degrees, abs=5.1e-5)


def test_tip_of_the_silicone_beam_to_all_stored_digits(silicone_beam: Cantilever) -> None:
    # references.json, seed_case_elastica, another program's shooting: agreement to 1e-11 m says that both
    # are right to that, so the 1e-8 promised here has room.
    assert tip(solve(silicone_beam)) == pytest.approx((0.11185239521246813, 0.12844934883944195), abs=1e-11)


@pytest.mark.parametrize("k", [1e-12, 1e-6, 1e-3, 0.1, 1, 10, 100, 1e3, 1e4, 1e5])
def test_energy_identity(loaded: Loaded, k: float) -> None:
    # Multiply phi'' = -k (1 - s) cos(phi) by phi' and integrate over the beam, by parts: phi'(0)^2 = 2 k
    # y_tip. Exact for the exact solution; 1e-8 is the accuracy promised, and 1e-12 what the method keeps.
    line = solve(loaded(k))
    assert line.root_curvature**2 == pytest.approx(2 * k * tip(line)[1], rel=1e-12)


@pytest.mark.parametrize("k", [1e-6, 1e-3, 0.1, 1, 10, 100, 1e3])
def test_estimated_error_is_small(loaded: Loaded, k: float) -> None:
    # The promise is 1e-8 relative to the deflection; the resolution is doubled until 1e-10.
    line = solve(loaded(k))
    assert 0 < line.estimated_error < 1.1e-10 * max(tip(line)[1], end_slope(line))


@pytest.mark.parametrize("k", [0.1, 1, 10.932370234238226, 100, 1000])
def test_taylor_series_from_the_tip_agrees(loaded: Loaded, k: float) -> None:
    # An independent method (below), accurate to a few roundings: doubling its steps changes it by less than
    # 1e-15. The difference must be within the error that the solution claims for itself, plus 1e-14 for that.
    line = solve(loaded(k))
    x, y = taylor_centre_line(k)  # at 81 equal stations
    s = np.linspace(0, 1, len(x))
    assert np.abs(s + line.axial(s) - x).max() < line.estimated_error + 1e-14
    assert np.abs(line.transverse(s) - y).max() < line.estimated_error + 1e-14


def test_small_loads_give_the_small_deflection(loaded: Loaded) -> None:
    # v_tip = k/8 to first order. The axial displacement is -1/2 integral of (k/6 (1 - (1-s)^3))^2 = -k^2/112.
    # At k = 1e-6 the next terms are 1e-12 relative; 1e-11 leaves room for rounding.
    line = solve(loaded(1e-6))
    one = np.array([1.0])
    assert line.transverse(one)[0] == pytest.approx(1e-6 / 8, rel=1e-11)
    assert line.axial(one)[0] == pytest.approx(-1e-12 / 112, rel=1e-11)


def test_next_to_no_load_is_no_special_case(loaded: Loaded) -> None:
    # v_tip = k/8, with nothing of higher order left in double precision.
    assert tip(solve(loaded(1e-200)))[1] == pytest.approx(1e-200 / 8, rel=1e-12)


def test_departure_from_small_deflection_is_of_second_order(loaded: Loaded) -> None:
    # v_tip = k/8 (1 - c k^2 + O(k^4)): halving k divides the relative difference by 4, up to O(k^2) = 4e-4
    # of it at k = 0.02 (times a constant of order one).
    excess = [1 - tip(solve(loaded(k)))[1] / (k / 8) for k in (0.02, 0.01)]
    assert excess[0] / excess[1] == pytest.approx(4, rel=1e-3)


def test_heavy_beam_hangs(loaded: Loaded) -> None:
    # For large k the root bends with curvature sqrt(2 k), as under an end load w L, and below it the beam
    # hangs straight; the first correction is of order 1/sqrt(k) = 0.3 % at k = 1e5.
    line = solve(loaded(1e5))
    assert line.root_curvature == pytest.approx(math.sqrt(2e5), rel=3e-3)
    assert end_slope(line) == pytest.approx(math.pi / 2, abs=line.estimated_error)


def test_says_so_when_it_is_not_solved(loaded: Loaded) -> None:
    # At k = 1e12 the root bends within 1e-6 of the length, which 512 points do not resolve to 1e-10.
    with pytest.raises(NotSolved, match="load parameter 1e") as caught:
        solve(loaded(1e12))
    assert caught.value.history[-1] > 1e-10


def taylor_centre_line(k: float, steps: int = 80) -> tuple[list[float], list[float]]:
    """Centre line at equal stations, by Taylor series from the tip.

    With t = 1 - s and theta = pi/2 - phi, theta'' = k t sin(theta), theta'(0) = 0, and theta(1) = pi/2 fixes
    the logarithm of theta(0). Only growing solutions leave the tip, so the shot is stable for every k. The
    series converge within about pi / (2 sqrt(k)), 0.05 at k = 1000: a step of 1/80 leaves 4^-22 of the first
    term.
    """
    log_tip = brentq(lambda q: taylor_shot(k, q, steps)[0] - math.pi / 2, -34.0, math.log(1.5705), xtol=1e-15)
    _, right, below = taylor_shot(k, log_tip, steps)
    x = [right[-1] - r for r in reversed(right)]
    y = [below[-1] - b for b in reversed(below)]
    return x, y


def taylor_shot(k: float, log_tip: float, steps: int) -> tuple[float, list[float], list[float]]:
    """theta at the root, and the distances from the tip along the axis and gravity after each step."""
    theta, rate, h = math.exp(log_tip), 0.0, 1 / steps
    right, below = [0.0], [0.0]
    for i in range(steps):
        th, sin, cos = taylor_series(k, i * h, theta, rate)
        powers = [h**n for n in range(len(th))]
        theta = math.fsum(a * p for a, p in zip(th, powers, strict=True))
        rate = math.fsum(n * th[n] * powers[n - 1] for n in range(1, len(th)))
        right.append(right[-1] + math.fsum(sin[n] * powers[n] * h / (n + 1) for n in range(len(sin))))
        below.append(below[-1] + math.fsum(cos[n] * powers[n] * h / (n + 1) for n in range(len(cos))))
    return theta, right, below


def taylor_series(
    k: float, t: float, theta: float, rate: float, order: int = 22
) -> tuple[list[float], list[float], list[float]]:
    """Coefficients of theta, sin(theta) and cos(theta) about t, from the recurrences of sine and cosine."""
    th, sin, cos = [theta, rate], [math.sin(theta)], [math.cos(theta)]
    for n in range(order - 1):
        if n:
            sin.append(math.fsum(j * th[j] * cos[n - j] for j in range(1, n + 1)) / n)
            cos.append(-math.fsum(j * th[j] * sin[n - j] for j in range(1, n + 1)) / n)
        th.append(k * (t * sin[n] + (sin[n - 1] if n else 0.0)) / ((n + 1) * (n + 2)))
    return th, sin, cos
