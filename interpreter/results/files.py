"""Files that are there whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

parts: set[str] = set()  # files that are being written under another name: an end by a signal takes them away


def replace(path: Path, content: str | bytes) -> Path:
    """Write under another name in the same folder, then rename: nobody ever sees half a file. Raises OSError.

    What is no regular file, such as /dev/stdout or a pipe, is written to as it is.
    """
    if path.exists() and not path.is_file():
        path.write_bytes(_encoded(content))
        return path
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    parts.add(temporary)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(_encoded(content))
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    finally:
        parts.discard(temporary)
    return path


def _encoded(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode(errors="replace")


def _umask() -> int:
    """The permissions that new files do not get; mkstemp gives none but the owner's."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
