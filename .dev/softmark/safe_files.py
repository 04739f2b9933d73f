"""Safe reading of untrusted files: only regular files, and references only within the folder of a file.

Every reader opens files here. A pipe or a device never blocks it. A file can refer only to files in its own folder,
whatever `..`, absolute paths or symbolic links it uses. This module does not import numpy, because scenes are checked
without it.
"""

from __future__ import annotations

import os
import stat

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than this
if TYPE_CHECKING:
    from io import BufferedReader
    from pathlib import Path

LARGEST = 2 << 30  # maximum bytes of a file that is read whole
SMALL = 1 << 16  # bytes


class UnsafeFile(OSError):
    """Error when a file is refused; `strerror` is the reason."""

    def __init__(self, reason: str) -> None:
        super().__init__(None, reason)


def open_regular(path: str | os.PathLike[str]) -> BufferedReader:
    """Open a regular file for reading bytes. Raises OSError, and UnsafeFile if it is not a regular file.

    The path is checked before and after a non-blocking open: a pipe without a writer would block for ever, and
    opening some devices has effects.
    """
    return open(path, "rb", opener=descriptor_of)


def descriptor_of(path: str | os.PathLike[str], _: int = 0) -> int:
    """Open a regular file for reading and return its file descriptor; usable as `opener` of `open`.

    Raises UnsafeFile, OSError.
    """
    if "\0" in os.fspath(path):
        raise UnsafeFile("a name has no NUL in it")
    _require_regular(os.stat(path).st_mode)
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags | getattr(os, "O_NOCTTY", 0))
    try:
        _require_regular(os.fstat(descriptor).st_mode)
    except UnsafeFile:
        os.close(descriptor)
        raise
    return descriptor


def read_regular(path: str | os.PathLike[str], largest: int = LARGEST) -> bytes:
    """Return the bytes of a regular file.

    Raises OSError, and UnsafeFile if the file is not regular or has more bytes than `largest`.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size <= largest:
            return file.read(max(size, SMALL))  # some files of /proc report a size of 0 bytes
    shown = f"{largest >> 30} GiB" if largest >= 1 << 30 else f"{largest / 1e6:g} MB"
    raise UnsafeFile(f"it is larger than {shown}")


def path_within(folder: Path, told: str) -> Path:
    """Return the resolved path of a regular file that another file in `folder` names as `told`.

    Raises OSError, and UnsafeFile if the path leads out of the folder or to no regular file.
    """
    try:
        home = folder.resolve()
        file = (home / told).resolve()
        if not file.is_relative_to(home):
            raise UnsafeFile("that lies outside the folder of the file")
        _require_regular(file.stat().st_mode, "that")
    except FileNotFoundError:
        raise UnsafeFile("there is no such file") from None
    except (ValueError, RuntimeError) as error:  # a NUL, or links in a circle
        raise UnsafeFile(f"that cannot be read ({error})") from None
    return file


def _require_regular(mode: int, it: str = "it") -> None:
    if not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "not a regular file: pipes and devices are not read"
        raise UnsafeFile(f"{it} is {what}")
