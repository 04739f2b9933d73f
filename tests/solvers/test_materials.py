"""Laws that every law of elasticity obeys, asserted over the registry."""

from __future__ import annotations

import subprocess
import sys
import typing
from pathlib import Path

import equal_moduli
import numpy as np
import pytest
from deformations import close, difference, rotations
from equal_moduli import made
from numpy.typing import NDArray

from softmark.solvers.materials import (
    MATERIALS,
    STRAINS,
    Law,
    NoFiniteLaw,
    batching,
    law_for,
    project,
    shear_and_volume_laws,
)
from softmark.solvers.materials.corotational import FLOOR, Corotational
from softmark.solvers.materials.hyperelastic import Hyperelastic
from softmark.solvers.materials.linear_elastic import LinearElastic
from softmark.solvers.materials.neo_hookean import NeoHookean

Array = NDArray[np.float64]


def laws(young: float = 1.0, poisson: float = 0.3) -> dict[str, Law]:
    """Every law there is: the two strain measures, and the finite law of every material that has one."""
    hooke = LinearElastic(young, poisson, density=1.0)
    materials = {name: made(name, young, poisson) for name in MATERIALS}
    finite = {name: law_for(m, "finite") for name, m in materials.items() if m.finite_law() is not None}
    return {strain: law_for(hooke, strain) for strain in ("small", "corotational")} | finite


def gradients(low: tuple[float, ...], high: tuple[float, ...], m: int = 40, seed: int = 1) -> Array:
    """F = U diag(s) V^T (m, 3, 3) with any rotations U, V and s between low and high."""
    rng = np.random.default_rng(seed)
    s = rng.uniform(low, high, (m, 3))
    return np.asarray((rotations(rng, m) * s[:, None, :]) @ rotations(rng, m))


STRETCHED = gradients((0.6, 0.6, 0.6), (1.6, 1.6, 1.6))
INSIDE_OUT = gradients((1.1, 0.8, -0.6), (1.5, 1.1, -0.2))
PULLED = gradients((1.02, 1.02, 1.02), (1.08, 1.08, 1.08))
NAMES = tuple(laws())
OBJECTIVE = tuple(name for name in NAMES if name != "small")
EVERYWHERE = tuple(name for name, law in laws().items() if np.isfinite(law.psi(INSIDE_OUT)).all())
CONSTANTS = pytest.mark.parametrize(
    ("young", "poisson"), [(1.0, 0.3), (1.0, -0.4), (1e5, 0.499)], ids=["unit", "auxetic", "stiff"]
)


def states(name: str) -> Array:
    """Stretches with large rotations, and where the law is defined also elements that are inside out."""
    return np.concatenate((STRETCHED, INSIDE_OUT)) if name in EVERYWHERE else STRETCHED


def test_which_laws_are_defined_inside_out() -> None:
    """The list that the other tests draw on: no ln J and no J^(-2/3) in these."""
    assert set(EVERYWHERE) == {"small", "corotational", "st_venant_kirchhoff", "stable_neo_hookean"}


@CONSTANTS
@pytest.mark.parametrize("name", NAMES)
def test_stress_is_the_derivative_of_the_energy(name: str, young: float, poisson: float) -> None:
    """Truncation step^2 psi'''/6 and round-off 1e-16/step are about 1e-10; a wrong term shows above 1e-3."""
    law, F = laws(young, poisson)[name], states(name)
    close(difference(law.psi, F), law.P(F), 1e-7)


@CONSTANTS
@pytest.mark.parametrize("name", NAMES)
def test_stiffness_is_the_derivative_of_the_stress(name: str, young: float, poisson: float) -> None:
    """Tolerance as for the stress."""
    law, F = laws(young, poisson)[name], states(name)
    close(difference(law.P, F), law.dPdF(F), 1e-7)


@pytest.mark.parametrize("name", NAMES)
def test_stiffness_has_major_symmetry(name: str) -> None:
    """It is the second derivative of an energy: equal bit by bit, since half is a copy of the other half."""
    H = laws()[name].dPdF(states(name))
    np.testing.assert_array_equal(H, H.transpose(0, 3, 4, 1, 2))


