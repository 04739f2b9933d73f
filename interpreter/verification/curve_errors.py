"""Stated error of a curve metric compared with a measured curve: histories in dynamics, states in statics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.metrics.curve_error import CurveError
from softmark.interpreter.metrics.curve_geometry import Curve
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.metrics.metric_evaluation import evaluate_curve, force_history
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.verification.probe_errors import NO_ERROR, Floats, NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.references.measured_curve import MeasuredCurve


@dataclass(frozen=True)
class CurveUnderTest(ProbeResultUnderTest):
    """History of one point whose displacement in the direction `along` is compared with a measured curve."""

    along: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reference: Curve | None = None
    contact: ForceMetric | None = None  # contact metric instead of a displacement

    @property
    def size(self) -> float:
        """Factor that turns an error relative to the displacements into an error of the metric."""
        return self._curve_distance(np.zeros_like(self._curve_values(self)))

    def change(self, other: ProbeResultUnderTest) -> float:
        """Return a bound of the change of the metric if another solution replaces this one; equal to `apart`.

        Raises NoErrorEstimate.
        """
        return self.apart(other)

    def apart(self, other: ProbeResultUnderTest) -> float:
        """Return a bound of the change of the metric if another solution replaces this one. Raises NoErrorEstimate."""
        if not np.all(np.isfinite(other.u)):
            raise NoErrorEstimate("another solution has values that are not finite")
        return self._curve_distance(self._curve_values(other))

    def _curve_values(self, of: ProbeResultUnderTest) -> Floats:
        if self.contact is not None and self.times is not None:
            try:
                course = force_history(self.contact, of.at_rest)
            except Undefined as undefined:
                raise NoErrorEstimate(f"{NO_ERROR}: {undefined}") from undefined
            return np.interp(self.times, course.x, course.y)
        seen: Floats = of.u[:, -1] @ np.array(self.along)
        return seen

    def _curve_distance(self, other: Floats) -> float:
        if not isinstance(self.metric, CurveError) or self.times is None or self.reference is None:
            raise NoErrorEstimate(NO_ERROR)
        try:
            return self.metric.bound_replacement_change(self.times, self._curve_values(self), other, self.reference)
        except Undefined as undefined:
            raise NoErrorEstimate(f"{NO_ERROR}: {undefined}") from undefined


def history_answer(scene: Scene, metric: Declared, view: View, measured: Mapping[str, Any]) -> CurveUnderTest | None:
    """Return the history of a model that a metric compares with a measured curve; None if there is no such history."""
    of, data = scene.declared[metric.thing.of].thing, measured.get(metric.thing.against)
    probe = view.probes.get(of.probe_name or "")
    if not isinstance(view.case.analysis, Dynamic) or not isinstance(data, MeasuredCurve):
        return None
    reference = Curve(data.x, data.y, data.u)
    if isinstance(of, ForceMetric) and of.followed and view.at_rest is not None and view.at_rest.knows(of.subject_name):
        times, nothing = force_history(of, view.at_rest).x, np.zeros((0, 3))
        return CurveUnderTest(nothing, np.zeros((len(times), 0, 3)), times, metric.thing, view.displacement, None, view,
                           view.history, at_rest=view.at_rest, reference=reference, contact=of)  # fmt: skip
    if probe is None:
        return None
    if probe.course is None or of.direction is None:
        return None
    return CurveUnderTest(
        probe.points[-1:], probe.course[:, -1:], probe.times, metric.thing, view.displacement, probe, view,
        view.history, along=of.direction, reference=reference,
    )  # fmt: skip


def static_curve_errors(
    scene: Scene, known: Sequence[tuple[View, Mapping[str, StatedError]]], measured: Mapping[str, Any]
) -> dict[str, StatedError]:
    """Return the stated error of each curve over states, by name, from the stated errors of its two metrics."""
    if isinstance(known[-1][0].case.analysis, Dynamic):
        return {}
    asked = {n: m.thing for n, m in scene.of_kind("metric").items() if isinstance(m.thing, CurveMetric)}
    return {
        n: _error_from_states(scene, thing, known, measured.get(thing.measured_from or ""))
        for n, thing in asked.items()
    }


def _error_from_states(
    scene: Scene, thing: CurveMetric, known: Sequence[tuple[View, Mapping[str, StatedError]]], data: Any
) -> StatedError:
    """Return the stated error of a curve over states.

    It follows from the stated errors of its points and the error of straight lines between states.
    """
    if thing.measured_from is not None and not isinstance(data, MeasuredCurve):
        return StatedError(reason=NO_ERROR)
    reference = None if data is None else Curve(data.x, data.y, data.u)
    off: list[Floats] = []
    try:
        course = evaluate_curve(scene, thing, [view for view, _ in known])
        for name in (thing.of, *([] if thing.over is None else [thing.over])):
            each = [found.get(name, StatedError(reason=NO_ERROR)) for _, found in known]
            if (unknown := next((said for said in each if said.value is None), None)) is not None:
                return StatedError(reason=f"`{name}`: {unknown.reason}")
            off.append(np.array([said.value or 0.0 for said in each]))
        off += [np.zeros(len(known))] if thing.over is None else []  # times have no error
        parts: dict[str, float | None] = {**thing.stated(course, off[0], off[1], reference)}
    except Undefined as undefined:
        return StatedError(reason=f"{NO_ERROR}: {undefined}")
    return StatedError(sum(part or 0.0 for part in parts.values()), "1", parts)
