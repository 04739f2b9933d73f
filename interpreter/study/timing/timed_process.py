"""Process that times one run of one model: `python -m softmark.interpreter.study.timing.timed_process`.

It reads a job as JSON from standard input and always writes one line of JSON, the record, to standard output. The
environment must fix the number of threads before anything is imported. The processor is chosen here, before libraries
start their threads. Compiling kernels, loading code and one warm-up solution are not timed.
"""

from __future__ import annotations

import gc
import json
import math
import os
import platform
import signal
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from functools import partial
from typing import TYPE_CHECKING, Any

from softmark.interpreter.results.state_results import SOLVED
from softmark.interpreter.study.analysis.timing_quality import OWN, WHOLE
from softmark.interpreter.study.configurations.timing_job import TimingJob
from softmark.interpreter.study.timing.os_counters import OsCounters, load_average, measure_pace, memory_use
from softmark.interpreter.study.workers.orphan_processes import die_with_parent
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.models.shared.prepared_model import Prepared, Solution
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.study.timing.solver_phases import PhaseClock

FACTS = ("iterations", "steps", "residual", "linear_solver", "criterion", "unsolved", "halved")
QUANTILES = {"median": 0.5, "p95": 0.95, "p99": 0.99, "max": 1.0}

Record = dict[str, Any]


class NotTimed(Exception):
    """Error: a job could not be timed. The text gives the reason."""


@dataclass(frozen=True)
class TimedSolution:
    """Solution with its wall time and CPU time, s, and the counters of the operating system during it."""

    solution: Solution
    wall: float
    cpu: float
    during: Record

    @property
    def is_solved(self) -> bool:
        """True if the timed solution has converged."""
        return self.solution.status in SOLVED


def main() -> int:
    """Read a job, time it and write the record; return the exit status 0."""
    answer = os.dup(1)
    os.dup2(2, 1)  # output of libraries must not mix with the record
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    die_with_parent()
    try:
        asked = json.loads(sys.stdin.buffer.read())
        record = _run_guarded(asked)
    except ValueError as error:
        record = _failure_record(f"the job cannot be read: {error}")
    with os.fdopen(answer, "w", encoding="utf-8") as out:
        out.write(json.dumps(replace_nonfinite(record), allow_nan=False) + "\n")
    return 0


def _run_guarded(asked: Mapping[str, Any]) -> Record:
    """Return the record of a job; after an exception it has the status `failed` and a message."""
    from softmark.interpreter.problem.body_case import Fault

    try:
        return time_job(TimingJob.from_json(asked), asked.get("cores") or [], bool(asked.get("phases")))
    except NotTimed as refused:
        return _failure_record(str(refused))
    except Fault as refused:
        return _failure_record(refused.diagnostic.message)
    except MemoryError:
        return _failure_record("out of memory")
    except Exception as error:  # a defect, or a missing file: the parent continues with other jobs
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        return _failure_record(f"it stopped with an error ({type(error).__name__}: {error})")


def _failure_record(message: str) -> Record:
    return {"status": "failed", "message": message, "pid": os.getpid()}


def time_job(job: TimingJob, cores: Sequence[int], phases: bool = False) -> Record:
    """Return the record of one run of a model. Raises NotTimed, Fault.

    With `phases` the record has the times of phases instead of valid timings, because their clocks slow the run.
    """
    _bind_processors(job, cores)
    scene, declared, case = _load_scene_model_case(job)
    prepared, setup, before = _prepare_model(job, scene, declared, case)
    prepared.warm()
    where = _clocks() if phases else None
    found = _time_solutions(prepared, job, where)
    last = found.runs[-1].solution
    record = _identity_entries(job) | {
        "status": last.status,
        "message": last.message,
        "size": dict(prepared.size),
        "solve": _solution_facts(last),
        "setup": setup,
        "memory": memory_use() | {"before": before},
    }
    if not found.runs[-1].is_solved:
        return record
    if last.spent is not None:
        record |= {"clock": WHOLE if last.spent.most else OWN, "memory": {}}
    if where is not None:
        parts = (
            {} if last.spent is not None else _phase_times(where, found.warmed)
        )  # our clocks would not see its phases
        return record | {"phases": parts, "output_s": _time_writing(job, last)}
    return record | {
        "warmed": found.warmed,
        "wall_s": [r.wall for r in found.runs],
        "cpu_s": [r.cpu for r in found.runs],
        "during": found.during | {"compiled": found.compiled, "load": load_average()},
        "pace_s": statistics.fmean(found.paces),
        "steps": _step_time_quantiles([r.solution for r in found.runs]),
    }


