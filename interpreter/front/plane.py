"""What cannot be in a scene with plane bodies: regions without a thickness, other models, forces out of the plane.

Whatever has no formulas for a plane problem is refused here, so that nothing is computed as if it had.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.metrics.frequency import Frequency
from softmark.interpreter.metrics.volume_change import VolumeChange
from softmark.interpreter.models.fem.words import Fem
from softmark.interpreter.problem.case import Case
from softmark.interpreter.vocabulary.loads import AtPoint, PerArea, PerLength, PerMass, Turning
from softmark.solvers.elements.quadrilaterals import PLANE

WHAT = {"plane_strain": "plane strain", "plane_stress": "plane stress"}
QUADS = ", ".join(f"`{name}`" for name in PLANE)


def shapes(scene: Scene) -> Iterator[Diagnostic]:
    """Plane regions that are no plane body's, and plane bodies of no plane region."""
    for body in scene.of_kind("body").values():
        if body.thing.planar and not body.thing.shape.flat:
            yield diagnostic("E542", body.at("region"), f"`{body.name}` is a slice of a plane region, and this is none",
                             "not a plane region",
                             "use `quadrilateral(...)` or `quarter_ring(...)`; a body in space is `solid`")  # fmt: skip
        elif body.thing.shape.flat and not body.thing.planar:
            yield diagnostic("E542", body.at("shape"), f"`{body.name}` has a plane region for its shape",
                             "no thickness",
                             "a slice of it is `plane_strain(..., thickness = 1 mm)` or `plane_stress`")  # fmt: skip


def acting(scene: Scene) -> Iterator[Diagnostic]:
    """Loads and supports that act across the plane of a plane body.

    Weight acts on all bodies of a scene: beside solids a plane body may lie level, and is held in its plane.
    """
    bodies = {name for name, body in scene.of_kind("body").items() if body.thing.planar}
    alone = 0 < len(bodies) == len(scene.of_kind("body"))
    for declared in (*scene.of_kind("load").values(), *scene.of_kind("support").values()):
        own = declared.value("body")
        flat = own in bodies or (own is None and alone and declared.kind == "load")
        if flat and declared.kind == "load" and isinstance(declared.thing.action, Turning):
            yield diagnostic("E544", declared.at(), f"`{declared.name}` is a moment, and a plane body takes forces",
                             "not for plane bodies", "turn an edge by `turned(..., axis = +z)`")  # fmt: skip
        elif flat and abs(_across(declared)) > 0.0:
            does = "moves" if declared.kind == "support" else "pulls"
            yield diagnostic("E544", declared.at(), f"`{declared.name}` {does} a plane body out of its plane",
                             "it has a component along z", "the plane is that of x and y: leave z out")  # fmt: skip


def _across(declared: Declared) -> float:
    """The component along z of what acts."""
    thing = declared.thing
    if declared.kind == "support":
        turned = math.hypot(*thing.rotation[:2])  # about an axis in the plane
        return turned or (float(thing.displacement[2]) if 2 in thing.components else 0.0)
    match thing.action:
        case PerMass(acceleration=vector) | PerArea(traction=vector) | AtPoint(force=vector) | PerLength(force=vector):
            return float(vector[2])
    return 0.0


def model(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """A model and a body that are not for each other."""
    thing = declared.thing
    plane = getattr(thing, "element", None) in PLANE
    if not case.planar:
        if isinstance(thing, Fem) and plane:
            yield diagnostic("E543", declared.at("element"), f"{thing.element} is an element of plane bodies, and "
                             f"`{case.body.name}` is a solid", "not for solids",
                             "use `hex8`, `hex20`, `hex27`, `tet4` or `tet10`, or declare the body as "
                             "`plane_strain(...)`")  # fmt: skip
        return
    kind, at = WHAT[case.planar], declared.at()
    if not isinstance(thing, Fem):
        yield diagnostic("E543", at, f"`{declared.name}` knows no {kind}", "not for plane bodies",
                         f"use `fem` with {QUADS}")  # fmt: skip
    elif not plane:
        yield diagnostic("E543", declared.at("element"), f"{thing.element} is no element of {kind}",
                         "for bodies in space", f"use {QUADS}")  # fmt: skip
    elif thing.mesh is not None or thing.quality is not None:
        field = "mesh" if thing.mesh is not None else "quality"
        yield diagnostic("E543", declared.at(field), f"`{declared.name}` has a `{field}`, and plane bodies have meshes "
                         "of their own alone", "not of plane bodies", "leave it out, and give a `size`")  # fmt: skip
    elif case.planar == "plane_stress":
        yield from _of_plates(thing, declared, case)


def _of_plates(thing: Fem, declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """What plane stress does without, and a solid whose thickness could not follow."""
    field = "integration" if thing.integration != "full" else "formulation"
    if thing.integration != "full" or thing.formulation != "displacement" or thing.rotation != "point":
        field = "rotation" if thing.rotation != "point" else field
        yield diagnostic("E545", declared.at(field), f"`{declared.name}` is in plane stress, where nothing locks and "
                         "every point finds its thickness by itself", f"not with {field}", "leave it out")  # fmt: skip
    elif thing.precision == "single":
        yield diagnostic("E545", declared.at("precision"), f"`{declared.name}` is in plane stress, whose thickness is "
                         "found in double precision", "not in single precision", "leave it out")  # fmt: skip
    if any(material.incompressible for material in case.materials):
        yield diagnostic("E545", case.body.at("material"), f"`{case.body.name}` is in plane stress, and its material "
                         "has no bulk modulus to find its thickness with", "a Poisson's ratio of 0.5",
                         "use one below it, such as 0.4999: in plane stress nothing locks")  # fmt: skip


def metrics(scene: Scene) -> Iterator[Diagnostic]:
    """What is not known of a slice: how it vibrates, and the volume of a plate whose thickness is not in its points."""
    for metric in scene.of_kind("metric").values():
        body = scene.declared.get(metric.thing.body_in(scene) or "")
        planar = "" if body is None else body.thing.planar
        if planar and isinstance(metric.thing, Frequency):
            yield diagnostic("E545", metric.at(), f"`{metric.name}` is of a plane body, of which frequencies are not "
                             "found", "not of a plane body",
                             "a slice has motions that vary through it as well: use a `solid`")  # fmt: skip
        if planar == "plane_stress" and isinstance(metric.thing, VolumeChange):
            yield diagnostic("E545", metric.at(), f"`{metric.name}` is of a body in plane stress, whose surface does "
                             "not show how thick it is", "not in plane stress",
                             "use `stretch(..., component = volume)`")  # fmt: skip
