"""Memory for readers of measured files: in proportion to the file, whatever its header promises."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

FACTOR, FLOOR = 1000, 1 << 30  # bytes of memory for a byte of the file, and for any file


@contextmanager
def rationed(path: Path, size: int | None = None) -> Iterator[None]:
    """While a file is read, this process may take 1000 times its size and 1 GiB beyond what it has.

    `size` in bytes is that of all files of a series.

    A header that promises more than the file holds then ends in a MemoryError, instead of in a machine that has no
    memory left. Where the system has no such limits, or sets a lower one, nothing changes.
    """
    try:
        import resource

        has = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = has + FACTOR * (path.stat().st_size if size is None else size) + FLOOR
    except (ImportError, OSError):
        yield
        return
    if soft != resource.RLIM_INFINITY and soft <= limit:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def reason_of(error: Exception) -> str:
    """What a reader's exception says, in words for whoever has the file."""
    if isinstance(error, MemoryError):
        return "it asks for more memory than its size can need: it is cut off, or its header is wrong"
    if isinstance(error, ModuleNotFoundError):
        return f"this format needs the package {error.name}, which is not installed"
    return " ".join(str(error).split())[:200] or type(error).__name__
