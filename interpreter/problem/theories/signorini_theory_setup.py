"""Setup of the Signorini problem: an elastic bar whose end meets a rigid plane."""

from __future__ import annotations

import math
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.box_and_cylinder_faces import BoxBody
from softmark.interpreter.problem.theories.contact_theory_setup import (
    FAR,
    SAME,
    Face,
    RigidContactSetup,
    bonding_and_mirrors,
    contact_and_face,
    rigid_displacement,
)
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.references.signorini import StoppedBar
from softmark.references.straight_cantilever import NotApplicable, Vector
from softmark.solvers.mesh.rigid_shapes import HalfSpace
from softmark.solvers.mesh.shape import add_multiples, dot, replace_coordinate

PLANE = "use `half_space(...)` with its normal toward the bar, or a box that covers its end"
LOADS = "use at most one `traction(...)` along the bar, on the whole end that meets the plane"


class SignoriniSetup(RigidContactSetup):
    """Makes the problem of an elastic bar whose end a rigid plane stops."""

    def problem_from(self, reference: Declared, case: Case) -> StoppedBar:
        touch, face = contact_and_face(case)
        material, nu = case.material, float(case.material.poisson)
        if touch.thing.friction and nu:
            raise NotApplicable(f"the contact has friction of {touch.thing.friction:g}", "remove `friction`")
        n = face.normal
        gap = _gap_above_face(touch.rigid.name, touch.rigid.thing.shape, face) + dot(rigid_displacement(touch), n)
        bonded, mirrors = bonding_and_mirrors(case, face)
        if bonded and nu:
            raise NotApplicable(
                "its far face cannot expand or contract laterally", "hold it along its normal only, so that it slides"
            )
        if not touch.thing.where.holds(*face.middle, case.shape.diagonal):
            raise NotApplicable(f"the `where` of `{touch.name}` excludes the place of contact", "select the whole face")
        young, narrowing = 2.0 * float(material.shear_modulus) * (1.0 + nu), nu
        if case.planar == "plane_strain":
            young, narrowing = young / (1.0 - nu**2), nu / (1.0 - nu)
        x, y, z = (c in face.across or not case.planar for c in range(3))
        return StoppedBar(
            face.thickness,
            face.area,
            young,
            narrowing,
            gap,
            _end_force(case, face),
            _fixed_point(face, mirrors),
            n,
            (x, y, z),
        )


def _gap_above_face(name: str, shape: Any, face: Face) -> float:
    """Return the distance, m, between a face and the flat side of a rigid body above it. Raises NotApplicable."""
    n = face.normal
    if isinstance(shape, HalfSpace):
        return float(dot(add_multiples(shape.origin, (-1.0, face.middle)), n))
    from softmark.solvers.mesh.shapes import Box

    if not isinstance(shape, Box):
        raise NotApplicable(f"`{name}` is not a plane", PLANE)
    low, high = shape.bounds
    own_low, own_high = face.body.bounds
    flat = isinstance(face.body, BoxBody) and face.body.flat
    if any(
        low[c] > own_low[c] or high[c] < own_high[c] for c in face.across if not (flat and face.has_half_section_body)
    ):
        raise NotApplicable(f"`{name}` does not cover the end", PLANE)
    way = max(range(3), key=lambda c: abs(n[c]))
    if abs(n[way]) < 1.0 - SAME:
        raise NotApplicable(f"`{name}` is not normal to the bar", PLANE)
    near = low if n[way] > 0.0 else high
    return (near[way] - face.middle[way]) * n[way]


def _end_force(case: Case, face: Face) -> float:
    """Return the outward force, N, of a traction on the end that meets the plane. Raises NotApplicable."""
    if not case.loads:
        return 0.0
    load = case.loads[0]
    action = load.thing.action
    if len(case.loads) > 1 or not isinstance(action, SurfaceTraction) or face.selected_ends(action.where) != {face.end}:
        raise NotApplicable(f"the load `{load.name}` does not act on the end that meets the plane", LOADS)
    along = float(dot(action.traction, face.normal))
    if math.hypot(*add_multiples(action.traction, (-along, face.normal))) > SAME * math.hypot(*action.traction):
        raise NotApplicable(f"the load `{load.name}` does not act along the bar", LOADS)
    return along * face.area


def _fixed_point(face: Face, mirrors: set[tuple[int, int]]) -> Vector:
    """Return a point, m, that does not move: the centre of the face opposite to `face`, shifted into symmetry planes.

    `mirrors` are the symmetry planes of the body by direction and end. The centre is shifted into each of them, because
    points on a symmetry plane do not move across it. Raises NotApplicable if two planes prevent the lateral expansion.
    """
    found = add_multiples(face.middle, (-face.thickness, face.normal))
    for way, end in mirrors:
        assert isinstance(face.body, BoxBody)
        if (way, 1 - end) in mirrors:
            raise NotApplicable(f"it cannot expand along {'xyz'[way]}", f"leave one side free; {FAR}")
        found = replace_coordinate(found, way, (face.body.high if end else face.body.low)[way])
    return found
