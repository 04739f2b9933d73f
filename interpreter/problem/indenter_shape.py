"""Indenter shapes of rigid bodies, for contact theories."""

from __future__ import annotations

import math
from typing import Any

from softmark.records import dataclass
from softmark.references.indentation import Kind
from softmark.references.straight_cantilever import NotApplicable, Vector
from softmark.solvers.mesh.revolved_bodies import Cone
from softmark.solvers.mesh.rigid_shapes import Punch, RoundedCone
from softmark.solvers.mesh.shape import add_multiples, cross, dot, replace_coordinate
from softmark.solvers.mesh.shapes import Cylinder
from softmark.solvers.mesh.spheres import Sphere

ALIGNED = 1e-6  # tolerance of directions
ALONG = "use `cylinder(..., axis = +z)`"


@dataclass(frozen=True)
class Indenter:
    """Part of a rigid body that touches first: its first contact point, m, and its size.

    The size is a radius, m, or the angle of a cone, rad.
    """

    kind: Kind
    size: float  # m, or rad of a cone
    foot: Vector  # m, first point of contact
    edge: float = 0.0  # m, the radius of a rounded rim or tip
    reach: float = math.inf  # m, depth up to which the shape is valid


def indenter_of(name: str, shape: Any, normal: Vector, planar: str) -> Indenter:
    """Return the indenter of a rigid body on a face with the outward unit normal. Raises NotApplicable."""
    if isinstance(shape, Sphere):
        if shape.part != "whole":
            raise NotApplicable(
                f"`{name}` is only a part of a sphere",
                "use a whole sphere: a rigid body may reach beyond a plane of symmetry",
            )
        if planar == "plane_strain":
            raise NotApplicable(f"in plane strain the section of `{name}` is that of a cylinder", ALONG)
        return Indenter("sphere", shape.radius, add_multiples(shape.origin, (-shape.radius, normal)))
    if isinstance(shape, Cylinder) and planar == "plane_strain":
        if math.hypot(*shape.axis[:2]) > ALIGNED:
            raise NotApplicable(f"the axis of `{name}` is not along z", ALONG)
        middle = replace_coordinate(shape.origin, 2, 0.0)  # of the slice
        return Indenter("cylinder", shape.radius, add_multiples(middle, (-shape.radius, normal)))
    if isinstance(shape, Cylinder | Cone | Punch | RoundedCone):
        if planar == "plane_strain":
            raise NotApplicable(f"in plane strain `{name}` is cut along its axis", ALONG)
        return _revolved_indenter(name, shape, normal)
    raise NotApplicable(f"`{name}` is not a sphere, cylinder, cone or punch", "use one of these")


def _revolved_indenter(name: str, shape: Any, normal: Vector) -> Indenter:
    """Return the indenting end of a body of revolution. Raises NotApplicable if its axis is not normal to the face."""
    if math.hypot(*cross(shape.axis, normal)) > ALIGNED:
        raise NotApplicable(f"the axis of `{name}` is not normal to the face", "rotate it so that it is")
    first = dot(shape.axis, normal) > 0.0  # true if the end at `origin` touches first
    foot = shape.origin if first else add_multiples(shape.origin, (shape.length, shape.axis))
    if isinstance(shape, Cylinder):
        return Indenter("punch", shape.radius, foot)
    if isinstance(shape, Punch):
        return Indenter("punch", shape.radius - shape.rounding, foot, shape.rounding)
    if isinstance(shape, RoundedCone):
        if not first:
            raise NotApplicable(f"`{name}` presses with its blunt end", "turn it around")
        angle = 0.5 * shape.angle
        return Indenter("cone", angle, foot, shape.rounding, shape.length - 2.0 * shape.rounding)
    here, there = (shape.radius, shape.end) if first else (shape.end, shape.radius)
    if here == 0.0:
        return Indenter("cone", math.atan(there / shape.length), foot, reach=shape.length)
    if there > here:
        raise NotApplicable(f"the end of `{name}` is a truncated cone", "use a cone with a tip, or a cylinder")
    return Indenter("punch", here, foot)
