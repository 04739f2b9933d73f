"""Pressures of linear cells at an axis of revolution, where those of nodes are off whatever the size of the cells.

A node on the axis has 20 % too much (with one point for the volume; 8 % too little with all) and the next ring the rest
of it: what linear cells make of a field that goes with r^2 is no such field at r = 0. Both together are right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.energies.energy import Floats, Ints

Bools = NDArray[np.bool_]
ON = 1e-7  # of the size of a slice: the axis
BOTH = 4.0 / 3.0  # the mean of r^2 that an axis and its ring stand for, in that of the ring, of even facets
NEXT = 1.125  # the same of the ring after it


def mended(p: Floats, area: Floats, corners: Ints, r: Floats, alike: Ints) -> Floats:
    """Pressures p (n,), Pa, of nodes at r (n,), m, by what the axis and its ring have together: the force is the same.

    The mean of both, and the ring after them, tell the even parabola that the axis is taken from. `area` (n,), m^2, is
    what nodes stand for, all that are `alike` (n,) together; facets have `corners` (k, 4). A surface may meet the axis
    more than once, above and below.
    """
    found, axis = p.copy(), r < ON * float(r.max(initial=0.0))
    for one in np.unique(alike[corners[axis[corners]]]):
        tip = alike == one
        inner = tip[corners].any(axis=1)
        own = corners[inner]
        ring = np.isin(alike, alike[own[~axis[own]]])
        after = corners[ring[corners].any(axis=1) & ~inner]
        _mend(found, p, area, r, tip, ring, after[~ring[after] & ~axis[after]])
    return found


def _mend(found: Floats, p: Floats, area: Floats, r: Floats, tip: Bools, ring: Bools, after: Ints) -> None:
    """Of one place on the axis: nodes there, those of the ring, and those of the ring `after` it by their numbers."""
    a, b = area[tip].max(), area[ring].max()
    mean = (a * p[tip].max() + b * p[ring].max()) / (a + b)
    share = BOTH * r[ring].max() ** 2
    c = share / (NEXT * r[after].max() ** 2 - share) if len(after) else 0.0
    more = c * (mean - (p[after].max() if len(after) else mean))
    more = max(min(more, mean * b / a), -mean)  # nothing pulls, at either
    found[tip], found[ring] = mean + more, mean - more * a / b