@pytest.mark.parametrize("name", OBJECTIVE)
def test_objectivity(name: str) -> None:
    """psi(Q F) = psi(F) and P(Q F) = Q P(F), to round-off."""
    law, F = laws()[name], states(name)
    Q = rotations(np.random.default_rng(2), len(F))
    close(law.psi(Q @ F), law.psi(F), 1e-13)
    close(law.P(Q @ F), Q @ law.P(F), 1e-13)


@pytest.mark.parametrize("name", OBJECTIVE)
def test_isotropy(name: str) -> None:
    """psi(F Q) = psi(F) and P(F Q) = P(F) Q, to round-off."""
    law, F = laws()[name], states(name)
    Q = rotations(np.random.default_rng(3), len(F))
    close(law.psi(F @ Q), law.psi(F), 1e-13)
    close(law.P(F @ Q), law.P(F) @ Q, 1e-13)


@pytest.mark.parametrize("name", OBJECTIVE)
def test_stiffness_follows_rotations_from_either_side(name: str) -> None:
    """The derivatives of objectivity and isotropy: dPdF : (W F) = W P and dPdF : (F W) = P W for skew W."""
    law, F = laws()[name], states(name)
    A = np.random.default_rng(4).standard_normal(F.shape)
    W = A - A.transpose(0, 2, 1)
    H, P = law.dPdF(F), law.P(F)
    scale = np.abs(H).max() * np.abs(W).max()
    np.testing.assert_allclose(np.einsum("miJkL,mkL->miJ", H, W @ F), W @ P, rtol=0.0, atol=1e-13 * scale)
    np.testing.assert_allclose(np.einsum("miJkL,mkL->miJ", H, F @ W), P @ W, rtol=0.0, atol=1e-13 * scale)


