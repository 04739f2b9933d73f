"""One run of one model in a process of its own: `python -m softmark.interpreter.study.timing.timed_process`.

A job comes as JSON on standard input, one line of JSON goes to standard output, whatever happens. The number of
threads must be fixed by the environment, before anything is imported; the processor is chosen here, before libraries
start their threads. Compiling kernels, loading code and one solution to warm up stay outside the clock.
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
from softmark.interpreter.study.timing.os_counters import Gauges, load_average, memory, pace
from softmark.interpreter.study.workers.orphan_processes import die_with_parent
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.models.shared.prepared_model import Prepared, Solution
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.study.timing.solver_phases import Phases

FACTS = ("iterations", "steps", "residual", "linear_solver", "criterion", "unsolved", "halved")
QUANTILES = {"median": 0.5, "p95": 0.95, "p99": 0.99, "max": 1.0}

Record = dict[str, Any]


class Untimed(Exception):
    """Why nothing could be timed."""


@dataclass(frozen=True)
class Clocked:
    """A solution, its wall and CPU seconds, and what the gauges said meanwhile."""

    solution: Solution
    wall: float
    cpu: float
    during: Record

    @property
    def good(self) -> bool:
        """Whether there is a solution."""
        return self.solution.status in SOLVED


def main() -> int:
    """Read the job, time it, write the record; 0 unless nothing could be written."""
    answer = os.dup(1)
    os.dup2(2, 1)  # what libraries print must not get between
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    die_with_parent()
    try:
        asked = json.loads(sys.stdin.buffer.read())
        record = _guarded(asked)
    except ValueError as error:
        record = _failed(f"the job cannot be read: {error}")
    with os.fdopen(answer, "w", encoding="utf-8") as out:
        out.write(json.dumps(finite(record), allow_nan=False) + "\n")
    return 0


def _guarded(asked: Mapping[str, Any]) -> Record:
    """The record of a job, with a status and a message where it fails."""
    from softmark.interpreter.problem.body_case import Fault

    try:
        return timed(TimingJob.from_json(asked), asked.get("cores") or [], bool(asked.get("phases")))
    except Untimed as refused:
        return _failed(str(refused))
    except Fault as refused:
        return _failed(refused.diagnostic.message)
    except MemoryError:
        return _failed("out of memory")
    except Exception as error:  # a defect, or a file that is gone: the parent goes on with other jobs
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        return _failed(f"it stopped with an error ({type(error).__name__}: {error})")


def _failed(message: str) -> Record:
    return {"status": "failed", "message": message, "pid": os.getpid()}


def timed(job: TimingJob, cores: Sequence[int], phases: bool = False) -> Record:
    """The record of one run; with `phases`, of where its time goes, which disturbs the clock. Raises Refused, Fault."""
    _alone(job, cores)
    scene, declared, case = _scene(job)
    prepared, setup, before = _prepared(job, scene, declared, case)
    prepared.warm()
    where = _clocks() if phases else None
    found = _solutions(prepared, job, where)
    last = found.runs[-1].solution
    record = _identity(job) | {
        "status": last.status,
        "message": last.message,
        "size": dict(prepared.size),
        "solve": _facts(last),
        "setup": setup,
        "memory": memory() | {"before": before},
    }
    if not found.runs[-1].good:
        return record
    if last.spent is not None:
        record |= {"clock": WHOLE if last.spent.most else OWN, "memory": {}}
    if where is not None:
        parts = {} if last.spent is not None else _spent(where, found.warmed)  # of ours, which looks at an answer
        return record | {"phases": parts, "output_s": _written(job, last)}
    return record | {
        "warmed": found.warmed,
        "wall_s": [r.wall for r in found.runs],
        "cpu_s": [r.cpu for r in found.runs],
        "during": found.during | {"compiled": found.compiled, "load": load_average()},
        "pace_s": statistics.fmean(found.paces),
        "steps": _steps([r.solution for r in found.runs]),
    }


def _clocks() -> Phases:
    from softmark.interpreter.study.timing.solver_phases import Phases

    return Phases()


# ------------------------------------------------------------------ before the clock


def _alone(job: TimingJob, cores: Sequence[int]) -> None:
    """Stay on the processors that were chosen; see that the number of threads is fixed. Raises Refused."""
    if cores and hasattr(os, "sched_setaffinity"):
        with suppress(OSError):  # the container may have lost it
            os.sched_setaffinity(0, cores)
    wrong = [n for n, v in job.environment.items() if os.environ.get(n) != v]
    if wrong:
        raise Untimed(f"{', '.join(wrong)} must be {job.threads} before a timed process starts")
    if hasattr(signal, "alarm"):  # the parent may be gone
        signal.alarm(math.ceil(min(job.timeout_s, 1e8)) + 5)


def _scene(job: TimingJob) -> tuple[Scene, Declared, Case]:
    """The scene, the model and its case. Raises Refused, Fault."""
    from pathlib import Path

    from softmark.grammar.diagnostic import Source
    from softmark.interpreter.language.scene_sources import UnreadableScene, locate_scene, read_scene_file
    from softmark.interpreter.problem.body_case import case_for
    from softmark.interpreter.validation.constructor_registry import compile_source

    try:
        path = locate_scene(job.file) if job.text is None and job.file else None
        source = read_scene_file(path) if path else Source(job.file or "<text>", job.text or "")
    except UnreadableScene as missing:
        raise Untimed(missing.reason) from missing
    folder = path.parent if path else Path(job.folder)
    scene, found = compile_source(source, folder, path, job.overrides, job.plugins)
    if errors := [d for d in found if d.severity == "error"]:
        raise Untimed(f"{errors[0].code}: {errors[0].message}")
    declared = scene.of_kind("model").get(job.model)
    if declared is None:
        raise Untimed(f"the scene has no model `{job.model}`")
    return scene, declared, case_for(scene, declared)


def _prepared(job: TimingJob, scene: Scene, declared: Declared, case: Case) -> tuple[Prepared, Record, int | None]:
    """The model, what building it took, and the bytes held before. Raises Fault.

    Where kernels or libraries were loaded meanwhile, it is built once more, unless that takes too long.
    """
    from softmark.interpreter.models import model_builders

    model_builders.load(declared.thing)
    before, compiling, begin = memory()["now"], _compilations(), time.perf_counter()
    prepared, setup = _built(scene, declared, case)
    if compiling() and time.perf_counter() - begin < job.patience_s:
        del prepared
        gc.collect()
        prepared, setup = _built(scene, declared, case)
    return prepared, setup, before


def _built(scene: Scene, declared: Declared, case: Case) -> tuple[Prepared, Record]:
    """The model, and wall and CPU seconds of its mesh, of the rest, and of reading what was measured. Raises Fault."""
    from softmark.interpreter.language.scene_states import in_state, states_of
    from softmark.interpreter.problem.body_case import case_for

    meshes: dict[tuple[Any, ...], Any] = {}
    if not (states := states_of(scene)):
        return _built_once(scene, declared, case, meshes)
    from softmark.interpreter.models.shared.state_sequence import InTurn

    scenes = [in_state(scene, number) for number in range(len(states))]
    built = [_built_once(own, d := own.declared[declared.name], case_for(own, d), meshes) for own in scenes]
    spent = {name: [sum(s[name][i] for _, s in built) for i in (0, 1)] for name in built[0][1]}
    return InTurn(tuple(prepared for prepared, _ in built)), spent


def _built_once(
    scene: Scene, declared: Declared, case: Case, meshes: dict[tuple[Any, ...], Any]
) -> tuple[Prepared, Record]:
    """The same in one situation; `meshes` are shared."""
    from softmark.interpreter.models.model_preparation import Measurements, prepared_model
    from softmark.interpreter.models.shared.prepared_model import Workshop

    measured = Measurements(scene)
    workshop = Workshop(meshes=meshes, scene=scene, measured=measured)
    prepared, spent = prepared_model(declared, case, workshop)
    mesh = [sum(s[i] for s in workshop.seconds.values()) for i in (0, 1)]
    rest = [max(0.0, spent[i] - mesh[i] - measured.seconds[i]) for i in (0, 1)]
    return prepared, {"mesh": mesh, "set-up": rest, "reading": list(measured.seconds)}


def _identity(job: TimingJob) -> Record:
    """What ran where."""
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


# ------------------------------------------------------------------ the clock


@dataclass
class Timed:
    """The solutions that were timed, with the pace of the processor before, between and after them."""

    runs: list[Clocked]
    warmed: bool = False  # a first solution was left out
    compile_source: int = 0  # kernels that were compiled or loaded meanwhile
    paces: list[float] = field(default_factory=list)
    during: Record = field(default_factory=dict)


def _solutions(prepared: Prepared, job: TimingJob, where: Phases | None) -> Timed:
    """A first solution, and others until they have taken long enough."""
    gc.collect()
    before, first = pace(), _clocked(prepared, where)
    if not first.good or first.wall > job.patience_s:
        return Timed([first], paces=[before, pace()], during=first.during)
    compiling = _compilations()
    found = Timed([], warmed=True, paces=[pace()])
    while not found.runs or sum(r.wall for r in found.runs) < job.least_s:
        found.runs.append(_clocked(prepared, where))
        found.paces.append(pace())
        if not found.runs[-1].good:
            break
    found.compiled = compiling()
    found.during = _summed([r.during for r in found.runs])
    return found


def _summed(stretches: Sequence[Record]) -> Record:
    """What happened in several stretches of time together."""
    whole: Record = {}
    for name, last in stretches[-1].items():
        values = [s[name] for s in stretches]
        whole[name] = last if isinstance(last, list) else None if None in values else sum(values)
    return whole


def _clocked(prepared: Prepared, where: Phases | None) -> Clocked:
    """One solution between two looks at the gauges, which take half a millisecond and are not counted."""
    cores = frozenset(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else frozenset()
    solve = partial(prepared.solve, _unwatched)
    begin = Gauges.now(cores)
    wall, cpu = time.perf_counter(), time.process_time()
    solution = solve() if where is None else where.around(solve)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    if (spent := solution.spent) is not None:  # our clock knows nothing of another program
        wall, cpu = spent.wall_s, spent.cpu_s
    return Clocked(solution, wall, cpu, Gauges.now(cores).since(begin))


def _unwatched(iteration: object) -> None:
    """Nobody looks on."""


def _compilations() -> Callable[[], int]:
    """Begin to count how often numba compiles or loads a kernel; the function says how often it did."""
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


# ------------------------------------------------------------------ what came of it


def _facts(solution: Solution) -> Record:
    """What tells that two runs did the same: iterations, residual, and the size of the motion."""
    facts = {name: solution.facts[name] for name in FACTS if name in solution.facts}
    if solution.mesh is not None:
        facts["motion"] = math.sqrt(float((solution.mesh.displacement**2).sum()))
    return facts


def _steps(solutions: Sequence[Solution]) -> Record | None:
    """Quantiles of the seconds of time steps, over all solutions; None of a static analysis."""
    histories = [s.history for s in solutions if s.history is not None]
    if not histories:
        return None
    wall = sorted(t for h in histories for t in h.step_s)
    cpu = sorted(t for h in histories for t in h.step_cpu_s)
    return {"wall_s": quantiles(wall), "cpu_s": quantiles(cpu), "steps": len(histories[0].step_s)}


def quantiles(ordered: Sequence[float]) -> dict[str, float] | None:
    """The least value that is not below a share of all, for the shares of QUANTILES; None of nothing."""
    count = len(ordered)
    return {n: ordered[max(0, math.ceil(q * count) - 1)] for n, q in QUANTILES.items()} if count else None


def _spent(where: Phases, warmed: bool) -> dict[str, float]:
    """CPU seconds of one solution by phases: means over those that were timed."""
    counted = where.solutions[1:] if warmed else where.solutions
    names = dict.fromkeys(name for spent in counted for name in spent)
    return {name: statistics.fmean(spent.get(name, 0.0) for spent in counted) for name in names}


def _written(job: TimingJob, solution: Solution) -> float | None:
    """CPU seconds of writing the deformed mesh, or its state at some points, to a file; imports are not counted."""
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


def finite(value: Any) -> Any:
    """The same value with None for numbers that JSON does not have."""
    if isinstance(value, Mapping):
        return {str(k): finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    if isinstance(value, bool | int | str) or value is None:
        return value
    try:
        number = float(value)
    except (TypeError, ValueError):
        return str(value)
    return number if math.isfinite(number) else None


if __name__ == "__main__":
    sys.exit(main())
