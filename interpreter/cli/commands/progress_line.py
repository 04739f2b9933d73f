"""Progress messages: one changing line on a terminal, else one printed line for each long task."""

from __future__ import annotations

import os
import shutil
import time
from typing import TextIO


class Progress:
    """Writer of progress messages to `stream`.

    On a terminal it redraws one line, at most ten times a second.
    """

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.live = stream.isatty() and os.environ.get("TERM") != "dumb"
        self._last = 0.0
        self._drawn = False

    def say(self, what: str, detail: str) -> None:
        """Show the current task `what`, such as `solve`, with its `detail`, such as `rod: iteration 3`."""
        detail = detail if detail.isprintable() else "".join(c if c.isprintable() else "?" for c in detail)
        if what == "journal" and not detail:
            return
        if what in ("compile", "compiled", "took", "journal") or (what == "start" and not self.live):
            self.clear()
            line = {"start": detail, "compile": f"  {detail} ..."}.get(what, f"  {detail}")
            print(line, file=self.stream, flush=True)
            return
        soon = time.monotonic() - self._last < 0.1 and what not in ("start", "reference")  # may be last for a while
        if not self.live or soon:
            return
        self._last = time.monotonic()
        width = shutil.get_terminal_size().columns - 1
        line = detail if what == "start" else f"  {what} {detail}"
        self.stream.write("\r\x1b[K" + line[:width])
        self.stream.flush()
        self._drawn = True

    def clear(self) -> None:
        """Remove the progress line from the terminal."""
        if self._drawn:
            self.stream.write("\r\x1b[K")
            self.stream.flush()
            self._drawn = False
