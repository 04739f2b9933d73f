"""Files that raise EOFError where a reader goes on asking after their end, as some of meshio's would do for ever."""

from __future__ import annotations

import io
import sys
from typing import Any

from softmark.safe_files import descriptor_of

PATIENCE = 100  # times that nothing may be read at the end of a file


class Ended(EOFError):
    """A reader asks and asks for what comes after the end of its file."""

    def __init__(self) -> None:
        super().__init__("the file breaks off")


class _Counted:
    """Counts how often in a row nothing was read."""

    nothing = 0

    def _seen(self, found: Any) -> Any:
        self.nothing = 0 if found else self.nothing + 1
        if self.nothing > PATIENCE:
            raise Ended
        return found


class Bytes(_Counted, io.BufferedReader):
    """A file of bytes with an end."""

    def readline(self, size: int | None = -1, /) -> bytes:
        """As of any file. Raises Ended."""
        return bytes(self._seen(super().readline(-1 if size is None else size)))

    def read(self, size: int | None = -1, /) -> bytes:
        """As of any file. Raises Ended."""
        found = super().read(size)
        return found if size == 0 else bytes(self._seen(found))


class EndedText(_Counted, io.TextIOWrapper):
    """A file of text with an end."""

    def readline(self, size: int = -1, /) -> str:  # type: ignore[override]
        """As of any file. Raises Ended."""
        return str(self._seen(super().readline(size)))

    def read(self, size: int | None = -1, /) -> str:
        """As of any file. Raises Ended."""
        found = super().read(size)
        return found if size == 0 else str(self._seen(found))


def opened(file: Any, mode: str = "r", *further: Any, **options: Any) -> Any:
    """As `open`; what is read has an end."""
    if mode not in ("r", "rt", "rb") or further:
        return open(file, mode, *further, **options)
    raw = Bytes(io.FileIO(file, "r", opener=descriptor_of))
    return raw if mode == "rb" else EndedText(raw, **{"encoding": "utf-8", **options})


def _silent(text: str, *further: Any, **options: Any) -> None:
    """Replace meshio's warnings, which nobody sees, because it takes minutes to wrap a long line."""


def everywhere(package: str) -> None:
    """Have the modules of a package that are loaded open their files so."""
    for name, module in sys.modules.copy().items():  # at once: what a collector of garbage runs may import
        if module is not None and (name == package or name.startswith(f"{package}.")):
            module.__dict__.setdefault("open", opened)
            if name == "meshio" or name.startswith("meshio."):
                module.__dict__.update({"warn": _silent} if "warn" in module.__dict__ else {})
