"""One configuration computed: `perform` runs it in this process and gives what came of it as plain JSON.

It never raises for what a scene or a solver does: a variation that cannot be built is a failed point like any other,
and a study goes on.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.front.requests import needed
from softmark.interpreter.language.scene import Declared, Scene, SceneError
from softmark.interpreter.plan.needs import reached
from softmark.interpreter.study.expansion.truths import traces

if TYPE_CHECKING:
    from softmark.interpreter.results.report import ModelResult, ProbeResult, ReferenceResult, Report, Warned

Json = dict[str, Any]
POINTS = 200  # of a probe that a comparison keeps
FINE = ("converged", "capped", "skipped")


def perform(task: Mapping[str, Any]) -> Json:
    """The outcome of one task: `point` and `references` of the comparison, and the seconds that it took.

    A point's `status` is `failed`, with a message, for whatever goes wrong.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        found = _performed(task)
    except SceneError as error:
        found = failed(told(error.diagnostics))
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        what = "out of memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
        found = failed(f"it stopped with an error ({what})")
    spent = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    return {"key": task["key"], **found, **spent}


def failed(message: str, status: str = "failed") -> Json:
    """The outcome of a task that has no result."""
    point: Json = {
        "status": status, "message": message, "outline": "", "size": {}, "solve": {}, "errors": {},
        "measured_from": {}, "probes": {}, "warnings": [],
    }  # fmt: skip
    return {"point": point, "references": {}}


def told(diagnostics: Sequence[Diagnostic]) -> str:
    """The first of some diagnostics as a line, and how many more there are."""
    first = diagnostics[0]
    where = f" (line {first.span.line} of {first.source.name})" if first.span and first.source else ""
    more = f" and {len(diagnostics) - 1} more" if len(diagnostics) > 1 else ""
    return f"{first.code}: {first.message}{where}{more}" + (f"; {first.help}" if first.help else "")


def _performed(task: Mapping[str, Any]) -> Json:
    from softmark.interpreter.run.pipeline import Options, run
    from softmark.interpreter.study.expansion.keys import recall

    scene, warnings = scene_of(task)
    truth = task.get("truth") or {}  # of a stability study: a model taken as right, and the metric that does so
    asked = (str(task["model"]), *([truth["model"]] if truth else [])) if task.get("stated") else None
    options = Options(only=tuple(task["models"]), draw=False, recall=recall, stated=asked)
    try:
        report = run(scene, warnings, options)
    except SceneError as error:
        if not truth or not all(_within(scene, [scene.declared[truth["model"]]], d) for d in error.diagnostics):
            raise
        refused = {"status": "failed", "message": told(error.diagnostics), "stated": None}
        return {**failed(told(error.diagnostics)), "truths": {truth["model"]: refused}}
    model = report.models.get(str(task["model"]))
    references = {name: _reference(r) for name, r in report.references.items()}
    if model is None:
        return {**failed("nothing asks for this model: add a probe or a metric of its body"), "references": references}
    found = {"point": _point(scene, report, model), "references": references}
    return found | ({"truths": {truth["model"]: _truth(report, **truth)}} if truth else {})


def _truth(report: Report, model: str, metric: str) -> Json:
    """What a model that is taken as right says of itself."""
    result = report.models.get(model)
    if result is None:
        return {"status": "skipped", "message": "it was not computed", "stated": None}
    said: Json = clean(result.stated.get(metric))
    return {"status": result.status, "message": result.message, "stated": said}


def scene_of(task: Mapping[str, Any]) -> tuple[Scene, list[Diagnostic]]:
    """The scene of a task, and the warnings about it. Raises SceneError."""
    from softmark.interpreter.front.catalogue import compiled
    from softmark.interpreter.front.check import check

    file = task["file"]
    source = Source(task["shown"], task["text"])
    scene, found = compiled(source, Path(task["folder"]), Path(file) if file else None, task["overrides"])
    if not any(d.severity == "error" for d in found):
        scene = replace(scene, chosen=needed(scene, task["models"]))
        found += check(scene)
    if errors := [d for d in found if d.severity == "error" and not _of_another(scene, task, d)]:
        raise SceneError(errors)
    return scene, [d for d in found if d.severity != "error"]


def _of_another(scene: Scene, task: Mapping[str, Any], error: Diagnostic) -> bool:
    """Whether an error is about a model that a task, which is to stand `alone`, does not need."""
    if not task.get("alone") or error.span is None:
        return False
    others = [d for n, d in scene.of_kind("model").items() if n not in reached(scene, task["models"])]
    return _within(scene, others, error)


def _within(scene: Scene, declared: Sequence[Declared], error: Diagnostic) -> bool:
    """Whether an error points into one of some declarations, or into an override of one of their fields."""
    at, places = error.span, [p for d in declared for p in (d.location, *d.fields.values())]
    return at is not None and any(p.source is error.source and p.span.start <= at.start < p.span.end for p in places)


