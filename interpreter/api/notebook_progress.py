"""Progress line in a notebook: one line below the cell that is rewritten, and removed at the end."""

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
    """Progress line; it appears only when something takes longer than PAUSE."""

    def __init__(self) -> None:
        self._last = time.monotonic()
        self._handle: Any = None

    def say(self, what: str, detail: str) -> None:
        """Show the current task: `solve`, `rod: iteration 3`."""
        now = time.monotonic()
        if now - self._last < PAUSE:
            return
        self._last = now
        words = " ".join(f"{what} {detail}".split())
        self._show("".join(c if c.isprintable() else "?" for c in words)[:WIDE])

    def _show(self, words: str) -> None:
        from IPython.display import display

        bundle = {"text/plain": words}
        if self._handle is None:
            self._handle = display(bundle, raw=True, display_id=True)  # type: ignore[no-untyped-call]
        else:
            self._handle.update(bundle, raw=True)

    def end(self) -> None:
        """Remove the line."""
        if self._handle is not None:
            self._show("")


@contextmanager
def progress_line() -> Iterator[Say]:
    """Yield the function that reports progress: to a notebook's line if there is one, else to nowhere.

    IPython is not imported to find out.
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
