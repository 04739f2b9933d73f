"""Memory and time for readers of files, which grow with the file whatever it promises, and the memory that is free."""

from __future__ import annotations

import functools
import os
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than this
if TYPE_CHECKING:
    from collections.abc import Iterator

FACTOR = 200  # bytes of memory for a byte of a file: texts of numbers take up to 60 of them in Python's lists
FLOOR = 1 << 30  # bytes for any file, and for the modules that its reader imports
PATIENCE, PACE = 8.0, 2e-6  # s of the processor for any file, and for each of its bytes
TURNS = 10_000  # of a loop: what is pending is raised at the first
SHARE = 0.5  # of the free memory, for the largest of files
GROUP = Path("/sys/fs/cgroup")
process_lock = threading.RLock()  # held by the thread that changes limits or standard streams of the whole process
LIMITS = (  # of a container and what it uses, by versions of the interface
    ("memory.max", "memory.current"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
)


class TooSlow(Exception):
    """Reading a file takes longer than its size can need."""

    def __init__(self) -> None:
        super().__init__("reading it takes longer than its size can need: it is damaged, or of another format")


@contextmanager
def limited_resources(path: Path, size: int | None = None) -> Iterator[None]:
    """Limit the memory of this process and the time of this thread while a file is read, one file at a time.

    The limit is what the process has, and beyond it 1 GiB and 200 times the size of the file, though no more than
    half of the free memory. `size` in bytes is that of all files of a series. A header that promises more than the file
    holds, and a small file that unpacks to a large one, then end in a MemoryError instead of a machine without memory.
    Where the system has no such limits, or sets a lower one, memory is not limited.

    The time is 8 s of the processor and 2 s for each MB; what takes longer ends in TooSlow, as soon as Python code
    runs again. Other threads wait until the file is read: who restores a limit must have been the last to change it.
    """
    try:
        long = path.stat().st_size if size is None else size
    except OSError:
        long = 0
    with process_lock, _limited_time(PATIENCE + PACE * long), _limited_memory(long):
        yield


@contextmanager
def _limited_time(seconds: float) -> Iterator[None]:
    """Raise TooSlow in this thread after so much time of its own; a limit within another changes nothing."""
    if getattr(_timed, "within", False):
        yield
        return
    import ctypes

    clock = time.pthread_getcpuclockid(threading.get_ident()) if hasattr(time, "pthread_getcpuclockid") else None
    used = time.monotonic if clock is None else functools.partial(time.clock_gettime, clock)
    thread, began, ended = ctypes.c_ulong(threading.get_ident()), used(), threading.Event()
    lock, raised = threading.Lock(), threading.Event()

    def watch() -> None:
        while not ended.wait(max(0.01, left := began + seconds - used())):
            with lock:
                if left <= 0.0 and not ended.is_set():
                    raised.set()
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, ctypes.py_object(TooSlow))
                    return

    threading.Thread(target=watch, daemon=True).start()
    _timed.within = True
    try:
        yield
    finally:
        _timed.within = False
        with lock:
            ended.set()  # from now on nothing is raised
        if raised.is_set():
            _take_pending()


def _take_pending() -> None:
    """Let a TooSlow that is set and not raised yet be raised here, and drop it.

    `PyThreadState_SetAsyncExc(thread, NULL)` would take it back too, but leaves the interpreter's flag of pending work
    set for ever (CPython 3.11), which makes every later function slower and hangs it under a profiler.
    """
    with suppress(TooSlow):
        for _ in range(TURNS):
            pass


_timed = threading.local()


@contextmanager
def _limited_memory(size: int) -> Iterator[None]:
    try:
        import resource

        has = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError):
        yield
        return
    limit = has + int(min(FLOOR + FACTOR * size, max(FLOOR, SHARE * available())))
    if soft != resource.RLIM_INFINITY and soft <= limit:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def reason_of(error: BaseException) -> str:
    """Return the reason that a reader's exception gives, in words for whoever has the file."""
    if isinstance(error, MemoryError):
        return "it asks for more memory than its size can need: it is cut off, or its header is wrong"
    if isinstance(error, RecursionError):
        return "its parts lie too deep in each other"
    if isinstance(error, ModuleNotFoundError):
        return f"this format needs the package {error.name}, which is not installed"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return " ".join(str(error).split())[:200] or type(error).__name__


def available() -> float:
    """Return the bytes that can be had without swapping, as far as the system says; infinite where it says nothing."""
    return min(_available_in_system(), _available_in_container())


def _available_in_system() -> float:
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    except (OSError, ValueError):
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def _available_in_container() -> float:
    for limit, used in LIMITS:
        try:
            return float(int((GROUP / limit).read_text()) - int((GROUP / used).read_text()))
        except (OSError, ValueError):
            continue
    return float("inf")
