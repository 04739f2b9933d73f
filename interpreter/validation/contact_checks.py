"""Checks of rigid bodies and contacts that use only the scene, before anything is built."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene, is_rigid
from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import is_force_driven, rigid_body_error
from softmark.interpreter.problem.out_of_plane_contact import missed_plane_error
from softmark.interpreter.problem.symmetry_planes import rigid_body_motion_error
from softmark.interpreter.validation.initial_overlap import check_initial_overlap
from softmark.interpreter.vocabulary.contact_words import RigidContactPair
from softmark.interpreter.vocabulary.loads.point_force import PointForce
from softmark.interpreter.vocabulary.loads.torque import Torque
from softmark.interpreter.vocabulary.supports.support import Support

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape, Vector3

ON_AXIS = 1e-9  # relative to its size: a rigid body closer to the axis rotates about it
PULLED = (
    "use gravity or `point_force(...)`: in a dynamic analysis the rigid body needs a `density` or a `mass` and also "
    "accepts `torque(...)`; in a static analysis exactly one direction must be free"
)
MOVED = (
    "support a rigid body as a whole, with `fixed(...)`, `displaced(...)` or `rotated(...)`; it acts on other "
    "bodies through a `contact`"
)


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield the errors about contacts and rigid bodies of a scene."""
    contacts = list(scene.of_kind("contact").values())
    between = [c for c in contacts if isinstance(c.thing, RigidContactPair)]
    for contact in between:
        yield from _check_bodies(scene, contact)
        yield from _check_symmetry(scene, contact)
    for contact in contacts:
        if not isinstance(contact.thing, RigidContactPair):
            yield from _check_deformable(scene, contact)
    yield from _check_duplicates(contacts)
    named = {c.thing.rigid for c in between}
    sure = bool(named) and all(is_rigid(scene.declared[name]) for name in named)  # otherwise the other may be meant
    for body in scene.of_kind("rigid").values():
        if sure and body.name not in named and scene.acting("support", body.name):
            yield diagnostic("W614", body.at(), f"no contact names the rigid body `{body.name}`, so it has no effect",
                             "no contact", f"add `contact touch = rigid_contact({body.name}, BODY)`, or remove the "
                                                  "body")  # fmt: skip
        yield from _check_rigid_body_actions(scene, body)
        yield from _check_supports(scene, body)


def _check_deformable(scene: Scene, contact: Declared) -> Iterator[Diagnostic]:
    """Check that a body with self-contact or tied parts is deformable."""
    body, kind = scene.declared[contact.thing.body], contact.constructor.name
    if is_rigid(body):
        yield diagnostic(
            "E652",
            contact.at("body"),
            f"`{kind}(...)` needs a deformable body, but `{body.name}` is rigid",
            "a rigid body",
            f"name the deformable body; for contact with the rigid one write `rigid_contact({body.name}, BODY)`",
        )


def _check_duplicates(contacts: list[Declared]) -> Iterator[Diagnostic]:
    """Yield errors of contacts that repeat an earlier contact.

    The two would share the contact force, and each would have a friction of its own.
    """
    for i, later in enumerate(contacts):
        for first in contacts[:i]:
            one = later.thing
            if _contact_key(one) == _contact_key(first.thing):
                between = isinstance(one, RigidContactPair)
                whose = f"between `{one.rigid}` and `{one.body}`" if between else f"of `{one.body}` with itself"
                yield diagnostic("E616", later.at(), f"`{later.name}` repeats `{first.name}`, the contact {whose}",
                                 "duplicate contact", "remove one of them, or give each its own part of the "
                                                           "surface: `where = x <= 0 mm`")  # fmt: skip


def _contact_key(thing: Any) -> tuple[Any, ...]:
    """Return the bodies and selections of a contact, which identify duplicates."""
    return type(thing), getattr(thing, "rigid", None), thing.body, thing.where


