"""Parallel compilation of kernels in a second process, since numba compiles only one at a time in each process.

The second process, the helper, saves its kernels on disk, where this process finds them. Kernels that it has not
compiled are compiled in this process, so the helper affects only the time, not the results. It is started once, if no
kernel of this version is on disk.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from subprocess import Popen

PATIENCE = 120.0  # s: longest wait for the helper after this process has finished
_asked = False


@contextmanager
def allow_helper(wanted: bool) -> Iterator[None]:
    """Allow or forbid a helper process within the block."""
    global _asked
    _asked, before = wanted, _asked
    try:
        yield
    finally:
        _asked = before


@contextmanager
def helper_process(code: str) -> Iterator[None]:
    """Run Python code in a helper process while the block runs, and wait for it at the end.

    No helper is started if it is not allowed or would not be useful. The code prints the number of kernels that it
    compiled. If the block fails, the helper is terminated.
    """
    helper = _start_helper(code) if _asked and _is_helper_useful() else None
    try:
        yield
        if helper is not None:
            _wait_for_helper(helper)
    finally:
        if helper is not None:
            helper.kill()
            helper.communicate()


def count_processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _is_helper_useful() -> bool:
    """Return whether a helper can save time: a second processor, a Python executable, and a writable cache folder."""
    from softmark.solvers.runtime import kernel_cache

    startable = bool(sys.executable) and not getattr(sys, "frozen", False)
    return count_processors() > 1 and startable and kernel_cache.CACHED and os.access(kernel_cache.FOLDER, os.W_OK)


def _start_helper(code: str) -> Popen[str] | None:
    """Return a helper process that runs Python code; None if it cannot be started.

    The helper imports nothing from the working folder.
    """
    from subprocess import DEVNULL, PIPE, Popen

    with suppress(OSError):
        return Popen([sys.executable, "-P", "-c", code], stdin=DEVNULL, stdout=PIPE, stderr=DEVNULL, text=True)
    return None


def _wait_for_helper(helper: Popen[str]) -> None:
    """Wait for the helper process and add its number of compiled kernels.

    A crashed helper adds none. The wait has a time limit.
    """
    from subprocess import TimeoutExpired

    from softmark.solvers.runtime import kernel_cache

    with suppress(TimeoutExpired, ValueError):
        kernel_cache.add_compiled(int(helper.communicate(timeout=PATIENCE)[0]))
