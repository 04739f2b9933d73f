"""Reliable timing: one process at a time on the machine, on a processor of its own, in interleaved rounds.

Every run of every job is a new process (`timed_process.py`). Rounds are interleaved, A B C A B C, so that a machine
that slows down slows all jobs. Two comparisons on one machine take turns. Disturbed runs are repeated. Each record is
passed to `keep` at once, and is passed back in `done` when an interrupted comparison continues.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from softmark.interpreter.results.state_results import SOLVED
from softmark.interpreter.study.analysis import timing_quality
from softmark.interpreter.study.configurations.timing_job import TimingJob
from softmark.interpreter.study.timing.os_counters import OsCounters
from softmark.interpreter.study.timing.processor_choice import choose_processors

Record = dict[str, Any]
Say = Callable[[str, str], None]  # (what is being done, detail)
CHILD = (sys.executable, "-P", "-m", "softmark.interpreter.study.timing.timed_process")
GLANCE = 0.25  # s, how long the machine is watched before a round
LONGEST_WAIT = 600.0  # s, maximum wait for the lock: a longer holder is not timing a run
TURN = 0.1  # s after a run in which another comparison may begin one
PATIENCE = 5.0  # s, maximum wait of a round for an idle machine
QUIET = 5.0  # s of waiting after which a line is printed, also where no progress is drawn
CALM = 0.05  # fraction of the time in which some task waits
FEW = 3  # number of runs of a slow job


def _ignore_message(what: str, detail: str) -> None:
    """Do nothing; default for the callback `say`, which gets messages."""


def _discard_record(record: Record) -> None:
    """Do nothing; default for the callback `keep`, which gets new records."""


@dataclass
class _TimingRecords:
    """Records of all runs, from which the jobs that need another run are found."""

    jobs: Sequence[TimingJob]
    repeats: int
    extra: int
    phases: bool
    records: dict[str, list[Record]] = field(default_factory=dict)

    def add(self, record: Record) -> None:
        """Add the record of a run."""
        self.records.setdefault(str(record.get("key")), []).append(record)

    def of(self, job: TimingJob) -> list[Record]:
        """Return the records of all runs of a job, in order."""
        return self.records.get(job.key, [])

    @property
    def pace(self) -> float | None:
        """Usual CPU time, s, of the fixed piece of work that measures processor speed; None without records."""
        return timing_quality.usual_pace(r for own in self.records.values() for r in own)

    def timed(self, job: TimingJob) -> list[Record]:
        """Return the records of the runs of a job that have a solution and its time."""
        return [r for r in self.of(job) if timing_quality.is_timed_solution(r)]

    def wanted_run_count(self, job: TimingJob) -> int:
        """Return the number of undisturbed runs that a job should have."""
        costly = any(r.get("elapsed_s", 0.0) > job.costly_s for r in self.timed(job))
        return min(self.repeats, FEW) if costly else self.repeats

    def due(self, job: TimingJob) -> bool:
        """Return whether a job needs another run: it has too few undisturbed runs, no failed run, and tries left."""
        if any(r.get("status") not in SOLVED for r in self.of(job)):
            return False
        runs, wanted = self.timed(job), self.wanted_run_count(job)
        calm = sum(timing_quality.is_undisturbed(r, self.pace) for r in runs)
        return calm < wanted and len(runs) < wanted + self.extra

    def jobs_without_phases(self) -> list[TimingJob]:
        """Return the jobs that still need the run in which the phases of the solver are timed."""
        if not self.phases:
            return []
        return [j for j in self.jobs if self.timed(j) and not any(r.get("kind") == "phases" for r in self.of(j))]


def time_jobs(
    jobs: Sequence[TimingJob],
    repeats: int = 5,
    keep: Callable[[Record], None] = _discard_record,
    done: Iterable[Record] = (),
    say: Say = _ignore_message,
    extra: int | None = None,
    phases: bool = True,
) -> dict[str, timing_quality.CostJson | None]:
    """Return the timing results of each job by its key, None for a job without a solution (see `timing_quality`).

    Each job runs until `repeats` runs are undisturbed, with at most `extra` more runs (by default `repeats`). It runs
    once more with clocks for the `phases`. Records in `done` count if they are from this machine. Jobs with the same
    key are one job.
    """
    unique = list({job.key: job for job in jobs}.values())
    book = _TimingRecords(unique, repeats, repeats if extra is None else extra, phases)
    for record in done:
        if record.get("host") == describe_host():
            book.add(record)
    if any(map(book.due, unique)) or book.jobs_without_phases():
        with _TimingRunner(keep, say) as desk:
            desk.work(book)
    return {job.key: timing_quality.summarize_cost(book.of(job), repeats, book.pace) for job in unique}


def describe_host() -> str:
    """Return the names of this machine and its Python version as text; only times with equal texts are comparable."""
    return f"{platform.node()} {platform.machine()} python {platform.python_version()}"


class _TimingRunner:
    """Runner that starts timing processes one after the other, on processors that it does not use itself."""

    def __init__(self, keep: Callable[[Record], None], say: Say) -> None:
        self.keep, self.say = keep, say
        self.cores: list[int] = []
        self.busy = False  # whether the busy machine was already reported
        self.allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()

    def __enter__(self) -> _TimingRunner:
        return self

    def __exit__(self, *failure: object) -> None:
        if self.allowed:
            with suppress(OSError):
                os.sched_setaffinity(0, self.allowed)

    def work(self, book: _TimingRecords) -> None:
        """Run rounds until no job needs another run."""
        while due := [job for job in book.jobs if book.due(job)]:
            self._wait_until_idle(max(job.threads for job in due))
            for job in due:
                tries = len(book.timed(job)) + 1
                self.say("time", f"{job.called}: run {tries} of {max(tries, book.wanted_run_count(job))}")
                with exclusive_timing(self.say):
                    self._time_job_once(book, job, "timed")
        for job in book.jobs_without_phases():
            self.say("time", f"{job.called}: profile of CPU time")
            self._wait_until_idle(job.threads)
            with exclusive_timing(self.say):
                self._time_job_once(book, job, "phases")

    def _time_job_once(self, book: _TimingRecords, job: TimingJob, kind: str) -> None:
        record = run_timing_process(job, self.cores, kind)
        if kind == "timed" and (found := timing_quality.disturbances(record, book.pace)):
            record["flags"] = found
            self.say("time", f"{job.called}: disturbed ({', '.join(found)})")
            if len(self.allowed) > max(2, len(self.cores)):  # perhaps another processor is quieter
                self.cores = []
        book.add(record)
        self.keep(record)

    def _wait_until_idle(self, threads: int) -> None:
        """Wait, for at most PATIENCE seconds, until no task waits for a processor; then choose processors."""
        begin = time.monotonic()
        while True:
            start = OsCounters.now()
            time.sleep(GLANCE)
            now = OsCounters.now()
            seen = now.since(start)
            if (seen["pressure_s"] or 0.0) <= CALM * seen["wall_s"]:
                break
            if time.monotonic() - begin > PATIENCE:
                self._say_busy()
                break
        if self.allowed and len(self.cores) != min(threads, len(self.allowed)):
            self.cores = choose_processors(self.allowed, start.busy, now.busy, threads)
            with suppress(OSError):
                os.sched_setaffinity(0, self.allowed - set(self.cores) or self.allowed)

    def _say_busy(self) -> None:
        """Print once that timing takes longer because other processes disturb it."""
        if not self.busy:
            self.say(
                "took", "timing takes longer because other processes use this machine; disturbed runs are repeated"
            )
        self.busy = True


def run_timing_process(job: TimingJob, cores: Sequence[int], kind: str = "timed") -> Record:
    """Run one timing process and return its record.

    A process that ends without a record, or too late, gets a record with a status and a message.
    """
    asked = job.to_json() | {"cores": list(cores), "phases": kind == "phases"}
    begin = time.monotonic()
    record = _run_process(job, json.dumps(asked).encode())
    return record | {
        "key": job.key,
        "kind": kind,
        "host": describe_host(),
        "elapsed_s": time.monotonic() - begin,
    }


def _run_process(job: TimingJob, asked: bytes) -> Record:
    """Return the record that a timing process writes, or a record with the reason why there is none."""
    with tempfile.TemporaryFile() as spoken:
        environment = {**os.environ, **job.environment}
        pipe = subprocess.PIPE
        with subprocess.Popen(CHILD, stdin=pipe, stdout=pipe, stderr=spoken, env=environment) as child:
            try:
                answer, _ = child.communicate(asked, timeout=job.timeout_s)
            except subprocess.TimeoutExpired:
                late = f"it did not finish within {job.timeout_s:g} s"
                return {"status": "timed_out", "message": late, "pid": child.pid}
            finally:  # also where somebody interrupts
                if child.poll() is None:
                    child.kill()
        spoken.seek(0)
        return _read_record(answer, child, spoken.read()[-500:].decode(errors="replace"))


def _read_record(answer: bytes, child: subprocess.Popen[bytes], spoken: str) -> Record:
    try:
        record: Record = json.loads(answer)
    except ValueError:
        how = f"by signal {-child.returncode}" if child.returncode < 0 else f"with status {child.returncode}"
        last = spoken.strip().splitlines()[-1:] or ["no output"]
        return {"status": "failed", "message": f"the process ended {how}: {last[0]}", "pid": child.pid}
    return record


# ------------------------------------------------------------------ one run at a time


def lock_file() -> Path:
    """Return the file that a comparison locks while it times a run; there is one for all users of a machine."""
    return Path(tempfile.gettempdir()) / "softmark-timing.lock"


@contextmanager
def exclusive_timing(say: Say = _ignore_message) -> Iterator[None]:
    """Context in which no other comparison on this machine times a run.

    The lock is held for one run and then released for a moment, so that comparisons take turns. If the system has no
    such locks, or the wait exceeds LONGEST_WAIT seconds, timing continues without the lock.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = _open_lock_file(lock_file())
    if handle is None:
        yield
        return
    begin = time.monotonic()
    lines = [(0.0, "time", "another comparison is timing on this machine; waiting for it"),
             (QUIET, "took", f"waiting for another comparison that is timing on this machine ({lock_file()}), "
              f"{LONGEST_WAIT:g} s at most")]  # fmt: skip
    try:
        while time.monotonic() < begin + LONGEST_WAIT:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError:
                while lines and time.monotonic() - begin >= lines[0][0]:
                    say(*lines.pop(0)[1:])
                time.sleep(TURN / 4)
        else:
            say("took", f"{lock_file()} was locked for {LONGEST_WAIT:g} s: timing continues without the lock")
        yield
    finally:
        os.close(handle)  # releases the lock
        time.sleep(TURN)


def _open_lock_file(file: Path) -> int | None:
    """Open the lock file, creating it if necessary, and return its descriptor; None if that fails.

    In a public folder, a file of another user may only be read.
    """
    careful = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
    for flags in (os.O_RDONLY, os.O_RDWR | os.O_CREAT):
        with suppress(OSError):
            return os.open(file, flags | careful, 0o644)
    return None
