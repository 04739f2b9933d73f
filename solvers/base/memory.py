"""How much memory a process may still use."""

from __future__ import annotations

import os
from pathlib import Path

GROUP = Path("/sys/fs/cgroup")
LIMITS = (  # of a container and what it uses, by versions of the interface
    ("memory.max", "memory.current"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
)


def available() -> float:
    """Bytes that can be had without swapping, as far as the system says; infinite where it says nothing."""
    return min(_system(), _group())


def _system() -> float:
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    except (OSError, ValueError):
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def _group() -> float:
    """What the limit of a container leaves."""
    for limit, used in LIMITS:
        try:
            return float(int((GROUP / limit).read_text()) - int((GROUP / used).read_text()))
        except (OSError, ValueError):
            continue
    return float("inf")
