"""Checks of free rigid bodies that use only the scene, before anything is built."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene, is_rigid
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import case_of, free_directions, is_force_driven
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.contact_words import RigidContactPair
from softmark.interpreter.vocabulary.loads.body_force import BodyForce, Gravity
from softmark.interpreter.vocabulary.loads.point_force import PointForce
from softmark.interpreter.vocabulary.loads.torque import Torque

Reason = tuple[Any, str, str, str]  # place, what, label, help


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield the first error of every rigid body that has a mass or a force."""
    for body in scene.of_kind("rigid").values():
        for at, what, label, help in _reasons(scene, body):
            yield diagnostic("E658", at, what, label, help)
            break


def _reasons(scene: Scene, body: Declared) -> Iterator[Reason]:
    """Yield the reasons why one free rigid body is refused."""
    thing, name = body.thing, body.name
    if is_force_driven(scene, body):
        yield from _check_static(scene, body)
        return
    if not thing.free:
        if field := _initial_motion_field(thing):
            yield (
                body.at(field),
                f"`{name}` has a {field} but no mass",
                "no inertia",
                "give it a `density`, or move it with a support: `displaced(...)`",
            )
        return
    yield from _check_mass(body)
    if not thing.shape.has_mass_properties:
        yield (
            body.at("shape"),
            f"the moments of inertia of `{name}` cannot be computed from its shape",
            "not for a free body",
            "use a `sphere`, `box`, `cylinder`, `tube`, `cone`, `revolved(...)` or `tetrahedralized(...)`",
        )
    for support in scene.acting("support", name)[:1]:
        yield (
            support.at(),
            f"`{support.name}` prescribes the motion of `{name}`, which is free because it has a mass",
            "free and supported",
            "remove its mass: a rigid body moved by a support has no weight",
        )
    yield from _check_dynamic(scene, body)
    yield from _check_contacts(scene, body)


def _initial_motion_field(thing: Any) -> str:
    """Return the field that gives a rigid body an initial motion; "" if there is none."""
    return "velocity" if any(thing.velocity) else "spin" if any(thing.spin) else ""


def _check_mass(body: Declared) -> Iterator[Reason]:
    """Refuse a rigid body with both a density and a mass."""
    if body.thing.density is not None and body.thing.mass is not None:
        yield (
            body.at("mass"),
            f"`{body.name}` has both a density and a mass",
            "both are given",
            "keep one of them: the other follows",
        )


def _check_dynamic(scene: Scene, body: Declared) -> Iterator[Reason]:
    """Check a free rigid body in a dynamic analysis, in which load moments are taken at the ends of time steps."""
    analysis = next(iter(scene.of_kind("analysis").values()), None)
    if analysis is None or not isinstance(analysis.thing, Dynamic):
        yield (
            body.at("mass" if body.thing.mass is not None else "density"),
            f"the free rigid body `{body.name}` needs a static or a dynamic analysis",
            "free rigid body",
            "move it with a support, `displaced(...)`, without a mass, or use `static(...)` or `dynamic(...)`",
        )
    elif analysis.thing.integrator == "midpoint":
        yield (
            analysis.at("integrator"),
            f"`midpoint` balances moments at mid-step, but contact forces of `{body.name}` act at the end of a step",
            "not with a free body",
            "use `trapezoidal`, which also conserves energy",
        )


def _check_static(scene: Scene, body: Declared) -> Iterator[Reason]:
    """Check a free rigid body in a static analysis.

    It must have no initial motion, no torque and no support that rotates it. It must be free to move along one
    direction only, and touch one body.
    """
    thing, name = body.thing, body.name
    if field := _initial_motion_field(thing):
        yield (
            body.at(field),
            f"`{name}` has a {field} in a static analysis",
            "static analysis",
            "leave it out, or use `dynamic(...)`",
        )
    yield from _check_mass(body)
    for load in scene.acting("load", name):
        if isinstance(load.thing, Torque):
            yield (
                load.at(),
                f"`{load.name}` would rotate `{name}`, which moves along one direction only in a static analysis",
                "its supports take the moment",
                "leave it out; in a dynamic analysis the body rotates",
            )
    for support in scene.acting("support", name):
        if support.thing.prescribes_rotation:
            yield (
                support.at(),
                f"`{support.name}` rotates `{name}`, which is driven by loads",
                "driven by loads and by a support",
                "remove its mass and its loads and prescribe its whole motion by supports, or remove the rotation",
            )
    met = [
        c for c in scene.of_kind("contact").values() if isinstance(c.thing, RigidContactPair) and c.thing.rigid == name
    ]
    if met and not is_rigid(other := scene.declared[met[0].thing.body]):
        yield from _check_free_direction(scene, body, other)
    yield from _check_contacts(scene, body)


