"""A ball of rubber that is blown up, and the laws of rubber that closed forms take."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from softmark.references.rubber_energies import KNOWN, Rubber
from softmark.references.rubber_inflation import BlownBall
from softmark.references.straight_cantilever import NotApplicable

# REFERENCES 3.5: the laws of its table, Pa, and Arruda-Boyce beside them
LAWS = {
    "mooney_rivlin": Rubber("mooney_rivlin", (("c1", 6e3), ("c2", 4e3))),
    "yeoh": Rubber("yeoh", (("c1", 10e3), ("c2", 500.0), ("c3", 10.0))),
    "ogden": Rubber("ogden", (("mu", (630e3, 1.2e3, -10e3)), ("alpha", (1.3, 5.0, -2.0)))),
    "gent": Rubber("gent", (("mu", 20e3), ("limit", 30.0))),
    "fung": Rubber("fung", (("mu", 20e3), ("b", 1.0))),
    "veronda_westmann": Rubber("veronda_westmann", (("c", 5e3), ("a", 2.0))),
    "arruda_boyce": Rubber("arruda_boyce", (("m", 20e3), ("limit", 2.8))),
}
# nominal stress in kPa, of Ogden in MPa, of a pull by 2 and of two directions by 1.5: six digits of the same table
PULLED = {
    "mooney_rivlin": (28.0, 41.0494), "yeoh": (42.42, 32.2483), "ogden": (602.722, 601.98), "gent": (37.5, 29.0076),
    "fung": (258.617, 149.432), "veronda_westmann": (1902.19, 785.179),
}  # fmt: skip


@pytest.mark.parametrize("law", PULLED)
def test_stresses_are_those_of_the_table(law: str) -> None:
    for t, free, known in ((2.0, -0.5, PULLED[law][0]), (1.5, -2.0, PULLED[law][1])):
        e = math.log(t) * (np.array([1.0, -0.5, -0.5]) if free == -0.5 else np.array([1.0, 1.0, -2.0]))
        tensions = LAWS[law].tensions(e[:, None])[:, 0]
        assert (tensions[0] - tensions[2]) / t == pytest.approx(1e3 * known, rel=6e-6)


@pytest.mark.parametrize("law", LAWS)
def test_tensions_are_slopes_of_the_energy(law: str) -> None:
    """Where the volume stays: dW = (t1 - t3) de of e1 and e3 = -e1; differences of second order in 1e-6."""
    e, h = np.array([[0.3], [-0.1], [-0.2]]), 1e-6 * np.array([[1.0], [0.0], [-1.0]])
    slope = (LAWS[law].energy(e + h) - LAWS[law].energy(e - h)) / 2e-6
    tensions = LAWS[law].tensions(e)
    assert slope == pytest.approx(tensions[0] - tensions[2], rel=1e-7)
    assert LAWS.keys() == set(KNOWN)


def ball(rubber: Rubber, pressure: float, outer: float = 0.02) -> BlownBall:
    return BlownBall(0.01, outer, rubber, 0.5, pressure, (0.0, 0.0, 0.0))


# REFERENCES 3.6: p/mu of a neo-Hookean ball with B = 2 A, and with c2: its part of the integral 4 c2 (s - 1/(2 s^2))
GROWN = {1.1: 0.2871548, 1.25: 0.5518685, 1.5: 0.7554331, 1.75: 0.8138508, 2.0: 0.8069266, 3.0: 0.6345067}


@pytest.mark.parametrize("stretch", GROWN)
def test_pressures_of_a_thick_ball(stretch: float) -> None:
    e, outer = np.array([math.log(stretch)]), (1.0 + (stretch**3 - 1.0) / 8.0) ** (1.0 / 3.0)
    assert ball(Rubber.neo_hookean(1.0), 1.0).at(e) == pytest.approx(GROWN[stretch], abs=6e-8)
    second = 4.0 * ((stretch - 0.5 / stretch**2) - (outer - 0.5 / outer**2))
    found = ball(Rubber("mooney_rivlin", (("c1", 0.5), ("c2", 0.3))), 1.0).at(e)
    assert found == pytest.approx(GROWN[stretch] + 0.3 * second, abs=1e-7)


def test_the_limit_of_a_thin_neo_hookean_ball() -> None:
    """A membrane has it at 7^(1/6), with .619731 * 2 mu T/R; at T/R = 1e-4, R the middle, it is that to 1e-4."""
    thin = BlownBall(0.99995, 1.00005, Rubber.neo_hookean(1.0), 0.5, 1e-5, (0.0, 0.0, 0.0))
    assert thin.limit is not None
    assert thin.limit[0] == pytest.approx(7.0 ** (1.0 / 6.0), rel=2e-4)
    assert thin.limit[1] == pytest.approx(0.619731 * 2e-4, rel=2e-4)


def test_past_its_limit_an_ogden_ball_is_found_where_the_pressure_rises_again() -> None:
    """By scipy's quadrature of W'(s)/(s^3 - 1) with W' by hand, its minimizer and its root finder."""
    mu, alpha = (630e3, 12e3, -10e3), (1.3, 5.0, -2.0)
    rubber = Rubber("ogden", (("mu", mu), ("alpha", alpha)))

    def pressure(t: float) -> float:
        def slope(s: float) -> float:
            each = (2.0 * m * (s ** (a - 1.0) - s ** (-2.0 * a - 1.0)) for m, a in zip(mu, alpha, strict=True))
            return float(sum(each))

        outer = (1.0 + (t**3 - 1.0) / 1.2**3) ** (1.0 / 3.0)
        return float(quad(lambda s: slope(s) / (s**3 - 1.0), outer, t, epsabs=0.0, epsrel=1e-12)[0])

    top = minimize_scalar(lambda t: -pressure(t), bounds=(1.2, 2.0), method="bounded", options={"xatol": 1e-9})
    known = ball(rubber, 110e3, 0.012)
    assert known.limit is not None
    assert known.limit[1] == pytest.approx(-top.fun, rel=1e-12)
    assert known.limit[0] == pytest.approx(top.x, rel=1e-6)
    assert known.stretch == pytest.approx(brentq(lambda t: pressure(t) - 110e3, 3.5, 6.0, xtol=1e-14), rel=1e-11)
    assert replace(known, pressure=107e3).stretch == pytest.approx(
        brentq(lambda t: pressure(t) - 107e3, 1.1, top.x, xtol=1e-14), rel=1e-9
    )
    assert 0.0 < known.estimated_error < 1e-12


