"""Atomic writing of files, never through a symbolic link.

Each file is written under a temporary name in its folder and then renamed, so nobody reads an incomplete file. A
symbolic link is replaced, and the file that it points to stays unchanged.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

parts: set[str] = set()  # temporary files in use, removed if a signal ends the process


def replace(path: Path, content: str | bytes) -> Path:
    """Write a file, replacing an existing file, link or pipe of that name. Raises OSError."""
    with replace_atomically(path) as part:
        part.write_bytes(_encode_content(content))
    return path


def write_named(path: Path, content: str | bytes) -> Path:
    """Write to a path from the command line, which may be a device or a pipe such as /dev/stdout. Raises OSError."""
    if path.exists() and not path.is_file():
        path.write_bytes(_encode_content(content))
        return path
    return replace(path, content)


@contextmanager
def replace_atomically(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the same suffix, which replaces `path` when the block ends. Raises OSError."""
    handle, temporary = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    parts.add(temporary)
    try:
        yield Path(temporary)
        os.chmod(temporary, 0o666 & ~_file_mode_mask())
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    finally:
        parts.discard(temporary)


def make_inner_folder(folder: Path, *inner: str) -> Path:
    """Create and return a folder below `folder`; no folder in between may be a symbolic link. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in inner:
        folder = folder / name
        folder.mkdir(exist_ok=True)
        refuse_link(folder)
    return folder


def refuse_link(path: Path) -> None:
    """Raise OSError if a path is a symbolic link, since writing through it would change another file."""
    if path.is_symlink():
        raise OSError(None, f"{path} is a symbolic link")


def _encode_content(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode(errors="replace")


def _file_mode_mask() -> int:
    """Return the file mode creation mask (umask): mkstemp would otherwise give access only to the owner."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
