"""What the points of cells remember of their past, and the energy of their next step.

A memory is arrays beside an elastic energy over cells; it is never changed. `over(h)` is the energy of a step of h
seconds, `accepted(x, h)` the memory after it: whoever marches keeps one for each energy, and takes the next once a step
is accepted.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats

CANCELS = 1e-3  # times of relaxation: over a shorter step differences are taken as series
LINEAR = (
    1e-5  # of the modulus: of smaller stresses energies of finite strain are rounding, and those of small ones right
)
PANELS, POINTS, FEW, SHORT = (1.0, 4.0, 16.0), 5, 2, 0.05  # times of relaxation; points in each; in a step so short


class Springs(Protocol):
    """Springs of a law of C (n, 3, 3), q (n, 3, 3), Pa, being lost of them; whether C `keeps` its volume."""

    @property
    def keeps(self) -> bool: ...

    def stored(self, C: Floats, q: Floats) -> Floats:
        """The energy per share (n,), J/m^3."""

    def rate(self, C: Floats, q: Floats) -> Floats:
        """tau times what is dissipated per share (n,), J/m^3."""


class Fading(Protocol):
    """A stress that relaxes: shares `g` (k,) of it in times `tau` (k,), s; linear in its strain without `springs`."""

    @property
    def g(self) -> Floats: ...
    @property
    def tau(self) -> Floats: ...
    @property
    def mu(self) -> float: ...
    @property
    def springs(self) -> Springs | None: ...

    def compliant(self, S: Floats) -> Floats:
        """S : C^-1 : S (...), J/m^3, of stresses (..., 3, 3) by the moduli at rest."""

    def stress(self, F: Floats) -> Floats:
        """The stress of what relaxes that works with its strain, Pa (n, 3, 3)."""

    def energy(self, F: Floats) -> Floats:
        """Its energy, J/m^3 (n,)."""

    def strain(self, F: Floats) -> Floats:
        """The strain that works with it (n, 3, 3)."""

    def relaxed(self, whole: Any, decay: Floats, mean: Floats, H: Floats, S: Floats, shape: Any) -> Any:
        """The law of a step over which exp(-s/tau) falls to `decay` (k,), and is `mean` (k,)."""


class Fades(ABC):
    """A memory of an energy: at points of cells (`Memory`), in elements of a rod or in pores."""

    energy: Any  # what it has before anything relaxes
    worked: float | None = None  # J, by what it is the memory of, where it counts that itself
    pumped: float = 0.0  # J, since the start by pressures of fluid that are held: forces do not tell of it
    unknown = False  # whether what it stores or has lost was not found somewhere

    @abstractmethod
    def over(self, h: float) -> Energy:
        """The energy of a step of h s from here: of its end."""

    @abstractmethod
    def accepted(self, x: Floats, h: float) -> Fades:
        """The memory after a step of h s that ends in the state x."""

    @property
    @abstractmethod
    def stored(self) -> float:
        """What branches store less what the energy at once has in their place, J."""

    @property
    @abstractmethod
    def dissipated(self) -> float:
        """Since the start, J."""


def fading(h: float, tau: Floats) -> tuple[Floats, Floats, Floats]:
    """exp(-z), its mean over a step of h s, 1 where that takes no time, and z - 2 tanh(z/2), z = h / tau (k,)."""
    z = h / tau
    mean = -np.expm1(-z) / np.where(z > 0.0, z, 1.0) if h > 0.0 else np.ones_like(z)
    left = np.where(z > CANCELS, z - 2.0 * np.tanh(0.5 * z), z**3 * (1.0 - z * z / 10.0) / 12.0)
    return np.exp(-z), mean, left


@dataclass(frozen=True, eq=False)
class Memory(Fades):
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
    unknown: bool = False  # whether what is stored or lost was not found somewhere

    @classmethod
    def at_rest(cls, energy: Any, series: Fading) -> Memory:
        """That of what has always been at rest."""
        n, k = energy.w.size, len(series.g)
        none, each = np.zeros((n, 3, 3)), np.zeros(n)
        return cls(energy, series, none, each, none, np.zeros((k, n, 3, 3)), each, each)

    def over(self, h: float) -> Energy:
        """The energy of a step of h s from here: of its end."""
        decay, mean, _ = fading(h, self.series.tau)
        law = self.series.relaxed(self.energy.law, decay, mean, self.H, self.S, self.energy.w.shape)
        made: Energy = replace(self.energy, law=law)
        return made

    def accepted(self, x: Floats, h: float) -> Memory:
        """The memory after a step of h s that ends in the state x."""
        known, (decay, mean, _) = self.series, fading(h, self.series.tau)
        F = self.energy.F(x)
        S, W, E = known.stress(F), known.energy(F), known.strain(F)
        grown = np.einsum("k,nij->knij", known.g * mean, S - self.S)
        H = decay[:, None, None, None] * self.H + grown
        springs = self._springs(H, S, E)
        if known.springs is None:
            lost = self._linear_loss(S, h)
        elif np.array_equal(E, self.E):  # all that has been stored and is no more
            lost = np.maximum(self.springs - springs, 0.0)
        else:
            lost = self._loss(known.springs, S, E, h)
        open_ = np.isnan(springs) | np.isnan(lost)
        springs, lost = np.where(open_, self.springs, springs), np.where(open_, 0.0, lost)
        return Memory(self.energy, known, S, W, E, H, springs, self.lost + lost, self.unknown or bool(open_.any()))

    def _springs(self, H: Floats, S: Floats, E: Floats) -> Floats:
        """What the branches store (n,), J/m^3: H : C^-1 : H / 2g where stress is linear in strain, or small."""
        known = self.series
        small: Floats = 0.5 * np.einsum("kn,k->n", known.compliant(H), 1.0 / known.g)
        if known.springs is None:
            return small
        C, total = 2.0 * E + np.eye(3), np.zeros(len(S))
        for g, each in zip(known.g, H, strict=True):
            total += g * known.springs.stored(C, S - each / g)
        return np.where(np.abs(S).max(axis=(1, 2)) < LINEAR * known.mu, small, total)

    def _linear_loss(self, S: Floats, h: float) -> Floats:
        """int sum_i H : C^-1 : H / (g tau) dt over a step (n,), J/m^3, never negative: exact, H = A exp(-s/tau) + B."""
        known = self.series
        total = np.zeros(len(S))
        if h <= 0.0:
            return total
        rate = (S - self.S) / h
        for g, tau, left, H in zip(known.g, known.tau, fading(h, known.tau)[2], self.H, strict=True):
            z, B = h / tau, g * tau * rate
            a, half = -0.5 * tau * np.expm1(-2.0 * z), np.tanh(0.5 * z)
            # int |A e + B|^2 = a |A|^2 + 2 b A.B + h |B|^2, with A = H - B and b = -tau expm1(-z): a square in H and
            # B, kept as one, and what is left of B, h - b^2 / a = tau (z - 2 tanh(z / 2)), which short steps cancel
            total += (a * known.compliant(H + half * B) + tau * left * known.compliant(B)) / (g * tau)
        return total

    def _loss(self, springs: Springs, S: Floats, E: Floats, h: float) -> Floats:
        """The same of a law whose springs are known: by Gauss's rule, in panels that grow with tau.

        S goes along a straight line in time, as stresses of branches take it; and so does the strain, C being scaled
        where it keeps its volume.
        """
        known, total = self.series, np.zeros(len(S))
        if h <= 0.0:
            return total
        for g, tau, H in zip(known.g, known.tau, self.H, strict=True):
            B = tau * (S - self.S) / h
            for t, w in _places(h, tau):
                now, left = t / h, np.exp(-t / tau)
                C = np.eye(3) + 2.0 * (self.E + now * (E - self.E))
                if springs.keeps:
                    C /= np.cbrt(np.linalg.det(C))[:, None, None]
                q = self.S + now * (S - self.S) - left * H / g + np.expm1(-t / tau) * B
                total += w * g / tau * springs.rate(C, q)
        return total

    @property
    def stored(self) -> float:
        """What branches store less what the law at once has in their place, J: to be added to its energy."""
        return float((self.springs - self.series.g.sum() * self.W) @ self.energy.w.ravel())

    @property
    def dissipated(self) -> float:
        """Since the start, J."""
        return float(self.lost @ self.energy.w.ravel())


def _places(h: float, tau: float) -> list[tuple[float, float]]:
    """Times and weights, s, at which what fades in tau is integrated over a step of h s."""
    cuts = [0.0, *(edge * tau for edge in PANELS if edge * tau < h), h]
    xi, w = np.polynomial.legendre.leggauss(POINTS if h > SHORT * tau else FEW)
    return [
        (0.5 * (a + b + (b - a) * x), 0.5 * (b - a) * weight)
        for a, b in pairwise(cuts)
        for x, weight in zip(xi.tolist(), w.tolist(), strict=True)
    ]


@dataclass(frozen=True, eq=False)
class Memories:
    """Those of a body: of `each` of its internal energies the memory, or the energy itself where it has none."""

    each: tuple[Fades | Energy, ...]

    @property
    def energies(self) -> tuple[Energy, ...]:
        """Those that it has before anything relaxes."""
        return tuple(own.energy if isinstance(own, Fades) else own for own in self.each)

    def over(self, h: float) -> tuple[Energy, ...]:
        """Those of a step of h s from here."""
        return tuple(own.over(h) if isinstance(own, Fades) else own for own in self.each)

    def accepted(self, x: Floats, h: float) -> Memories:
        """The same after a step of h s that ends in the state x."""
        return Memories(tuple(own.accepted(x, h) if isinstance(own, Fades) else own for own in self.each))

    def stored(self, x: Floats) -> float:
        """Energy of all springs in the state x that the memories are of, J."""
        return float(sum(e.value(x) for e in self.energies)) + sum(memory.stored for memory in self._fading)

    @property
    def dissipated(self) -> float:
        """Since the start, J."""
        return sum(memory.dissipated for memory in self._fading)

    @property
    def unknown(self) -> bool:
        """Whether what is stored or dissipated was not found somewhere."""
        return any(own.unknown for own in self._fading)

    @property
    def pumped(self) -> float:
        """Since the start, by pressures of fluid that are held, J."""
        return sum(memory.pumped for memory in self._fading)

    @property
    def worked(self) -> float | None:
        """Of what is inside, J, where each of its memories counts that itself."""
        each = [own.worked for own in self._fading if own.worked is not None]
        return float(sum(each)) if len(each) == len(self.each) else None

    @property
    def _fading(self) -> tuple[Fades, ...]:
        return tuple(own for own in self.each if isinstance(own, Fades))


def fall_of(lost: Floats) -> float:
    """How much of what is dissipated up to each of some times (t,), J, comes back at most."""
    return float((np.maximum.accumulate(lost) - lost).max(initial=0.0))
