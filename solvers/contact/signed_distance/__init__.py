"""Signed distances ("gaps") of points to rigid shapes. To add one: a function in shape_distances.py, a line in GAPS.

A line also serves the classes derived from its class: a new `RoundedRevolution` needs none.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from softmark.solvers.contact.signed_distance import shape_distances
from softmark.solvers.contact.signed_distance.distance_function import Gap
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.revolved_bodies import Revolution
from softmark.solvers.mesh.rigid_shapes import HalfSpace, RoundedBox, RoundedRevolution
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import Box, Cylinder, MeshFile
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.mesh.surface_bodies import SurfaceBody
from softmark.solvers.mesh.tubes import Tube

GAPS: dict[type[Shape], Callable[[Any], Gap]] = {
    HalfSpace: shape_distances.half_space,
    Sphere: shape_distances.sphere,
    SphericalShell: shape_distances.shell,
    Box: shape_distances.box,
    RoundedBox: shape_distances.rounded_box,
    Cylinder: shape_distances.cylinder,
    Tube: shape_distances.tube,
    Revolution: shape_distances.revolved_gap,
    RoundedRevolution: shape_distances.rounded_gap,
    Extruded: shape_distances.prism_gap,
    SurfaceBody: shape_distances.surface,
    MeshFile: shape_distances.surface,
}


def gap_of(shape: Shape) -> Gap | None:
    """Return the signed distance to a shape, or None for a shape without one.

    Raises UnreadableMesh for a surface from a file that is not valid.
    """
    if shape.fault or not shape.has_signed_distance:
        return None
    return next(make for cls, make in GAPS.items() if isinstance(shape, cls))(shape)
