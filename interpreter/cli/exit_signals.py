"""How `dsl` leaves: at a signal, and where the machine it runs on has no more of something.

Python raises KeyboardInterrupt wherever it happens to be, in the middle of an import or of a destructor, where it is
swallowed or printed as a traceback. What `dsl` has finished is on disk already, each file whole, so a signal has
nothing to unwind: the handler says what is kept, takes away files that are being written, and ends the process.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from softmark.interpreter.results.atomic_files import parts

Words = Callable[[], str]

SPENT = {  # what a machine may have no more of, and what to do; by the number of the system's error
    errno.ENOSPC: "make room on the disk, or choose another one with `--out`",
    errno.EDQUOT: "make room within the quota, or choose another disk with `--out`",
    errno.EROFS: "choose a folder that can be written to with `--out`",
    errno.EFBIG: "raise the limit on the size of a file (`ulimit -f`)",
    errno.EMFILE: "raise the limit on open files (`ulimit -n`); 64 are enough",
    errno.ENFILE: "close other programs: the machine has too many files open",
    errno.EAGAIN: "raise the limit on processes (`ulimit -u`), or use fewer `--jobs`",
    errno.ENOMEM: "use a coarser mesh, fewer `--jobs`, or a machine with more memory",
}
NEEDED = 640 << 20  # bytes of addresses: numpy, scipy and numba take 500 MB before anything is computed

_words: list[Words] = []  # what to say of an interrupted command: the last one holds


def saying(words: Words) -> None:
    """From now on an interrupt says this of what is kept."""
    _words.append(words)


def guard() -> None:
    """End this process in order at SIGINT and SIGTERM, and give it the streams that it was started without.

    A signal that whoever started us has set to be ignored stays ignored.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:  # `dsl run x >&-`: else a report gets its number
        pass
    os.close(descriptor)
    sys.stdin, sys.stdout, sys.stderr = (
        stream or open(os.devnull, mode, encoding="utf-8")  # noqa: SIM115, for as long as the process lives
        for stream, mode in ((sys.stdin, "r"), (sys.stdout, "w"), (sys.stderr, "w"))
    )
    for stream in (sys.stdout, sys.stderr):  # a terminal that has no such character shows `?`
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _leave)


def unguard() -> None:
    """All is said: from here on a signal ends the process as it ends any other."""
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is _leave:
            signal.signal(number, signal.SIG_DFL)


def _leave(number: int, frame: Any) -> None:
    """Say what is kept and end with 128 + the signal; buffers are left alone, we may be in the midst of writing one."""
    signal.signal(number, signal.SIG_IGN)
    word = "interrupted" if number == signal.SIGINT else "terminated"
    text = ""
    if _words:
        with suppress(Exception):
            text = _words[-1]()
    for part in list(parts):
        with suppress(OSError):
            os.unlink(part)
    clear = "\r\x1b[K" if os.isatty(2) and os.environ.get("TERM") != "dumb" else ""
    with suppress(OSError):
        os.write(2, f"{clear}{word}{'; ' if text else ''}{text}\n".encode(errors="replace"))
    os._exit(128 + number)


def spent(error: BaseException) -> str | None:
    """What the machine has no more of and what to do, None where that is not what happened."""
    if isinstance(error, MemoryError):
        return "out of memory; use a coarser mesh, fewer models at a time (`--model`), or a machine with more memory"
    if isinstance(error, ImportError) and ("failed to map" in str(error) or "Cannot allocate" in str(error)):
        return f"out of memory while loading libraries; raise the limit on memory (`ulimit -v`) to {_size(NEEDED)}"
    if isinstance(error, OSError) and error.errno in SPENT:
        what = f"{error.filename}: " if error.filename else ""
        return f"{what}{error.strerror}; {SPENT[error.errno]}"
    return None


def cramped() -> str | None:
    """Why this process has not enough memory to load its libraries, which would end it without a word, or None."""
    try:
        import resource
    except ImportError:  # Windows has no such limits
        return None
    limits = [resource.getrlimit(name)[0] for name in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    least = min((limit for limit in limits if limit != resource.RLIM_INFINITY), default=NEEDED)
    if least >= NEEDED:
        return None
    return (f"this process may have {_size(least)} of memory (`ulimit -v`), and numpy, scipy and numba alone need "
            f"{_size(NEEDED)}; raise the limit")  # fmt: skip


def _size(size: float) -> str:
    return f"{size / (1 << 20):.0f} MB"
