"""Workers: every task has one outcome, whatever happens to the process that has it.

Most tests have a worker of their own, which speaks the same lines and does what a task tells it: sleep, die, print.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import field, replace
from pathlib import Path
from typing import Any

import pytest

import softmark
from softmark.interpreter.study.configurations import configuration_task
from softmark.interpreter.study.configurations.configuration_expansion import (
    CommandLineAdditions,
    expand,
    read_vary,
    subject_of,
)
from softmark.interpreter.study.configurations.task_outcome import PointOutcome, PointTask
from softmark.interpreter.study.workers import worker_pool
from softmark.records import dataclass

BEAM = """
param    n      = 4
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = n)
reference theory = elastica(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
"""

WORKER = """
import json, os, signal, sys, time
print(json.dumps({"ready": os.getpid()}), flush=True)
for line in sys.stdin:
    task = json.loads(line)
    time.sleep(task.get("sleep", 0.0))
    if "die" in task:
        os.kill(os.getpid(), task["die"])
    if "leave" in task:
        os._exit(task["leave"])
    point = {"status": "converged", "by": os.getpid()}
    print(json.dumps({"key": task["key"], "point": point, "references": {}}), flush=True)
"""


@dataclass(frozen=True)
class Told(PointTask):
    """A task that tells the worker above what to do."""

    to_do: dict[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        return {"key": self.key, **self.to_do}


def told(key: str, **to_do: float) -> Told:
    return Told(key, to_do=to_do)


def done(given: list[Told], jobs: int = 1, timeout: float | None = None) -> dict[str, PointOutcome]:
    """Outcomes by key, of a worker that obeys."""
    found = list(worker_pool.run_tasks(given, jobs, timeout, command=(sys.executable, "-c", WORKER)))
    assert sorted(o.key for o in found) == sorted(t.key for t in given), "each once"
    return {o.key: o for o in found}


def beam_tasks(over: str, text: str = BEAM) -> list[PointTask]:
    configurations = expand([subject_of(softmark.loads(text).scene)], CommandLineAdditions(*read_vary([over])))
    return [c.task for c in configurations]


# ------------------------------------------------------------------ what happens to processes


@pytest.mark.parametrize("jobs", [1, 3])
def test_every_task_once(jobs: int) -> None:
    found = done([told(str(i)) for i in range(10)], jobs)
    assert 1 <= len({o.point["by"] for o in found.values()}) <= jobs


def test_tasks_that_come_to_nothing() -> None:
    assert done([]) == {}


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"die": signal.SIGKILL}, "the process was killed (SIGKILL; the system does this when memory is exhausted)"),
        ({"die": signal.SIGSEGV}, "the process was killed (SIGSEGV)"),
        ({"leave": 7}, "the process ended with exit status 7"),
        ({"leave": 0}, "the process ended with exit status 0"),
    ],
)
def test_a_process_that_dies_takes_one_task_with_it(how: dict[str, int], message: str) -> None:
    found = done([told("a"), told("b", **how), told("c")])
    assert [o.point["status"] for o in found.values()] == ["converged", "failed", "converged"]
    assert found["b"].point["message"] == message
    assert found["b"].unfinished
    assert found["a"].point["by"] != found["c"].point["by"], "a new process"


def test_all_processes_may_die() -> None:
    found = done([told(str(i), die=signal.SIGKILL) for i in range(5)], 2)
    assert {o.point["status"] for o in found.values()} == {"failed"}


@pytest.mark.slow
@pytest.mark.long
def test_a_task_that_takes_too_long_is_stopped() -> None:
    begin = time.monotonic()
    found = done([told("a"), told("b", sleep=60), told("c")], timeout=0.5)
    assert time.monotonic() - begin < 30  # of 60 that it would take
    assert [o.point["status"] for o in found.values()] == ["converged", "timed_out", "converged"]
    assert found["b"].point["message"] == "it was stopped after 0.5 s; increase `--timeout`"


def test_closing_the_outcomes_ends_all_workers() -> None:
    outcomes = worker_pool.run_tasks(
        [told("a"), *(told(str(i), sleep=60) for i in range(3))], 2, command=(sys.executable, "-c", WORKER)
    )
    first = next(outcomes)
    outcomes.close()  # type: ignore[attr-defined]
    with pytest.raises(ProcessLookupError):
        os.kill(first.point["by"], 0)


def test_workers_that_do_not_start() -> None:
    with pytest.raises(worker_pool.NoWorkers, match="cannot be started"):
        list(worker_pool.run_tasks([told("a")], command=(sys.executable, "-c", "raise SystemExit(3)")))


# ------------------------------------------------------------------ real workers


@pytest.mark.long
@pytest.mark.slow
def test_one_worker_and_two_find_the_same_as_this_process() -> None:
    """Bit for bit: the same code, one thread each."""
    given = beam_tasks("n=4,5,6,7,8")
    here = {t.key: configuration_task.perform(t) for t in given}
    for jobs in (1, 2):
        there = {o.key: o for o in worker_pool.run_tasks(given, jobs)}
        assert len(there) == 5
        for key, outcome in here.items():
            assert there[key].point == outcome.point
            assert there[key].references == outcome.references
    assert [here[t.key].point["status"] for t in given] == ["converged"] * 5


@pytest.mark.slow
def test_a_killed_worker_of_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kill it when it has the second task, which is far too long to finish."""
    given = beam_tasks("n=4,100000,5")
    names = {t.key: t.overrides[-1] for t in given}
    children: list[int] = []

    def started(key: str) -> None:
        if names[key] == "n=100000":
            pids = Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="utf-8").split()
            children.extend(int(p) for p in pids if b"study.worker" in Path(f"/proc/{p}/cmdline").read_bytes())
            os.kill(children[0], signal.SIGKILL)

    if not Path("/proc/self/task").exists():
        pytest.skip("no /proc to find the worker in")
    found = {names[o.key]: o.point for o in worker_pool.run_tasks(given, started=started)}
    assert {n: p["status"] for n, p in found.items()} == {"n=4": "converged", "n=100000": "failed", "n=5": "converged"}
    assert "SIGKILL" in found["n=100000"]["message"]


