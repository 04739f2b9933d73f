"""Counters of the operating system: times in which this process computed, waited, or was displaced.

Linux has all of them. On other systems a missing counter is None, and no conclusion is drawn from it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from softmark.records import dataclass

Read = TypeVar("Read")
PROC = Path("/proc")
PACED = 30_000  # iterations of a loop, one to two milliseconds


@dataclass(frozen=True)
class OsCounters:
    """Values of all counters at one moment: times, s, from an arbitrary origin, and numbers of events."""

    wall: float
    cpu: float
    involuntary: int | None  # involuntary context switches
    voluntary: int | None
    waited: float | None  # s in which this thread waited for a processor
    pressure: float | None  # s in which some task on this machine waited for a processor
    pressure_avg10: float | None  # share of the last ten seconds, 0 to 1
    steal: float | None  # s that the hypervisor gave to others, of the processors in use
    busy: tuple[float, ...]  # s for which each processor has computed, () where it is not known

    @classmethod
    def now(cls, cores: frozenset[int] = frozenset()) -> OsCounters:
        """Read all counters; the stolen time is that of the processors `cores`, or of all if none are given."""
        switches, (avg10, total) = _context_switches(), _read_counter(_processor_pressure) or (None, None)
        lines = _read_counter(_processor_times) or {}
        steal = sum(s for n, (_, s) in lines.items() if not cores or n in cores) if lines else None
        busy = tuple(b for _, (b, _) in sorted(lines.items()))
        waited = _read_counter(_waiting_time)
        return cls(time.perf_counter(), time.process_time(), *switches, waited, total, avg10, steal, busy)

    def since(self, start: OsCounters) -> dict[str, Any]:
        """Return the differences of all counters since `start`, as JSON; a difference is None if it is unknown."""
        wall = max(self.wall - start.wall, 1e-9)
        cpu = self.cpu - start.cpu
        return {
            "wall_s": wall,
            "cpu_s": cpu,
            "involuntary": _difference_or_none(self.involuntary, start.involuntary),
            "voluntary": _difference_or_none(self.voluntary, start.voluntary),
            "waited_s": _difference_or_none(self.waited, start.waited),
            "pressure_s": _difference_or_none(self.pressure, start.pressure),
            "pressure_avg10": [start.pressure_avg10, self.pressure_avg10],
            "steal_s": _difference_or_none(self.steal, start.steal),
            "others_s": self._time_of_other_processes(start, cpu),
        }

    def _time_of_other_processes(self, start: OsCounters, own: float) -> float | None:
        """Return the time that all processors computed for other processes, s, to 0.01 s."""
        if not self.busy or len(self.busy) != len(start.busy):
            return None
        return max(0.0, sum(self.busy) - sum(start.busy) - own)


def _difference_or_none(now: Any, then: Any) -> Any:
    return None if now is None or then is None else now - then


def _read_counter(read: Callable[[], Read]) -> Read | None:
    """Return the value that `read` returns, or None if this system lacks the counter."""
    try:
        return read()
    except (OSError, ValueError, IndexError, KeyError):
        return None


def _context_switches() -> tuple[int | None, int | None]:
    try:
        import resource
    except ImportError:
        return None, None
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_nivcsw, usage.ru_nvcsw


def _waiting_time() -> float:
    """Return the time that the calling thread has waited for a processor, s."""
    return int((PROC / "thread-self/schedstat").read_text().split()[1]) * 1e-9


def _processor_pressure() -> tuple[float, float]:
    """Return how long some task of the machine waited for a processor.

    The first number is the fraction of the last ten seconds, the second the total time, s.
    """
    some = next(line for line in (PROC / "pressure/cpu").read_text().splitlines() if line.startswith("some"))
    values = dict(item.split("=") for item in some.split()[1:])
    return float(values["avg10"]) / 100.0, int(values["total"]) * 1e-6


def _processor_times() -> dict[int, tuple[float, float]]:
    """Return the busy time and the stolen time of each processor, s."""
    tick = 1.0 / os.sysconf("SC_CLK_TCK")
    found = {}
    for line in (PROC / "stat").read_text().splitlines():
        name, *fields = line.split()
        if name.startswith("cpu") and name[3:].isdigit():
            user, nice, system, _, _, interrupts, soft, stolen = (int(f) * tick for f in fields[:8])
            found[int(name[3:])] = (user + nice + system + interrupts + soft, stolen)
    return found


def measure_pace() -> float:
    """Return the CPU time, s, of a fixed piece of work without memory access, as a measure of processor speed.

    A guest of a hypervisor shares cores with others, and processors change their frequency. No counter shows this,
    although CPU time may then grow by half and more.
    """
    begin, total = time.process_time(), 0
    for i in range(PACED):
        total += i * i
    return time.process_time() - begin


def memory_use() -> dict[str, int | None]:
    """Return the memory that this process holds, bytes, and the largest amount so far.

    `ru_maxrss` starts with the parent's memory at the start of this process, so the kernel's own counter is preferred.
    """
    return {
        "now": _read_counter(lambda: _memory_status("VmRSS")),
        "peak": _read_counter(lambda: _memory_status("VmHWM")) or _peak_memory(),
    }


def _memory_status(name: str) -> int:
    for line in (PROC / "self/status").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1]) * 1024
    raise KeyError(name)


def _peak_memory() -> int | None:
    try:
        import resource
    except ImportError:
        return None
    import sys

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def load_average() -> float | None:
    """Return the mean number of running or waiting tasks over the last minute; None if unknown."""
    return _read_counter(lambda: os.getloadavg()[0])
