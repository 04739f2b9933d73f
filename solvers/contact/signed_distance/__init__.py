"""Signed distances ("gaps") of points to rigid shapes. To add one: a class in a file here, and a line in GAPS.

`gap_of(shape)` returns the signed distance to a shape of the scene language. A shape in the table may still have no
signed distance, such as a sphere cut by planes of symmetry: a rigid body must be whole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from softmark.solvers.contact.signed_distance import shape_distances
from softmark.solvers.contact.signed_distance.distance_function import Gap
from softmark.solvers.mesh.boolean_shapes import Difference, Intersection, Union
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.revolved_bodies import Cone, Revolved
from softmark.solvers.mesh.rigid_shapes import HalfSpace, Punch, RoundedBox, RoundedCone
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import Box, Cylinder, MeshFile
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.mesh.surface_bodies import Tetrahedralized
from softmark.solvers.mesh.tubes import Tube

GAPS: dict[type[Shape], Callable[[Any], Gap | None]] = {
    HalfSpace: shape_distances.half_space,
    Sphere: shape_distances.sphere,
    SphericalShell: shape_distances.shell,
    Box: shape_distances.box,
    RoundedBox: shape_distances.rounded_box,
    Cylinder: shape_distances.cylinder,
    Tube: shape_distances.tube,
    Cone: shape_distances.revolved_gap,
    Revolved: shape_distances.revolved_gap,
    Punch: shape_distances.rounded_gap,
    RoundedCone: shape_distances.rounded_gap,
    Extruded: shape_distances.prism_gap,
    Tetrahedralized: shape_distances.surface,
    MeshFile: shape_distances.surface,
    Union: shape_distances.surface,
    Difference: shape_distances.surface,
    Intersection: shape_distances.surface,
}


def gap_of(shape: Shape) -> Gap | None:
    """Return the signed distance to a shape, or None for a shape without one.

    Raises UnreadableMesh for a surface from a file that is not valid.
    """
    make = GAPS.get(type(shape))
    return None if make is None or shape.fault else make(shape)
