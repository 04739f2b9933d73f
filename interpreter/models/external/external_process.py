"""Execution of an external program in its own folder and process group, with limits and a classified ending.

The kernel limits address space, CPU time, file size and core dumps (`limited_launcher.py`); this module limits
wall-clock time and output. Processes that a program leaves behind are killed: those of its group and, on Linux,
those that left the group, found by a mark in their environment. If our own process is killed, the program is
killed as well. The program's output is untrusted text: it is stored up to a size limit, and shown in few lines
without control characters.
"""

from __future__ import annotations

import math
import os
import re
import resource
import select
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Literal

from softmark.records import dataclass

How = Literal["done", "timed_out", "flooded", "out_of_memory", "died", "unstarted"]

LOG = "log.txt"  # output file in the folder of the program
MOST = 2**20  # largest size of its output, bytes
FILE = 0.25  # of its memory limit: largest size of one file, because files are read here
LINES, WIDE = 8, 160  # number of last output lines that are shown, and characters of each
TICK = 0.02  # s between two checks of the process
GRACE = 2.0  # s that a killed process may take to end
ROUNDS = 5  # number of searches for processes left behind, which may start others meanwhile
MARK = "SOFTMARK_OUTSIDE"  # environment variable that marks all processes of a program
ALONE = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS", "NUMBA", "NGS", "VECLIB")}
LAUNCH = (sys.executable, "-I", "-S", str(Path(__file__).with_name("limited_launcher.py")))

_ESCAPES = re.compile(r"\x1b(\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(\x07|\x1b\\)?|.)?", re.S)
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]")
_MEMORY = re.compile(
    r"MemoryError|bad_alloc|out of memory|not enough memory|cannot allocate|unable to allocate|error allocating memory"
    r"|memory allocation|insufficient memory",
    re.I,
)


@dataclass(frozen=True)
class ProgramEnd:
    """Ending of an external program: how it ended, its wall time and CPU time, s, and the last lines of its output."""

    how: How
    code: int | None  # its exit status, or less than 0: the signal that ended it
    wall_s: float
    cpu_s: float | None  # None for a program that was stopped
    last: tuple[str, ...]
    why: str  # in words for users

    @property
    def message(self) -> str:
        """Return the reason why the program ended, with the last lines of its output."""
        return f"{self.why}; {self.words}" if self.last else f"{self.why}; it printed nothing"

    @property
    def words(self) -> str:
        """Last lines of the output, joined to one line."""
        return f"last output: {' | '.join(self.last)}" if self.last else ""


def run(
    command: Sequence[str],
    folder: Path,
    seconds: float,
    memory: float,
    threads: int = 1,
    most: int = MOST,
    environment: Mapping[str, str] | None = None,
) -> ProgramEnd:
    """Run a command in a folder within limits, and return how it ended.

    `seconds` limits wall time and `memory` the bytes of address space. Standard input is empty. Standard output and
    error go to LOG, up to `most` bytes. CPU time is limited to that of `threads` in twice the wall time, as a
    safeguard in case our own process is no longer watching the clock.
    """
    mark = uuid.uuid4().hex
    limits = (FILE * memory, memory, 2 * seconds * threads + 1)
    whole = [*LAUNCH, *(str(math.ceil(n)) for n in (os.getpid(), *limits)), *map(str, command)]
    begin = time.monotonic()
    try:
        child = subprocess.Popen(
            whole, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            env=_environment(folder, threads, environment, mark), start_new_session=True,
        )  # fmt: skip
    except (OSError, ValueError) as error:
        return ProgramEnd("unstarted", None, 0.0, None, (), f"it could not be started ({error})")
    try:
        how, status, usage = _wait_for_end(child, folder / LOG, begin + seconds, most)
    finally:
        _kill_all(child, mark)
    spent = None if usage is None else usage.ru_utime + usage.ru_stime
    return _make_ending(how, status, time.monotonic() - begin, spent, last_words(folder / LOG), (seconds, memory, most))


def _environment(folder: Path, threads: int, more: Mapping[str, str] | None, mark: str) -> dict[str, str]:
    """Return the environment of a program: ours, with a limited number of threads and a folder for temporary files."""
    counts = {name: str(threads) for name in ALONE}
    return {**os.environ, **counts, "TMPDIR": str(folder), **(more or {}), MARK: mark}


