"""Laws with shape and volume apart: closed forms of homogeneous states, limits, stretches that coincide."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from deformations import close, difference
from equal_moduli import CONSTANTS as OWN
from equal_moduli import made
from numpy.typing import NDArray
from written_stresses import Written, stress_of

from softmark.ranges import InvalidCombination
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress
from softmark.solvers.materials import MATERIALS, law_for, mixed_for
from softmark.solvers.materials.arruda_boyce import ArrudaBoyce
from softmark.solvers.materials.fung import Fung
from softmark.solvers.materials.gent import Gent
from softmark.solvers.materials.isochoric_split import VOLUMETRIC, IsochoricMaterial
from softmark.solvers.materials.mooney_rivlin import MooneyRivlin
from softmark.solvers.materials.neo_hookean_isochoric import NeoHookeanIsochoric
from softmark.solvers.materials.ogden import Ogden
from softmark.solvers.materials.veronda_westmann import VerondaWestmann
from softmark.solvers.materials.yeoh import Yeoh
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

Array = NDArray[np.float64]
RUBBER: dict[str, Any] = {"poisson": 0.5, "density": 1000.0}

# ------------------------------------------------------------------ five homogeneous states, incompressible

# REFERENCES 3.5, nominal stress in kPa, of Ogden in MPa: pull of .7, 1.1, 1.5, 2 and 3, of two directions by 1.5 and 2,
# of one with another held by 2, and simple shear by .5 and 1; six digits as printed there
STATES = (("pull", 0.7), ("pull", 1.1), ("pull", 1.5), ("pull", 2.0), ("pull", 3.0), ("both", 1.5), ("both", 2.0),
          ("held", 2.0), ("shear", 0.5), ("shear", 1.0))  # fmt: skip
TABLE: dict[str, tuple[IsochoricMaterial, tuple[float, ...]]] = {
    "neo-Hooke": (MooneyRivlin(c1=10.0, c2=0.0, **RUBBER),
        (-26.8163, 5.47107, 21.1111, 35.0, 57.7778, 27.3663, 39.375, 37.5, 10.0, 20.0)),
    "mooney_rivlin": (MooneyRivlin(c1=6.0, c2=4.0, **RUBBER),
        (-31.4134, 5.27213, 18.2963, 28.0, 42.3704, 41.0494, 86.625, 37.5, 10.0, 20.0)),
    "yeoh": (Yeoh(c1=10.0, c2=0.5, c3=0.01, **RUBBER),
        (-27.7569, 5.48651, 22.3641, 42.42, 104.0, 32.2483, 62.336, 46.507, 10.2519, 22.06)),
    "ogden": (Ogden(mu=(0.63, 0.0012, -0.01), alpha=(1.3, 5.0, -2.0), **RUBBER),
        (-0.591803, 0.113335, 0.401617, 0.602722, 0.879926, 0.60198, 0.821615, 0.685622, 0.20687, 0.391854)),
    "gent": (Gent(mu=20.0, limit=30.0, **RUBBER),
        (-27.1303, 5.47622, 21.5297, 37.5, 74.2857, 29.0076, 47.3684, 40.5405, 10.084, 20.6897)),
    "fung": (Fung(mu=20.0, b=1.0, **RUBBER),
        (-37.9456, 5.62745, 37.8311, 258.617, 45400.2, 149.432, 6220.66, 355.79, 12.8403, 54.3656)),
    "veronda_westmann": (VerondaWestmann(c=5.0, a=2.0, **RUBBER),
        (-34.5392, 3.30145, 60.7565, 1902.19, 3.56742e7, 785.179, 982692.0, 3356.89, 11.4872, 137.781)),
}  # fmt: skip


def gradient(state: str, t: float) -> Array:
    """F of a state that keeps the volume."""
    if state == "shear":
        return np.eye(3) + t * np.outer([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    others = {"pull": (t**-0.5, t**-0.5), "both": (t, t**-2.0), "held": (1.0, 1.0 / t)}[state]
    return np.diag([t, *others])


def nominal(material: IsochoricMaterial, state: str, t: float) -> float:
    """P11, or the shear stress P12, with the pressure that leaves no stress along the third axis."""
    F = gradient(state, t)
    split = mixed_for(material, "finite")
    assert split is not None
    P, turned = split.shape.P(F[None])[0], split.constraint.gradient(F[None])[0]
    P = P - P[2, 2] / turned[2, 2] * turned
    return float(P[0, 1] if state == "shear" else P[0, 0])


@pytest.mark.parametrize("name", TABLE)
def test_nominal_stress_is_that_of_the_table(name: str) -> None:
    material, known = TABLE[name]
    found = [nominal(material, *state) for state in STATES]
    np.testing.assert_allclose(found, known, rtol=6e-6)  # half of the sixth digit


Slopes = Callable[[float, float], tuple[float, float]]  # W1 and W2 of I1 - 3 and I2 - 3


def closed(slopes: Slopes, state: str, t: float) -> float:
    """REFERENCES 3.5: nominal stress of an incompressible solid with W(I1, I2)."""
    if state == "shear":
        return float(2.0 * t * sum(slopes(t * t, t * t)))
    I1, I2 = {"pull": (t**2 + 2.0 / t, 2.0 * t + t**-2.0), "both": (2.0 * t**2 + t**-4.0, t**4 + 2.0 * t**-2.0),
              "held": (1.0 + t**2 + t**-2.0, 1.0 + t**2 + t**-2.0)}[state]  # fmt: skip
    W1, W2 = slopes(I1 - 3.0, I2 - 3.0)
    form = {"pull": (t - t**-2.0) * (W1 + W2 / t), "both": (t - t**-5.0) * (W1 + t * t * W2),
            "held": (t - t**-3.0) * (W1 + W2)}[state]  # fmt: skip
    return 2.0 * form


# m C_n / limit^(2n - 2) n I1^(n - 1), with the coefficients of Arruda and Boyce (1993), equation 21
COEFFICIENTS = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)
SLOPES: list[tuple[IsochoricMaterial, Slopes]] = [
    (MooneyRivlin(c1=6.0, c2=4.0, **RUBBER), lambda i, k: (6.0, 4.0)),
    (Yeoh(c1=10.0, c2=0.5, c3=0.01, **RUBBER), lambda i, k: (10.0 + i + 0.03 * i * i, 0.0)),
    (Gent(mu=20.0, limit=30.0, **RUBBER), lambda i, k: (10.0 * 30.0 / (30.0 - i), 0.0)),
    (Fung(mu=20.0, b=1.0, **RUBBER), lambda i, k: (10.0 * np.exp(i), 0.0)),
    (VerondaWestmann(c=5.0, a=2.0, **RUBBER), lambda i, k: (10.0 * np.exp(2.0 * i), -5.0)),
    (ArrudaBoyce(m=20.0, limit=2.8, **RUBBER), lambda i, k: (
        20.0 * sum(n * c * (3.0 + i) ** (n - 1) / 2.8 ** (2 * n - 2) for n, c in enumerate(COEFFICIENTS, 1)), 0.0)),
]  # fmt: skip


@pytest.mark.parametrize(("material", "slopes"), SLOPES, ids=[type(m).__name__ for m, _ in SLOPES])
@pytest.mark.parametrize("state", ["pull", "both", "held", "shear"])
def test_nominal_stress_is_the_closed_form(material: IsochoricMaterial, slopes: Slopes, state: str) -> None:
    """To 1e-9 of itself, which is rounding by the largest of the stresses that cancel."""
    for t in (0.6, 0.9, 1.0 + 1e-5, 1.4, 2.0):
        assert nominal(material, state, t) == pytest.approx(closed(slopes, state, t), rel=1e-9)


@pytest.mark.parametrize(("state", "power"), [("pull", -0.5), ("both", -2.0), ("held", -1.0)])
def test_nominal_stress_of_ogden_is_the_closed_form(state: str, power: float) -> None:
    """sum mu (t^(alpha - 1) - t^(power alpha - 1)), power that of the stretch of the free direction."""
    material = Ogden(mu=(0.63, 0.0012, -0.01), alpha=(1.3, 5.0, -2.0), **RUBBER)
    for t in (0.6, 0.9, 1.0 + 1e-5, 1.4, 2.0, 6.0):
        known = sum(
            m * (t ** (a - 1.0) - t ** (power * a - 1.0)) for m, a in zip(material.mu, material.alpha, strict=True)
        )
        assert nominal(material, state, t) == pytest.approx(known, rel=1e-9)


@pytest.mark.parametrize("name", OWN)
@pytest.mark.parametrize("volumetric", VOLUMETRIC)
def test_confined_and_swollen_states_are_closed_forms(name: str, volumetric: str) -> None:
    """Volume alone: P = K g g' J^(2/3) of a dilatation to J. Confined to t = J: the volume's share is K g g'."""
    material = made(name, 2.6, 0.3, volumetric=volumetric)
    K = 2.6 / 1.2
    measure: Any = {"squared": (lambda J: J - 1.0, lambda J: 1.0), "logarithmic": (np.log, lambda J: 1.0 / J),
               "reciprocal": (lambda J: (J - 1.0 / J) / 2.0, lambda J: (1.0 + J**-2) / 2.0)}[volumetric]  # fmt: skip
    for J in (0.5, 0.9, 1.2, 2.0):
        known = K * measure[0](J) * measure[1](J)
        P = law_for(material, "finite").P(J ** (1.0 / 3.0) * np.eye(3)[None])[0]
        np.testing.assert_allclose(P, known * J ** (2.0 / 3.0) * np.eye(3), rtol=1e-9, atol=1e-12)
        held = law_for(material, "finite").P(np.diag([J, 1.0, 1.0])[None])[0]
        mean = (held[0, 0] * J + held[1, 1] + held[2, 2]) / 3.0  # of Kirchhoff: no shape has any
        assert mean == pytest.approx(J * known, rel=1e-9)


