"""Truncated ellipsoidal shells: the wall between two coaxial ellipsoids, as in models of heart ventricles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.plane_regions import EllipticCylinderSide, Place, PlaneRegion
from softmark.solvers.mesh.shape import Bounds, CurvedSide, Shape, Vector3, add_multiples, dot, place_mesh

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.mesh.mesh import Floats, Mesh
else:
    from softmark.solvers.runtime.lazy_modules import np

ON = 1e-6  # relative to the size: tolerance of nodes on a curved side
NEAR = 1e-9  # relative to the size: tolerance of containment


@dataclass(frozen=True)
class EllipsoidalWall:
    """The wall between two concentric ellipsoids about an axis, truncated at the top.

    A point of the wall has two coordinates, s and t. The depth s, 0 on the inner and 1 on the outer ellipsoid, selects
    an ellipsoid between the two. The coordinate t, 0 at the tip and 1 at the rim, selects a point of that ellipsoid:
    its angle from the tip is proportional to t (p + (1 - p) t), with p the field `tip`. Thus cells at the rim are 2 - p
    times as long as with p = 1.
    """

    inner: Annotated[float, "m in (0, inf)", "semi-axis of the inner ellipsoid across the axis"]
    inner_along: Annotated[float, "m in (0, inf)", "semi-axis of the inner ellipsoid along the axis"]
    outer: Annotated[float, "m in (0, inf)", "semi-axis of the outer ellipsoid across the axis"]
    outer_along: Annotated[float, "m in (0, inf)", "semi-axis of the outer ellipsoid along the axis"]
    rim: Annotated[
        float, "m in (-inf, inf)", "position of the rim along the axis, measured from the centre of both ellipsoids"
    ]
    layers: Annotated[
        int | None, "1 in [1, 1000]", "number of cells through the wall; default: follows from `size`"
    ] = None
    tip: Annotated[float, "1 in [0.05, 1]", "relative length of cells at the tip; 1: as elsewhere"] = 1.0

    @property
    def fault(self) -> str:
        """Return an error if the wall has no thickness or the rim does not cut both ellipsoids; "" if valid."""
        if not (self.inner < self.outer and self.inner_along < self.outer_along):
            return "its inner ellipsoid must be smaller than the outer one, both across and along the axis"
        if not -self.inner_along < self.rim < self.inner_along:
            return "its `rim` must cut both ellipsoids: it must lie between -`inner_along` and `inner_along`"
        return ""

    def _at(self, s: Any, t: Any) -> tuple[Any, Any]:
        """Return the distance from the axis and the axial position, m, of the wall point (s, t).

        The depth s is 0 on the inner and 1 on the outer ellipsoid; t is 0 at the tip and 1 at the rim. Both are numbers
        or arrays.
        """
        a = self.inner + s * (self.outer - self.inner)
        b = self.inner_along + s * (self.outer_along - self.inner_along)
        turn = t * (self.tip + (1.0 - self.tip) * t) * np.arccos(-self.rim / b)
        return a * np.sin(turn), -b * np.cos(turn)

    @property
    def _wall_dimensions(self) -> tuple[float, float]:
        """Return the largest thickness of the wall, and an upper bound of the length from tip to rim, m."""
        turn = math.acos(-self.rim / self.outer_along)
        wall = max(self.outer - self.inner, self.outer_along - self.inner_along)
        return wall, turn * max(self.outer, self.outer_along)

    def _wall_contains(self, r: float, z: float, slack: float) -> bool:
        """Return whether the wall contains a point, within `slack`, m.

        The point is at distance r, m, from the axis and at the axial position z, m.
        """
        out = math.hypot(r / self.inner, z / self.inner_along) - 1.0
        off = math.hypot(r / self.outer, z / self.outer_along) - 1.0
        least = min(self.inner, self.inner_along)
        return z <= self.rim + slack and out >= -slack / least and off <= slack / min(self.outer, self.outer_along)

    @property
    def _largest_radius(self) -> float:
        """Largest distance of the wall from the axis, m."""
        return self.outer * (1.0 if self.rim >= 0.0 else math.sqrt(1.0 - (self.rim / self.outer_along) ** 2))


@dataclass(frozen=True)
class TruncatedEllipsoidSection(EllipsoidalWall, PlaneRegion):
    """Half the axial section of a truncated ellipsoidal shell about the y axis, for `axisymmetric`.

    It lies at x >= 0, between two ellipses around the origin and below y = `rim`. Rows of cells go from one ellipse to
    the other, and all nodes of curved sides lie on the ellipses. `size` is the largest cell size if `tip = 1`. With
    smaller values of `tip`, cells are shorter near the tip and correspondingly longer near the rim.
    """

    def _uniform_cell_counts(self, size: float) -> tuple[int, int]:
        """Return the numbers of cells of `size` (m) through the wall and along it."""
        through, along = super()._uniform_cell_counts(size)
        return self.layers or through, along

    def __call__(self, s: Any, t: Any) -> tuple[Any, Any]:
        """Return x and y, m, of the point at depth s (0 inside, 1 outside) and t (0 at the tip, 1 at the rim)."""
        x, y = self._at(s, t)
        return x * (t > 0), np.where(t < 1, y, self.rim)  # on the axis and on the rim, exactly

    @property
    def area(self) -> float:
        """Exact area, m^2."""
        return self._half_area_below_rim(self.outer, self.outer_along) - self._half_area_below_rim(
            self.inner, self.inner_along
        )

    def _half_area_below_rim(self, a: float, b: float) -> float:
        q = self.rim / b
        return 0.5 * a * b * (0.5 * math.pi + math.asin(q) + q * math.sqrt(1.0 - q * q))

    @property
    def sizes(self) -> tuple[float, float]:
        """Largest thickness of the wall, and an upper bound of the length from tip to rim, m."""
        return self._wall_dimensions

    @property
    def ends(self) -> tuple[Place, Place]:
        """Lowest and highest x and y, m."""
        return (0.0, -self.outer_along), (self._largest_radius, self.rim)

    def within(self, x: float, y: float, slack: float) -> bool:
        """Return whether a point lies between the ellipses and below the rim, within `slack` (m)."""
        return x >= -slack and self._wall_contains(x, y, slack)

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Outer and inner ellipse."""
        return EllipticCylinderSide(self.outer, self.outer_along), EllipticCylinderSide(self.inner, self.inner_along)


