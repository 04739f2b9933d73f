"""Stress fields given by a formula, with the interface of recovered stress fields (`stress_field.Stresses`)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats
    from softmark.solvers.stress_recovery.stress_field import Chosen, Number, Part
    from softmark.solvers.stress_recovery.stress_measures import Tensors, TensorsBySide
else:
    from softmark.solvers.runtime.lazy_modules import np


class AnalyticField:
    """Base class of stress fields given by a formula.

    Members of `stress_field.Stresses` that concern cells have trivial results here, because there are no cells.
    """

    def at(self, X: Floats) -> Tensors:
        """Return stress and deformation at points X (n, 3), m, of the undeformed body."""
        raise NotImplementedError(f"{type(self).__name__} has no tensors")

    def sides(self, X: Floats) -> TensorsBySide:
        """Return stress and deformation at points X (n, 3), m, with one row for each point."""
        from softmark.solvers.stress_recovery.stress_measures import TensorsBySide

        return TensorsBySide(np.arange(len(X)), np.zeros(len(X), dtype=np.int64), self.at(X))

    def interface_crossings(self, begin: Floats, end: Floats) -> Floats:
        """Return an empty array (0,): a line from `begin` to `end` crosses no interface between materials."""
        return np.zeros(0)

    spacing: float = math.inf  # m: there are no cells

    def peaks(self, number: Number, chosen: Chosen, surface: bool = False) -> Floats:
        """Return an empty array (0, 3) of nodes with large values, because there are no nodes."""
        return np.zeros((0, 3))

    def count_interface_points(self, X: Floats) -> int:
        """Return 0, the number of points X (n, 3) at which several materials meet."""
        return 0

    def unresolved(self, X: Floats) -> Floats:
        """Return zeros (n,), Pa, the differences of cell stresses from the recovered stress at points X (n, 3)."""
        none: Floats = np.zeros(len(X))
        return none

    def relative_fit_residual(self, X: Floats, of: Part) -> Floats:
        """Return zeros (n,), the relative differences of cell tensors from the recovered tensor at points X (n, 3)."""
        return self.unresolved(X)

    def sampled(self) -> None:
        """Do nothing, since a formula can be evaluated everywhere."""