# ------------------------------------------------------------------ the same by other ways


STRETCHES = np.random.default_rng(8).uniform(0.6, 1.6, (40, 3))


def turned(stretches: Array, seed: int = 2) -> Array:
    """F = Q diag(stretches) R with any rotations (m, 3, 3)."""
    Q, R = (np.linalg.qr(A)[0] for A in np.random.default_rng(seed).standard_normal((2, len(stretches), 3, 3)))
    Q, R = (A * np.sign(np.linalg.det(A))[:, None, None] for A in (Q, R))
    return np.asarray((Q * stretches[:, None, :]) @ R)


def test_mooney_rivlin_without_a_second_constant_is_neo_hookean() -> None:
    ours = law_for(MooneyRivlin(c1=0.5, c2=0.0, poisson=0.4, density=1.0), "finite")
    theirs = law_for(NeoHookeanIsochoric(2.8, 0.4, 1.0), "finite")
    F = turned(STRETCHES)
    close(ours.psi(F), theirs.psi(F), 1e-13)
    close(ours.P(F), theirs.P(F), 1e-13)
    close(ours.dPdF(F), theirs.dPdF(F), 1e-13)


NEAR = [0.0, 1e-16, 1e-13, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2]


@pytest.mark.parametrize("volumetric", VOLUMETRIC)
def test_ogden_is_mooney_rivlin_where_stretches_coincide(volumetric: Any) -> None:
    """alpha = [2, -2]: the same law without principal stretches. Two alike, three alike, and all gaps between.

    Quotients of differences would lose 16 digits less those of the gap; what is left here is rounding.
    """
    rest: dict[str, Any] = {"poisson": 0.4, "density": 1.0, "volumetric": volumetric}
    ours = law_for(Ogden(mu=(0.6, -0.4), alpha=(2.0, -2.0), **rest), "finite")
    theirs = law_for(MooneyRivlin(c1=0.3, c2=0.2, **rest), "finite")
    pairs = [[1.3, 1.3 + gap, 0.7] for gap in NEAR] + [[0.8, 0.8 + gap, 0.8 - gap] for gap in NEAR]
    F = np.concatenate([turned(np.array(pairs)), turned(STRETCHES), np.array([np.diag(p) for p in pairs])])
    close(ours.psi(F), theirs.psi(F), 1e-13)
    close(ours.P(F), theirs.P(F), 1e-13)
    close(ours.dPdF(F), theirs.dPdF(F), 1e-12)
    close(ours.dPdF_projected(F), theirs.dPdF_projected(F), 1e-12)


