"""File objects that raise EOFError if a reader keeps reading past the end of the file.

Some of meshio's readers would do so forever.
"""

from __future__ import annotations

import io
import sys
from typing import Any

from softmark.safe_files import descriptor_of

PATIENCE = 100  # allowed empty reads at the end of a file


class ReadPastEnd(EOFError):
    """Raised if a reader keeps reading past the end of its file."""

    def __init__(self) -> None:
        super().__init__("the file is incomplete")


class _EmptyReadCounter:
    """Base class of files that counts consecutive reads that returned nothing."""

    nothing = 0

    def _count_empty_reads(self, found: Any) -> Any:
        """Return the result of a read, and raise ReadPastEnd after too many empty results in a row."""
        self.nothing = 0 if found else self.nothing + 1
        if self.nothing > PATIENCE:
            raise ReadPastEnd
        return found


class BoundedBytes(_EmptyReadCounter, io.BufferedReader):
    """A binary file that limits reads past its end."""

    def readline(self, size: int | None = -1, /) -> bytes:
        """Return the next line. Raises ReadPastEnd."""
        return bytes(self._count_empty_reads(super().readline(-1 if size is None else size)))

    def read(self, size: int | None = -1, /) -> bytes:
        """Return the next bytes. Raises ReadPastEnd."""
        found = super().read(size)
        return found if size == 0 else bytes(self._count_empty_reads(found))


class BoundedText(_EmptyReadCounter, io.TextIOWrapper):
    """A text file that limits reads past its end."""

    def readline(self, size: int = -1, /) -> str:  # type: ignore[override]
        """Return the next line. Raises ReadPastEnd."""
        return str(self._count_empty_reads(super().readline(size)))

    def read(self, size: int | None = -1, /) -> str:
        """Return the next characters. Raises ReadPastEnd."""
        found = super().read(size)
        return found if size == 0 else str(self._count_empty_reads(found))


def open_bounded(file: Any, mode: str = "r", *further: Any, **options: Any) -> Any:
    """Open a file as `open` does, with a limit on reads past its end."""
    if mode not in ("r", "rt", "rb") or further:
        return open(file, mode, *further, **options)
    raw = BoundedBytes(io.FileIO(file, "r", opener=descriptor_of))
    return raw if mode == "rb" else BoundedText(raw, **{"encoding": "utf-8", **options})


def _ignore_warning(text: str, *further: Any, **options: Any) -> None:
    """Ignore a warning; it replaces meshio's function, which takes minutes to wrap a long line.

    These warnings are never shown.
    """


def patch_open(package: str) -> None:
    """Replace `open` by `open_bounded` in all loaded modules of a package."""
    for name, module in sys.modules.copy().items():  # copied first, since garbage collection may import modules
        if module is not None and (name == package or name.startswith(f"{package}.")):
            module.__dict__.setdefault("open", open_bounded)
            if name == "meshio" or name.startswith("meshio."):
                module.__dict__.update({"warn": _ignore_warning} if "warn" in module.__dict__ else {})
