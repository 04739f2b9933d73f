"""Torsion of a cylinder of rubber: torque and thrust are slopes of its energy, displacements keep the volume."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from softmark.references.cantilever import Refused
from softmark.references.torsion import TwistedCylinder

ROD = TwistedCylinder(0.06, 0.01, 20e3, 0.5, (0.01, -0.02, 0.03), (0.0, 0.6, 0.8), 2.5)


def energy(angle: float, stretch: float) -> float:
    """mu/2 int (I1 - 3) dV where sections turn by Z angle / L, and all is stretched along the axis without change of
    volume: I1 = stretch^2 + (2 + (R angle / L)^2) / stretch. By Gauss's rule over the radius, exact."""
    x, w = np.polynomial.legendre.leggauss(4)
    R = 0.5 * ROD.radius * (x + 1.0)
    I1 = stretch**2 + (2.0 + (R * angle / ROD.length) ** 2) / stretch
    weights = 0.5 * ROD.radius * w * 2.0 * math.pi * R * ROD.length
    return float(0.5 * ROD.shear_modulus * weights @ (I1 - 3.0))


def test_torque_and_thrust_are_slopes_of_the_energy() -> None:
    """Central differences, of second order in 1e-5: 1e-8."""
    h = 1e-5
    assert ROD.energy == pytest.approx(energy(2.5, 1.0), rel=1e-12)
    assert ROD.torque == pytest.approx((energy(2.5 + h, 1.0) - energy(2.5 - h, 1.0)) / (2 * h), rel=1e-8)
    pull = (energy(2.5, 1.0 + h) - energy(2.5, 1.0 - h)) / (2 * h * ROD.length)
    assert ROD.thrust == pytest.approx(-pull, rel=1e-8)


def test_its_displacements_keep_the_volume_and_have_that_energy() -> None:
    """F by central differences: det F = 1, I1 - 3 = (twist r)^2; the held end stays, the other turns by the angle."""
    a, root = np.array(ROD.axis), np.array(ROD.root)
    X = root + 0.045 * a + np.array([0.004, 0.0048, -0.0036])
    h, F = 1e-6, np.eye(3)
    for i, e in enumerate(np.eye(3)):
        up, down = ROD.displacement((X + h * e)[None]), ROD.displacement((X - h * e)[None])
        F[:, i] += (up - down)[0] / (2 * h)
    r = np.linalg.norm(np.cross(a, X - root))
    assert np.linalg.det(F) == pytest.approx(1.0, abs=1e-8)
    assert np.sum(F * F) - 3.0 == pytest.approx((ROD.twist * r) ** 2, rel=1e-6)
    ends = np.array([X - 0.045 * a, X + 0.015 * a])
    u = ROD.displacement(ends)
    assert u[0] == pytest.approx(np.zeros(3), abs=1e-17)
    assert np.linalg.norm(u[1]) == pytest.approx(2.0 * r * math.sin(1.25), rel=1e-12)
    assert np.cross(X - root, u[1]) @ a > 0.0  # right-handed: sin(2.5) > 0


def test_what_it_does_not_hold_for() -> None:
    wrong: list[dict[str, Any]] = [{"poisson": 0.4999}, {"radius": 0.0}, {"shear_modulus": -1.0}, {"angle": math.inf}]
    for changes in wrong:
        with pytest.raises(Refused):
            replace(ROD, **changes)
    with pytest.raises(Refused):
        ROD.displacement(np.zeros(3))
