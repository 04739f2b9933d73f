"""Checks that a reference has the data that a metric, a probe or a support needs.

A theory and a model are displacement fields, known at every point. A measured surface gives the deformed shape, but not
the motion of material points. Tracked points give the displacement of those points only. Some theories give only
forces.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.energy_norm_error import EnergyNormError
from softmark.interpreter.metrics.frequency import Frequency
from softmark.interpreter.metrics.hausdorff import Hausdorff
from softmark.interpreter.metrics.max_error import MaxError
from softmark.interpreter.metrics.mean_error import MeanError
from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.metrics.period import Period
from softmark.interpreter.metrics.relative_displacement_error import RelativeDisplacementError
from softmark.interpreter.metrics.stress import AXES, Stress
from softmark.interpreter.metrics.surface_distance import SurfaceDistance
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.metrics.tip_error import TipError
from softmark.interpreter.metrics.trajectory_error import TrajectoryError
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.metrics.volume_change import VolumeChange
from softmark.interpreter.problem.body_case import Fault, case_for
from softmark.interpreter.problem.theories import theory_setup_of
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.probe_words import Markers, Surface, Volume
from softmark.records import dataclass
from softmark.references.measured_curve import CurveFromFile
from softmark.references.published_values import GivenValues
from softmark.references.tracked_points import TrackedPoints

Known = Literal["field", "forces", "surface", "points", "curve", "value"]

KNOWN = {
    "field": "a field of displacements", "surface": "a measured surface", "points": "tracked points",
    "forces": "a theory of forces only", "curve": "a measured curve", "value": "a given value",
}  # fmt: skip
POINTWISE = (RelativeDisplacementError, TipError, MaxError, MeanError)  # errors of material points


@dataclass(frozen=True)
class _Refusal:
    """Reason why a metric has no value: field, message, label and remedy."""

    field: str
    message: str
    label: str
    help: str


def data_kind_of(reference: Declared) -> Known:
    """Return the kind of data of a reference, or of a model used as a reference."""
    if isinstance(reference.thing, TrackedPoints):
        return "points"
    if isinstance(reference.thing, CurveFromFile):
        return "curve"
    if isinstance(reference.thing, GivenValues):
        return "value"
    if reference.kind == "reference" and not reference.thing.with_displacements:
        return "forces"
    return "surface" if reference.kind == "reference" and reference.thing.how in ("measured", "scanned") else "field"


def check_comparisons(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of metrics that cannot be evaluated.

    Also yield errors of probes and supports that follow tracked points if their reference has none.
    """
    for declared in (*scene.of_kind("probe").values(), *scene.of_kind("support").values()):
        yield from _check_tracked_points(scene, declared)
    for metric in scene.of_kind("metric").values():
        refusal = (
            _probe_refusal(scene, metric)
            or _time_refusal(scene, metric)
            or _reference_data_refusal(scene, metric)
            or _unavailable_stress_refusal(scene, metric)
        )
        if refusal is not None:
            yield diagnostic("E509", metric.at(refusal.field), refusal.message, refusal.label, refusal.help)


def _check_tracked_points(scene: Scene, declared: Declared) -> Iterator[Diagnostic]:
    """Check that probes of markers, and supports that follow markers, have a reference of tracked points."""
    of = declared.thing.tracked
    if of is None or data_kind_of(scene.declared[of]) == "points":
        return
    known, at = data_kind_of(scene.declared[of]), declared.at("of")
    does = "needs" if declared.kind == "probe" else "follows"
    else_ = "; for a surface, use `surface(...)`" if declared.kind == "probe" else ""
    yield diagnostic("E509", at, f"`{declared.name}` {does} tracked points, but `{of}` has none",
                     KNOWN[known], f'name tracked points, `markers("beads.csv", ...)`{else_}')  # fmt: skip


# ------------------------------------------------------------------ the probe and the analysis


def _probe_refusal(scene: Scene, metric: Declared) -> _Refusal | None:
    """Return the refusal of a surface metric without a surface probe, or a strain metric without a volume probe."""
    name = metric.thing.probe_name
    if name is None:
        return None
    probe, word = scene.declared[name], metric.constructor.name
    found = f"`{name}` is a `{probe.constructor.name}` probe"
    body = probe.thing.body
    if isinstance(metric.thing, EnergyNormError) and not isinstance(probe.thing, Volume):
        return _Refusal("probe", f"`{word}` integrates over the body, but {found}", "no volume",
                        f"use a volume probe: `probe inside = volume({body})`")  # fmt: skip
    if _needs_surface(scene, metric) and not isinstance(probe.thing, Surface):
        return _Refusal("probe", f"`{metric.name}` needs triangles of a surface, but {found}", "no surface",
                        f"use a surface probe: `probe skin = surface({body})`"
                        + _nearest_projection_hint(metric))  # fmt: skip
    if isinstance(metric.thing, TrajectoryError) and isinstance(probe.thing, Surface):
        return _Refusal("probe", f"`{word}` follows points in time, but {found}", "no time history",
                        f"use a point probe: `probe tip = point({body}, at = ...)`")  # fmt: skip
    return None


