"""Domains of probes: integration points for means, and additional points at which extremes are searched.

Means over a line or a surface are integrals. They are split where the material changes, since stress and strain jump
there. Extremes over a volume lie on its surface, its edges and its corners as often as inside it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Bools = NDArray[np.bool_]
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class ProbeDomain:
    """Line, surface or volume over which a probe evaluates results.

    For a line, `ends` are its end points, m. For a surface, `points` (q, 3), m, and `weights` (q,), m^2,
    integrate over it; each point lies inside one material. `border` (b, 3), m, are additional points at which
    extremes are searched. `nodes` states which nodes of a mesh belong to the domain, where the condition `where`
    holds. `extent`, m, is the size of the body.
    """

    ends: tuple[Floats, Floats] | None = None
    points: Floats | None = None
    weights: Floats | None = None
    border: Floats | None = None
    nodes: Literal["none", "surface", "all"] = "none"
    where: Condition | None = None
    extent: float = 0.0

    def holds(self, X: Floats) -> Bools:
        """Return a mask of the points X (n, 3), m, that satisfy the condition of the domain (n,)."""
        if self.where is None:
            return np.ones(len(X), dtype=np.bool_)
        return np.array(
            np.broadcast_to(self.where.holds(X[:, 0], X[:, 1], X[:, 2], self.extent), len(X)), dtype=np.bool_
        )
