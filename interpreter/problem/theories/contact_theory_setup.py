"""Setup of contact theories: the rigid body, the face of the body that it touches, and the forces of the theory."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case, RigidBodyContact
from softmark.interpreter.problem.box_and_cylinder_faces import BoxBody, CylinderBody, box_or_cylinder_body
from softmark.interpreter.problem.indenter_shape import indenter_of
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.results.reaction_results import ContactNumbers as Touched
from softmark.interpreter.results.reaction_results import EquilibriumForces, Reaction
from softmark.interpreter.vocabulary.amplitude_words import at_full_size
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.records import dataclass
from softmark.references.half_space_indentation import Surroundings
from softmark.references.indentation import SAID, Indentation
from softmark.references.straight_cantilever import NotApplicable, Vector
from softmark.solvers.mesh.shape import add_multiples, cross, dot

NEAR = 1e-6  # relative to the body's size: how far beside the axis a plane of symmetry may lie
SAME = 1e-9  # relative to the body's size, or of a travel: what is less is none
ONE = "one rigid body, one `rigid_contact(...)`, and no other load"
FAR = "hold the whole far face with `fixed(...)`, or only along its normal, so that it slides"
NONE = (0.0, 0.0, 0.0)
NEGLECTED = {
    "depth": "that the depth is not small compared with the radius",
    "thickness": "that the body is not a half-space: its far face is near",
    "sides": "that the body ends at its sides",
    "rim": "that the rim is rounded",
    "tip": "that the tip is rounded",
    "series": "the error of the integral equation of the layer",
    "pressure": "that the strip is not thick compared with the width of contact",
    "strain": "that strain is not small",
    "overhang": "that faces which narrow by different amounts overhang each other",
}


@dataclass(frozen=True)
class Face:
    """Flat face of a body: the face normal to x, y or z of a box, or an end of a cylinder.

    `way` is the direction of the normal: 0, 1 or 2 for x, y or z. `end` is 0 for the low face or the root of a
    cylinder, 1 for the opposite face.
    """

    body: BoxBody | CylinderBody
    way: int
    end: int

    @property
    def normal(self) -> Vector:
        """Outward unit normal."""
        return self.body.outward(self.way, self.end)

    @property
    def middle(self) -> Vector:
        """Centre of the face, m; for a body of revolution the point on its axis."""
        return self.body.centre(self.way, self.end)

    @property
    def thickness(self) -> float:
        """Distance to the opposite face, m."""
        return self.body.size(self.way)

    @property
    def area(self) -> float:
        """Area of the face, m^2; for a body of revolution the area of the full circle or ring."""
        return self.body.area(self.way)

    @property
    def has_half_section_body(self) -> bool:
        """True if the body is modelled by half of its section, as a body of revolution is."""
        return isinstance(self.body, BoxBody) and self.body.turns

    @property
    def across(self) -> tuple[int, ...]:
        """Directions along the face, as numbers 0 to 2 of x, y and z, in which its points may move."""
        if isinstance(self.body, CylinderBody):
            return tuple(c for c in range(3) if abs(self.body.shape.axis[c]) < 0.5)
        return tuple(c for c in range(3) if c != self.way and not (c == 2 and self.body.flat))

    def selected_ends(self, where: Any) -> set[int]:
        """Return the `end` numbers of those of this face and its opposite face that a condition selects exactly."""
        return self.body.selected_faces(where, self.way)

    def is_overlapped_by_box(self, low: Vector, high: Vector) -> bool:
        """Return whether a box, seen along the normal, overlaps the face. `low` and `high` are its corners, m."""
        own_low, own_high = self.body.bounds
        return all(low[c] <= own_high[c] and own_low[c] <= high[c] for c in self.across)

    def contains_projection_of(self, point: Vector) -> bool:
        """Return whether the projection of a point, m, along the normal lies on the face."""
        low, high = self.body.bounds
        size = max(b - a for a, b in zip(low, high, strict=True))
        return all(low[c] - NEAR * size <= point[c] <= high[c] + NEAR * size for c in self.across)

    def width(self, at: Vector, mirrors: set[tuple[int, int]]) -> float:
        """Return the distance, m, from a point to the nearest edge of the face; edges in symmetry planes do not count.

        `mirrors` are the symmetry planes, each as direction (0 to 2) and end (0 low, 1 high).
        """
        if isinstance(self.body, CylinderBody):
            return self.body.shape.radius - math.dist(at, self.middle)
        if self.body.turns:
            return self.body.high[0]
        low, high = self.body.bounds
        sides = [
            (at[c] - low[c], high[c] - at[c])[end] for c in self.across for end in (0, 1) if (c, end) not in mirrors
        ]
        return min(sides, default=math.inf)


# ------------------------------------------------------------------ contact and supports of the scene


def contact_and_face(case: Case) -> tuple[RigidBodyContact, Face]:
    """Return the only contact of a case, and the face that its rigid body approaches. Raises NotApplicable."""
    if case.parts or hasattr(case.material, "passive"):
        raise NotApplicable(
            f"`{case.body.name}` does not consist of one passive material",
            "use one material without active stress for the whole body",
        )
    if case.planar == "plane_stress":
        raise NotApplicable("its body is in plane stress", "use `plane_strain(...)`, or a solid")
    if len(case.contacts) != 1:
        count = len(case.contacts) or "no"
        raise NotApplicable(f"`{case.body.name}` has {count} contacts with rigid bodies", f"use {ONE}")
    touch, body = case.contacts[0], box_or_cylinder_body(case)
    ways = (0,) if isinstance(body, CylinderBody) else (1,) if body.turns else (0, 1) if body.flat else (0, 1, 2)
    for face in (Face(body, way, end) for way in ways for end in (0, 1)):
        if _is_above_face(touch, face):
            return touch, face
    raise NotApplicable(
        f"`{touch.rigid.name}` is not above a flat face of `{case.body.name}`", "start with a gap above a flat face"
    )


def _is_above_face(touch: RigidBodyContact, face: Face) -> bool:
    """Return whether the rigid body of a contact lies on the outer side of a face and over it."""
    shape, n = touch.rigid.thing.shape, face.normal
    normal = getattr(shape, "normal", None)
    if normal is not None:  # all behind a plane
        return bool(dot(normal, n) < -1.0 + SAME)
    if shape.bounds is None:
        return False
    low, high = shape.bounds
    x, y, z = (0.5 * (a + b) for a, b in zip(low, high, strict=True))
    return dot(add_multiples((x, y, z), (-1.0, face.middle)), n) > 0.0 and face.is_overlapped_by_box(low, high)


def rigid_displacement(touch: RigidBodyContact) -> Vector:
    """Return the displacement, m, that supports prescribe for the rigid body of a contact.

    Raises NotApplicable if the rigid body rotates or is driven by loads.
    """
    if touch.along is not None:
        raise NotApplicable(f"`{touch.rigid.name}` is driven by loads, but the theory needs a given displacement",
                      "compare in a scene in which a support moves it: `displaced(...)`")  # fmt: skip
    shift = NONE
    for support in touch.moved:
        if at_full_size(support.thing).rotates:
            raise NotApplicable(f"`{support.name}` rotates `{touch.rigid.name}`", "move it without rotation")
        shift = add_multiples(shift, (1.0, support.thing.imposed))
    return shift


def bonding_and_mirrors(case: Case, face: Face) -> tuple[bool, set[tuple[int, int]]]:
    """Return whether the opposite face is bonded, and the sides of the body that are symmetry planes.

    Each side is given by direction (0 to 2) and end (0 low, 1 high). Supports that only prevent rigid motion, such as
    points held in a plane through the axis, are ignored. Raises NotApplicable.
    """
    held, mirrors = set[int](), set[tuple[int, int]]()
    for support in case.named_supports:
        thing = at_full_size(support.thing)
        if not isinstance(thing, DisplacementSupport) or thing.moves:
            raise NotApplicable(f"the support `{support.name}` moves `{case.body.name}`", FAR)
        if face.selected_ends(thing.where) == {1 - face.end}:
            held |= set(thing.components)
            continue
        side = _symmetric_sides(face, thing)
        if side is None:
            raise NotApplicable(f"the support `{support.name}` holds points outside the far face", FAR)
        mirrors |= side
    way = {face.way} if isinstance(face.body, BoxBody) else set(range(3)) - set(face.across)
    if not way <= held:
        raise NotApplicable("its far face is not held along its normal", FAR)
    bonded = set(face.across) <= held
    if not bonded and held & set(face.across):
        raise NotApplicable("its far face is held in one of its tangential directions only", FAR)
    return bonded, mirrors


def _symmetric_sides(face: Face, thing: DisplacementSupport) -> set[tuple[int, int]] | None:
    """Return the sides that a support holds only along their normal, which makes them symmetry planes.

    Each side is given by direction and end. Returns None if the support holds anything else.
    """
    if len(thing.components) != 1 or isinstance(face.body, CylinderBody):
        on = isinstance(face.body, CylinderBody) and all(
            face.body.selects_axial_plane(thing.where, c) for c in thing.components
        )
        return set() if on else None
    (c,) = thing.components
    if c == face.way or c not in face.across:
        return None
    sides = face.body.selected_faces(thing.where, c)
    if len(sides) == 1:
        return {(c, sides.pop())}
    return None


def _body_fraction(case: Case, face: Face, at: Vector, mirrors: set[tuple[int, int]]) -> float:
    """Return the modelled fraction of the full body: one half for each symmetry plane.

    `at` is the point below the indenter, m. Raises NotApplicable if a symmetry plane does not contain its axis.
    """
    share, body = 1.0, face.body
    for way, end in mirrors:
        assert isinstance(body, BoxBody)
        if abs(at[way] - (body.high if end else body.low)[way]) > NEAR * case.shape.diagonal:
            raise NotApplicable("a plane of symmetry does not contain the axis of the indenter",
                          "put the axis in the plane")  # fmt: skip
        share *= 0.5
    return share


def _moves_along_face(case: Case, touch: RigidBodyContact, n: Vector) -> bool:
    """Return whether a rigid body moves along the face while it goes deeper.

    One oblique support may do both, or several supports with different amplitudes. `n` is the normal of the face.
    """
    for support in touch.moved:
        whole = at_full_size(support.thing).imposed
        down, size = abs(dot(whole, n)), math.hypot(*whole)
        if SAME * size < down < (1.0 - SAME) * size:
            return True
    if not isinstance(case.analysis, Quasistatic):
        return False
    analysis = case.analysis
    times = [t for t in analysis.moments if t <= analysis.now]
    for (a, dragged), (b, more) in pairwise([_depth_and_shift(touch.moved, n, t) for t in (0.0, *times)]):
        if more - dragged < -SAME * abs(dragged) or (more > dragged and abs(a - b) > SAME * abs(a)):
            return True
    return False


def _depth_and_shift(moving: Sequence[Declared], n: Vector, t: float) -> tuple[float, float]:
    """Return the displacement of a rigid body along the normal n, and its size along the face, m, at time t, s."""
    total = NONE
    for support in moving:
        full = at_full_size(support.thing)
        total = add_multiples(total, (1.0 if full.amplitude is None else full.amplitude.at(t), full.imposed))
    down = dot(total, n)
    return down, math.hypot(*add_multiples(total, (-down, n)))


# ------------------------------------------------------------------ results of the theories


@dataclass(frozen=True)
class RadialContactPressure:
    """Contact pressure of a theory on a flat face, as a function of the distance from the first contact point `at`, m.

    `normal` is the outward unit normal of the face.
    """

    theory: Any
    at: Vector
    normal: Vector
    flat: bool  # a body in plane strain, whose z is alike

    def pressures(self, X: Any) -> Any:
        """Return the pressures (n,), Pa, at material points X (n, 3), m, of the face."""
        import numpy as np

        off = X - np.array(self.at)
        across = off - np.outer(off @ np.array(self.normal), self.normal)
        return self.theory.pressure(np.linalg.norm(across[:, :2] if self.flat else across, axis=1))

    @property
    def at_nodes(self) -> Mapping[str, Any]:
        """Return an empty mapping, because a theory has no mesh."""
        return {}


# ------------------------------------------------------------------ setups


class ContactSetup(TheorySetup):
    """Base of the setups for theories of contact, which estimate the error of their forces."""

    estimates_force_error = True

    def warning(self, solution: Any) -> str | None:
        """Return which neglected effect makes the force of the theory inaccurate, and by how much; else None."""
        most = max(solution.relative_errors.items(), key=lambda one: abs(one[1]), default=("", 0.0))
        if not abs(most[1]) > SAID:
            return None
        return f"it neglects {NEGLECTED[most[0]]}: its force may be off by about {100.0 * most[1]:+.2g} %"

    def facts(self, solution: Any) -> Mapping[str, Any]:
        """Return contact area, contact force, errors of neglected effects and radii of a solution for the report."""
        found: dict[str, Any] = {
            "off": dict(solution.relative_errors),
            "area_m2": solution.area,
            "push_N": solution.push,
        }
        for name in ("radius", "stick_radius", "most"):
            if hasattr(solution, name):
                found[f"{name}_m"] = getattr(solution, name)
        return found


class RigidContactSetup(ContactSetup):
    """Base of the setups for theories of contact with one rigid body."""

    admits_rigid_contact = True

    def modelled_fraction(self, mirrors: set[tuple[int, int]]) -> float:
        """Return the fraction of the theory's body that the scene models; `mirrors` are its symmetry planes."""
        return 1.0

    def contact_point(self, face: Face, solution: Any) -> Vector:
        """Return the point, m, at which the resultant contact force acts."""
        return face.middle

    def forces(self, case: Case, solution: Any) -> EquilibriumForces:
        """Return the contact force and the support forces of a theory, for the part of the body that the scene models.

        Forces on symmetry planes are not known and are nan.
        """
        touch, face = contact_and_face(case)
        _, mirrors = bonding_and_mirrors(case, face)
        share = self.modelled_fraction(mirrors)
        n, at = face.normal, self.contact_point(face, solution)
        unknown = math.nan, math.nan, math.nan
        force = add_multiples(NONE, (-share * solution.push, n), (share, getattr(solution, "dragged", NONE)))
        acting = add_multiples(force, (share * getattr(solution, "load", 0.0), n))
        part = share < 1.0  # of what presses: it pushes beside its axis, on one side of the plane
        found = {touch.name: Reaction(force, unknown if part else cross(at, force), at, unknown if part else NONE)}
        far = add_multiples(face.middle, (-face.thickness, face.normal))
        alone = [s for s in case.named_supports if face.selected_ends(s.thing.where) == {1 - face.end}]
        for support in case.supports:
            if support not in alone:
                found[support.name] = Reaction(unknown, unknown, far, unknown)
                continue
            whole = len(alone) == 1
            x, y, z = (
                -f if whole and c in support.thing.components and (share == 1.0 or abs(n[c]) > 0.5) else
                (0.0 if c not in support.thing.components else math.nan)
                for c, f in enumerate(acting)
            )  # fmt: skip
            carried, full = (x, y, z), not mirrors and whole
            own = add_multiples(NONE, (-1.0, cross(add_multiples(at, (-1.0, far)), acting))) if full else unknown
            moment = add_multiples(own, (1.0, cross(far, carried))) if full else unknown
            found[support.name] = Reaction(carried, moment, far, own)
        work = {load.name: None for load in case.loads}
        there = (
            RadialContactPressure(solution, at, n, case.planar == "plane_strain")
            if hasattr(solution, "pressure")
            else None
        )
        touched = Touched(share * solution.area, solution.largest_pressure, solution.gap, field=there)
        return EquilibriumForces(found, work, math.nan, dissipated=share * getattr(solution, "dissipated", 0.0),
                      touches={touch.name: touched},
                      relative_error=sum(map(abs, solution.relative_errors.values())))  # fmt: skip