@pytest.mark.parametrize("name", OWN)
@pytest.mark.parametrize("volumetric", VOLUMETRIC)
def test_stresses_written_out_again_agree(name: str, volumetric: str) -> None:
    """The closed forms of tests/shared/written_stresses.py, whole and in two terms, as the parts of the law."""
    material = made(name, 2.6, 0.4, volumetric=volumetric)
    assert isinstance(material, IsochoricMaterial)
    F, parts = turned(STRETCHES), material.finite_parts()
    assert parts is not None
    (whole,), both = Written(material).terms(False), Written(material).terms(True)
    close(whole(F), law_for(material, "finite").P(F), 1e-13)
    for term, part in zip(both, parts, strict=True):
        close(term(F), part.P(F), 1e-13)


FINITE_LAWS = [name for name in MATERIALS if made(name, 1.0, 0.3).finite_law() is not None]


@pytest.mark.parametrize("name", FINITE_LAWS)
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49999])
def test_the_energy_of_every_law_has_the_stress_that_is_published(name: str, poisson: float) -> None:
    """Closed forms against the stress and against differences of the energy: a wrong energy density is seen here.

    A law that is added fails until its stress is in tests/shared/written_stresses.py. Differences leave 1e-12 of the
    stress, and of K / mu = 5e4 as much as that of the part that cancels.
    """
    law, known = made(name, 2.6, poisson), stress_of(made(name, 2.6, poisson))
    F = turned(STRETCHES)
    close(known(F), law_for(law, "finite").P(F), 1e-12)
    P, error = EnergyStress(law_for(law, "finite").psi).with_error(F)
    left = np.abs(P - known(F)).max(axis=(1, 2))
    assert (left < 50.0 * error + 1e-14).all()  # the factor that the force check has for rounding too
    assert (left < 1e-10 * np.abs(known(F)).max(axis=(1, 2))).all()


