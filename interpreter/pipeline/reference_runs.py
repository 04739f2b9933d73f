"""References of a run: data that was measured, theories and limits that are solved, scans of what models computed."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, SceneError
from softmark.interpreter.language.plugin_words import find_faulty_plugin
from softmark.interpreter.metrics.curve_geometry import Curve
from softmark.interpreter.models.model_preparation import from_a_model, measurement
from softmark.interpreter.pipeline import probe_sampling
from softmark.interpreter.pipeline.run_state import Work
from softmark.interpreter.problem.body_case import Fault
from softmark.interpreter.problem.probe_points import above, facts_of, scanned, seen_finite
from softmark.interpreter.problem.solution import View
from softmark.interpreter.problem.theory_problems import at_rest_of, doubt_of_theory, facts_of_theory, solved, stress_of
from softmark.interpreter.results.even_thinning import picked
from softmark.interpreter.results.reaction_results import AtRest
from softmark.interpreter.results.run_report import ProbeResult, ReferenceResult, SeenCurve, SeenSurface, clean
from softmark.records import dataclass
from softmark.references.code_consensus import ConsensusCurve
from softmark.references.measured_curve import MeasuredCurve
from softmark.references.measured_data import MeasuredSurface
from softmark.references.published_values import KnownValue

SLOW = 2.0  # s of a reference, above which what it took is said
DRAWN = 400  # points of a measured curve that a report keeps


@dataclass(frozen=True)
class Known:
    """What a theory may know beside displacements: forces, stress as a model has it, why it may be no truth here."""

    rest: AtRest | None = None
    stress: Callable[[], Any] | None = None
    doubt: str | None = None


def read(work: Work) -> None:
    """Read measured data first: probes and supports may lie where something was measured."""
    for name in work.plan.references:
        thing = work.scene.declared[name].thing
        if thing.how == "measured" and not _known_before(work, name):
            with _timed(work, name, "reading "):
                _read(work, work.scene.declared[name])


@contextmanager
def _timed(work: Work, name: str, doing: str = "") -> Iterator[None]:
    """Say which reference is looked at, and how long that took where it was slow."""
    work.options.say("reference", f"{doing}{name}{work.where}")
    begin = time.perf_counter()
    yield
    if (spent := time.perf_counter() - begin) > SLOW:
        work.options.say("took", f"{doing}reference {name}{work.where}: {spent:.0f} s")


def _read(work: Work, declared: Declared) -> None:
    """Whatever is wrong with a file, the models can still be computed."""
    try:
        work.measured[declared.name] = _measurement(work, declared)
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        _failed(work, declared, find_faulty_plugin(failure) or str(failure))


def _known_before(work: Work, name: str) -> bool:
    """Take over what the state before has read, where this one asks for the same of a file."""
    before, declared = work.before, work.scene.declared[name]
    if before is None or before.scene.declared[name].thing != declared.thing:
        return False
    if name in before.measured:
        work.measured[name] = before.measured[name]
    elif (failed := before.references.get(name)) is not None:
        _failed(work, declared, failed.message or "")
    return name in before.measured or name in before.references


def solve(work: Work) -> None:
    """Solve, or look at, every reference that is asked for and needs no model. Raises SceneError."""
    for name in work.plan.references:
        if not from_a_model(work.scene.declared[name]):
            with _timed(work, name):
                _reference(work, work.scene.declared[name])


def scan(work: Work) -> None:
    """Make the references that are made from what models computed."""
    for name in work.plan.references:
        if from_a_model(work.scene.declared[name]):
            with _timed(work, name):
                _virtual(work, work.scene.declared[name])


def _measurement(work: Work, declared: Declared) -> Any:
    return work.options.recall(work.scene, declared, lambda: measurement(work.scene, declared))


def _failed(work: Work, declared: Declared, message: str) -> None:
    cls, case = type(declared.thing), work.case(declared)
    work.views[declared.name] = View(declared.name, case.body.name, case, message)
    work.references[declared.name] = ReferenceResult(
        declared.name, "failed", message, declared.thing.kind, cls.source, means=cls.means
    )


def _reference(work: Work, declared: Declared) -> None:
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
        case = work.case(declared)
        found = work.options.recall(work.scene, declared, lambda: solved(declared, case))
        error, rest = float(found.estimated_error), at_rest_of(declared, case, found)
        more = Known(rest, stress_of(declared, found), doubt_of_theory(declared, found))
        facts = facts_of_theory(declared, found)
        displacement = (lambda X: above(found.displacement(X), error)) if declared.thing.with_displacements else None
        _keep_reference(work, declared, displacement, error, facts, more)
    except Fault as refused:
        raise SceneError([refused.diagnostic]) from refused
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        _failed(work, declared, find_faulty_plugin(failure) or str(failure))


def _keep_refined(work: Work, declared: Declared) -> None:
    """The limit of models that are refined, over all points that are asked for."""
    from softmark.interpreter.verification.refinement_family import settled

    places = [work.place(p).X for p in work.probes(work.case(declared).body.name)]
    points = np.concatenate([np.zeros((0, 3)), *places])
    found = work.options.recall(
        work.scene, declared, lambda: settled(work.scene, declared, points, work.measured, work.options.say)
    )
    _keep_reference(work, declared, found.displacement, found.estimated_error, found.facts)


def _keep_reference(
    work: Work,
    declared: Declared,
    displacement: Callable[[Any], Any] | None,
    error: float,
    facts: Mapping[str, Any] | None = None,
    more: Known | None = None,
) -> None:
    """A reference that has a field of displacements, or forces alone."""
    cls, case = type(declared.thing), work.case(declared)
    seen = {} if displacement is None else probe_sampling.look(work, case.body.name, displacement)
    if not (np.isfinite(error) and all(map(seen_finite, seen.values()))):
        _failed(work, declared, "its displacements are not finite numbers")
        return
    weights = probe_sampling.weights(work, case.body.name)
    more = more or Known()
    work.views[declared.name] = View(
        declared.name,
        case.body.name,
        case,
        None,
        displacement,
        seen,
        weights,
        probe_sampling.domains(work, case.body.name),
        uncertainty=error,
        at_rest=more.rest,
        stress=more.stress,
        doubt=more.doubt,
    )
    work.references[declared.name] = ReferenceResult(
        declared.name, "converged", None, declared.thing.kind, cls.source, error, seen, facts=clean(facts or {}),
        means=cls.means,
    )  # fmt: skip


def _keep_curve(work: Work, declared: Declared, data: MeasuredCurve) -> None:
    """A curve: it has no displacements of points."""
    cls, case, thing = type(declared.thing), work.case(declared), declared.thing
    work.views[declared.name] = View(
        declared.name, case.body.name, case, curve=Curve(data.x, data.y, data.u, data.lost_between, data.band)
    )
    chosen = picked(len(data.x), DRAWN)
    named = tuple(units.si_unit(amount.dimension) for amount in (thing.x_unit, thing.y_unit))
    band = None if data.band is None else (data.band[0][chosen], data.band[1][chosen])
    drawn = SeenCurve(data.x[chosen], data.y[chosen], (named[0], named[1]), data.u[chosen], band)
    facts = {
        "uncertainty": data.resolution, "unit": named[1], "repeats": data.repeats, "spread": data.spread,
        "rows": len(data.x), "from": data.x[0], "to": data.x[-1], "lost": data.lost, "notes": list(data.notes),
    }  # fmt: skip
    facts |= {"codes": thing.agreed} if isinstance(thing, ConsensusCurve) else {}
    found = ("converged", None, thing.kind, data.source or cls.source)  # its error is no length, but in its facts
    work.references[declared.name] = ReferenceResult(declared.name, *found, facts=clean(facts), drawn=drawn)


def _keep_value(work: Work, declared: Declared, data: KnownValue) -> None:
    """A value of one state: it has no displacements of points."""
    case, unit = work.case(declared), units.si_unit(declared.thing.values.dimension)
    work.views[declared.name] = View(declared.name, case.body.name, case, value=data)
    facts = {"value": data.value, "uncertainty": data.uncertainty, "unit": unit}
    if data.band is not None:
        facts |= {"low": data.band[0], "high": data.band[1], "codes": data.codes}
    found = ("converged", None, declared.thing.kind, data.source)  # its error is no length, but in its facts
    work.references[declared.name] = ReferenceResult(declared.name, *found, facts=clean(facts))


def _keep_measured(work: Work, declared: Declared, data: Any) -> None:
    """A measured surface, the displacements of tracked points, a curve or a value."""
    if isinstance(data, MeasuredCurve):
        _keep_curve(work, declared, data)
        return
    if isinstance(data, KnownValue):
        _keep_value(work, declared, data)
        return
    cls, case = type(declared.thing), work.case(declared)
    surface: Any = data if isinstance(data, MeasuredSurface) else None
    if declared.thing.registered == "icp":

        def surface(points: np.ndarray, triangles: np.ndarray) -> Any:
            return declared.thing.load(target=(points, triangles))

    resolution = data.resolution  # with what registering it has left
    seen = {}
    if surface is None:
        for probe in work.probes(case.body.name):
            if probe.thing.tracked == declared.name:
                X = work.place(probe).X
                seen[probe.name] = ProbeResult(X, data.displacement(X))
    if not (np.isfinite(resolution) and all(map(seen_finite, seen.values()))):
        _failed(work, declared, "what was measured is not finite numbers")
        return
    work.views[declared.name] = View(
        declared.name, case.body.name, case, None, None, seen, surface=surface, uncertainty=resolution
    )
    work.references[declared.name] = ReferenceResult(
        declared.name,
        "converged",
        None,
        declared.thing.kind,
        data.source or cls.source,
        resolution,
        seen,
        shape=SeenSurface(data.points, data.triangles) if isinstance(data, MeasuredSurface) else None,
        facts=clean(facts_of(data)),
    )


def _virtual(work: Work, declared: Declared) -> None:
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
