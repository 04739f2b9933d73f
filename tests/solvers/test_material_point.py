"""One material point against closed forms: five laws in five homogeneous states, and where states end."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

from softmark.solvers.api.elastic_solid import material
from softmark.solvers.materials import law_for, mixed_for
from softmark.solvers.statics.material_point import ImposedDeformation, MaterialPoint, NoState

E, FREE = 60e3, math.nan
Principal = Callable[[float, float, float], list[float]]


def point(name: str, poisson: float, strain: str = "finite") -> MaterialPoint:
    made = material(name, young=E, poisson=poisson, density=1000.0)
    if not made.incompressible:
        return MaterialPoint(law_for(made, strain), None, strain == "small")
    split = mixed_for(made, strain)
    assert split is not None
    return MaterialPoint(split.shape, split.constraint, strain == "small")


def moduli(nu: float) -> tuple[float, float, float]:
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    return mu, lam, lam + 2 * mu / 3


# Nominal stresses of stretches along the axes, dpsi/dl_i, written out (Smith et al. 2018; Bonet and Wood 2008)


def neo_hookean(nu: float) -> Principal:
    mu, lam, _ = moduli(nu)
    return lambda *l: [mu * (a - 1 / a) + lam * math.log(math.prod(l)) / a for a in l]


def isochoric(nu: float) -> Principal:
    mu, _, K = moduli(nu)

    def found(*l: float) -> list[float]:
        J, I1 = math.prod(l), sum(a * a for a in l)
        return [mu * J ** (-2 / 3) * (a - I1 / (3 * a)) + K * (J - 1) * J / a for a in l]

    return found


def kirchhoff(nu: float) -> Principal:
    mu, lam, _ = moduli(nu)
    return lambda *l: [a * (mu * (a * a - 1) + lam / 2 * (sum(b * b for b in l) - 3)) for a in l]


def stable(nu: float) -> Principal:
    mu, lam, _ = moduli(nu)
    m, s = 4 * mu / 3, lam + 5 * mu / 6

    def found(*l: float) -> list[float]:
        J, I1 = math.prod(l), sum(a * a for a in l)
        return [m * (1 - 1 / (I1 + 1)) * a + s * (J - 1 - 3 * m / (4 * s)) * J / a for a in l]

    return found


def hooke(nu: float) -> Principal:
    mu, lam, _ = moduli(nu)
    return lambda *l: [2 * mu * (a - 1) + lam * (sum(l) - 3) for a in l]


LAWS = {
    "neo_hookean": (neo_hookean, "finite"), "neo_hookean_isochoric": (isochoric, "finite"),
    "st_venant_kirchhoff": (kirchhoff, "finite"), "stable_neo_hookean": (stable, "finite"),
    "linear_elastic": (hooke, "corotational"),
}  # fmt: skip
STATES = {
    "uniaxial": (lambda l, t: (l, t, t), lambda l: (l, FREE, FREE)),
    "equibiaxial": (lambda l, t: (l, l, t), lambda l: (l, l, FREE)),
    "planar": (lambda l, t: (l, 1.0, t), lambda l: (l, 1.0, FREE)),
    "confined": (lambda l, t: (l, 1.0, 1.0), lambda l: (l, 1.0, 1.0)),
}


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", LAWS)
def test_states_of_stretch_are_those_of_closed_forms(name: str, state: str, nu: float) -> None:
    formula, strain = LAWS[name]
    of, (stretches, given) = formula(nu), STATES[state]
    for l in (0.8, 1.1, 1.3):
        t = 1.0
        if state != "confined":
            left = lambda t, l=l: of(*stretches(l, t))[2]  # noqa: E731
            if left(0.4) > 0.0:  # as wide as that is nothing: the law ends before
                with pytest.raises(NoState):
                    point(name, nu, strain).state(ImposedDeformation(np.array(given(l))))
                continue
            t = brentq(left, 0.4, 1.6, xtol=1e-15, rtol=1e-15)
        found = point(name, nu, strain).state(ImposedDeformation(np.array(given(l))))
        assert found.F.diagonal() == pytest.approx(stretches(l, t), rel=1e-9)
        assert found.P.diagonal() == pytest.approx(of(*stretches(l, t)), rel=1e-9, abs=1e-9 * E)
        assert found.residual < 1e-10


@pytest.mark.parametrize("g", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("name", [*LAWS, "small"])
def test_simple_shear_is_that_of_closed_forms(name: str, g: float) -> None:
    nu = 0.3
    mu, lam, _ = moduli(nu)
    s = math.sqrt(4 + g * g)
    shear = {
        "neo_hookean": mu * g,
        "neo_hookean_isochoric": mu * g,
        "st_venant_kirchhoff": (lam / 2 + mu) * g**3 + mu * g,
        "stable_neo_hookean": 4 / 3 * mu * (1 - 1 / (4 + g * g)) * g,
        "linear_elastic": 2 * mu * (g - g / s) + lam * (s - 2) * g / s,
        "small": mu * g,
    }[name]
    law, strain = ("linear_elastic", "small") if name == "small" else (name, LAWS[name][1])
    found = point(law, nu, strain).state(ImposedDeformation(np.ones(3), shear=(0, 1, g), driven=(0,)))
    assert found.P[0, 1] == pytest.approx(shear, rel=1e-9)


@pytest.mark.parametrize(("state", "l", "P"), [
    ("uniaxial", 0.7, -26816.3265306), ("uniaxial", 1.1, 5471.0743802), ("uniaxial", 1.5, 21111.1111111),
    ("uniaxial", 3.0, 57777.7777778), ("equibiaxial", 1.5, 27366.2551440), ("equibiaxial", 2.0, 39375.0),
    ("planar", 2.0, 37500.0),
])  # fmt: skip
@pytest.mark.parametrize("name", ["neo_hookean", "neo_hookean_isochoric"])
def test_at_half_a_pressure_keeps_the_volume(name: str, state: str, l: float, P: float) -> None:
    found = point(name, 0.5).state(ImposedDeformation(np.array(STATES[state][1](l))))
    assert found.P[0, 0] == pytest.approx(P, rel=1e-9)  # mu (l - l^-2), mu (l - l^-5), mu (l - l^-3)
    assert np.linalg.det(found.F) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("nu", [0.3, 0.45, 0.49999])
def test_a_force_finds_the_stretch_that_has_it(nu: float) -> None:
    rubber = point("neo_hookean", nu)
    there = rubber.state(ImposedDeformation(np.array([1.7, FREE, FREE])))
    again = rubber.state(ImposedDeformation(np.full(3, FREE), np.array([there.P[0, 0], 0.0, 0.0])))
    assert again.F.diagonal() == pytest.approx(there.F.diagonal(), rel=1e-9)


def test_in_simple_shear_at_half_the_side_beside_the_plane_is_free() -> None:
    found = point("neo_hookean", 0.5).state(ImposedDeformation(np.ones(3), shear=(0, 1, 0.5), driven=(0,), relieved=2))
    assert found.P[0, 1] == pytest.approx(10e3, rel=1e-12)
    assert found.P[2, 2] == pytest.approx(0.0, abs=1e-8)


def test_a_law_past_its_largest_force_says_where_that_is() -> None:
    """St Venant-Kirchhoff in compression: P = E l (l^2 - 1)/2 has its extreme at 1/sqrt(3)."""
    law, past = point("st_venant_kirchhoff", 0.3), ImposedDeformation(np.array([0.5, FREE, FREE]))
    assert law.state(past).freed < 0.0 < law.state(ImposedDeformation(np.array([0.6, FREE, FREE]))).freed
    first = law.first_unstable_state(past)
    assert first.F[0, 0] == pytest.approx(1 / math.sqrt(3), rel=1e-6)
    assert first.P[0, 0] == pytest.approx(-E / math.sqrt(27), rel=1e-9)
    with pytest.raises(NoState) as none:
        law.state(ImposedDeformation(np.full(3, FREE), np.array([-0.2 * E, 0.0, 0.0])))
    assert none.value.share == pytest.approx(0.19245 / 0.2, abs=2e-3)


def test_a_law_that_ends_says_how_far_it_came() -> None:
    """Its width is nothing at l^2 = 1 + 1/nu: no stretch beyond has a state."""
    with pytest.raises(NoState) as none:
        point("st_venant_kirchhoff", 0.49).state(ImposedDeformation(np.array([2.0, FREE, FREE])))
    assert none.value.stretches[0] == pytest.approx(math.sqrt(1 + 1 / 0.49), rel=2e-3)


@pytest.mark.parametrize("nu", [0.45, 0.5])
def test_a_sheet_that_is_pulled_alike_both_ways_may_thin_one_way(nu: float) -> None:
    """Neither force nor stretches of a neo-Hookean sheet have a maximum; the force along one axis has none either."""
    for l in (1.5, 3.0):
        assert point("neo_hookean", nu).state(ImposedDeformation(np.array([l, l, FREE]), driven=(0, 1))).freed > 0.0


def test_amounts_of_any_size_are_found() -> None:
    for l in (1e-2, 20.0):
        found = point("neo_hookean", 0.4999).state(ImposedDeformation(np.array([l, FREE, FREE])))
        assert found.residual < 1e-8
        assert np.linalg.det(found.F) == pytest.approx(1.0, rel=0.05)
