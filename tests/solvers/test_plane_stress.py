"""The law of a thin plate: any solid's, with the stretch across it that leaves no stress there."""

from __future__ import annotations

import numpy as np
import pytest
from equal_moduli import made
from scipy.optimize import brentq

from softmark.solvers.independent_forces.stress_by_differences import PlaneStressLaw
from softmark.solvers.materials import MATERIALS, law_for, mixed_for, shear_and_volume_laws
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.materials.plane_stress import PlaneStress, Plate

E, NU = 1.0, 0.3  # unit scale, so that a wrong derivative shows
FINITE = [name for name in MATERIALS if name != "linear_elastic"]


def plate(name: str, strain: str) -> PlaneStress:
    """The law of a plate."""
    law = law_for(Plate.from_material(made(name, E, NU, 1000.0)), strain)
    assert isinstance(law, PlaneStress)
    return law


def in_plane(count: int = 6, by: float = 0.2) -> np.ndarray:
    """Deformation gradients (count, 3, 3) that keep the plane, with any number across it."""
    F = np.tile(np.eye(3), (count, 1, 1))
    F[:, :2, :2] += by * np.random.default_rng(3).uniform(-1.0, 1.0, (count, 2, 2))
    return F


@pytest.mark.parametrize("name", FINITE)
def test_derivatives(name: str) -> None:
    """P and dP/dF in the plane are those of psi by central differences: error of second order, 1e-4 squared."""
    law, F, h = plate(name, "finite"), in_plane(), 1e-5
    P, A = law.P(F), law.dPdF(F)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        step = np.zeros((3, 3))
        step[i, j] = h
        assert (law.psi(F + step) - law.psi(F - step)) / (2 * h) == pytest.approx(P[:, i, j], abs=1e-8)
        slope = (law.P(F + step) - law.P(F - step)) / (2 * h)
        assert slope == pytest.approx(A[:, :, :, i, j], abs=1e-7)
    assert not A[:, 2, 2].any()
    assert not A[:, :, :, 2, 2].any()
    assert np.linalg.eigvalsh(law.dPdF_projected(F).reshape(-1, 9, 9)).min() > -1e-12


@pytest.mark.parametrize("name", FINITE)
def test_stress_across_without_tensors(name: str) -> None:
    """P33 and dP33/dF33 are those entries of the tensors, to rounding: two sums of the same terms."""
    law, F = plate(name, "finite"), in_plane()
    F[:, 2, 2] = np.linspace(0.8, 1.3, len(F))
    stress, slope = law._transverse_stress_and_stiffness(law.solid, F)
    assert stress == pytest.approx(law.solid.P(F)[:, 2, 2], abs=1e-13)
    assert slope == pytest.approx(law.solid.dPdF(F)[:, 2, 2, 2, 2], rel=1e-12)


@pytest.mark.parametrize("name", FINITE)
def test_no_stress_across_and_the_least_energy(name: str) -> None:
    """The solid at the stretch that is found has no stress across, and more energy at any other nearby."""
    law, F = plate(name, "finite"), in_plane()
    open_, other = law.opened(F), law.opened(F)
    assert np.abs(law.solid.P(open_)[:, 2, 2]).max() < 1e-13
    for away in (-0.02, 0.02):
        other[:, 2, 2] = open_[:, 2, 2] + away
        assert (law.solid.psi(other) > law.psi(F)).all()


