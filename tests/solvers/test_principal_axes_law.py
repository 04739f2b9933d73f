"""Laws in principal axes and points found by plain numbers, against the same laws over arrays, which share no line."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from equal_moduli import CONSTANTS, made

from softmark.records import dataclass
from softmark.solvers.materials import MATERIALS, law_for, mixed_for
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.materials.isotropic_material import Isotropic
from softmark.solvers.materials.two_invariant_law import TwoInvariantLaw
from softmark.solvers.runtime import scalar_or_array
from softmark.solvers.statics.isotropic_material_point import PrincipalStretchSolver
from softmark.solvers.statics.material_point import ImposedDeformation, MaterialPoint, NoState

RNG = np.random.default_rng(11)
FREE = math.nan
AXES = np.ix_((0, 4, 8), (0, 4, 8))


def laws() -> Iterator[tuple[str, Any]]:
    """Every isotropic law, whole and the part that a pressure leaves, with each energy of the volume that it has."""
    for name in MATERIALS:
        for volumetric in ("squared", "logarithmic", "reciprocal") if name in CONSTANTS else ("",):
            own = made(name, 60e3, 0.4, **({"volumetric": volumetric} if volumetric else {}))
            if name == "linear_elastic":
                yield name, Corotational(own.shear_modulus, own.lame_lambda)
                continue
            yield f"{name}-{volumetric}", law_for(own, "finite")
            split = mixed_for(own, "finite")
            assert split is not None
            yield f"{name}-{volumetric}-shape", split.shape


LAWS = dict(laws())


@pytest.mark.parametrize("name", LAWS)
def test_a_law_in_principal_axes_is_that_of_tensors(name: str) -> None:
    """psi, dpsi/de and d2psi/de2, e = ln s, from psi, P and dP/dF of diag(s): to rounding, of numbers and of arrays."""
    law, e = LAWS[name], RNG.uniform(-0.3, 0.3, (20, 3))
    at_once = law.principal(tuple(e.T))
    for n, row in enumerate(e):
        s = np.exp(row)
        F = np.diag(s)[None]
        P, H = law.P(F)[0].diagonal(), law.dPdF(F)[0].reshape(9, 9)[AXES]
        psi, tau, bent = law.principal(tuple(row.tolist()))
        assert all(type(value) is float for value in (psi, *tau, *bent[0], *bent[1], *bent[2]))  # no array was made
        slopes = H * np.outer(s, s) + np.diag(s * P)
        size = float(np.abs(slopes).max())
        assert psi == pytest.approx(float(law.psi(F)[0]), rel=1e-12)
        np.testing.assert_allclose(tau, s * P, rtol=0.0, atol=1e-13 * size)
        np.testing.assert_allclose(bent, slopes, rtol=0.0, atol=1e-13 * size)
        np.testing.assert_allclose(np.array(at_once[1])[:, n], tau, rtol=0.0, atol=1e-13 * size)


@pytest.mark.parametrize("x", [-math.inf, -2.0, -1.0, -0.5, 0.0, 1e-9, 3.0, 800.0, math.inf, math.nan])
def test_functions_of_a_number_are_those_of_arrays(x: float) -> None:
    with np.errstate(all="ignore"):
        for name in ("exp", "expm1", "log1p"):
            of = getattr(scalar_or_array, name)
            assert of(x) == pytest.approx(float(getattr(np, name)(x)), rel=1e-15, nan_ok=True)
            assert isinstance(of(np.array([x])), np.ndarray)
    assert scalar_or_array.where(x > 0.0, 1.0, 2.0) == (1.0 if x > 0.0 else 2.0)
    assert scalar_or_array.where(np.array([True, False]), 1.0, 2.0).tolist() == [1.0, 2.0]


STATES = {
    "uniaxial": lambda l: ImposedDeformation(np.array([l, FREE, FREE])),
    "equibiaxial": lambda l: ImposedDeformation(np.array([l, l, FREE]), driven=(0, 1)),
    "planar": lambda l: ImposedDeformation(np.array([1.0, l, FREE]), driven=(1,)),
    "confined": lambda l: ImposedDeformation(np.array([l, 1.0, 1.0])),
    "simple_shear": lambda l: ImposedDeformation(np.ones(3), shear=(1, 2, l - 1.0), driven=(1,), relieved=0),
    "sheared_and_stretched": lambda l: ImposedDeformation(
        np.array([1.2, 0.9, 1.1]), shear=(2, 0, l - 1.0), driven=(2,), relieved=1
    ),
    "pulled": lambda l: ImposedDeformation(np.full(3, FREE), np.array([40e3 * (l - 1.0), 0.0, 0.0])),
    "pulled_twice": lambda l: ImposedDeformation(
        np.full(3, FREE), (l - 1.0) * np.array([9e3, 30e3, 0.0]), driven=(0, 1)
    ),
}


KINDS = [n for n in MATERIALS if n not in ("linear_elastic", "arruda_boyce")]
QUICK = ("neo_hookean", "st_venant_kirchhoff", "ogden", "veronda_westmann")  # one of each form


def both(name: str, nu: float, **more: Any) -> tuple[MaterialPoint, MaterialPoint]:
    """A point of a law, and one that is not told that its law knows principal axes."""
    own = made(name, 60e3, nu, **more)
    split = mixed_for(own, "finite") if own.incompressible else None
    law = law_for(own, "finite") if split is None else split.shape

    class Tensors:
        psi, P, dPdF, dPdF_projected = law.psi, law.P, law.dPdF, law.dPdF_projected

    constraint = None if split is None else split.constraint
    return MaterialPoint(law, constraint), MaterialPoint(Tensors(), constraint)


@pytest.mark.parametrize("nu", [0.3, pytest.param(0.4999, marks=pytest.mark.slow), 0.5])
@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in KINDS])
def test_a_state_by_numbers_is_that_of_arrays(name: str, state: str, nu: float) -> None:
    if nu == 0.5 and (name == "st_venant_kirchhoff" or state in ("confined", "sheared_and_stretched")):
        return  # arrays alone know its constraint; and there is no such state
    numbers, arrays = both(name, nu)
    for l in (0.85, 1.0 + 1e-9, 1.25):
        drive = STATES[state](l)
        assert isinstance(numbers._select_solver(drive), PrincipalStretchSolver)
        try:
            other = arrays.state(drive)
        except NoState:
            with pytest.raises(NoState):
                numbers.state(drive)
            continue
        one = numbers.state(drive)
        rounding = 64.0 * 2.0**-52 * numbers._largest_stiffness
        size = float(np.abs(other.P).max())
        np.testing.assert_allclose(one.F, other.F, rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(one.P, other.P, rtol=0.0, atol=1e-9 * size + rounding)
        assert one.psi == pytest.approx(other.psi, rel=1e-8, abs=1e-9 * rounding)
        assert one.freed == pytest.approx(other.freed, rel=1e-7, abs=1e-9)
        assert one.held == pytest.approx(other.held, rel=1e-7)
        assert one.volume == pytest.approx(np.linalg.det(other.F), rel=1e-12)


@dataclass(frozen=True)
class Ciarlet(TwoInvariantLaw, Isotropic):
    """psi = mu/2 (I1 - 3) - mu ln J + lam/4 (J^2 - 1 - 2 ln J), written with numpy, as somebody else's law may be."""

    def energy(self, stretch: Any, j: Any) -> Any:
        l = np.log1p(j)
        volume = 0.25 * self.lame_lambda * (j * (2.0 + j) - 2.0 * l)
        return np.where(j > -1.0, 0.5 * self.shear_modulus * stretch - self.shear_modulus * l + volume, np.inf)

    def slopes(self, stretch: Any, j: Any) -> Any:
        mu = self.shear_modulus
        return np.full_like(j, mu), (0.5 * self.lame_lambda * j * (2.0 + j) - mu) / (1.0 + j)

    def curvatures(self, stretch: Any, j: Any) -> Any:
        mu, lam = self.shear_modulus, self.lame_lambda
        return None, 0.5 * lam + (0.5 * lam + mu) / (1.0 + j) ** 2


