"""Timing in processes of their own: order, isolation, disturbance, and processes that fail. No time is asserted."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from softmark.interpreter.study.analysis import timing_quality
from softmark.interpreter.study.configurations.timing_job import THREADS, TimingJob
from softmark.interpreter.study.timing import timed_process, timing_rounds
from softmark.interpreter.study.timing.os_counters import OsCounters
from softmark.interpreter.study.timing.solver_phases import (
    FUNCTIONS,
    METHODS,
    PhaseClock,
    find_timed_functions,
    owner_of,
)
from softmark.interpreter.study.timing.timing_rounds import run_timing_process, time_jobs

LINUX = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="processors can be chosen on Linux only")
TEXT = """softmark 1
scene "A bar that bends"
material gel = neo_hookean(young = 60 kPa, poisson = 0.45, density = 1000 kg/m^3)
body     bar = solid(cylinder(length = 100 mm, radius = 10 mm, axis = +x), gel)
support  wall = fixed(bar, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2, direction = -z)
analysis rest = static(max_iterations = 50)
model    rod = beam6dof(segments = 4)
model    cells = fem(tet4, strain = corotational, size = 10 mm)
probe    axis = line(bar, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 3)
metric   drop = displacement(axis, along = -z)
"""


def job(key: str, *overrides: str, text: str = TEXT, **more: Any) -> TimingJob:
    """A rod of few segments, timed for a short while."""
    return TimingJob(key, more.pop("model", "rod"), text=text, overrides=overrides, **{"least_s": 0.05} | more)


@pytest.fixture(autouse=True)
def own_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A lock of this test's own, for others may be timing on this machine; no waiting for it to calm down."""
    monkeypatch.setattr(timing_rounds, "PATIENCE", 0.0)
    monkeypatch.setattr(timing_rounds, "lock_file", lambda: tmp_path / "lock")


