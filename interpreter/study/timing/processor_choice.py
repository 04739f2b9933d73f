"""Which processor to time on: a fast one that is idle, and whose twin on the same core is idle too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

SYSTEM = Path("/sys/devices/system/cpu")
IDLE = 0.05  # of a processor: less than that is no difference


def least_busy(allowed: Iterable[int], before: Sequence[float], after: Sequence[float], count: int) -> list[int]:
    """`count` of the `allowed` processors, fast and idle ones first, from their busy seconds at two moments.

    Of equals the last: the first one of a machine serves most interrupts.
    """
    busy = [b - a for a, b in zip(before, after, strict=False)]
    elapsed = max(max(busy, default=0.0), 0.1)

    def rank(core: int) -> tuple[float, float, int]:
        taken = sum(busy[c] for c in twins(core) if c < len(busy)) / elapsed
        return (-fastest(core), round(taken / IDLE), -core)

    return sorted(sorted(allowed, key=rank)[:count])


def twins(core: int) -> set[int]:
    """The processors that share a core with this one, itself included."""
    text = _said(f"cpu{core}/topology/thread_siblings_list") or str(core)
    found = {core}
    for part in text.split(","):
        first, _, last = part.partition("-")
        found.update(range(int(first), int(last or first) + 1))
    return found


def fastest(core: int) -> float:
    """Its highest frequency in kHz, 0 where nobody says: machines with two kinds of cores have two."""
    return float(_said(f"cpu{core}/cpufreq/cpuinfo_max_freq") or 0.0)


def _said(name: str) -> str | None:
    try:
        return (SYSTEM / name).read_text().strip() or None
    except OSError:
        return None