class IndentationSetup(RigidContactSetup):
    """Makes the problem of a rigid indenter in a half-space or a layer."""

    def problem_from(self, reference: Declared, case: Case) -> Indentation:
        touch, face = contact_and_face(case)
        for load in case.loads:
            raise NotApplicable(f"the theory does not include the load `{load.name}`", f"use {ONE}")
        n = face.normal
        tool = indenter_of(touch.rigid.name, touch.rigid.thing.shape, n, case.planar)
        shift = rigid_displacement(touch)
        gap = dot(add_multiples(tool.foot, (-1.0, face.middle)), n)
        first = add_multiples(tool.foot, (-gap, n))
        if not face.contains_projection_of(first):
            raise NotApplicable(
                f"`{touch.rigid.name}` would not touch the face, but move past its edge", "move it above the face"
            )
        if face.has_half_section_body and math.hypot(first[0], first[2]) > NEAR * case.shape.diagonal:
            raise NotApplicable(f"`{touch.rigid.name}` is not on the axis", "move it to the y axis")
        bonded, mirrors = bonding_and_mirrors(case, face)
        depth = -dot(shift, n) - gap
        slid = add_multiples(shift, (-dot(shift, n), n))
        if tool.reach < depth:
            raise NotApplicable(
                f"`{touch.rigid.name}` is pressed deeper than the length of its tip",
                "use a longer tip, or a smaller depth",
            )
        share = _body_fraction(case, face, first, mirrors)
        if share < 1.0 and math.hypot(*slid) > SAME * case.shape.diagonal:
            raise NotApplicable(f"`{touch.rigid.name}` is dragged off the plane of symmetry", "model the whole body")
        friction = float(touch.thing.friction)
        at = first if friction else add_multiples(first, (1.0, slid))
        if not touch.thing.where.holds(*at, case.shape.diagonal):
            raise NotApplicable(f"the `where` of `{touch.name}` excludes the place of contact", "select the whole face")
        material = case.material
        nu = float(material.poisson)
        problem = Indentation(
            tool.kind, tool.size, depth, 2.0 * float(material.shear_modulus) * (1.0 + nu), nu, at, n,
            Surroundings(face.thickness, face.width(at, mirrors), bonded), friction, slid, share,
            case.body.thing.thickness if case.planar == "plane_strain" else None, tool.edge,
            _moves_along_face(case, touch, n),
        )  # fmt: skip
        reference.thing.must_hold(problem)
        return problem

    def modelled_fraction(self, mirrors: set[tuple[int, int]]) -> float:
        return 0.5 ** len(mirrors)

    def contact_point(self, face: Face, solution: Any) -> Vector:
        at: Vector = solution.at
        return at
