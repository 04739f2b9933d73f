"""Python's search for unused cycles rests while a command loads its modules, whose objects it will use to its end.

It would walk all of them again and again, a tenth of a short run's time, and find next to nothing.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_own = False  # whether this process ends with its command


def begin() -> None:
    """No search from now on: of a process of our own."""
    global _own
    _own = True
    gc.disable()


def end() -> None:
    """Search again, in a process of our own only among what is made from now on."""
    if _own:
        gc.freeze()
        gc.enable()


@contextmanager
def loading() -> Iterator[None]:
    """No search within: for imports."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()
            end()