def _check_bodies(scene: Scene, contact: Declared) -> Iterator[Diagnostic]:
    """Check that a contact joins one rigid and one deformable body, and that these do not overlap."""
    first, second = (scene.declared[name] for name in (contact.thing.rigid, contact.thing.body))
    if not is_rigid(first):
        label = "the same body, which is not rigid" if first is second else "not rigid"
        if is_rigid(second):
            help = f"put the rigid body first: `rigid_contact({second.name}, {first.name})`"
        elif first is second:
            help = (
                f"name a rigid body, `body plate = rigid(...)`, or declare self-contact: `self_contact({first.name})`"
            )
        else:
            help = (
                f"declare an instrument, a plate or a floor as rigid, `body {first.name} = rigid(...)`, without "
                "a material; make two deformable bodies one, `solid(disjoint(...), ...)`, with `self_contact(...)`"
            )
        yield diagnostic("E652", contact.at("rigid"), "`rigid_contact(...)` needs a rigid body first, "
                         f"but `{first.name}` is deformable", label, help)  # fmt: skip
    elif is_rigid(second):
        problem = "`rigid_contact(...)` needs a deformable body second"
        what = "a rigid body and itself" if first is second else "two rigid bodies"
        yield diagnostic("E652", contact.at("body"), f"`{second.name}` is rigid, but {problem}", what,
                         "name a deformable body second: contact between rigid bodies is not computed")  # fmt: skip
    elif not first.thing.shape.fault and not second.thing.shape.fault:
        yield from _check_geometry(scene, contact, first, second)


def _check_symmetry(scene: Scene, contact: Declared) -> Iterator[Diagnostic]:
    """Check that symmetry planes of the deformable body are also symmetry planes of the rigid body's motion."""
    mirrors = [s for s in scene.acting("support", contact.thing.body) if s.thing.is_symmetry_plane]
    for mirror, way in product(mirrors, scene.acting("support", contact.thing.rigid)):
        if (fault := rigid_body_motion_error(mirror, scene.declared[contact.thing.rigid], way)) is not None:
            yield fault


def _check_geometry(scene: Scene, contact: Declared, first: Declared, second: Declared) -> Iterator[Diagnostic]:
    """Check that the rigid body has a signed distance, fits a plane body, and lies outside the deformable body.

    `first` and `second` are the bodies of the contact.
    """
    shape = first.thing.shape
    if not shape.has_signed_distance:
        yield diagnostic(
            "E653",
            first.at("shape"),
            f"contact with the shape of the rigid body `{first.name}` is not supported",
            "unsupported shape of a rigid body",
            "use a `half_space`, a whole `sphere`, `box`, `rounded_box`, `cylinder`, `tube`, `cone`, `punch`, "
            "`rounded_cone`, `extruded` or `tetrahedralized(...)`",
        )
        return
    if shape.prebuilt or shape.enclosed or shape.bounds is None:
        return  # its file is only read when needed
    low, high = shape.bounds
    x, y, z = (0.5 * (a + b) for a, b in zip(low, high, strict=True))
    off = (x * x + z * z) ** 0.5
    if second.thing.planar == "axisymmetric" and off > ON_AXIS * shape.diagonal:
        yield diagnostic("E654", first.at("shape"), f"`{first.name}` is not centred on the y axis, the axis of "
                                                    f"`{second.name}`: its centre is "
                                                    f"{units.format_value(off, units.LENGTH)} away", "off the axis",
                         "move it to the y axis, or use a `solid` as the deformable body")  # fmt: skip
    elif missed := missed_plane_error(first, second, low[2], high[2]):
        yield missed
    elif shape.contains((x, y, z)) and _is_inside(second.thing.shape, (x, y, z)):
        yield diagnostic(
            "E612",
            contact.at(),
            f"`{first.name}` starts inside `{second.name}`: its centre lies in the material",
            "inside from the start",
            "move it outside, where it may touch the surface, and "
            "press it in with a support: `displaced(..., by = "
            "...)`; declare an inclusion as a `region` with its "
            "own material",
        )
    elif not (second.thing.shape.prebuilt or second.thing.shape.enclosed):
        yield from check_initial_overlap(scene, contact, first, second)


