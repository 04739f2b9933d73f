"""Domains of probes: integration points for means, and further points at which extremes are looked for.

Means over a line or a surface are integrals. They are split where the material changes, since stress and strain jump
there. Extremes over a volume lie on its surface, its edges and its corners as often as inside of it.
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
    """Line, surface or volume of a probe.

    `ends` are those of a line, m. `points` (q, 3), m, and `weights` (q,), m^2, integrate over a surface of several
    materials; each lies inside one material. `border` (b, 3), m, are points at which extremes are looked for besides
    the probe's own. Nodes of a mesh belong to it as `nodes` says, where `where` holds; `extent` is that of the body, m.
    """

    ends: tuple[Floats, Floats] | None = None
    points: Floats | None = None
    weights: Floats | None = None
    border: Floats | None = None
    nodes: Literal["none", "surface", "all"] = "none"
    where: Condition | None = None
    extent: float = 0.0

    def holds(self, X: Floats) -> Bools:
        """Return the points X (n, 3), m, that satisfy the condition of the domain (n,)."""
        if self.where is None:
            return np.ones(len(X), dtype=np.bool_)
        return np.array(
            np.broadcast_to(self.where.holds(X[:, 0], X[:, 1], X[:, 2], self.extent), len(X)), dtype=np.bool_
        )
