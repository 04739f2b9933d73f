"""Pool of workers that perform tasks: processes of this machine, or workers of a dask cluster.

    run_tasks(tasks, jobs=2)                in worker processes, one thread each
    run_tasks_on_cluster(tasks, address)    on the workers of the scheduler at the address

Both yield each task's outcome once, as it becomes available. If a worker dies, only its current task fails.
"""

from __future__ import annotations

import importlib
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from softmark.interpreter.study.configurations import timing_job
from softmark.interpreter.study.configurations.configuration_task import failed_outcome
from softmark.interpreter.study.configurations.task_outcome import PointOutcome, PointTask

Started = Callable[[str], None]  # called with the key of a task when it starts

THREADS = (*timing_job.THREADS, "NUMEXPR_NUM_THREADS", "BLIS_NUM_THREADS")
WORKER = (sys.executable, "-P", "-m", "softmark.interpreter.study.workers.worker_process")
TICK = 0.2  # s between checks of the clock
START = 120.0  # s in which a worker must have started
STARTS = 3  # maximum number of consecutive failed starts


class NoWorkers(Exception):
    """Error: no worker is available. The text gives the reason and the remedy."""


def unfinished_outcome(task: PointTask, message: str) -> PointOutcome:
    """Return the outcome of a lost task: its result is unknown, and another try may have one."""
    return failed_outcome(task, message, unfinished=True)


def timed_out_outcome(task: PointTask, limit: float) -> PointOutcome:
    """Return the outcome of a task that took longer than `limit` seconds; with more time it may have a result."""
    why = f"it was stopped after {limit:g} s; increase `--timeout`"
    return failed_outcome(task, why, "timed_out", wall_s=limit, unfinished=True, limit_s=limit)


def worker_environment() -> dict[str, str]:
    """Return the environment variables of a worker: one thread for every library, since tasks share the machine."""
    return {**os.environ, **dict.fromkeys(THREADS, "1")}


# ------------------------------------------------------------------ processes


@dataclass
class _Worker:
    """Worker process and its current task."""

    process: subprocess.Popen[bytes]
    task: PointTask | None = None
    ready: bool = False
    since: float = field(default_factory=time.monotonic)  # start of the process or of its task, s (monotonic clock)
    read: bytes = b""
    spent: float | None = None  # CPU time of the process at the start of its task, s

    def give(self, task: PointTask) -> None:
        """Send a task to the process. Raises OSError if it has ended."""
        self.task, self.since, self.spent = task, time.monotonic(), cpu_seconds_of(self.process.pid)
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(task.to_json(), separators=(",", ":")).encode() + b"\n")
        self.process.stdin.flush()

    def end(self) -> int:
        """Kill the process, wait for it, and return its exit status."""
        if self.process.poll() is None:
            self.process.kill()
        code = self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):  # buffered input of a dead process is lost
                if pipe is not None:
                    pipe.close()
        return code


