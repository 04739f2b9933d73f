"""Laws of materials that know directions: what every one obeys, and what is published of some."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from anisotropic_laws import F0, GUCCIONE, S0
from anisotropic_laws import LAWS as COMMON
from deformations import close, difference, rotations
from numpy.typing import NDArray
from scipy.optimize import brentq
from written_stresses import directed_stress

from softmark.solvers.independent_forces import fiber_axes_by_differences as checks
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress
from softmark.solvers.materials import DIRECTED, MATERIALS, law_for, mixed_for
from softmark.solvers.materials.active_strain import ActiveStrain
from softmark.solvers.materials.active_stress import Active
from softmark.solvers.materials.active_wrapper import ActiveMaterial
from softmark.solvers.materials.fiber_reinforced import FiberLaw
from softmark.solvers.materials.material_axes import InvalidDirection, MaterialFrame

Array = NDArray[np.float64]

LAWS: dict[str, Any] = {
    **COMMON,
    "active gent": DIRECTED["active"](MATERIALS["gent"](1.0, 30.0, poisson=0.3, density=1.0), 2.0, F0),
    "short": DIRECTED["active_strain"](GUCCIONE, 0.2),
    "short heart": DIRECTED["active_strain"](
        DIRECTED["holzapfel_ogden"](1.0, 2.0, 3.0, 1.0, 2.0, 1.0, 0.5, 2.0, 1.0, F0, S0, 3.0), 0.1),
    "short rubber": DIRECTED["active_strain"](MATERIALS["neo_hookean"](1.0, 0.3, 1.0), 0.3, F0),
    "long gent": DIRECTED["active_strain"](MATERIALS["gent"](1.0, 30.0, poisson=0.3, density=1.0), -0.3, F0),
}  # fmt: skip
AROUND = {
    "guccione",
    "tendon",
    "linear fibres",
    "muscle",
    "active rubber",
    "active gent",
    "short",
    "short rubber",
    "long gent",
}  # alike all around the fibres
PASSIVE = [name for name in LAWS if not isinstance(LAWS[name], ActiveMaterial)]


def gradients(m: int = 40) -> Array:
    """F (m, 3, 3) with any rotations and stretches from 0.7 to 1.4."""
    s = np.random.default_rng(1).uniform(0.7, 1.4, (m, 3))
    return np.asarray((rotations(np.random.default_rng(2), m) * s[:, None, :]) @ rotations(np.random.default_rng(3), m))


def about(axis: Array, angle: float) -> Array:
    """The rotation about an axis (3, 3), by Rodrigues."""
    K = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) - math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K)


@pytest.mark.parametrize("name", LAWS)
def test_stress_and_stiffness_are_derivatives(name: str) -> None:
    """Truncation of step^2 and rounding of 1e-16/step, relative to exponentials of 1e2: 1e-9; a wrong term is 1e-2."""
    law, F = LAWS[name], gradients()
    close(difference(law.psi, F, 1e-6), law.P(F), 1e-8)
    close(difference(law.P, F, 1e-6), law.dPdF(F), 1e-8)
    H = law.dPdF(F)
    np.testing.assert_array_equal(H, H.transpose(0, 3, 4, 1, 2))


@pytest.mark.parametrize("name", LAWS)
def test_objectivity(name: str) -> None:
    """psi(Q F) = psi(F) and P(Q F) = Q P(F): to rounding of the exponents, up to 10."""
    law, F = LAWS[name], gradients()
    Q = rotations(np.random.default_rng(4), len(F))
    close(law.psi(Q @ F), law.psi(F), 1e-12)
    close(law.P(Q @ F), Q @ law.P(F), 1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_symmetry_groups(name: str) -> None:
    """Half turns about fibres, sheets and across both leave every law as it is; any turn about fibres, some of them."""
    law, F = LAWS[name], gradients()
    axes = law.frame.axes(np.float64)[..., 0]
    for axis in axes:
        close(law.psi(F @ about(axis, math.pi)), law.psi(F), 1e-12)
    turned = law.psi(F @ about(axes[0], 0.7))
    apart = np.abs(turned - law.psi(F)).max() / np.abs(law.psi(F)).max()
    assert apart < 1e-12 if name in AROUND else apart > 1e-3
    across = np.abs(law.psi(F @ about(axes[1], 0.7)) - law.psi(F)).max() / np.abs(law.psi(F)).max()
    assert across > 1e-3


@pytest.mark.parametrize("law", [
    replace(GUCCIONE, bf=2.0, bfs=2.0), replace(LAWS["artery"], kappa=1.0 / 3.0, angle=0.3),
], ids=["guccione with one exponent", "collagen in all directions"])  # fmt: skip
def test_without_a_preferred_direction_a_law_is_isotropic(law: Any) -> None:
    F = gradients()
    close(law.psi(F @ rotations(np.random.default_rng(5), len(F))), law.psi(F), 1e-12)


@pytest.mark.parametrize("name", PASSIVE)
def test_at_rest_there_is_no_stress(name: str) -> None:
    """And energy grows from there."""
    law = LAWS[name]
    assert np.abs(law.P(np.eye(3)[None])).max() < 1e-15
    assert law.psi(np.eye(3)[None])[0] < 1e-30
    near = np.eye(3) + 1e-4 * np.random.default_rng(6).standard_normal((50, 3, 3))
    assert (law.psi(near) > 0.0).all()


@pytest.mark.parametrize("name", LAWS)
def test_other_formulas_agree(name: str) -> None:
    """S = 2 dpsi/dC in axes along the fibres, written out; muscle is what it is at ease, and its tension.

    So do differences of the energy, to 1e-10 of the stress or the error that they state of themselves.
    """
    law, F = LAWS[name], gradients()
    if isinstance(law, Active):
        pull = checks.active_stress(np.array([law.tension]), np.array([law.fibres]))(F)
        close(law.within.P(F) + pull, law.P(F), 1e-12)
        return
    if isinstance(law, ActiveStrain):
        again = checks.energy_with_shortening(law.within.psi, np.array([law.shortening]), np.array([law.fibres]))
        close(EnergyStress(again)(F), law.P(F), 1e-10)
        return
    axes = law.frame.axes(np.float64)[..., 0][None]
    close(directed_stress(law, axes, law.bulk)(F), law.P(F), 1e-12)
    P, error = EnergyStress(checks.energy_along_axes(law, axes, law.bulk)).with_error(F)
    close(P, law.P(F), 1e-10)
    assert (np.abs(P - law.P(F)).max(axis=(1, 2)) < 20.0 * error).all()
    mixed, split = mixed_for(law, "finite"), checks.split_off_pressure(law, axes)
    assert mixed is not None
    close(split.shape(F), mixed.shape.P(F), 1e-10)
    close(split.dg(F), mixed.constraint.gradient(F), 1e-14)
    assert split.compliance == pytest.approx(mixed.compliance, rel=1e-14)


@pytest.mark.parametrize("name", LAWS)
def test_with_a_pressure_it_is_the_same_law(name: str) -> None:
    """psi_shape + M/2 g^2 = psi; M is infinite where the volume cannot change, which leaves the shape as it is."""
    law, F = LAWS[name], gradients()
    mixed = mixed_for(law, "finite")
    assert mixed is not None
    close(mixed.shape.psi(F) + 0.5 * mixed.modulus * mixed.constraint.value(F) ** 2, law.psi(F), 1e-12)
    if name in PASSIVE:
        tight = mixed_for(replace(law, bulk=None), "finite")
        assert tight is not None
        assert tight.compliance == 0.0
        assert law.poisson < replace(law, bulk=None).poisson == 0.5


@pytest.mark.parametrize("name", [name for name in LAWS if isinstance(LAWS[name], ActiveStrain)])
def test_short_fibres_are_at_rest_where_nothing_holds_them(name: str) -> None:
    """At F = Fa, of determinant one, is no stress; at F = I rubber has that of fibres stretched by 1 / (1 - s)."""
    law = LAWS[name]
    s, f = law.shortening, law.frame.axes(np.float64)[0, :, 0]
    Fa = (1.0 - s) * np.outer(f, f) + (1.0 - s) ** -0.5 * (np.eye(3) - np.outer(f, f))
    assert np.linalg.det(Fa) == pytest.approx(1.0, rel=1e-14)
    assert np.abs(law.P(Fa[None])).max() < 1e-14
    if name == "short rubber":  # mu (l^2 - 1/l) of the difference along and across, which no pressure changes
        sigma, mu, stretch = law.P(np.eye(3)[None])[0], law.law.shear_modulus, 1.0 / (1.0 - s)
        across = np.trace(sigma) - f @ sigma @ f
        assert f @ sigma @ f - 0.5 * across == pytest.approx(mu * (stretch**2 - 1.0 / stretch), rel=1e-13)


def along(law: Any, frame: MaterialFrame) -> Any:
    """The same law with other directions."""
    if isinstance(law, ActiveMaterial):
        return replace(law, own=frame) if law.own is not None else replace(law, law=along(law.law, frame))
    return replace(law, fibres=frame, **({"sheets": None} if "sheets" in vars(law) else {}))


@pytest.mark.parametrize("name", LAWS)
def test_directions_of_points_are_those_of_each(name: str) -> None:
    """Arrays of directions, over more points than a block has, give what each point has by itself."""
    m, F = 3 * 1500, gradients(3 * 1500)
    f, s = np.random.default_rng(7).standard_normal((2, m, 3))
    many = law_for(along(LAWS[name], MaterialFrame.at(f, s, (1500, 3))), "finite")
    P, A = many.P(F), many.dPdF(F)
    for i in (0, 17, 4095, 4096, m - 1):
        one = along(LAWS[name], MaterialFrame.of(tuple(f[i]), tuple(s[i])))
        close(P[i], one.P(F[i : i + 1])[0], 1e-12)
        close(A[i], one.dPdF(F[i : i + 1])[0], 1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_the_projected_stiffness_is_definite(name: str) -> None:
    H = LAWS[name].dPdF_projected(gradients()).reshape(-1, 9, 9)
    assert np.linalg.eigvalsh(H).min() > -1e-12 * np.abs(H).max()


# ------------------------------------------------------------------ published numbers (REFERENCES.md 3.5)


def stress(law: Any, first: float, second: float) -> Array:
    """Cauchy stress, Pa, along axes of an incompressible solid stretched along x and y and free along z."""
    F = np.diag([first, second, 1.0 / (first * second)])[None]
    sigma = law.P(F)[0] @ F[0].T
    return np.asarray(np.diag(sigma) - sigma[2, 2])


def artery(kappa: float) -> Any:
    """Adventitia of Gasser, Ogden and Holzapfel (2006), whose volume cannot change."""
    wall = DIRECTED["holzapfel_gasser_ogden"]
    return wall(7.64e3, 996.6e3, 524.6, math.radians(49.98), 1000.0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), kappa)


@pytest.mark.parametrize(("kappa", "stretch", "kPa"), [
    (0.226, 1.05, (75.955, 97.535)), (0.226, 1.10, (7752.3, 9615.7)),
    (1.0 / 3.0, 1.05, (5.72793, 5.72793)), (1.0 / 3.0, 1.10, (48.6600, 48.6600)),
])  # fmt: skip
def test_an_artery_stretched_both_ways(kappa: float, stretch: float, kPa: tuple[float, float]) -> None:
    """To the five digits that are given."""
    np.testing.assert_allclose(stress(artery(kappa), stretch, stretch)[:2] / 1e3, kPa, rtol=1e-5)


@pytest.mark.parametrize(("kappa", "stretch", "kPa", "across"), [
    (0.226, 1.05, 1.42114, 0.960087), (0.226, 1.10, 4.06979, 0.907416), (0.226, 1.20, 48.2446, 0.800023),
    (0.0, 1.05, 1.27178, None), (0.0, 1.10, 2.73031, None), (0.0, 1.20, 6.82119, None),
])  # fmt: skip
def test_an_artery_stretched_one_way(kappa: float, stretch: float, kPa: float, across: float | None) -> None:
    """To the six digits that are given, with fibres that begin within a strain of 1e-4: E here is above 4e-4."""
    law = artery(kappa)
    second = brentq(lambda b: stress(law, stretch, b)[1], 0.5, 1.0, xtol=1e-14)
    assert stress(law, stretch, second)[0] / 1e3 == pytest.approx(kPa, rel=5e-6)
    assert across is None or second == pytest.approx(across, abs=6e-7)


@pytest.mark.parametrize(("stretch", "kPa"), [
    (0.9, -1.60852), (1.05, 1.01818), (1.1, 2.42069), (1.2, 8.09652), (1.3, 26.4674),
])  # fmt: skip
def test_heart_muscle_stretched_along_its_fibres(stretch: float, kPa: float) -> None:
    """Guccione with C = 2 kPa, 8, 2, 4; to the six digits that are given."""
    law = DIRECTED["guccione"](2e3, 8.0, 2.0, 4.0, 1000.0, (1.0, 0.0, 0.0))
    assert stress(law, stretch, stretch**-0.5)[0] / 1e3 == pytest.approx(kPa, rel=5e-6)


def test_heart_muscle_that_pulls() -> None:
    """T f (x) f, second Piola-Kirchhoff: Cauchy stress along fibres grows by T stretch^2, and nothing else changes."""
    law = DIRECTED["guccione"](2e3, 8.0, 2.0, 4.0, 1000.0, (1.0, 0.0, 0.0))
    pulls = DIRECTED["active"](law, 60e3)
    np.testing.assert_allclose(stress(pulls, 1.1, 1.0) - stress(law, 1.1, 1.0), [60e3 * 1.21, 0.0, 0.0], atol=1e-9)


# ------------------------------------------------------------------ fibres that are slack, and directions


@pytest.mark.parametrize(("k2", "onset"), [(0.0, 1e-4), (3.0, 0.1), (524.6, 1e-3), (50.0, 0.1)])
def test_fibres_are_taken_up_smoothly(k2: float, onset: float) -> None:
    """None in compression, the formula beyond the onset; stress and its slope meet at both ends and never fall."""
    strand, formula = FiberLaw(2.0, k2, onset), FiberLaw(2.0, k2)
    E = onset * np.linspace(-1.0, 3.0, 4001)
    psi, slope, curvature = strand.energy_and_derivatives(E)
    assert not np.stack([psi, slope, curvature])[:, E <= 0.0].any()
    beyond = np.greater_equal(E, onset)
    np.testing.assert_array_equal(slope[beyond], formula.energy_and_derivatives(E)[1][beyond])
    assert (curvature >= 0.0).all()
    assert (np.diff(psi) >= 0.0).all()
    jump = np.abs(np.diff(curvature)).max() / curvature.max()
    assert jump < 0.01  # a switch would have 1
    close(np.diff(slope) / np.diff(E), 0.5 * (curvature[1:] + curvature[:-1]), 1e-5)
    close(np.diff(psi) / np.diff(E), 0.5 * (slope[1:] + slope[:-1]), 1e-5)


def test_sheets_are_what_of_them_lies_across_the_fibres() -> None:
    axes = MaterialFrame.of((1.0, 1.0, 0.0), (0.0, 1.0, 0.0)).axes(np.float64)[..., 0]
    np.testing.assert_allclose(
        axes, np.array([[1, 1, 0], [-1, 1, 0], [0, 0, math.sqrt(2.0)]]) / math.sqrt(2.0), atol=1e-15
    )
    for sheets in ((2.0, 2.0, 0.0), (0.0, 0.0, 0.0)):
        with pytest.raises(InvalidDirection):
            MaterialFrame.of((1.0, 1.0, 0.0), sheets)
    with pytest.raises(InvalidDirection):
        MaterialFrame.at(np.zeros((2, 3)), None, (2, 1))
