"""Correction of contact pressures of linear cells at the axis of revolution.

The nodal pressure on the axis is 20 % too high (with one integration point for the volume; 8 % too low with full
integration), whatever the cell size, and the next ring of nodes carries the opposite error: linear cells cannot
represent a field that varies with r^2 at r = 0. The force on the axis node and its ring together is right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.energies.energy import Floats, Ints

Bools = NDArray[np.bool_]
ON = 1e-7  # of the size of a slice: the axis
BOTH = 4.0 / 3.0  # the mean of r^2 that an axis and its ring stand for, in that of the ring, of even facets
NEXT = 1.125  # the same of the ring after it


def correct_axis_pressures(p: Floats, area: Floats, corners: Ints, r: Floats, alike: Ints) -> Floats:
    """Return pressures p (n,), Pa, of nodes at radii r (n,), m, corrected on the axis and on the ring next to it.

    The force on both together is kept. Their mean and the ring after them give the even parabola that the corrected
    values lie on. `area` (n,), m^2, is the area of each node, summed over all nodes with the same number in `alike`
    (n,); facets have `corners` (k, 4). A surface may meet the axis more than once, above and below.
    """
    found, axis = p.copy(), r < ON * float(r.max(initial=0.0))
    for one in np.unique(alike[corners[axis[corners]]]):
        tip = alike == one
        inner = tip[corners].any(axis=1)
        own = corners[inner]
        ring = np.isin(alike, alike[own[~axis[own]]])
        after = corners[ring[corners].any(axis=1) & ~inner]
        _correct_axis_point(found, p, area, r, tip, ring, after[~ring[after] & ~axis[after]])
    return found


def _correct_axis_point(
    found: Floats, p: Floats, area: Floats, r: Floats, tip: Bools, ring: Bools, after: Ints
) -> None:
    """Correct one place on the axis: masks of its nodes and of the ring, and node numbers of the ring `after` it."""
    a, b = area[tip].max(), area[ring].max()
    mean = (a * p[tip].max() + b * p[ring].max()) / (a + b)
    share = BOTH * r[ring].max() ** 2
    c = share / (NEXT * r[after].max() ** 2 - share) if len(after) else 0.0
    more = c * (mean - (p[after].max() if len(after) else mean))
    more = max(min(more, mean * b / a), -mean)  # nothing pulls, at either
    found[tip], found[ring] = mean + more, mean - more * a / b
