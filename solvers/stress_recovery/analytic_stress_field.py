"""Stress fields known everywhere by a formula, with the interface of recovered fields."""

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
    """Base of analytic stress fields: members of `stress_field.Stresses` that concern cells, with trivial results."""

    def at(self, X: Floats) -> Tensors:
        """Return the tensors at points X (n, 3), m, of the undeformed body."""
        raise NotImplementedError(f"{type(self).__name__} has no tensors")

    def sides(self, X: Floats) -> TensorsBySide:
        """Return the tensors at points X (n, 3), m: one for each."""
        from softmark.solvers.stress_recovery.stress_measures import TensorsBySide

        return TensorsBySide(np.arange(len(X)), np.zeros(len(X), dtype=np.int64), self.at(X))

    def crossings(self, begin: Floats, end: Floats) -> Floats:
        """Return no material changes along a line: (0,)."""
        return np.zeros(0)

    spacing: float = math.inf  # m: there are no cells

    def peaks(self, number: Number, chosen: Chosen, surface: bool = False) -> Floats:
        """Return no nodes (0, 3), m."""
        return np.zeros((0, 3))

    def shared(self, X: Floats) -> int:
        """Return 0: no point has more than one stress."""
        return 0

    def unresolved(self, X: Floats) -> Floats:
        """Return zero differences between cells (n,), Pa."""
        none: Floats = np.zeros(len(X))
        return none

    def disagreement(self, X: Floats, of: Part) -> Floats:
        """Return zero differences between cells (n,)."""
        return self.unresolved(X)

    def sampled(self) -> None:
        """Do nothing: the field is known everywhere."""
