"""Exact surface of a shape without a mesh: selected area, and integral of the normal over it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, reduce
from itertools import pairwise

import numpy as np

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE, Condition, Term
from softmark.interpreter.problem.surface_selection.containment import HERE, Point, inside_condition
from softmark.interpreter.problem.surface_selection.facet_patches import ConditionOnPatches, Floats, Patches
from softmark.interpreter.problem.surface_selection.selected_facets import Part, select_patches
from softmark.interpreter.problem.surface_selection.sphere_selection import select_curved_side, symmetry_cuts
from softmark.records import dataclass
from softmark.solvers.mesh.boolean_shapes import BooleanShape
from softmark.solvers.mesh.curved_boundary import ConeSide, CylinderSide, EllipsoidSide
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.polygons import edges
from softmark.solvers.mesh.revolved_bodies import Revolution
from softmark.solvers.mesh.shape import Shape, Vector3, add_multiples, transverse
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.spheres import RoundBody
from softmark.solvers.mesh.tubes import Tube

BESIDE = 2e-8  # relative to the extent: offset of samples beside a surface
SOME = 1e-6  # relative to the extent squared: smaller common areas are tolerances
TIPS = (1 / 4096, 1 / 256, 1 / 32, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of a cone: bands towards its tip; the first is flat
SIDES = 48  # flat strips of an unrolled cylinder side


Measured = tuple[float, Floats, float]  # area, m^2; of the outward normal n, (3,), m^2; of x . n, m^3


@dataclass(frozen=True)
class Piece:
    """Part of a body's exact surface.

    `measure` returns the area, m^2, and normal integrals of the part that a condition selects. `symbolic_offset_point`
    returns a point of the piece, moved out of the body by a distance, m (into it if negative). Its coordinates are
    symbolic terms of those of the piece.
    """

    measure: Callable[[Condition, float], Measured]
    symbolic_offset_point: Callable[[float], Point]

    def within(self, *held: Condition) -> Piece:
        """Return the part of the piece on which the given conditions hold."""
        return Piece(
            lambda asked, extent: self.measure(reduce(_both_hold, held, asked), extent), self.symbolic_offset_point
        )

    def reversed_piece(self) -> Piece:
        """Return the same piece with its normal reversed."""

        def measure(condition: Condition, extent: float) -> Measured:
            area, vector, through = self.measure(condition, extent)
            return area, -vector, -through

        return Piece(measure, lambda out: self.symbolic_offset_point(-out))


def select_surface(shape: Shape, condition: Condition) -> tuple[float, Floats] | None:
    """Return the selected area, m^2, and the integral of the outward normal over it (3,), m^2; None for mesh files.

    It is computed once for all models of a body. For combined bodies the exact surface of each part is used where it
    lies on the combined surface.
    """
    found = None if condition.groups else _measure_surface(shape, condition)
    return found and found[:2]


def volume(shape: Shape) -> float | None:
    """Return the volume of a single or combined shape, m^3, by the divergence theorem; None if it is not known."""
    if not isinstance(shape, BooleanShape):
        return shape.volume
    found = _measure_surface(shape, EVERYWHERE)
    return found and found[2] / 3.0


@lru_cache(maxsize=64)
def _measure_surface(shape: Shape, condition: Condition) -> Measured | None:
    """Return the area, m^2, and normal integral of the selected part of the whole surface; None for mesh files.

    It is computed once.
    """
    if (found := pieces(shape)) is None:
        return None
    return _add_up([piece.measure(condition, shape.diagonal) for piece in found])


def limit_of_facet_area(shape: BooleanShape, condition: Condition, size: float) -> float | None:
    """Return the limit of facet areas, m^2, as cells of the given `size`, m, are halved; None with named groups.

    Each halving reduces the error to a fourth. This is used for parts without exact surfaces. Raises UnreadableMesh.
    """
    if condition.groups:
        return None
    areas = [
        _selected_flat_part(own.points[own.triangles], condition, shape.diagonal)[0]
        for own in shape.coarse_and_fine_surfaces(size)
    ]
    return areas[1] + (areas[1] - areas[0]) / 3.0


def pieces(shape: Shape) -> list[Piece] | None:
    """Return all pieces of a shape's surface; None for mesh files and curved axes."""
    if isinstance(shape, BooleanShape):
        return _combined_pieces(shape)
    if isinstance(shape, Box):
        return [_flat_piece(corners[None]) for corners in _faces(shape)]
    if isinstance(shape, RoundBody):
        flat, inner = symmetry_cuts(shape)
        balls = [_ellipsoid_piece(shape, side) for side in shape.sides]
        return [*_reverse_inner(balls), *(_flat_piece(corners[None], inner) for corners in flat)]
    if isinstance(shape, Cylinder | Tube):
        inner = _radius_condition(shape.origin, shape.axis, shape.radius, shape.section.hole_radius)
        sides = [_side_piece([side]) for side in shape.sides]
        return [*_reverse_inner(sides), *(_flat_piece(corners[None], inner) for corners in _end_squares(shape))]
    if isinstance(shape, Revolution):
        return _revolved_pieces(shape)
    if isinstance(shape, Extruded):
        return [_flat_piece(corners) for corners in _extrusion_faces(shape)]
    return None


