"""Timed solution of one model: compilation first, repetitions, and the start from the previous state."""

from __future__ import annotations

import os
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.loaded_plugin import find_faulty_plugin
from softmark.interpreter.models.model_preparation import ComputingTimes
from softmark.interpreter.models.shared.prepared_model import DeformedMesh, Prepared, Solution
from softmark.interpreter.pipeline.run_state import StateRun
from softmark.interpreter.results.run_report import Timing
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT, format_state
from softmark.solvers.runtime import parallel_compilation
from softmark.solvers.runtime.work_count import counted, seconds_since

if TYPE_CHECKING:
    from softmark.solvers.statics.static_equilibrium import Iteration

NEAR_REST = 1e-4  # of the displacement in the state before: below, the undeformed state is the start


def solve_from_previous_state(work: StateRun, name: str, prepared: Prepared) -> tuple[Solution, ComputingTimes]:
    """Return the solution started from the preceding state, and its times.

    There is no solution if the preceding state failed. A state that turns out to be almost undeformed is solved again
    from the undeformed state.
    """
    if work.before is None or work.before.state is None:
        return _solve_with_timing(work, name, prepared)
    before = work.before.models[name]
    if before.status not in ANSWERED:
        reason = f"the previous state, {format_state(work.before.state)}, has no solution"
        return Solution("skipped", reason, {}), ComputingTimes()
    if before.mesh is None:
        return _solve_with_timing(work, name, prepared)
    begun = prepared.after(before.mesh)
    found, times = _solve_with_timing(work, name, begun)
    if begun is prepared or not _is_nearly_undeformed(found, before.mesh):
        return found, times
    again, more = _solve_with_timing(work, name, prepared)
    return again, times + more


def _is_nearly_undeformed(found: Solution, before: DeformedMesh) -> bool:
    """Return whether the deformation in a state is negligible compared with the preceding state.

    Rounding errors of the preceding state would then be large in it.
    """
    if found.mesh is None:
        return False
    now, then = (float(np.abs(moved.displacement).max(initial=0.0)) for moved in (found.mesh, before))
    return now <= NEAR_REST * then


def _solve_with_timing(work: StateRun, name: str, prepared: Prepared) -> tuple[Solution, ComputingTimes]:
    """Return the solution and its times in each repetition; kernels are compiled before timing."""
    wall: list[float] = []
    cpu: list[float] = []
    solution, before = Solution("failed", "not run", {}), counted()

    def watch(iteration: Iteration) -> None:
        work.options.say(
            "solve",
            f"{name}{work.where}: {iteration.phase}, iteration {iteration.number + 1},"
            f" residual {iteration.residual:.1e}",
        )

    try:
        _compile_kernels(work, name, prepared)
        for _ in range(work.options.repeat):
            start, before = (time.perf_counter(), time.process_time()), counted()
            solution = prepared.solve(watch)
            if solution.status in LEFT_OUT:
                return solution, ComputingTimes()
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
        solution = Solution("failed", f"the solver stopped with an error ({what})", {})
    return solution, ComputingTimes(tuple(wall), tuple(cpu), seconds_since(before))


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


def timings(
    declared: Declared, solution: Solution, setup: ComputingTimes, times: ComputingTimes
) -> dict[str, Timing | None]:
    """Return the timings of a model for the report; those of the solution are None for models that are not timed."""
    spent, history, timed = solution.spent, solution.history, declared.thing.timed
    basis, most = ("", False) if spent is None else (spent.basis, spent.most)
    return {
        "setup_s": Timing(setup.wall),
        "solve_s": Timing(times.wall, basis, most) if times.wall and timed else None,
        "step_s": Timing(history.step_s) if history and history.step_s else None,
        "setup_cpu_s": Timing(setup.cpu),
        "solve_cpu_s": Timing(times.cpu, basis, most) if times.cpu and timed else None,
    }