@pytest.mark.parametrize("name", OWN)
@pytest.mark.parametrize("volumetric", VOLUMETRIC)
def test_derivatives_with_every_energy_of_the_volume(name: str, volumetric: str) -> None:
    """Central differences at unit scale, beside those of test_materials.py: errors of 1e-10, a wrong term 1e-3."""
    law, F = law_for(made(name, 1.0, 0.3, volumetric=volumetric), "finite"), turned(STRETCHES[:12])
    close(difference(law.psi, F), law.P(F), 1e-7)
    close(difference(law.P, F), law.dPdF(F), 1e-7)


# ------------------------------------------------------------------ constants


def test_what_others_ask_follows_from_the_constants() -> None:
    """mu = 2 (c1 + c2) = 20; nu = 0.25: E = 50, lam = mu, K = 5/3 mu; and by K in place of nu the same."""
    for more in ({"poisson": 0.25}, {"bulk": 100.0 / 3.0}):
        material = MooneyRivlin(c1=6.0, c2=4.0, density=1.0, **more)  # type: ignore[arg-type]
        assert material.shear_modulus == pytest.approx(20.0, rel=1e-15)
        assert material.young == pytest.approx(50.0, rel=1e-15)
        assert material.poisson == pytest.approx(0.25, rel=1e-15)
        assert material.lame_lambda == pytest.approx(20.0, rel=1e-14)
        assert material.bulk_modulus == pytest.approx(100.0 / 3.0, rel=1e-14)
    changed = replace(material, c1=1.0)  # K stays
    assert changed.bulk_modulus == pytest.approx(100.0 / 3.0, rel=1e-14)


def test_constants_that_do_not_go_together_are_refused() -> None:
    with pytest.raises(InvalidCombination, match="2 constants `mu` but 1 exponents"):
        Ogden(mu=(1.0, 2.0), alpha=(2.0,), **RUBBER)
    with pytest.raises(InvalidCombination, match="not positive"):
        Ogden(mu=(1.0, -2.0), alpha=(2.0, 2.0), **RUBBER)
    with pytest.raises(InvalidCombination, match="exponent 0"):
        Ogden(mu=(1.0, 2.0), alpha=(2.0, 0.0), **RUBBER)
    with pytest.raises(ValueError, match="needs `poisson` or `bulk`"):
        Gent(mu=1.0, limit=30.0, density=1.0)