@contextmanager
def busy(core: int) -> Iterator[None]:
    """A process that computes on a processor without end."""
    loop = f"import os\nos.sched_setaffinity(0, {{{core}}})\nprint(flush=True)\nwhile True: pass"
    process = subprocess.Popen([sys.executable, "-c", loop], stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        process.stdout.readline()
        yield
    finally:
        process.kill()
        process.communicate()


@pytest.mark.long
@pytest.mark.slow
def test_rounds_are_interleaved_and_every_run_is_a_process_of_its_own() -> None:
    records: list[dict[str, Any]] = []
    costs = time_jobs([job("a"), job("b", "rod.segments=6")], repeats=2, extra=0, keep=records.append, phases=False)
    assert [r["key"] for r in records] == ["a", "b", "a", "b"]
    assert len({r["pid"] for r in records} | {os.getpid()}) == 5
    for record in records:
        assert record["status"] == "converged", record
        assert record["threads"]["asked"] == 1
        assert record["threads"]["running"] in (1, None)
        assert record["during"]["compiled"] == 0
        assert record["warmed"]
        assert record["size"]["nodes"] == {"a": 5, "b": 7}[record["key"]]
    assert costs.keys() == {"a", "b"}
    for cost in costs.values():
        assert cost is not None
        assert cost["wall_s"]["runs"] == 2
        assert cost["cpu_s"]["median"] > 0
        assert json.loads(json.dumps(cost, allow_nan=False)) == cost


@pytest.mark.slow
@LINUX
def test_all_runs_are_on_one_processor_and_the_parent_keeps_off_it() -> None:
    allowed, seen = os.sched_getaffinity(0), []
    records: list[dict[str, Any]] = []

    def keep(record: dict[str, Any]) -> None:
        records.append(record)
        seen.append(os.sched_getaffinity(0))

    time_jobs([job("a")], repeats=1, extra=0, keep=keep, phases=False)
    (core,) = records[0]["cores"]
    assert core in allowed
    if len(allowed) > 1:
        assert core not in seen[0]
    assert os.sched_getaffinity(0) == allowed


@pytest.mark.long
@pytest.mark.slow
def test_what_is_done_already_is_not_done_again() -> None:
    first: list[dict[str, Any]] = []
    time_jobs([job("a")], repeats=1, extra=0, keep=first.append)
    assert [r["kind"] for r in first] == ["timed", "phases"]
    more: list[dict[str, Any]] = []
    costs = time_jobs([job("a")], repeats=1, extra=0, keep=more.append, done=json.loads(json.dumps(first)))
    assert more == []
    assert costs["a"] is not None
    others = [r | {"host": "another machine"} for r in first]
    time_jobs([job("a")], repeats=1, extra=0, keep=more.append, done=others, phases=False)
    assert len(more) == 1


@pytest.mark.slow
@LINUX
def test_a_run_beside_a_busy_loop_is_flagged() -> None:
    core = max(os.sched_getaffinity(0))
    with busy(core):
        record = run_timing_process(job("a", least_s=0.3), [core])
    assert record["status"] == "converged", record
    assert "shared" in timing_quality.disturbances(record)  # two on one processor: each gets half of it


@pytest.mark.slow
def test_disturbed_runs_are_repeated_so_often_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three clean runs are wanted, all are disturbed, two more are allowed: five."""
    made: list[str] = []

    def disturbed(job: TimingJob, cores: Any, kind: str = "timed") -> dict[str, Any]:
        made.append(job.key)
        return _record(job.key, compiled=1)

    monkeypatch.setattr(timing_rounds, "run_timing_process", disturbed)
    costs = time_jobs([job("a")], repeats=3, extra=2, phases=False)
    assert made == ["a"] * 5
    assert costs["a"] is not None
    assert costs["a"]["contaminated"]
    assert costs["a"]["flags"] == ["contaminated", "compiled"]


@pytest.mark.slow
def test_what_takes_long_is_repeated_three_times(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []

    def slow(job: TimingJob, cores: Any, kind: str = "timed") -> dict[str, Any]:
        made.append(job.key)
        return _record(job.key, elapsed_s=61.0 if job.key == "a" else 1.0)

    monkeypatch.setattr(timing_rounds, "run_timing_process", slow)
    costs = time_jobs([job("a"), job("b")], repeats=5, phases=False)
    assert made == ["a", "b"] * 3 + ["b"] * 2
    assert costs["a"] is not None
    assert costs["b"] is not None
    assert costs["a"]["flags"] == ["few repeats"]
    assert costs["b"]["flags"] == []


def _record(key: str, elapsed_s: float = 1.0, compiled: int = 0) -> dict[str, Any]:
    return {
        "key": key,
        "kind": "timed",
        "host": timing_rounds.describe_host(),
        "elapsed_s": elapsed_s,
        "status": "converged",
        "wall_s": [1.0],
        "cpu_s": [1.0],
        "setup": {"mesh": [0, 0], "set-up": [1, 1]},
        "memory": {},
        "during": {"wall_s": 1.0, "compiled": compiled},
        "threads": {"asked": 1},
    }


# ------------------------------------------------------------------ what fails


@pytest.mark.slow
def test_what_does_not_converge_is_run_once_and_says_so() -> None:
    records: list[dict[str, Any]] = []
    costs = time_jobs([job("a", "rest.max_iterations=1", "weight.magnitude=9e4 m/s^2")], repeats=3, keep=records.append)
    assert costs == {"a": None}
    assert [r["status"] for r in records] == ["not_converged"]
    assert timing_quality.reason_without_times(records)


def test_a_process_that_hangs_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing_rounds, "CHILD", (sys.executable, "-c", "import time; time.sleep(60)"))
    record = run_timing_process(job("a", timeout_s=0.5), [])
    assert record["status"] == "timed_out"
    assert record["message"] == "it did not finish within 0.5 s"
    with pytest.raises(ProcessLookupError):
        os.kill(record["pid"], 0)


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("import os; os.kill(os.getpid(), 9)", "the process ended by signal 9: no output"),
        ("raise SystemExit('no such library')", "the process ended with status 1: no such library"),
        ("print('not JSON')", "the process ended with status 0: no output"),
    ],
)
@LINUX
def test_a_process_that_dies_has_a_message(program: str, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing_rounds, "CHILD", (sys.executable, "-c", program))
    record = run_timing_process(job("a"), [])
    assert (record["status"], record["message"]) == ("failed", message)


def test_an_interruption_ends_the_process_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a person's Ctrl-C does to the parent while it waits."""
    started: list[subprocess.Popen[bytes]] = []

    class Interrupted(subprocess.Popen):  # type: ignore[type-arg]
        def communicate(self, *args: Any, **kwargs: Any) -> Any:
            started.append(self)
            raise KeyboardInterrupt

    monkeypatch.setattr(timing_rounds, "CHILD", (sys.executable, "-c", "import time; time.sleep(60)"))
    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        time_jobs([job("a")], repeats=1)
    (child,) = started
    assert child.returncode is not None


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"text": TEXT, "model": "rods"}, "the scene has no model `rods`"),
        ({}, "E223: the scene declares nothing"),
        ({"text": "softmark 1\nscene"}, "E"),
        ({"file": "no-such-scene", "text": None}, "there is no file"),
        ({"overrides": ["bar=1"]}, "E"),
    ],
)
def test_a_scene_that_cannot_be_computed_is_a_message(asked: dict[str, Any], message: str) -> None:
    text = 'softmark 1\nscene "Nothing"\n'
    record = _in_this_process({"key": "a", "text": text, "model": "rod"} | asked)
    assert record["status"] == "failed"
    assert record["message"].startswith(message)


