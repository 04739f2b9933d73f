"""Termination of `dsl` by a signal or by an exhausted resource of the machine.

Python raises KeyboardInterrupt anywhere, even during an import or in a destructor, where it is swallowed or printed as
a traceback. All finished results of `dsl` are already complete files on disk, so nothing needs unwinding: the handler
prints which results are saved, removes unfinished files, and ends the process.
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

SPENT = {  # exhausted resources and remedies, by errno
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

_words: list[Words] = []  # messages for an interrupted command; the last one is used


def set_interrupt_message(words: Words) -> None:
    """Set the function whose text about saved results is printed at an interrupt from now on."""
    _words.append(words)


def install_handlers() -> None:
    """Install handlers that end this process cleanly at SIGINT and SIGTERM, and open missing standard streams.

    A signal that the parent process has set to be ignored stays ignored.
    """
    while (
        descriptor := os.open(os.devnull, os.O_RDWR)
    ) <= 2:  # after `dsl run x >&-` a report would get the number of standard output
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
            signal.signal(number, _exit_on_signal)


def restore_handlers() -> None:
    """Restore the default handlers, so that a signal ends the process at once."""
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is _exit_on_signal:
            signal.signal(number, signal.SIG_DFL)


def _exit_on_signal(number: int, frame: Any) -> None:
    """Print which results are saved, and exit with the status 128 + signal number.

    Buffers are not flushed, because one may be only half written.
    """
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


def exhausted_resource(error: BaseException) -> str | None:
    """Return a message with the exhausted resource and its remedy; None if the error has another cause."""
    if isinstance(error, MemoryError):
        return "out of memory; use a coarser mesh, fewer models at a time (`--model`), or a machine with more memory"
    if isinstance(error, ImportError) and ("failed to map" in str(error) or "Cannot allocate" in str(error)):
        return f"out of memory while loading libraries; raise the limit on memory (`ulimit -v`) to {_size(NEEDED)}"
    if isinstance(error, OSError) and error.errno in SPENT:
        what = f"{error.filename}: " if error.filename else ""
        return f"{what}{error.strerror}; {SPENT[error.errno]}"
    return None


def memory_shortage() -> str | None:
    """Return an error message if there is too little memory to load the libraries, else None.

    Without this check the system would kill the process.
    """
    try:
        import resource
    except ImportError:  # Windows has no such limits
        return None
    limits = [resource.getrlimit(name)[0] for name in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    least = min((limit for limit in limits if limit != resource.RLIM_INFINITY), default=NEEDED)
    if least >= NEEDED:
        return None
    return (f"this process is limited to {_size(least)} of memory (`ulimit -v`), but numpy, scipy and numba alone "
            f"need {_size(NEEDED)}; raise the limit")  # fmt: skip


def _size(size: float) -> str:
    return f"{size / (1 << 20):.0f} MB"
