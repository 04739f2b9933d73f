"""Numbers: tabulated homogeneous states, manufactured body forces, and another code's constitutive laws."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import felupe  # type: ignore[import-untyped]
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from softmark.solvers.materials import Law, law_for
from softmark.solvers.materials.isotropic_material import Isotropic
from softmark.solvers.materials.linear_elastic import LinearElastic
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.materials.neo_hookean_isochoric import NeoHookeanIsochoric
from softmark.solvers.materials.st_venant_kirchhoff import StVenantKirchhoff

Array = NDArray[np.float64]


def uniaxial(law: Law, stretch: float) -> tuple[float, float]:
    """Nominal stress and lateral stretch of a bar with free sides."""

    def lateral_stress(t: float) -> float:
        return float(law.P(np.diag([stretch, t, t])[None])[0, 1, 1])

    t = float(brentq(lateral_stress, 0.4, 1.6, xtol=1e-15, rtol=1e-14))
    return float(law.P(np.diag([stretch, t, t])[None])[0, 0, 0]), t


# Poisson's ratio, stretch; nominal stress (Pa) and lateral stretch of the form with ln J, then of the
# isochoric form, for E = 60 kPa. From mu (t^2 - 1) + lam ln(l t^2) = 0 and its counterpart, digits as shown.
NEO_HOOKEAN = [
    (0.3, 0.7, -24313.825, 1.107935, -26732.962, 1.104472),
    (0.3, 0.9, -6523.331, 1.031702, -6712.489, 1.031696),
    (0.3, 1.1, 5584.646, 0.971493, 5441.388, 0.971609),
    (0.3, 1.5, 22696.811, 0.880175, 20303.830, 0.884338),
    (0.3, 2.0, 38804.680, 0.798078, 31976.300, 0.813144),
    (0.45, 0.7, -26036.326, 1.170853, -26955.886, 1.175643),
    (0.45, 0.9, -6642.774, 1.048313, -6707.981, 1.048721),
    (0.45, 1.1, 5502.207, 0.957844, 5454.475, 0.958171),
    (0.45, 1.5, 21516.861, 0.830679, 20709.658, 0.836397),
    (0.45, 2.0, 35927.776, 0.725935, 33460.373, 0.742050),
    (0.49, 0.7, -26648.531, 1.190160, -26850.212, 1.191455),
    (0.49, 0.9, -6681.211, 1.052925, -6695.225, 1.053031),
    (0.49, 1.1, 5477.456, 0.954331, 5467.213, 0.954416),
    (0.49, 1.5, 21192.540, 0.819241, 21014.306, 0.820731),
    (0.49, 2.0, 35183.800, 0.710687, 34602.863, 0.715038),
]


@pytest.mark.parametrize(("nu", "stretch", "log", "t_log", "iso", "t_iso"), NEO_HOOKEAN)
def test_neo_hookean_bars(nu: float, stretch: float, log: float, t_log: float, iso: float, t_iso: float) -> None:
    """The table, to half a unit of its last digit."""
    for material, P, t in ((NeoHookean, log, t_log), (NeoHookeanIsochoric, iso, t_iso)):
        stress, lateral = uniaxial(law_for(material(60e3, nu, 1.0), "finite"), stretch)
        assert stress == pytest.approx(P, abs=6e-4)
        assert lateral == pytest.approx(t, abs=6e-7)


@pytest.mark.parametrize(("stretch", "P"), [(0.8, -0.144), (0.9, -0.0855), (1.1, 0.1155), (1.3, 0.4485), (1.5, 0.9375)])
def test_st_venant_kirchhoff_bar(stretch: float, P: float) -> None:
    """P/E = l (l^2 - 1)/2, for any Poisson's ratio; exact numbers, so round-off of the root only."""
    for nu in (0.0, 0.3, 0.45):
        assert uniaxial(StVenantKirchhoff(1.0, nu, 1.0), stretch)[0] == pytest.approx(P, abs=1e-13)