def cpu_seconds_of(pid: int) -> float | None:
    """Return the CPU time that a process has used so far, s; None if unknown."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
            fields = file.read().rpartition(")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / float(os.sysconf("SC_CLK_TCK"))  # utime and stime of proc(5)


def run_tasks(
    tasks: Sequence[PointTask] | deque[PointTask],
    jobs: int = 1,
    timeout: float | None = None,
    started: Started = lambda key: None,
    command: Sequence[str] = WORKER,
    patience: float = 1.0,
) -> Iterator[PointOutcome]:
    """Yield the outcomes of tasks run in `jobs` processes, as they become available. Raises NoWorkers.

    A task that takes longer than `timeout` seconds is killed (`timed_out_outcome`). Closing the iterator kills all
    workers. With a `patience` above 1 the timeout is CPU time, so that a busy machine changes no outcome; the limit of
    wall time is then `patience` times as long. If `tasks` is a deque, the receiver of an outcome may append further
    tasks.
    """
    waiting = tasks if isinstance(tasks, deque) else deque(tasks)
    pool = _Pool(waiting, jobs, timeout, started, command=command, patience=patience)
    try:
        yield from pool.run()
    finally:
        pool.end()


@dataclass
class _Pool:
    waiting: deque[PointTask]
    jobs: int
    timeout: float | None
    started: Started
    workers: dict[int, _Worker] = field(default_factory=dict)  # by the descriptor of its outcomes
    selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)
    command: Sequence[str] = WORKER
    lost: int = 0  # workers in a row that did not start
    patience: float = 1.0

    def run(self) -> Iterator[PointOutcome]:
        """Yield outcomes until all tasks are done."""
        while self.waiting or any(w.task for w in self.workers.values()):
            self._start_workers()
            for key, _ in self.selector.select(TICK):
                yield from self._handle_output(key.fd)
            yield from self._kill_late_workers()

    def end(self) -> None:
        """Kill the processes of all workers."""
        for worker in self.workers.values():
            worker.end()
        self.workers.clear()
        self.selector.close()

    def _start_workers(self) -> None:
        """Start as many workers as there are tasks, up to the limit, and give a task to each idle worker."""
        busy = sum(w.task is not None for w in self.workers.values())
        while len(self.workers) < min(self.jobs, busy + len(self.waiting)):
            process = subprocess.Popen(
                [*self.command],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=worker_environment(),
            )  # fmt: skip
            assert process.stdout is not None
            self.workers[process.stdout.fileno()] = _Worker(process)
            self.selector.register(process.stdout, selectors.EVENT_READ)
        for worker in self.workers.values():
            if worker.ready and worker.task is None and self.waiting:
                task = self.waiting.popleft()
                self.started(task.key)
                with suppress(OSError):  # it may have died: its pipe ends, and the task is reported then
                    worker.give(task)

    def _handle_output(self, descriptor: int) -> Iterator[PointOutcome]:
        """Handle the output of a worker: that it is ready, an outcome, or the end of its process."""
        worker = self.workers[descriptor]
        data = os.read(descriptor, 1 << 20)
        if not data:
            yield from self._handle_worker_exit(descriptor)
            return
        *lines, worker.read = (worker.read + data).split(b"\n")
        for line in lines:
            found = json.loads(line)
            if worker.ready:
                worker.task = None
                yield PointOutcome.from_json(found)
            else:
                worker.ready, self.lost = True, 0

    def _handle_worker_exit(self, descriptor: int, late: bool = False) -> Iterator[PointOutcome]:
        worker = self.workers.pop(descriptor)
        self.selector.unregister(descriptor)
        code = worker.end()
        if worker.task is not None:
            limit = self.timeout if late else None
            yield (
                unfinished_outcome(worker.task, _describe_death(code))
                if limit is None
                else timed_out_outcome(worker.task, limit)
            )
        elif not worker.ready:
            self.lost += 1
            if self.lost >= STARTS:
                raise NoWorkers(f"worker processes cannot be started (exit status {code}); see the output above")

    def _kill_late_workers(self) -> Iterator[PointOutcome]:
        """Kill the workers whose task exceeded its time limit, and yield the outcomes of these tasks."""
        now = time.monotonic()
        for descriptor, worker in list(self.workers.items()):
            spent = now - worker.since
            if worker.task is not None and self.timeout is not None and self._is_over_time_limit(worker, spent):
                yield from self._handle_worker_exit(descriptor, late=True)
            elif not worker.ready and spent > START:
                yield from self._handle_worker_exit(descriptor)

    def _is_over_time_limit(self, worker: _Worker, wall: float) -> bool:
        """Return whether the task of a worker exceeded its time limit."""
        limit = max(self.timeout or 0.0, worker.task.limit_s or 0.0 if worker.task else 0.0)
        now = cpu_seconds_of(worker.process.pid) if self.patience > 1 else None
        if now is None or worker.spent is None:
            return wall > limit
        return now - worker.spent > limit or wall > self.patience * limit


def _describe_death(code: int) -> str:
    """Return the message for a worker process that ended during a task."""
    if code >= 0:
        return f"the process ended with exit status {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    hint = "; the system does this when memory is exhausted" if name == "SIGKILL" else ""
    return f"the process was killed ({name}{hint})"


# ------------------------------------------------------------------ a cluster


def run_tasks_on_cluster(
    tasks: Sequence[PointTask], address: str, timeout: float | None = None, wait: float = 10.0
) -> Iterator[PointOutcome]:
    """Yield the outcomes of tasks run on a dask cluster, as they become available. Raises NoWorkers.

    `address` is that of the dask scheduler. Each thread of a worker performs one task at a time. A task cannot be
    killed on a cluster: after `timeout` seconds it counts as `timed_out_outcome`, and its thread continues.
    """
    client = _connect_client(address, wait)
    try:
        yield from _gather_outcomes(client, tasks, timeout)
    finally:
        with suppress(Exception):  # the scheduler has died, so nothing can be cancelled
            client.close()


def _connect_client(address: str, wait: float) -> Any:
    try:
        return _import_dask().Client(address, timeout=wait, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error) or type(error).__name__
        raise NoWorkers(
            f"no dask scheduler responds at {address} ({reason}); start one with `dask scheduler`, or omit --cluster"
        ) from error


def _import_dask() -> Any:
    """Return the package `distributed`, which the extra `softmark[cluster]` installs. Raises NoWorkers."""
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise NoWorkers("--cluster needs dask: pip install 'softmark[cluster]'") from error


def _gather_outcomes(client: Any, tasks: Sequence[PointTask], timeout: float | None) -> Iterator[PointOutcome]:
    from softmark.interpreter.study.configurations import source_digests

    own = source_digests.digest_sources()
    futures = {client.submit(perform_on_cluster, task, own, timeout, pure=False, retries=0): task for task in tasks}
    waiting = dict(futures)
    try:
        for future in _import_dask().as_completed(futures, loop=client.loop):
            task = waiting.pop(future)
            if future.status == "finished":
                yield future.result()
            else:
                yield unfinished_outcome(task, _describe_lost_task(future))
    except _connection_errors() as error:
        reason = str(error) or type(error).__name__
        for task in waiting.values():
            yield unfinished_outcome(task, f"the cluster lost this task (no connection to the scheduler: {reason})")


def _connection_errors() -> tuple[type[BaseException], ...]:
    """Return the exceptions that dask raises when the connection to its scheduler is lost."""
    futures = importlib.import_module("concurrent.futures")
    comm = importlib.import_module("distributed.comm")
    return OSError, futures.CancelledError, comm.CommClosedError, TimeoutError


def _describe_lost_task(future: Any) -> str:
    error = future.exception() if future.status == "error" else None
    name = future.status if error is None else type(error).__name__
    if name == "KilledWorker":
        return "the process was killed (a cluster worker died while running this task)"
    return f"the cluster lost this task ({name}: {error})"


def perform_on_cluster(task: PointTask, digest: str, timeout: float | None = None) -> PointOutcome:
    """Perform a task on a worker of a cluster; `digest` is the digest of the sources of this process.

    If the worker has other sources or library versions, the task is not performed.
    """
    from softmark.interpreter.study.configurations import configuration_task, source_digests

    if source_digests.digest_sources() != digest:
        return unfinished_outcome(
            task, "the worker has a different version of softmark, numpy, scipy or numba than this process"
        )
    if timeout is None:
        return configuration_task.perform(task)
    return _perform_within(task, timeout)


def _perform_within(task: PointTask, timeout: float) -> PointOutcome:
    """Perform a task in a separate thread, which is abandoned after `timeout` seconds."""
    import threading

    from softmark.interpreter.study.configurations import configuration_task

    found: list[PointOutcome] = []
    thread = threading.Thread(target=lambda: found.append(configuration_task.perform(task)), daemon=True)
    thread.start()
    thread.join(timeout)
    if found:
        return found[0]
    return timed_out_outcome(task, timeout)