def about_z(angle: float) -> Array:
    """Rotation by `angle` about z (1, 3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]])


@pytest.mark.parametrize("name", OBJECTIVE)
def test_quarter_turn_leaves_no_stress(name: str) -> None:
    """A rotation stores nothing; what remains is round-off (cos 90 degrees = 6e-17) times moduli near 1."""
    law = laws()[name]
    assert abs(law.psi(about_z(np.pi / 2))[0]) < 1e-15
    assert np.abs(law.P(about_z(np.pi / 2))).max() < 1e-15


@pytest.mark.parametrize(
    ("degrees", "strain"),
    [(1, -1.523e-4), (5, -3.805e-3), (10, -0.01519), (30, -0.13397), (45, -0.29289), (90, -1.0)],
)
def test_small_strain_takes_a_rotation_for_a_strain(degrees: float, strain: float) -> None:
    """eps_xx = eps_yy = cos th - 1, tabulated to 4 or 5 digits; with E = 1, nu = 0 it is the stress."""
    P = laws(1.0, 0.0)["small"].P(about_z(np.radians(degrees)))[0]
    np.testing.assert_allclose([P[0, 0], P[1, 1]], strain, rtol=2e-4)
    np.testing.assert_allclose([P[2, 2], P[0, 1], P[1, 0]], 0.0, atol=1e-16)


@CONSTANTS
@pytest.mark.parametrize("name", NAMES)
def test_hooke_at_rest(name: str, young: float, poisson: float) -> None:
    """dPdF(I) = mu (d_ik d_JL + d_iL d_kJ) + lam d_iJ d_kL, and no stress and no energy, to round-off."""
    law, d = laws(young, poisson)[name], np.eye(3)
    mu = young / (2.0 * (1.0 + poisson))
    lam = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    hooke = mu * (np.einsum("ik,JL->iJkL", d, d) + np.einsum("iL,kJ->iJkL", d, d))
    hooke += lam * np.einsum("iJ,kL->iJkL", d, d)
    close(law.dPdF(d[None])[0], hooke, 1e-15)
    assert np.abs(law.P(d[None])).max() == 0.0
    assert law.psi(d[None])[0] == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_energy_is_accurate_near_rest(name: str) -> None:
    """At a strain of 1e-9 psi is Hooke's quadratic to 1e-6; det F - 1 or I1 - 3 as written would leave 1e+2.

    What limits it is the round-off of F - R in the corotational law, 1e-16 of a strain of 1e-9.
    """
    F = np.eye(3) + 1e-9 * np.random.default_rng(5).uniform(-1.0, 1.0, (20, 3, 3))
    eps = 0.5 * ((F - np.eye(3)) + (F - np.eye(3)).transpose(0, 2, 1))
    mu, lam = 1.0 / 2.6, 0.3 / (1.3 * 0.4)
    quadratic = mu * (eps * eps).sum((1, 2)) + 0.5 * lam * np.trace(eps, axis1=1, axis2=2) ** 2
    np.testing.assert_allclose(laws()[name].psi(F), quadratic, rtol=1e-6)


@pytest.mark.parametrize("name", OBJECTIVE)
def test_only_rotations_are_free_in_any_unstressed_state(name: str) -> None:
    """At F = Q the nine modes are three rotations Q W of no stiffness, five shears 2 mu, one swelling 3 K."""
    F = rotations(np.random.default_rng(6), 5)
    w = np.linalg.eigvalsh(laws()[name].dPdF(F).reshape(5, 9, 9))
    mu, K = 1.0 / 2.6, 1.0 / (3.0 * 0.4)
    np.testing.assert_allclose(w, np.broadcast_to([0.0] * 3 + [2 * mu] * 5 + [3 * K], (5, 9)), atol=1e-14)


def test_corotational_stiffness_has_the_published_eigenvalues() -> None:
    """2 mu (five), 2 mu + 3 lam, and 2 mu + 2 (lam tr(S - I) - 2 mu)/(s_i + s_j): Smith et al. (2019)."""
    s, mu, lam = np.array([1.4, 0.7, -0.3]), 0.4, 0.6
    pairs = np.array([s[0] + s[1], s[0] + s[2], s[1] + s[2]])
    twists = 2.0 * mu + 2.0 * (lam * (s.sum() - 3.0) - 2.0 * mu) / pairs
    expected = np.sort(np.concatenate(([2.0 * mu] * 5, [2.0 * mu + 3.0 * lam], twists)))
    H = Corotational(mu, lam).dPdF(np.diag(s)[None]).reshape(9, 9)
    np.testing.assert_allclose(np.linalg.eigvalsh(H), expected, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("name", sorted(set(NAMES) - set(EVERYWHERE)))
def test_infinite_energy_outside_the_domain(name: str) -> None:
    """psi = +inf for J <= 0, so a line search steps back; stress and stiffness raise no warning there."""
    law = laws()[name]
    flat = np.array([np.diag([1.0, 1.0, 0.0]), np.zeros((3, 3)), np.diag([1.0, 1.0, -1.0])])
    F = np.concatenate((flat, INSIDE_OUT))
    np.testing.assert_array_equal(law.psi(F), np.inf)
    for f in (law.P, law.dPdF, law.dPdF_projected):
        assert f(F).shape[:3] == F.shape


@pytest.mark.parametrize("name", NAMES)
def test_a_gradient_that_is_not_a_number_spoils_only_its_own_row(name: str) -> None:
    """A diverging step is met by NaN or +inf, never by an exception, and the other rows stay right."""
    law, F = laws()[name], STRETCHED[:3].copy()
    F[1] = np.nan
    assert not np.isfinite(law.psi(F)[1])
    for f in (law.psi, law.P):
        np.testing.assert_allclose(f(F)[[0, 2]], f(STRETCHED[[0, 2]]), rtol=1e-12)
    for f in (law.dPdF, law.dPdF_projected):
        close(f(F)[[0, 2]], f(STRETCHED[[0, 2]]), 1e-13)


SINGULAR = np.array(
    [np.diag(s) for s in ([1.0, 0.5, -0.5], [1.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [-1.0, -1.0, -1.0])]
)


def test_corotational_stays_bounded_where_the_rotation_is_not_unique() -> None:
    """s2 + s3 = 0: the energy by hand; by the floor |dPdF| <= 2 mu + lam + 4 |lam tr(S - I) - 2 mu|/FLOOR."""
    mu, lam = 0.4, 0.6
    law = Corotational(mu, lam)
    s = np.array([[1.0, 0.5, -0.5], [1.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, -1.0]])
    t = s.sum(1) - 3.0
    np.testing.assert_allclose(law.psi(SINGULAR), mu * ((s - 1.0) ** 2).sum(1) + 0.5 * lam * t * t, rtol=1e-14)
    assert np.isfinite(law.P(SINGULAR)).all()
    bound = 2.0 * mu + lam + 4.0 * np.abs(lam * t - 2.0 * mu).max() / FLOOR
    for H in (law.dPdF(SINGULAR), law.dPdF_projected(SINGULAR)):
        assert np.abs(H).max() <= bound


@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-5, 1e-7])
def test_corotational_stiffness_close_to_the_singular_set(gap: float) -> None:
    """Eigenvalue 2 mu + 2 c/(s2 + s3), as accurate as s2 + s3 is, 1e-15/gap; floored at the last gap."""
    mu, lam = 0.4, 0.6
    law, Q = Corotational(mu, lam), rotations(np.random.default_rng(7), 2)
    s = np.array([1.2, 0.9, -0.9 + gap])
    H = law.dPdF((Q[:1] * s) @ Q[1:]).reshape(9, 9)
    c = lam * (s.sum() - 3.0) - 2.0 * mu
    np.testing.assert_allclose(np.linalg.eigvalsh(H)[0], 2.0 * mu + 2.0 * c / max(gap, FLOOR), rtol=1e-14 / gap)


COMPRESSED = gradients((0.3, 0.3, 0.3), (0.9, 0.9, 0.9), m=60)


@CONSTANTS
@pytest.mark.parametrize("name", NAMES)
def test_projected_stiffness_is_the_nearest_positive_one(name: str, young: float, poisson: float) -> None:
    """Equal to the eigenvalue clamp of the full 9x9, which is the definition; both to round-off."""
    law = laws(young, poisson)[name]
    F = np.concatenate((states(name), COMPRESSED, np.eye(3)[None]))
    projected = law.dPdF_projected(F)
    close(projected, project(law.dPdF(F)), 1e-13)
    w = np.linalg.eigvalsh(projected.reshape(-1, 9, 9))
    assert w.min() > -1e-14 * w.max()


@pytest.mark.parametrize("name", OBJECTIVE)
def test_compression_makes_the_stiffness_indefinite(name: str) -> None:
    """The test above is of something: a compressed solid wants to turn (Smith et al. 2019)."""
    assert np.linalg.eigvalsh(laws()[name].dPdF(COMPRESSED).reshape(-1, 9, 9)).min() < -0.1


@pytest.mark.parametrize("name", NAMES)
def test_projection_changes_nothing_where_the_stiffness_is_positive(name: str) -> None:
    """Under tension in all directions; to round-off."""
    law = laws()[name]
    H = law.dPdF(PULLED)
    assert np.linalg.eigvalsh(H.reshape(-1, 9, 9)).min() > -1e-15
    close(law.dPdF_projected(PULLED), H, 1e-14)
    close(project(H), H, 1e-14)


def test_project_by_hand() -> None:
    """diag(-1, 2, 0, ...) becomes diag(0, 2, 0, ...)."""
    H = np.diag([-1.0, 2.0] + [0.0] * 7).reshape(1, 3, 3, 3, 3)
    np.testing.assert_array_equal(project(H).reshape(9, 9), np.diag([0.0, 2.0] + [0.0] * 7))


@pytest.mark.parametrize("name", NAMES)
def test_the_cut_into_blocks_does_not_show(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of 7 give what one block gives, to the round-off of iterations that stop together."""
    law = laws()[name]
    methods = (law.psi, law.P, law.dPdF, law.dPdF_projected)
    whole = [f(STRETCHED) for f in methods]
    monkeypatch.setattr(batching, "BLOCK", 7)
    for f, expected in zip(methods, whole, strict=True):
        close(f(STRETCHED), expected, 1e-14)
        assert f(np.empty((0, 3, 3))).shape == (0, *expected.shape[1:])


