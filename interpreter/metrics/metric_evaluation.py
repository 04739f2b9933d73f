"""Evaluation of the metrics of a scene for each model and reference."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.loaded_plugin import find_faulty_plugin
from softmark.interpreter.metrics.curve_geometry import MetricCurve
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.measurement import Measurement, MetricInput, MetricNumber, ReferenceData
from softmark.interpreter.metrics.metric_base import ForceMetric, Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.problem.body_case import body_of
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.json_records import to_plain_json
from softmark.interpreter.results.reaction_results import EquilibriumForces
from softmark.interpreter.results.run_report import MetricResult, PlottedCurve, ProbeResult
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic

Floats = NDArray[np.float64]
SAMPLES = 5000  # largest number of samples of a metric in a report
DRAWN = 400  # largest number of points of a curve in a report
FOLLOWED = 2000  # the same for a curve over time, whose value at a time may be requested


def evaluate_metrics(
    scene: Scene,
    view: View,
    views: Mapping[str, View],
    before: Sequence[Mapping[str, View]] = (),
    coming: Container[str] = (),
) -> tuple[dict[str, MetricResult], dict[str, Floats]]:
    """Return the metrics of one model or reference, and their errors at the points of their probes (n,), m, by name.

    `view` is the model's or reference's solution, `views` are all solutions by name, and `before` those in the previous
    states, in order. `coming` are the names of the models still to be solved.
    """
    found, errors = {}, {}
    for metric in scene.of_kind("metric").values():
        if _is_applicable(scene, metric, view):
            against = metric.thing.measured_from
            if against is not None and against not in views:
                found[metric.name] = _result_without_reference(scene, metric, view, against in coming)
                continue
            result, at_points = _evaluate_metric(scene, metric, view, views, before)
            if result.value is None and _is_force_from_theory(scene, metric, view):
                continue  # the theory does not know this force
            found[metric.name] = result
            if at_points is not None:
                errors[metric.name] = at_points
    return found, errors


def _is_applicable(scene: Scene, metric: Declared, view: View) -> bool:
    """Return whether a metric can be evaluated for a solution.

    It must be about the same body, and must not compare the solution with itself or with another body.
    """
    against = metric.thing.measured_from
    if against == view.name:
        return False
    probe, model = metric.thing.probe_in(scene), scene.declared[view.name].kind == "model"
    if probe is None:  # metric of forces, energies or computing time
        same = against is None or body_of(scene, scene.declared[against]) == view.body
        return (
            (model or _is_force_from_theory(scene, metric, view))
            and same
            and metric.thing.body_in(scene) in (None, view.body)
        )
    if not model and view.message is None and probe not in view.probes:  # the reference has no data at this probe
        return False
    return bool(scene.declared[probe].thing.body == view.body)


def _is_force_from_theory(scene: Scene, metric: Declared, view: View) -> bool:
    """Return whether a metric is a plain force or energy and `view` has the forces of a theory."""
    theory = scene.declared[view.name].kind != "model" and view.at_rest is not None
    return theory and isinstance(metric.thing, ForceMetric) and metric.thing.measured_from is None


def _evaluate_metric(
    scene: Scene, metric: Declared, view: View, views: Mapping[str, View], before: Sequence[Mapping[str, View]]
) -> tuple[MetricResult, Floats | None]:
    """Return the result of one metric of a model or reference, and its errors at the points (n,), m, if any."""
    thing = metric.thing
    published = find_published_value(scene, metric.name, view.name)
    try:
        seen = collect_metric_input(thing, view, views)
        if isinstance(thing, CurveMetric):
            seen = replace(seen, curve=evaluate_curve(scene, thing, [*(known[view.name] for known in before), view]))
        elif isinstance(thing, ErrorOfValue):
            seen = replace(seen, number=evaluate_number(scene, thing, view))
        measured = measure_metric(thing, seen)
    except Undefined as undefined:
        return MetricResult(None, thing.unit, str(undefined), published=published), None
    if not math.isfinite(measured.value):
        return MetricResult(None, thing.unit, "the value is not a finite number", published=published), None
    against = views.get(thing.measured_from or "")
    uncertainty = measured.uncertainty or (against.uncertainty if against and thing.uncertain else 0.0)
    samples = () if measured.samples is None else _thin_samples(measured.samples[np.isfinite(measured.samples)])
    result = MetricResult(
        measured.value,
        thing.unit,
        details=to_plain_json(measured.details),
        samples=samples,
        uncertainty=uncertainty if uncertainty and math.isfinite(uncertainty) else None,
        published=published,
        curve=None if measured.curve is None else _thin_curve(measured.curve),
        doubt=(against or view).doubt,
    )
    at_points = measured.at_points
    return result, at_points if at_points is None or np.all(np.isfinite(at_points)) else None


def _result_without_reference(scene: Scene, metric: Declared, view: View, coming: bool) -> MetricResult:
    """Return a result without value, because the reference model is not solved yet or was left out of the run."""
    against = metric.thing.measured_from
    why = "is not computed yet" if coming else f"was left out of this run: add `--model {view.name} --model {against}`"
    reason = f"it is compared with `{against}`, which {why}"
    return MetricResult(None, metric.thing.unit, reason, published=find_published_value(scene, metric.name, view.name))


def _thin_samples(samples: Floats) -> tuple[float, ...]:
    """Return at most SAMPLES of the values, evenly spaced in the list."""
    return tuple(samples[:: -(-len(samples) // SAMPLES) or 1].tolist())


def _thin_curve(course: MetricCurve) -> PlottedCurve:
    """Return a curve for the report with a limited number of points, including both ends."""
    chosen = pick_evenly(len(course.x), FOLLOWED if course.units[0] == "s" else DRAWN)
    known = None if course.known is None else course.known[chosen]
    return PlottedCurve(course.x[chosen], course.y[chosen], course.units, known=known)


def evaluate_curve(scene: Scene, thing: CurveMetric, views: Sequence[View]) -> MetricCurve:
    """Return the curve of the metric `of`: over time, or in statics from state to state. Raises Undefined.

    `views` are the solutions of one model in every state, in order.
    """
    of = scene.declared[thing.of].thing
    if isinstance(views[-1].case.analysis, Dynamic):
        own = collect_metric_input(of, views[-1], {})
        if of.followed:
            return force_history(of, own.at_rest)
        if own.times is None or own.course is None or of.direction is None:
            raise Undefined("it has no time history")
        return MetricCurve(own.times, own.course[:, -1] @ np.array(of.direction), ("s", unit_key(of.unit)))
    times = [a.now for view in views if isinstance(a := view.case.analysis, Quasistatic)]
    if thing.over is None and times:
        y = np.array([_evaluate_value(of, view) for view in views])
        return MetricCurve(np.array(times), y, ("s", unit_key(of.unit)))
    if thing.over is None:
        raise Undefined("in a static analysis a curve needs `over`, the metric on its horizontal axis")
    over = scene.declared[thing.over].thing
    x, y = (np.array([_evaluate_value(one, view) for view in views]) for one in (over, of))
    return MetricCurve(x, y, (unit_key(over.unit), unit_key(of.unit)))


def force_history(of: ForceMetric, rest: EquilibriumForces | None) -> MetricCurve:
    """Return the time history of a contact metric. Raises Undefined if there is none."""
    if (course := of.course(rest)) is None:
        raise Undefined("it has no time history")
    return course


def evaluate_number(scene: Scene, thing: ErrorOfValue, view: View) -> MetricNumber:
    """Return the value of the metric that a `value_error` metric (`thing`) compares. Raises Undefined."""
    of = scene.declared[thing.of].thing
    return MetricNumber(_evaluate_value(of, view), unit_key(of.unit))


def _evaluate_value(thing: Metric, view: View) -> float:
    """Return the value of a metric that has no reference. Raises Undefined."""
    return measure_metric(thing, collect_metric_input(thing, view, {})).value


def unit_key(unit: str) -> str:
    """Return a unit in the form that keys of details use: `Nm` for `N*m`."""
    return unit.replace("*", "").replace("^", "")


def measure_metric(thing: Metric, seen: MetricInput) -> Measurement:
    """Return the measurement of a metric; exceptions of a plugin's metric become Undefined. Raises Undefined."""
    try:
        return thing.measure(seen)
    except Exception as error:
        if (whose := find_faulty_plugin(error)) is None:
            raise
        raise Undefined(whose) from error


