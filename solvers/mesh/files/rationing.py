"""Memory for readers of files: in proportion to the file, whatever its header promises."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

FACTOR, FLOOR = 200, 1 << 30  # bytes of memory for a byte of the file, and for any file


@contextmanager
def rationed(path: Path) -> Iterator[None]:
    """While a file is read, this process may take 200 times its size and 1 GiB beyond what it has.

    A header that promises more than the file holds then ends in a MemoryError, instead of in a machine that has no
    memory left. Where the system has no such limits, or sets a lower one, nothing changes.
    """
    try:
        import resource

        has = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = has + FACTOR * path.stat().st_size + FLOOR
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