def _clocks() -> PhaseClock:
    from softmark.interpreter.study.timing.solver_phases import PhaseClock

    return PhaseClock()


# ------------------------------------------------------------------ preparation


def _bind_processors(job: TimingJob, cores: Sequence[int]) -> None:
    """Bind the process to the chosen processors, and check that the number of threads is fixed. Raises NotTimed."""
    if cores and hasattr(os, "sched_setaffinity"):
        with suppress(OSError):  # the container may have lost it
            os.sched_setaffinity(0, cores)
    wrong = [n for n, v in job.environment.items() if os.environ.get(n) != v]
    if wrong:
        raise NotTimed(f"{', '.join(wrong)} must be {job.threads} before a timed process starts")
    if hasattr(signal, "alarm"):  # the parent may be gone
        signal.alarm(math.ceil(min(job.timeout_s, 1e8)) + 5)


def _load_scene_model_case(job: TimingJob) -> tuple[Scene, Declared, Case]:
    """Return the scene of a job, the declaration of its model, and the case of the body. Raises NotTimed, Fault."""
    from pathlib import Path

    from softmark.grammar.diagnostic import Source
    from softmark.interpreter.language.scene_sources import UnreadableScene, locate_scene, read_scene_file
    from softmark.interpreter.problem.body_case import case_for
    from softmark.interpreter.validation.constructor_registry import compile_source

    try:
        path = locate_scene(job.file) if job.text is None and job.file else None
        source = read_scene_file(path) if path else Source(job.file or "<text>", job.text or "")
    except UnreadableScene as missing:
        raise NotTimed(missing.reason) from missing
    folder = path.parent if path else Path(job.folder)
    scene, found = compile_source(source, folder, path, job.overrides, job.plugins)
    if errors := [d for d in found if d.severity == "error"]:
        raise NotTimed(f"{errors[0].code}: {errors[0].message}")
    declared = scene.of_kind("model").get(job.model)
    if declared is None:
        raise NotTimed(f"the scene has no model `{job.model}`")
    return scene, declared, case_for(scene, declared)


def _prepare_model(job: TimingJob, scene: Scene, declared: Declared, case: Case) -> tuple[Prepared, Record, int | None]:
    """Return the prepared model, the times of building it, and the memory held before, bytes. Raises Fault.

    If kernels or libraries were loaded while it was built, it is built again, unless that takes too long.
    """
    from softmark.interpreter.models import model_builders

    model_builders.load(declared.thing)
    before, compiling, begin = memory_use()["now"], _compilation_counter(), time.perf_counter()
    prepared, setup = _build_model(scene, declared, case)
    if compiling() and time.perf_counter() - begin < job.patience_s:
        del prepared
        gc.collect()
        prepared, setup = _build_model(scene, declared, case)
    return prepared, setup, before