@pytest.mark.parametrize("name", NAMES)
def test_input_is_read_only_and_may_be_whole_numbers(name: str) -> None:
    """F is not written to, and an integer array means the same as a float array."""
    law, F = laws()[name], np.diag([2.0, 1.0, 1.0])[None]
    F.setflags(write=False)
    for f in (law.psi, law.P, law.dPdF, law.dPdF_projected):
        np.testing.assert_array_equal(f(F.astype(np.int64)), f(F))


def test_moduli_by_hand() -> None:
    """E = 60 kPa, nu = 0.25: mu = E/2.5, lam = mu (nu = 1/4), K = E/1.5."""
    material = NeoHookean(60e3, 0.25, 1070.0)
    assert material.shear_modulus == pytest.approx(24e3, rel=1e-15)
    assert material.lame_lambda == pytest.approx(24e3, rel=1e-15)
    assert material.bulk_modulus == pytest.approx(40e3, rel=1e-15)


def test_hookes_law_is_no_law_of_finite_strain() -> None:
    """The error names the material and what it does have."""
    hooke = LinearElastic(60e3, 0.3, 1070.0)
    assert hooke.finite_law() is None
    with pytest.raises(NoFiniteLaw, match="LinearElastic has no finite-strain law; use small") as caught:
        law_for(hooke, "finite")
    assert caught.value.material is hooke


