"""Support by an elastic foundation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.interpreter.vocabulary.supports.spring_support import SpringSupport, rigid_motions_along
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.vocabulary.supports.spring_support import Result, Springs
    from softmark.interpreter.vocabulary.supports.support import Floats
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class ElasticFoundationSupport(SpringSupport):
    """Elastic foundation: springs and dashpots under a part of the surface, for surrounding tissue, foam or soil.

    The traction -(stiffness u + damping v) acts at every point, per undeformed area, with u the displacement and v the
    velocity. It acts in all directions, or only along the undeformed normal (`directions = normal`), so that the
    surface can slide. The springs resist tension and compression alike; there is no lift-off. Their directions stay
    fixed, and they exert no moments of their own. The dashpots act only in a dynamic analysis. Finite elements support
    it in three dimensions and in the plane. The force between foundation and body is a reaction as of any support:
    `force(NAME, along = +z)`.
    """

    body: Annotated[str, "body", "body on the foundation"]
    where: Annotated[Any, "condition", "part of its surface, by undeformed coordinates"]
    stiffness: Annotated[float, "Pa/m in (0, inf)", "traction per displacement: `10 kPa/mm`"]
    damping: Annotated[float, "Pa*s/m in [0, inf)", "traction per velocity"] = 0.0
    directions: Annotated[Literal["all", "normal"], "directions in which it acts"] = "all"

    def springs(self, surface: Springs[Result]) -> Result:
        """Return springs and dashpots spread over the selected part of the surface."""
        return surface.distributed_springs(self.where, self.stiffness, self.damping, self.directions == "normal")

    def resisted_motions(self, X: Floats, normal: Floats) -> Floats:
        """Return the constraint rows (p, r, 6) at each point: of its displacements, or of the normal one only."""
        along = normal[:, None] if self.directions == "normal" else np.broadcast_to(np.eye(3), (len(X), 3, 3))
        return rigid_motions_along(X, along)
