"""Bodies of revolution: a polygon revolved about an axis, and cones."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.cell_counts import count_disc_cells, count_divisions
from softmark.solvers.mesh.conforming_planes import Cut, count_cells, cuts_along
from softmark.solvers.mesh.curved_boundary import ConeSide
from softmark.solvers.mesh.polygons import Corners
from softmark.solvers.mesh.shape import Bounds, Shape, Span, Vector3, add_multiples, dot, transverse

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.mesh.shape import Swept

ON_AXIS = 1e-9  # relative to the largest radius: closer corners lie on the axis
HEXAHEDRA = "it meets its axis at a tip, or more than once"


@dataclass(frozen=True)
class Ring:
    """A flat annular part of the surface, normal to the axis of revolution.

    It lies at the position `at` along the axis and reaches from radius `inner` to `outer`, m. Its normal points up or
    down along the axis (`up`).
    """

    at: float
    inner: float
    outer: float
    up: bool


class Revolution(Shape):
    """A body of revolution: a polygon revolved about an axis.

    Corners of the polygon are pairs of a radius and a position along the axis from `origin`, m.
    """

    has_signed_distance = True
    has_mass_properties = True

    if TYPE_CHECKING:

        @property
        def axis(self) -> Vector3:
            """Unit vector along the axis of revolution."""

        @property
        def origin(self) -> Vector3:
            """Point on the axis from which axial positions are measured, m."""

    @property
    def outline(self) -> Corners:
        """Corners (r, z) of the polygon, counter-clockwise, m."""
        raise NotImplementedError(f"{type(self).__name__} has no outline")

    @property
    def largest_radius(self) -> float:
        """Largest radius, m."""
        return max(r for r, _ in self.outline)

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m, from the circles of the corners."""
        low, high = [math.inf] * 3, [-math.inf] * 3
        for r, z in self.outline:
            for i, (o, a) in enumerate(zip(self.origin, self.axis, strict=True)):
                reach = r * math.sqrt(max(0.0, 1.0 - a * a))
                low[i], high[i] = min(low[i], o + z * a - reach), max(high[i], o + z * a + reach)
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    @property
    def volume(self) -> float:
        """Exact volume, m^3, by Pappus's theorem."""
        return 2.0 * math.pi * polygons.centroid(self.outline)[0] * polygons.signed_area(self.outline)

    def contains(self, point: Vector3) -> bool:
        """Return whether the body contains a point, within 1e-9 of its size."""
        off = [p - o for p, o in zip(point, self.origin, strict=True)]
        z, *across = (dot(off, e) for e in (self.axis, *transverse(self.axis)))
        return polygons.contains_point(self.outline, math.hypot(*across), z, polygons.SAME * self.diagonal)

    @property
    def oriented_curved_sides(self) -> tuple[tuple[ConeSide, bool], ...]:
        """Curved sides, each with a flag that is True if the side faces away from the axis."""
        found, least = [], ON_AXIS * self.largest_radius
        for (a, b), (c, d) in polygons.edges(self.outline):
            if abs(d - b) <= least or max(a, c) <= least:
                continue
            (r, z), (q, w) = ((a, b), (c, d)) if d > b else ((c, d), (a, b))
            found.append((ConeSide(self.axis, add_multiples(self.origin, (z, self.axis)), w - z, r, q), d > b))
        return tuple(found)

    @property
    def sides(self) -> tuple[ConeSide, ...]:
        """Curved sides."""
        return tuple(side for side, _ in self.oriented_curved_sides)

    @property
    def rings(self) -> tuple[Ring, ...]:
        """Flat parts of the surface, normal to the axis: discs and annuli."""
        sides, least = polygons.edges(self.outline), ON_AXIS * self.largest_radius
        return tuple(Ring(b, min(a, c), max(a, c), c < a) for (a, b), (c, d) in sides if abs(d - b) <= least)

    @property
    def skin(self) -> float:
        """Exact surface area, m^2, by Pappus's theorem."""
        return sum(math.pi * (a + c) * math.dist((a, b), (c, d)) for (a, b), (c, d) in polygons.edges(self.outline))


