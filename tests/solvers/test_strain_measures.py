"""Measures of strain of held stresses against finite differences, and springs of a series against minimisation."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from softmark.solvers.energies.viscoelastic_memory import BodyHistory, ViscoelasticHistory
from softmark.solvers.materials import WORDS, law_for
from softmark.solvers.materials.maxwell_branch_energy import IsotropicBranch, first_invariant_branch
from softmark.solvers.materials.strain_measures import (
    BiotStrain,
    GreenStrain,
    IsochoricStrain,
    SmallStrainMeasure,
    StrainMeasure,
)
from softmark.solvers.materials.viscoelastic import Viscoelastic
from softmark.solvers.materials.viscoelastic_increment import prony_series

ALL: list[StrainMeasure] = [SmallStrainMeasure(), GreenStrain(), IsochoricStrain(), BiotStrain()]
ids = [type(m).__name__ for m in ALL]


def states(n: int = 5) -> Any:
    """Deformation gradients of strains up to a third, and symmetric tensors."""
    rng = np.random.default_rng(1)
    F = np.eye(3) + 0.3 * rng.uniform(-1.0, 1.0, (n, 3, 3))
    H = rng.standard_normal((n, 3, 3))
    return F, H + H.transpose(0, 2, 1)


@pytest.mark.parametrize("measure", ALL, ids=ids)
def test_what_is_held_pulls_with_the_derivative_of_its_energy(measure: StrainMeasure) -> None:
    """Central differences of 1e-6 at unit scale are right to 1e-8."""
    F, H = states()
    P, A, h = measure.first_piola_stress(F, H), np.zeros((len(F), 3, 3, 3, 3)), 1e-6
    measure.add_tangent(F, H, A)
    for i in range(3):
        for j in range(3):
            d = np.zeros((3, 3))
            d[i, j] = h
            energy = [np.einsum("nij,nij->n", H, measure.strain(F + s * d)) for s in (1.0, -1.0)]
            np.testing.assert_allclose((energy[0] - energy[1]) / (2.0 * h), P[:, i, j], atol=1e-8)
            pulled = [measure.first_piola_stress(F + s * d, H) for s in (1.0, -1.0)]
            np.testing.assert_allclose((pulled[0] - pulled[1]) / (2.0 * h), A[:, :, :, i, j], atol=2e-8)


@pytest.mark.parametrize("measure", ALL[1:], ids=ids[1:])
def test_a_rotation_changes_no_strain_and_turns_what_is_held(measure: StrainMeasure) -> None:
    F, H = states()
    R = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    R *= np.linalg.det(R)
    np.testing.assert_allclose(measure.strain(R @ F), measure.strain(F), atol=1e-14)
    np.testing.assert_allclose(measure.first_piola_stress(R @ F, H), R @ measure.first_piola_stress(F, H), atol=1e-12)


def test_the_stress_of_a_law_is_what_pulls_as_the_law_does() -> None:
    F, _ = states()
    gel = WORDS["neo_hookean_isochoric"](young=3.0, poisson=0.3, density=1.0)
    laws = [
        (SmallStrainMeasure(), law_for(gel, "small")),
        (GreenStrain(), law_for(gel, "finite")),
        (IsochoricStrain(), gel.isochoric()),
        (BiotStrain(), law_for(gel, "corotational")),
    ]
    for measure, law in laws:
        np.testing.assert_allclose(measure.first_piola_stress(F, measure.stress(law, F)), law.P(F), atol=1e-13)


# ------------------------------------------------------------------ energies of a series


@dataclass(frozen=True)
class Point:
    """An energy of one point of a body, whose state is F."""

    law: Any
    w: Any = field(default_factory=lambda: np.ones((1, 1)))

    def F(self, x: Any) -> Any:
        return x.reshape(1, 3, 3)


GELS = {
    "small": ("linear_elastic", {"young": 3.0, "poisson": 0.3}, "whole", "small"),
    "turned": ("linear_elastic", {"young": 3.0, "poisson": 0.3}, "whole", "corotational"),
    "turned shape": ("linear_elastic", {"young": 3.0, "poisson": 0.3}, "shape", "corotational"),
    "green": ("st_venant_kirchhoff", {"young": 3.0, "poisson": 0.3}, "whole", "finite"),
    "neo": ("neo_hookean_isochoric", {"young": 3.0, "poisson": 0.3}, "shape", "finite"),
    "gent": ("gent", {"mu": 1.0, "limit": 9.0, "poisson": 0.3}, "shape", "finite"),
    "mooney": ("mooney_rivlin", {"c1": 0.45, "c2": 0.05, "poisson": 0.3}, "shape", "finite"),
    "ogden": ("ogden", {"mu": (1.0, -0.2), "alpha": (1.8, -2.0), "poisson": 0.3}, "shape", "finite"),
}


def walked(name: str, h: float, tau: list[float]) -> tuple[list[float], float]:
    """What is dissipated after every step of a way through shapes that come back, 3 s long, and what is left at its
    end of the work of internal forces, by the trapezoidal rule, relative to it: less what is stored and dissipated."""
    word, constants, of, strain = GELS[name]
    shares, times = SimpleNamespace(values=[0.5, 0.4]), SimpleNamespace(values=tau)
    gel = Viscoelastic(WORDS[word](**constants, density=1.0), shares, times, of)
    memories = BodyHistory((ViscoelasticHistory.at_rest(Point(law_for(gel.law, strain)), prony_series(gel, strain)),))
    rng = np.random.default_rng(3)
    ways, turns = 0.25 * rng.uniform(-1.0, 1.0, (2, 3, 3)), rng.uniform(0.5, 3.0, (2, 3, 3))
    lost, work, x, P = [], 0.0, np.eye(3), np.zeros((3, 3))
    for t in np.arange(h, 3.0 + 0.5 * h, h).tolist():
        y = np.eye(3) + ways[0] * np.sin(turns[0] * t) + ways[1] * (1.0 - np.cos(turns[1] * t))
        (point,) = memories.over(h)
        now: Any = point.law.P(y[None])[0]
        work += 0.5 * float(((P + now) * (y - x)).sum())
        memories, x, P = memories.history_after_step(y, h), y, now
        lost.append(memories.dissipated)
    (point,) = memories.energies
    own: Any = memories.each[0]
    stored = float(point.law.psi(x[None])[0]) + own.stored
    assert not memories.has_unknown_energy
    return lost, (work - stored - lost[-1]) / work


QUICK = ("small", "turned", "green", "neo")


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in sorted(GELS.keys() - {*QUICK}))]
)
def test_what_is_lost_never_comes_back_and_the_rest_is_stored(name: str) -> None:
    """On any way, in steps from a tenth to ten times of what relaxes; what is left is the step's, in its square."""
    lost, off = walked(name, 0.06, [0.5, 5.0])
    assert np.diff([0.0, *lost]).min() >= 0.0
    finer = walked(name, 0.03, [0.5, 5.0])[1]
    assert abs(off) < 0.01
    assert abs(finer) < max(0.4 * abs(off), 1e-5)
    for tau in ([0.006, 1e3], [0.6, 1e6]):
        assert np.diff([0.0, *walked(name, 0.06, tau)[0]]).min() >= 0.0