def test_a_law_that_knows_arrays_alone_is_found_as_well() -> None:
    """Uniaxial: mu (t^2 - 1) + lam/2 (J^2 - 1) = 0 across, with J = l t^2; to rounding, and with no warning."""
    law = Ciarlet(60e3, 0.3, 1.0)
    mu, lam = law.shear_modulus, law.lame_lambda
    for l in (1e-3, 1.4, 1e4):
        found = MaterialPoint(law).state(ImposedDeformation(np.array([l, FREE, FREE])))
        a, b, c = 0.5 * lam * l * l, mu, -mu - 0.5 * lam  # of t^2
        across = -2.0 * c / (b + math.sqrt(b * b - 4.0 * a * c))
        assert found.F[1, 1] == pytest.approx(math.sqrt(across), rel=1e-12)
        assert type(found.psi) is float


def test_a_state_asks_its_law_a_few_times_and_takes_a_fraction_of_what_arrays_do() -> None:
    """A count of iterations, and a ratio within one run: it is some twenty times as fast, and asserted to be five."""
    for nu, most in ((0.45, 6), (0.5, 0)):
        numbers, arrays = both("yeoh", nu)
        drives = [ImposedDeformation(np.array([l, FREE, FREE])) for l in np.linspace(0.8, 1.4, 25)]
        spent = []
        for point in (numbers, arrays):
            point.state(drives[0])
            start = time.process_time()
            found = [point.state(drive) for drive in drives]
            spent.append(time.process_time() - start)
            if point is numbers:
                assert max(state.iterations for state in found) <= most
        assert spent[0] < 0.2 * spent[1]
