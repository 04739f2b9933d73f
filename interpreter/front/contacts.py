"""What rigid bodies and contacts may be: of a scene alone, before anything is built."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.conditions import EVERYWHERE
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared, Scene, rigid
from softmark.interpreter.vocabulary.contacts import Between
from softmark.interpreter.vocabulary.supports import Displaced, Fixed, Turned

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.contact.gaps.gap import Gap
else:
    from softmark.solvers.base.deferred import np

ON_AXIS = 1e-9  # of its size: a rigid body that is nearer to the axis turns about it
MOVED = "a rigid body is `fixed(...)`, `displaced(...)` or `turned(...)` as a whole, and a `contact` lets it act"


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Of contacts, and of what else is declared about rigid bodies."""
    for declared in scene.of_kind("contact").values():
        if isinstance(declared.thing, Between):
            yield from _between(scene, declared)
    for body in scene.of_kind("rigid").values():
        yield from _about(scene, body)


def _between(scene: Scene, contact: Declared) -> Iterator[Diagnostic]:
    """That it has one rigid body and one that deforms, and that there is a distance between them."""
    first, second = (scene.declared[name] for name in (contact.thing.rigid, contact.thing.body))
    if not rigid(first):
        what = "two rigid bodies" if rigid(second) else "itself" if first is second else "a body that deforms"
        if rigid(second):
            help = f"the rigid body comes first: `between({second.name}, {first.name})`"
        else:
            help = f"an instrument, a plate or a floor is rigid: `body {first.name} = rigid(...)`, without a material"
            help = "touch a rigid body: `body plate = rigid(...)`" if first is second else help
        yield diagnostic("E652", contact.at("rigid"), f"`{first.name}` deforms, and `between(...)` takes a rigid body "
                         "first", f"{what}, where a rigid one is due" if first is second else "not rigid",
                         help)  # fmt: skip
    elif rigid(second):
        problem = "`between(...)` takes a body that deforms second"
        what = "a rigid body and itself" if first is second else "two rigid bodies"
        yield diagnostic("E652", contact.at("body"), f"`{second.name}` is rigid, and {problem}", what,
                         "what presses is found by how a body deforms: rigid bodies do not meet")  # fmt: skip
    elif not first.thing.shape.fault and not second.thing.shape.fault:
        yield from _apart(contact, first, second)


def _apart(contact: Declared, first: Declared, second: Declared) -> Iterator[Diagnostic]:
    """That the rigid body has a gap function, that fits the plane, and that it is not inside the other."""
    from softmark.solvers.contact.gaps import gap_of
    from softmark.solvers.mesh.files.reading import UnreadableMesh

    try:
        gap = gap_of(first.thing.shape)
    except UnreadableMesh as unreadable:
        yield diagnostic("E653", first.at("shape"), f"`{first.name}` has no inside: {unreadable}", "no closed surface",
                         "a rigid body of a file is a closed surface of triangles")  # fmt: skip
        return
    if gap is None:
        yield diagnostic("E653", first.at("shape"), f"how far points are from `{first.name}` is not known of its shape",
                         "not a shape of rigid bodies", "take a `half_space`, a whole `sphere`, `box`, `rounded_box`, "
                         "`cylinder`, `tube`, `cone`, `punch`, `tip`, `extruded` or `filled(...)`")  # fmt: skip
        return
    if second.thing.planar == "axisymmetric" and (why := _beside(gap)):
        yield diagnostic("E654", first.at("shape"), f"`{first.name}` does not turn about the y axis, as `{second.name}`"
                         f" does: {why}", "beside the axis", "put it on the y axis, or press a `solid`")  # fmt: skip
    elif gap.centroid is not None and _inside(gap, second):
        yield diagnostic("E612", contact.at(), f"`{first.name}` is inside `{second.name}`: its middle is in the matter "
                         "of that", "inside from the start", "move it out, so that it touches at most, and let a "
                         "support bring it: `displaced(..., by = ...)`; an inclusion is a `region` with a material of "
                         "its own")  # fmt: skip


def _beside(gap: Gap) -> str:
    """Why a rigid body is none of revolution about the y axis; "" where nothing speaks against it."""
    if gap.centroid is None:
        return ""
    x, _, z = gap.centroid
    off = (x * x + z * z) ** 0.5
    size = abs(float(gap.gap(_row(gap.centroid))[0])) + off
    return f"its middle is {1e3 * off:.3g} mm from it" if off > ON_AXIS * size else ""


def _inside(gap: Gap, other: Declared) -> bool:
    """Whether the middle of a rigid body is in its own matter and in that of another."""
    assert gap.centroid is not None
    shape = other.thing.shape
    if shape.bounds is None or shape.prebuilt or not float(gap.gap(_row(gap.centroid))[0]) < 0.0:
        return False
    low, high = shape.bounds
    x, y, z = gap.centroid
    within = all(a < c < b for a, c, b in zip(low, (x, y, z), high, strict=True))
    return within and bool(shape.contains((x, y, z)))


def _row(point: tuple[float, float, float]) -> NDArray[np.float64]:
    """As an array (1, 3)."""
    return np.array([point])


def _about(scene: Scene, body: Declared) -> Iterator[Diagnostic]:
    """Supports of a part of a rigid body, and what it takes none of."""
    for declared in scene.declared.values():
        thing = declared.thing
        if declared.kind in ("contact", "metric") or getattr(thing, "body", None) != body.name:
            continue
        if declared.kind != "support":
            yield diagnostic("E655", declared.at("body"), f"`{declared.name}` is about `{body.name}`, which is rigid",
                             f"no {declared.kind} of a rigid body", MOVED)  # fmt: skip
        elif not isinstance(thing, Fixed | Displaced | Turned):
            yield diagnostic("E655", declared.at(), f"`{declared.name}` is no support of a rigid body such as "
                             f"`{body.name}`", "not of a rigid body", MOVED)  # fmt: skip
        elif thing.where is not EVERYWHERE:
            yield diagnostic("E656", declared.at("where"), f"`{body.name}` is rigid: a support has all of it",
                             "no part of a rigid body", "leave `where` out")  # fmt: skip
