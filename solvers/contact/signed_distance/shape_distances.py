"""Constructors of signed distances for the shapes of the language, one function for each kind."""

from __future__ import annotations

from softmark.solvers.contact.signed_distance.distance_function import Gap
from softmark.solvers.contact.signed_distance.polyhedra import BoxGap, HalfSpaceGap, PrismGap
from softmark.solvers.contact.signed_distance.revolved_shapes import RevolvedGap, axial_centroid
from softmark.solvers.contact.signed_distance.rounded_shapes import BallGap, RoundedGap
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.revolved_bodies import Revolution
from softmark.solvers.mesh.rigid_shapes import HalfSpace, RoundedBox, RoundedRevolution
from softmark.solvers.mesh.shape import Shape, Vector3, add_multiples
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.mesh.surface_bodies import SurfaceBody
from softmark.solvers.mesh.tubes import Tube

ARC = 1024  # points of a rounded corner, of which the middle of the volume is found: to 1e-7 of the size
ORDERS = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}  # of a prism's two coordinates in section, and along it


def half_space(shape: HalfSpace) -> Gap:
    """Return the gap of a half-space."""
    return HalfSpaceGap(shape.origin, shape.normal)


def sphere(shape: Sphere) -> Gap | None:
    """Return the gap of a whole sphere; None for a part of one."""
    return None if shape.kept else BallGap(shape.radius, shape.origin)


def shell(shape: SphericalShell) -> Gap | None:
    """Return the gap of a whole spherical shell; None for a part of one."""
    return None if shape.kept else BallGap(shape.radius, shape.origin, shape.inner)


def box(shape: Box) -> Gap:
    """Return the gap of a box with sharp edges."""
    return _brick(shape.origin, shape.size, 0.0)


def rounded_box(shape: RoundedBox) -> Gap:
    """Return the gap of a box with rounded edges: a smaller box and all points near it."""
    core = _brick(shape.origin, shape.size, shape.rounding)
    return RoundedGap(core, shape.rounding, core.centroid)


def _brick(origin: Vector3, size: Vector3, less: float) -> BoxGap:
    """Return a box with corner `origin` and `size`, m, smaller by `less` on each side."""
    a, b, c = (0.5 * s for s in size)
    x, y, z = origin
    return BoxGap((x + a, y + b, z + c), (a - less, b - less, c - less))


def cylinder(shape: Cylinder) -> Gap:
    """Return the gap of a cylinder with flat ends and sharp rims."""
    r, h = shape.radius, shape.length
    return RevolvedGap(((0.0, 0.0), (r, 0.0), (r, h), (0.0, h)), shape.axis, shape.origin)


def tube(shape: Tube) -> Gap:
    """Return the gap of a tube with flat ends and sharp rims."""
    r, s, h = shape.radius, shape.inner, shape.length
    return RevolvedGap(((s, 0.0), (r, 0.0), (r, h), (s, h)), shape.axis, shape.origin)


def revolved_gap(shape: Revolution) -> Gap:
    """Return the gap of a polygon revolved around an axis, such as a cone."""
    return RevolvedGap(shape.outline, shape.axis, shape.origin)


def rounded_gap(shape: RoundedRevolution) -> Gap:
    """Return the gap of a rounded body of revolution: its core and all points near it."""
    core = RevolvedGap(shape.core, shape.axis, shape.origin)
    centre = add_multiples(shape.origin, (axial_centroid(shape.outline(ARC)), shape.axis))
    return RoundedGap(core, shape.rounding, centre)


def prism_gap(shape: Extruded) -> Gap:
    """Return the gap of a prism of any polygon."""
    return PrismGap(shape.section, shape.base, shape.height, ORDERS[shape.along])


def surface(shape: Shape) -> Gap:
    """Return the gap of a closed triangle surface, repaired like those of filled bodies. Raises UnreadableMesh."""
    from softmark.solvers.contact.signed_distance.triangle_surface import TriangleSurface
    from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
    from softmark.solvers.mesh.files.watertight_repair import close_surface

    whole = shape.closed() if isinstance(shape, SurfaceBody) else close_surface(*shape.surface(0.0))
    if whole.crossings:  # where parts overlap, the nearest triangle may be within: no side of it is outside
        raise UnreadableMesh(
            f"its surface intersects itself at {whole.crossings} triangles, so its inside is ambiguous",
            remedy="unite the parts in the program that made the surface",
        )
    return TriangleSurface(whole.points, whole.triangles)
