"""Observed orders of the geometrically exact rod: second order in the tip's position and in its rotation, to 0.1.

Theory: two-node elements with one integration point, h^2 in positions and rotations (Simo and Vu-Quoc 1986). Truths:
elliptic integrals (Bisshopp and Drucker 1945), and boundary value problems by scipy's collocation, which share
nothing with the solver.
"""

from __future__ import annotations

import numpy as np
import pytest
from end_force import concentrated
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from softmark.solvers.energies.energy import Space
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_section import RodStiffness, circular
from softmark.solvers.energies.rod_state import RodChain, chain_elements, rod_at_rest

TOLERANCE = 0.1  # of every order


def equilibrium(elastic: RodElastic, load: RodForces, space: Space) -> np.ndarray:
    """Newton's method from rest, with halved steps until the energy falls, clamped at the first node."""
    x = elastic.rest
    for step in range(100):
        g = np.zeros(space.dofs)
        elastic.add_gradient(x, g)
        load.add_gradient(x, g)
        d = np.linalg.solve(tangent(elastic, x, space.dofs, False), -g[6:])
        if g[6:] @ d > 0:
            d = np.linalg.solve(tangent(elastic, x, space.dofs, True), -g[6:])
        if step and -(g[6:] @ d) < 1e-20 * elastic.value(x):
            return x
        start, length = elastic.value(x) + load.value(x), 1.0
        while length > 1e-6:
            y = space.move(x, length * np.concatenate([np.zeros(6), d]))
            if elastic.value(y) + load.value(y) <= start + 1e-13 * abs(start):
                break
            length /= 2
        x = y
    raise AssertionError("Newton's method did not converge")


def tangent(elastic: RodElastic, x: np.ndarray, dofs: int, projected: bool) -> np.ndarray:
    """The free part of the Hessian, dense."""
    data, stencils = np.zeros(dofs * dofs), elastic.stencils
    elastic.add_hessian(x, data, stencils[:, :, None] * dofs + stencils[:, None, :], projected=projected)
    return np.asarray(data.reshape(dofs, dofs)[6:, 6:])


def solved(length: float, segments: int, stiffness: RodStiffness, line: float, end: float) -> np.ndarray:
    """x, z and the slope of the tip of a horizontal rod under a weight per length and an end force, both downwards."""
    rest = rod_at_rest(np.linspace([0.0, 0, 0], [length, 0, 0], segments + 1), up=np.array([0.0, 0.0, 1.0]))
    held = np.zeros((segments + 1, 3), dtype=bool)
    held[0] = True
    load = RodForces.uniform(rest, chain_elements(segments + 1), np.array([0.0, 0.0, -line]))
    if end:
        load = concentrated(rest, -1, np.array([0.0, 0.0, -end]))
    elastic, space = RodElastic(rest, chain_elements(segments + 1), stiffness), RodChain(rest, held)
    x = equilibrium(elastic, load, space)
    if elastic.rigid_fraction(x) > 0:  # stretch and shear switched off: take what is left of them out
        x = equilibrium(elastic.with_multipliers(x), load, space)
    tip, before = x.reshape(-1, 7)[-1], elastic.rest.reshape(-1, 7)[-1]
    return np.array([tip[0], tip[2], turned(tip[3:], before[3:])])


def turned(q: np.ndarray, before: np.ndarray) -> float:
    """The angle (rad) of the rotation from one unit quaternion to another."""
    return 2 * float(np.arccos(min(1.0, abs(q @ before))))


def orders(errors: np.ndarray, segments: tuple[int, ...]) -> np.ndarray:
    return np.asarray(np.log(errors[-2] / errors[-1]) / np.log(segments[-1] / segments[-2]))


def errors_of(tips: list[np.ndarray], exact: np.ndarray) -> np.ndarray:
    """Position and rotation (n, 2)."""
    off = np.array(tips) - exact
    return np.stack([np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])], axis=1)


