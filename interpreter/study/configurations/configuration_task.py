"""One configuration computed: `perform` runs it in this process and gives what came of it as plain JSON.

It never raises for what a scene or a solver does: a variation that cannot be built is a failed point like any other,
and a study goes on.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.language.compiled_scene import Declared, Scene, SceneError
from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.planning.declaration_dependencies import with_dependencies
from softmark.interpreter.results.json_records import clean
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT
from softmark.interpreter.study.configurations.reference_changes import traces
from softmark.interpreter.study.configurations.task_outcome import (
    PointError,
    PointOutcome,
    PointStated,
    PointTask,
    PointWarning,
    ProbeTrace,
    SolvedReference,
    Truth,
    TruthAsked,
)
from softmark.interpreter.validation.requested_names import needed_models

if TYPE_CHECKING:
    from softmark.interpreter.results.run_report import ModelResult, ProbeResult, ReferenceResult, Report, Warned

Json = dict[str, Any]
POINTS = 200  # of a probe that a comparison keeps
FINE = (*ANSWERED, *LEFT_OUT)


def perform(task: PointTask) -> PointOutcome:
    """The outcome of one task: `point` and `references` of the comparison, and the seconds that it took.

    A point's `status` is `failed`, with a message, for whatever goes wrong.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        found = _performed(task)
    except SceneError as error:
        found = failed(task, told(error.diagnostics))
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        what = "out of memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
        found = failed(task, f"it stopped with an error ({what})")
    return replace(found, wall_s=time.perf_counter() - wall, cpu_s=time.process_time() - cpu)


def failed(task: PointTask, message: str, status: str = "failed", **more: Any) -> PointOutcome:
    """The outcome of a task that has no result."""
    point: Json = {
        "status": status, "message": message, "outline": "", "size": {}, "solve": {}, "errors": {},
        "measured_from": {}, "probes": {}, "warnings": [],
    }  # fmt: skip
    return PointOutcome(task.key, point, **more)


def told(diagnostics: Sequence[Diagnostic]) -> str:
    """The first of some diagnostics as a line, and how many more there are."""
    first = diagnostics[0]
    where = f" (line {first.span.line} of {first.source.name})" if first.span and first.source else ""
    more = f" and {len(diagnostics) - 1} more" if len(diagnostics) > 1 else ""
    return f"{first.code}: {first.message}{where}{more}" + (f"; {first.help}" if first.help else "")


def _performed(task: PointTask) -> PointOutcome:
    from softmark.interpreter.pipeline.run_pipeline import Options, run
    from softmark.interpreter.study.configurations.configuration_keys import recall

    scene, warnings = scene_of(task)
    truth = task.truth
    asked = (task.model, *([truth.model] if truth else [])) if task.stated else None
    options = Options(only=task.models, draw=False, recall=recall, stated=asked)
    try:
        report = run(scene, warnings, options)
    except SceneError as error:
        if truth is None or not all(is_about([scene.declared[truth.model]], d) for d in error.diagnostics):
            raise
        why = told(error.diagnostics)
        return failed(task, why, truths={truth.model: Truth("failed", why, None)})
    model = report.models.get(task.model)
    references = {name: _reference(r) for name, r in report.references.items()}
    if model is None:
        why = "nothing asks for this model: add a probe or a metric of its body"
        return failed(task, why, references=references)
    truths = None if truth is None else {truth.model: _truth(report, truth)}
    return PointOutcome(task.key, _point(scene, report, model), references, truths)


def _truth(report: Report, asked: TruthAsked) -> Truth:
    """What a model that is taken as right says of itself."""
    result = report.models.get(asked.model)
    if result is None:
        return Truth("skipped", "it was not computed", None)
    return Truth(result.status, result.message, result.stated.get(asked.metric))


def scene_of(task: PointTask) -> tuple[Scene, list[Diagnostic]]:
    """The scene of a task, and the warnings about it. Raises SceneError."""
    from softmark.interpreter.validation.constructor_registry import compile_source
    from softmark.interpreter.validation.scene_checks import check

    source, file = Source(task.shown, task.text), Path(task.file) if task.file else None
    scene, found = compile_source(source, Path(task.folder), file, task.overrides, task.plugins)
    if not any(d.severity == "error" for d in found):
        scene = replace(scene, chosen=needed_models(scene, task.models))
        found += check(scene)
    if errors := [d for d in found if d.severity == "error" and not _of_another(scene, task, d)]:
        raise SceneError(errors)
    return scene, [d for d in found if d.severity != "error"]


def _of_another(scene: Scene, task: PointTask, error: Diagnostic) -> bool:
    """Whether an error is about a model that a task, which is to stand `alone`, does not need."""
    if not task.alone or error.span is None:
        return False
    others = [d for n, d in scene.of_kind("model").items() if n not in with_dependencies(scene, task.models)]
    return is_about(others, error)


