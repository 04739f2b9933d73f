"""Choice of the processor for timing: fast and idle, with an idle sibling on the same core."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

SYSTEM = Path("/sys/devices/system/cpu")
IDLE = 0.05  # fraction of a processor below which loads are equal


def choose_processors(allowed: Iterable[int], before: Sequence[float], after: Sequence[float], count: int) -> list[int]:
    """Return `count` of the `allowed` processors, fast and idle ones first.

    `before` and `after` are the busy times of all processors, s, at two moments. Among equals the last processor is
    chosen, because the first one of a machine serves most interrupts.
    """
    busy = [b - a for a, b in zip(before, after, strict=False)]
    elapsed = max(max(busy, default=0.0), 0.1)

    def rank(core: int) -> tuple[float, float, int]:
        taken = sum(busy[c] for c in sibling_processors(core) if c < len(busy)) / elapsed
        return (-highest_frequency(core), round(taken / IDLE), -core)

    return sorted(sorted(allowed, key=rank)[:count])


def sibling_processors(core: int) -> set[int]:
    """Return the processors that share a core with this processor, including itself."""
    text = _read_system_file(f"cpu{core}/topology/thread_siblings_list") or str(core)
    found = {core}
    for part in text.split(","):
        first, _, last = part.partition("-")
        found.update(range(int(first), int(last or first) + 1))
    return found


def highest_frequency(core: int) -> float:
    """Return the highest frequency of a processor, kHz, or 0 if unknown; some machines have two kinds of cores."""
    return float(_read_system_file(f"cpu{core}/cpufreq/cpuinfo_max_freq") or 0.0)


def _read_system_file(name: str) -> str | None:
    try:
        return (SYSTEM / name).read_text().strip() or None
    except OSError:
        return None
