"""Pause of Python's garbage collector while a command imports modules, whose objects live until the command ends.

The collector would scan all these objects repeatedly, a tenth of a short run's time, and find almost nothing.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_own = False  # whether this process ends with its command


def pause_collection() -> None:
    """Disable garbage collection in a process that ends with its command, such as `dsl`."""
    global _own
    _own = True
    gc.disable()


def resume_collection() -> None:
    """Enable garbage collection again after `pause_collection`, only for objects created from now on.

    Without `pause_collection` nothing changes.
    """
    if _own:
        gc.freeze()
        gc.enable()


@contextmanager
def collection_paused() -> Iterator[None]:
    """Disable garbage collection inside the block, in which modules are imported."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()
            resume_collection()
