"""References of a run: measured data, theories, converged limits, and virtual scans of computed shapes."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, SceneError
from softmark.interpreter.language.loaded_plugin import find_faulty_plugin
from softmark.interpreter.metrics.curve_geometry import Curve
from softmark.interpreter.models.model_preparation import from_a_model, measurement
from softmark.interpreter.pipeline import probe_sampling
from softmark.interpreter.pipeline.run_state import StateRun
from softmark.interpreter.problem.body_case import Fault
from softmark.interpreter.problem.probe_points import facts_of, is_finite_probe, scan_surface, zero_below_error
from softmark.interpreter.problem.solution import View
from softmark.interpreter.problem.theories import theory_setup_of
from softmark.interpreter.problem.theories.reference_solution import solve_theory
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.reaction_results import EquilibriumForces
from softmark.interpreter.results.run_report import (
    DrawnSurface,
    PlottedCurve,
    ProbeResult,
    ReferenceResult,
    to_plain_json,
)
from softmark.records import dataclass
from softmark.references.code_consensus import ConsensusCurve
from softmark.references.measured_curve import MeasuredCurve
from softmark.references.measured_data import MeasuredSurface
from softmark.references.published_values import KnownValue

SLOW = 2.0  # s, above which the time of a reference is reported
DRAWN = 400  # maximum number of points of a measured curve in a report


@dataclass(frozen=True)
class TheoryResults:
    """Additional results of a theory: forces, stress in a model's form, and reasons for inexact results."""

    rest: EquilibriumForces | None = None
    stress: Callable[[], Any] | None = None
    doubt: str | None = None


def read_measurements(work: StateRun) -> None:
    """Read the measured data before any other step, since measured points may define probes and supports."""
    for name in work.plan.references:
        thing = work.scene.declared[name].thing
        if thing.how == "measured" and not _reuse_previous_state(work, name):
            with _report_progress(work, name, "reading "):
                _read_measurement(work, work.scene.declared[name])


@contextmanager
def _report_progress(work: StateRun, name: str, doing: str = "") -> Iterator[None]:
    """Report the reference `name` as the current task, and its computing time if it was slow."""
    work.options.say("reference", f"{doing}{name}{work.where}")
    begin = time.perf_counter()
    yield
    if (spent := time.perf_counter() - begin) > SLOW:
        work.options.say("took", f"{doing}reference {name}{work.where}: {spent:.0f} s")


def _read_measurement(work: StateRun, declared: Declared) -> None:
    """Read one file of measured data; after an error in the file the models are still solved."""
    try:
        work.measured[declared.name] = _load_measurement(work, declared)
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        _record_failed_reference(work, declared, find_faulty_plugin(failure) or str(failure))


def _reuse_previous_state(work: StateRun, name: str) -> bool:
    """Reuse a reference of the previous state if its declaration is unchanged; return whether it was reused."""
    before, declared = work.before, work.scene.declared[name]
    if before is None or before.scene.declared[name].thing != declared.thing:
        return False
    if name in before.measured:
        work.measured[name] = before.measured[name]
    elif (failed := before.references.get(name)) is not None:
        _record_failed_reference(work, declared, failed.message or "")
    return name in before.measured or name in before.references


def solve_references(work: StateRun) -> None:
    """Solve or evaluate every requested reference that needs no model. Raises SceneError."""
    for name in work.plan.references:
        if not from_a_model(work.scene.declared[name]):
            with _report_progress(work, name):
                _solve_reference(work, work.scene.declared[name])


def compute_model_references(work: StateRun) -> None:
    """Compute the references that depend on models."""
    for name in work.plan.references:
        if from_a_model(work.scene.declared[name]):
            with _report_progress(work, name):
                _compute_virtual_scan(work, work.scene.declared[name])


def _load_measurement(work: StateRun, declared: Declared) -> Any:
    return work.options.recall(work.scene, declared, lambda: measurement(work.scene, declared))


def _record_failed_reference(work: StateRun, declared: Declared, message: str) -> None:
    cls, case = type(declared.thing), work.case(declared)
    work.views[declared.name] = View(declared.name, case.body.name, case, message)
    work.references[declared.name] = ReferenceResult(
        declared.name, "failed", message, declared.thing.kind, cls.source, means=cls.means
    )


def _solve_reference(work: StateRun, declared: Declared) -> None:
    """Solve a reference, or evaluate measured data."""
    if declared.name in work.references:  # it could not be read
        return
    try:
        if declared.name in work.measured:
            _store_measured_data(work, declared, work.measured[declared.name])
            return
        if declared.thing.how == "refined":
            _store_refined_limit(work, declared)
            return
        case = work.case(declared)
        found = work.options.recall(work.scene, declared, lambda: solve_theory(declared, case))
        setup, error = theory_setup_of(declared), float(found.estimated_error)
        stress = setup.stress(found)
        more = TheoryResults(
            setup.forces(case, found), None if stress is None else lambda: stress, setup.warning(found)
        )
        displacement = (
            (lambda X: zero_below_error(found.displacement(X), error)) if declared.thing.with_displacements else None
        )
        _store_reference(work, declared, displacement, error, setup.facts(found), more)
    except Fault as refused:
        raise SceneError([refused.diagnostic]) from refused
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        _record_failed_reference(work, declared, find_faulty_plugin(failure) or str(failure))


