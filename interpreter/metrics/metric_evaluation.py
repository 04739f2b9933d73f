"""Metrics: every number that a scene asks for, of whoever it can be asked of."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.plugin_words import blamed
from softmark.interpreter.metrics.curve_geometry import Course
from softmark.interpreter.metrics.curve_metrics import OfCurves
from softmark.interpreter.metrics.measurement import Known, Measurement, Number, Seen
from softmark.interpreter.metrics.metric_base import Metric, OfForces
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.problem.body_case import body_of
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.even_thinning import picked
from softmark.interpreter.results.json_records import clean
from softmark.interpreter.results.reaction_results import AtRest
from softmark.interpreter.results.run_report import MetricResult, ProbeResult, SeenCurve
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic

Floats = NDArray[np.float64]
SAMPLES = 5000  # of a metric that a report keeps
DRAWN = 400  # points of a curve that it keeps
FOLLOWED = 2000  # of one over time, which is asked for its value at a time


def metrics_of(
    scene: Scene,
    view: View,
    views: Mapping[str, View],
    before: Sequence[Mapping[str, View]] = (),
    coming: Container[str] = (),
) -> tuple[dict[str, MetricResult], dict[str, Floats]]:
    """The metrics of one model or reference, and their errors at the points of their probes (n,), m.

    `before` are the views in the states before, in their order; `coming` the models that are asked for.
    """
    found, errors = {}, {}
    for metric in scene.of_kind("metric").values():
        if _concerns(scene, metric, view):
            against = metric.thing.measured_from
            if against is not None and against not in views:
                found[metric.name] = _alone(scene, metric, view, against in coming)
                continue
            result, at_points = _metric(scene, metric, view, views, before)
            if result.value is None and _of_theory(scene, metric, view):
                continue  # which says nothing of it
            found[metric.name] = result
            if at_points is not None:
                errors[metric.name] = at_points
    return found, errors


def _concerns(scene: Scene, metric: Declared, view: View) -> bool:
    """Whether a metric looks at the body of a view, and does not compare it with itself or with another body."""
    against = metric.thing.measured_from
    if against == view.name:
        return False
    probe, model = metric.thing.probe_in(scene), scene.declared[view.name].kind == "model"
    if probe is None:  # about forces, or the computation itself
        same = against is None or body_of(scene, scene.declared[against]) == view.body
        return (model or _of_theory(scene, metric, view)) and same and metric.thing.body_in(scene) in (None, view.body)
    if not model and view.message is None and probe not in view.probes:  # measured elsewhere
        return False
    return bool(scene.declared[probe].thing.body == view.body)


def _of_theory(scene: Scene, metric: Declared, view: View) -> bool:
    """Whether it is of forces themselves, which a theory may say of the part of the body that a scene has."""
    theory = scene.declared[view.name].kind != "model" and view.at_rest is not None
    return theory and isinstance(metric.thing, OfForces) and metric.thing.measured_from is None


def _metric(
    scene: Scene, metric: Declared, view: View, views: Mapping[str, View], before: Sequence[Mapping[str, View]]
) -> tuple[MetricResult, Floats | None]:
    thing = metric.thing
    published = published_of(scene, metric.name, view.name)
    try:
        seen = seen_of(thing, view, views)
        if isinstance(thing, OfCurves):
            seen = replace(seen, curve=course_of(scene, thing, [*(known[view.name] for known in before), view]))
        elif isinstance(thing, ErrorOfValue):
            seen = replace(seen, number=number_of(scene, thing, view))
        measured = measured_by(thing, seen)
    except Undefined as undefined:
        return MetricResult(None, thing.unit, str(undefined), published=published), None
    if not math.isfinite(measured.value):
        return MetricResult(None, thing.unit, "the value is not a finite number", published=published), None
    against = views.get(thing.measured_from or "")
    uncertainty = measured.uncertainty or (against.uncertainty if against and thing.uncertain else 0.0)
    samples = () if measured.samples is None else _some(measured.samples[np.isfinite(measured.samples)])
    result = MetricResult(
        measured.value,
        thing.unit,
        details=clean(measured.details),
        samples=samples,
        uncertainty=uncertainty if uncertainty and math.isfinite(uncertainty) else None,
        published=published,
        curve=None if measured.curve is None else _drawn(measured.curve),
        doubt=(against or view).doubt,
    )
    at_points = measured.at_points
    return result, at_points if at_points is None or np.all(np.isfinite(at_points)) else None


def _alone(scene: Scene, metric: Declared, view: View, coming: bool) -> MetricResult:
    """Of a metric against a model of which there is nothing: its turn is yet to come, or it was left out."""
    against = metric.thing.measured_from
    why = "is not computed yet" if coming else f"this run leaves out: `--model {view.name} --model {against}`"
    reason = f"it is measured against `{against}`, which {why}"
    return MetricResult(None, metric.thing.unit, reason, published=published_of(scene, metric.name, view.name))


def _some(samples: Floats) -> tuple[float, ...]:
    """At most SAMPLES values, every so many of them."""
    return tuple(samples[:: -(-len(samples) // SAMPLES) or 1].tolist())


def _drawn(course: Course) -> SeenCurve:
    """A course as a report keeps it: some of its points, each end among them."""
    chosen = picked(len(course.x), FOLLOWED if course.units[0] == "s" else DRAWN)
    known = None if course.known is None else course.known[chosen]
    return SeenCurve(course.x[chosen], course.y[chosen], course.units, known=known)


def course_of(scene: Scene, thing: OfCurves, views: Sequence[View]) -> Course:
    """The curve of the metric that another is about: over time, or at rest from state to state. Raises Undefined.

    `views` are those of one model in every state, in their order.
    """
    of = scene.declared[thing.of].thing
    if isinstance(views[-1].case.analysis, Dynamic):
        own = seen_of(of, views[-1], {})
        if of.followed:
            return followed(of, own.at_rest)
        if own.times is None or own.course is None or of.direction is None:
            raise Undefined("it has no history")
        return Course(own.times, own.course[:, -1] @ np.array(of.direction), ("s", key_of(of.unit)))
    times = [a.now for view in views if isinstance(a := view.case.analysis, Quasistatic)]
    if thing.over is None and times:
        y = np.array([_own_value(of, view) for view in views])
        return Course(np.array(times), y, ("s", key_of(of.unit)))
    if thing.over is None:
        raise Undefined("it is at rest, and says not along what the curve goes")
    over = scene.declared[thing.over].thing
    x, y = (np.array([_own_value(one, view) for view in views]) for one in (over, of))
    return Course(x, y, (key_of(over.unit), key_of(of.unit)))


def followed(of: OfForces, rest: AtRest | None) -> Course:
    """The course of what a contact does. Raises Undefined where it has none."""
    if (course := of.course(rest)) is None:
        raise Undefined("it has no history")
    return course


def number_of(scene: Scene, thing: ErrorOfValue, view: View) -> Number:
    """What the metric comes to whose number is held against a value. Raises Undefined."""
    of = scene.declared[thing.of].thing
    return Number(_own_value(of, view), key_of(of.unit))


def _own_value(thing: Metric, view: View) -> float:
    """Of a metric that is measured from nothing. Raises Undefined."""
    return measured_by(thing, seen_of(thing, view, {})).value


def key_of(unit: str) -> str:
    """A unit as the keys of details end in it: `Nm` for `N*m`."""
    return unit.replace("*", "").replace("^", "")


def measured_by(thing: Metric, seen: Seen) -> Measurement:
    """What a metric makes of what it sees. Raises Undefined."""
    try:
        return thing.measure(seen)
    except Exception as error:
        if (whose := blamed(error)) is None:
            raise
        raise Undefined(whose) from error


def seen_of(thing: Metric, view: View, views: Mapping[str, View]) -> Seen:
    """What the metric may look at. Raises Undefined where it is not there."""
    nothing, name = np.zeros((0, 3)), thing.looked_at
    own = ProbeResult(nothing, nothing)
    if name is not None:
        if name not in view.probes:
            raise Undefined(view.message or "it has no displacements there")
        own = view.probes[name]
    elif view.message is not None:
        raise Undefined(view.message)
    against = thing.measured_from
    return Seen(
        view.name,
        view.case,
        own.points,
        own.displacement,
        own.triangles,
        view.weights.get(name or ""),
        None if against is None else _known(against, views.get(against), name, own),
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


def _known(against: str, reference: View | None, probe: str | None, own: ProbeResult) -> Known:
    if reference is None:
        raise Undefined(f"there is nothing of `{against}` to compare with")
    if reference.message is not None:
        raise Undefined(f"the reference `{reference.name}` has no solution")
    seen = reference.probes.get(probe or "")
    surface = reference.surface
    if callable(surface):  # it is registered onto what is compared with it
        if own.triangles is None:
            raise Undefined("registering onto a computed surface needs a probe of a surface")
        surface = surface(own.position, own.triangles)
    return Known(
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


def published_of(scene: Scene, metric: str, owner: str) -> float | None:
    """What the scene says that others found for a model and a metric, in the metric's unit."""
    for table in scene.of_kind("published").values():
        if table.thing.metric == metric and owner in table.thing.of:
            value: float = table.thing.values.values[table.thing.of.index(owner)]
            return value
    return None
