"""Independent stress of viscoelastic bodies by the hereditary integral, from the history of nodal displacements.

The relaxing stress is int G(t - s) dS/ds ds with G(t) = sum_i g_i exp(-t / tau_i). Between two known states S varies
linearly in time, and G is integrated exactly. Every step contributes with the decay since it was made; no recursion
over steps is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any, Literal

import numpy as np

from softmark.records import dataclass
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody, SplitLaw
from softmark.solvers.independent_forces.solid_forces import (
    CheckedBody,
    Floats,
    Ints,
    Stress,
    StressTerm,
    interpolate,
    polar_rotation,
    quadrature_rule,
    shape_gradients_and_volumes,
)
from softmark.solvers.independent_forces.stress_by_differences import stress_with_error

Measure = Literal["small", "turned", "green", "shape"]


def remaining_fractions(times: Sequence[float], shares: Floats, taus: Floats) -> Floats:
    """Return the fraction of each step's stress change that remains at the last of `times`, s: (t,).

    It is the relaxing fraction multiplied by its decay, for a Prony series with shares (k,) and relaxation times (k,),
    s.
    """
    t = np.array(times)
    begin = np.concatenate([[0.0], t[:-1]])
    found = np.zeros(len(t))
    for g, tau in zip(shares, taus, strict=True):
        width = (t - begin) / tau
        mean = np.where(width > 0.0, -np.expm1(-width) / np.where(width > 0.0, width, 1.0), 1.0)
        found += g * np.exp(-(t[-1] - t) / tau) * mean
    return found


def series_of_youngs_modulus(shares: Floats, taus: Floats, poisson: float) -> tuple[Floats, Floats]:
    """Return the shares and relaxation times, s, of the Prony series of Young's modulus.

    The shear modulus relaxes with `shares` (k,) and `taus` (k,), s; the bulk modulus is constant. The series is found
    from the poles and residues of E / G0 = 9 k G / (3 k + G), k = K / G0.
    """
    k = 2.0 * (1.0 + poisson) / (3.0 * (1.0 - 2.0 * poisson))
    D = np.poly(-1.0 / taus)  # of the product of s + 1/tau
    N = D - sum(g / t * np.pad(np.atleast_1d(np.poly(-np.delete(1.0 / taus, i))), (1, 0))
                for i, (g, t) in enumerate(zip(shares, taus, strict=True)))  # fmt: skip
    bottom = 3.0 * k * D + N
    poles = np.roots(bottom).real
    each = np.polyval(9.0 * k * N, poles) / np.polyval(np.polyder(bottom), poles)
    late: Any = -1.0 / poles
    found: Floats = -each * late / (9.0 * k / (3.0 * k + 1.0))
    return found, late


@dataclass(frozen=True)
class DisplacementHistory:
    """History of nodal displacements `states` (t, n, 3), m, at `times` (t,), s, and the law whose stress relaxes.

    `part` is the relaxing law, and `g` (k,) and `tau` (k,), s, its Prony series. `measure` is the strain measure:
    "small", "turned" (U - 1), "green", or "shape", which is Green's strain of J^(-1/3) F.
    """

    times: Sequence[float]
    states: Sequence[Floats]
    part: Stress
    g: Floats
    tau: Floats
    measure: Measure
    depth: float = 0.0

    def remaining_stress(self, points: Floats, cells: Ints, kind: str, mean: bool = False) -> Floats:
        """Return the part of the relaxing stress that remains from the history (m q, 3, 3), Pa, in some cells.

        It is conjugate to the strain measure, and given at the quadrature points of the cells, or once per cell if
        `mean`.
        """
        dNdX, _, hoop = shape_gradients_and_volumes(points, cells, kind, quadrature_rule(kind), self.depth, mean)
        steps = remaining_fractions(self.times, self.g, self.tau)
        found = before = np.zeros((dNdX.shape[0] * dNdX.shape[1], 3, 3))
        for weight, u in zip(steps, self.states, strict=True):
            F = np.einsum("mai,mqaJ->mqiJ", u[cells] - u[cells[:, :1]], dNdX) + np.eye(3)
            if hoop is not None:
                F[..., 2, 2] = 1.0 + interpolate(hoop, u[cells][:, :, 0])
            S = self.conjugate_stress(F.reshape(-1, 3, 3))
            found, before = found + weight * (S - before), S
        return found

    def conjugate_stress(self, F: Floats) -> Floats:
        """Return the relaxing stress (n, 3, 3), Pa, at F (n, 3, 3), conjugate to the strain measure."""
        P = self.part(F)
        if self.measure == "small":
            return P
        if self.measure == "turned":
            S = np.einsum("nki,nkj->nij", polar_rotation(F), P)
            even: Floats = 0.5 * (S + S.transpose(0, 2, 1))
            return even
        size = np.linalg.det(F)[:, None, None] ** (2.0 / 3.0) if self.measure == "shape" else 1.0
        found: Floats = size * (np.linalg.inv(F) @ P)
        return found

    def relaxed_stress_with_error(self, whole: Stress, F: Floats, held: Floats) -> tuple[Floats, Any]:
        """Return P (n, 3, 3), Pa, of the `whole` law after relaxation of its viscous part, and its error, Pa.

        `held` (n, 3, 3), Pa, is the stress that remains from the history.
        """
        (P, error), (part, more), g = stress_with_error(whole, F), stress_with_error(self.part, F), float(self.g.sum())
        found: Floats = P - g * part + self.first_piola_stress(F, held)
        return found, error + g * more

    def first_piola_stress(self, F: Floats, held: Floats) -> Floats:
        """Return the first Piola-Kirchhoff stress (n, 3, 3), Pa, of a stress `held` conjugate to the strain measure."""
        if self.measure == "small":
            return held
        if self.measure == "turned":
            return 2.0 * F @ _solve_sylvester(np.einsum("nki,nkj->nij", polar_rotation(F), F), held)
        tau = F @ held @ F.transpose(0, 2, 1)  # Kirchhoff's
        if self.measure == "shape":
            tau = tau - np.trace(tau, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
            tau = tau * np.linalg.det(F)[:, None, None] ** (-2.0 / 3.0)
        found: Floats = tau @ np.linalg.inv(F).transpose(0, 2, 1)
        return found


def _solve_sylvester(U: Floats, H: Floats) -> Floats:
    """Return the solution X (n, 3, 3) of U X + X U = H, by nine linear equations."""
    one = np.eye(3)
    K = np.einsum("nij,kl->nikjl", U, one) + np.einsum("ij,nkl->nikjl", one, U)
    found: Floats = np.linalg.solve(K.reshape(-1, 9, 9), H.reshape(-1, 9, 1)).reshape(-1, 3, 3)
    return found


@dataclass(frozen=True)
class ViscoelasticBody(CheckedBody):
    """A deformed mesh of viscoelastic material, with `course`, the history of its displacements."""

    course: DisplacementHistory = field(kw_only=True)

    def _stress(self, cells: Ints, term: StressTerm, F: Floats, at: slice) -> tuple[Floats, Any]:
        """Return P (n, 3, 3), Pa, at the points of some cells, and the error of its entries, Pa."""
        return self.course.relaxed_stress_with_error(
            term.stress, F, self.course.remaining_stress(self.points, cells, self.kind, term.mean)
        )


@dataclass(frozen=True)
class ViscoelasticMixedBody(MixedBody):
    """A deformed viscoelastic mesh with pressure unknowns, whose deviatoric stress relaxes."""

    course: DisplacementHistory = field(kw_only=True)

    def _split(self, some: slice) -> SplitLaw:
        """Return the split law of the cells `some`, including the deviatoric stress that remains from the history."""
        course, whole = self.course, self.split.shape
        held = course.remaining_stress(self.points, self.cells[some], self.kind)
        return replace(self.split, shape=RelaxedStress(course, whole, held))


@dataclass(frozen=True)
class RelaxedStress:
    """Stress of a `whole` law after relaxation of its viscous part, as a function of F.

    `held` (n, 3, 3), Pa, is the stress that remains from the history.
    """

    course: DisplacementHistory
    whole: Stress
    held: Floats

    def __call__(self, F: Floats) -> Floats:
        """Return the first Piola-Kirchhoff stress (n, 3, 3), Pa, at F (n, 3, 3)."""
        return self.with_error(F)[0]

    def with_error(self, F: Floats) -> tuple[Floats, Any]:
        """Return P (n, 3, 3) and the error of its entries, Pa."""
        return self.course.relaxed_stress_with_error(self.whole, F, self.held)
