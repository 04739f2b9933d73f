"""Torsion of a cylinder of rubber: torque and thrust are slopes of its energy, displacements keep the volume."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from softmark.references.rubber_energies import Rubber
from softmark.references.rubber_torsion import TwistedCylinder
from softmark.references.straight_cantilever import NotApplicable
from tests.references.test_inflation import LAWS

MU = 20e3  # Pa
ROD = TwistedCylinder(0.06, 0.01, Rubber.neo_hookean(MU), 0.5, (0.01, -0.02, 0.03), (0.0, 0.6, 0.8), 2.5)


def energy(angle: float, stretch: float) -> float:
    """mu/2 int (I1 - 3) dV where sections turn by Z angle / L, and all is stretched along the axis without change of
    volume: I1 = stretch^2 + (2 + (R angle / L)^2) / stretch. By Gauss's rule over the radius, exact."""
    x, w = np.polynomial.legendre.leggauss(4)
    R = 0.5 * ROD.radius * (x + 1.0)
    I1 = stretch**2 + (2.0 + (R * angle / ROD.length) ** 2) / stretch
    weights = 0.5 * ROD.radius * w * 2.0 * math.pi * R * ROD.length
    return float(0.5 * MU * weights @ (I1 - 3.0))


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
    wrong: list[dict[str, Any]] = [{"poisson": 0.4999}, {"radius": 0.0}, {"angle": math.inf}]
    for changes in wrong:
        with pytest.raises(NotApplicable):
            replace(ROD, **changes)
    with pytest.raises(NotApplicable):
        ROD.displacement(np.zeros(3))


def test_torques_of_other_laws() -> None:
    """REFERENCES 3.6: c1 = 6 and c2 = 4 kPa, A = 19 mm, 20 rad/m: .0818831 N m and 1.146363 N; neo-Hooke of 20 kPa."""
    mooney = Rubber("mooney_rivlin", (("c1", 6e3), ("c2", 4e3)))
    rod = TwistedCylinder(0.1, 0.019, mooney, 0.5, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 2.0)
    assert rod.torque == pytest.approx(0.0818831, abs=6e-8)
    assert rod.thrust == pytest.approx(1.146363, abs=6e-7)
    assert rod.torque == pytest.approx(math.pi * 10e3 * 20.0 * 0.019**4, rel=1e-12)
    assert rod.thrust == pytest.approx(0.5 * math.pi * 400.0 * 0.019**4 * 14e3, rel=1e-12)
    again = replace(rod, rubber=Rubber.neo_hookean(20e3))
    assert again.torque == pytest.approx(0.0818831, abs=6e-8)
    assert again.thrust == pytest.approx(0.818831, abs=6e-7)
    same = replace(rod, rubber=Rubber("ogden", (("mu", (12e3, -8e3)), ("alpha", (2.0, -2.0)))))
    assert (same.torque, same.thrust, same.energy) == pytest.approx((rod.torque, rod.thrust, rod.energy), rel=1e-12)
    assert replace(rod, angle=-2.0).torque == pytest.approx(-rod.torque, rel=1e-14)


@pytest.mark.parametrize("law", ["yeoh", "gent", "fung", "ogden", "arruda_boyce", "veronda_westmann"])
def test_torque_is_the_slope_of_the_energy_of_every_law(law: str) -> None:
    """Central differences, of second order in 1e-5. Thrust: that of W of the twist and a stretch t along the axis."""
    rubber = LAWS[law]
    rod = TwistedCylinder(0.1, 0.019, rubber, 0.5, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 4.0)
    h = 1e-5
    slope = (replace(rod, angle=4.0 + h).energy - replace(rod, angle=4.0 - h).energy) / (2 * h)
    assert rod.torque == pytest.approx(slope, rel=1e-8)
    x, w = np.polynomial.legendre.leggauss(40)
    R, w = 0.5 * 0.019 * (x + 1.0), 0.5 * 0.019 * w

    def stored(t: float) -> float:
        F = np.zeros((40, 3, 3))
        F[:, 0, 0] = F[:, 1, 1] = t**-0.5
        F[:, 2, 2], F[:, 1, 2] = t, 40.0 * R * t**-0.5  # theta by z: the twist is by the undeformed length
        e = 0.5 * np.log(np.linalg.eigvalsh(F.transpose(0, 2, 1) @ F)).T
        return float(2.0 * math.pi * 0.1 * w @ (R * rubber.energy(e)))

    pull = (stored(1.0 + h) - stored(1.0 - h)) / (2 * h * 0.1)
    assert rod.thrust == pytest.approx(-pull, rel=1e-7)
