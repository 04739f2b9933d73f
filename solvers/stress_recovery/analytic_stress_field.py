"""Stress that is known everywhere by a formula: there are no cells that could differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats
    from softmark.solvers.stress_recovery.stress_field import Chosen, Number, Part
    from softmark.solvers.stress_recovery.stress_measures import Sides, Tensors
else:
    from softmark.solvers.runtime.lazy_modules import np


class WithoutCells:
    """What metrics ask beside the stress itself, as they ask it of `field.Stresses`."""

    def at(self, X: Floats) -> Tensors:
        """Tensors at points X (n, 3), m, of the undeformed body."""
        raise NotImplementedError(f"{type(self).__name__} has no tensors")

    def sides(self, X: Floats) -> Sides:
        """Tensors at points X (n, 3), m: one for each."""
        from softmark.solvers.stress_recovery.stress_measures import Sides

        return Sides(np.arange(len(X)), np.zeros(len(X), dtype=np.int64), self.at(X))

    def crossings(self, begin: Floats, end: Floats) -> Floats:
        """No line is known to change its material: (0,)."""
        return np.zeros(0)

    spacing: float = math.inf  # m: there are no cells

    def peaks(self, number: Number, chosen: Chosen, surface: bool = False) -> Floats:
        """No nodes (0, 3), m."""
        return np.zeros((0, 3))

    def shared(self, X: Floats) -> int:
        """No point has more than one stress."""
        return 0

    def unresolved(self, X: Floats) -> Floats:
        """No cells differ (n,), Pa."""
        none: Floats = np.zeros(len(X))
        return none

    def disagreement(self, X: Floats, of: Part) -> Floats:
        """No cells differ (n,)."""
        return self.unresolved(X)

    def sampled(self) -> None:
        """It is known everywhere."""
