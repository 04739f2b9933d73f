"""What the operating system says of a stretch of time: how long this process computed, waited, or was displaced.

Linux tells all of it; elsewhere what is not told is None, and nothing is concluded from it.
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
PACED = 30_000  # turns of a loop, between one and two milliseconds


@dataclass(frozen=True)
class Gauges:
    """Counters at one moment: seconds since some beginning, and counts."""

    wall: float
    cpu: float
    involuntary: int | None  # switches to another process although this one could go on
    voluntary: int | None
    waited: float | None  # s for which this thread could run and did not get a processor
    pressure: float | None  # s for which some task on this machine had to wait for a processor
    pressure_avg10: float | None  # share of the last ten seconds, 0 to 1
    steal: float | None  # s that the hypervisor gave to others, of the processors in use
    busy: tuple[float, ...]  # s for which each processor has computed, () where it is not known

    @classmethod
    def now(cls, cores: frozenset[int] = frozenset()) -> Gauges:
        """Read all of them; steal is that of `cores`, of all where there are none."""
        switches, (avg10, total) = _switches(), _known(_pressure) or (None, None)
        lines = _known(_processors) or {}
        steal = sum(s for n, (_, s) in lines.items() if not cores or n in cores) if lines else None
        busy = tuple(b for _, (b, _) in sorted(lines.items()))
        waited = _known(_waited)
        return cls(time.perf_counter(), time.process_time(), *switches, waited, total, avg10, steal, busy)

    def since(self, start: Gauges) -> dict[str, Any]:
        """What happened since `start`: seconds, and shares of the wall time; None where it is not known."""
        wall = max(self.wall - start.wall, 1e-9)
        cpu = self.cpu - start.cpu
        return {
            "wall_s": wall,
            "cpu_s": cpu,
            "involuntary": _less(self.involuntary, start.involuntary),
            "voluntary": _less(self.voluntary, start.voluntary),
            "waited_s": _less(self.waited, start.waited),
            "pressure_s": _less(self.pressure, start.pressure),
            "pressure_avg10": [start.pressure_avg10, self.pressure_avg10],
            "steal_s": _less(self.steal, start.steal),
            "others_s": self._others(start, cpu),
        }

    def _others(self, start: Gauges, own: float) -> float | None:
        """Seconds that all processors together computed for others; counted in hundredths of a second."""
        if not self.busy or len(self.busy) != len(start.busy):
            return None
        return max(0.0, sum(self.busy) - sum(start.busy) - own)


def _less(now: Any, then: Any) -> Any:
    return None if now is None or then is None else now - then


def _known(read: Callable[[], Read]) -> Read | None:
    """What can be read, None where this system does not tell."""
    try:
        return read()
    except (OSError, ValueError, IndexError, KeyError):
        return None


def _switches() -> tuple[int | None, int | None]:
    try:
        import resource
    except ImportError:
        return None, None
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_nivcsw, usage.ru_nvcsw


def _waited() -> float:
    """Seconds on the queue of a processor, of the calling thread."""
    return int((PROC / "thread-self/schedstat").read_text().split()[1]) * 1e-9


def _pressure() -> tuple[float, float]:
    """The share of the last ten seconds, and seconds in all, for which some task waited for a processor."""
    some = next(line for line in (PROC / "pressure/cpu").read_text().splitlines() if line.startswith("some"))
    values = dict(item.split("=") for item in some.split()[1:])
    return float(values["avg10"]) / 100.0, int(values["total"]) * 1e-6


def _processors() -> dict[int, tuple[float, float]]:
    """Seconds busy and seconds stolen of each processor."""
    tick = 1.0 / os.sysconf("SC_CLK_TCK")
    found = {}
    for line in (PROC / "stat").read_text().splitlines():
        name, *fields = line.split()
        if name.startswith("cpu") and name[3:].isdigit():
            user, nice, system, _, _, interrupts, soft, stolen = (int(f) * tick for f in fields[:8])
            found[int(name[3:])] = (user + nice + system + interrupts + soft, stolen)
    return found


def pace() -> float:
    """CPU seconds of a fixed piece of work that needs no memory: how fast the processor is at the moment.

    A guest of a hypervisor shares cores with strangers, and processors change their frequency; no counter tells, and
    CPU time grows by half and more.
    """
    begin, total = time.process_time(), 0
    for i in range(PACED):
        total += i * i
    return time.process_time() - begin


def memory() -> dict[str, int | None]:
    """Bytes of memory that this process holds, and the most that it has held.

    `ru_maxrss` begins with what the parent held when it started this process, so the kernel's own counter goes first.
    """
    return {"now": _known(lambda: _status("VmRSS")), "peak": _known(lambda: _status("VmHWM")) or _largest()}


def _status(name: str) -> int:
    for line in (PROC / "self/status").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1]) * 1024
    raise KeyError(name)


def _largest() -> int | None:
    try:
        import resource
    except ImportError:
        return None
    import sys

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def load_average() -> float | None:
    """Tasks that ran or waited, mean of the last minute."""
    return _known(lambda: os.getloadavg()[0])