def test_workers_have_one_thread_each() -> None:
    assert {v for n, v in worker_pool.worker_environment().items() if n in worker_pool.THREADS} == {"1"}


# ------------------------------------------------------------------ one task


def test_an_outcome_is_json_and_has_what_a_point_needs() -> None:
    outcome = configuration_task.perform(beam_tasks("n=4")[0])
    json.dumps(outcome.to_json(), allow_nan=False)
    point, theory = outcome.point, outcome.references["theory"]
    assert set(point) == {
        "status", "message", "outline", "size", "solve", "errors", "measured_from", "probes", "warnings", "resolution",
    }  # fmt: skip
    assert point["size"] == {"nodes": 5, "elements": 4, "dofs": 24}
    assert set(point["errors"]["eta"]) == {"value", "unit", "against"}
    assert point["errors"]["eta"]["against"] == "theory"
    assert len(point["probes"]["axis"]["displacement"]) == len(theory.probes["axis"].displacement) == 5
    assert theory.status == "converged"
    assert (outcome.cpu_s or 0.0) > 0 < (outcome.wall_s or 0.0)


def test_without_metrics_that_compare_every_probe_is_held_against_every_theory() -> None:
    """A scene without a metric gets the number of `relative_l2_error` under an automatic name."""
    without = BEAM.replace("metric   eta    = relative_l2_error(axis, against = theory)", "")
    asked, automatic = (
        configuration_task.perform(beam_tasks("n=4", text)[0]).point["errors"] for text in (BEAM, without)
    )
    assert list(automatic) == ["axis against theory"]
    assert automatic["axis against theory"] == asked["eta"]


def test_a_long_probe_is_thinned() -> None:
    outcome = configuration_task.perform(beam_tasks("n=4", BEAM.replace("points = 5", "points = 1001"))[0])
    points = outcome.point["probes"]["axis"]["points"]
    assert len(points) == configuration_task.POINTS
    assert (points[0][0], points[-1][0]) == (0.0, pytest.approx(0.178, rel=1e-12))


def test_a_scene_that_has_become_wrong_is_a_failed_point() -> None:
    task = beam_tasks("n=4")[0]
    outcome = configuration_task.perform(replace(task, overrides=("n=-4",)))
    assert outcome.point["status"] == "failed"
    assert outcome.point["message"].startswith("E301: `segments` must be")


def test_a_defect_is_a_failed_point(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object) -> None:
        raise MemoryError

    monkeypatch.delenv("SOFTMARK_DEBUG", raising=False)
    monkeypatch.setattr("softmark.interpreter.pipeline.run_pipeline.run_scene", broken)
    outcome = configuration_task.perform(beam_tasks("n=4")[0])
    assert (outcome.point["status"], outcome.point["message"]) == (
        "failed", "it stopped with an error (out of memory)",
    )  # fmt: skip