@pytest.mark.parametrize("name", FINITE)
def test_a_pulled_strip_is_a_pulled_bar(name: str) -> None:
    """Pulled along x with free sides, a plate grows as narrow as thin: as the bar of the solid, by root finding."""
    law, stretch = plate(name, "finite"), 1.3

    def aside(s: float) -> float:
        return float(law.solid.P(np.diag([stretch, s, s])[None])[0, 1, 1])

    narrow = brentq(aside, 0.5, 1.2, xtol=1e-14)
    F = np.diag([stretch, narrow, 1.0])[None]
    assert law.opened(F)[0, 2, 2] == pytest.approx(narrow, abs=1e-12)
    assert law.P(F)[0, 1, 1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("strain", ["small", "corotational"])
def test_small_strains_are_those_of_the_textbook(strain: str) -> None:
    """sigma_xx = E / (1 - nu^2) (e_xx + nu e_yy), e_zz = -nu / (1 - nu) (e_xx + e_yy); no rotation here."""
    law, e = plate("linear_elastic", strain), np.diag([2e-3, -1e-3, 0.0])
    P = law.P(np.eye(3)[None] + e)[0]
    assert P[0, 0] == pytest.approx(E / (1 - NU**2) * (e[0, 0] + NU * e[1, 1]), rel=1e-12)
    across = law.opened(np.eye(3)[None] + e)[0, 2, 2] - 1.0
    assert across == pytest.approx(-NU / (1 - NU) * (e[0, 0] + e[1, 1]), rel=1e-12)


@pytest.mark.parametrize("name", FINITE)
def test_the_check_finds_the_same_by_halving(name: str) -> None:
    """60 halvings leave rounding."""
    law, F = plate(name, "finite"), in_plane()
    assert PlaneStressLaw(law.solid.P)(F) == pytest.approx(law.P(F), abs=1e-13)


def test_where_no_stretch_frees_it_there_is_no_state() -> None:
    """A St Venant-Kirchhoff plate stretched by sqrt(1 + 1 / nu) both ways would have to be thinner than nothing."""
    law = plate("st_venant_kirchhoff", "finite")
    F = np.diag([2.1, 2.1, 1.0])[None]
    assert np.isinf(law.psi(F)).all()
    assert np.isnan(law.opened(F)[0, 2, 2])


def test_nothing_is_taken_apart_and_a_plate_of_a_plate_is_one() -> None:
    """Where the thickness follows the motion nothing locks, and laws of parts are those of solids."""
    gel = Plate.from_material(MATERIALS["neo_hookean"](E, NU, 1000.0))
    assert Plate.from_material(gel) is gel
    assert (
        shear_and_volume_laws(gel, "finite") is shear_and_volume_laws(gel, "small") is mixed_for(gel, "small") is None
    )


@pytest.mark.parametrize("stretches", [(-0.5, 1.0), (1.618, 0.00156), (5.0, 0.05), (1.0, 1.0)])
@pytest.mark.parametrize("name", ["corotational", "stable_neo_hookean", "ogden"])
def test_stress_is_the_gradient_of_the_energy_where_cells_are_inverted_or_flat(
    name: str, stretches: tuple[float, float]
) -> None:
    """The thickness stretch of an inverted cell is not that of its mirror image: P = dpsi/dF, or there is no energy."""
    solid = {
        "corotational": Corotational(4e5, 6e5),
        "stable_neo_hookean": MATERIALS["stable_neo_hookean"](1e6, 0.3, 1000.0).finite_law(),
        "ogden": MATERIALS["ogden"](mu=(2e4,), alpha=(3.0,), poisson=0.45, density=1000.0).finite_law(),
    }[name]
    law, turn = PlaneStress(solid), np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    F = (turn @ np.diag((*stretches, 1.0)) @ turn)[None]
    psi = law.psi(F)[0]
    if stretches[0] > 0.0 and name != "corotational":  # whose linear law has no thickness left at (5, 0.05)
        assert np.isfinite(psi)
    if np.isfinite(psi):
        step = 1e-6 * min(map(abs, stretches))
        for i in range(2):
            E = np.zeros((1, 3, 3))
            E[0, i, 0] = step
            slope = (law.psi(F + E)[0] - law.psi(F - E)[0]) / (2.0 * step)
            assert law.P(F)[0, i, 0] == pytest.approx(slope, rel=1e-5, abs=1e-3 * abs(psi) + 1.0)