def _needs_surface(scene: Scene, metric: Declared) -> bool:
    thing = metric.thing
    if not isinstance(thing, SurfaceDistance):
        return isinstance(thing, Hausdorff | VolumeChange)
    against = scene.declared[thing.against]
    moved = against.kind == "reference" and against.thing.registered == "icp"  # onto the triangles of the probe
    return thing.along == "normal" or moved or data_kind_of(against) == "field"


def _nearest_projection_hint(metric: Declared) -> str:
    normal = isinstance(metric.thing, SurfaceDistance) and metric.thing.along == "normal"
    return ", or use `along = nearest`" if normal else ""


def _unavailable_stress_refusal(scene: Scene, metric: Declared) -> _Refusal | None:
    """Return the refusal of a stress or strain metric that no model or reference can evaluate, or None.

    The reason is that no model of the scene has stress, that the reference has none, or that the stress measure does
    not
    have the component.
    """
    thing = metric.thing
    if not isinstance(thing, TensorMetric):
        return None
    if isinstance(thing, Stress) and thing.measure_ == "nominal" and thing.component not in AXES:
        return _Refusal("component", f"nominal stress is not symmetric and has no `{thing.component}`",
                        "only of `cauchy`", "use one of " + ", ".join(f"`{a}`" for a in AXES)
                        + ", or `measure = cauchy`")  # fmt: skip
    bodies = (None, scene.declared[thing.probe].thing.body)
    models = [m for m in scene.of_kind("model").values() if m.value("body") in bodies]
    laws = [_full_model(scene, m).thing.stress_law for m in models]
    past = [
        "" if isinstance(law, str) else _history_dependent_body(scene, m) for law, m in zip(laws, models, strict=True)
    ]
    if any(past) and all(why or isinstance(law, str) for why, law in zip(past, laws, strict=True)):
        whose = next(why for why in past if why)
        message = f"`{metric.name}` needs stress or strain at points, which is not computed for {whose}"
        help = "use `force(...)`, `displacement(...)`, or `pore_pressure(...)` of a fluid"
        return _Refusal("", message, "not available here", help)
    if not laws or not all(isinstance(law, str) for law in laws):
        return _reference_stress_refusal(scene, metric)
    return _Refusal("", f"`{metric.name}` needs stress or strain, which no model of the scene has: {laws[0]}",
                    "no model has stress",
                    "add one: `model solid = fem(tet10, strain = finite, size = 5 mm)`")  # fmt: skip


def _history_dependent_body(scene: Scene, model: Declared) -> str:
    """Return "porous" or "viscoelastic" for a body whose stress is not known at points; "" for others."""
    try:
        case = case_for(scene, _full_model(scene, model))
    except Fault:  # reported elsewhere
        return ""
    if case.porous:
        return f"`{case.body.name}`, a porous body"
    return f"`{case.body.name}`, a viscoelastic body" if case.has_material_history else ""


def _reference_stress_refusal(scene: Scene, metric: Declared) -> _Refusal | None:
    """Return the refusal of a stress metric whose reference model has no stress, or None."""
    if (name := metric.thing.against) is None:
        return None
    if (right := scene.declared[name]).kind == "reference":
        if theory_setup_of(right).gives_stress:
            return None
        return _Refusal("against", f"`{metric.name}` compares stress or strain, but `{name}` has none",
                        "no stress", "compare with a model, or with a theory that has stress: `goodier(...)`, "
                                        "`kirsch(...)`")  # fmt: skip
    law = _full_model(scene, scene.declared[name]).thing.stress_law
    if not isinstance(law, str):
        return None
    return _Refusal("against", f"`{metric.name}` compares stress or strain, but `{name}` has none: {law}",
                    "no stress", "compare with a finite element model: `against = solid`")  # fmt: skip


def _full_model(scene: Scene, model: Declared) -> Declared:
    """Return the model itself, or the full model from which a reduced one is derived."""
    return model if model.thing.reduces is None else scene.declared[model.thing.reduces]


def _time_refusal(scene: Scene, metric: Declared) -> _Refusal | None:
    """Return the refusal of a metric that does not fit the kind of analysis, or None.

    It is a metric over time without a dynamic analysis, a frequency with one, or a frequency under a load that permits
    none.
    """
    moving = any(isinstance(analysis.thing, Dynamic) for analysis in scene.of_kind("analysis").values())
    if moving and isinstance(metric.thing, Frequency):
        help = "remove the analysis, or measure the motion: `metric swing = period(tip, along = -z)`"
        return _Refusal(
            "", f"`{metric.name}` needs an equilibrium, but the analysis is dynamic", "no equilibrium", help
        )
    if isinstance(metric.thing, Frequency):
        turning = (load for load in scene.acting("load", metric.thing.body) if load.thing.action.in_dynamics)
        if (load := next(turning, None)) is not None:
            return _Refusal(
                "", f"`{metric.name}` cannot be computed under the load `{load.name}`", load.thing.action.in_dynamics,
                "remove the load, or the metric",
            )  # fmt: skip
    if moving or not isinstance(metric.thing, Period | TrajectoryError):
        return None
    return _Refusal("", f"`{metric.name}` needs a motion, but the analysis is static", "nothing moves in time",
                    "add one: `analysis fall = dynamic(duration = 1 s, step = 10 ms)`")  # fmt: skip


