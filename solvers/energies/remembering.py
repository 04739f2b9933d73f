"""What the points of cells remember of their past, and the energy of their next step.

A memory is arrays beside an elastic energy over cells; it is never changed. `over(h)` is the energy of a step of h
seconds, `accepted(x, h)` the memory after it: whoever marches keeps one for each energy, and takes the next once a step
is accepted.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats

CANCELS = 1e-3  # times of relaxation: over a shorter step differences are taken as series
NONE = 1e-18  # of the modulus, squared: stresses below are none, and store as small ones do


class Fading(Protocol):
    """A stress that relaxes: shares `g` (k,) of it in times `tau` (k,), s; `small` strains, or Green's."""

    @property
    def g(self) -> Floats: ...
    @property
    def tau(self) -> Floats: ...
    @property
    def mu(self) -> float: ...
    @property
    def small(self) -> bool: ...

    def weights(self, h: float) -> tuple[Floats, Floats]:
        """exp(-h/tau), and the mean of exp(-s/tau) over a step of h s (k,)."""

    def compliant(self, S: Floats) -> Floats:
        """S : C^-1 : S (...), J/m^3, of stresses (..., 3, 3) by the moduli at rest."""

    def stress(self, F: Floats) -> Floats:
        """The second Piola-Kirchhoff stress of what relaxes, Pa (n, 3, 3)."""

    def energy(self, F: Floats) -> Floats:
        """Its energy, J/m^3 (n,)."""

    def strain(self, F: Floats) -> Floats:
        """The strain that works with it (n, 3, 3)."""

    def relaxed(self, whole: Any, h: float, H: Floats, S: Floats, shape: Any) -> Any:
        """The law of a step."""