def _build_model(scene: Scene, declared: Declared, case: Case) -> tuple[Prepared, Record]:
    """Build a model and return it with wall and CPU times, s. Raises Fault.

    The times are given separately for the mesh, for reading measurements, and for the rest of the set-up.
    """
    from softmark.interpreter.language.scene_states import in_state, states_of
    from softmark.interpreter.problem.body_case import case_for

    meshes: dict[tuple[Any, ...], Any] = {}
    if not (states := states_of(scene)):
        return _build_in_state(scene, declared, case, meshes)
    from softmark.interpreter.models.shared.state_sequence import StateSequence

    scenes = [in_state(scene, number) for number in range(len(states))]
    built = [_build_in_state(own, d := own.declared[declared.name], case_for(own, d), meshes) for own in scenes]
    spent = {name: [sum(s[name][i] for _, s in built) for i in (0, 1)] for name in built[0][1]}
    return StateSequence(tuple(prepared for prepared, _ in built)), spent


def _build_in_state(
    scene: Scene, declared: Declared, case: Case, meshes: dict[tuple[Any, ...], Any]
) -> tuple[Prepared, Record]:
    """Build a model in one state and return it with wall and CPU times, s; `meshes` are shared between states."""
    from softmark.interpreter.models.model_preparation import Measurements, prepared_model
    from softmark.interpreter.models.shared.prepared_model import BuildContext

    measured = Measurements(scene)
    workshop = BuildContext(meshes=meshes, scene=scene, measured=measured)
    prepared, spent = prepared_model(declared, case, workshop)
    mesh = [sum(s[i] for s in workshop.seconds.values()) for i in (0, 1)]
    took = spent.wall[0], spent.cpu[0]
    rest = [max(0.0, took[i] - mesh[i] - measured.seconds[i]) for i in (0, 1)]
    return prepared, {"mesh": mesh, "set-up": rest, "reading": list(measured.seconds)}


def _identity_entries(job: TimingJob) -> Record:
    """Return the entries of a record that identify the model, the process, its processors and the versions."""
    numpy = sys.modules.get("numpy")
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    tasks = len(os.listdir("/proc/self/task")) if os.path.isdir("/proc/self/task") else None
    return {
        "key": job.key,
        "model": job.model,
        "pid": os.getpid(),
        "cores": cores,
        "threads": {"asked": job.threads, "running": tasks},
        "versions": {
            "python": platform.python_version(),
            "numpy": getattr(numpy, "__version__", None),
        },
    }


# ------------------------------------------------------------------ timing


@dataclass
class TimedSolutions:
    """All timed solutions of a run, with the pace of the processor before, between and after them."""

    runs: list[TimedSolution]
    warmed: bool = False  # a first solution was left out
    compiled: int = 0  # kernels that were compiled or loaded meanwhile
    paces: list[float] = field(default_factory=list)
    during: Record = field(default_factory=dict)


def _time_solutions(prepared: Prepared, job: TimingJob, where: PhaseClock | None) -> TimedSolutions:
    """Solve once as a warm-up, and then repeatedly until the solutions have taken `job.least_s` seconds."""
    gc.collect()
    before, first = measure_pace(), _time_solution(prepared, where)
    if not first.is_solved or first.wall > job.patience_s:
        return TimedSolutions([first], paces=[before, measure_pace()], during=first.during)
    compiling = _compilation_counter()
    found = TimedSolutions([], warmed=True, paces=[measure_pace()])
    while not found.runs or sum(r.wall for r in found.runs) < job.least_s:
        found.runs.append(_time_solution(prepared, where))
        found.paces.append(measure_pace())
        if not found.runs[-1].is_solved:
            break
    found.compiled = compiling()
    found.during = _sum_counters([r.during for r in found.runs])
    return found


def _sum_counters(stretches: Sequence[Record]) -> Record:
    """Return the sums of the counters over several time intervals."""
    whole: Record = {}
    for name, last in stretches[-1].items():
        values = [s[name] for s in stretches]
        whole[name] = last if isinstance(last, list) else None if None in values else sum(values)
    return whole


