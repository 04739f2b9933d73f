"""The border of the region of which a plane body is a slice: its facets across the slice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.mesh.mesh import Floats, Ints

SAME = 1e-9  # of a slice: what is thinner lies in its faces, what is nearer to the axis on it


def bordering(points: Floats, facets: Ints, revolved: bool = False) -> NDArray[np.bool_]:
    """Which facets (f, a) of a slice of points (n, 3), m, belong to its border (f,): not those of its faces.

    Nor those on the axis, of what is `revolved` around x = 0: there the body goes on.
    """
    X = points[facets]
    found: NDArray[np.bool_] = np.ptp(X[..., 2], axis=1) > SAME * np.ptp(points[:, 2])
    if revolved:
        found &= np.abs(X[..., 0]).max(axis=1) > SAME * np.abs(points[:, 0]).max()
    return found
