"""The theory of a bar that relaxes, against tables of the standard linear solid and against quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from softmark.references.prony import Amplitude, HarmonicAmplitudeSegment, RelaxingBar
from softmark.references.straight_cantilever import NotApplicable

ONCE = Amplitude([(0.0, 1.0)], [])


def bar(driven: Amplitude, now: float, force: bool = False, g=(0.3, 0.2), tau=(1.0, 10.0)) -> RelaxingBar:
    """A unit bar of unit stiffness, by an amount of one."""
    return RelaxingBar(1.0, 1.0, (0, 0, 0), (1, 0, 0), (0, 0, 0), 1.0, 0.3, g, tau, force, 1.0, driven, now)


def test_creep_of_zeners_solid() -> None:
    """J = (1 - g exp(-(1 - g) t / tau)) / (1 - g)."""
    for t in (0.0, 0.5, 2.0, 20.0):
        own = bar(ONCE, t, force=True, g=(0.5,), tau=(1.0,)).strain_at(t)
        assert own == pytest.approx(2.0 - math.exp(-0.5 * t), rel=1e-12)


def test_a_ramp_and_a_hold() -> None:
    driven = Amplitude([], [HarmonicAmplitudeSegment(0.0, 1.0, 0.1)])
    known = {0.5: 0.046558, 1.0: 0.087996, 2.0: 0.074198, 5.0: 0.063105, 20.0: 0.052847}
    for t, stress in known.items():
        assert bar(driven, t).pull == pytest.approx(stress, abs=1e-6)


def test_a_swing_against_quadrature_and_an_equation_of_its_branches() -> None:
    w, t = 2.0, 3.3
    driven = Amplitude([], [HarmonicAmplitudeSegment(0.0, t, w, w)])  # sin(w t)
    own = bar(driven, t)
    left = quad(lambda s: w * math.cos(w * s) * (0.5 + 0.3 * math.exp(s - t) + 0.2 * math.exp(0.1 * (s - t))), 0.0, t)
    assert own.pull == pytest.approx(left[0], rel=1e-10)

    def branches(s: float, y):  # stress of both, and what is dissipated
        rate = w * math.cos(w * s)
        a, b = y[0], y[1]
        return [0.3 * rate - a, 0.2 * rate - 0.1 * b, a * a / 0.3 + b * b / (0.2 * 10.0)]

    end = solve_ivp(branches, (0.0, t), [0.0, 0.0, 0.0], rtol=1e-11, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(own.branches_at(t), end[:2], rtol=1e-8)
    assert own.dissipated == pytest.approx(end[2], rel=1e-8)


@pytest.mark.parametrize("force", [False, True])
def test_work_is_what_is_stored_and_what_is_dissipated(force: bool) -> None:
    driven = Amplitude(
        [(0.0, 0.3)], [HarmonicAmplitudeSegment(0.5, 2.0, 0.4), HarmonicAmplitudeSegment(2.0, 6.0, -0.1 + 0.2j, 1.5)]
    )
    t = 7.0
    own = bar(driven, t, force)
    h = 1e-4
    at = [own.strain_at(0.0), own.stress_at(0.0)]
    work = 0.5 * at[0] * at[1]  # at once
    grid = np.arange(0.0, t + 0.5 * h, 20 * h)
    strain = np.array([own.strain_at(s) for s in grid])
    stress = np.array([own.stress_at(s) for s in grid])
    work += float((0.5 * (stress[1:] + stress[:-1]) * np.diff(strain)).sum())
    assert own.stored + own.dissipated == pytest.approx(work, rel=1e-5)


def test_what_flows_under_a_force_is_refused() -> None:
    with pytest.raises(NotApplicable, match="flows"):
        bar(ONCE, 1.0, force=True, g=(1.0,), tau=(1.0,))


@pytest.mark.parametrize(
    ("g", "tau"), [((0.3, 0.2, 0.1), (1e-6, 1.0, 1e6)), ((0.1,) * 9, (*10.0 ** np.arange(-6, 3),))]
)
def test_times_that_lie_far_apart_are_known_to_all_digits(g: tuple[float, ...], tau: tuple[float, ...]) -> None:
    """At once a bar is elastic: J(0) = 1, to what rounding leaves of the sum of all poles' parts."""
    assert bar(ONCE, 0.0, force=True, g=g, tau=tau).strain_at(0.0) == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("tau", [1e-12, 1e-8, 1e-4])
def test_what_relaxes_in_no_time_is_dissipated(tau: float) -> None:
    """Of a bar held at once g / 2 is dissipated in the end; of one under a force, that creeps to 2, g / 2 as well."""
    assert bar(ONCE, 1.0, g=(0.5,), tau=(tau,)).dissipated == pytest.approx(0.25, rel=1e-8)
    assert bar(ONCE, 1.0, force=True, g=(0.5,), tau=(tau,)).dissipated == pytest.approx(0.5, rel=1e-8)


@pytest.mark.parametrize("rate", [0.0, 1e-12, 1e-9, 1e-8, 1e-7])
def test_a_slow_term_follows_a_ramp_without_rounding(rate: float) -> None:
    """(1 - exp(-r)) / r = 1 - r/2 + r^2/6."""
    assert HarmonicAmplitudeSegment(0.0, 1.0, 1.0).hereditary_integral(rate, 1.0) == pytest.approx(
        1.0 - rate / 2.0 + rate**2 / 6.0, rel=1e-15
    )
