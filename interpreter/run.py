"""Running a scene: prepare what the plan names, solve, look, judge. Each finished model is in the report at once."""

from __future__ import annotations

import hashlib
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter import units
from softmark.interpreter.cantilever import cantilever_of
from softmark.interpreter.case import Fault, body_of, case_of, fault
from softmark.interpreter.expectations import truth
from softmark.interpreter.expressions import Bad, Evaluator, Place, Quantity, Value
from softmark.interpreter.metrics.undefined import Undefined
from softmark.interpreter.models.prepared import Prepared, Solution, Workshop
from softmark.interpreter.plan import Plan, named_in, plan_of
from softmark.interpreter.results import (
    ExpectationResult,
    MetricResult,
    ModelResult,
    ProbeResult,
    ReferenceResult,
    Report,
    Timing,
    Warned,
)
from softmark.interpreter.scene import Declared, Expectation, Scene, SceneError

if TYPE_CHECKING:
    from softmark.grammar import tree
    from softmark.solvers.statics import Iteration

Say = Callable[[str, str], None]  # (what is being done, detail)


@dataclass
class Options:
    """How to run: which models, how many timed repetitions, whom to tell, where to keep unfinished reports."""

    only: tuple[str, ...] = ()
    repeat: int = 1
    say: Say = lambda what, detail: None
    keep: Callable[[Report], None] = lambda report: None
    warn: Callable[[Sequence[Diagnostic]], None] = lambda found: None


@dataclass
class _Run:
    scene: Scene
    options: Options
    plan: Plan
    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    prepared: dict[str, tuple[Prepared, float, float]] = field(default_factory=dict)
    models: dict[str, ModelResult] = field(default_factory=dict)
    references: dict[str, ReferenceResult] = field(default_factory=dict)
    warnings: list[Diagnostic] = field(default_factory=list)
    compiling: bool = False


def run(scene: Scene, warnings: list[Diagnostic], options: Options) -> Report:
    """The report of a scene. Raises SceneError before anything is solved if something cannot be built."""
    work = _Run(scene, options, plan_of(scene, options.only), warnings=list(warnings))
    _prepare_all(work)
    for name in work.plan.references:
        options.say("reference", name)
        work.references[name] = _reference(work, scene.declared[name])
    for name in work.plan.models:
        work.models[name] = _model(work, name)
        options.keep(_report(work, partial=True))
    return _report(work, partial=False)


# ------------------------------------------------------------------ models


def _prepare_all(work: _Run) -> None:
    """Build every model; report everything that cannot be built at once."""
    faults, workshop = [], Workshop()
    for name in work.plan.models:
        declared = work.scene.declared[name]
        case = case_of(work.scene, body_of(work.scene, declared))
        work.options.say("prepare", name)
        declared.thing.load()
        workshop.borrowed = (0.0, 0.0)
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            prepared = declared.thing.prepare(declared, case, workshop)
            spent = time.perf_counter() - wall, time.process_time() - cpu
            # a mesh that another model has made costs this one what it cost that one
            work.prepared[name] = (prepared, spent[0] + workshop.borrowed[0], spent[1] + workshop.borrowed[1])
            _probes_inside(work, case.body.name, prepared)
        except Fault as error:
            faults.append(error.diagnostic)
        else:
            _warn(work, prepared.notes)
    if faults:
        raise SceneError(list(dict.fromkeys(faults)))


def _warn(work: _Run, found: Sequence[Diagnostic]) -> None:
    """Keep warnings for the report, and show them."""
    work.warnings.extend(found)
    work.options.warn(found)


def _probes_inside(work: _Run, body: str, prepared: Prepared) -> None:
    """Refuse probes outside a mesh that was read from a file (shapes of our own are checked exactly)."""
    outside = getattr(prepared, "outside", None)
    if outside is None:
        return
    for probe in _probes(work, body):
        if (distance := outside(np.array(probe.thing.stations))) > 0:
            field = "at" if "at" in probe.fields else "to"
            raise fault(
                "E504",
                probe.at(field),
                f"`{probe.name}` looks at a point {units.show(distance, units.LENGTH)} outside `{body}`",
                "not in the body",
                "give coordinates of the undeformed body",
            )


