"""Runs of the models: preparation, solution, verification and error estimates."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from operator import add
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.language.loaded_plugin import find_faulty_plugin
from softmark.interpreter.models.model_preparation import prepared_model
from softmark.interpreter.models.postprocessing.mesh_stress import add_stress
from softmark.interpreter.models.postprocessing.reaction_and_work import forces_and_energies
from softmark.interpreter.models.shared import interaction_setup
from softmark.interpreter.models.shared.material_regions import cell_means_function, material_report
from softmark.interpreter.models.shared.prepared_model import BuildContext, DeformedMesh, Prepared, Solution
from softmark.interpreter.pipeline import cached_results, probe_sampling
from softmark.interpreter.pipeline.run_state import StateRun
from softmark.interpreter.problem.body_case import Case, Fault
from softmark.interpreter.problem.probe_points import is_finite_probe
from softmark.interpreter.problem.solution import View
from softmark.interpreter.problem.surface_selection.load_resultants import load_mismatch_warnings, resultants
from softmark.interpreter.results.reaction_results import ContactResult, EquilibriumForces
from softmark.interpreter.results.run_report import ModelResult, Timing
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT, format_state
from softmark.interpreter.verification.force_verification import verify_solution
from softmark.interpreter.verification.selection_error import support_facts
from softmark.interpreter.verification.stress_warnings import asks_for_stress, stress_warnings
from softmark.solvers.mesh.surface_bodies import SurfaceBody
from softmark.solvers.runtime import parallel_compilation

if TYPE_CHECKING:
    from softmark.solvers.statics.static_equilibrium import Iteration

NEAR_REST = 1e-4  # of the displacement in the state before: below, the undeformed state is the start


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
            work.prepared[name] = (prepared, *spent)
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
    case = work.case(declared := work.scene.declared[name])
    prepared, setup, setup_cpu = work.prepared[name]
    solution, wall, cpu = _solve_from_previous_state(work, name, prepared)
    case = interaction_setup.with_moved_rigid_bodies(case, solution.mesh)
    solution = add_stress(work.scene, declared, case, verify_solution(work.scene, declared, case, prepared, solution))
    history = solution.history
    known = material_report(case, prepared.mesh) | _mesh_facts(case, prepared) | _filled_surface_facts(case, prepared)
    solution = replace(solution, facts=solution.facts | known)
    basis, most = ("", False) if solution.spent is None else (solution.spent.basis, solution.spent.most)

    def timed(seconds: list[float]) -> Timing:
        return Timing(tuple(seconds), basis, most)

    clock = {
        "setup_s": Timing((setup,)),
        "solve_s": timed(wall) if wall and declared.thing.timed else None,
        "step_s": Timing(history.step_s) if history and history.step_s else None,
        "setup_cpu_s": Timing((setup_cpu,)),
        "solve_cpu_s": timed(cpu) if cpu and declared.thing.timed else None,
    }
    seen = {}
    if solution.displacement is not None:
        seen = probe_sampling.sample_probes(work, case.body.name, solution.displacement, history)
        if not all(map(is_finite_probe, seen.values())):
            reason, seen = "the displacements are not finite numbers", {}
            solution = Solution("failed", reason, solution.facts, notes=solution.notes)
    rest = forces_and_energies(declared, case, prepared, solution)
    work.warn(load_mismatch_warnings(case, declared, loads := resultants(case, prepared)), here=solution.notes)
    message = solution.message if solution.displacement is None else None
    work.views[name] = View(
        name,
        case.body.name,
        case,
        message or (None if solution.displacement else "it was not computed"),
        solution.displacement,
        seen,
        probe_sampling.probe_weights(work, case.body.name),
        probe_sampling.probe_domains(work, case.body.name),
        clock=clock,
        history=solution.history,
        solve=solution.facts,
        stress=solution.stress,
        at_rest=rest,
        step_errors=solution.step_errors and cache(solution.step_errors),
        vibrations=solution.vibrations,
    )
    work.warn(stress_warnings(work.scene, work.views[name], prepared), once=True)
    if solution.step_errors is not None and solution.displacement is not None:
        from softmark.interpreter.verification.motion_errors import time_step_warnings

        work.warn((), here=time_step_warnings(work.scene, declared, work.views[name], solution.notes))
    if case.contacts:
        from softmark.interpreter.verification.contact_warnings import (
            contradiction_warnings,
            gap_warnings,
            penetration_warnings,
        )

        metrics = [metric.thing for metric in work.scene.of_kind("metric").values()]
        cut = penetration_warnings(declared, case, rest, prepared.mesh, solution.facts)
        work.warn(
            (), here=(*cut, *contradiction_warnings(declared, rest, metrics), *gap_warnings(declared, case, rest))
        )
    outline, kind = declared.thing.outline(case), declared.thing.kind(case)
    held = support_facts(case, prepared, rest)
    found = (solution.status, solution.message, outline, prepared.size, solution.facts, clock, seen)
    work.models[name] = ModelResult(name, *found, mesh=solution.mesh, loads=loads, reactions=held, kind=kind,
                                    contacts=contact_results(case, prepared, rest, solution.facts),
                                    stress=solution.stress if solution.mesh and asks_for_stress(work.scene) else None,
                                    constants=cell_means_function(case, solution.mesh))  # fmt: skip


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


def _solve_from_previous_state(
    work: StateRun, name: str, prepared: Prepared
) -> tuple[Solution, list[float], list[float]]:
    """Return the solution started from the preceding state, with wall and CPU seconds.

    There is no solution if the preceding state failed. A state that turns out to be almost undeformed is solved again
    from the undeformed state.
    """
    if work.before is None or work.before.state is None:
        return _solve_with_timing(work, name, prepared)
    before = work.before.models[name]
    if before.status not in ANSWERED:
        return (
            Solution("skipped", f"the previous state, {format_state(work.before.state)}, has no solution", {}),
            [],
            [],
        )
    if before.mesh is None:
        return _solve_with_timing(work, name, prepared)
    begun = prepared.after(before.mesh)
    found, wall, cpu = _solve_with_timing(work, name, begun)
    if begun is prepared or not _is_nearly_undeformed(found, before.mesh):
        return found, wall, cpu
    again, more, cpu_more = _solve_with_timing(work, name, prepared)
    return again, list(map(add, wall, more)), list(map(add, cpu, cpu_more))


def _is_nearly_undeformed(found: Solution, before: DeformedMesh) -> bool:
    """Return whether the deformation in a state is negligible compared with the preceding state.

    Rounding errors of the preceding state would then be large in it.
    """
    if found.mesh is None:
        return False
    now, then = (float(np.abs(moved.displacement).max(initial=0.0)) for moved in (found.mesh, before))
    return now <= NEAR_REST * then


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


def _solve_with_timing(work: StateRun, name: str, prepared: Prepared) -> tuple[Solution, list[float], list[float]]:
    """Return the solution, and wall and CPU seconds of each repetition; kernels are compiled before timing."""
    wall: list[float] = []
    cpu: list[float] = []
    solution = Solution("failed", "not run", {})

    def watch(iteration: Iteration) -> None:
        work.options.say(
            "solve",
            f"{name}{work.where}: {iteration.phase}, iteration {iteration.number + 1},"
            f" residual {iteration.residual:.1e}",
        )

    try:
        _compile_kernels(work, name, prepared)
        for _ in range(work.options.repeat):
            start = time.perf_counter(), time.process_time()
            solution = prepared.solve(watch)
            if solution.status in LEFT_OUT:
                return solution, [], []
            spent = solution.spent
            wall.append(spent.wall_s if spent else time.perf_counter() - start[0])
            cpu.append(spent.cpu_s if spent else time.process_time() - start[1])
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        what = (
            "out of memory"
            if isinstance(error, MemoryError)
            else find_faulty_plugin(error) or f"{type(error).__name__}: {error}"
        )
        return Solution("failed", f"the solver stopped with an error ({what})", {}), wall, cpu
    return solution, wall, cpu


def _compile_kernels(work: StateRun, name: str, prepared: Prepared) -> None:
    kernels: Any = sys.modules.get("softmark.solvers.runtime.kernel_cache")
    cold = not work.compiling and kernels is not None and not kernels.is_compiled()
    work.compiling |= cold
    say, begin, before = work.options.say, time.perf_counter(), kernels.count_compiled() if kernels else 0
    say("compile", "compiling kernels, once for this version") if cold else say("solve", name)
    with parallel_compilation.allow_helper(work.options.beside and cold):
        prepared.warm()
    if work.compiling and kernels and kernels.count_compiled() > before:
        say("compiled", f"compiling kernels: {kernels.count_compiled() - before}, {time.perf_counter() - begin:.0f} s")


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
