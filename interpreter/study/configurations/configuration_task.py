"""Computation of one configuration in this process (`perform`), with its outcome as JSON.

Errors of a scene or a solver raise no exception. A variation that cannot be built gets the status `failed`, and
the study continues.
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
from softmark.interpreter.results.json_records import to_plain_json
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT
from softmark.interpreter.study.configurations.reference_changes import trace_references
from softmark.interpreter.study.configurations.task_outcome import (
    PointError,
    PointOutcome,
    PointStatedErrors,
    PointTask,
    PointWarning,
    ProbeTrace,
    SolvedReference,
    TruthRequest,
    TruthStatement,
)
from softmark.interpreter.validation.requested_names import needed_models

if TYPE_CHECKING:
    from softmark.interpreter.results.run_report import ModelResult, ProbeResult, ReferenceResult, Report, ReportWarning

Json = dict[str, Any]
POINTS = 200  # maximum number of probe points that a comparison keeps
FINE = (*ANSWERED, *LEFT_OUT)


def perform(task: PointTask) -> PointOutcome:
    """Compute one configuration and return its outcome: results, references and computing time, s.

    After any error the status of the outcome is `failed`, with a message.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        found = _compute_task(task)
    except SceneError as error:
        found = failed_outcome(task, format_diagnostics(error.diagnostics))
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        what = "out of memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
        found = failed_outcome(task, f"it stopped with an error ({what})")
    return replace(found, wall_s=time.perf_counter() - wall, cpu_s=time.process_time() - cpu)


def failed_outcome(task: PointTask, message: str, status: str = "failed", **more: Any) -> PointOutcome:
    """Return the outcome of a task that has no result."""
    point: Json = {
        "status": status, "message": message, "outline": "", "size": {}, "solve": {}, "errors": {},
        "measured_from": {}, "probes": {}, "warnings": [],
    }  # fmt: skip
    return PointOutcome(task.key, point, **more)


def format_diagnostics(diagnostics: Sequence[Diagnostic]) -> str:
    """Return the first diagnostic on one line, with the number of the others."""
    first = diagnostics[0]
    where = f" (line {first.span.line} of {first.source.name})" if first.span and first.source else ""
    more = f" and {len(diagnostics) - 1} more" if len(diagnostics) > 1 else ""
    return f"{first.code}: {first.message}{where}{more}" + (f"; {first.help}" if first.help else "")


def _compute_task(task: PointTask) -> PointOutcome:
    from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
    from softmark.interpreter.study.configurations.configuration_keys import cached_reference

    scene, warnings = compile_task(task)
    truth = task.truth
    asked = (task.model, *([truth.model] if truth else [])) if task.stated else None
    options = RunOptions(only=task.models, draw=False, recall=cached_reference, stated=asked)
    try:
        report = run_scene(scene, warnings, options)
    except SceneError as error:
        if truth is None or not all(is_about([scene.declared[truth.model]], d) for d in error.diagnostics):
            raise
        why = format_diagnostics(error.diagnostics)
        return failed_outcome(task, why, truths={truth.model: TruthStatement("failed", why, None)})
    model = report.models.get(task.model)
    references = {name: _reference(r) for name, r in report.references.items()}
    if model is None:
        why = "no probe or metric uses this model: add one of its body"
        return failed_outcome(task, why, references=references)
    truths = None if truth is None else {truth.model: _reference_statements(report, truth)}
    return PointOutcome(task.key, _point_entry(scene, report, model), references, truths)


def _reference_statements(report: Report, asked: TruthRequest) -> TruthStatement:
    """Return the error statement of a model that serves as the reference of a robustness study."""
    result = report.models.get(asked.model)
    if result is None:
        return TruthStatement("skipped", "it was not computed", None)
    return TruthStatement(result.status, result.message, result.stated.get(asked.metric))


def compile_task(task: PointTask) -> tuple[Scene, list[Diagnostic]]:
    """Return the compiled scene of a task and its warnings. Raises SceneError."""
    from softmark.interpreter.validation.constructor_registry import compile_source
    from softmark.interpreter.validation.scene_checks import check

    source, file = Source(task.shown, task.text), Path(task.file) if task.file else None
    scene, found = compile_source(source, Path(task.folder), file, task.overrides, task.plugins)
    if not any(d.severity == "error" for d in found):
        scene = replace(scene, chosen=needed_models(scene, task.models))
        found += check(scene)
    if errors := [d for d in found if d.severity == "error" and not _is_about_unneeded_model(scene, task, d)]:
        raise SceneError(errors)
    return scene, [d for d in found if d.severity != "error"]


def _is_about_unneeded_model(scene: Scene, task: PointTask, error: Diagnostic) -> bool:
    """Return whether an error concerns a model that the task does not need and ignores (`alone`)."""
    if not task.alone or error.span is None:
        return False
    others = [d for n, d in scene.of_kind("model").items() if n not in with_dependencies(scene, task.models)]
    return is_about(others, error)


