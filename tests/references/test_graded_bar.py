"""The pulled bar whose constants vary along it: closed forms, its own check of its quadrature, and what it refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softmark.references.graded_bar import PulledBar
from softmark.references.straight_cantilever import NotApplicable

Floats = NDArray[np.float64]


def bar(young: Any, density: Any = lambda s: np.full(len(s), 1000.0), **other: Any) -> PulledBar:
    """A bar along x from (0.1, 0, 0) m, pulled by 1 N on 1 cm^2."""
    known = {"length": 0.2, "area": 1e-4, "root": (0.1, 0.0, 0.0), "axis": (1.0, 0.0, 0.0), "force": 1.0, "pull": 0.0,
             "young": young, "density": density, "poisson": 0.0}  # fmt: skip
    return PulledBar(**(known | other))


def along(s: Floats) -> Floats:
    """Points beside the axis at distances s from the held end, m."""
    return np.stack([0.1 + s, np.full(len(s), 0.003), np.full(len(s), -0.001)], axis=1)


def test_a_linear_stiffness_gives_a_logarithm() -> None:
    """E = E0 (1 + s / L): u = F L / (E0 A) ln(1 + s / L), to the rounding of 64 panels."""
    found = bar(lambda s: 1e5 * (1.0 + s / 0.2)).stretched()
    s = np.linspace(0.0, 0.2, 23)
    u = found.displacement(along(s))
    exact = 0.2 / (1e5 * 1e-4) * np.log1p(s / 0.2)
    np.testing.assert_allclose(u[:, 0], exact, rtol=1e-13, atol=1e-18)
    assert not u[:, 1:].any()
    assert found.estimated_error < 1e-13 * exact[-1] * 1e2


def test_its_own_weight_pulls_what_lies_above() -> None:
    """E and rho even: u(L) = F L / (E A) + rho g L^2 / (2 E)."""
    found = bar(lambda s: np.full(len(s), 1e5), force=1.0, pull=9.81).stretched()
    exact = 0.2 / (1e5 * 1e-4) + 1000.0 * 9.81 * 0.2**2 / 2e5
    assert found.displacement(along(np.array([0.2])))[0, 0] == pytest.approx(exact, rel=1e-13)


def test_a_jump_of_the_stiffness_is_in_its_error() -> None:
    """Within a panel: Gauss's rule is off there, QUADPACK cuts it, and the difference is what is stated."""
    found = bar(lambda s: np.where(s < 0.1037, 1e5, 3e5)).stretched()
    exact = (0.1037 / 1e5 + (0.2 - 0.1037) / 3e5) / 1e-4
    off = abs(found.displacement(along(np.array([0.2])))[0, 0] - exact)
    assert 0.0 < off <= 1.01 * found.estimated_error + 1e-16


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        ({"poisson": 0.3}, "contract by different amounts"),
        ({"force": 0.0}, "no load acts along"),
        ({"length": 0.0}, "the length is 0"),
        ({"area": math.inf}, "the section is inf"),
        ({"young": lambda s: 1e5 * (1.0 - 10.0 * s)}, "not positive"),
        ({"young": lambda s: 1e5 * (1.001 + np.sin(3e5 * s))}, "two quadratures"),
    ],
)
def test_what_it_does_not_hold_for_is_refused(other: dict[str, Any], reason: str) -> None:
    with pytest.raises(NotApplicable, match=reason):
        bar(**({"young": lambda s: np.full(len(s), 1e5)} | other)).stretched()
