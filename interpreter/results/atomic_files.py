"""Atomic writing of files, never through a symbolic link.

Each file is written under a temporary name in its folder and then renamed: nobody reads half a file, and a link in a
foreign folder is replaced, while the file that it leads to stays unchanged.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

parts: set[str] = set()  # temporary files in use, removed if a signal ends the process


def replace(path: Path, content: str | bytes) -> Path:
    """Write a file in place of an existing file, link or pipe of that name. Raises OSError."""
    with replace_atomically(path) as part:
        part.write_bytes(_encoded(content))
    return path


def write_named(path: Path, content: str | bytes) -> Path:
    """Write to a path of the command line, also to a device or a pipe such as /dev/stdout. Raises OSError."""
    if path.exists() and not path.is_file():
        path.write_bytes(_encoded(content))
        return path
    return replace(path, content)


@contextmanager
def replace_atomically(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the same ending, which replaces the file when the block ends. Raises OSError."""
    handle, temporary = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    parts.add(temporary)
    try:
        yield Path(temporary)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    finally:
        parts.discard(temporary)


def folder_within(folder: Path, *inner: str) -> Path:
    """Create a folder below another; no folder in between may be a symbolic link. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in inner:
        folder = folder / name
        folder.mkdir(exist_ok=True)
        refuse_link(folder)
    return folder


def refuse_link(path: Path) -> None:
    """Refuse a path that is a symbolic link, since writing would change another file. Raises OSError."""
    if path.is_symlink():
        raise OSError(None, f"{path} is a symbolic link")


def _encoded(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode(errors="replace")


def _umask() -> int:
    """Return the permissions that new files do not get; mkstemp gives only the owner's."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