def _model(work: _Run, name: str) -> ModelResult:
    declared = work.scene.declared[name]
    case = case_of(work.scene, body_of(work.scene, declared))
    prepared, setup, setup_cpu = work.prepared[name]
    outline = declared.thing.outline(case)
    solution, wall, cpu = _timed(work, name, prepared)
    clock = {
        "setup_s": Timing((setup,)),
        "solve_s": Timing(tuple(wall)) if wall else None,
        "step_s": None,
        "setup_cpu_s": Timing((setup_cpu,)),
        "solve_cpu_s": Timing(tuple(cpu)) if cpu else None,
    }
    probes = {}
    if solution.displacement is not None:
        probes = _look(work, case.body.name, solution.displacement)
        if not all(np.all(np.isfinite(p.displacement)) for p in probes.values()):
            solution, probes = (
                Solution("failed", "the displacements are not finite numbers", solution.facts),
                {},
            )
    _warn(work, solution.notes)
    metrics = _metrics(work, name, case.body.name, probes, solution.message)
    return ModelResult(
        name,
        solution.status,
        solution.message,
        outline,
        prepared.size,
        solution.facts,
        clock,
        probes,
        metrics,
    )


def _timed(work: _Run, name: str, prepared: Prepared) -> tuple[Solution, list[float], list[float]]:
    """The solution, and wall and CPU seconds of each repetition; kernels are ready before the clock starts."""
    wall: list[float] = []
    cpu: list[float] = []
    solution = Solution("failed", "not run", {})

    def watch(iteration: Iteration) -> None:
        work.options.say(
            "solve",
            f"{name}: {iteration.phase}, iteration {iteration.number + 1}, residual {iteration.residual:.1e}",
        )

    try:
        _warm(work, name, prepared)
        for _ in range(work.options.repeat):
            start = time.perf_counter(), time.process_time()
            solution = prepared.solve(watch)
            wall.append(time.perf_counter() - start[0])
            cpu.append(time.process_time() - start[1])
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        what = "out of memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
        return Solution("failed", f"the solver stopped with an error ({what})", {}), wall, cpu
    return solution, wall, cpu


def _warm(work: _Run, name: str, prepared: Prepared) -> None:
    if (
        not work.compiling
        and "softmark.solvers.jit" in sys.modules
        and not sys.modules["softmark.solvers.jit"].compiled()
    ):
        work.compiling = True
        work.options.say("compile", "compiling kernels, once for this version")
    else:
        work.options.say("solve", name)
    prepared.warm()


# ------------------------------------------------------------------ references


def _reference(work: _Run, declared: Declared) -> ReferenceResult:
    cls, body = type(declared.thing), body_of(work.scene, declared)
    try:
        line = declared.thing.solve(cantilever_of(declared, case_of(work.scene, body)))
        error = float(line.estimated_error)
        probes = _look(work, body, lambda X: _above(line.displacement(X), error))
    except Fault as refused:
        raise SceneError([refused.diagnostic]) from refused
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        return ReferenceResult(declared.name, "failed", str(failure), cls.kind, cls.source)
    return ReferenceResult(declared.name, "converged", None, cls.kind, cls.source, error, probes)


def _above(u: np.ndarray, error: float) -> np.ndarray:
    """Displacements (n, 3), zero where they are below the reference's own error: such numbers say nothing."""
    return np.where(np.linalg.norm(u, axis=1, keepdims=True) > error, u, 0.0)


# ------------------------------------------------------------------ looking and judging


def _probes(work: _Run, body: str) -> list[Declared]:
    return [p for p in work.scene.of_kind("probe").values() if p.thing.body == body]


def _look(work: _Run, body: str, displacement: Callable[[Any], Any]) -> dict[str, ProbeResult]:
    found = {}
    for probe in _probes(work, body):
        X = np.array(probe.thing.stations)
        found[probe.name] = ProbeResult(X, np.asarray(displacement(X)))
    return found


def _metrics(
    work: _Run, owner: str, body: str, probes: dict[str, ProbeResult], message: str | None
) -> dict[str, MetricResult]:
    found = {}
    for metric in work.scene.of_kind("metric").values():
        if (
            work.scene.declared[metric.thing.probe].thing.body == body
            and getattr(metric.thing, "against", None) != owner
        ):
            found[metric.name] = _metric(work, metric, probes, message)
    return found


