"""Checks of plane bodies: regions without a thickness, unsupported models, and forces out of the plane.

Everything without formulas for plane bodies is refused here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.metrics.contact import ContactMetric
from softmark.interpreter.metrics.displacement import Displacement
from softmark.interpreter.metrics.force import Force
from softmark.interpreter.metrics.frequency import Frequency
from softmark.interpreter.metrics.max_error import MaxError
from softmark.interpreter.metrics.mean_error import MeanError
from softmark.interpreter.metrics.metric_base import DerivedMetric
from softmark.interpreter.metrics.pore_pressure import Outflow, PorePressure
from softmark.interpreter.metrics.relative_displacement_error import RelativeDisplacementError
from softmark.interpreter.metrics.strain_energy import StrainEnergy
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.metrics.tip_error import TipError
from softmark.interpreter.metrics.volume_change import VolumeChange
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.shared.option_limits import OptionLimits
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.contact_words import RigidContactPair
from softmark.interpreter.vocabulary.loads.load import Reason
from softmark.interpreter.vocabulary.probe_words import Line, Point
from softmark.solvers.elements.plane import PLANE
from softmark.solvers.mesh.plane_regions import NEAR
from softmark.solvers.mesh.shape import Shape

WHAT = {"plane_strain": "plane strain", "plane_stress": "plane stress", "axisymmetric": "axial symmetry"}
AT_POINTS = (
    Displacement,
    RelativeDisplacementError,
    MaxError,
    MeanError,
    TensorMetric,
    TipError,
)  # metrics that axisymmetric bodies have
QUADS = ", ".join(f"`{name}`" for name in PLANE)


def shapes(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of shapes that do not fit the kind of their body.

    These are a plane region as the shape of a solid, a plane body whose shape is no plane region, and an axisymmetric
    region on both sides of its axis.
    """
    for body in scene.of_kind("body").values():
        if body.thing.planar and not body.thing.shape.flat:
            yield diagnostic("E542", body.at("region"), f"`{body.name}` needs a plane region as its shape",
                             "not a plane region",
                             "use `quadrilateral(...)`, `quarter_ring(...)` or a `mesh(...)` of plane cells, or "
                             "declare a body in space as `solid`")  # fmt: skip
        elif body.thing.planar == "axisymmetric" and _crosses_axis(body.thing.shape):
            yield diagnostic("E322", body.at("region"), f"the region of `{body.name}` lies on both sides of its "
                                                        "axis, the y axis", "x below 0",
                             "give only the half with x >= 0: x is the distance from the axis")  # fmt: skip
        elif body.thing.shape.flat and not body.thing.planar:
            yield diagnostic("E542", body.at("shape"), f"the shape of `{body.name}` is a plane region",
                             "no thickness",
                             "declare a slice as `plane_strain(..., thickness = 1 mm)` or `plane_stress`")  # fmt: skip


def _crosses_axis(shape: Shape) -> bool:
    """Return whether a region of a body of revolution has points with x < 0."""
    return shape.bounds is not None and shape.bounds[0][0] < -NEAR * shape.diagonal