@dataclass(frozen=True, eq=False)
class Memory:
    """What the points of an elastic `energy` over cells remember.

    Of the end of the last step: the stress S (n, 3, 3) and the energy W (n,) of what relaxes, the strain E, and the
    stresses H (k, n, 3, 3) of the branches, Pa; `springs` (n,) is what these store, `lost` (n,) what is dissipated,
    J/m^3.
    """

    energy: Any
    series: Fading
    S: Floats
    W: Floats
    E: Floats
    H: Floats
    springs: Floats
    lost: Floats

    @classmethod
    def at_rest(cls, energy: Any, series: Fading) -> Memory:
        """That of what has always been at rest."""
        n, k = energy.w.size, len(series.g)
        none, each = np.zeros((n, 3, 3)), np.zeros(n)
        return cls(energy, series, none, each, none, np.zeros((k, n, 3, 3)), each, each)

    def over(self, h: float) -> Energy:
        """The energy of a step of h s from here: of its end."""
        law = self.series.relaxed(self.energy.law, h, self.H, self.S, self.energy.w.shape)
        made: Energy = replace(self.energy, law=law)
        return made

    def accepted(self, x: Floats, h: float) -> Memory:
        """The memory after a step of h s that ends in the state x."""
        known, (decay, mean) = self.series, self.series.weights(h)
        F = self.energy.F(x)
        S, W, E = known.stress(F), known.energy(F), known.strain(F)
        grown = np.einsum("k,nij->knij", known.g * mean, S - self.S)
        H = decay[:, None, None, None] * self.H + grown
        springs = self._springs(H, S, W)
        lost = self.lost + (self._small_loss(S, h) if known.small else self._loss(S, W, E, H, springs))
        return Memory(self.energy, known, S, W, E, H, springs, lost)

    def _springs(self, H: Floats, S: Floats, W: Floats) -> Floats:
        """What the branches store (n,), J/m^3: as much of W as their stress is of S, in the square.

        In small strain H : C^-1 : H / 2g; of what is strained at once g W, whatever the strain.
        """
        known = self.series
        own: Floats = np.einsum("kn,k->n", known.compliant(H), 1.0 / known.g)
        if known.small:
            return 0.5 * own
        whole = known.compliant(S)
        some = whole > NONE * known.mu
        found: Floats = own * np.where(some, W / np.where(some, whole, 1.0), 0.5)
        return found

    def _small_loss(self, S: Floats, h: float) -> Floats:
        """int sum_i H : C^-1 : H / (g tau) dt over a step (n,), J/m^3, never negative: exact, H = A exp(-s/tau) + B."""
        known = self.series
        total = np.zeros(len(S))
        if h <= 0.0:
            return total
        rate = (S - self.S) / h
        for g, tau, H in zip(known.g, known.tau, self.H, strict=True):
            z, B = h / tau, g * tau * rate
            a, half = -0.5 * tau * np.expm1(-2.0 * z), np.tanh(0.5 * z)
            # int |A e + B|^2 = a |A|^2 + 2 b A.B + h |B|^2, with A = H - B and b = -tau expm1(-z): a square in H and
            # B, kept as one, and what is left of B, h - b^2 / a = tau (z - 2 tanh(z / 2)), which short steps cancel
            left = z - 2.0 * half if z > CANCELS else z**3 * (1.0 - z * z / 10.0) / 12.0
            total += (a * known.compliant(H + half * B) + tau * left * known.compliant(B)) / (g * tau)
        return total

    def _loss(self, S: Floats, W: Floats, E: Floats, H: Floats, springs: Floats) -> Floats:
        """Work of the branches over a step less what they store more (n,), J/m^3.

        The work is that of the stress of the branches, or that of the whole less that of what has relaxed of it,
        whichever of these two is the smaller: the trapezoidal rule then errs by a part of what is dissipated.
        """
        known = self.series
        way, before, after = E - self.E, self.H.sum(axis=0), H.sum(axis=0)
        share = float(known.g.sum())
        held = 0.5 * (before + after)
        gone = 0.5 * share * (self.S + S) - held
        direct = np.einsum("nij,nij->n", held, way)
        around = share * (W - self.W) - np.einsum("nij,nij->n", gone, way)
        less = np.einsum("nij,nij->n", held, held) <= np.einsum("nij,nij->n", gone, gone)
        found: Floats = np.where(less, direct, around) - (springs - self.springs)
        return found

    @property
    def stored(self) -> float:
        """What branches store less what the law at once has in their place, J: to be added to its energy."""
        return float((self.springs - self.series.g.sum() * self.W) @ self.energy.w.ravel())

    @property
    def dissipated(self) -> float:
        """Since the start, J."""
        return float(self.lost @ self.energy.w.ravel())


@dataclass(frozen=True, eq=False)
class Memories:
    """Those of a body: of `each` of its internal energies the memory, or the energy itself where it has none."""

    each: tuple[Memory | Energy, ...]

    @property
    def energies(self) -> tuple[Energy, ...]:
        """Those that it has before anything relaxes."""
        return tuple(own.energy if isinstance(own, Memory) else own for own in self.each)

    def over(self, h: float) -> tuple[Energy, ...]:
        """Those of a step of h s from here."""
        return tuple(own.over(h) if isinstance(own, Memory) else own for own in self.each)

    def accepted(self, x: Floats, h: float) -> Memories:
        """The same after a step of h s that ends in the state x."""
        return Memories(tuple(own.accepted(x, h) if isinstance(own, Memory) else own for own in self.each))

    def stored(self, x: Floats) -> float:
        """Energy of all springs in the state x that the memories are of, J."""
        return float(sum(e.value(x) for e in self.energies)) + sum(memory.stored for memory in self._fading)

    @property
    def dissipated(self) -> float:
        """Since the start, J."""
        return sum(memory.dissipated for memory in self._fading)

    @property
    def _fading(self) -> tuple[Memory, ...]:
        return tuple(own for own in self.each if isinstance(own, Memory))


def fall_of(lost: Floats) -> float:
    """How much of what is dissipated up to each of some times (t,), J, comes back at most."""
    return float((np.maximum.accumulate(lost) - lost).max(initial=0.0))
