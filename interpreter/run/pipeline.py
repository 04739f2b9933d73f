"""Running a scene: prepare what the plan names, solve, look, judge. Each finished model is in the report at once."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark import pausing
from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.evidence.expectations import judge
from softmark.interpreter.evidence.force_check import loose, watched
from softmark.interpreter.evidence.selection_error import reactions
from softmark.interpreter.language import units
from softmark.interpreter.language.scene import Declared, Scene, SceneError
from softmark.interpreter.metrics.measure import metrics_of
from softmark.interpreter.models.prepare import from_a_model, measurement, prepared_model
from softmark.interpreter.models.shared.prepared import Prepared, Solution, Workshop
from softmark.interpreter.plan.plan import Plan, plan_of
from softmark.interpreter.problem.beam_theory import cantilever_of
from softmark.interpreter.problem.case import Case, Fault, case_for, case_of, fault
from softmark.interpreter.problem.parts.resultants import doubts, resultants
from softmark.interpreter.problem.points import (
    Place,
    above,
    drawn,
    facts_of,
    place_of,
    scanned,
    seen_finite,
    surface_of,
)
from softmark.interpreter.problem.view import View
from softmark.interpreter.results.history import History
from softmark.interpreter.results.report import (
    ModelResult,
    ProbeResult,
    ReferenceResult,
    Report,
    Shape,
    Timing,
    Warned,
    clean,
)
from softmark.interpreter.run.environment import describe, environment
from softmark.interpreter.run.names import names_of

if TYPE_CHECKING:
    from softmark.solvers.statics.equilibrium import Iteration

Say = Callable[[str, str], None]  # (what is being done, detail)


@dataclass
class Options:
    """How to run: which models, how many timed repetitions, whom to tell, where to keep unfinished reports."""

    only: tuple[str, ...] = ()
    repeat: int = 1
    say: Say = lambda what, detail: None
    keep: Callable[[Report], None] = lambda report: None
    warn: Callable[[Sequence[Diagnostic]], None] = lambda found: None
    draw: bool = True  # find the surfaces that a report shows
    stated: tuple[str, ...] | None = None  # which models are asked what error they state themselves; (): all
    free: bool = False  # the others say what is known of their error at no cost
    # how a reference is had: made, or known from another run of the same
    recall: Callable[[Scene, Declared, Callable[[], Any]], Any] = lambda scene, reference, make: make()


@dataclass
class _Run:
    scene: Scene
    options: Options
    plan: Plan
    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    prepared: dict[str, tuple[Prepared, float, float]] = field(default_factory=dict)
    models: dict[str, ModelResult] = field(default_factory=dict)
    references: dict[str, ReferenceResult] = field(default_factory=dict)
    views: dict[str, View] = field(default_factory=dict)
    measured: dict[str, Any] = field(default_factory=dict)  # what references of measured data hold
    places: dict[str, Place] = field(default_factory=dict)  # of probes
    surfaces: dict[str, Place] = field(default_factory=dict)  # of bodies, for pictures
    drawn: dict[str, np.ndarray] = field(default_factory=dict)  # displacements there, by reference
    warnings: list[Diagnostic] = field(default_factory=list)
    compiling: bool = False

    def case(self, declared: Declared) -> Case:
        """The case that a model or reference is about."""
        return case_for(self.scene, declared)

    def place(self, probe: Declared) -> Place:
        """The points of a probe, found once. Raises Fault."""
        if probe.name not in self.places:
            case = case_of(self.scene, probe.thing.body)
            self.places[probe.name] = place_of(probe, case, lambda name: self.measured[name].X)
        return self.places[probe.name]

    def probes(self, body: str) -> list[Declared]:
        """The probes of a body, without those of tracked points that could not be read."""
        own = [p for p in self.scene.of_kind("probe").values() if p.thing.body == body]
        return [p for p in own if p.thing.tracked in (None, *self.measured)]


def run(scene: Scene, warnings: list[Diagnostic], options: Options) -> Report:
    """The report of a scene. Raises SceneError before anything is solved if something cannot be built."""
    pausing.end()
    work = _Run(scene, options, plan_of(scene, options.only), warnings=list(warnings))
    _read_all(work)
    _place_all(work)
    _prepare_all(work)
    for name in work.plan.references:
        if not from_a_model(scene.declared[name]):
            options.say("reference", name)
            _reference(work, scene.declared[name])
    for name in work.plan.models:
        _model(work, name)
        options.keep(_report(work, partial=True))
    for name in work.plan.references:
        if from_a_model(scene.declared[name]):
            options.say("scan", name)
            _virtual(work, scene.declared[name])
    asked = () if options.stated is None else options.stated or tuple(work.models)
    if asked or options.free:
        from softmark.interpreter.evidence.stated_errors import state

        state(work, asked, options.free)
    return _report(work, partial=False)


# ------------------------------------------------------------------ models


def _place_all(work: _Run) -> None:
    """Find the points of every probe before anything is solved; report all that cannot be found. Raises SceneError."""
    plan, faults = work.plan, []
    bodies = {work.case(work.scene.declared[name]).body.name: None for name in (*plan.models, *plan.references)}
    for probe in (probe for body in bodies for probe in work.probes(body)):
        try:
            _warn(work, work.place(probe).notes)
        except Fault as error:
            faults.append(error.diagnostic)
    if faults:
        raise SceneError(list(dict.fromkeys(faults)))


def _prepare_all(work: _Run) -> None:
    """Build every model; report everything that cannot be built at once."""
    faults, workshop = [], Workshop(scene=work.scene, measured=work.measured)
    for name in work.plan.models:
        declared = work.scene.declared[name]
        case = work.case(declared)
        work.options.say("prepare", name)
        try:
            prepared, spent = prepared_model(declared, case, workshop)
            work.prepared[name] = (prepared, *spent)
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
    for probe in work.probes(body):
        if probe.thing.stations is None:
            continue
        if (distance := prepared.outside(work.place(probe).X)) > 0:
            field = "at" if "at" in probe.fields else "to"
            raise fault(
                "E504",
                probe.at(field),
                f"`{probe.name}` looks at a point {units.show(distance, units.LENGTH)} outside `{body}`",
                "not in the body",
                "give coordinates of the undeformed body",
            )


def _model(work: _Run, name: str) -> None:
    """Solve a model and keep what came of it."""
    case = work.case(declared := work.scene.declared[name])
    prepared, setup, setup_cpu = work.prepared[name]
    solution, wall, cpu = _timed(work, name, prepared)
    solution = watched(work.scene, declared, case, prepared, solution)
    history = solution.history
    clock = {
        "setup_s": Timing((setup,)),
        "solve_s": Timing(tuple(wall)) if wall else None,
        "step_s": Timing(history.step_s) if history and history.step_s else None,
        "setup_cpu_s": Timing((setup_cpu,)),
        "solve_cpu_s": Timing(tuple(cpu)) if cpu else None,
    }
    probes = {}
    if solution.displacement is not None:
        probes = _look(work, case.body.name, solution.displacement, history)
        if not all(map(seen_finite, probes.values())):
            reason, probes = "the displacements are not finite numbers", {}
            solution = Solution("failed", reason, solution.facts, notes=solution.notes)
    _warn(work, (*doubts(case, declared, loads := resultants(case, prepared)), *solution.notes))
    message = solution.message if solution.displacement is None else None
    work.views[name] = View(
        name,
        case.body.name,
        case,
        message or (None if solution.displacement else "it was not computed"),
        solution.displacement,
        probes,
        _weights(work, case.body.name),
        clock=clock,
        history=solution.history,
        solve=solution.facts,
    )
    outline, kind, held = declared.thing.outline(case), declared.thing.kind(case), reactions(case, prepared)
    found = (solution.status, solution.message, outline, prepared.size, solution.facts, clock, probes)
    work.models[name] = ModelResult(name, *found, mesh=solution.mesh, loads=loads, reactions=held, kind=kind)


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
    kernels: Any = sys.modules.get("softmark.solvers.base.jit")
    cold = not work.compiling and kernels is not None and not kernels.compiled()
    work.compiling |= cold
    say, begin, before = work.options.say, time.perf_counter(), kernels.made() if kernels else 0
    say("compile", "compiling kernels, once for this version") if cold else say("solve", name)
    prepared.warm()
    if work.compiling and kernels and kernels.made() > before:
        say("compiled", f"compiling kernels: {kernels.made() - before}, {time.perf_counter() - begin:.0f} s")


# ------------------------------------------------------------------ references


def _read_all(work: _Run) -> None:
    """Read measured data first: probes and supports may lie where something was measured."""
    for name in work.plan.references:
        thing = work.scene.declared[name].thing
        if thing.how == "measured":
            work.options.say("reference", f"reading {name}")
            try:
                work.measured[name] = _measurement(work, work.scene.declared[name])
            except Exception as failure:  # whatever is wrong with a file, the models can still be computed
                if os.environ.get("SOFTMARK_DEBUG"):
                    raise
                _failed(work, work.scene.declared[name], str(failure))


def _measurement(work: _Run, declared: Declared) -> Any:
    return work.options.recall(work.scene, declared, lambda: measurement(work.scene, declared))


def _failed(work: _Run, declared: Declared, message: str) -> None:
    cls, case = type(declared.thing), work.case(declared)
    work.views[declared.name] = View(declared.name, case.body.name, case, message)
    work.references[declared.name] = ReferenceResult(declared.name, "failed", message, cls.kind, cls.source)


def _reference(work: _Run, declared: Declared) -> None:
    """Solve a reference, or look at what was measured."""
    if declared.name in work.references:  # it could not be read
        return
    try:
        if declared.name in work.measured:
            _keep_measured(work, declared, work.measured[declared.name])
            return
        if declared.thing.how == "refined":
            _keep_refined(work, declared)
            return
        line = work.options.recall(
            work.scene, declared, lambda: declared.thing.solve(cantilever_of(declared, work.case(declared)))
        )
        error = float(line.estimated_error)
        _keep_reference(work, declared, lambda X: above(line.displacement(X), error), error)
    except Fault as refused:
        raise SceneError([refused.diagnostic]) from refused
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        _failed(work, declared, str(failure))


def _keep_refined(work: _Run, declared: Declared) -> None:
    """The limit of models that are refined, over all points that are asked for."""
    from softmark.interpreter.evidence.refinement import settled

    places = [work.place(p).X for p in work.probes(work.case(declared).body.name)]
    points = np.concatenate([np.zeros((0, 3)), *places])
    found = work.options.recall(
        work.scene, declared, lambda: settled(work.scene, declared, points, work.measured, work.options.say)
    )
    _keep_reference(work, declared, found.displacement, found.estimated_error, found.facts)


def _keep_reference(
    work: _Run,
    declared: Declared,
    displacement: Callable[[Any], Any],
    error: float,
    facts: Mapping[str, Any] | None = None,
) -> None:
    """A reference that has a field of displacements."""
    cls, case = type(declared.thing), work.case(declared)
    probes = _look(work, case.body.name, displacement)
    if not (np.isfinite(error) and all(map(seen_finite, probes.values()))):
        _failed(work, declared, "its displacements are not finite numbers")
        return
    weights = _weights(work, case.body.name)
    work.views[declared.name] = View(
        declared.name, case.body.name, case, None, displacement, probes, weights, uncertainty=error
    )
    work.references[declared.name] = ReferenceResult(
        declared.name, "converged", None, cls.kind, cls.source, error, probes, facts=clean(facts or {})
    )


def _keep_measured(work: _Run, declared: Declared, data: Any) -> None:
    """A measured surface, or the displacements of tracked points."""
    cls, case = type(declared.thing), work.case(declared)
    surface = data if hasattr(data, "triangles") else None
    if declared.thing.registered == "icp":

        def surface(points: np.ndarray, triangles: np.ndarray) -> Any:
            return declared.thing.load(target=(points, triangles))

    resolution = getattr(data, "resolution", data.uncertainty)  # with what registering it has left
    probes = {}
    if surface is None:
        for probe in work.probes(case.body.name):
            if probe.thing.tracked == declared.name:
                X = work.place(probe).X
                probes[probe.name] = ProbeResult(X, data.displacement(X))
    if not (np.isfinite(resolution) and all(map(seen_finite, probes.values()))):
        _failed(work, declared, "what was measured is not finite numbers")
        return
    work.views[declared.name] = View(
        declared.name, case.body.name, case, None, None, probes, surface=surface, uncertainty=resolution
    )
    work.references[declared.name] = ReferenceResult(
        declared.name,
        "converged",
        None,
        cls.kind,
        getattr(data, "source", "") or cls.source,
        resolution,
        probes,
        shape=Shape(data.points, data.triangles) if hasattr(data, "triangles") else None,
        facts=clean(facts_of(data)),
    )


def _virtual(work: _Run, declared: Declared) -> None:
    """A scan of a shape that a model computed: what an imaging chain makes of known truth."""
    thing, model = declared.thing, work.views.get(declared.thing.of)
    if model is None or model.displacement is None:
        _failed(work, declared, f"the model `{thing.of}` has no shape to scan")
        return
    place = scanned(model.case)
    try:
        data = thing.load(place.X + model.displacement(place.X), place.triangles)
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        _failed(work, declared, str(failure))
        return
    _keep_measured(work, declared, data)


# ------------------------------------------------------------------ looking and judging


def _look(
    work: _Run, body: str, displacement: Callable[[Any], Any], history: History | None = None
) -> dict[str, ProbeResult]:
    found = {}
    for probe in work.probes(body):
        place = work.place(probe)
        times = course = None
        if history is not None and place.triangles is None and place.weights is None:
            times, course = history.times, np.asarray(history.displacement(place.X))
        u = np.asarray(displacement(place.X))
        found[probe.name] = ProbeResult(place.X, u, times, course, place.triangles)
    return found


def _weights(work: _Run, body: str) -> dict[str, np.ndarray]:
    places = {p.name: work.place(p) for p in work.probes(body)}
    return {name: place.weights for name, place in places.items() if place.weights is not None}


# ------------------------------------------------------------------ the report


def _measure(work: _Run, partial: bool) -> None:
    """Metrics and shapes of what is there; in an unfinished report, of what is new since the last."""
    results: list[dict[str, Any]] = [work.models, work.references]
    for kept in results:
        for name, result in kept.items():
            if partial and result.metrics:
                continue
            metrics, errors = metrics_of(work.scene, work.views[name], work.views)
            shape = _shape(work, name, errors) if work.options.draw and not partial else None
            kept[name] = replace(result, metrics=metrics, shape=shape or result.shape)


def _shape(work: _Run, name: str, errors: dict[str, np.ndarray]) -> Shape | None:
    """The surface of a body as a model or a theory has it, coloured by its error where there is one."""
    view = work.views[name]
    if view.displacement is None:
        return None
    probe = next((p for p in work.probes(view.body) if work.place(p).triangles is not None), None)
    if view.body not in work.surfaces:
        work.surfaces[view.body] = work.place(probe) if probe else drawn(view.case)
    place, u = work.surfaces[view.body], _drawn(work, view)
    asked = {m.name: m.thing for m in work.scene.of_kind("metric").values()}
    for metric, error in errors.items():
        if probe is not None and asked[metric].probe == probe.name:
            return surface_of(view, place, u, error, asked[metric].measured_from)
    fields = (v for v in work.views.values() if v.name in work.references and v.body == view.body)
    known = next((v for v in fields if v.displacement is not None), None)
    if known is None or known.name == name:
        return surface_of(view, place, u, None, None)
    error = np.linalg.norm(u - _drawn(work, known), axis=1)
    return surface_of(view, place, u, error, known.name)


def _drawn(work: _Run, view: View) -> np.ndarray:
    """The displacements (n, 3) of a body's surface in m; of a reference, which all models are compared with, kept."""
    if view.displacement is None:
        raise ValueError(f"{view.name} has no displacements")
    if view.name in work.drawn:
        return work.drawn[view.name]
    u = np.asarray(view.displacement(work.surfaces[view.body].X))
    if view.name in work.references:
        work.drawn[view.name] = u
    return u


def _report(work: _Run, partial: bool) -> Report:
    _measure(work, partial)
    if not partial:
        _warn(work, loose(work.scene, work.models))
    warnings = tuple(
        Warned(d.code, d.message, d.span.line if d.span and d.source is work.scene.source else None, d.help)
        for d in dict.fromkeys(work.warnings)
    )
    expectations = (
        ()
        if partial
        else tuple(judge(work.scene, {**work.models, **work.references}, e) for e in work.scene.expectations)
    )
    return Report(
        describe(work.scene),
        environment(work.started),
        dict(work.models),
        dict(work.references),
        expectations,
        warnings,
        partial,
        names_of(work.scene),
    )
