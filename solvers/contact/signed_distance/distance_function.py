"""Interface of signed distances to rigid shapes, and the depth of the centroid of a shape.

A signed distance has no gradient on sharp edges and tips, nor at interior points with the same distance to two parts of
the surface. At such interior points `look` returns the normal of one of these parts; on an edge or a tip it returns a
normal between those of the adjacent faces. The Hessian is zero there, so that all values are finite. At a distance d
from a sharp edge the Hessian is 1/d, which is exact.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

Look = tuple[Floats, Floats, Floats]  # gap (n,) in m, normal (n, 3), Hessian (n, 3, 3) in 1/m


class Gap(Protocol):
    """Signed distance to the surface of a rigid shape.

    It is exact everywhere, so that |g(X) - g(Y)| <= |X - Y|.
    """

    @property
    def least_curvature_radius(self) -> float:
        """Smallest radius of curvature of convex edges of the shape, m.

        It is 0 for a sharp edge, and inf if the surface is flat or concave everywhere.
        """

    @property
    def centroid(self) -> Vector3 | None:
        """Centroid of the shape, m; None for an infinite shape."""

    def gap(self, X: Floats) -> Floats:
        """Return the gaps (n,), m, at points X (n, 3), m: positive outside the shape, negative inside."""

    def look(self, X: Floats) -> Look:
        """Return gaps (n,), m, gradients (n, 3) and Hessians (n, 3, 3), 1/m, at points X (n, 3), m.

        The gradient is the outward normal.
        """


def depth_of_centroid(gap: Gap) -> float:
    """Return the depth of the centroid below the surface, m.

    It is inf for an infinite shape, and 0 if the centroid lies in a hollow.
    """
    middle = gap.centroid
    return np.inf if middle is None else max(0.0, -float(gap.gap(np.array([middle]))[0]))
