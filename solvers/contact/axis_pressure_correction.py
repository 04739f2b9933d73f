"""Correction of contact pressures at the axis of an axisymmetric model with linear cells.

Without correction the nodal pressure on the axis is 20 % too high if the volume change has one integration point per
cell, and 8 % too low with full integration. This error does not depend on the cell size, because linear cells cannot
represent a field that varies with r^2 at r = 0. The next ring of nodes has the opposite error, so that the total force
on the axis node and on that ring is right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.energies.energy import Floats, Ints

Bools = NDArray[np.bool_]
ON = 1e-7  # largest radius of nodes on the axis, relative to the largest radius of the surface
BOTH = 4.0 / 3.0  # mean of r^2 over axis node and ring, divided by r^2 of the ring, for facets of equal size
NEXT = 1.125  # mean of r^2 over the second ring, divided by r^2 of that ring


def correct_axis_pressures(p: Floats, area: Floats, corners: Ints, r: Floats, alike: Ints) -> Floats:
    """Return nodal pressures, Pa, shape (n,), corrected on the axis and on the ring of nodes next to it.

    The correction keeps the total force on the axis node and this ring. The corrected pressures lie on a parabola in
    r^2; it is determined by the mean pressure of both and by the pressure of the second ring. `p` (n,), Pa, are the
    pressures and `r` (n,), m, the radii of the nodes. Nodes with the same number in `alike` (n,) lie on the same ring,
    and `area` (n,), m^2, is the area of that ring. `corners` (k, 4) are the corner nodes of each facet. A surface may
    meet the axis at several points, such as the top and the bottom of a body.
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
    """Correct the nodal pressures `found` in place where the surface meets the axis at one point.

    `tip` (n,) is the mask of the nodes on the axis, `ring` (n,) that of the first ring, and `after` holds the node
    numbers of the second ring. The other arguments are as in `correct_axis_pressures`.
    """
    a, b = area[tip].max(), area[ring].max()
    mean = (a * p[tip].max() + b * p[ring].max()) / (a + b)
    share = BOTH * r[ring].max() ** 2
    c = share / (NEXT * r[after].max() ** 2 - share) if len(after) else 0.0
    more = c * (mean - (p[after].max() if len(after) else mean))
    more = max(min(more, mean * b / a), -mean)  # no pressure may become negative
    found[tip], found[ring] = mean + more, mean - more * a / b
