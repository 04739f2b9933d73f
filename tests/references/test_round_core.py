"""A core or a hole that is pulled from afar: its fields are in equilibrium and continuous, and those that others print.

Eshelby's tensor is integrated here over directions of waves (Mura 1987, Micromechanics of Defects in Solids, section
3), which shares nothing with functions of the radius. Printed values are those of REFERENCES 3.3 and of Timoshenko and
Goodier (1970), sections 35 and 137.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from softmark.references.inclusion import BodyWithRoundCore, Hookean
from softmark.references.straight_cantilever import NotApplicable

AFAR = (1.0, 0.3, -0.2)
STIFF, SOFT = Hookean(5.0, 0.2), Hookean(1.0, 0.4)
BALL = BodyWithRoundCore(3, STIFF, SOFT, 1.3, 6.0, AFAR, (0.5, -1.0, 2.0))
RING = BodyWithRoundCore(2, STIFF, SOFT, 1.3, 6.0, (1.0, 0.3, 0.0))
CASES = {
    "ball": BALL,
    "unbounded": replace(BALL, outer=math.inf),
    "cavity": replace(BALL, core=None),
    "incompressible": replace(BALL, core=Hookean(5.0, 0.5), matrix=Hookean(1.0, 0.5)),
    "soft core": replace(BALL, core=SOFT, matrix=STIFF),
    "fibre": RING,
    "hole": replace(RING, core=None),
    "unbounded hole": replace(RING, core=None, outer=math.inf),
    "thin": replace(RING, core=None, thin=2.0 / 3.0),  # 0.4 in the plane
}


def places(body: BodyWithRoundCore, low: float, high: float, count: int = 200) -> np.ndarray:
    """Points (n, 3) in a body at distances between two bounds from its centre, in all directions of it."""
    rng = np.random.default_rng(7)
    x = rng.normal(size=(count, 3))
    if body.n == 2:
        x[:, 2] = 0.0
    x *= (rng.uniform(low, high, count) / np.linalg.norm(x, axis=1))[:, None]
    return x + np.array(body.centre)


def directions(body: BodyWithRoundCore) -> np.ndarray:
    return places(body, 1.0, 1.0) - np.array(body.centre)


def slopes(field: Any, X: np.ndarray, h: float = 1e-5) -> np.ndarray:
    """Central differences of a field (n, ...) along x, y and z, the last axis: good to 1e-9."""
    return np.stack([(field(X + h * e) - field(X - h * e)) / (2 * h) for e in np.eye(3)], axis=-1)


@pytest.mark.parametrize("name", CASES)
def test_its_fields_are_in_equilibrium_and_follow_the_law(name: str) -> None:
    """du/dX are slopes of u, stress is Hooke's of them, and its divergence is nothing: by differences, 1e-8."""
    body = CASES[name]
    for solid, low, high in ((body.core, 0.1, 1.28), (body.matrix, 1.32, 5.5)):
        if solid is None:
            continue
        X = places(body, low, high)
        H, sigma = body.gradient(X), body.stress_at(X)
        plane = slice(0, body.n)
        assert slopes(body.displacement, X)[:, plane, plane] == pytest.approx(H[:, plane, plane], abs=1e-8)
        assert np.einsum("nijj->ni", slopes(body.stress_at, X)) == pytest.approx(np.zeros((len(X), 3)), abs=1e-7)
        strain = 0.5 * (H + H.swapaxes(1, 2))
        volume = np.trace(strain, axis1=1, axis2=2)
        shear = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
        even = strain - volume[:, None, None] / 3.0 * np.eye(3)
        assert shear == pytest.approx(2.0 * solid.shear_modulus * even, abs=1e-12)
        nu = solid.poisson if body.thin is None else body.thin
        young = 2.0 * solid.shear_modulus * (1.0 + nu)
        pressed = (1.0 - 2.0 * nu) * np.trace(sigma, axis1=1, axis2=2)
        assert young * volume == pytest.approx(pressed, abs=1e-12)
        across = H[:, 2, 2] if body.thin is None else sigma[:, 2, 2]
        assert body.n == 3 or across == pytest.approx(np.zeros(len(X)), abs=1e-15)