# ------------------------------------------------------------------ as JSON


def _point(scene: Scene, report: Report, model: ModelResult) -> Json:
    from softmark.interpreter.study.expansion.resolution import resolution_of

    solve = {name: value for name, value in model.solve.items() if name != "history"}
    errors = _errors(scene, report, model)
    point = {
        "status": model.status, "message": model.message, "outline": model.outline, "size": dict(model.size),
        "solve": solve, "errors": errors, "measured_from": traces(scene, report, model.name, errors),
        "probes": {n: _probe(p) for n, p in model.probes.items()},
        "warnings": [{"code": w.code, "message": w.message} for w in _concerned(scene, report, model)],
        "resolution": resolution_of(scene, model.name),
    }  # fmt: skip
    if model.stated:
        point["stated"] = _stated(scene, model)
    cleaned: Json = clean(point)
    return cleaned


def _stated(scene: Scene, model: ModelResult) -> Json:
    """What the model states of the first relative metric against something, and of all (`of`)."""
    relative = (
        n for n, m in scene.of_kind("metric").items()
        if n in model.stated and m.thing.unit == "1" and m.thing.measured_from is not None
    )  # fmt: skip
    plain = next((n for n, said in model.stated.items() if said.get("unit", "1") == "1"), None)
    if (first := next(relative, plain)) is None:  # forces alone, none of them relative
        return {"value": None, "reason": "no relative error is asked for", "of": dict(model.stated)}
    return {**model.stated[first], "metric": first, "of": dict(model.stated)}


def _concerned(scene: Scene, report: Report, model: ModelResult) -> list[Warned]:
    """Warnings without those at other models, but for the models that this one is made from."""
    own = reached(scene, [model.name])
    others = [d.location for n, d in scene.of_kind("model").items() if n not in own]
    lines = [range(at.span.line, at.span.end_line + 1) for at in others if at.source is scene.source]
    return [w for w in report.warnings if w.line is None or not any(w.line in there for there in lines)]


def _reference(reference: ReferenceResult) -> Json:
    found: Json = clean({
        "kind": reference.kind, "source": reference.source, "status": reference.status,
        "message": reference.message, "estimated_error": reference.estimated_error,
        "probes": {n: _probe(p) for n, p in reference.probes.items()},
    })  # fmt: skip
    return found


def _probe(probe: ProbeResult) -> Json:
    from softmark.interpreter.results.thinning import picked

    some = picked(len(probe.points), POINTS)
    return {"points": probe.points[some].tolist(), "displacement": probe.displacement[some].tolist()}


def clean(value: Any) -> Any:
    """Plain JSON: what is not finite becomes null, what numpy made becomes Python's own."""
    if isinstance(value, Mapping):
        return {str(k): clean(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [clean(v) for v in value]
    if hasattr(value, "tolist"):
        return clean(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


# ------------------------------------------------------------------ errors


def _errors(scene: Scene, report: Report, model: ModelResult) -> Json:
    """Every metric but those about speed, which a shared processor would spoil; without comparisons, our own."""
    found, asked = {}, scene.of_kind("metric")
    for name, result in model.metrics.items():
        if asked[name].thing.looked_at is not None or asked[name].thing.concerned is not None:
            entry = {"value": result.value, "unit": result.unit, "against": _against(asked[name])}
            extra = {"reason": result.reason, "uncertainty": result.uncertainty}
            found[name] = entry | {n: v for n, v in extra.items() if v is not None}
    if not any(_against(m) for m in asked.values()):
        found |= _automatic(report, model)
    return found


def _against(metric: Declared) -> str | None:
    against: str | None = metric.thing.measured_from
    return against


def _automatic(report: Report, model: ModelResult) -> Json:
    """`PROBE against REFERENCE`: the relative l2 norm of every probe against every field of displacements."""
    return {
        f"{name} against {reference.name}": _relative(reference, probe, name)
        for reference in report.references.values()
        for name, probe in model.probes.items()
        if reference.status != "converged" or name in reference.probes
    }


def _relative(reference: ReferenceResult, probe: ProbeResult, name: str) -> Json:
    from softmark.interpreter.metrics.energy_norm import EnergyNorm
    from softmark.interpreter.metrics.undefined import Undefined

    entry: Json = {"value": None, "unit": EnergyNorm.unit, "against": reference.name}
    if name not in reference.probes:
        return entry | {"reason": f"the reference `{reference.name}` has no solution"}
    try:
        value = EnergyNorm(name, reference.name).value(
            probe.points, probe.displacement, reference.probes[name].displacement
        )
    except Undefined as undefined:
        return entry | {"reason": str(undefined)}
    return entry | {"value": value} if math.isfinite(value) else entry | {"reason": "it is not a finite number"}