def check_conditions(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of conditions on z for plane bodies, whose points at all z are equivalent."""
    for declared in (d for kind in ("region", "support", "load") for d in scene.of_kind(kind).values()):
        body, condition = scene.declared.get(declared.value("body") or ""), declared.value("where")
        if body is not None and body.thing.planar and condition is not None and 2 in condition.axes:
            yield diagnostic("E321", declared.at("where"), f"`{declared.name}` selects by z, but the plane body "
                                                           f"`{body.name}` is the same for all z", "depends on z",
                             "select by x and y only, such as `x <= 0 mm`; declare a body that varies along z as "
                             "`solid`")  # fmt: skip


def check_actions(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of loads and supports normal to the plane of a plane body.

    Gravity along z is allowed if the scene also has solids: it acts on all bodies, and the plane body is held in its
    plane.
    """
    bodies = {name: body.thing.planar for name, body in scene.of_kind("body").items() if body.thing.planar}
    alone = 0 < len(bodies) == len(scene.of_kind("body"))
    for declared in (*scene.of_kind("load").values(), *scene.of_kind("support").values()):
        own = declared.value("body")
        flat = own in bodies or (own is None and alone and declared.kind == "load")
        if across := [*_check_axisymmetric_actions(scene, declared)]:
            yield from across
            continue
        revolved = own in bodies and bodies[own] == "axisymmetric"
        reason = _out_of_plane(declared, revolved) if flat else None
        if reason is not None:
            field, problem, label, help = reason
            yield diagnostic("E544", declared.at(field), f"`{declared.name}` {problem}", label, help)
        elif own in bodies and declared.kind == "load" and _is_off_plane_force(declared.thing.action):
            yield diagnostic("E544", declared.at("at"), f"`{declared.name}` acts outside the plane of `{own}`",
                             "z is not 0", "write z = 0: points of a plane body have z = 0")  # fmt: skip
    for contact in scene.of_kind("contact").values():
        if isinstance(contact.thing, RigidContactPair) and contact.thing.body in bodies:
            yield from _check_rigid_motion(scene, contact.thing.rigid, scene.declared[contact.thing.body])
    for analysis in scene.of_kind("analysis").values() if bodies else ():
        for field in _out_of_plane_motions(analysis.thing, alone):
            yield diagnostic("E544", analysis.at(field), f"the initial `{field}` moves plane bodies out of their "
                                                         "plane", "not within the plane",
                             "give a velocity along x and y, and a spin about z")  # fmt: skip


def _check_rigid_motion(scene: Scene, rigid: str, body: Declared) -> Iterator[Diagnostic]:
    """Yield errors of supports that move a rigid body out of the plane, or off the axis, of the body it contacts."""
    around = body.thing.planar == "axisymmetric"
    for support in scene.acting("support", rigid):
        thing = support.thing
        if not thing.on_rigid_bodies:
            continue  # refused elsewhere
        x, _, z = thing.imposed
        if around and (x or z or thing.rotates):
            yield diagnostic(
                "E323",
                support.at(),
                f"`{support.name}` moves `{rigid}` off the axis of `{body.name}`, or rotates it",
                "not along y",
                "move it along y only; use a `solid` for shear and torsion",
            )
        elif not around and (z or any(thing.rotation[:2])):
            yield diagnostic(
                "E544",
                support.at(),
                f"`{support.name}` moves `{rigid}` out of the plane of `{body.name}`, with which it is in contact",
                "it has a component along z",
                "remove the z component, and rotate about z only: the body lies in the x-y plane",
            )


def _check_axisymmetric_actions(scene: Scene, declared: Declared) -> Iterator[Diagnostic]:
    """Yield errors of gravity across the axis of revolution, symmetry planes not normal to it, and rotated parts."""
    turned = [body.name for body in scene.of_kind("body").values() if body.thing.planar == "axisymmetric"]
    own = declared.value("body") or (turned[0] if turned and declared.kind == "load" else None)
    acting = declared.thing.action if declared.kind == "load" else declared.thing
    if own in turned and (reason := acting.axial_fault(own)) is not None:
        field, problem, label, help = reason
        yield diagnostic("E323", declared.at(field), f"`{declared.name}` {problem}", label, help)


def _is_off_plane_force(action: Any) -> bool:
    """Return whether an action is a force at a point outside the plane."""
    return len(action.points) == 1 and action.points[0][1][2] != 0.0


def _out_of_plane_motions(analysis: Any, alone: bool) -> Iterator[str]:
    """Yield the names of initial motions that leave the plane.

    A velocity along z counts only with `alone`, if all bodies are plane.
    """
    if not isinstance(analysis, Dynamic):
        return
    if alone and analysis.velocity[2]:
        yield "velocity"
    if any(analysis.spin[:2]):
        yield "spin"


def _out_of_plane(declared: Declared, revolved: bool) -> Reason | None:
    """Return the reason why a load or a support of a plane body is refused, or None."""
    thing = declared.thing
    fault: Reason | None = thing.action.plane_fault(revolved) if declared.kind == "load" else thing.plane_fault()
    return fault


def model(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors of a model that does not fit a plane body, or of a plane model of a solid."""
    thing = declared.thing
    plane = getattr(thing, "element", None) in PLANE
    if not case.planar:
        if isinstance(thing, Fem) and plane:
            yield diagnostic("E543", declared.at("element"), f"{thing.element} is an element of plane bodies, but "
                                                             f"`{case.body.name}` is a solid", "not for solids",
                             "use `hex8`, `hex20`, `hex27`, `tet4` or `tet10`, or declare the body as "
                             "`plane_strain(...)`")  # fmt: skip
        return
    kind, at = WHAT[case.planar], declared.at()
    if not isinstance(thing, Fem):
        yield diagnostic("E543", at, f"`{declared.name}` does not support {kind}", "not for plane bodies",
                         f"use `fem` with {QUADS}")  # fmt: skip
    elif not plane:
        yield diagnostic("E543", declared.at("element"), f"{thing.element} is not an element for {kind}",
                         "an element of solids", f"use {QUADS}")  # fmt: skip
    elif thing.mesh is not None or thing.quality is not None:
        field = "mesh" if thing.mesh is not None else "quality"
        yield diagnostic(
            "E543",
            declared.at(field),
            f"`{declared.name}` has a `{field}`, but the mesh of a plane body is always generated",
            "not for plane bodies",
            "leave it out, and give a `size`",
        )
    elif (lines := [load for load in case.loads if load.thing.action.length is not None]) and not case.depth:
        yield diagnostic(
            "E543",
            lines[0].at(),
            f"`{lines[0].name}` acts along a line, but `{case.body.name}` is in {kind}",
            "not for plane bodies",
            "use `point_force(...)`, which is spread along z, or a `traction` on an edge",
        )
    elif case.planar == "plane_stress":
        yield from _check_plane_stress_model(thing, declared, case)
    elif case.depth:
        yield from _check_axisymmetric_model(declared, case)


AXISYMMETRIC_OPTIONS = OptionLimits(
    {"rotation": ("point",), "precision": ("double",), "mass": ("consistent",), "initial_guess": (None,)},
    code="E322",
    message="`{model}` models a body of revolution, which does not support this `{option}`",
    label="not for axisymmetric bodies",
)


def _check_axisymmetric_model(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors of options and dynamic analyses that axisymmetric models do not support."""
    yield from AXISYMMETRIC_OPTIONS.excluded_value_errors(declared, case)
    if isinstance(case.analysis, Dynamic) or case.analysis.disturbed != "none" or case.analysis.path != "load":
        yield diagnostic("E322", declared.at(), f"`{declared.name}` models a body of revolution, which supports only "
                                                "static analyses that start at rest", "not for axisymmetric bodies",
                         "use `static()`, or a `solid`")  # fmt: skip


def _check_plane_stress_model(thing: Fem, declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors of options that plane stress does not support, and of materials with unknown change of thickness."""
    field = "integration" if thing.integration != "full" else "formulation"
    if thing.integration != "full" or thing.formulation != "displacement" or thing.rotation != "point":
        field = "rotation" if thing.rotation != "point" else field
        yield diagnostic(
            "E545",
            declared.at(field),
            f"`{declared.name}` is in plane stress, which does not lock and computes the thickness at each point",
            f"not with {field}",
            "leave it out",
        )
    elif thing.precision == "single":
        yield diagnostic(
            "E545",
            declared.at("precision"),
            f"`{declared.name}` is in plane stress, whose thickness needs double precision",
            "not in single precision",
            "leave it out",
        )
    if any(material.incompressible for material in case.typical):
        yield diagnostic(
            "E545",
            case.body.at("material"),
            f"`{case.body.name}` is in plane stress, but its material has no bulk modulus to compute the thickness",
            "a Poisson's ratio of 0.5",
            "use a smaller Poisson's ratio, such as 0.4999: plane stress does not lock",
        )


def _reason_without_value(metric: Declared, scene: Scene) -> str:
    """Return why a metric has no value for an axisymmetric body; "" if it has one."""
    thing = metric.thing
    if isinstance(thing, Force):
        return "" if not (thing.direction[0] or thing.direction[2]) else "because forces across the axis cancel"
    if isinstance(thing, StrainEnergy | PorePressure | Outflow | ContactMetric):
        return ""
    if isinstance(thing, DerivedMetric):  # known if the metric `of` is
        return _reason_without_value(scene.declared[thing.of], scene)
    probe = scene.declared.get(thing.probe_name or "")
    if isinstance(thing, AT_POINTS) and probe is not None:
        seen = isinstance(probe.thing, Point | Line)
        return "" if seen else "which is probed only at points and along lines"
    return "which does not support this metric"


def metrics(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of metrics without a value for plane bodies.

    These are frequencies, and the volume of a plate whose thickness varies.
    """
    for metric in scene.of_kind("metric").values():
        body = scene.declared.get(metric.thing.body_in(scene) or "")
        planar = "" if body is None else body.thing.planar
        if planar == "axisymmetric" and (why := _reason_without_value(metric, scene)):
            yield diagnostic(
                "E323",
                metric.at(),
                f"`{metric.name}` does not apply to a body of revolution, {why}",
                "not for axisymmetric bodies",
                "use displacements and their errors, stress, strain or "
                "stretch at points and along lines, strain_energy, force "
                "along y, contacts, or pore_pressure and outflow of a fluid",
            )
            continue
        if planar and isinstance(metric.thing, Frequency):
            yield diagnostic("E545", metric.at(), f"`{metric.name}` needs frequencies, which are not computed for "
                                                  "plane bodies", "not for plane bodies",
                             "use a `solid`: a slice also has modes that vary through its thickness")  # fmt: skip
        if planar == "plane_stress" and isinstance(metric.thing, VolumeChange):
            yield diagnostic("E545", metric.at(), f"`{metric.name}` cannot be measured in plane stress: the surface "
                                                  "does not show the thickness", "not in plane stress",
                             "use `stretch(..., component = volume)`")  # fmt: skip
