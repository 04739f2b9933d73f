"""Signed distance to a polygon in its plane: the section of a prism, or the half-section of a body of revolution."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.mesh.polygons import Corners

NONE = 1e-12  # of its size: what is as near is on it


@dataclass(frozen=True)
class PolygonSides:
    """Sides of a polygon from `start` (e, 2) along `way` (e, 2), m, with unit outward normals and normals of both
    corners.
    """

    start: Floats
    way: Floats
    normal: Floats
    first: Floats
    last: Floats


@dataclass(frozen=True)
class PolygonDistance:
    """Polygon with corners counter-clockwise, m; `around` an axis r >= 0, sides on the axis are no surface."""

    corners: Corners
    around: bool = False

    @cached_property
    def size(self) -> float:
        """Diagonal of its bounding box, m."""
        return polygons.extent(self.corners)

    @cached_property
    def sides(self) -> PolygonSides:
        """Sides without those on the axis; a side that ends on the axis meets its own mirror image there."""
        a = np.array(self.corners)
        way = np.roll(a, -1, axis=0) - a
        n = np.stack([way[:, 1], -way[:, 0]], axis=1) / np.linalg.norm(way, axis=1)[:, None]
        before, after = np.roll(n, 1, axis=0), np.roll(n, -1, axis=0)
        if not self.around:
            return PolygonSides(a, way, n, n + before, n + after)
        on = a[:, 0] <= NONE * self.size
        begins, ends = on, np.roll(on, -1)
        first = np.where(begins[:, None], n + n * [-1.0, 1.0], n + before)
        last = np.where(ends[:, None], n + n * [-1.0, 1.0], n + after)
        kept = ~(begins & ends)
        return PolygonSides(a[kept], way[kept], n[kept], first[kept], last[kept])

    @cached_property
    def sharp(self) -> bool:
        """True if it has a convex corner off the axis, or a tip on the axis."""
        s = self.sides
        return bool(np.any(np.einsum("ei,ei->e", s.way, s.last) > 1e-6 * np.linalg.norm(s.way, axis=1)))

    def _nearest(self, p: Floats) -> tuple[Ints, Floats, Floats]:
        """Return for points (n, 2): the nearest side (n,), the vector from it (n, 2), m, and the position along it
        (n,).
        """
        s = self.sides
        off = p[:, None] - s.start
        t = np.clip(np.einsum("nei,ei->ne", off, s.way) / np.einsum("ei,ei->e", s.way, s.way), 0.0, 1.0)
        off -= t[:, :, None] * s.way
        side = np.argmin(np.einsum("nei,nei->ne", off, off), axis=1)
        rows = np.arange(len(p))
        return side, off[rows, side], t[rows, side]

    def _signed(self, p: Floats) -> tuple[Floats, Floats, Floats, Floats, NDArray[np.bool_]]:
        """Return gap (n,), vector from the polygon (n, 2), its length (n,), pseudonormal (n, 2), and corner mask (n,).

        The sign is that of the angle with the pseudonormal: Baerentzen and Aanaes 2005, in the plane.
        """
        side, off, t = self._nearest(p)
        s = self.sides
        pseudo = np.where(
            (t <= 0.0)[:, None], s.first[side], np.where((t >= 1.0)[:, None], s.last[side], s.normal[side])
        )
        d = np.linalg.norm(off, axis=1)
        corner = (t <= 0.0) | (t >= 1.0)
        straight = np.einsum("ni,ni->n", off, s.normal[side])
        beside = np.linalg.norm(off - straight[:, None] * s.normal[side], axis=1)  # d - |straight| has half its digits
        corner &= beside > NONE * d  # else it is straight above the end of a side
        pseudo = np.where(corner[:, None], pseudo, s.normal[side])
        sign = np.where(np.einsum("ni,ni->n", off, pseudo) < 0.0, -1.0, 1.0)
        return np.where(corner, sign * d, straight), off, d, pseudo, corner

    def gap(self, p: Floats) -> Floats:
        """Return distances from points (n, 2), m, to the polygon (n,), m: negative inside."""
        return self._signed(p)[0]

    def look(self, p: Floats) -> tuple[Floats, Floats, Floats]:
        """Return at points (n, 2), m: the gap (n,), its gradient (n, 2), and its second derivative across that (n,),
        1/m.
        """
        g, off, d, pseudo, corner = self._signed(p)
        at = corner & (d > NONE * self.size)
        sign = np.where(g < 0.0, -1.0, 1.0)
        safe = np.where(at, d, 1.0)
        n = np.where(at[:, None], (sign / safe)[:, None] * off, pseudo)
        n /= np.linalg.norm(n, axis=1)[:, None]
        return g, n, np.where(at, sign / safe, 0.0)
