"""Boundary of a plane region: the facets of its slice that are normal to the plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.mesh.mesh import Floats, Ints

SAME = 1e-9  # relative to the slice: tolerance of its faces and of the axis


def is_on_border(points: Floats, facets: Ints, revolved: bool = False) -> NDArray[np.bool_]:
    """Return a mask (f,) of the facets (f, a) of a slice on the border of the plane region, not on its two faces.

    `points` (n, 3), m, are the nodes. If the body is `revolved` around the y axis, facets at x = 0 are excluded,
    because the body continues there.
    """
    X = points[facets]
    found: NDArray[np.bool_] = np.ptp(X[..., 2], axis=1) > SAME * np.ptp(points[:, 2])
    if revolved:
        found &= np.abs(X[..., 0]).max(axis=1) > SAME * np.abs(points[:, 0]).max()
    return found
