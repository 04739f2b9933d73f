"""Pressures of linear cells at an axis of revolution, where those of nodes are off whatever the size of the cells.

A node on the axis has 20 % too much (with one point for the volume; 8 % too little with all) and the next ring the rest
of it: what linear cells make of a field that goes with r^2 is no such field at r = 0. Both together are right.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints

ON = 1e-7  # of the size of a slice: the axis
BOTH = 4.0 / 3.0  # the mean of r^2 that an axis and its ring stand for, in that of the ring, of even facets
NEXT = 1.125  # the same of the ring after it


def mended(p: Floats, area: Floats, corners: Ints, r: Floats, alike: Ints) -> Floats:
    """Pressures p (n,), Pa, of nodes at r (n,), m, by what the axis and its ring have together: the force is the same.

    The mean of both, and the ring after them, tell the even parabola that the axis is taken from. `area` (n,), m^2, is
    what nodes stand for, all that are `alike` (n,) together; facets have `corners` (k, 4).
    """
    axis = r < ON * float(r.max(initial=0.0))
    inner = axis[corners].any(axis=1)
    if not inner.any():
        return p
    found, first = p.copy(), np.unique(corners[inner])
    tip, ring = (np.isin(alike, alike[first[on]]) for on in (axis[first], ~axis[first]))
    a, b = area[tip].max(), area[ring].max()
    mean = (a * p[tip].max() + b * p[ring].max()) / (a + b)
    after = corners[ring[corners].any(axis=1) & ~inner]
    after = after[~ring[after]]
    share = BOTH * r[ring].max() ** 2
    c = share / (NEXT * r[after].max() ** 2 - share) if len(after) else 0.0
    more = min(c * (mean - (p[after].max() if len(after) else mean)), mean * b / a)
    found[tip], found[ring] = max(mean + more, 0.0), mean - more * a / b
    return found
