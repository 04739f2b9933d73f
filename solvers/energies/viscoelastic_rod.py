"""Viscoelastic history of rod elements: forces and moments relax, each strain mode by its own Prony series.

The method is that of solids (viscoelastic_memory.py), with the six strains of an element instead of those of a point.
Over a step of h seconds, term i of the series changes from H to exp(-h/tau) H + g f(h/tau) C (eps - eps_n), where f(z)
= (1 - exp(-z)) / z. This is exact if strains grow linearly in time. Stored and dissipated energy are exact, because
forces are linear in strains.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.rod_section import VaryingStiffness
from softmark.solvers.energies.viscoelastic_memory import EnergyHistory, decay_factors

if TYPE_CHECKING:
    from softmark.solvers.energies.incremental_rotation.moving_rods import MovingRod


@dataclass(frozen=True, eq=False)
class RodHistory(EnergyHistory):
    """Viscoelastic history of n rod elements at the end of the last time step.

    `energy` is a `RodElastic`, or a `MovingRod` over the unknowns of a chart. The fractions `g` (k, 6) of each mode
    relax with the times `tau` (k,), s. E (n, 6) are the strains, H (k, n, 6) the forces and moments of the terms, and N
    (n, 6) the total ones. `worked` is the work of the internal forces, and `lost` the dissipated energy, J.
    """

    energy: RodElastic | MovingRod
    g: Floats
    tau: Floats
    E: Floats
    H: Floats
    N: Floats
    internal_work: float = 0.0
    lost: float = 0.0

    @classmethod
    def at_rest(cls, energy: RodElastic | MovingRod, g: Floats, tau: Floats) -> RodHistory:
        """Return the history of a body that has always been at rest."""
        none = np.zeros((len(_static_rod_energy(energy).elements), 6))
        return cls(energy, g, tau, none, np.zeros((len(tau), *none.shape)), none)

    def over(self, h: float) -> Energy:
        """Return the energy of the next step of h seconds; its minimum is the state at the end of the step."""
        held, stiffness = self._past_forces_and_stiffnesses(h)
        other = _static_rod_energy(self.energy).with_stiffness_and_offset(VaryingStiffness(stiffness), held / stiffness)
        energy: Any = self.energy
        return other if isinstance(energy, RodElastic) else replace(energy, elastic=other)

    def _past_forces_and_stiffnesses(self, h: float) -> tuple[Floats, Floats]:
        """Return section forces that remain from the past after h seconds, and stiffnesses of the step, each (n, 6)."""
        C = self._C
        decay, mean, _ = decay_factors(h, self.tau)
        grown = self.g * mean[:, None]
        held: Floats = np.einsum("k,knc->nc", decay, self.H) - grown.sum(axis=0) * C * self.E
        return held, C * (1.0 - self.g.sum(axis=0) + grown.sum(axis=0))

    def history_after_step(self, x: Floats, h: float) -> RodHistory:
        """Return the history after a step of h seconds that ends in state x."""
        E, C, (decay, mean, _) = self._element_strains(x), self._C, decay_factors(h, self.tau)
        way = E - self.E
        H = decay[:, None, None] * self.H + (self.g * mean[:, None])[:, None] * (C * way)
        N = (1.0 - self.g.sum(axis=0)) * C * E + H.sum(axis=0)
        worked = self.internal_work + float(self._element_lengths @ (0.5 * (self.N + N) * way).sum(axis=1))
        return replace(self, E=E, H=H, N=N, internal_work=worked, lost=self.lost + self._step_dissipation(way, h))

    def _step_dissipation(self, way: Floats, h: float) -> float:
        """Return the dissipation of a step of h seconds in which strains change by `way` (n, 6), J.

        It is int sum H^2 / (g C tau) dt, and exact because the forces of the terms are H = A exp(-s/tau) + B. It is
        never negative.
        """
        if h <= 0.0:
            return 0.0
        total, C = np.zeros(way.shape), self._C
        for g, tau, left, H in zip(self.g, self.tau, decay_factors(h, self.tau)[2], self.H, strict=True):
            z, some = h / tau, g > 0.0
            B = g * tau * C * way / h
            a, half = -0.5 * tau * np.expm1(-2.0 * z), np.tanh(0.5 * z)
            square = a * (H + half * B) ** 2 + tau * left * B**2
            total += np.where(some, square / (np.where(some, g, 1.0) * C * tau), 0.0)
        return float(self._element_lengths @ total.sum(axis=1))

    @property
    def stored(self) -> float:
        """Energy stored in the terms minus their share of the instantaneous rod energy, J."""
        some, C = self.g > 0.0, self._C
        own = (np.where(some[:, None], self.H**2, 0.0) / (np.where(some, self.g, 1.0)[:, None] * C)).sum(axis=0)
        return 0.5 * float(self._element_lengths @ (own - self.g.sum(axis=0) * C * self.E**2).sum(axis=1))

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J."""
        return self.lost

    def _element_strains(self, x: Floats) -> Floats:
        """Return the strains of the elements in state x (n, 6)."""
        energy: Any = self.energy
        return _static_rod_energy(energy).strains(x if isinstance(energy, RodElastic) else energy.chart.state(x))

    @property
    def _C(self) -> Floats:
        """Stiffnesses of each element (n, 6)."""
        rod = _static_rod_energy(self.energy)
        return np.broadcast_to(rod.stiffness.diagonal, (len(rod.elements), 6))

    @property
    def _element_lengths(self) -> Floats:
        """Undeformed lengths of the elements (n,), m."""
        return _static_rod_energy(self.energy).lengths


def _static_rod_energy(energy: Any) -> RodElastic:
    """Return the static rod energy of `energy`, a `RodElastic` or a `MovingRod`."""
    found: RodElastic = energy if isinstance(energy, RodElastic) else energy.elastic
    return found
