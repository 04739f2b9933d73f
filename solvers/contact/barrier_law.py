"""Barrier law of contact: the pressure is zero beyond a given gap and rises steeply as the gap closes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats


@dataclass(frozen=True)
class Barrier:
    """Barrier law: pressure = stiffness * s^2 / (1 - s) with s = 1 - g / distance, for gaps g below `distance`, m.

    Where s exceeds `bend`, the pressure continues as a straight line. So energy and tangent are also defined for
    iterates that lie behind the surface, and Newton's method can return from there. A converged state is valid only if
    all gaps are positive. `touch_pressure` (Pa) is the pressure at zero gap. Where contact pressures exceed it,
    `stiffness` (Pa) must be raised. The law has two continuous derivatives, like the truncated barrier of Li et al.
    2020 ("Incremental potential contact", ACM Trans. Graph. 39:49, eq. 6), but its energy grows as 1 / g instead of ln
    g near zero gap.
    """

    distance: float
    stiffness: float
    bend: float = 0.75

    @property
    def touch_pressure(self) -> float:
        """Pressure at zero gap, Pa."""
        return float(self.pressure(np.zeros(1))[0])

    def stiffer(self, factor: float) -> Barrier:
        """Return the same barrier with its stiffness multiplied by a factor."""
        return replace(self, stiffness=factor * self.stiffness)

    def energy(self, g: Floats) -> Floats:
        """Return the energy per area, J/m^2 (n,), at gaps g (n,), m."""
        s = 1.0 - g / self.distance
        b = np.clip(s, 0.0, self.bend)
        far = np.maximum(s - self.bend, 0.0)
        first, second = self._pressure_ratio_with_derivative(b)
        inner = -np.log1p(-b) - b - 0.5 * b * b  # the integral of s^2 / (1 - s)
        found: Floats = self.stiffness * self.distance * (inner + far * (first + 0.5 * second * far))
        return found

    def pressure(self, g: Floats) -> Floats:
        """Return the pressure, Pa (n,), at gaps g (n,), m: the negative derivative of the energy."""
        s = 1.0 - g / self.distance
        b = np.clip(s, 0.0, self.bend)
        first, second = self._pressure_ratio_with_derivative(b)
        found: Floats = self.stiffness * (first + second * np.maximum(s - self.bend, 0.0))
        return found

    def energy_second_derivative(self, g: Floats) -> Floats:
        """Return the second derivative of the energy, Pa/m (n,), at gaps g (n,), m."""
        b = np.clip(1.0 - g / self.distance, 0.0, self.bend)
        found: Floats = self.stiffness / self.distance * self._pressure_ratio_with_derivative(b)[1]
        return found

    def gap(self, pressure: Floats) -> Floats:
        """Return the gap, m (n,), at which a given pressure (n,), Pa, acts: the inverse of `pressure`.

        The pressure must be below `touch_pressure`.
        """
        y = pressure / self.stiffness
        s = 0.5 * (np.sqrt(y * y + 4.0 * y) - y)
        first, second = self._pressure_ratio_with_derivative(np.array(self.bend))
        found: Floats = self.distance * (1.0 - np.where(s <= self.bend, s, self.bend + (y - first) / second))
        return found

    @staticmethod
    def _pressure_ratio_with_derivative(s: Floats) -> tuple[Floats, Floats]:
        """Return s^2 / (1 - s) and its derivative, both (n,), for dimensionless depths s (n,) in the barrier."""
        left = 1.0 - s
        return s * s / left, s * (2.0 - s) / left**2
