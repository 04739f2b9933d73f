"""Support in a plane of symmetry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.language import units
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.vocabulary.loads.load import Reason
    from softmark.solvers.mesh.shape import Shape

IN_PLANE = 1e-6  # relative to the body's extent: tolerance of points in a symmetry plane


@dataclass(frozen=True)
class Symmetric(DisplacementSupport):
    """Plane of symmetry: the body represents itself and its mirror image, and points of the plane stay in it.

    `where` selects the plane face that lies in it, such as `x <= 0 mm` for a body with x >= 0. Displacements normal to
    the plane are zero. The plane is normal to x, y or z, and the body lies on one side of it. A beam model also fixes
    the two rotations that would tilt the section out of the plane. Loads and supports must be symmetric too: gravity
    across the plane and initial velocities across it are refused. So are a traction, an elastic foundation or a drain
    on the plane itself, because only the half model has that face. Forces, energies and mass are those of the half
    model; for a force at a point of the plane give half of it (`W335`). The solution is symmetric as well: buckling and
    vibration modes that are not symmetric are not found.
    """

    is_symmetry_plane = True

    body: Annotated[str, "body", "body that is held"]
    where: Annotated[Any, "condition", "plane face, by undeformed coordinates: `x <= 0 mm`"]

    @property
    def mirror_plane(self) -> tuple[int, float] | None:
        """Index of the coordinate that is constant on the plane, and its value, m.

        None if `where` selects no such plane.
        """
        found = set()
        for border in self.where.borders:
            *normal, d = border.plane or (1.0, 1.0, 1.0, 0.0)
            along = [i for i, c in enumerate(normal) if c]
            if len(along) != 1:
                return None
            found.add((along[0], -d / normal[along[0]]))
        return found.pop() if len(found) == 1 else None

    @property
    def components(self) -> tuple[int, ...]:  # type: ignore[override]  # a constant of other kinds
        """Direction in which displacements are zero: the normal of the plane."""
        return () if self.mirror_plane is None else (self.mirror_plane[0],)

    def body_fault(self, name: str, body: str, shape: Shape) -> tuple[str, Reason] | None:
        """Return the reason why the plane is not normal to x, y or z, or cuts the body, or None."""
        if self.mirror_plane is None:
            problem, label = f"`{name}` is not a plane of symmetry", "not a plane normal to x, y or z"
            help = "write one comparison of one coordinate, `where = x <= 0 mm`; rotate an oblique body"
            return "E582", ("where", problem, label, help)
        if (bounds := shape.bounds) is None:
            return None
        axis, place = self.mirror_plane
        low, high = bounds[0][axis], bounds[1][axis]
        near = IN_PLANE * max(b - a for a, b in zip(*bounds, strict=True))
        if min(abs(place - low), abs(place - high)) <= near or not low < place < high:
            return None  # empty selections are reported elsewhere
        problem = f"`{body}` lies on both sides of the plane of symmetry `{name}`"
        span = f"it spans {units.format_value(low, units.LENGTH)} to {units.format_value(high, units.LENGTH)}"
        help = "model only the half on one side of it, as in `sphere(radius = 10 mm, part = half)`"
        return "E582", ("where", problem, span, help)

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why a plane around the axis is no plane of symmetry of a body of revolution, or None."""
        if self.mirror_plane is None or self.mirror_plane[0] != 0 or self.mirror_plane[1] == 0.0:
            return None
        return (
            "where",
            f"is not a plane of symmetry of `{body}`, a body of revolution about the y axis",
            "a cylinder around the axis",
            "use a plane normal to y; to prevent radial growth write `fixed(..., components = x)`",
        )
