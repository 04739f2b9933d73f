"""The law of a gap: no pressure beyond a distance, and more than a body can bear before it closes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats


@dataclass(frozen=True)
class Barrier:
    """Pressure stiffness * s^2 / (1 - s), s = 1 - g / distance the share of a `distance` (m) that a gap g has lost.

    From the share `bend` on it goes on as a straight line, so that a state on the way, which may lie behind the
    surface, has an energy and a tangent too: Newton's method goes there and comes back. What it ends on is no answer
    unless all gaps are positive; the pressure at touch is `most` (Pa), and of bodies that press harder the stiffness
    (Pa) is raised. It has two continuous derivatives, as barriers that are cut off need (Li et al. 2020, "Incremental
    potential contact", ACM Trans. Graph. 39:49, eq. 6), but grows as 1 / g instead of ln g near touch.
    """

    distance: float
    stiffness: float
    bend: float = 0.75

    @property
    def most(self) -> float:
        """The pressure at touch, Pa."""
        return float(self.pressure(np.zeros(1))[0])

    def stiffer(self, factor: float) -> Barrier:
        """The same with a stiffness so many times as large."""
        return replace(self, stiffness=factor * self.stiffness)

    def energy(self, g: Floats) -> Floats:
        """Per area (n,), J/m^2, of gaps g (n,), m."""
        s = 1.0 - g / self.distance
        b = np.clip(s, 0.0, self.bend)
        far = np.maximum(s - self.bend, 0.0)
        first, second = self._slopes(b)
        inner = -np.log1p(-b) - b - 0.5 * b * b  # the integral of s^2 / (1 - s)
        found: Floats = self.stiffness * self.distance * (inner + far * (first + 0.5 * second * far))
        return found

    def pressure(self, g: Floats) -> Floats:
        """Minus its derivative (n,), Pa."""
        s = 1.0 - g / self.distance
        b = np.clip(s, 0.0, self.bend)
        first, second = self._slopes(b)
        found: Floats = self.stiffness * (first + second * np.maximum(s - self.bend, 0.0))
        return found

    def slope(self, g: Floats) -> Floats:
        """Its second derivative (n,), Pa/m."""
        b = np.clip(1.0 - g / self.distance, 0.0, self.bend)
        found: Floats = self.stiffness / self.distance * self._slopes(b)[1]
        return found

    def gap(self, pressure: Floats) -> Floats:
        """Where a pressure (n,), Pa, below that at touch acts (n,), m: its inverse."""
        y = pressure / self.stiffness
        s = 0.5 * (np.sqrt(y * y + 4.0 * y) - y)
        first, second = self._slopes(np.array(self.bend))
        found: Floats = self.distance * (1.0 - np.where(s <= self.bend, s, self.bend + (y - first) / second))
        return found

    @staticmethod
    def _slopes(s: Floats) -> tuple[Floats, Floats]:
        """Of the share s: s^2 / (1 - s), and its derivative."""
        left = 1.0 - s
        return s * s / left, s * (2.0 - s) / left**2