FIRST = {
    "neo": ("neo_hookean_isochoric", {"young": 3.0, "poisson": 0.4}),
    "yeoh": ("yeoh", {"c1": 0.5, "c2": 0.1, "c3": 0.02, "poisson": 0.4}),
    "gent": ("gent", {"mu": 1.0, "limit": 9.0, "poisson": 0.4}),
}


def shapes(n: int, most: float) -> Any:
    """C (n, 3, 3) that keeps the volume."""
    L = np.random.default_rng(n).uniform(-most, most, (n, 3, 3))
    values, axes = np.linalg.eigh(L + L.transpose(0, 2, 1))
    values = np.exp(values - values.mean(axis=1)[:, None])
    return (axes * values[:, None, :]) @ axes.transpose(0, 2, 1)


@pytest.mark.parametrize("name", sorted(FIRST))
def test_a_spring_stores_nothing_where_it_rests_and_never_less(name: str) -> None:
    """At q = S(C); elsewhere what is stored, and what is lost of it, are positive for all of 4 000 pairs of states."""
    word, constants = FIRST[name]
    law = first_invariant_branch(WORDS[word](**constants, density=1.0))
    assert law is not None
    C, other = shapes(4000, 0.4), shapes(4001, 0.4)[:4000]
    q = 0.5 * law.stress(other) + 0.3 * law.stress(C[::-1])  # of a past: shares of stresses
    rest = law.rest_strain(law.stress(C))
    np.testing.assert_allclose(rest, C, atol=1e-7)
    assert law.stored(C, law.stress(C)).max() < 1e-12
    raw = 0.5 * np.einsum("nij,nij->n", C - law.rest_strain(q), law.stress(C) - q)
    assert raw.min() > 0.0
    assert law.stored(C, q).min() > 0.0


@pytest.mark.parametrize("name", sorted(FIRST))
def test_where_a_spring_rests_is_the_shape_of_the_greatest_work(name: str) -> None:
    """Against a search by another program over shapes exp(L), tr L = 0, of W(C) - q : C / 2."""
    word, constants = FIRST[name]
    law = first_invariant_branch(WORDS[word](**constants, density=1.0))
    assert law is not None
    q = 0.6 * law.stress(shapes(1, 0.4))

    def energy(v: Any) -> float:
        L = np.array([[v[0], v[2], v[3]], [v[2], v[1], v[4]], [v[3], v[4], -v[0] - v[1]]])
        values, axes = np.linalg.eigh(L)
        C = (axes * np.exp(values)) @ axes.T
        return float(law.energy(np.array([np.trace(C) - 3.0]))[0] - 0.5 * np.sum(q[0] * C))

    found = minimize(energy, np.zeros(5), tol=1e-12)
    rest = law.rest_strain(q)
    own = law.energy(np.einsum("nii->n", rest) - 3.0) - 0.5 * np.einsum("nij,nij->n", q, rest)
    assert found.fun == pytest.approx(own[0], abs=1e-8)
    C, gel = shapes(2, 0.4)[:1], WORDS[word](**constants, density=1.0)
    whole = IsotropicBranch(gel.isochoric(), gel.shear_modulus, True)
    assert whole.stored(C, q)[0] == pytest.approx(law.stored(C, q)[0], rel=1e-9)
    assert whole.dissipation_times_tau(C, q)[0] == pytest.approx(law.dissipation_times_tau(C, q)[0], rel=1e-9)
    assert np.linalg.det(rest[0]) == pytest.approx(1.0, rel=1e-12)