def _check_free_direction(scene: Scene, body: Declared, other: Declared) -> Iterator[Reason]:
    """Check that one direction is free, that the weight is known, and that no other rigid body is force-driven."""
    name, left = body.name, free_directions(scene, body, other)
    loads = [load for load in scene.acting("load", name) if isinstance(load.thing, Gravity | PointForce)]
    if not left:
        yield (
            body.at(),
            f"`{name}` is driven by loads, but its supports leave no direction free",
            "one free direction is needed",
            "remove the direction of its motion from the `components` of its supports",
        )
    elif len(left) > 1:
        pressed = [i for i in left if any(_has_component(load.thing.action, i) for load in loads)]
        held = ["xyz"[i] for i in left if i != (pressed or left)[-1]]
        hold = held[0] if len(held) == 1 else f"({', '.join(held)})"
        ways = f"{', '.join('xyz'[i] for i in left[:-1])} and {'xyz'[left[-1]]}"
        yield (
            body.at(),
            f"`{name}` is driven by loads but is free along {ways}, and free to rotate",
            "one free direction is needed",
            f"fix the other directions, which also prevents rotation: `fixed({name}, components = {hold})`",
        )
    weighed = any(isinstance(load.thing.action, BodyForce) for load in loads)
    if len(left) == 1 and not any(_has_component(load.thing.action, left[0]) for load in loads):
        way = "xyz"[left[0]]
        yield (
            body.at(),
            f"no load acts on `{name}` along {way}, its free direction",
            "no load",
            f"give gravity or a `point_force({name}, ...)` a component along {way}, or move it with a support",
        )
    if weighed and body.thing.density is not None:
        if other.thing.planar in ("plane_strain", "plane_stress"):
            yield (
                body.at("density"),
                f"the weight of `{name}` on the slice is unknown: a density gives the weight of the whole body",
                "whole body or slice?",
                "give the mass that acts on the slice: `mass = 4 g`",
            )
        elif not body.thing.shape.has_mass_properties:
            yield (
                body.at("shape"),
                f"the weight of `{name}` cannot be computed from its shape",
                "no volume",
                "give its `mass`",
            )
    for one in scene.of_kind("contact").values():
        second = scene.declared[one.thing.rigid] if isinstance(one.thing, RigidContactPair) else body
        if second.name != name and one.thing.body == other.name and is_rigid(second) and is_force_driven(scene, second):
            yield (
                body.at(),
                f"`{name}` and `{second.name}` are both driven by loads",
                "only one is allowed",
                "remove the mass and the loads of one body and fix this body: it then carries the force of the other",
            )
            return


def _has_component(action: Any, along: int) -> bool:
    """Return whether a load has a component along a direction, x, y or z by number."""
    return bool((action.acceleration if isinstance(action, BodyForce) else action.force)[along])


def _check_contacts(scene: Scene, body: Declared) -> Iterator[Reason]:
    """Check that a free rigid body contacts exactly one body, which in dynamics must be a solid."""
    known = (c for c in scene.of_kind("contact").values() if isinstance(c.thing, RigidContactPair))
    contacts = [c for c in known if c.thing.rigid == body.name]
    if not contacts:
        yield (
            body.at(),
            f"the free rigid body `{body.name}` has no contact",
            "no contact",
            "add `contact NAME = rigid_contact(...)`",
        )
        return
    first = contacts[0].thing.body
    if is_rigid(scene.declared[first]):
        return  # reported for the contact
    case = case_of(scene, first)
    for contact in contacts:
        if contact.thing.body != first:
            yield (
                contact.at("body"),
                (
                    f"the free rigid body `{body.name}` touches `{first}` and `{contact.thing.body}`, which are solved "
                    "separately"
                ),
                "more than one body",
                "make them one body: `disjoint(...)`",
            )
    for support in (s for s in case.supports if s.thing.is_symmetry_plane):
        yield (
            support.at(),
            (
                f"`{support.name}` is a plane of symmetry of `{first}`, but the free rigid body `{body.name}` touches "
                "the other half too"
            ),
            "not with a free body",
            "model the whole body",
        )
    if case.planar and not is_force_driven(scene, body):
        yield (
            body.at(),
            f"the free rigid body `{body.name}` cannot touch the plane body `{first}`",
            "touches a plane body",
            "use a `solid`",
        )
    elif case.has_material_history:
        yield (
            body.at(),
            f"the free rigid body `{body.name}` cannot touch `{first}`, which is viscoelastic or poroelastic",
            "not with a free body",
            "use a material without viscoelasticity or pore fluid",
        )
