"""What a model states of how far its curve is from a measured one: by the curve itself, or at rest by its one point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.evidence.probe_answers import NO_ERROR, Floats, ProbeAnswer, Unknown
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.metrics.curve_error import CurveError
from softmark.interpreter.metrics.curves import Curve
from softmark.interpreter.metrics.measure import course_of
from softmark.interpreter.metrics.undefined import Undefined
from softmark.interpreter.problem.view import View
from softmark.interpreter.results.stated import StatedError
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.records import dataclass
from softmark.references.curve import MeasuredCurve

NEAR = 1e-6  # of the reference's range: over how much its slope at a point is taken


@dataclass(frozen=True)
class CurveAnswer(ProbeAnswer):
    """The course of one point, whose displacement `along` a direction is held against a measured curve."""

    along: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reference: Curve | None = None

    @property
    def size(self) -> float:
        """What an error relative to the displacements is multiplied by."""
        return self._of_curves(np.zeros_like(self._course(self)))

    def apart(self, other: ProbeAnswer) -> float:
        """How much another solution may change the metric. Raises Unknown."""
        if not np.all(np.isfinite(other.u)):
            raise Unknown("another solution is not finite")
        return self._of_curves(self._course(other))

    def _course(self, of: ProbeAnswer) -> Floats:
        course: Floats = of.u[:, -1] @ np.array(self.along)
        return course

    def _of_curves(self, other: Floats) -> float:
        if not isinstance(self.metric, CurveError) or self.times is None or self.reference is None:
            raise Unknown(NO_ERROR)
        try:
            return self.metric.apart(self.times, self._course(self), other, self.reference)
        except Undefined as undefined:
            raise Unknown(f"{NO_ERROR}: {undefined}") from undefined


def in_time(scene: Scene, metric: Declared, view: View, measured: Mapping[str, Any]) -> CurveAnswer | None:
    """What is stated of a course against a measured one; None where there is none."""
    of, data = scene.declared[metric.thing.of].thing, measured.get(metric.thing.against)
    probe = view.probes.get(of.looked_at or "")
    if not isinstance(view.case.analysis, Dynamic) or not isinstance(data, MeasuredCurve) or probe is None:
        return None
    if probe.course is None or of.direction is None:
        return None
    return CurveAnswer(
        probe.points[-1:], probe.course[:, -1:], probe.times, metric.thing, view.displacement, probe, view,
        view.history, along=of.direction, reference=Curve(data.x, data.y, data.u),
    )  # fmt: skip


def at_rest(
    scene: Scene, view: View, found: Mapping[str, StatedError], measured: Mapping[str, Any]
) -> dict[str, StatedError]:
    """Of curves that are one point: what is stated of its two metrics, by how much that moves the difference."""
    if isinstance(view.case.analysis, Dynamic):
        return {}
    asked = {n: m.thing for n, m in scene.of_kind("metric").items() if isinstance(m.thing, CurveError)}
    return {n: _point(scene, thing, view, found, measured.get(thing.against)) for n, thing in asked.items()}


def _point(scene: Scene, thing: CurveError, view: View, found: Mapping[str, StatedError], data: Any) -> StatedError:
    if thing.of not in found or not isinstance(data, MeasuredCurve):
        return StatedError(reason=NO_ERROR)
    try:
        x = float(course_of(scene, thing, view, {}).x[0])
    except Undefined as undefined:
        return StatedError(reason=f"{NO_ERROR}: {undefined}")
    step = NEAR * (data.x[-1] - data.x[0])
    before, r, after = (float(v) for v in np.interp([x - step, x, x + step], data.x, data.y))
    if r == 0.0 or not data.x[0] <= x <= data.x[-1]:
        return StatedError(reason=NO_ERROR)
    own = _scaled(found[thing.of], 1.0 / abs(r))
    along = _scaled(found.get(thing.over or "", StatedError(0.0)), max(abs(after - r), abs(r - before)) / step / abs(r))
    if own.value is None or along.value is None:
        return own if own.value is None else along
    parts = {**own.parts, **{f"{name} along": part for name, part in along.parts.items() if part}}
    return replace(own, value=own.value + along.value, parts=parts)


def _scaled(said: StatedError, factor: float) -> StatedError:
    parts = {name: None if part is None else factor * part for name, part in said.parts.items()}
    return replace(said, value=None if said.value is None else factor * said.value, unit="1", parts=parts)
