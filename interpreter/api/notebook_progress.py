"""Progress line in a notebook: one line below the cell, which is updated and finally removed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Say = Callable[[str, str], None]  # (what is being done, detail)

PAUSE = 0.2  # s between two lines
WIDE = 110  # characters of a line


class ProgressLine:
    """Progress line; it appears only when a task takes longer than PAUSE."""

    def __init__(self) -> None:
        self._last = time.monotonic()
        self._handle: Any = None

    def say(self, what: str, detail: str) -> None:
        """Show the current task and its detail: `solve`, `rod: iteration 3`."""
        now = time.monotonic()
        if now - self._last < PAUSE:
            return
        self._last = now
        words = " ".join(f"{what} {detail}".split())
        self._update_text("".join(c if c.isprintable() else "?" for c in words)[:WIDE])

    def _update_text(self, words: str) -> None:
        from IPython.display import display

        bundle = {"text/plain": words}
        if self._handle is None:
            self._handle = display(bundle, raw=True, display_id=True)  # type: ignore[no-untyped-call]
        else:
            self._handle.update(bundle, raw=True)

    def end(self) -> None:
        """Remove the progress line."""
        if self._handle is not None:
            self._update_text("")


@contextmanager
def progress_line() -> Iterator[Say]:
    """Yield a function that reports progress in the notebook's progress line, or nowhere outside a notebook.

    The test for a notebook does not import IPython.
    """
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if getattr(shell, "kernel", None) is None:
        yield lambda what, detail: None
        return
    own = ProgressLine()
    try:
        yield own.say
    finally:
        own.end()
