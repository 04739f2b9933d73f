"""Stress that is known everywhere by a formula: there are no cells that could differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats
    from softmark.solvers.stresses.field import Part
else:
    from softmark.solvers.base.deferred import np


class WithoutCells:
    """What metrics ask beside the stress itself, as they ask it of `field.Stresses`."""

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