def _combined_pieces(shape: BooleanShape) -> list[Piece] | None:
    """Return the surface pieces of a combined shape: parts of each shape's surface outside or inside the other shape.

    Where both surfaces coincide, the first counts if both bodies lie on the same side (on opposite sides for a
    difference), and the second never. Borders between parts of the first shape are not part of its surface. The result
    is None if a shape has no exact pieces.
    """
    first, second = pieces(shape.one), pieces(shape.other)
    if first is None or second is None:
        return None
    union, taken = shape.operation == "union", shape.operation == "difference"
    beside = BESIDE * shape.diagonal
    same = (beside,) if union else (-beside,)
    both = (-beside, beside) if isinstance(shape.one, BooleanShape) else ()
    found = [_restrict_piece(piece, shape.other, union or taken, same) for piece in first]
    found += [_restrict_piece(piece.reversed_piece() if taken else piece, shape.one, union, both) for piece in second]
    return None if None in found else [piece for piece in found if piece is not None]


def _restrict_piece(piece: Piece, other: Shape, outside: bool, beside: tuple[float, ...]) -> Piece | None:
    """Return the part of a piece outside or inside another shape, with coincident parts if required.

    `beside` are the distances, m out of the body, at which coincident parts are tested; empty if they do not count.
    """
    open_, closed = (inside_condition(other, HERE, held) for held in (False, True))
    if open_ is None or closed is None:
        return None
    on = piece.within(closed, Condition.negation(open_))
    sure = piece.within(Condition.negation(closed) if outside else open_)
    there = [
        held for out in beside if (held := inside_condition(other, piece.symbolic_offset_point(out), True)) is not None
    ]
    doubtful = on.within(*(map(Condition.negation, there) if outside else there))

    def measure(condition: Condition, extent: float) -> Measured:
        found = sure.measure(condition, extent)
        if not beside or on.measure(condition, extent)[0] <= SOME * extent**2:
            return found
        return _add_up([found, doubtful.measure(condition, extent)])

    return Piece(measure, piece.symbolic_offset_point)


def _both_hold(one: Condition, other: Condition) -> Condition:
    return Condition.junction("and", one, other)


def _reverse_inner(found: list[Piece]) -> list[Piece]:
    """Return the pieces of an outer surface and a cavity, with the normals of the cavity reversed."""
    return [piece if i == 0 else piece.reversed_piece() for i, piece in enumerate(found)]


def _add_up(found: list[Measured]) -> Measured:
    if not found:
        return 0.0, np.zeros(3), 0.0
    areas, vectors, through = zip(*found, strict=True)
    return sum(areas), np.sum(vectors, axis=0), sum(through)


def _flat_piece(corners: Floats, *held: Condition) -> Piece:
    """Return the surface piece of coplanar flat facets (f, k, 3), m, restricted to where all conditions `held` hold."""
    normal = np.cross(corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0])
    normal /= np.linalg.norm(normal)

    def point_shifted_along_normal(out: float) -> Point:
        return _linear(np.eye(3), out * normal)

    def measure(condition: Condition, extent: float) -> Measured:
        area, vector = _selected_flat_part(corners, condition, extent)
        return area, vector, float(vector @ corners[0, 0])

    return Piece(measure, point_shifted_along_normal).within(*held)


