"""Arcs: bodies of constant section along a part of a circle, for solid and beam models."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.mesh.cell_counts import count_disc_cells, count_divisions, count_rectangle_cells
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.cross_sections import Disc, Rectangle
from softmark.solvers.mesh.curved_boundary import CylinderSide, TorusSide
from softmark.solvers.mesh.shape import Bounds, CurvedSide, Swept, Vector3, add_multiples, cross, dot, transverse

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats, Mesh
else:
    from softmark.solvers.runtime.lazy_modules import np

SIDEWAYS = 1e-6  # length of the unit vector's normal part below which it defines no plane


@dataclass(frozen=True)
class Arc(Swept):
    """A body of constant section along a part of a circle, from `origin` along `axis`, bent towards `towards`.

    The section is rectangular (`side`, and `height` if it differs) or round (`section_radius`). The mesh is that of a
    straight box or cylinder, bent: every node lies on its exact position. Beam models take the curved shape as
    stress-free. At the far end the body points along `axis` rotated by `angle`.
    """

    gap = "curved"

    radius: Annotated[float, "m in (0, inf)", "radius of the circle that the axis follows"]
    angle: Annotated[float, "rad in (0, 6.283185]", "angle between the ends of the axis"]
    side: Annotated[float | None, "m in (0, inf)", "extent of a rectangular section in the plane of the circle"] = None
    height: Annotated[
        float | None, "m in (0, inf)", "extent of a rectangular section normal to that plane; default: `side`"
    ] = None
    section_radius: Annotated[float | None, "m in (0, inf)", "radius of a round section"] = None
    axis: Annotated[Vector3, "direction", "direction of the axis at `origin`"] = (1.0, 0.0, 0.0)
    towards: Annotated[
        Vector3, "direction", "direction in which it bends; only its component normal to `axis` counts"
    ] = (
        0.0,
        1.0,
        0.0,
    )
    origin: Annotated[Vector3, "m", "centre of the end where the axis starts"] = (0.0, 0.0, 0.0)

    @property
    def fault(self) -> str:
        """Return why the arc is invalid; "" if it is valid.

        It is invalid without a section or with two, if the section reaches past the centre of the circle, or if the
        directions define no plane.
        """
        if (self.side is None) == (self.section_radius is None):
            return "it needs either a `side` (rectangular section) or a `section_radius` (round section)"
        if self.height is not None and self.side is None:
            return "`height` belongs to a rectangular section; a round one has only a `section_radius`"
        if max(0.5 * (self.side or 0.0), self.section_radius or 0.0) >= self.radius:
            return "its section extends beyond the centre of the circle: `radius` must be more than half the section"
        if math.hypot(*cross(self.axis, self.towards)) < SIDEWAYS:
            return "`towards` is parallel to `axis`, so the bending plane is undefined"
        return ""

    @property
    def root(self) -> Vector3:
        """Centre of the section at the start of the axis, m."""
        return self.origin

    @property
    def length(self) -> float:
        """Length along the axis, m."""
        return self.radius * self.angle

    @property
    def axis_curvature(self) -> float:
        """Curvature of the axis, 1/m."""
        return 1.0 / self.radius

    @property
    def section(self) -> Rectangle | Disc:
        """Cross-section: its first axis points to the centre of the circle, its second is normal to the plane."""
        if self.section_radius is not None:
            return Disc(self.section_radius)
        side = self.side or self.radius  # reported by `fault`; this value is not used
        return Rectangle(side, self.height or side)

    def frame(self, station: float) -> tuple[Vector3, Vector3, Vector3]:
        """Return three unit vectors at a station: along the axis, to the circle's centre, and normal to both."""
        t, n, b = self._start_frame
        c, s = math.cos(station / self.radius), math.sin(station / self.radius)
        return add_multiples((0.0, 0.0, 0.0), (c, t), (s, n)), add_multiples((0.0, 0.0, 0.0), (c, n), (-s, t)), b

    @property
    def _start_frame(self) -> tuple[Vector3, Vector3, Vector3]:
        across = cross(self.axis, self.towards)
        norm = math.hypot(*across)
        if norm == 0.0:  # reported by `fault`; this value is not used
            return self.axis, *transverse(self.axis)
        b = (across[0] / norm, across[1] / norm, across[2] / norm)
        return self.axis, cross(b, self.axis), b

    @property
    def middle(self) -> Vector3:
        """Centre of the circle, m."""
        return add_multiples(self.origin, (self.radius, self._start_frame[1]))

    def centre(self, station: float) -> Vector3:
        """Return the centre of the section at a station, m from the root along the axis."""
        t, n, _ = self._start_frame
        turn = station / self.radius
        return add_multiples(
            self.origin, (self.radius * math.sin(turn), t), (2.0 * self.radius * math.sin(0.5 * turn) ** 2, n)
        )

    def section_coordinates(self, point: Vector3) -> Vector3:
        """Return a point's station and its two coordinates in the section there, m.

        The station is discontinuous halfway round the circle.
        """
        t, n, b = self._start_frame
        off = [p - m for p, m in zip(point, self.middle, strict=True)]
        x, y = dot(off, t), -dot(off, n)
        half = 0.5 * self.angle
        turn = half + math.remainder(math.atan2(x, y) - half, 2.0 * math.pi)
        return self.radius * turn, self.radius - math.hypot(x, y), dot(off, b)

    def coordinates(self, X: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the stations and both section coordinates of points X (n, 3), as three arrays (n,), m."""
        off = X - np.array(self.middle)
        x, y, v = (off @ np.array(e) for e in self._start_frame)
        half = 0.5 * self.angle
        past = np.arctan2(x, -y) - half
        turn = half + past - 2.0 * np.pi * np.rint(past / (2.0 * np.pi))
        return self.radius * turn, self.radius - np.hypot(x, y), v

    def bounds_between(self, first: float, last: float) -> Bounds:
        """Return the exact lowest and highest coordinates of the part between two stations, m.

        A point is middle - (radius - u) n(turn) + v b. Along a coordinate axis it is highest where -n is highest,
        because the section does not reach beyond the centre of the circle.
        """
        section, (t, n, b) = self.section, self._start_frame
        ends = first / self.radius, last / self.radius
        low, high = [0.0] * 3, [0.0] * 3
        for i, middle in enumerate(self.middle):
            least, most = self._sinusoid_range(t[i], -n[i], *ends)
            low[i] = middle + self.radius * least - section.support(least, -b[i])
            high[i] = middle + self.radius * most + section.support(-most, b[i])
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    @staticmethod
    def _sinusoid_range(a: float, b: float, first: float, last: float) -> tuple[float, float]:
        """Return the least and the largest value of a sin(turn) + b cos(turn) for turns from `first` to `last`, rad."""
        found = [a * math.sin(turn) + b * math.cos(turn) for turn in (first, last)]
        top = math.atan2(a, b)
        for sense, turn in ((1.0, top), (-1.0, top + math.pi)):
            if first + (turn - first) % (2.0 * math.pi) <= last:
                found.append(sense * math.hypot(a, b))
        return min(found), max(found)

    @property
    def similar_mesh_size(self) -> float:
        """Cell size, m, such that this size and its whole fractions give meshes with similar sections."""
        section = self.section
        return section.radius / 2.5 if isinstance(section, Disc) else min(section.extents) / 2

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells for a cell `size` (m): two across the section, one along the axis."""
        section, along = self.section, count_divisions(self.length, size)
        across = (
            count_disc_cells(section.radius, size)
            if isinstance(section, Disc)
            else count_rectangle_cells(*section.extents, size)
        )
        return *across, along

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of the element `kind` with edges of about `size` (m). Raises UnknownElement."""
        from softmark.solvers.mesh.mesh import Mesh
        from softmark.solvers.mesh.structured_meshes import (
            mesh_disc,
            mesh_extrusion,
            mesh_rectangle,
            project_midside_nodes,
        )

        section = self.section
        flat = mesh_disc(section.radius, size) if isinstance(section, Disc) else mesh_rectangle(*section.extents, size)
        straight = mesh_extrusion(flat, self.length, size, kind)
        if isinstance(section, Disc):
            straight = project_midside_nodes(
                straight, [CylinderSide((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), self.length, section.radius)]
            )
        return Mesh(self._bend_points(straight.points), straight.cells, kind)

    def _bend_points(self, points: Floats) -> Floats:
        """Map points (n, 3), m, of a straight body along z to their positions in the arc."""
        u, v, s = points.T
        t, n, b = (np.array(e) for e in self._start_frame)
        c, d, turn = np.cos(s / self.radius), np.sin(s / self.radius), 0.5 * s / self.radius
        axis = np.outer(self.radius * d, t) + np.outer(2.0 * self.radius * np.sin(turn) ** 2, n)
        inward = c[:, None] * n - d[:, None] * t
        return np.ascontiguousarray(np.array(self.origin) + axis + u[:, None] * inward + v[:, None] * b)

    @property
    def sides(self) -> tuple[CurvedSide, ...]:
        """Curved sides: a torus, or the inner and the outer cylinder."""
        section, b = self.section, self._start_frame[2]
        if isinstance(section, Disc):
            return (TorusSide(b, self.middle, self.radius, section.radius),)
        foot = add_multiples(self.middle, (-0.5 * section.height, b))
        half = 0.5 * section.width
        return tuple(CylinderSide(b, foot, section.height, r) for r in (self.radius + half, self.radius - half))