@pytest.mark.parametrize("name", CASES)
def test_borders_are_bonded_free_or_pulled(name: str) -> None:
    """At the core u and tractions are continuous, at a hole tractions vanish, at the border they are those of T."""
    body = CASES[name]
    away, centre = directions(body), np.array(body.centre)

    def at(r: float) -> tuple[np.ndarray, np.ndarray]:
        X = centre + r * away
        return body.displacement(X), np.einsum("nij,nj->ni", body.stress_at(X), away)

    (_, inner), (_, outer) = at(1.3 * (1 - 1e-8)), at(1.3 * (1 + 1e-8))
    if body.core is None:
        assert outer == pytest.approx(np.zeros_like(outer), abs=1e-7)
    else:
        assert at(1.3 * (1 - 1e-8))[0] == pytest.approx(at(1.3 * (1 + 1e-8))[0], abs=1e-7)
        assert inner == pytest.approx(outer, abs=1e-7)
    pull = away * np.array(body.stress)
    far = body.outer if math.isfinite(body.outer) else 1e5
    assert at(far)[1] == pytest.approx(pull, abs=1e-12 if math.isfinite(body.outer) else 1e-8)


def eshelby(nu: float) -> np.ndarray:
    """S (3, 3, 3, 3) of a sphere by Gauss's rule over directions: S = P C, P the mean of the symmetrised Green
    operator of a wave, (acoustic tensor)^-1 between two of its directions."""
    lam, eye = 2.0 * nu / (1.0 - 2.0 * nu), np.eye(3)
    C = lam * np.einsum("ij,kl->ijkl", eye, eye)
    C = C + np.einsum("ik,jl->ijkl", eye, eye) + np.einsum("il,jk->ijkl", eye, eye)  # mu = 1
    z, w = np.polynomial.legendre.leggauss(8)
    P = np.zeros((3, 3, 3, 3))
    for (height, weight), turn in product(zip(z, w, strict=True), 2.0 * np.pi * np.arange(16) / 16):
        n = np.array([*(math.sqrt(1.0 - height**2) * np.array([math.cos(turn), math.sin(turn)])), height])
        inverse = np.linalg.inv(np.einsum("ijkl,j,l->ik", C, n, n))
        P += weight / 32.0 * np.einsum("ik,j,l->ijkl", inverse, n, n)
    P = 0.5 * (P + P.swapaxes(0, 1))
    P = 0.5 * (P + P.swapaxes(2, 3))
    return np.einsum("ijkl,klmn->ijmn", P, C)


@pytest.mark.parametrize(("core", "matrix"), [(STIFF, SOFT), (SOFT, STIFF), (Hookean(40.0, -0.3), Hookean(2.0, 0.0))])
def test_within_an_unbounded_matrix_stress_is_even_and_that_of_eshelby(core: Hookean, matrix: Hookean) -> None:
    """eps = (I + S C2^-1 (C1 - C2))^-1 eps_afar (Eshelby 1957), S by quadrature over directions: rounding."""

    def hooke(solid: Hookean, strain: np.ndarray) -> np.ndarray:
        nu, mu = solid.poisson, solid.shear_modulus
        return np.asarray(2.0 * mu * (strain + nu / (1.0 - 2.0 * nu) * np.trace(strain) * np.eye(3)))

    def compliance(solid: Hookean, stress: np.ndarray) -> np.ndarray:
        nu, mu = solid.poisson, solid.shear_modulus
        return np.asarray(0.5 / mu * (stress - nu / (1.0 + nu) * np.trace(stress) * np.eye(3)))

    S, columns = eshelby(matrix.poisson), []
    for k in range(9):
        unit = np.eye(9)[k].reshape(3, 3)
        unit = 0.5 * (unit + unit.T)
        apart = hooke(core, unit) - hooke(matrix, unit)
        columns.append((np.eye(9)[k].reshape(3, 3) + np.einsum("ijkl,kl", S, compliance(matrix, apart))).ravel())
    afar = compliance(matrix, np.diag(AFAR))
    strain = np.linalg.solve(np.array(columns).T, afar.ravel()).reshape(3, 3)
    body = BodyWithRoundCore(3, core, matrix, 1.3, math.inf, AFAR)
    X = places(body, 0.0, 1.299)
    even = np.broadcast_to(strain, (len(X), 3, 3))
    assert 0.5 * (body.gradient(X) + body.gradient(X).swapaxes(1, 2)) == pytest.approx(even, abs=1e-14)
    assert body.stress_at(X) == pytest.approx(np.broadcast_to(hooke(core, strain), even.shape), abs=1e-13)
    assert not body.on_border(X).any()