def test_st_venant_kirchhoff_bar_collapses() -> None:
    """Limit point at l = 1/sqrt(3), P = -0.19245 E (5 digits of 1/(3 sqrt 3)); less force on either side."""
    law, limit = StVenantKirchhoff(1.0, 0.3, 1.0), 1.0 / np.sqrt(3.0)
    P = [uniaxial(law, limit + d)[0] for d in (-0.01, 0.0, 0.01)]
    assert P[1] == pytest.approx(-0.19245, abs=5e-6)
    assert P[1] < min(P[0], P[2])


@pytest.mark.parametrize("stretch", [0.5, 0.9, 1.1, 2.0])
def test_corotational_bar(stretch: float) -> None:
    """P/E = l - 1 and t = 1 - nu (l - 1): Hooke's bar at any stretch."""
    stress, t = uniaxial(law_for(LinearElastic(1.0, 0.3, 1.0), "corotational"), stretch)
    assert stress == pytest.approx(stretch - 1.0, abs=1e-13)
    assert t == pytest.approx(1.0 - 0.3 * (stretch - 1.0), abs=1e-13)


def sheared(law: Law, shear: float) -> Array:
    """Cauchy stress P F^T/J (3, 3) in simple shear; J = 1."""
    F = np.eye(3)
    F[0, 1] = shear
    return np.asarray(law.P(F[None])[0] @ F.T)


@pytest.mark.parametrize(
    ("shear", "s12", "s11", "s22", "s33"),
    [
        (0.1, 0.039135, 0.010644, 0.006731, 0.002885),
        (0.5, 0.276442, 0.306490, 0.168269, 0.072115),
        (1.0, 1.057692, 1.730769, 0.673077, 0.288462),
    ],
)
def test_st_venant_kirchhoff_simple_shear(shear: float, s12: float, s11: float, s22: float, s33: float) -> None:
    """Cauchy stresses for E = 1, nu = 0.3, tabulated to six decimals."""
    sigma = sheared(StVenantKirchhoff(1.0, 0.3, 1.0), shear)
    np.testing.assert_allclose(sigma, [[s11, s12, 0.0], [s12, s22, 0.0], [0.0, 0.0, s33]], rtol=0.0, atol=6e-7)


@pytest.mark.parametrize("shear", [0.1, 0.5, 1.0])
def test_neo_hookean_simple_shear(shear: float) -> None:
    """s12 = mu g, s11 = mu g^2, nothing else: exact."""
    mu = 1.0 / 2.6
    sigma = sheared(NeoHookean(1.0, 0.3, 1.0), shear)
    expected = [[mu * shear**2, mu * shear, 0.0], [mu * shear, 0.0, 0.0], [0.0, 0.0, 0.0]]
    np.testing.assert_allclose(sigma, expected, rtol=0.0, atol=1e-15)


def test_small_strain_patch() -> None:
    """The three-dimensional patch of MacNeal and Harder (1985): normal stresses 2000, shear stresses 400."""
    F = np.eye(3) + 5e-4 * (np.ones((3, 3)) + np.eye(3))
    P = law_for(LinearElastic(1e6, 0.25, 1.0), "small").P(F[None])[0]
    np.testing.assert_allclose(P, 400.0 * np.ones((3, 3)) + 1600.0 * np.eye(3), rtol=1e-12)


DIRECTION = np.array([1.0, 2.0, -1.0])
MANUFACTURED: list[tuple[type[Isotropic], str, float, tuple[float, float, float]]] = [
    (LinearElastic, "small", 0.3, (794.3902, 1194.3503, -794.3902)),
    (LinearElastic, "small", 0.49, (8462.1262, 10041.5787, -8462.1262)),
    (StVenantKirchhoff, "finite", 0.3, (1130.7342, 1377.6040, -758.4217)),
    (StVenantKirchhoff, "finite", 0.49, (11026.1860, 12451.8044, -9555.9141)),
    (NeoHookean, "finite", 0.3, (605.8324, 1173.6124, -900.4762)),
    (NeoHookean, "finite", 0.49, (5126.1017, 9594.4171, -10219.4068)),
]


def bump(X: Array) -> tuple[Array, Array]:
    """First and second derivatives of 0.05 sin(pi X) sin(pi Y) sin(pi Z)."""
    s, c = np.sin(np.pi * X), np.cos(np.pi * X)
    first, second = np.empty(3), np.empty((3, 3))
    for J in range(3):
        first[J] = np.pi * c[J] * np.prod(np.delete(s, J))
        for L in range(3):
            factors = [(-s if J == L else c)[K] if K in (J, L) else s[K] for K in range(3)]
            second[J, L] = np.pi**2 * np.prod(factors)
    return 0.05 * first, 0.05 * second