def _in_this_process(asked: dict[str, Any], **environment: str) -> dict[str, Any]:
    """What the child makes of a job, without a process."""
    kept = {n: os.environ.get(n) for n in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1") | environment)
    try:
        return timed_process._run_guarded(asked | {"timeout_s": 1e5})
    finally:
        timed_process.signal.alarm(0)
        for name, value in kept.items():
            os.environ.pop(name) if value is None else os.environ.__setitem__(name, value)


def test_a_process_with_another_number_of_threads_refuses() -> None:
    record = _in_this_process(job("a").to_json(), OMP_NUM_THREADS="4")
    assert record["status"] == "failed"
    assert record["message"] == "OMP_NUM_THREADS must be 1 before a timed process starts"


def test_a_job_that_cannot_be_read_is_a_message() -> None:
    done = subprocess.run(timing_rounds.CHILD, input=b"{", capture_output=True, check=True)
    assert json.loads(done.stdout)["message"].startswith("the job cannot be read")
    assert b"Traceback" not in done.stderr


# ------------------------------------------------------------------ one comparison at a time


def test_a_second_comparison_waits_for_the_first() -> None:
    said, free = [], threading.Event()

    def wait() -> None:
        with timing_rounds.exclusive_timing(lambda what, detail: said.append(detail)):
            free.set()

    other = threading.Thread(target=wait)
    with timing_rounds.exclusive_timing():
        other.start()
        assert not free.wait(0.2)
    assert free.wait(10)
    other.join()
    assert said == ["another comparison is timing on this machine; waiting for it"]


# ------------------------------------------------------------------ where the time goes


@pytest.mark.slow
@pytest.mark.long
def test_every_name_in_the_tables_is_there() -> None:
    for dotted in FUNCTIONS:
        path = dotted.rpartition(".")[0]
        importlib.import_module(path if path.rpartition(".")[2].islower() else path.rpartition(".")[0])
        owner, name = owner_of(dotted)
        assert callable(vars(owner)[name]), dotted
    users = ("sparse.sparse_cholesky", "linear.recycled_solves", "energies.geometrically_exact_rod",
             "energies.elastic_energy", "energies.corotational_tets")  # fmt: skip
    for name in (*METHODS, *(f"softmark.solvers.{user}" for user in users)):
        importlib.import_module(name)
    found = {(owner.__name__, name): phase for owner, name, phase in find_timed_functions()}
    assert found["softmark.solvers.linear.factorisations", "factor"] == "factorisation"
    assert found["CholeskyFactor", "solve"] == found["LinearSolver", "solve"] == "solution"
    assert found["Cholesky", "factorise"] == "factorisation"
    assert found["CorotationalTets", "add_both_lagged"] == found["RodElementEnergy", "add_hessian"] == "assembly"
    for prefix, methods in METHODS.items():
        for method in methods:
            owners = [o for o, n, _ in find_timed_functions() if n == method and isinstance(o, type)]
            assert any(o.__module__.startswith(prefix) for o in owners), (prefix, method)


@pytest.mark.slow
def test_phases_of_a_solid_are_mostly_tangents_and_factors() -> None:
    record = run_timing_process(job("a", model="cells"), [], "phases")
    assert record["status"] == "converged", record
    phases = record["phases"]
    assert {"assembly", "factorisation", "solution", "other"} == phases.keys()
    # a few hundred unknowns: tangents and factors are nearly all of it, substitutions next to nothing
    assert phases["assembly"] + phases["factorisation"] > 0.5 * sum(phases.values())
    assert phases["solution"] < phases["factorisation"]
    assert record["output_s"] > 0


def test_the_time_of_output_is_that_of_the_file_of_the_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once a mesh that came without its model was passed over: the time was that of making an empty folder."""
    from softmark.interpreter.models.model_preparation import prepared_model
    from softmark.interpreter.models.shared.prepared_model import BuildContext
    from softmark.interpreter.results import vtk_writer

    own, files = vtk_writer.write_vtu, []
    monkeypatch.setattr(
        vtk_writer, "write_vtu", lambda report, folder: files.append([f.name for f in own(report, folder)])
    )
    scene, declared, case = timed_process._load_scene_model_case(job("a", model="cells"))
    prepared, _ = prepared_model(declared, case, BuildContext(scene=scene))
    assert timed_process._time_writing(job("a", model="cells"), prepared.solve(lambda i: None)) is not None
    assert files == [["cells.vtu"], ["cells.vtu"]]


def test_phases_sum_to_the_whole_and_no_clock_stays_behind() -> None:
    """Clocks that nest stop each other: what they count together is the CPU time of the solutions, within 2 %."""
    import time

    from softmark.interpreter.models.model_preparation import prepared_model
    from softmark.interpreter.models.shared.prepared_model import BuildContext
    from softmark.solvers.linear import factorisations

    scene, declared, case = timed_process._load_scene_model_case(job("a", model="cells"))
    prepared, _ = prepared_model(declared, case, BuildContext(scene=scene))
    prepared.warm()
    where = PhaseClock()
    where.around(lambda: prepared.solve(lambda i: None))
    before = (factorisations.factor, factorisations.LuFactor.solve)

    def ten() -> float:
        begin = time.process_time()
        for _ in range(10):
            prepared.solve(lambda i: None)
        return time.process_time() - begin

    whole = where.around(ten)
    assert sum(where.solutions[-1].values()) == pytest.approx(whole, rel=0.02)
    assert (factorisations.factor, factorisations.LuFactor.solve) == before


def test_gauges_tell_what_happened_between_two_looks() -> None:
    start = OsCounters.now()
    seen = OsCounters.now().since(start)
    assert seen["wall_s"] > 0
    assert all(v is None or v >= 0 for n, v in seen.items() if n != "pressure_avg10")


@pytest.mark.slow
def test_comparisons_take_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second comparison waited until the first had timed all that it had to."""
    order: list[str] = []

    def run(job: TimingJob, cores: object, kind: str = "timed") -> dict[str, Any]:
        order.append(job.key)
        time.sleep(0.2)
        return {
            "key": job.key,
            "kind": kind,
            "host": timing_rounds.describe_host(),
            "status": "failed",
            "message": "",
            "pid": 0,
        }

    monkeypatch.setattr(timing_rounds, "run_timing_process", run)
    monkeypatch.setattr(timing_rounds.timing_quality, "disturbances", lambda record, pace: [])
    first = threading.Thread(
        target=lambda: time_jobs([job("a"), job("b"), job("c"), job("d")], repeats=1, phases=False)
    )
    first.start()
    while not order:
        time.sleep(0.01)
    time_jobs([job("z")], repeats=1, phases=False)
    first.join()
    assert order.index("z") < len(order) - 1


def test_a_lock_that_is_never_let_go_is_waited_for_no_longer_than_its_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Anybody may lock a file in the folder of everybody's."""
    import fcntl

    monkeypatch.setattr(timing_rounds, "lock_file", lambda: tmp_path / "lock")
    monkeypatch.setattr(timing_rounds, "LONGEST_WAIT", 0.2)
    said: list[str] = []
    with (tmp_path / "lock").open("w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        with timing_rounds.exclusive_timing(lambda what, detail: said.append(detail)):
            pass
    assert said[0].startswith("another comparison is timing")
    assert said[-1].endswith("timing continues without the lock")


def test_a_log_without_progress_names_what_a_comparison_waits_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Progress outside a terminal prints only lines of some kinds: a held lock, and a busy machine, are among them."""
    import fcntl
    import io

    from softmark.interpreter.cli.commands.progress_line import Progress

    monkeypatch.setattr(timing_rounds, "lock_file", lambda: tmp_path / "lock")
    monkeypatch.setattr(timing_rounds, "LONGEST_WAIT", 0.3)
    monkeypatch.setattr(timing_rounds, "QUIET", 0.1)
    stream = io.StringIO()
    with (tmp_path / "lock").open("w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        with timing_rounds.exclusive_timing(Progress(stream).say):
            pass
    assert stream.getvalue().count("waiting for another comparison") == 1
    monkeypatch.setattr(timing_rounds, "CALM", -1.0)  # whatever is measured, the machine is busy
    monkeypatch.setattr(timing_rounds, "PATIENCE", 0.0)
    monkeypatch.setattr(timing_rounds, "GLANCE", 0.01)
    desk = timing_rounds._TimingRunner(timing_rounds._discard_record, Progress(stream).say)
    with desk:
        desk._wait_until_idle(1)
        desk._wait_until_idle(1)
    assert stream.getvalue().count("other processes use this machine") == 1
