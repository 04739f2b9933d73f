"""What may be asked of the gap to a rigid shape, and of any gap: how deep its middle is.

Where a gap has no gradient, which is on sharp edges and tips themselves and inside at equal distance from two parts of
the surface, `look` gives the normal of one of them (of an edge or a tip, one between those of its faces) and a Hessian
of zero there: values are finite everywhere. Next to a sharp edge, at a distance d, the Hessian is 1/d, as it is.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

Look = tuple[Floats, Floats, Floats]  # gap (n,) in m, normal (n, 3), Hessian (n, 3, 3) in 1/m


class Gap(Protocol):
    """The signed distance to the surface of a rigid shape: exact everywhere, so that |g(X) - g(Y)| <= |X - Y|."""

    @property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m: 0 of a sharp one, inf where all is flat or hollow."""

    @property
    def centroid(self) -> Vector3 | None:
        """The middle of its volume, m; None of one without end."""

    def gap(self, X: Floats) -> Floats:
        """From points X (n, 3), m, to its surface (n,), m: positive outside, negative inside."""

    def look(self, X: Floats) -> Look:
        """At points X (n, 3), m: the gap, its gradient, which is the outward normal, and its Hessian."""


def inside(gap: Gap) -> float:
    """How deep the middle of its volume is, m: inf of one without end, 0 where that is in a hollow."""
    middle = gap.centroid
    return np.inf if middle is None else max(0.0, -float(gap.gap(np.array([middle]))[0]))
