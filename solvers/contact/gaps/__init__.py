"""Gaps: how far points are from the surface of a rigid shape. To add one: a class in a file here, a line in GAPS.

`gap_of(shape)` says which shapes of the language have one. A shape that is listed may still have none, such as a sphere
of which planes of symmetry leave a part: an instrument is whole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from softmark.solvers.contact.gaps import made
from softmark.solvers.contact.gaps.gap import Gap
from softmark.solvers.mesh.combined import Difference, Intersection, Union
from softmark.solvers.mesh.extruded import Extruded
from softmark.solvers.mesh.filled import Filled
from softmark.solvers.mesh.instruments import HalfSpace, Punch, RoundedBox, Tip
from softmark.solvers.mesh.revolved import Cone, Revolved
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import Box, Cylinder, MeshFile
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.mesh.tube import Tube

GAPS: dict[type[Shape], Callable[[Any], Gap | None]] = {
    HalfSpace: made.half_space,
    Sphere: made.sphere,
    SphericalShell: made.shell,
    Box: made.box,
    RoundedBox: made.rounded_box,
    Cylinder: made.cylinder,
    Tube: made.tube,
    Cone: made.revolved,
    Revolved: made.revolved,
    Punch: made.rounded,
    Tip: made.rounded,
    Extruded: made.extruded,
    Filled: made.surface,
    MeshFile: made.surface,
    Union: made.surface,
    Difference: made.surface,
    Intersection: made.surface,
}


def gap_of(shape: Shape) -> Gap | None:
    """The gap to a shape's surface; None of one that has none. Raises UnreadableMesh, of a file's surface."""
    make = GAPS.get(type(shape))
    return None if make is None or shape.fault else make(shape)