# ------------------------------------------------------------------ the reference


def _gives_forces(right: Declared) -> bool:
    """Return whether a model or reference gives forces."""
    return right.kind == "model" or theory_setup_of(right).gives_forces


def _reference_data_refusal(scene: Scene, metric: Declared) -> _Refusal | None:
    """Return the refusal of a metric whose reference lacks the data that it needs, or None."""
    name = metric.thing.measured_from
    if name is None:
        return None
    reference, word = scene.declared[name], metric.constructor.name
    known = data_kind_of(reference)
    if isinstance(metric.thing, ErrorOfValue) is not (known == "value"):
        return _value_metric_refusal(metric, name, known)
    if isinstance(metric.thing, ForceMetric) and not _gives_forces(reference):
        return _Refusal("against", f"`{word}` compares forces or energies, but `{name}` has none", "no forces",
                        "compare with a model, or with a theory that has them: `torsion(...)`")  # fmt: skip
    if known == "forces" and not isinstance(metric.thing, ForceMetric | CurveMetric):
        return _Refusal("against", f"`{word}` cannot be computed from `{name}`, which is {KNOWN[known]}", KNOWN[known],
                        "compare `force(...)` with it")  # fmt: skip
    if isinstance(metric.thing, TrajectoryError) and reference.kind != "model":
        return _Refusal("against", f"`{word}` compares motions, but `{name}` has none", "no time history",
                        "compare with a model of this scene")  # fmt: skip
    if isinstance(metric.thing, CurveMetric) is not (known == "curve"):
        return _curve_metric_refusal(metric, name, known)
    if isinstance(metric.thing, Hausdorff | SurfaceDistance) and known == "points":
        return _Refusal("against", f"`{word}` needs a surface, but `{name}` has tracked points only", "no surface",
                        "compare points one by one: `mean_error(...)` or `max_error(...)`")  # fmt: skip
    if isinstance(metric.thing, EnergyNormError) and known != "field":
        return _Refusal("against", f"`{word}` needs strains, but `{name}` is {KNOWN[known]}", "no strains",
                        "compare with a theory or with another model")  # fmt: skip
    if isinstance(metric.thing, POINTWISE):
        return _displacement_metric_refusal(scene, metric, name, known)
    return None


def _curve_metric_refusal(metric: Declared, name: str, known: Known) -> _Refusal:
    """Return the refusal of a curve metric compared with a reference that is no curve."""
    word = metric.constructor.name
    if known != "curve":
        return _Refusal("against", f"`{word}` compares curves, but `{name}` is {KNOWN[known]}", "not a curve",
                        'name a measured curve: `curve("pull.csv", ...)`')  # fmt: skip
    return _Refusal("against", f"`{word}` cannot be computed from `{name}`, which is a single curve", "only a curve",
                    f"compare a curve with it: `metric miss = curve_error(METRIC, against = {name})`")  # fmt: skip


def _value_metric_refusal(metric: Declared, name: str, known: Known) -> _Refusal:
    """Return the refusal of a number compared with a reference that has no given values."""
    word = metric.constructor.name
    if known != "value":
        return _Refusal("against", f"`{word}` needs a given value, but `{name}` is {KNOWN[known]}", "no value",
                        'compare with a number: `values(53.4 mm, uncertainty = 0.05 mm, source = "...")`')  # fmt: skip
    return _Refusal("against", f"`{word}` cannot be computed from `{name}`, which is a single value", "only a value",
                    f"compare a number with it: `metric miss = value_error(METRIC, against = {name})`")  # fmt: skip


def _displacement_metric_refusal(scene: Scene, metric: Declared, name: str, known: Known) -> _Refusal | None:
    """Return the refusal of a displacement metric whose reference does not have its material points, or None.

    A measured surface has none, and tracked points have only their own.
    """
    if known == "surface":
        return _Refusal("against", f"`{metric.constructor.name}` compares displacements, but `{name}` has none",
                        KNOWN[known], "use `surface_distance(...)`: a measured surface does not show how material "
                                      "points moved")  # fmt: skip
    probe = scene.declared[metric.thing.probe]
    own = isinstance(probe.thing, Markers) and probe.thing.of == name
    if known == "points" and not own:
        return _Refusal(
            "probe",
            f"`{name}` has results only at the tracked points, but `{probe.name}` needs other points",
            "not tracked",
            f"use a probe at the tracked points: `probe beads = markers({probe.thing.body}, of = {name})`",
        )
    return None