def test_displacements_keep_the_volume() -> None:
    """r^3 - R^3 is the same everywhere, and the hollow opens by the stretch."""
    known = replace(ball(LAWS["gent"], 12e3), centre=(0.1, 0.0, -0.2))
    X = np.array([0.1, 0.0, -0.2]) + np.array([[0.01, 0.0, 0.0], [0.0, 0.012, 0.005], [0.0, 0.0, 0.02]])
    R = np.linalg.norm(X - known.centre, axis=1)
    r = np.linalg.norm(X + known.displacement(X) - known.centre, axis=1)
    assert r[0] / R[0] == pytest.approx(known.stretch, rel=1e-14)
    assert r**3 - R**3 == pytest.approx(np.full(3, r[0] ** 3 - R[0] ** 3), rel=1e-12)


def test_what_it_does_not_hold_for() -> None:
    soft = ball(Rubber.neo_hookean(20e3), 10e3)
    wrong: list[dict[str, Any]] = [{"poisson": 0.4999}, {"outer": 0.01}, {"pressure": -1.0}, {"pressure": math.nan}]
    for changes in wrong:
        with pytest.raises(NotApplicable):
            replace(soft, **changes)
    with pytest.raises(NotApplicable, match="no state has a pressure"):  # the limit is .814 mu
        replace(soft, pressure=17e3).opened  # noqa: B018
    with pytest.raises(NotApplicable, match="no closed form"):
        Rubber("st_venant_kirchhoff", ())
