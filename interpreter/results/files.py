"""Files that are there whole or not at all, and that no symbolic link leads elsewhere.

Every file that a command leaves is written under another name in its folder and renamed: nobody sees half a file, and
a link in a folder of somebody else's is replaced, while the file that it leads to stays as it is.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

parts: set[str] = set()  # files that are being written under another name: an end by a signal takes them away


def replace(path: Path, content: str | bytes) -> Path:
    """Write a file, whatever its name was before: a file, a link, a pipe. Raises OSError."""
    with replacing(path) as part:
        part.write_bytes(_encoded(content))
    return path


def write_named(path: Path, content: str | bytes) -> Path:
    """Write where the command line says: a device or a pipe, such as /dev/stdout, as it is. Raises OSError."""
    if path.exists() and not path.is_file():
        path.write_bytes(_encoded(content))
        return path
    return replace(path, content)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give another name with the same ending to write to; it takes the place of the file at the end. Raises OSError."""
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
    """Make a folder below another, none of which on the way may be a symbolic link. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in inner:
        folder = folder / name
        folder.mkdir(exist_ok=True)
        refuse_link(folder)
    return folder


def refuse_link(path: Path) -> None:
    """Raises OSError where a path is a symbolic link, through which something else would be written."""
    if path.is_symlink():
        raise OSError(None, f"{path} is a symbolic link")


def _encoded(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode(errors="replace")


def _umask() -> int:
    """The permissions that new files do not get; mkstemp gives none but the owner's."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