def _store_refined_limit(work: StateRun, declared: Declared) -> None:
    """Store the converged limit of refined models as reference, at the points of all requested probes."""
    from softmark.interpreter.verification.refinement_family import find_reference

    places = [work.place(p).X for p in work.probes(work.case(declared).body.name)]
    points = np.concatenate([np.zeros((0, 3)), *places])
    found = work.options.recall(
        work.scene, declared, lambda: find_reference(work.scene, declared, points, work.measured, work.options.say)
    )
    _store_reference(work, declared, found.displacement, found.estimated_error, found.facts)


def _store_reference(
    work: StateRun,
    declared: Declared,
    displacement: Callable[[Any], Any] | None,
    error: float,
    facts: Mapping[str, Any] | None = None,
    more: TheoryResults | None = None,
) -> None:
    """Store a reference that has a displacement field, or only forces if `displacement` is None."""
    cls, case = type(declared.thing), work.case(declared)
    seen = {} if displacement is None else probe_sampling.sample_probes(work, case.body.name, displacement)
    if not (np.isfinite(error) and all(map(is_finite_probe, seen.values()))):
        _record_failed_reference(work, declared, "the displacements of the reference are not finite numbers")
        return
    weights = probe_sampling.probe_weights(work, case.body.name)
    more = more or TheoryResults()
    work.views[declared.name] = View(
        declared.name,
        case.body.name,
        case,
        None,
        displacement,
        seen,
        weights,
        probe_sampling.probe_domains(work, case.body.name),
        uncertainty=error,
        at_rest=more.rest,
        stress=more.stress,
        doubt=more.doubt,
    )
    work.references[declared.name] = ReferenceResult(
        declared.name, "converged", None, declared.thing.kind, cls.source, error, seen,
        facts=to_plain_json(facts or {}), means=cls.means,
    )  # fmt: skip


def _store_measured_curve(work: StateRun, declared: Declared, data: MeasuredCurve) -> None:
    """Store a measured curve as reference; it has no displacements of points."""
    cls, case, thing = type(declared.thing), work.case(declared), declared.thing
    work.views[declared.name] = View(
        declared.name, case.body.name, case, curve=Curve(data.x, data.y, data.u, data.lost_between, data.band)
    )
    chosen = pick_evenly(len(data.x), DRAWN)
    named = tuple(units.si_unit(amount.dimension) for amount in (thing.x_unit, thing.y_unit))
    band = None if data.band is None else (data.band[0][chosen], data.band[1][chosen])
    drawn = PlottedCurve(data.x[chosen], data.y[chosen], (named[0], named[1]), data.u[chosen], band)
    facts = {
        "uncertainty": data.resolution, "unit": named[1], "repeats": data.repeats, "spread": data.spread,
        "rows": len(data.x), "from": data.x[0], "to": data.x[-1], "lost": data.lost, "notes": list(data.notes),
    }  # fmt: skip
    facts |= {"codes": thing.code_count} if isinstance(thing, ConsensusCurve) else {}
    found = ("converged", None, thing.kind, data.source or cls.source)  # its error is not a length; it is in the facts
    work.references[declared.name] = ReferenceResult(declared.name, *found, facts=to_plain_json(facts), drawn=drawn)


def _store_known_value(work: StateRun, declared: Declared, data: KnownValue) -> None:
    """Store a value of one state as reference; it has no displacements of points."""
    case, unit = work.case(declared), units.si_unit(declared.thing.values.dimension)
    work.views[declared.name] = View(declared.name, case.body.name, case, value=data)
    facts = {"value": data.value, "uncertainty": data.uncertainty, "unit": unit}
    if data.band is not None:
        facts |= {"low": data.band[0], "high": data.band[1], "codes": data.codes}
    found = ("converged", None, declared.thing.kind, data.source)  # its error is not a length; it is in the facts
    work.references[declared.name] = ReferenceResult(declared.name, *found, facts=to_plain_json(facts))


def _store_measured_data(work: StateRun, declared: Declared, data: Any) -> None:
    """Store measured data as reference: a surface, displacements of tracked points, a curve or a value."""
    if isinstance(data, MeasuredCurve):
        _store_measured_curve(work, declared, data)
        return
    if isinstance(data, KnownValue):
        _store_known_value(work, declared, data)
        return
    cls, case = type(declared.thing), work.case(declared)
    surface: Any = data if isinstance(data, MeasuredSurface) else None
    if declared.thing.registered == "icp":

        def surface(points: np.ndarray, triangles: np.ndarray) -> Any:
            return declared.thing.load(target=(points, triangles))

    resolution = data.resolution  # including the registration residual
    seen = {}
    if surface is None:
        for probe in work.probes(case.body.name):
            if probe.thing.tracked == declared.name:
                X = work.place(probe).X
                seen[probe.name] = ProbeResult(X, data.displacement(X))
    if not (np.isfinite(resolution) and all(map(is_finite_probe, seen.values()))):
        _record_failed_reference(work, declared, "the measured values are not finite numbers")
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
        shape=DrawnSurface(data.points, data.triangles) if isinstance(data, MeasuredSurface) else None,
        facts=to_plain_json(facts_of(data)),
    )


def _compute_virtual_scan(work: StateRun, declared: Declared) -> None:
    """Compute a virtual scan: the surface that an imaging chain would measure of a model's deformed shape."""
    thing, model = declared.thing, work.views.get(declared.thing.of)
    if model is None or model.displacement is None:
        _record_failed_reference(work, declared, f"the model `{thing.of}` has no displacements to scan")
        return
    place = scan_surface(model.case)
    try:
        data = thing.load(place.X + model.displacement(place.X), place.triangles)
    except Exception as failure:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        _record_failed_reference(work, declared, str(failure))
        return
    _store_measured_data(work, declared, data)
