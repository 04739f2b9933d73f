"""Constructors of signed distances for the shapes of the scene language, one function for each shape."""

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

ARC = 1024  # points per rounded corner to compute the centroid: exact to 1e-7 of the size
ORDERS = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}  # coordinates of a prism: two in the section, one along it


def half_space(shape: HalfSpace) -> Gap:
    """Return the signed distance to a half-space."""
    return HalfSpaceGap(shape.origin, shape.normal)


def sphere(shape: Sphere) -> Gap:
    """Return the signed distance to a whole sphere."""
    return BallGap(shape.radius, shape.origin)


def shell(shape: SphericalShell) -> Gap:
    """Return the signed distance to a whole spherical shell."""
    return BallGap(shape.radius, shape.origin, shape.inner)


def box(shape: Box) -> Gap:
    """Return the signed distance to a box with sharp edges."""
    return _inset_box_distance(shape.origin, shape.size, 0.0)


def rounded_box(shape: RoundedBox) -> Gap:
    """Return the signed distance to a box with rounded edges.

    The core is a box that is smaller by the rounding radius on each side.
    """
    core = _inset_box_distance(shape.origin, shape.size, shape.rounding)
    return RoundedGap(core, shape.rounding, core.centroid)


def _inset_box_distance(origin: Vector3, size: Vector3, less: float) -> BoxGap:
    """Return the signed distance to a box with a corner at `origin` and edge lengths `size`, m.

    The box is made smaller by `less`, m, on each side.
    """
    a, b, c = (0.5 * s for s in size)
    x, y, z = origin
    return BoxGap((x + a, y + b, z + c), (a - less, b - less, c - less))


def cylinder(shape: Cylinder) -> Gap:
    """Return the signed distance to a cylinder with flat ends and sharp rims."""
    r, h = shape.radius, shape.length
    return RevolvedGap(((0.0, 0.0), (r, 0.0), (r, h), (0.0, h)), shape.axis, shape.origin)


def tube(shape: Tube) -> Gap:
    """Return the signed distance to a tube with flat ends and sharp rims."""
    r, s, h = shape.radius, shape.inner, shape.length
    return RevolvedGap(((s, 0.0), (r, 0.0), (r, h), (s, h)), shape.axis, shape.origin)


def revolved_gap(shape: Revolution) -> Gap:
    """Return the signed distance to a polygon revolved around an axis, such as a cone."""
    return RevolvedGap(shape.outline, shape.axis, shape.origin)


def rounded_gap(shape: RoundedRevolution) -> Gap:
    """Return the signed distance to a rounded body of revolution.

    The body consists of all points within the rounding radius, m, of a convex core.
    """
    core = RevolvedGap(shape.core, shape.axis, shape.origin)
    centre = add_multiples(shape.origin, (axial_centroid(shape.outline(ARC)), shape.axis))
    return RoundedGap(core, shape.rounding, centre)


def prism_gap(shape: Extruded) -> Gap:
    """Return the signed distance to a prism with any polygon as section."""
    return PrismGap(shape.section, shape.base, shape.height, ORDERS[shape.along])


def surface(shape: Shape) -> Gap:
    """Return the signed distance to a closed triangle surface, with holes closed. Raises UnreadableMesh."""
    from softmark.solvers.contact.signed_distance.triangle_surface import TriangleSurface
    from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
    from softmark.solvers.mesh.files.watertight_repair import close_surface

    whole = shape.closed() if isinstance(shape, SurfaceBody) else close_surface(*shape.surface(0.0))
    if whole.crossings:  # in an overlap the nearest triangle may be inside, and the sign is undefined
        raise UnreadableMesh(
            f"its surface intersects itself at {whole.crossings} triangles, so its inside is ambiguous",
            remedy="unite the parts in the program that made the surface",
        )
    return TriangleSurface(whole.points, whole.triangles)
