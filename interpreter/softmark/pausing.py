"""Pause of Python's garbage collector while a command loads its modules, whose objects live until its end.

The collector would scan all of them repeatedly, a tenth of a short run's time, and find almost nothing.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_own = False  # whether this process ends with its command


def pause_collection() -> None:
    """Disable garbage collection in a process of our own."""
    global _own
    _own = True
    gc.disable()


def resume_collection() -> None:
    """Enable garbage collection again, in a process of our own only for objects created from now on."""
    if _own:
        gc.freeze()
        gc.enable()


@contextmanager
def collection_paused() -> Iterator[None]:
    """Disable garbage collection inside the block, for imports."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()
            resume_collection()
