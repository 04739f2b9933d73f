"""History variables of relaxing materials, and the energy of their next time step.

A history is a set of arrays attached to an elastic energy over cells; it is immutable. `over(h)` returns the energy of
a step of h seconds, `accepted(x, h)` the history after it. A time integrator keeps one history for each energy, and
replaces it once a step is accepted.
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
    """Energy of the springs of Maxwell branches, for C (n, 3, 3) and relaxed stress q (n, 3, 3), Pa.

    `keeps` is True if only the isochoric part of C counts.
    """

    @property
    def keeps(self) -> bool: ...

    def stored(self, C: Floats, q: Floats) -> Floats:
        """Return the stored energy per unit branch share (n,), J/m^3."""

    def rate(self, C: Floats, q: Floats) -> Floats:
        """Return tau times the dissipation per unit branch share (n,), J/m^3."""


class RelaxationSeries(Protocol):
    """Interface of a Prony series: shares `g` (k,) of a stress relax in times `tau` (k,), s.

    If `springs` is None the stress is linear in its strain.
    """

    @property
    def g(self) -> Floats: ...
    @property
    def tau(self) -> Floats: ...
    @property
    def mu(self) -> float: ...
    @property
    def springs(self) -> BranchSprings | None: ...

    def compliant(self, S: Floats) -> Floats:
        """Return S : C^-1 : S (...), J/m^3, of stresses (..., 3, 3), with the moduli at rest."""

    def stress(self, F: Floats) -> Floats:
        """Return the relaxing stress that is work-conjugate to `strain`, Pa (n, 3, 3)."""

    def energy(self, F: Floats) -> Floats:
        """Return the energy of the relaxing stress, J/m^3 (n,)."""

    def strain(self, F: Floats) -> Floats:
        """Return the strain that is work-conjugate to `stress` (n, 3, 3)."""

    def relaxed(self, whole: Any, decay: Floats, mean: Floats, H: Floats, S: Floats, shape: Any) -> Any:
        """Return the law of a step over which exp(-s/tau) falls to `decay` (k,) and has the mean `mean` (k,)."""


class EnergyHistory(ABC):
    """History of an energy: at points of cells (`ViscoelasticHistory`), in elements of a rod, or of pore fluid."""

    energy: Any  # instantaneous energy, before relaxation
    worked: float | None = None  # work of the internal forces, J, if the history counts it itself
    pumped: float = 0.0  # work of prescribed pore pressures since the start, J; nodal forces do not contain it
    unknown = False  # stored or dissipated energy could not be computed at some point

    @abstractmethod
    def over(self, h: float) -> Energy:
        """Return the energy that governs the end of a step of h seconds from here."""

    @abstractmethod
    def accepted(self, x: Floats, h: float) -> EnergyHistory:
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
    """Return exp(-z), its mean over a step of h s (1 if h = 0), and z - 2 tanh(z/2), with z = h / tau (k,)."""
    z = h / tau
    mean = -np.expm1(-z) / np.where(z > 0.0, z, 1.0) if h > 0.0 else np.ones_like(z)
    left = np.where(z > CANCELS, z - 2.0 * np.tanh(0.5 * z), z**3 * (1.0 - z * z / 10.0) / 12.0)
    return np.exp(-z), mean, left


@dataclass(frozen=True, eq=False)
class ViscoelasticHistory(EnergyHistory):
    """Viscoelastic history at the integration points of an elastic `energy`.

    At the end of the last step: stress S (n, 3, 3) and energy W (n,) of the relaxing part, strain E, and branch
    stresses H (k, n, 3, 3), Pa. `springs` (n,) is the energy stored in the branches, `lost` (n,) the dissipated energy,
    J/m^3.
    """

    energy: Any
    series: RelaxationSeries
    S: Floats
    W: Floats
    E: Floats
    H: Floats
    springs: Floats
    lost: Floats
    unknown: bool = False  # stored or dissipated energy could not be computed at some point

    @classmethod
    def at_rest(cls, energy: Any, series: RelaxationSeries) -> ViscoelasticHistory:
        """Return the history of a body that has always been at rest."""
        n, k = energy.w.size, len(series.g)
        none, each = np.zeros((n, 3, 3)), np.zeros(n)
        return cls(energy, series, none, each, none, np.zeros((k, n, 3, 3)), each, each)

    def over(self, h: float) -> Energy:
        """Return the energy that governs the end of a step of h seconds from here."""
        decay, mean, _ = decay_factors(h, self.series.tau)
        law = self.series.relaxed(self.energy.law, decay, mean, self.H, self.S, self.energy.w.shape)
        made: Energy = replace(self.energy, law=law)
        return made

    def accepted(self, x: Floats, h: float) -> ViscoelasticHistory:
        """Return the history after a step of h seconds that ends in state x."""
        known, (decay, mean, _) = self.series, decay_factors(h, self.series.tau)
        F = self.energy.F(x)
        S, W, E = known.stress(F), known.energy(F), known.strain(F)
        grown = np.einsum("k,nij->knij", known.g * mean, S - self.S)
        H = decay[:, None, None, None] * self.H + grown
        springs = self._springs(H, S, E)
        if known.springs is None:
            lost = self._linear_loss(S, h)
        elif np.array_equal(E, self.E):  # at constant strain, the decrease of the stored energy
            lost = np.maximum(self.springs - springs, 0.0)
        else:
            lost = self._loss(known.springs, S, E, h)
        open_ = np.isnan(springs) | np.isnan(lost)
        springs, lost = np.where(open_, self.springs, springs), np.where(open_, 0.0, lost)
        return ViscoelasticHistory(
            self.energy, known, S, W, E, H, springs, self.lost + lost, self.unknown or bool(open_.any())
        )

    def _springs(self, H: Floats, S: Floats, E: Floats) -> Floats:
        """Return the branch energy (n,), J/m^3: H : C^-1 : H / 2g if stress is linear in strain, or small."""
        known = self.series
        small: Floats = 0.5 * np.einsum("kn,k->n", known.compliant(H), 1.0 / known.g)
        if known.springs is None:
            return small
        C, total = 2.0 * E + np.eye(3), np.zeros(len(S))
        for g, each in zip(known.g, H, strict=True):
            total += g * known.springs.stored(C, S - each / g)
        return np.where(np.abs(S).max(axis=(1, 2)) < LINEAR * known.mu, small, total)

    def _linear_loss(self, S: Floats, h: float) -> Floats:
        """Return int sum_i H : C^-1 : H / (g tau) dt over a step (n,), J/m^3; exact for H = A exp(-s/tau) + B."""
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
            total += (a * known.compliant(H + half * B) + tau * left * known.compliant(B)) / (g * tau)
        return total

    def _loss(self, springs: BranchSprings, S: Floats, E: Floats, h: float) -> Floats:
        """Return the dissipation of a step for a law with known `springs`, by Gauss quadrature in panels.

        S and the strain vary linearly in time, as the branch stresses assume; C is scaled if its volume is kept.
        """
        known, total = self.series, np.zeros(len(S))
        if h <= 0.0:
            return total
        for g, tau, H in zip(known.g, known.tau, self.H, strict=True):
            B = tau * (S - self.S) / h
            for t, w in _panel_quadrature(h, tau):
                now, left = t / h, np.exp(-t / tau)
                C = np.eye(3) + 2.0 * (self.E + now * (E - self.E))
                if springs.keeps:
                    C /= np.cbrt(np.linalg.det(C))[:, None, None]
                q = self.S + now * (S - self.S) - left * H / g + np.expm1(-t / tau) * B
                total += w * g / tau * springs.rate(C, q)
        return total

    @property
    def stored(self) -> float:
        """Branch energy minus its share of the instantaneous law's energy, J: to be added to the elastic energy."""
        return float((self.springs - self.series.g.sum() * self.W) @ self.energy.w.ravel())

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J."""
        return float(self.lost @ self.energy.w.ravel())


def _panel_quadrature(h: float, tau: float) -> list[tuple[float, float]]:
    """Return times and weights, s, of the quadrature of a function decaying with tau over a step of h s."""
    cuts = [0.0, *(edge * tau for edge in PANELS if edge * tau < h), h]
    xi, w = np.polynomial.legendre.leggauss(POINTS if h > SHORT * tau else FEW)
    return [
        (0.5 * (a + b + (b - a) * x), 0.5 * (b - a) * weight)
        for a, b in pairwise(cuts)
        for x, weight in zip(xi.tolist(), w.tolist(), strict=True)
    ]


@dataclass(frozen=True, eq=False)
class BodyHistory:
    """Histories of a body: `each` holds, for each internal energy, its history, or the energy itself if it has none."""

    each: tuple[EnergyHistory | Energy, ...]

    @property
    def energies(self) -> tuple[Energy, ...]:
        """Instantaneous energies, before any relaxation."""
        return tuple(own.energy if isinstance(own, EnergyHistory) else own for own in self.each)

    def over(self, h: float) -> tuple[Energy, ...]:
        """Return the energies of a step of h s from here."""
        return tuple(own.over(h) if isinstance(own, EnergyHistory) else own for own in self.each)

    def accepted(self, x: Floats, h: float) -> BodyHistory:
        """Return the histories after a step of h s that ends in state x."""
        return BodyHistory(tuple(own.accepted(x, h) if isinstance(own, EnergyHistory) else own for own in self.each))

    def stored(self, x: Floats) -> float:
        """Return the energy of all springs in state x, J; the histories must be of that state."""
        return float(sum(e.value(x) for e in self.energies)) + sum(memory.stored for memory in self._fading)

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J."""
        return sum(memory.dissipated for memory in self._fading)

    @property
    def unknown(self) -> bool:
        """True if the stored or dissipated energy could not be computed at some point."""
        return any(own.unknown for own in self._fading)

    @property
    def pumped(self) -> float:
        """Work done since the start by prescribed pore pressures, J."""
        return sum(memory.pumped for memory in self._fading)

    @property
    def worked(self) -> float | None:
        """Work of the internal forces, J, or None unless every history counts its own."""
        each = [own.worked for own in self._fading if own.worked is not None]
        return float(sum(each)) if len(each) == len(self.each) else None

    @property
    def _fading(self) -> tuple[EnergyHistory, ...]:
        return tuple(own for own in self.each if isinstance(own, EnergyHistory))


def largest_decrease(lost: Floats) -> float:
    """Return the largest decrease of the dissipated energy `lost` (t,) below an earlier value, J."""
    return float((np.maximum.accumulate(lost) - lost).max(initial=0.0))
