"""Runs of the models: preparation, solution, verification and error estimates; `solve_model` has the steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.compiled_scene import Declared, SceneError
from softmark.interpreter.models.model_preparation import ComputingTimes, prepared_model
from softmark.interpreter.models.postprocessing.mesh_stress import add_stress
from softmark.interpreter.models.postprocessing.reaction_and_work import forces_and_energies
from softmark.interpreter.models.shared import interaction_setup
from softmark.interpreter.models.shared.material_regions import cell_means_function, material_report
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.pipeline import cached_results, probe_sampling
from softmark.interpreter.pipeline.run_state import StateRun
from softmark.interpreter.pipeline.solution_timing import solve_from_previous_state, timings
from softmark.interpreter.problem.body_case import Case, Fault
from softmark.interpreter.problem.probe_points import is_finite_probe
from softmark.interpreter.problem.solution import View
from softmark.interpreter.problem.surface_selection.load_resultants import load_mismatch_warnings, resultants
from softmark.interpreter.results.reaction_results import ContactResult, EquilibriumForces
from softmark.interpreter.results.run_report import ModelResult, ProbeResult, Timing
from softmark.interpreter.verification.force_verification import verify_solution
from softmark.interpreter.verification.selection_error import support_facts
from softmark.interpreter.verification.stress_warnings import asks_for_stress, stress_warnings
from softmark.solvers.mesh.surface_bodies import SurfaceBody

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic


def prepare_models(work: StateRun) -> None:
    """Build every model. Raises SceneError that lists all models that cannot be built."""
    faults, workshop = [], BuildContext(meshes=work.meshes, scene=work.scene, measured=work.measured)
    for name in work.plan.models:
        work.about = "prepare", name
        if cached_results.reuse_prepared_model(work, name):
            continue
        declared = work.scene.declared[name]
        case = work.case(declared)
        work.options.say("prepare", f"{name}{work.where}")
        try:
            prepared, spent = prepared_model(declared, case, workshop)
            work.prepared[name] = prepared, spent
            probe_sampling.require_probes_inside(work, case.body.name, prepared)
        except Fault as error:
            faults.append(error.diagnostic)
        else:
            work.warn(prepared.notes)
    if faults:
        raise SceneError(list(dict.fromkeys(faults)))


def solve_model(work: StateRun, name: str) -> None:
    """Solve a model and store its result."""
    work.about = "solve", name
    if cached_results.reuse_solved_model(work, name):
        return
    declared, (prepared, setup) = work.scene.declared[name], work.prepared[name]
    solution, times = solve_from_previous_state(work, name, prepared)
    case = interaction_setup.with_moved_rigid_bodies(work.case(declared), solution.mesh)
    solution = verify_solution(work.scene, declared, case, prepared, solution)
    solution = add_stress(work.scene, declared, case, solution)
    solution = _with_report_entries(solution, case, prepared, setup, times)
    seen = _sample_probes(work, case, solution)
    if not all(map(is_finite_probe, seen.values())):
        reason, seen = "the displacements are not finite numbers", {}
        solution = Solution("failed", reason, solution.facts, notes=solution.notes)
    rest, loads = forces_and_energies(declared, case, prepared, solution), resultants(case, prepared)
    view = _view(work, declared, case, solution, seen, rest, timings(declared, solution, setup, times))
    work.views[name] = view
    work.warn(load_mismatch_warnings(case, declared, loads), here=solution.notes)
    work.warn(stress_warnings(work.scene, view, prepared), once=True)
    work.warn((), here=_time_step_warnings(work, view, solution))
    work.warn((), here=_contact_warnings(work, view, prepared, rest))
    work.models[name] = ModelResult(
        name,
        solution.status,
        solution.message,
        declared.thing.outline(case),
        prepared.size,
        solution.facts,
        view.clock,
        seen,
        mesh=solution.mesh,
        loads=loads,
        reactions=support_facts(case, prepared, rest),
        kind=declared.thing.kind(case),
        contacts=contact_results(case, prepared, rest, solution.facts),
        stress=solution.stress if solution.mesh and asks_for_stress(work.scene) else None,
        constants=cell_means_function(case, solution.mesh),
    )


def _with_report_entries(
    solution: Solution, case: Case, prepared: Prepared, setup: ComputingTimes, times: ComputingTimes
) -> Solution:
    """Return a solution with report entries about materials, the mesh, and the nominal times of set-up and solution."""
    known = material_report(case, prepared.mesh) | _mesh_facts(case, prepared) | _filled_surface_facts(case, prepared)
    nominal = {"nominal_cpu_s": {"setup": setup.nominal, "solve": times.nominal}}
    return replace(solution, facts=solution.facts | known | nominal)


def _sample_probes(work: StateRun, case: Case, solution: Solution) -> dict[str, ProbeResult]:
    """Return the results at all probes of the body, by probe name; empty without a solution."""
    if solution.displacement is None:
        return {}
    return probe_sampling.sample_probes(work, case.body.name, solution.displacement, solution.history)


def _view(
    work: StateRun,
    declared: Declared,
    case: Case,
    solution: Solution,
    seen: dict[str, ProbeResult],
    rest: EquilibriumForces,
    clock: dict[str, Timing | None],
) -> View:
    """Return the view of a model that metrics and warnings evaluate."""
    body, missing = case.body.name, None
    if solution.displacement is None:
        missing = solution.message or "it was not computed"
    return View(
        declared.name,
        body,
        case,
        missing,
        solution.displacement,
        seen,
        probe_sampling.probe_weights(work, body),
        probe_sampling.probe_domains(work, body),
        clock=clock,
        history=solution.history,
        solve=solution.facts,
        stress=solution.stress,
        at_rest=rest,
        step_errors=solution.step_errors and cache(solution.step_errors),
        vibrations=solution.vibrations,
    )


def _time_step_warnings(work: StateRun, view: View, solution: Solution) -> Sequence[Diagnostic]:
    """Return warnings about the time step of a motion."""
    if solution.step_errors is None or solution.displacement is None:
        return ()
    from softmark.interpreter.verification.motion_errors import time_step_warnings

    return time_step_warnings(work.scene, work.scene.declared[view.name], view, solution.notes)


def _contact_warnings(work: StateRun, view: View, prepared: Prepared, rest: EquilibriumForces) -> Sequence[Diagnostic]:
    """Return warnings about penetration, gaps, and areas and pressures that contradict the forces of contacts."""
    if not view.case.contacts:
        return ()
    from softmark.interpreter.verification.contact_warnings import (
        contradiction_warnings,
        gap_warnings,
        penetration_warnings,
    )

    declared = work.scene.declared[view.name]
    metrics = [metric.thing for metric in work.scene.of_kind("metric").values()]
    return (
        *penetration_warnings(declared, view.case, rest, prepared.mesh, view.solve),
        *contradiction_warnings(declared, rest, metrics),
        *gap_warnings(declared, view.case, rest),
    )


def contact_results(
    case: Case, prepared: Prepared, rest: EquilibriumForces, facts: Mapping[str, Any]
) -> dict[str, ContactResult]:
    """Return the results of the contacts of a model for the report, by contact name."""
    if not rest.touches:
        return {}
    from softmark.interpreter.verification.contact_error import force_excess
    from softmark.interpreter.verification.contact_warnings import selected_area_ratios

    checks, taken = (facts.get("checks") or {}).get("contact") or {}, selected_area_ratios(case, prepared.mesh)
    return {
        name: ContactResult(
            touch, rest.reactions[name], (checks.get(name) or {}).get("overlap"), taken.get(name), force_excess(touch)
        )
        for name, touch in rest.touches.items()
    }


def _mesh_facts(case: Case, prepared: Prepared) -> dict[str, Any]:
    """Return report entries about the mesh of a body whose exact surface is known.

    They are empty for other bodies or without a mesh, and then no module is imported.
    """
    if case.shape.skin is None or prepared.mesh is None:
        return {}
    from softmark.interpreter.models.shared.mesh_notes import volume_and_area_facts

    return volume_and_area_facts(case.shape, prepared.mesh)


def _filled_surface_facts(case: Case, prepared: Prepared) -> dict[str, Any]:
    """Return report entries about the distance between a filled surface and its mesh.

    They are empty for other bodies, and then no module is imported.
    """
    if not isinstance(case.shape, SurfaceBody):
        return {}
    from softmark.interpreter.models.shared import filled_mesh_notes

    return filled_mesh_notes.filled_mesh_report(case.shape, prepared.mesh)


def estimate_model_errors(work: StateRun, names: Iterable[str]) -> None:
    """Estimate the errors of models and store them in their results.

    Models named in the option `stated` compute them at additional cost. With the option `free`, other models
    state errors that cost nothing.
    """
    asked = () if work.options.stated is None else work.options.stated or tuple(work.models)
    if not asked and not work.options.free:
        return
    from softmark.interpreter.verification.error_estimate import estimate_errors

    for name in list(names):
        result = work.models[name]
        if name not in work.taken and not result.stated and (name in asked or work.options.free):
            work.options.say("state", f"the error of {name}{work.where}")
            declared, prepared, view = work.scene.declared[name], work.prepared[name][0], work.views[name]
            known = work.measured, work.warnings, work.views
            before = [(w.views[name], w.models[name].stated) for w in work.earlier]
            said = estimate_errors(
                work.scene, declared, view, prepared, result, *known, name in asked, before, work.estimates
            )
            work.models[name] = replace(result, stated=said)