def _wait_for_end(
    child: subprocess.Popen[bytes], log: Path, until: float, most: int
) -> tuple[How, int | None, resource.struct_rusage | None]:
    """Return how a child process ended, its wait status and its resource usage.

    Status and usage are None if the child did not end by itself.
    """
    assert child.stdout is not None
    pipe, said, open_ = child.stdout.fileno(), 0, True
    os.set_blocking(pipe, False)
    with log.open("wb") as out:
        while True:
            if open_ and select.select([pipe], [], [], TICK)[0]:
                data = _read_available(pipe)
                open_ = data != b""
                out.write((data or b"")[: most - said])
                said += len(data or b"")
                if said > most:
                    return "flooded", None, None
            elif not open_:
                time.sleep(TICK)
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
            if pid:
                child.returncode = os.waitstatus_to_exitcode(status)
                out.write(_read_rest(pipe, most - said))
                return "done", child.returncode, usage
            if time.monotonic() > until:
                return "timed_out", None, None


def _read_available(pipe: int) -> bytes | None:
    """Return the available content of a pipe; None if there is nothing yet, and empty at its end."""
    try:
        return os.read(pipe, 65536)
    except BlockingIOError:
        return None


def _read_rest(pipe: int, most: int) -> bytes:
    """Return the remaining content of a pipe whose program has ended; its children may still hold the pipe open."""
    found = b""
    while len(found) < most and (data := _read_available(pipe)):
        found += data
    return found[:most]


def _kill_all(child: subprocess.Popen[bytes], mark: str) -> None:
    """Kill a child process, its group, and descendants that left the group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    if child.returncode is None:
        with suppress(subprocess.TimeoutExpired):
            child.wait(GRACE)
    assert child.stdout is not None
    child.stdout.close()
    for _ in range(ROUNDS):
        for pid in (left := find_stray_processes(mark)):
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        if not left:
            break


def find_stray_processes(mark: str) -> list[int]:
    """Return the ids of processes with a mark in their environment; empty on systems without /proc."""
    found, sign = [], f"{MARK}={mark}".encode()
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if sign in (entry / "environ").read_bytes().split(b"\0"):
                found.append(int(entry.name))
    return found


def _make_ending(
    how: How, code: int | None, wall: float, cpu: float | None, last: tuple[str, ...],
    limits: tuple[float, float, int],
) -> ProgramEnd:  # fmt: skip
    """Return the ending of a program with its description; lack of memory or CPU time differs from other failures."""
    seconds, memory, most = limits
    if how == "done" and code != 0:
        how = "out_of_memory" if any(map(_MEMORY.search, last)) else "died"
        how = "timed_out" if code in (-signal.SIGXCPU, -signal.SIGKILL) and (cpu or 0.0) > seconds else how
    why: Mapping[How, Callable[[], str]] = {
        "done": lambda: "it ended",
        "timed_out": lambda: f"it did not finish within {seconds:g} s and was stopped",
        "flooded": lambda: f"it printed more than {most / 2**20:.3g} MiB and was stopped",
        "out_of_memory": lambda: f"it ran out of memory (limit {memory / 1e9:.3g} GB)",
        "died": lambda: describe_exit_status(code or 0),
    }
    return ProgramEnd(how, code, wall, cpu, last, why[how]())


def describe_exit_status(code: int) -> str:
    """Return a description of an exit status or, if negative, of the signal that ended the program."""
    if code > 0:
        return f"it ended with exit status {code}"
    try:
        return f"it was terminated by a signal ({signal.Signals(-code).name})"
    except ValueError:
        return f"it was terminated by signal {-code}"


def last_words(log: Path) -> tuple[str, ...]:
    """Return the last lines of a log, without blank ones and without terminal control sequences."""
    with suppress(OSError), log.open("rb") as read:
        read.seek(max(0, log.stat().st_size - 4 * LINES * WIDE))
        lines = strip_control_characters(read.read().decode("utf-8", "replace")).splitlines()
        return tuple(line.strip()[:WIDE] for line in lines if line.strip())[-LINES:]
    return ()


def strip_control_characters(text: str) -> str:
    """Return text without control characters except line ends; a carriage return counts as a line end."""
    return _CONTROL.sub("", _ESCAPES.sub("", text).replace("\r", "\n").replace("\t", " "))