def bisshopp_drucker(alpha: float) -> np.ndarray:
    """x / L, z / L and the slope of the tip (rad) of an inextensible rod, P L^2 / EI = alpha; k^2 = (1 + sin phi)/2."""

    def gap(phi: float) -> float:
        m = (1 + np.sin(phi)) / 2
        return float(ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m) - np.sqrt(alpha))

    phi = brentq(gap, 1e-6, np.pi / 2 - 1e-9, xtol=1e-15)
    m = (1 + np.sin(phi)) / 2
    down = 1 - 2 / np.sqrt(alpha) * (ellipe(m) - ellipeinc(np.arcsin(np.sqrt(0.5 / m)), m))
    return np.array([np.sqrt(2 * np.sin(phi) / alpha), -down, phi])


def reissner(length: float, stiffness: RodStiffness, line: float) -> np.ndarray:
    """x, z and the slope of the tip (rad) of the planar Simo-Reissner rod under its weight, by collocation.

    EI phi'' = n x', with V = w (L - s) the force below: e = V sin(phi)/EA, g = V cos(phi)/GA, x' = (1 + e) cos - g sin.
    """
    EA, GA, EI = stiffness.EA, stiffness.GA3, stiffness.EI2

    def rate(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        phi, bend = y[2], y[3]
        V = line * (length - s)
        e, g = V * np.sin(phi) / EA, V * np.cos(phi) / GA
        dx = (1 + e) * np.cos(phi) - g * np.sin(phi)
        dz = (1 + e) * np.sin(phi) + g * np.cos(phi)
        return np.stack([dx, dz, bend, -V * dx / EI])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[0], a[1], a[2], b[3]])

    s = np.linspace(0, length, 201)
    guess = np.stack([s, 0 * s, s / length, 0 * s + 1 / length])
    found = solve_bvp(rate, ends, s, guess, tol=1e-10, max_nodes=200_000)
    assert found.success
    x, down, phi, _ = found.sol(length)
    return np.array([x, -down, phi])


def test_truths_are_those_of_the_catalogue() -> None:
    """REFERENCES 3.4, alpha = 4: six digits; 1.3, the silicone beam: tip (110.822, -133.727) mm."""
    x, z, phi = bisshopp_drucker(4.0)
    np.testing.assert_allclose([1 - x, -z, np.degrees(phi)], [0.328941, 0.669964, 64.2423], atol=5e-5)
    np.testing.assert_allclose([1 - x, -z], [0.328941, 0.669964], atol=6e-7)
    section = circular(0.019, 60e3, 0.49)
    tip = reissner(0.178, section.stiffness, 1070 * 9.81 * section.area)
    np.testing.assert_allclose(tip[:2], [0.11082205454830377, -0.13372721540648552], atol=1e-10)


@pytest.mark.parametrize("alpha", [1.0, 4.0, 10.0])
def test_order_against_the_elastica(alpha: float) -> None:
    """Without shear and stretch. Measured, position and rotation: 2.000 2.000, 1.999 2.001, 1.996 2.001."""
    segments = (20, 40)
    stiffness = RodStiffness(9.0, 8.0, 8.0, 0.5, 1.0, 1.0).with_suppressed_modes(1.0, shear=False, axial=False)
    tips = [solved(1.0, n, stiffness, 0.0, alpha) for n in segments]
    found = orders(errors_of(tips, bisshopp_drucker(alpha)), segments)
    np.testing.assert_allclose(found, 2.0, atol=TOLERANCE)


def test_order_against_reissners_rod() -> None:
    """The silicone beam of Marchal et al. (2008) under its own weight. Measured: 2.008 and 2.000."""
    segments, section = (20, 40), circular(0.019, 60e3, 0.49)
    weight = 1070 * 9.81 * section.area
    tips = [solved(0.178, n, section.stiffness, weight, 0.0) for n in segments]
    found = orders(errors_of(tips, reissner(0.178, section.stiffness, weight)), segments)
    np.testing.assert_allclose(found, 2.0, atol=TOLERANCE)
