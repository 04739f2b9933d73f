"""History variables of relaxing materials, and the energy of their next time step.

A history is a set of arrays attached to an elastic energy over cells; it is immutable. `over(h)` returns the energy of
a time step of h seconds, and `accepted(x, h)` the history after that step. A time integrator keeps one history for each
energy, and replaces it once a step is accepted.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats

CANCELS = 1e-3  # multiple of tau: for shorter steps differences are evaluated as series
LINEAR = 1e-5  # fraction of the modulus: below this stress use the small-strain energy (rounding)
# panel edges in tau; points per panel; points for steps below SHORT tau
PANELS, POINTS, FEW, SHORT = (1.0, 4.0, 16.0), 5, 2, 0.05


class BranchSprings(Protocol):
    """Interface of the stored energy of a Maxwell branch, a function of C = F^T F (n, 3, 3) and lost stress q.

    q (n, 3, 3), Pa, is the stress that the branch has lost by relaxation. `keeps` is True if the energy depends only on
    the isochoric part of C.
    """

    @property
    def is_isochoric(self) -> bool: ...

    def stored(self, C: Floats, q: Floats) -> Floats:
        """Return the energy stored in a branch (n,), J/m^3, per unit of its share of the stress."""

    def dissipation_times_tau(self, C: Floats, q: Floats) -> Floats:
        """Return the dissipated power of a branch times its relaxation time (n,), J/m^3, per unit of its share."""


class RelaxationSeries(Protocol):
    """Interface of a Prony series: the fractions `g` (k,) of a stress relax with the times `tau` (k,), s.

    `mu` is the shear modulus at rest, Pa. `springs` is the stored energy of a branch; it is None if the stress is
    linear in its strain measure.
    """

    @property
    def g(self) -> Floats: ...
    @property
    def tau(self) -> Floats: ...
    @property
    def mu(self) -> float: ...
    @property
    def springs(self) -> BranchSprings | None: ...

    def twice_complementary_energy(self, S: Floats) -> Floats:
        """Return S : C^-1 : S (...), J/m^3, of stresses S (..., 3, 3), Pa, with C the elasticity tensor at rest."""

    def stress(self, F: Floats) -> Floats:
        """Return the relaxing stress (n, 3, 3), Pa, that is work-conjugate to `strain`."""

    def energy(self, F: Floats) -> Floats:
        """Return the energy density of the relaxing part of the law (n,), J/m^3."""

    def strain(self, F: Floats) -> Floats:
        """Return the strain (n, 3, 3) that is work-conjugate to `stress`."""

    def make_step_law(self, whole: Any, decay: Floats, mean: Floats, H: Floats, S: Floats, shape: Any) -> Any:
        """Return the law of a time step, from branch stresses H and stress S at its start, Pa.

        Over the step exp(-s/tau) falls to `decay` (k,) and has the mean `mean` (k,). `whole` is the instantaneous law.
        """


class EnergyHistory(ABC):
    """Base class of history variables of an energy: of viscoelastic cells, of a viscoelastic rod, or of pore fluid."""

    energy: Any  # instantaneous energy, before relaxation
    internal_work: float | None = None  # work of the internal forces, J, if the history counts it itself
    pore_pressure_work: float = (
        0.0  # work of prescribed pore pressures since the start, J; nodal forces do not contain it
    )
    has_unknown_energy = False  # stored or dissipated energy could not be computed at some point

    @abstractmethod
    def over(self, h: float) -> Energy:
        """Return the energy of the next step of h seconds; its minimum is the state at the end of the step."""

    @abstractmethod
    def history_after_step(self, x: Floats, h: float) -> EnergyHistory:
        """Return the history after a step of h seconds that ends in state x."""

    @property
    @abstractmethod
    def stored(self) -> float:
        """Energy stored in the branches minus their share of the instantaneous elastic energy, J."""

    @property
    @abstractmethod
    def dissipated(self) -> float:
        """Energy dissipated since the start, J."""


def decay_factors(h: float, tau: Floats) -> tuple[Floats, Floats, Floats]:
    """Return three factors of a step of h seconds for each relaxation time tau (k,), with z = h / tau.

    They are exp(-z), the mean of exp(-t/tau) over the step (1 if h = 0), and z - 2 tanh(z/2).
    """
    z = h / tau
    mean = -np.expm1(-z) / np.where(z > 0.0, z, 1.0) if h > 0.0 else np.ones_like(z)
    left = np.where(z > CANCELS, z - 2.0 * np.tanh(0.5 * z), z**3 * (1.0 - z * z / 10.0) / 12.0)
    return np.exp(-z), mean, left


@dataclass(frozen=True, eq=False)
class ViscoelasticHistory(EnergyHistory):
    """Viscoelastic history at the n integration points of an elastic `energy`, at the end of the last step.

    S (n, 3, 3), Pa, and W (n,), J/m^3, are stress and energy of the relaxing part of the law, E (n, 3, 3) is the
    strain, and H (k, n, 3, 3), Pa, are the branch stresses. `springs` (n,) is the energy stored in the branches and
    `lost` (n,) the dissipated energy, J/m^3.
    """

    energy: Any
    series: RelaxationSeries
    S: Floats
    W: Floats
    E: Floats
    H: Floats
    springs: Floats
    lost: Floats
    has_unknown_energy: bool = False  # stored or dissipated energy could not be computed at some point

    @classmethod
    def at_rest(cls, energy: Any, series: RelaxationSeries) -> ViscoelasticHistory:
        """Return the history of a body that has always been at rest."""
        n, k = energy.w.size, len(series.g)
        none, each = np.zeros((n, 3, 3)), np.zeros(n)
        return cls(energy, series, none, each, none, np.zeros((k, n, 3, 3)), each, each)

    def over(self, h: float) -> Energy:
        """Return the energy of the next step of h seconds; its minimum is the state at the end of the step."""
        decay, mean, _ = decay_factors(h, self.series.tau)
        law = self.series.make_step_law(self.energy.law, decay, mean, self.H, self.S, self.energy.w.shape)
        made: Energy = replace(self.energy, law=law)
        return made

    def history_after_step(self, x: Floats, h: float) -> ViscoelasticHistory:
        """Return the history after a step of h seconds that ends in state x."""
        known, (decay, mean, _) = self.series, decay_factors(h, self.series.tau)
        F = self.energy.F(x)
        S, W, E = known.stress(F), known.energy(F), known.strain(F)
        grown = np.einsum("k,nij->knij", known.g * mean, S - self.S)
        H = decay[:, None, None, None] * self.H + grown
        springs = self._branch_energy(H, S, E)
        if known.springs is None:
            lost = self._linear_step_dissipation(S, h)
        elif np.array_equal(E, self.E):  # at constant strain, the decrease of the stored energy
            lost = np.maximum(self.springs - springs, 0.0)
        else:
            lost = self._step_dissipation(known.springs, S, E, h)
        open_ = np.isnan(springs) | np.isnan(lost)
        springs, lost = np.where(open_, self.springs, springs), np.where(open_, 0.0, lost)
        return ViscoelasticHistory(
            self.energy, known, S, W, E, H, springs, self.lost + lost, self.has_unknown_energy or bool(open_.any())
        )

    def _branch_energy(self, H: Floats, S: Floats, E: Floats) -> Floats:
        """Return the energy stored in all branches (n,), J/m^3, at branch stresses H, total stress S and strain E.

        If the stress is linear in the strain, and also for very small stresses, it is sum H : C^-1 : H / 2g, with C the
        elasticity tensor at rest.
        """
        known = self.series
        small: Floats = 0.5 * np.einsum("kn,k->n", known.twice_complementary_energy(H), 1.0 / known.g)
        if known.springs is None:
            return small
        C, total = 2.0 * E + np.eye(3), np.zeros(len(S))
        for g, each in zip(known.g, H, strict=True):
            total += g * known.springs.stored(C, S - each / g)
        return np.where(np.abs(S).max(axis=(1, 2)) < LINEAR * known.mu, small, total)

    def _linear_step_dissipation(self, S: Floats, h: float) -> Floats:
        """Return the dissipation of a step of h seconds for a linear law (n,), J/m^3.

        It is int sum_i H : C^-1 : H / (g tau) dt. S (n, 3, 3), Pa, is the stress at the end of the step. The result is
        exact for branch stresses H = A exp(-s/tau) + B.
        """
        known = self.series
        total = np.zeros(len(S))
        if h <= 0.0:
            return total
        rate = (S - self.S) / h
        for g, tau, left, H in zip(known.g, known.tau, decay_factors(h, known.tau)[2], self.H, strict=True):
            z, B = h / tau, g * tau * rate
            a, half = -0.5 * tau * np.expm1(-2.0 * z), np.tanh(0.5 * z)
            # int |A e + B|^2 = a |A|^2 + 2 b A.B + h |B|^2, with A = H - B and b = -tau expm1(-z): a square in H and
            # B, kept as one, and what is left of B, h - b^2 / a = tau (z - 2 tanh(z / 2)), which short steps cancel
            total += (
                a * known.twice_complementary_energy(H + half * B) + tau * left * known.twice_complementary_energy(B)
            ) / (g * tau)
        return total

    def _step_dissipation(self, springs: BranchSprings, S: Floats, E: Floats, h: float) -> Floats:
        """Return the dissipation of a step of h seconds (n,), J/m^3, for a law that is not linear in the strain.

        `springs` is the stored energy of a branch; S, Pa, and E (n, 3, 3) are stress and strain at the end of the step.
        Both vary linearly in time, as the branch stresses assume. The time integral is computed by Gauss quadrature in
        panels. C is scaled to unit determinant if the law is isochoric.
        """
        known, total = self.series, np.zeros(len(S))
        if h <= 0.0:
            return total
        for g, tau, H in zip(known.g, known.tau, self.H, strict=True):
            B = tau * (S - self.S) / h
            for t, w in _panel_quadrature(h, tau):
                now, left = t / h, np.exp(-t / tau)
                C = np.eye(3) + 2.0 * (self.E + now * (E - self.E))
                if springs.is_isochoric:
                    C /= np.cbrt(np.linalg.det(C))[:, None, None]
                q = self.S + now * (S - self.S) - left * H / g + np.expm1(-t / tau) * B
                total += w * g / tau * springs.dissipation_times_tau(C, q)
        return total

    @property
    def stored(self) -> float:
        """Energy stored in the branches minus their share of the instantaneous energy, J.

        Added to the instantaneous elastic energy, it gives the stored energy.
        """
        return float((self.springs - self.series.g.sum() * self.W) @ self.energy.w.ravel())

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J."""
        return float(self.lost @ self.energy.w.ravel())