def test_the_limit_of_gent_is_that_of_its_domain() -> None:
    """I1 - 3 = 4 at simple shear by 2: infinite energy there and beyond, stress and stiffness not a number."""
    law = law_for(Gent(mu=1.0, limit=4.0, poisson=0.4, density=1.0), "finite")
    F = np.stack([gradient("shear", g) for g in (1.999, 2.001, 3.0)])
    assert np.isfinite(law.psi(F)).tolist() == [True, False, False]
    for f in (law.P, law.dPdF):
        assert np.isfinite(f(F)).reshape(3, -1).all(axis=1).tolist() == [True, False, False]


def test_every_law_with_constants_of_its_own_is_in_these_tests() -> None:
    assert OWN.keys() == {n for n, m in MATERIALS.items() if issubclass(m, IsochoricMaterial)}


# ------------------------------------------------------------------ a bent bar, by FElupe on the same mesh

# FElupe 11.3.0 with tensortrax 0.29.0 for the energies (its own `mooney_rivlin`, `yeoh` and `ogden`, the others as
# their documentation here writes them) and `Volumetric(bulk = 200 kPa)`: displacement, m, of the far upper corner of a
# bar of 40 x 10 x 10 mm, 32 hexahedra of 8 nodes, clamped at x = 0, under 2e5 N/m^3 along x, -3e5 along z, to 1e-10
BAR: dict[str, tuple[dict[str, Any], tuple[float, float, float]]] = {
    "mooney_rivlin": ({"c1": 6e3, "c2": 4e3},
        (-0.005665438328719108, -4.405395630864901e-05, -0.03720144901548121)),
    "yeoh": ({"c1": 10e3, "c2": -500.0, "c3": 100.0},
        (-0.005764477379338583, -4.3713845236447226e-05, -0.0367345623761005)),
    "ogden": ({"mu": (16e3, 500.0, -2e3), "alpha": (1.3, 5.0, -2.0)},
        (-0.005036587856601291, -7.646947233405307e-05, -0.04103641977878445)),
    "arruda_boyce": ({"m": 16e3, "limit": 1.8},
        (-0.005655514014835188, -4.3487328601138134e-05, -0.036019743377158485)),
    "gent": ({"mu": 20e3, "limit": 5.0},
        (-0.005595771000943933, -4.425873161216067e-05, -0.035800387164033436)),
    "fung": ({"mu": 20e3, "b": 1.0},
        (-0.005266392256159738, -4.533927762939325e-05, -0.03419629310475732)),
    "veronda_westmann": ({"c": 10e3, "a": 2.0},
        (-0.004715418570882971, -4.6011602785473775e-05, -0.03124914650861457)),
}  # fmt: skip


@pytest.mark.parametrize("name", BAR)
def test_a_bent_bar_is_that_of_felupe(name: str) -> None:
    """A tip that sinks by most of the length, to 1e-8; all of the field agreed to 2e-9 when the numbers were taken."""
    constants, known = BAR[name]
    of: Any = MATERIALS[name]
    material = of(**constants, bulk=200e3, density=1.0)
    mesh = Box((40e-3, 10e-3, 10e-3)).mesh("hex8", 5e-3)
    parts = integrate_cells(mesh)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, "finite"))
    f = np.zeros_like(mesh.points)
    np.add.at(f, mesh.cells, (parts.w @ parts.N)[:, :, None] * [2e5, 0.0, -3e5])
    fixed = (3 * np.nonzero(mesh.points[:, 0] < 1e-9)[0][:, None] + np.arange(3)).ravel()
    assembly = Assembly(f.size, fixed, [elastic], [DeadForces(f.ravel())])
    problem = Statics(assembly, VectorSpace(f.size), np.zeros(f.size), fixed, np.zeros(len(fixed)), 1e-11)
    turning = replace(elastic, law=law_for(material, "corotational"))
    u = equilibrium(replace(problem, twin=assembly.with_internal([turning]))).x.reshape(-1, 3)
    corner = int(np.argmax(mesh.points.sum(axis=1)))
    assert np.linalg.norm(u[corner] - known) <= 1e-8 * np.linalg.norm(known)
