"""Solid cross-sections: disc and rectangle (hollow ones are in `tubes.py`)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.solvers.mesh.shape import CircularSection, Section

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class Disc(CircularSection):
    """A circular cross-section, radius in m."""

    radius: float

    @property
    def area(self) -> float:
        """Area, m^2."""
        return math.pi * self.radius**2

    @property
    def moments(self) -> tuple[float, float]:
        """Second moments of area about the two axes of the section, m^4."""
        return math.pi * self.radius**4 / 4, math.pi * self.radius**4 / 4

    def shear_factor(self, poisson: float) -> float:
        """Return the shear correction factor of Cowper (1966): 6 (1 + nu) / (7 + 6 nu)."""
        return 6 * (1 + poisson) / (7 + 6 * poisson)

    def samples(self) -> list[tuple[float, float]]:
        """Sample points of the section, m: its centre and two rings."""
        turns = [2 * math.pi * i / 16 for i in range(16)]
        rings = [(r * math.cos(t), r * math.sin(t)) for r in (0.5 * self.radius, self.radius) for t in turns]
        return [(0.0, 0.0), *rings]

    def contains(self, u: float, v: float, slack: float) -> bool:
        """Return whether a point of the section's plane lies inside, within `slack` (m)."""
        return math.hypot(u, v) <= self.radius + slack

    def outside(self, u: Floats, v: Floats) -> Floats:
        """Return how far points (u, v) of the section's plane lie outside the section, shape (n,), m."""
        far: Floats = np.maximum(np.hypot(u, v) - self.radius, 0.0)
        return far


@dataclass(frozen=True)
class Rectangle(Section):
    """A rectangular cross-section, with its extents along the two axes of the section in m."""

    width: float  # along the first transverse axis
    height: float  # along the second transverse axis

    @property
    def extents(self) -> tuple[float, float]:
        """Width and height, m."""
        return self.width, self.height

    @property
    def area(self) -> float:
        """Area, m^2."""
        return self.width * self.height

    @property
    def moments(self) -> tuple[float, float]:
        """Second moments of area about the first and the second transverse axis, m^4."""
        return self.width * self.height**3 / 12, self.height * self.width**3 / 12

    @property
    def torsion(self) -> float:
        """Saint-Venant torsion constant, m^4, as a series.

        Source: Timoshenko and Goodier (1970), section 109.
        """
        a, b = sorted((self.width, self.height))
        odd = range(1, 40, 2)
        series = sum(math.tanh(n * math.pi * b / (2 * a)) / n**5 for n in odd)
        return a**3 * b / 3 * (1 - 192 * a / (math.pi**5 * b) * series)

    def shear_factor(self, poisson: float) -> float:
        """Return the shear correction factor of Cowper (1966): 10 (1 + nu) / (12 + 11 nu)."""
        return 10 * (1 + poisson) / (12 + 11 * poisson)

    def samples(self) -> list[tuple[float, float]]:
        """Sample points of the section, m: a grid with its corners."""
        steps = (-0.5, -0.25, 0.0, 0.25, 0.5)
        return [(a * self.width, b * self.height) for a in steps for b in steps]

    def contains(self, u: float, v: float, slack: float) -> bool:
        """Return whether a point of the section's plane lies inside, within `slack` (m)."""
        return abs(u) <= self.width / 2 + slack and abs(v) <= self.height / 2 + slack

    def outside(self, u: Floats, v: Floats) -> Floats:
        """Return how far points (u, v) of the section's plane lie outside the section, shape (n,), m."""
        sides = np.abs(u) - 0.5 * self.width, np.abs(v) - 0.5 * self.height
        far: Floats = np.hypot(*(np.maximum(side, 0.0) for side in sides))
        return far

    def outline(self, around: int) -> Floats:
        """Return border points (k, 2), m, counter-clockwise from the lowest corner, equally many on each side."""
        n = around // 4
        t = np.linspace(-0.5, 0.5, n + 1)[:-1]
        half = np.full(n, 0.5)
        sides = [(t, -half), (half, t), (-t, half), (-half, -t)]
        unit = np.concatenate([np.stack(side, axis=1) for side in sides])
        rectangle: Floats = unit * np.array([self.width, self.height])
        return rectangle