def test_strain_measures_use_the_moduli_at_rest_of_any_material() -> None:
    """A neo-Hookean solid seen through a small strain is Hooke's."""
    rubber, hooke = NeoHookean(60e3, 0.3, 1070.0), LinearElastic(60e3, 0.3, 1070.0)
    for strain in ("small", "corotational"):
        assert law_for(rubber, strain) == law_for(hooke, strain)
    assert law_for(rubber, "finite") is rubber
    assert set(STRAINS) == {"small", "corotational", "finite"}
    assert isinstance(rubber, Hyperelastic)


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("strain", STRAINS)
def test_parts_add_up_to_the_law(name: str, strain: str) -> None:
    """Shear and volume of any law that has parts, to round-off; the first depends on mu alone."""
    material = made(name, 1.0, 0.4)
    if strain == "finite" and material.finite_parts() is None:  # see test_integration_options.py
        assert shear_and_volume_laws(material, strain) is None
        return
    whole, parts = law_for(material, strain), shear_and_volume_laws(material, strain)
    assert parts is not None
    for method in ("psi", "P", "dPdF"):
        values = [getattr(law, method)(STRETCHED) for law in (whole, *parts)]
        close(values[1] + values[2], values[0], 1e-13)
    again = shear_and_volume_laws(made(name, 1.0, 0.3), strain)
    assert again is not None
    ratio = 1.4 / 1.3  # mu = E/(2 (1 + nu)): the first part knows nothing else
    close(ratio * parts[0].P(STRETCHED), again[0].P(STRETCHED), 1e-13)


@pytest.mark.parametrize("name", MATERIALS)
def test_every_field_tells_its_unit_range_and_meaning(name: str) -> None:
    """What the vocabulary reads: Annotated[float, "unit in range", "meaning"], and a first line that ends."""
    material = MATERIALS[name]
    assert (material.__doc__ or "").splitlines()[0].endswith(".")
    hints = typing.get_type_hints(material, include_extras=True)
    assert set(hints) >= {"young", "poisson", "density"}
    told = {name: hint.__metadata__ for name, hint in hints.items() if hasattr(hint, "__metadata__")}
    assert hints.keys() - told.keys() <= {
        "young",
        "either",
        "varying",
        "powerless",
        "branches",
    }  # what follows is no field
    anything = {"c2", "c3", "mu", "alpha"}  # constants of either sign
    for field, (*unit, meaning) in told.items():
        assert not unit or " in " in unit[0] or field in anything
        assert meaning


def test_vocabulary_needs_no_numpy() -> None:
    """Reading the classes and their fields, as checking a scene does, imports no numerical package."""
    code = (
        "import sys, typing\n"
        f"sys.path.insert(0, {str(Path(equal_moduli.__file__).parent)!r})\n"
        "from equal_moduli import made\n"
        "from softmark.solvers.materials import MATERIALS\n"
        "for name, material in MATERIALS.items():\n"
        "    typing.get_type_hints(material, include_extras=True)\n"
        "    made(name, 1.0, 0.3).finite_law()\n"
        "print(sorted({'numpy', 'scipy', 'numba'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
