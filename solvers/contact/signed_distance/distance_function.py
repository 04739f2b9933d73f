"""Interface of signed distances to rigid shapes, and the depth of their centroid.

A signed distance has no gradient on sharp edges and tips, and inside at equal distance from two parts of the surface.
There `look` returns the normal of one of them (on an edge or a tip, one between those of its faces) and a zero
Hessian: values are finite everywhere. At a distance d from a sharp edge the Hessian is 1/d, which is exact.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Vector3

Look = tuple[Floats, Floats, Floats]  # gap (n,) in m, normal (n, 3), Hessian (n, 3, 3) in 1/m


class Gap(Protocol):
    """Signed distance to the surface of a rigid shape: exact everywhere, so that |g(X) - g(Y)| <= |X - Y|."""

    @property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m: 0 for a sharp one, inf if all is flat or concave."""

    @property
    def centroid(self) -> Vector3 | None:
        """Centroid of its volume, m; None for an infinite one."""

    def gap(self, X: Floats) -> Floats:
        """Return distances from points X (n, 3), m, to the surface (n,), m: positive outside, negative inside."""

    def look(self, X: Floats) -> Look:
        """Return at points X (n, 3), m: the gap, its gradient, which is the outward normal, and its Hessian."""


def depth_of_centroid(gap: Gap) -> float:
    """Return the depth of the centroid, m: inf for an infinite shape, 0 if the centroid is in a hollow."""
    middle = gap.centroid
    return np.inf if middle is None else max(0.0, -float(gap.gap(np.array([middle]))[0]))
