"""Signed distance to a polygon in its plane: the section of a prism, or the half-section of a body of revolution."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.mesh.polygons import Corners

NONE = 1e-12  # of the size: points this near are on the polygon


@dataclass(frozen=True)
class PolygonSides:
    """Sides of a polygon, each from `start` (e, 2), m, along the vector `way` (e, 2), m.

    `normal` (e, 2) are the unit outward normals, `first` and `last` (e, 2) the normals at the first and last corner of
    each side.
    """

    start: Floats
    way: Floats
    normal: Floats
    first: Floats
    last: Floats


@dataclass(frozen=True)
class PolygonDistance:
    """Signed distance to a polygon with corners in counter-clockwise order, m.

    With `around` it is the half-section of a body of revolution, with r >= 0 as first coordinate; sides on the axis are
    then no surface.
    """

    corners: Corners
    around: bool = False

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box of the polygon, m."""
        return polygons.extent(self.corners)

    @cached_property
    def sides(self) -> PolygonSides:
        """Sides of the polygon, without sides on the axis.

        A side that ends on the axis meets its own mirror image there.
        """
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
        """True if the polygon has a convex corner off the axis, or a tip on the axis."""
        s = self.sides
        return bool(np.any(np.einsum("ei,ei->e", s.way, s.last) > 1e-6 * np.linalg.norm(s.way, axis=1)))

    def _find_nearest_sides(self, p: Floats) -> tuple[Ints, Floats, Floats]:
        """Return the nearest side (n,) of each point p (n, 2), m, with the vector and position of the closest point.

        The vector (n, 2), m, leads from the closest point to p. The position (n,) along the side is from 0 to 1.
        """
        s = self.sides
        off = p[:, None] - s.start
        t = np.clip(np.einsum("nei,ei->ne", off, s.way) / np.einsum("ei,ei->e", s.way, s.way), 0.0, 1.0)
        off -= t[:, :, None] * s.way
        side = np.argmin(np.einsum("nei,nei->ne", off, off), axis=1)
        rows = np.arange(len(p))
        return side, off[rows, side], t[rows, side]

    def _gaps_with_pseudonormals(self, p: Floats) -> tuple[Floats, Floats, Floats, Floats, NDArray[np.bool_]]:
        """Return gaps, vectors from the polygon, their lengths, pseudonormals, and corner masks for points p (n, 2), m.

        The shapes are (n,), (n, 2), (n,), (n, 2) and (n,). The sign of a gap is that of the scalar product of the
        vector and the pseudonormal, as in Baerentzen and Aanaes 2005, here in the plane.
        """
        side, off, t = self._find_nearest_sides(p)
        s = self.sides
        pseudo = np.where(
            (t <= 0.0)[:, None], s.first[side], np.where((t >= 1.0)[:, None], s.last[side], s.normal[side])
        )
        d = np.linalg.norm(off, axis=1)
        corner = (t <= 0.0) | (t >= 1.0)
        straight = np.einsum("ni,ni->n", off, s.normal[side])
        beside = np.linalg.norm(off - straight[:, None] * s.normal[side], axis=1)  # more exact than d - |straight|
        corner &= beside > NONE * d  # otherwise the point lies straight above the end of a side
        pseudo = np.where(corner[:, None], pseudo, s.normal[side])
        sign = np.where(np.einsum("ni,ni->n", off, pseudo) < 0.0, -1.0, 1.0)
        return np.where(corner, sign * d, straight), off, d, pseudo, corner

    def gap(self, p: Floats) -> Floats:
        """Return the gaps (n,), m, at points p (n, 2), m: negative inside the polygon."""
        return self._gaps_with_pseudonormals(p)[0]

    def look(self, p: Floats) -> tuple[Floats, Floats, Floats]:
        """Return gaps (n,), m, gradients (n, 2), and second derivatives (n,), 1/m, at points p (n, 2), m.

        The second derivative is the one perpendicular to the gradient.
        """
        g, off, d, pseudo, corner = self._gaps_with_pseudonormals(p)
        at = corner & (d > NONE * self.size)
        sign = np.where(g < 0.0, -1.0, 1.0)
        safe = np.where(at, d, 1.0)
        n = np.where(at[:, None], (sign / safe)[:, None] * off, pseudo)
        n /= np.linalg.norm(n, axis=1)[:, None]
        return g, n, np.where(at, sign / safe, 0.0)
