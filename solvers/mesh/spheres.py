"""Spheres, ellipsoids and spherical shells, whole or cut by planes of symmetry.

To add a body: derive it from `RoundBody`, define its semi-axes and its hollow, and add a line to SHAPES.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.records import dataclass
from softmark.solvers.mesh.cell_counts import circle_radii, count_divisions
from softmark.solvers.mesh.conforming_planes import Cut, cuts_along, grid_lines
from softmark.solvers.mesh.curved_boundary import EllipsoidSide
from softmark.solvers.mesh.shape import Bounds, Shape, Span, Vector3
from softmark.solvers.mesh.tubes import INSIDE_OUT

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh

Part = Literal["whole", "half", "quarter", "octant"]
KEPT = {"whole": 0, "half": 1, "quarter": 2, "octant": 3}  # number of the axes x, y, z along which a half is kept


class RoundBody(Shape):
    """An ellipsoid, or the shell between two similar ellipsoids, with axes along x, y and z."""

    origin: Vector3
    part: Part

    @property
    def outer_semiaxes(self) -> Vector3:
        """Outer semi-axes along x, y and z, m."""
        raise NotImplementedError(f"{type(self).__name__} has no semi-axes")

    @property
    def hollow_ratio(self) -> float:
        """Ratio of the semi-axes of the hollow to the outer semi-axes; 0 without a hollow."""
        return 0.0

    @property
    def halved_axis_count(self) -> int:
        """Number of the axes x, y, z along which only the half with the higher coordinates is kept."""
        return KEPT[self.part]

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        ends = list(enumerate(zip(self.origin, self.outer_semiaxes, strict=True)))
        low = tuple(o if i < self.halved_axis_count else o - a for i, (o, a) in ends)
        return low, tuple(o + a for _, (o, a) in ends)  # type: ignore[return-value]

    @property
    def volume(self) -> float:
        """Exact volume, m^3."""
        x, y, z = self.outer_semiaxes
        return 4.0 * math.pi / 3.0 * x * y * z * (1.0 - self.hollow_ratio**3) * 0.5**self.halved_axis_count

    @property
    def similar_mesh_size(self) -> float | None:
        """Cell size, m, such that this size and its whole fractions give similar meshes; None for a hollow body."""
        return None if self.hollow_ratio else max(self.outer_semiaxes) / 2.5

    def contains(self, point: Vector3) -> bool:
        """Return whether the body contains a point, within 1e-9 of its size."""
        off = [(p - o) / a for p, o, a in zip(point, self.origin, self.outer_semiaxes, strict=True)]
        return self.hollow_ratio - 1e-9 <= math.hypot(*off) <= 1.0 + 1e-9 and all(
            c >= -1e-9 for c in off[: self.halved_axis_count]
        )

    @property
    def gradable_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates along which cells may be graded: across the wall of a hollow body."""
        return ("radius",) if self.hollow_ratio else ()

    @property
    def coordinate_ranges(self) -> dict[str, Span]:
        """Ranges of the body's coordinates: radius, m, and two angles.

        The radius is the distance from the centre along the longest axis. The angles are around the z axis and from it.
        """
        largest, turn = (
            max(self.outer_semiaxes),
            {0: (0.0, 2.0), 1: (-0.5, 0.5)}.get(self.halved_axis_count, (0.0, 0.5)),
        )
        tilt = 0.5 if self.halved_axis_count == 3 else 1.0
        return {
            "radius": (self.hollow_ratio * largest, largest),
            "turn": (turn[0] * math.pi, turn[1] * math.pi),
            "tilt": (0.0, tilt * math.pi),
        }

    def place(self, radius: float, turn: float, tilt: float) -> Vector3:
        """Return the point, m, at a radius, m, an angle around the z axis (`turn`, rad) and one from it (`tilt`)."""
        way = (math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt))
        share = radius / max(self.outer_semiaxes)
        x, y, z = (o + share * a * w for o, a, w in zip(self.origin, self.outer_semiaxes, way, strict=True))
        return x, y, z

    def _shell_radii(self, size: float, cuts: tuple[Cut, ...]) -> tuple[float, ...]:
        """Return the radii (m) at which shells of cells end, outward from the hollow or the core, including cuts."""
        largest = max(self.outer_semiaxes)
        if not self.hollow_ratio:
            return tuple(circle_radii(largest, size, cuts))
        count = count_divisions((1.0 - self.hollow_ratio) * largest, size)
        low = self.hollow_ratio * largest
        even = [low + (largest - low) * k / count for k in range(count + 1)]
        return tuple(grid_lines(low, largest, count, cuts_along(cuts, "radius")) or even)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells for a cell `size` (m): on a quarter of the largest circle, across the shells."""
        core, *beyond = self._shell_radii(size, cuts)
        inner = 0 if self.hollow_ratio else count_divisions(0.4 * core, size)
        return 2 * count_divisions(math.pi * max(self.outer_semiaxes) / 4, size), inner + len(beyond)

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.ball_blocks import build_ball, build_shell, mesh_blocks
        from softmark.solvers.mesh.structured_meshes import project_midside_nodes

        (side, shells), largest = self.counts(size, cuts), max(self.outer_semiaxes)
        core, *beyond = radii = self._shell_radii(size, cuts)
        if self.hollow_ratio:
            blocks, scale = build_shell(side, [r / largest for r in radii]), 1.0
        else:
            blocks, scale = build_ball(side, shells - len(beyond), [r / core for r in beyond]), core / largest
        stretch = tuple(scale * a for a in self.outer_semiaxes)
        return project_midside_nodes(
            mesh_blocks(blocks, kind, stretch, self.origin, self.halved_axis_count), self.sides, self.within(cuts)
        )

    def within(self, cuts: tuple[Cut, ...]) -> tuple[EllipsoidSide, ...]:
        """Return the ellipsoids inside the body on which nodes must lie, one for each cut of the radius."""
        return tuple(self._similar_ellipsoid(cut.at / max(self.outer_semiaxes)) for cut in cuts_along(cuts, "radius"))

    def _similar_ellipsoid(self, share: float) -> EllipsoidSide:
        x, y, z = self.outer_semiaxes
        return EllipsoidSide((share * x, share * y, share * z), self.origin)

    @property
    def sides(self) -> tuple[EllipsoidSide, ...]:
        """Outer surface, and the surface of the hollow if there is one."""
        return tuple(
            self._similar_ellipsoid(share) for share in ((1.0, self.hollow_ratio) if self.hollow_ratio else (1.0,))
        )


@dataclass(frozen=True)
class Sphere(RoundBody):
    """A solid sphere, or a part of it cut by planes of symmetry.

    It is meshed with shells of well-shaped cells around a rounded cube. The mesh is inscribed: its points lie on the
    sphere, so that a coarse mesh of linear elements has less volume (the report gives the difference). A half is the
    part with higher x than the centre, a quarter the part with higher x and y, an octant the part with higher x, y and
    z: with `symmetric(...)` on its planes it represents the whole sphere.
    """

    convex = True
    has_mass_properties = True

    radius: Annotated[float, "m in (0, inf)", "radius of the sphere"]
    origin: Annotated[Vector3, "m", "centre"] = (0.0, 0.0, 0.0)
    part: Annotated[Part, "the whole, or the part on one side of its planes of symmetry"] = "whole"

    @property
    def has_signed_distance(self) -> bool:
        """True if it is whole: parts are bounded by planes of symmetry."""
        return self.part == "whole"

    @property
    def outer_semiaxes(self) -> Vector3:
        """Outer semi-axes, all equal to the radius, m."""
        return self.radius, self.radius, self.radius


@dataclass(frozen=True)
class Ellipsoid(RoundBody):
    """A solid ellipsoid with its axes along x, y and z, or a part of it cut by planes of symmetry.

    The mesh is that of a sphere, stretched: `size` is the cell size along the longest axis. The parts are those of
    `sphere`.
    """

    convex = True

    semiaxes: Annotated[Vector3, "m in (0, inf)", "half the extents along x, y and z"]
    origin: Annotated[Vector3, "m", "centre"] = (0.0, 0.0, 0.0)
    part: Annotated[Part, "the whole, or the part on one side of its planes of symmetry"] = "whole"

    @property
    def outer_semiaxes(self) -> Vector3:
        """Semi-axes, m."""
        return self.semiaxes


@dataclass(frozen=True)
class SphericalShell(RoundBody):
    """The region between two concentric spheres, or a part of it cut by planes of symmetry.

    It is meshed with shells of hexahedra, or of tetrahedra made of them. The mesh is inscribed in both spheres, so that
    a coarse mesh of linear elements has less volume (the report gives the difference). The parts are those of `sphere`.
    """

    has_mass_properties = True

    radius: Annotated[float, "m in (0, inf)", "outer radius"]
    inner: Annotated[float, "m in (0, inf)", "inner radius"]
    origin: Annotated[Vector3, "m", "centre"] = (0.0, 0.0, 0.0)
    part: Annotated[Part, "the whole, or the part on one side of its planes of symmetry"] = "whole"

    @property
    def has_signed_distance(self) -> bool:
        """True if it is whole: parts are bounded by planes of symmetry."""
        return self.part == "whole"

    @property
    def fault(self) -> str:
        """Return an error if the wall has no thickness; "" if valid."""
        return "" if self.inner < self.radius else INSIDE_OUT

    @property
    def outer_semiaxes(self) -> Vector3:
        """Semi-axes, m."""
        return self.radius, self.radius, self.radius

    @property
    def hollow_ratio(self) -> float:
        """Ratio of the inner radius to the outer radius."""
        return self.inner / self.radius