def is_about(declared: Iterable[Declared], error: Diagnostic) -> bool:
    """Whether an error points into one of some declarations, or into an override of one of their fields."""
    return any(d.contains(error) for d in declared)


# ------------------------------------------------------------------ as JSON


def _point(scene: Scene, report: Report, model: ModelResult) -> Json:
    from softmark.interpreter.study.configurations.discretization_size import resolution_of

    solve = {name: value for name, value in model.solve.items() if name != "history"}
    errors = _errors(scene, report, model)
    point: Json = {
        "status": model.status, "message": model.message, "outline": model.outline, "size": dict(model.size),
        "solve": solve, "errors": errors, "measured_from": traces(scene, report, model.name, errors),
        "probes": {n: _probe(p) for n, p in model.probes.items()},
        "warnings": [PointWarning(w.code, w.message) for w in _concerned(scene, report, model)],
        "resolution": resolution_of(scene, model.name),
    }  # fmt: skip
    if model.stated:
        point["stated"] = _stated(scene, model)
    cleaned: Json = clean(point)
    return cleaned


def _stated(scene: Scene, model: ModelResult) -> PointStated:
    """What the model states of the first relative metric against something, and of all (`of`)."""
    relative = (
        n for n, m in scene.of_kind("metric").items()
        if n in model.stated and m.thing.unit == "1" and m.thing.measured_from is not None
    )  # fmt: skip
    plain = next((n for n, said in model.stated.items() if said.unit in ("1", None)), None)
    if (first := next(relative, plain)) is None:  # forces alone, none of them relative
        return PointStated(None, "1", {}, "no relative error is asked for", (), None, model.stated)
    own = model.stated[first]
    return PointStated(own.value, own.unit, own.parts, own.reason, own.doubts, first, model.stated)


def _concerned(scene: Scene, report: Report, model: ModelResult) -> list[Warned]:
    """Warnings without those at other models, but for the models that this one is made from."""
    own = with_dependencies(scene, [model.name])
    others = [d.location for n, d in scene.of_kind("model").items() if n not in own]
    lines = [range(at.span.line, at.span.end_line + 1) for at in others if at.source is scene.source]
    return [w for w in report.warnings if w.line is None or not any(w.line in there for there in lines)]


def _reference(reference: ReferenceResult) -> SolvedReference:
    error = reference.estimated_error
    return SolvedReference(
        reference.kind, reference.source, reference.status, reference.message,
        clean(error), {n: _probe(p) for n, p in reference.probes.items()},
    )  # fmt: skip


def _probe(probe: ProbeResult) -> ProbeTrace:
    from softmark.interpreter.results.even_thinning import picked

    some = picked(len(probe.points), POINTS)
    return ProbeTrace(clean(probe.points[some]), clean(probe.displacement[some]))


# ------------------------------------------------------------------ errors


def _errors(scene: Scene, report: Report, model: ModelResult) -> dict[str, PointError]:
    """Every metric but those about speed, which a shared processor would spoil; without comparisons, our own."""
    asked = scene.of_kind("metric")
    found = {
        name: PointError(
            result.value, result.unit, _against(asked[name]), result.reason, result.uncertainty,
            _by_itself(scene, asked[name]) or None,
        )
        for name, result in model.metrics.items()
        if (asked[name].thing.looked_at or asked[name].thing.concerned) is not None
    }  # fmt: skip
    if not any(_against(m) for m in asked.values()):
        found |= _automatic(report, model)
    return found


def _by_itself(scene: Scene, metric: Declared) -> bool:
    """Whether it looks at no probe, or at forces there: whether displacements have a limit is another question."""
    return metric.thing.probe_in(scene) is None or isinstance(metric.thing, ForceMetric)


def _against(metric: Declared) -> str | None:
    against: str | None = metric.thing.measured_from
    return against


def _automatic(report: Report, model: ModelResult) -> dict[str, PointError]:
    """`PROBE against REFERENCE`: the relative l2 norm of every probe against every field of displacements."""
    return {
        f"{name} against {reference.name}": _relative(reference, probe, name)
        for reference in report.references.values()
        for name, probe in model.probes.items()
        if reference.status != "converged" or name in reference.probes
    }


def _relative(reference: ReferenceResult, probe: ProbeResult, name: str) -> PointError:
    from softmark.interpreter.metrics.relative_displacement_error import RelativeDisplacementError
    from softmark.interpreter.metrics.undefined_metric import Undefined

    none = PointError(None, RelativeDisplacementError.unit, reference.name)
    if name not in reference.probes:
        return replace(none, reason=f"the reference `{reference.name}` has no solution")
    try:
        value = RelativeDisplacementError(name, reference.name).value(
            probe.points, probe.displacement, reference.probes[name].displacement
        )
    except Undefined as undefined:
        return replace(none, reason=str(undefined))
    return replace(none, **({"value": value} if math.isfinite(value) else {"reason": "it is not a finite number"}))