@pytest.mark.parametrize(("material", "strain", "nu", "b"), MANUFACTURED)
def test_body_force_of_a_manufactured_solution(
    material: type[Isotropic], strain: str, nu: float, b: tuple[float, float, float]
) -> None:
    """b = -Div P = -dPdF_iJkL d^2 u_k/dX_J dX_L for u = bump (1, 2, -1), E = 1000, at (.25, .5, .3).

    Tabulated to four decimals from P alone, so it judges the stiffness independently.
    """
    gradient, curvature = bump(np.array([0.25, 0.5, 0.3]))
    F = np.eye(3) + np.outer(DIRECTION, gradient)
    H = law_for(material(1000.0, nu, 1.0), strain).dPdF(F[None])[0]
    force = -np.einsum("iJkL,k,JL->i", H, DIRECTION, curvature)
    np.testing.assert_allclose(force, b, rtol=0.0, atol=6e-5)


def gradients(m: int = 30) -> Array:
    """Random F (m, 3, 3) with J > 0.2."""
    F = np.eye(3) + 0.3 * np.random.default_rng(1).standard_normal((4 * m, 3, 3))
    return np.asarray(F[np.linalg.det(F) > 0.2][:m])


FELUPE: list[tuple[str, type[Isotropic], Callable[[Isotropic], Any]]] = [
    ("small", LinearElastic, lambda m: felupe.LinearElastic(E=m.young, nu=m.poisson)),
    (
        "finite",
        NeoHookean,
        lambda m: felupe.NeoHookeCompressible(mu=m.shear_modulus, lmbda=m.lame_lambda),
    ),
    ("finite", NeoHookeanIsochoric, lambda m: felupe.NeoHooke(mu=m.shear_modulus, bulk=m.bulk_modulus)),
]


@pytest.mark.parametrize("nu", [0.3, 0.499])
@pytest.mark.parametrize(("strain", "material", "other"), FELUPE, ids=["small", "log", "isochoric"])
def test_against_felupe(strain: str, material: type[Isotropic], other: Callable[[Isotropic], Any], nu: float) -> None:
    """Stress and stiffness of FElupe's law with the same formula: round-off."""
    constants = material(1.0, nu, 1.0)
    law, theirs, F = law_for(constants, strain), other(constants), gradients()
    x = [F.transpose(1, 2, 0)[..., None].copy(), None]
    P, H = theirs.gradient(x)[0][..., 0], theirs.hessian(x)[0][..., 0]
    P, H = P.transpose(2, 0, 1), np.broadcast_to(H, (3, 3, 3, 3, len(F))).transpose(4, 0, 1, 2, 3)
    np.testing.assert_allclose(law.P(F), P, rtol=0.0, atol=1e-12 * np.abs(P).max())
    np.testing.assert_allclose(law.dPdF(F), H, rtol=0.0, atol=1e-12 * np.abs(H).max())


def test_st_venant_kirchhoff_against_its_formula() -> None:
    """dPdF = d_ik S_JL + F_iM C_MJNL F_kN and P = F S, written out with einsum; round-off."""
    mu, lam, d, F = 1.0 / 2.6, 0.3 / (1.3 * 0.4), np.eye(3), gradients()
    E = 0.5 * (F.transpose(0, 2, 1) @ F - d)
    S = 2.0 * mu * E + lam * np.trace(E, axis1=1, axis2=2)[:, None, None] * d
    C = lam * np.einsum("MJ,NL->MJNL", d, d)
    C += mu * (np.einsum("MN,JL->MJNL", d, d) + np.einsum("ML,JN->MJNL", d, d))
    H = np.einsum("ik,mJL->miJkL", d, S) + np.einsum("miM,MJNL,mkN->miJkL", F, C, F)
    law = StVenantKirchhoff(1.0, 0.3, 1.0)
    np.testing.assert_allclose(law.P(F), F @ S, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(law.dPdF(F), H, rtol=0.0, atol=1e-14 * np.abs(H).max())