@pytest.mark.parametrize(("nu", "most"), [(0.0, 1.92857), (0.3, 2.04545), (0.49, 2.15934), (0.5, 2.16667)])
def test_beside_a_cavity_stress_is_that_of_goodier(nu: float, most: float) -> None:
    """3 (9 - 5 nu) / (2 (7 - 5 nu)) at the equator, -(3 + 15 nu) / (2 (7 - 5 nu)) at the pole."""
    body = BodyWithRoundCore(3, None, Hookean(7.0, nu), 2.0, math.inf, (1.0, 0.0, 0.0))
    around, pole = body.stress_at(np.array([[0.0, 2.0, 0.0], [2.0, 0.0, 0.0]]))
    assert around[0, 0] == pytest.approx(most, abs=5e-6)
    assert around[0, 0] == pytest.approx(3 * (9 - 5 * nu) / (2 * (7 - 5 * nu)), rel=1e-13)
    assert np.diag(pole) == pytest.approx([0.0, *[-(3 + 15 * nu) / (2 * (7 - 5 * nu))] * 2], abs=1e-13)


def test_around_a_hole_it_is_that_of_kirsch() -> None:
    """REFERENCES 3.3: stresses with S = a = 1, and displacements in plane stress with E = 1000, nu = 0.3."""
    matrix = Hookean(1000.0 / 2.6, 0.3 / 1.3)
    body = BodyWithRoundCore(2, None, matrix, 1.0, math.inf, (1.0, 0.0, 0.0), thin=0.3)
    half = math.sqrt(0.5)
    X = np.array([[0.0, 1, 0], [1, 0, 0], [0, 2, 0], [1.5 * half, 1.5 * half, 0], [0, 4, 0]])
    sigma = body.stress_at(X)
    assert sigma[0, 0, 0] == pytest.approx(3.0, rel=1e-13)
    assert sigma[1, 1, 1] == pytest.approx(-1.0, rel=1e-13)
    assert np.diag(sigma[2])[:2] == pytest.approx([1.21875, 0.28125], rel=1e-13)
    turn = np.array([[half, -half, 0], [half, half, 0], [0, 0, 1]])  # r, theta
    polar = turn.T @ sigma[3] @ turn
    assert (polar[0, 0], polar[1, 1], polar[0, 1]) == pytest.approx((0.277778, 0.722222, -0.648148), abs=1e-6)
    assert sigma[4, 0, 0] == pytest.approx(1.037109, abs=1e-6)
    u = body.displacement(np.array([[1.0, 0, 0], [0, 1, 0], [half, half, 0], [2, 0, 0]]))
    assert (u[0, 0], u[1, 1], u[3, 0]) == pytest.approx((0.003, -0.001, 0.00324375), rel=1e-12)
    assert u[2] @ turn[:, 1] == pytest.approx(-0.002, rel=1e-12)