def collect_metric_input(thing: Metric, view: View, views: Mapping[str, View]) -> MetricInput:
    """Return the input of a metric: results, probe points and reference data. Raises Undefined if some are missing."""
    nothing, name = np.zeros((0, 3)), thing.probe_name
    own = ProbeResult(nothing, nothing)
    if name is not None:
        if name not in view.probes:
            raise Undefined(view.message or "it has no displacements at this probe")
        own = view.probes[name]
    elif view.message is not None:
        raise Undefined(view.message)
    against = thing.measured_from
    return MetricInput(
        view.name,
        view.case,
        own.points,
        own.displacement,
        own.triangles,
        view.weights.get(name or ""),
        None if against is None else _collect_reference_data(against, views.get(against), name, own),
        view.displacement,
        view.clock,
        view.history,
        view.solve,
        own.times,
        own.course,
        view.stress,
        view.at_rest,
        view.vibrations,
        domain=view.domains.get(name or ""),
    )


def _collect_reference_data(against: str, reference: View | None, probe: str | None, own: ProbeResult) -> ReferenceData:
    """Return the reference data of a metric. Raises Undefined if the reference has no solution."""
    if reference is None:
        raise Undefined(f"there are no results of `{against}` to compare with")
    if reference.message is not None:
        raise Undefined(f"the reference `{reference.name}` has no solution")
    seen = reference.probes.get(probe or "")
    surface = reference.surface
    if callable(surface):  # the measured surface is registered onto the computed one
        if own.triangles is None:
            raise Undefined("registration onto a computed surface needs a surface probe")
        surface = surface(own.position, own.triangles)
    return ReferenceData(
        reference.name,
        seen.displacement if seen else None,
        reference.displacement,
        surface,
        reference.uncertainty,
        seen.times if seen else None,
        seen.course if seen else None,
        reference.at_rest,
        reference.curve,
        reference.stress,
        reference.value,
    )


def find_published_value(scene: Scene, metric: str, owner: str) -> float | None:
    """Return the published value of a metric for a model, in the metric's unit; None if the scene gives none."""
    for table in scene.of_kind("published").values():
        if table.thing.metric == metric and owner in table.thing.of:
            value: float = table.thing.values.values[table.thing.of.index(owner)]
            return value
    return None