@dataclass(frozen=True)
class TruncatedEllipsoidShell(EllipsoidalWall, Shape):
    """The wall between two coaxial ellipsoids, closed at the bottom and cut off at the top, like a heart ventricle.

    `axis` points from the tip to the rim. The mesh consists of layers of hexahedra over a disc around the tip, or of
    tetrahedra made of them. Nodes of curved sides lie on the ellipsoids, so that a coarse mesh of linear elements has
    less volume (the report gives the difference). `size` is the largest cell size if `tip = 1`. With smaller values of
    `tip`, cells are shorter near the tip, where fibres that wind around the axis converge, and correspondingly longer
    near the rim.
    """

    axis: Annotated[Vector3, "direction", "direction of the axis, from the tip to the rim"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "the centre of both ellipsoids"] = (0.0, 0.0, 0.0)

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        low, high = [], []
        edge = self.outer * math.sqrt(max(0.0, 1.0 - (self.rim / self.outer_along) ** 2))
        for o, e in zip(self.origin, self.axis, strict=True):
            across = math.sqrt(max(0.0, 1.0 - e * e))
            reach = math.hypot(self.outer * across, self.outer_along * e)
            top = self.rim * e + edge * across, self.rim * e - edge * across  # extremes of the rim
            peak = self.outer_along**2 * e / reach  # axial position of the ellipsoid's extreme
            high.append(o + (reach if peak <= self.rim else top[0]))
            low.append(o - (reach if -peak <= self.rim else -top[1]))
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    @property
    def volume(self) -> float:
        """Exact volume, m^3."""
        return self._volume_below_rim(self.outer, self.outer_along) - self._volume_below_rim(
            self.inner, self.inner_along
        )

    def _volume_below_rim(self, a: float, b: float) -> float:
        return math.pi * a * a * (self.rim + b - (self.rim**3 + b**3) / (3.0 * b * b))

    def contains(self, point: Vector3) -> bool:
        """Return whether the shell contains a point, within 1e-9 of its size."""
        off = [p - o for p, o in zip(point, self.origin, strict=True)]
        z = float(dot(off, self.axis))
        r = math.dist(off, add_multiples((0.0, 0.0, 0.0), (z, self.axis)))
        return self._wall_contains(r, z, NEAR * self.diagonal)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells of a mesh with cells of `size` (m) along its three directions.

        These are along the side of the square over the tip, across the rings around it, and through the wall.
        """
        from softmark.solvers.mesh.cell_counts import count_disc_cells, count_divisions

        wall, way = self._wall_dimensions
        return *count_disc_cells(way, size), self.layers or count_divisions(wall, size)

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of the element `kind` with edges of about `size` (m). Raises UnknownElement."""
        from softmark.solvers.mesh.curved_boundary import CylinderSide
        from softmark.solvers.mesh.mesh import Mesh
        from softmark.solvers.mesh.structured_meshes import mesh_disc, mesh_extrusion, project_midside_nodes

        wall, way = self._wall_dimensions
        flat = mesh_extrusion(mesh_disc(way, size), wall, wall / self.layers if self.layers else size, kind)
        flat = project_midside_nodes(
            flat, (CylinderSide((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), wall, way),)
        )  # the rim becomes flat
        u, v, s = flat.points.T
        far = np.hypot(u, v)
        on = np.where(far > 0.0, far, 1.0)
        t = np.where(np.abs(far / way - 1.0) < NEAR, 1.0, far / way)
        r, z = self._at(s / wall, t)
        z = np.where(t == 1.0, self.rim, z)
        # mirrored, because the wall's outward direction is downward in the flat mesh
        points = np.stack([r * u / on, -r * v / on, z], axis=1)
        return place_mesh(Mesh(np.ascontiguousarray(points), flat.cells, flat.kind), self.axis, self.origin)

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Outer and inner ellipsoid."""
        return tuple(
            SpheroidSide(self.axis, self.origin, a, b)
            for a, b in ((self.outer, self.outer_along), (self.inner, self.inner_along))
        )


@dataclass(frozen=True)
class SpheroidSide(CurvedSide):
    """The surface of an ellipsoid of revolution: semi-axes across and along its axis, m.

    Points are projected along rays from the centre.
    """

    axis: Vector3
    origin: Vector3
    across: float
    along: float

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Return which facets, with nodes at (f, k, 3), m, have all their nodes on the ellipsoid; a mask (f,)."""
        Y = corners - np.array(self.origin)
        z = Y @ np.array(self.axis)
        r = np.linalg.norm(Y - z[..., None] * np.array(self.axis), axis=2)
        found: NDArray[np.bool_] = (np.abs(np.hypot(r / self.across, z / self.along) - 1.0) < ON).all(axis=1)
        return found

    def project_points(self, place: Any) -> Any:
        """Return points projected along rays from the centre onto the ellipsoid, m."""
        off = [p - o for p, o in zip(place, self.origin, strict=True)]
        z = dot(off, self.axis)
        square = sum(c * c for c in off) - z * z
        out = (square * self.across**-2.0 + z * z * self.along**-2.0) ** -0.5
        return tuple(o + out * c for o, c in zip(self.origin, off, strict=True))