def test_a_reference_is_solved_once_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    from softmark.interpreter.study.configurations import configuration_keys
    from softmark.references import REFERENCES

    count, solve = [0], REFERENCES["elastica"].solve

    def counted(self: Any, *arguments: Any) -> Any:
        count[0] += 1
        return solve(self, *arguments)

    monkeypatch.setattr(configuration_keys, "_REMEMBERED", {})
    monkeypatch.setattr(REFERENCES["elastica"], "solve", counted)
    for task in beam_tasks("n=4,5,6"):
        configuration_task.perform(task)
    assert count == [1]
    configuration_task.perform(beam_tasks("gel.young=50 kPa")[0])
    assert count == [2]


# ------------------------------------------------------------------ a cluster


@pytest.mark.slow
@pytest.mark.long
def test_nobody_answers() -> None:
    with pytest.raises(worker_pool.NoWorkers, match=r"no dask scheduler responds at tcp://127\.0\.0\.1:9"):
        list(worker_pool.run_tasks_on_cluster(beam_tasks("n=4"), "tcp://127.0.0.1:9", wait=0.5))


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(worker_pool.NoWorkers, match=r"pip install 'softmark\[cluster\]'"):
        list(worker_pool.run_tasks_on_cluster(beam_tasks("n=4"), "tcp://127.0.0.1:9"))


@pytest.mark.slow
def test_a_cluster_finds_the_same() -> None:
    """A scheduler and a worker process on this machine, found by their address as any other."""
    distributed = pytest.importorskip("distributed")
    given = beam_tasks("n=4,5,-3")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0", host="127.0.0.1"
    ) as cluster:
        there = {o.key: o for o in worker_pool.run_tasks_on_cluster(given, cluster.scheduler_address)}
    here = {t.key: configuration_task.perform(t) for t in given}
    assert {k: o.point for k, o in there.items()} == {k: o.point for k, o in here.items()}
    assert sorted(o.point["status"] for o in there.values()) == ["converged", "converged", "failed"]


def test_a_worker_with_other_sources_is_not_believed() -> None:
    outcome = worker_pool.perform_on_cluster(beam_tasks("n=4")[0], "0" * 64)
    assert outcome.point["status"] == "failed"
    assert "a different version" in outcome.point["message"]


def test_a_scheduler_that_dies_leaves_reasons(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was not finished is lost with the reason, what was finished is there; nothing is raised, nor by closing."""
    given = [*beam_tasks("n=4"), *beam_tasks("n=5")]

    class Future:
        status = "finished"

        def __init__(self, task: Any) -> None:
            self.task = task

        def result(self) -> Any:
            return worker_pool.timed_out_outcome(self.task, 1.0)

    class Client:
        loop = None

        def submit(self, function: Any, task: Any, *words: Any, **options: Any) -> Future:
            return Future(task)

        def close(self) -> None:
            raise OSError("it is gone")

    def as_completed(futures: Any, loop: Any) -> Any:
        yield next(iter(futures))
        raise ConnectionError("the stream is closed")

    module = type("Dask", (), {"as_completed": staticmethod(as_completed)})
    monkeypatch.setattr(worker_pool, "_import_dask", lambda: module)
    monkeypatch.setattr(worker_pool, "_connect_client", lambda address, wait: Client())
    monkeypatch.setattr(worker_pool, "_connection_errors", lambda: (OSError,))
    first, *others = worker_pool.run_tasks_on_cluster(given, "tcp://127.0.0.1:9")
    assert first.status == "timed_out"
    assert len(others) == len(given) - 1 > 0
    assert all("no connection to the scheduler: the stream is closed" in str(other.to_json()) for other in others)


@pytest.mark.slow
@pytest.mark.long
def test_a_worker_whose_parent_has_ended_ends_without_a_traceback() -> None:
    """An interrupt ends the parent while a worker starts: its first message meets a closed pipe."""
    command = [sys.executable, "-m", "softmark.interpreter.study.workers.worker_process"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as worker:
        assert worker.stdout is not None
        assert worker.stderr is not None
        worker.stdout.close()
        assert worker.stderr.read() == b""
        assert worker.wait(60) == 0