def _is_inside(shape: Shape, point: Vector3) -> bool:
    """Return whether a point, m, is inside a shape and not on its surface; False if only a mesh could tell."""
    if shape.bounds is None or shape.prebuilt or shape.enclosed:
        return False
    low, high = shape.bounds
    return all(a < c < b for a, c, b in zip(low, point, high, strict=True)) and bool(shape.contains(point))


def _check_rigid_body_actions(scene: Scene, body: Declared) -> Iterator[Diagnostic]:
    """Check that supports hold whole rigid bodies, and refuse declarations that rigid bodies do not support."""
    for declared in scene.declared.values():
        thing = declared.thing
        if declared.kind in ("contact", "metric") or getattr(thing, "body", None) != body.name:
            continue
        if declared.kind == "load" and _is_load_of_rigid_body(scene, body, thing):
            if isinstance(thing, Torque) and thing.where is not EVERYWHERE:
                yield diagnostic("E656", declared.at("where"), f"a moment on the rigid body `{body.name}` acts on "
                                                               "all of it",
                                 "selects a part of a rigid body", "remove `where`")  # fmt: skip
        elif declared.kind != "support":
            named = f"name a deformable body: a rigid body has no {declared.kind}s"
            help = PULLED if declared.kind == "load" else named
            yield rigid_body_error(declared, body, help)
        elif not thing.on_rigid_bodies:
            yield diagnostic("E655", declared.at(), f"`{declared.name}` is not a support for rigid bodies such as "
                                                    f"`{body.name}`", "not for rigid bodies", MOVED)  # fmt: skip
        elif thing.where is not EVERYWHERE:
            yield diagnostic("E656", declared.at("where"), f"a support of the rigid body `{body.name}` acts on all "
                                                           "of it",
                             "selects a part of a rigid body", "remove `where`")  # fmt: skip


def _is_load_of_rigid_body(scene: Scene, body: Declared, load: Any) -> bool:
    """Return whether a rigid body accepts a load in this analysis."""
    at_rest = isinstance(load, PointForce) and is_force_driven(scene, body)
    return at_rest or (body.thing.free and isinstance(load, PointForce | Torque))


def _check_supports(scene: Scene, body: Declared) -> Iterator[Diagnostic]:
    """Check that supports of a rigid body are compatible: at most one rotation, and no motion of fixed components."""
    before: list[Declared] = []
    for support in scene.acting("support", body.name):
        if not support.thing.on_rigid_bodies:
            continue  # refused elsewhere
        if support.thing.prescribes_rotation and len(support.thing.components) < 3:
            problem = f"`{support.name}` rotates the rigid body `{body.name}` in some components only"
            label, help = "a rigid body rotates as a whole", "remove `components`"
            yield diagnostic("E657", support.at("components"), problem, label, help)
        for other in before:
            if (what := _find_conflict(other.thing, support.thing)) is not None:
                yield diagnostic(
                    "E657",
                    support.at(),
                    f"`{other.name}` and `{support.name}` both {what} `{body.name}`",
                    "conflicting supports",
                    "keep one of the two supports; a rotation may be combined with displacements, which follow it",
                )
        before.append(support)


def _find_conflict(one: Support, other: Support) -> str | None:
    """Return the conflict of two supports of a rigid body as a word, or None; displacements may be combined."""
    if one.prescribes_rotation and other.prescribes_rotation:
        return "rotate"
    still, moving = (other, one) if one.moves else (one, other)
    if still.moves or not moving.moves:
        return None
    conflicting = moving.prescribes_rotation or any(moving.imposed[i] for i in still.components)
    return "prescribe the motion of" if conflicting else None
