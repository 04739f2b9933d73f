"""Another process that compiles kernels while this one compiles others: in one, numba compiles them one by one.

What it makes it leaves on disk, where this process finds it; what is not there is compiled here, so that nothing
depends on the other but the time that it saves. It is asked for once, where no kernel of this version is on disk.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from subprocess import Popen

PATIENCE = 120.0  # s to wait for the other process when all is compiled here
_asked = False


@contextmanager
def asked(wanted: bool) -> Iterator[None]:
    """Whether another process may be started within."""
    global _asked
    _asked, before = wanted, _asked
    try:
        yield
    finally:
        _asked = before


@contextmanager
def beside(code: str) -> Iterator[None]:
    """Have another process run Python that prints how many kernels it made, where that helps; wait for it at the end.

    Where what is within fails, it is ended.
    """
    helper = _started(code) if _asked and _helps() else None
    try:
        yield
        if helper is not None:
            _join(helper)
    finally:
        if helper is not None:
            helper.kill()
            helper.communicate()


def processors() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _helps() -> bool:
    """Whether there is a second processor, a Python to start, and a place for what it makes."""
    from softmark.solvers.runtime import kernel_cache

    startable = bool(sys.executable) and not getattr(sys, "frozen", False)
    return processors() > 1 and startable and kernel_cache.CACHED and os.access(kernel_cache.FOLDER, os.W_OK)


def _started(code: str) -> Popen[str] | None:
    """None where there is no process to be had; nothing is imported from the folder where it starts."""
    from subprocess import DEVNULL, PIPE, Popen

    with suppress(OSError):
        return Popen([sys.executable, "-P", "-c", code], stdin=DEVNULL, stdout=PIPE, stderr=DEVNULL, text=True)
    return None


def _join(helper: Popen[str]) -> None:
    """Wait, and count what it made; one that crashed says nothing, and one that does not end is not waited for."""
    from subprocess import TimeoutExpired

    from softmark.solvers.runtime import kernel_cache

    with suppress(TimeoutExpired, ValueError):
        kernel_cache.count(int(helper.communicate(timeout=PATIENCE)[0]))