def test_under_an_even_pressure_it_is_lame_in_two_layers() -> None:
    """A r in the core and B r + C / r^2 in the coat (Timoshenko and Goodier 1970, section 142)."""
    body = replace(BALL, stress=(-2.0, -2.0, -2.0), centre=(0.0, 0.0, 0.0))
    a, b = body.inner, body.outer
    K1, K2 = (2 * s.shear_modulus * (1 + s.poisson) / (3 * (1 - 2 * s.poisson)) for s in (STIFF, SOFT))
    rows = [
        [1.0, -1.0, -1.0 / a**3],
        [3 * K1, -3 * K2, 4.0 / a**3],
        [0.0, 3 * K2, -4.0 / b**3],
    ]  # mu of the coat is 1
    A, B, C = np.linalg.solve(np.array(rows), np.array([0.0, 0.0, -2.0]))
    X = np.array([[0.5, 0, 0], [0, 2.0, 0], [0, 0, 6.0]])
    found = body.displacement(X)[[0, 1, 2], [0, 1, 2]]
    assert found == pytest.approx([A * 0.5, B * 2 + C / 4, B * 6 + C / 36], rel=1e-12)


@pytest.mark.parametrize("name", ["ball", "cavity", "hole"])
def test_what_the_size_makes_is_a_number_that_falls_as_it_grows(name: str) -> None:
    """With the cube of the ratio of the radii in space, with its square in the plane; nothing of an unbounded body."""
    body = CASES[name]
    near, far = (replace(body, outer=r).size_matters for r in (26.0, 52.0))
    assert near / far == pytest.approx(2.0**body.n, rel=0.02)
    free = replace(body, outer=math.inf)
    assert free.size_matters == 0.0
    X = np.array(body.centre) + 1.3 * (1 + 1e-7) * np.eye(3)[: body.n]
    apart = np.linalg.norm(replace(body, outer=26.0).stress_at(X) - free.stress_at(X), axis=(1, 2)).max()
    assert apart <= near * math.hypot(*body.stress) * (1 + 1e-4)


def test_a_core_of_the_same_solid_is_none() -> None:
    """Uniform strain, at any ratio of radii, also large ones: rounding, which it says."""
    for ratio in (1.001, 3.0, 1e4):
        body = BodyWithRoundCore(3, SOFT, SOFT, 1.0, ratio, AFAR)
        X = places(body, 0.0, ratio)
        even = np.broadcast_to(np.diag(AFAR), (len(X), 3, 3))
        assert body.stress_at(X) == pytest.approx(even, abs=1e-9)
        exact = (np.array(AFAR) - 0.4 / 1.4 * sum(AFAR)) * X / 2.0
        assert np.abs(body.displacement(X) - exact).max() <= max(body.estimated_error, 1e-15)


def test_on_the_border_stress_is_the_larger_one() -> None:
    on = np.array(BALL.centre) + BALL.inner * np.eye(3)
    sides = [np.linalg.norm(BALL.stress_at(np.array(BALL.centre) + r * BALL.inner * np.eye(3)), axis=(1, 2))
             for r in (1 - 1e-7, 1 + 1e-7)]  # fmt: skip
    assert np.linalg.norm(BALL.stress_at(on), axis=(1, 2)) == pytest.approx(np.maximum(*sides), rel=1e-5)
    assert BALL.on_border(on).all()
    assert not replace(BALL, core=None).on_border(on).any()


def test_what_it_does_not_hold_for() -> None:
    wrong: list[dict[str, Any]] = [{"outer": 1.3}, {"inner": 0.0}, {"stress": (math.inf, 0.0, 0.0)}]
    for changes in wrong:
        with pytest.raises(NotApplicable):
            replace(BALL, **changes)
    for solid in ((0.0, 0.3), (math.nan, 0.3), (1.0, 0.6), (1.0, -1.0)):
        with pytest.raises(NotApplicable):
            Hookean(*solid)
    with pytest.raises(NotApplicable):
        BALL.displacement(np.zeros(3))