def is_about(declared: Iterable[Declared], error: Diagnostic) -> bool:
    """Return whether an error is located in one of some declarations, or in an override of one of their fields."""
    return any(d.contains(error) for d in declared)


# ------------------------------------------------------------------ as JSON


def _point_entry(scene: Scene, report: Report, model: ModelResult) -> Json:
    from softmark.interpreter.study.configurations.discretization_size import resolution_of

    solve = {name: value for name, value in model.solve.items() if name != "history"}
    errors = _metric_results(scene, report, model)
    point: Json = {
        "status": model.status, "message": model.message, "outline": model.outline, "size": dict(model.size),
        "solve": solve, "errors": errors, "measured_from": trace_references(scene, report, model.name, errors),
        "probes": {n: _probe(p) for n, p in model.probes.items()},
        "warnings": [PointWarning(w.code, w.message) for w in _own_warnings(scene, report, model)],
        "resolution": resolution_of(scene, model.name),
    }  # fmt: skip
    if model.stated:
        point["stated"] = _stated_error(scene, model)
    cleaned: Json = to_plain_json(point)
    return cleaned


def _stated_error(scene: Scene, model: ModelResult) -> PointStatedErrors:
    """Return the errors that a model states of all metrics, in `of`, and that of the first relative error metric."""
    relative = (
        n for n, m in scene.of_kind("metric").items()
        if n in model.stated and m.thing.unit == "1" and m.thing.measured_from is not None
    )  # fmt: skip
    plain = next((n for n, said in model.stated.items() if said.unit in ("1", None)), None)
    if (first := next(relative, plain)) is None:  # only forces, none of them relative
        return PointStatedErrors(None, "1", {}, "the scene has no relative error", (), None, model.stated)
    own = model.stated[first]
    return PointStatedErrors(own.value, own.unit, own.parts, own.reason, own.doubts, first, model.stated)


def _own_warnings(scene: Scene, report: Report, model: ModelResult) -> list[ReportWarning]:
    """Return the warnings that concern a model or the models from which it is made."""
    own = with_dependencies(scene, [model.name])
    others = [d.location for n, d in scene.of_kind("model").items() if n not in own]
    lines = [range(at.span.line, at.span.end_line + 1) for at in others if at.source is scene.source]
    return [w for w in report.warnings if w.line is None or not any(w.line in there for there in lines)]


def _reference(reference: ReferenceResult) -> SolvedReference:
    error = reference.estimated_error
    return SolvedReference(
        reference.kind, reference.source, reference.status, reference.message,
        to_plain_json(error), {n: _probe(p) for n, p in reference.probes.items()},
    )  # fmt: skip


def _probe(probe: ProbeResult) -> ProbeTrace:
    from softmark.interpreter.results.even_thinning import pick_evenly

    some = pick_evenly(len(probe.points), POINTS)
    return ProbeTrace(to_plain_json(probe.points[some]), to_plain_json(probe.displacement[some]))


# ------------------------------------------------------------------ errors


def _metric_results(scene: Scene, report: Report, model: ModelResult) -> dict[str, PointError]:
    """Return the results of all metrics except those of speed, which other processes on the machine would distort.

    If the scene has no error metric, relative displacement errors are added (`_default_errors`).
    """
    asked = scene.of_kind("metric")
    found = {
        name: PointError(
            result.value, result.unit, _reference_name(asked[name]), result.reason, result.uncertainty,
            _is_independent_of_probes(scene, asked[name]) or None,
        )
        for name, result in model.metrics.items()
        if (asked[name].thing.probe_name or asked[name].thing.subject_name) is not None
    }  # fmt: skip
    if not any(_reference_name(m) for m in asked.values()):
        found |= _default_errors(report, model)
    return found


def _is_independent_of_probes(scene: Scene, metric: Declared) -> bool:
    """Return whether a metric does not depend on displacements at a probe, as for forces.

    Convergence of displacements then says nothing about the metric.
    """
    return metric.thing.probe_in(scene) is None or isinstance(metric.thing, ForceMetric)


def _reference_name(metric: Declared) -> str | None:
    against: str | None = metric.thing.measured_from
    return against


def _default_errors(report: Report, model: ModelResult) -> dict[str, PointError]:
    """Return the relative l2 norm of the displacement error for every probe and every reference with displacements.

    Each error is named `PROBE against REFERENCE`.
    """
    return {
        f"{name} against {reference.name}": _relative_displacement_error(reference, probe, name)
        for reference in report.references.values()
        for name, probe in model.probes.items()
        if reference.status != "converged" or name in reference.probes
    }


def _relative_displacement_error(reference: ReferenceResult, probe: ProbeResult, name: str) -> PointError:
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