def _ellipsoid_piece(shape: RoundBody, side: EllipsoidSide) -> Piece:
    centre = np.array(side.centre)

    def point_with_changed_semiaxes(out: float) -> Point:
        stretch = np.diag([1.0 + out / a for a in side.semiaxes])
        return _linear(stretch, centre - stretch @ centre)

    return Piece(
        lambda condition, extent: select_curved_side(shape, side, condition, extent), point_with_changed_semiaxes
    )


def _linear(matrix: Floats, rest: Floats) -> Point:
    """Return the map of points x to matrix x + rest."""

    def of(row: list[float], more: float) -> Term:
        parts = [own.combine("*", Term.constant(c)) for own, c in zip(HERE, row, strict=True) if c]
        return reduce(lambda a, b: a.combine("+", b), parts, Term.constant(more))

    x, y, z = (of(row, more) for row, more in zip(matrix.tolist(), rest.tolist(), strict=True))
    return x, y, z


def _side_piece(bands: Sequence[CylinderSide | ConeSide]) -> Piece:
    """Return the side of a cylinder, or of a cone divided into bands, with its normal away from the axis."""
    side, widest = bands[0], max(max(band.radii) for band in bands)
    axis, origin = np.array(side.axis), np.array(side.origin)

    def point_stretched_about_axis(out: float) -> Point:
        stretch = np.eye(3) + out / widest * (np.eye(3) - np.outer(axis, axis))
        return _linear(stretch, origin - stretch @ origin)

    return Piece(
        lambda condition, extent: _add_up([_selected_side(band, condition, extent) for band in bands]),
        point_stretched_about_axis,
    )


def _selected_flat_part(corners: Floats, condition: Condition, extent: float) -> tuple[float, Floats]:
    """Return the area, m^2, and normal integral (3,), m^2, of the selected part of flat facets.

    The facets are parallelograms (f, 4, 3) or triangles (f, 3, 3), m.
    """
    patches = Patches(corners, extent)
    found = select_patches(ConditionOnPatches.of(condition, patches))
    vectors = np.concatenate([
        (4.0 if patches.nodes == 4 else 0.5) * patches.area(found.whole, np.zeros((len(found.whole), 2))),
        found.w[:, None] * patches.area(found.f, found.xi),
    ])  # fmt: skip
    return float(np.linalg.norm(vectors, axis=1).sum()), vectors.sum(axis=0)


def _faces(box: Box) -> Floats:
    """Return the six faces of a box (6, 4, 3), counter-clockwise from outside."""
    low, size, faces = np.array(box.origin), np.diag(box.size), []
    for axis in range(3):
        a, b, c = size[axis], size[(axis + 1) % 3], size[(axis + 2) % 3]
        faces += [[low, low + c, low + c + b, low + b], [low + a, low + a + b, low + a + b + c, low + a + c]]
    return np.array(faces)


def _end_squares(prism: Cylinder | Tube) -> Floats:
    """Return squares (2, 4, 3), m, that enclose both ends, counter-clockwise seen from outside."""
    root, a = np.array(prism.origin), np.array(prism.axis)
    u, v = (prism.radius * np.array(e) for e in transverse(prism.axis))
    turning = [-u - v, u - v, u + v, v - u]
    top = root + prism.length * a
    return np.array([[root + c for c in reversed(turning)], [top + c for c in turning]])


def _radius_condition(origin: Vector3, axis: Vector3, radius: float, hollow: float | None) -> Condition:
    """Return the condition that a point is within `radius`, m, of an axis, and outside the radius `hollow`."""
    square = Term.constant(0.0)
    for e in transverse(axis):
        along = Term.constant(-sum(o * c for o, c in zip(origin, e, strict=True)))
        for i in range(3):
            if e[i]:
                along = along.combine("+", Term.coordinate(i).combine("*", Term.constant(e[i])))
        square = square.combine("+", along.combine("*", along))
    inner = Condition.comparison("<=", square, Term.constant(radius**2), 2)
    if not hollow:
        return inner
    return Condition.junction("and", inner, Condition.comparison(">=", square, Term.constant(hollow**2), 2))