@dataclass(frozen=True)
class Revolved(Revolution):
    """A polygon revolved about an axis: a body of revolution whose section has straight edges.

    Corners are pairs of the distance from the axis (r, not negative) and the position along it (z), in either sense
    around the polygon, each once; the last is joined to the first. Where a side lies on the axis, the body is solid.
    Sides must not cross or touch, and the polygon must not touch the axis at a single point. Cells of the section are
    those of `extruded`, swept around the axis. A body whose ends are flat where it meets the axis, such as a stepped
    shaft, has a core of well-shaped cells. Any other body that meets the axis, such as one with a tip, is meshed with
    tetrahedra only, which are thin at the axis. The mesh is inscribed: its points lie on the circles, so that a coarse
    mesh of linear elements has less volume, or more volume around a hollow (the report gives the difference).
    """

    gap = "not a convex body"

    corners: Annotated[tuple[tuple[float, float], ...], "points of m", "corners of the section: r and z of each"]
    axis: Annotated[Vector3, "direction", "direction of the axis"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "point of the axis where z = 0 in the section"] = (0.0, 0.0, 0.0)

    @property
    def fault(self) -> str:
        """Return why the polygon is invalid, or where it crosses the axis; "" if it is valid."""
        if any(r < 0.0 for r, _ in self.corners):
            return "its section extends beyond the axis: distances from the axis must not be negative"
        return polygons.polygon_fault(self.corners) or _axis_pinch_fault(polygons.orient_counterclockwise(self.corners))

    @property
    def convex(self) -> bool:
        """True if the body is solid and its section convex."""
        return not self.fault and len(self.axis_corner_indices) > 1 and polygons.is_convex(self.outline)

    @property
    def outline(self) -> Corners:
        """Corners (r, z) of the polygon, counter-clockwise, m."""
        return polygons.orient_counterclockwise(self.corners) if self.corners else ((0.0, 0.0),)

    @property
    def axis_corner_indices(self) -> tuple[int, ...]:
        """Indices of the corners on the axis."""
        return _corners_on_axis(self.outline)

    @property
    def has_core(self) -> bool:
        """True if the section meets the axis in one segment with flat ends, so that the mesh has a core."""
        return _has_core(self.outline)

    @property
    def no_hexahedra_reason(self) -> str:
        """Return why the body has no hexahedral mesh; "" if it has one."""
        return "" if not self.axis_corner_indices or self.has_core else HEXAHEDRA

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells for a cell `size` (m): across the section's width and height, and around."""
        (left, low), (right, high) = polygons.coordinate_range(self.outline)
        return (
            count_divisions(right - left, size),
            count_divisions(high - low, size),
            8 * count_divisions(math.pi * right / 4, size),
        )

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of an element with edges of about `size` (m). Raises UnknownElement."""
        from softmark.solvers.mesh.revolved_meshes import sweep_polygon
        from softmark.solvers.mesh.shape import place_mesh
        from softmark.solvers.mesh.structured_meshes import project_midside_nodes

        made = sweep_polygon(
            self.outline, self.counts(size)[-1], size, kind, bool(self.axis_corner_indices), self.has_core
        )
        return project_midside_nodes(place_mesh(made, self.axis, self.origin), self.sides)


def _corners_on_axis(outline: Corners) -> tuple[int, ...]:
    least = ON_AXIS * max(r for r, _ in outline)
    return tuple(i for i, (r, _) in enumerate(outline) if r <= least)


@lru_cache(maxsize=64)
def _axis_pinch_fault(outline: Corners) -> str:
    """Return where a corner of a valid polygon touches the axis without a side along it; "" if nowhere."""
    there = set(_corners_on_axis(outline))
    n = len(outline)
    alone = [i for i in there if (i - 1) % n not in there and (i + 1) % n not in there]
    if not alone:
        return ""
    z = outline[min(alone)][1]
    return (
        f"its section touches the axis at only one point, z = {1e3 * z:.6g} mm: leave a gap, or draw a side "
        "along the axis"
    )


@lru_cache(maxsize=64)
def _has_core(outline: Corners) -> bool:
    """Return whether a polygon has one sequence of sides on the axis, with flat sides at its two ends."""
    there, n = _corners_on_axis(outline), len(outline)
    if len(there) < 2:
        return False
    tops = [i for i in there if (i + 1) % n not in there]
    feet = [i for i in there if (i - 1) % n not in there]
    if len(tops) != 1:
        return False
    out, back = outline[(tops[0] + 1) % n], outline[(feet[0] - 1) % n]
    slack = ON_AXIS * polygons.extent(outline)
    return abs(out[1] - outline[tops[0]][1]) <= slack and abs(back[1] - outline[feet[0]][1]) <= slack


@dataclass(frozen=True)
class Cone(Revolution):
    """A straight circular cone, solid, whose axis starts at `origin`; `end = 0 mm` gives it a tip.

    It is meshed as a tapered cylinder: rings of well-shaped cells around a core, and at a tip cells that close the
    cone. The mesh is inscribed: its points lie on the cone, so that a coarse mesh of linear elements has less volume
    (the report gives the difference). `size` is the cell size at the thickest section.
    """

    convex = True

    length: Annotated[float, "m in (0, inf)", "length along the axis"]
    radius: Annotated[float, "m in (0, inf)", "radius at `origin`"]
    end: Annotated[float, "m in [0, inf)", "radius at the other end; 0 mm is a tip"] = 0.0
    axis: Annotated[Vector3, "direction", "direction of the axis, from the end at `origin`"] = (1.0, 0.0, 0.0)
    origin: Annotated[Vector3, "m", "centre of the end where the axis starts"] = (0.0, 0.0, 0.0)

    @property
    def swept(self) -> Swept | None:
        """The cone as a body of discs along its axis, for beam models.

        None for a cone with a tip, where a section would vanish.
        """
        from softmark.solvers.mesh.cross_sections import Disc
        from softmark.solvers.mesh.frame_shapes import tapered_member

        if not self.end:
            return None
        return tapered_member(self.origin, self.axis, self.length, Disc(self.radius), Disc(self.end))

    @property
    def outline(self) -> Corners:
        """Corners of the section, counter-clockwise, m."""
        top = ((self.end, self.length),) if self.end else ()
        return ((0.0, 0.0), (self.radius, 0.0), *top, (0.0, self.length))

    def at(self, station: float) -> float:
        """Return the radius at a station, m from `origin`."""
        return self.radius + (self.end - self.radius) * station / self.length

    @property
    def similar_mesh_size(self) -> float:
        """Cell size, m, such that this size and its whole fractions give meshes with similar sections."""
        return max(self.radius, self.end) / 2.5

    @property
    def gradable_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates along which cells may be graded: only the axis."""
        return ("along",)

    @property
    def coordinate_ranges(self) -> dict[str, Span]:
        """Ranges of the cone's coordinates: fraction of the radius, angle around the axis, axial position in m."""
        return {"share": (0.0, 1.0), "turn": (0.0, 2.0 * math.pi), "along": (0.0, self.length)}

    def place(self, share: float, turn: float, along: float) -> Vector3:
        """Return the point, m, at a fraction of the radius (`share`), an angle (`turn`, rad) and a height (`along`)."""
        first, second = transverse(self.axis)
        r = share * self.at(along)
        return add_multiples(self.origin, (r * math.cos(turn), first), (r * math.sin(turn), second), (along, self.axis))

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells for a cell `size` (m): along the core's side, across the rings, axial."""
        side, rings = count_disc_cells(max(self.radius, self.end), size)
        return side, rings, count_cells(0.0, self.length, count_divisions(self.length, size), cuts_along(cuts, "along"))

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.revolved_meshes import mesh_cone
        from softmark.solvers.mesh.shape import place_mesh
        from softmark.solvers.mesh.structured_meshes import project_midside_nodes

        made = mesh_cone(self.length, self.radius, self.end, size, kind, cuts)
        return project_midside_nodes(place_mesh(made, self.axis, self.origin), self.sides)