def _time_solution(prepared: Prepared, where: PhaseClock | None) -> TimedSolution:
    """Solve once and return the solution with its times and counters.

    Reading the counters takes half a millisecond, which is outside the timed interval.
    """
    cores = frozenset(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else frozenset()
    solve = partial(prepared.solve, _ignore_iteration)
    begin = OsCounters.now(cores)
    wall, cpu = time.perf_counter(), time.process_time()
    solution = solve() if where is None else where.around(solve)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    if (spent := solution.spent) is not None:  # our clock does not include an external program
        wall, cpu = spent.wall_s, spent.cpu_s
    return TimedSolution(solution, wall, cpu, OsCounters.now(cores).since(begin))


def _ignore_iteration(iteration: object) -> None:
    """Do nothing; a callback for iterations that needs no output."""


def _compilation_counter() -> Callable[[], int]:
    """Start counting kernels that numba compiles or loads.

    Return a function that stops counting and returns the number.
    """
    if "numba" not in sys.modules:
        return lambda: int("numba" in sys.modules)
    from numba.core import event

    events: Any = event  # numba has no types
    recorder = events.RecordingListener()
    events.register("numba:compiler_lock", recorder)

    def count() -> int:
        events.unregister("numba:compiler_lock", recorder)
        return sum(1 for _, e in recorder.buffer if e.is_start)

    return count


# ------------------------------------------------------------------ facts about the solutions


def _solution_facts(solution: Solution) -> Record:
    """Return facts that show whether two runs did the same work: iterations, residual, size of displacements."""
    facts = {name: solution.facts[name] for name in FACTS if name in solution.facts}
    if solution.mesh is not None:
        facts["motion"] = math.sqrt(float((solution.mesh.displacement**2).sum()))
    return facts


def _step_time_quantiles(solutions: Sequence[Solution]) -> Record | None:
    """Return quantiles of the time of a step, s, over all solutions; None for a static analysis."""
    histories = [s.history for s in solutions if s.history is not None]
    if not histories:
        return None
    wall = sorted(t for h in histories for t in h.step_s)
    cpu = sorted(t for h in histories for t in h.step_cpu_s)
    return {"wall_s": quantiles(wall), "cpu_s": quantiles(cpu), "steps": len(histories[0].step_s)}


def quantiles(ordered: Sequence[float]) -> dict[str, float] | None:
    """Return the quantiles in QUANTILES of ascending values, without interpolation; None if there are no values.

    Each is the smallest value that is not exceeded by the fraction of values.
    """
    count = len(ordered)
    return {n: ordered[max(0, math.ceil(q * count) - 1)] for n, q in QUANTILES.items()} if count else None


def _phase_times(where: PhaseClock, warmed: bool) -> dict[str, float]:
    """Return the CPU time of each phase of a solution, s, as a mean over the timed solutions."""
    counted = where.solutions[1:] if warmed else where.solutions
    names = dict.fromkeys(name for spent in counted for name in spent)
    return {name: statistics.fmean(spent.get(name, 0.0) for spent in counted) for name in names}


def _time_writing(job: TimingJob, solution: Solution) -> float | None:
    """Return the CPU time, s, of writing the deformed mesh to a VTU file, without the time of imports."""
    import tempfile

    from softmark.interpreter.results.run_report import ModelResult, Report
    from softmark.interpreter.results.vtk_writer import write_vtu

    if solution.mesh is None:
        return None
    model = ModelResult(job.model, solution.status, solution.message, "", mesh=solution.mesh)
    report = Report({}, {}, {job.model: model}, {}, (), ())
    with tempfile.TemporaryDirectory() as folder:
        write_vtu(report, folder)  # loads what writing needs
        begin = time.process_time()
        write_vtu(report, folder)
        return time.process_time() - begin


def replace_nonfinite(value: Any) -> Any:
    """Return the value as plain JSON data, with None in place of numbers that are not finite."""
    if isinstance(value, Mapping):
        return {str(k): replace_nonfinite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [replace_nonfinite(v) for v in value]
    if isinstance(value, bool | int | str) or value is None:
        return value
    try:
        number = float(value)
    except (TypeError, ValueError):
        return str(value)
    return number if math.isfinite(number) else None


if __name__ == "__main__":
    sys.exit(main())