def _revolved_pieces(shape: Revolution) -> list[Piece]:
    """Return the curved sides of a body of revolution, and the flat rings around its axis."""
    axis = np.array(shape.axis)
    rolls = [(_side_piece(_bands(side)), outward) for side, outward in shape.oriented_curved_sides]
    found = [roll if outward else roll.reversed_piece() for roll, outward in rolls]
    u, v = (np.array(e) for e in transverse(shape.axis))
    for ring in shape.rings:
        turning = [ring.outer * c for c in (-u - v, u - v, u + v, v - u)]
        middle = np.array(shape.origin) + ring.at * axis
        corners = np.array([[middle + c for c in (turning if ring.up else reversed(turning))]])
        found.append(_flat_piece(corners, _radius_condition(shape.origin, shape.axis, ring.outer, ring.inner)))
    return found


def _bands(side: ConeSide) -> list[ConeSide]:
    """Return the side of a cone in bands, narrower towards a tip, where the direction of the normal is undefined."""
    if min(side.radii) > 0.0:
        return [side]
    ends = [0.0, *TIPS] if side.first == 0.0 else [1.0 - t for t in (*reversed(TIPS), 0.0)]
    way = (side.last - side.first, side.length)
    return [
        ConeSide(side.axis, add_multiples(side.origin, (a * way[1], side.axis)), (b - a) * way[1],
                side.first + a * way[0], side.last if b == 1.0 else side.first + b * way[0])
        for a, b in pairwise(ends)
    ]  # fmt: skip


def _extrusion_faces(shape: Extruded) -> list[Floats]:
    """Return the sides of an extruded polygon, (1, 4, 3) each, and the triangles of its ends (t, 3, 3), m.

    Corners are counter-clockwise seen from outside.
    """
    from softmark.solvers.mesh.quadrilateral_meshing import triangulate

    section = shape.section
    low, high = shape.base, shape.base + shape.height
    sides = [[(*a, low), (*b, low), (*b, high), (*a, high)] for a, b in edges(section)]
    points, cells = triangulate(section, shape.diagonal)
    flat = points[cells]
    ends = [np.concatenate([own, np.full((*own.shape[:2], 1), z)], axis=2)
            for own, z in ((flat[:, ::-1], low), (flat, high))]  # fmt: skip
    return [*(shape.placed(np.array([own])) for own in sides), *(shape.placed(own) for own in ends)]


def _selected_side(side: CylinderSide | ConeSide, condition: Condition, extent: float) -> Measured:
    """Return the measures of the selected part of the side of a cylinder or cone, with its normal away from the axis.

    It is integrated over strips between the axis and the side. Each point represents the point of the side right
    outside it: an angle and an axial length have the area r (e - r' a), with the direction e from the axis a and the
    radius r there.
    """
    r, q = side.radii
    slope, root, a = (q - r) / side.length, np.array(side.origin), np.array(side.axis)
    u, v = (np.array(e) for e in transverse(side.axis))
    turns = 2.0 * math.pi * np.arange(SIDES + 1) / SIDES
    rim = np.cos(turns)[:, None] * u + np.sin(turns)[:, None] * v
    low, high = r * rim, q * rim + side.length * a
    corners = root + np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1)
    patches = Patches(corners, extent, side.project_points if min(r, q) > 0.0 else None)
    found: Part = select_patches(ConditionOnPatches.of(condition, patches))
    half, mean = math.pi / SIDES, 0.5 * (r + q) * side.length
    middle = rim[:-1] + rim[1:]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    whole = 2.0 * mean * (math.sin(half) * middle[found.whole] - half * slope * a)
    X = patches.at(found.f, found.xi[:, None])[:, 0] - root
    along = X @ a
    away = X - along[:, None] * a
    off = np.linalg.norm(away, axis=1)
    e = away / off[:, None]
    turned = found.w * (patches.area(found.f, found.xi) * e).sum(axis=1) / off  # of the angle, times the length
    parts = (turned * (r + slope * along))[:, None] * (e - slope * a)
    area = 2.0 * mean * half * math.hypot(1.0, slope) * len(found.whole) + float(np.linalg.norm(parts, axis=1).sum())
    vector = whole.sum(axis=0) + parts.sum(axis=0)
    return area, vector, float(root @ vector) + r * area / math.hypot(1.0, slope)