def _panel_quadrature(h: float, tau: float) -> list[tuple[float, float]]:
    """Return times and weights, s, that integrate a function decaying with tau over a step of h seconds."""
    cuts = [0.0, *(edge * tau for edge in PANELS if edge * tau < h), h]
    xi, w = np.polynomial.legendre.leggauss(POINTS if h > SHORT * tau else FEW)
    return [
        (0.5 * (a + b + (b - a) * x), 0.5 * (b - a) * weight)
        for a, b in pairwise(cuts)
        for x, weight in zip(xi.tolist(), w.tolist(), strict=True)
    ]


@dataclass(frozen=True, eq=False)
class BodyHistory:
    """History variables of a body; `each` holds the history of each internal energy, or the energy without one."""

    each: tuple[EnergyHistory | Energy, ...]

    @property
    def energies(self) -> tuple[Energy, ...]:
        """Instantaneous energies, before any relaxation."""
        return tuple(own.energy if isinstance(own, EnergyHistory) else own for own in self.each)

    def over(self, h: float) -> tuple[Energy, ...]:
        """Return the internal energies of the next step of h seconds."""
        return tuple(own.over(h) if isinstance(own, EnergyHistory) else own for own in self.each)

    def history_after_step(self, x: Floats, h: float) -> BodyHistory:
        """Return the histories after a step of h seconds that ends in state x."""
        return BodyHistory(
            tuple(own.history_after_step(x, h) if isinstance(own, EnergyHistory) else own for own in self.each)
        )

    def stored(self, x: Floats) -> float:
        """Return the elastic energy stored in the body in state x, J; the histories must be those at this state."""
        return float(sum(e.value(x) for e in self.energies)) + sum(memory.stored for memory in self._histories)

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J."""
        return sum(memory.dissipated for memory in self._histories)

    @property
    def has_unknown_energy(self) -> bool:
        """True if the stored or dissipated energy could not be computed at some point."""
        return any(own.has_unknown_energy for own in self._histories)

    @property
    def pore_pressure_work(self) -> float:
        """Work done since the start by prescribed pore pressures, J."""
        return sum(memory.pore_pressure_work for memory in self._histories)

    @property
    def internal_work(self) -> float | None:
        """Work of the internal forces since the start, J; None if some internal energy does not count it."""
        each = [own.internal_work for own in self._histories if own.internal_work is not None]
        return float(sum(each)) if len(each) == len(self.each) else None

    @property
    def _histories(self) -> tuple[EnergyHistory, ...]:
        """Histories of the internal energies that have one."""
        return tuple(own for own in self.each if isinstance(own, EnergyHistory))


def largest_drop_below_maximum(lost: Floats) -> float:
    """Return the largest decrease of the dissipated energy `lost` (t,), J, below an earlier value."""
    return float((np.maximum.accumulate(lost) - lost).max(initial=0.0))