def _metric(
    work: _Run, metric: Declared, probes: dict[str, ProbeResult], message: str | None
) -> MetricResult:
    thing = metric.thing
    if thing.probe not in probes:
        return MetricResult(None, thing.unit, message or "it was not computed")
    against = getattr(thing, "against", None)
    known = None
    if against is not None:
        reference = work.references.get(against)
        if reference is None or thing.probe not in reference.probes:
            return MetricResult(None, thing.unit, f"the reference `{against}` has no solution")
        known = reference.probes[thing.probe].displacement
    own = probes[thing.probe]
    try:
        value = float(thing.value(own.points, own.displacement, known))
    except Undefined as undefined:
        return MetricResult(None, thing.unit, str(undefined))
    if not math.isfinite(value):
        return MetricResult(None, thing.unit, "the value is not a finite number")
    return MetricResult(value, thing.unit)


def _judge(work: _Run, expectation: Expectation) -> ExpectationResult:
    text, line = expectation.text, expectation.location.span.line
    missing = sorted(
        named_in(expectation.node) - set(work.models) - set(work.references) - set(work.scene.parameters)
    )
    if missing:
        return ExpectationResult(
            text, line, None, None, reason=f"{', '.join(missing)} was not run", left_out=True
        )
    place = Place(expectation.location.source, [])
    evaluator = Evaluator(place, lambda name: _known(work, name))
    try:
        passed = truth(expectation.node, evaluator)
        first = _first_value(expectation.node, evaluator)
    except _NoValue as nothing:
        return ExpectationResult(text, line, None, None, reason=str(nothing))
    except Bad as bad:
        return ExpectationResult(text, line, None, None, reason=str(bad))
    return ExpectationResult(
        text, line, passed, first.value if first else None, units.si(first.dimension) if first else ""
    )


class _NoValue(Exception):
    """A metric that an expectation names has no value."""


def _known(work: _Run, name: tree.Name) -> Value:
    """The value of a metric or of a parameter, after the run."""
    if name.text in work.scene.parameters:
        return work.scene.parameters[name.text].value
    owner, metric = name.parts
    result: ModelResult | ReferenceResult = (
        work.models[owner] if owner in work.models else work.references[owner]
    )
    known = result.metrics.get(metric)
    if known is None or known.value is None:
        raise _NoValue(f"{name.text} has no value" + (f": {known.reason}" if known and known.reason else ""))
    return Quantity(known.value, units.parse(known.unit).dimension)


def _first_value(node: Any, evaluator: Evaluator) -> Quantity | None:
    """What an expectation is about: the first operand of its comparison."""
    from softmark.grammar import tree

    comparison = next((n for n, _ in tree.walk(node) if isinstance(n, tree.Compare)), None)
    return evaluator.quantity(comparison.operands[0]) if comparison else None


# ------------------------------------------------------------------ the report


def _report(work: _Run, partial: bool) -> Report:
    if not partial:
        for name, reference in work.references.items():
            body = body_of(work.scene, work.scene.declared[name])
            metrics = _metrics(work, name, body, dict(reference.probes), reference.message)
            work.references[name] = replace(reference, metrics=metrics)
    warnings = tuple(
        Warned(d.code, d.message, d.span.line if d.span and d.source is work.scene.source else None, d.help)
        for d in dict.fromkeys(work.warnings)
    )
    expectations = () if partial else tuple(_judge(work, e) for e in work.scene.expectations)
    return Report(
        describe(work.scene),
        environment(work.started),
        dict(work.models),
        dict(work.references),
        expectations,
        warnings,
        partial,
    )


def describe(scene: Scene) -> dict[str, Any]:
    """Title, file, digest, text and parameters of a scene."""
    source: Source = scene.source
    parameters = {}
    for name, p in scene.parameters.items():
        value = p.value.value if isinstance(p.value, Quantity) else list(p.value.values)
        parameters[name] = {"value": value, "unit": units.si(p.value.dimension), "text": p.text}
    return {
        "title": scene.title,
        "file": scene.path or source.name,
        "sha256": hashlib.sha256(source.text.encode()).hexdigest(),
        "parameters": parameters,
        "text": source.text,
        "overridden": sorted(n for n, p in scene.parameters.items() if p.overridden),
        "overrides": list(scene.overrides),
    }


def environment(started: datetime) -> dict[str, Any]:
    """What a number may depend on besides the scene."""
    from importlib.metadata import version

    import softmark

    return {
        "softmark": softmark.__version__,
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        "numba": version("numba"),
        "platform": platform.platform(),
        "cpu": _cpu(),
        "threads": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "started": started.isoformat(timespec="seconds"),
    }


def _cpu() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next(
                (line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "unknown"
            )
    except OSError:
        return platform.processor() or "unknown"
