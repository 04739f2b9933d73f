"""Limits of memory and time for file readers, from the size of the file and the amount of free memory."""

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

FACTOR = 200  # bytes of memory per byte of a file: texts of numbers take up to 60 in Python lists
FLOOR = 1 << 30  # bytes for any file, and for the modules that its reader imports
PATIENCE, PACE = 8.0, 2e-6  # processor s for any file, and for each of its bytes
TURNS = 10_000  # iterations of a loop, in the first of which a pending exception is raised
SHARE = 0.5  # fraction of the free memory for one file
GROUP = Path("/sys/fs/cgroup")
process_lock = threading.RLock()  # held by the thread that changes limits or standard streams of the whole process
LIMITS = (  # limit and use of a container's memory, by cgroup version
    ("memory.max", "memory.current"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
)


class TooSlow(Exception):
    """Error when reading a file takes longer than its size justifies."""

    def __init__(self) -> None:
        super().__init__("reading it takes longer than its size can need: it is damaged, or of another format")


@contextmanager
def limited_resources(path: Path, size: int | None = None) -> Iterator[None]:
    """Limit the memory of this process and the time of this thread while a file is read, one file at a time.

    The memory limit is the current use plus 1 GiB and 200 times the size of the file, but at most half of the free
    memory. `size` in bytes replaces the size of the file, for a series of several files. The limit turns two attacks
    into a MemoryError: a header that promises more data than the file holds, and a small file that unpacks to a large
    one. Memory is not limited if the system has no such limits, or already sets a lower one.

    The time limit is 8 s of processor time plus 2 s for each MB; TooSlow is raised as soon as Python code runs again.
    Other threads wait until the file is read, so that limits are restored in order.
    """
    try:
        long = path.stat().st_size if size is None else size
    except OSError:
        long = 0
    with process_lock, _limited_time(PATIENCE + PACE * long), _limited_memory(long):
        yield


@contextmanager
def _limited_time(seconds: float) -> Iterator[None]:
    """Raise TooSlow in this thread after `seconds` of its processor time; a nested limit has no effect."""
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
            ended.set()  # from now on no exception is raised
        if raised.is_set():
            _discard_pending_timeout()


def _discard_pending_timeout() -> None:
    """Raise a TooSlow that is still pending in this thread, and discard it.

    `PyThreadState_SetAsyncExc(thread, NULL)` would also cancel it, but leaves the interpreter's flag of pending work
    set forever (CPython 3.11). That makes every later function slower and hangs it under a profiler.
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
    limit = has + int(min(FLOOR + FACTOR * size, max(FLOOR, SHARE * available_memory())))
    if soft != resource.RLIM_INFINITY and soft <= limit:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def describe_read_error(error: BaseException) -> str:
    """Return the reason for a reader's exception, in words for the owner of the file."""
    if isinstance(error, MemoryError):
        return "it asks for more memory than its size can need: it is cut off, or its header is wrong"
    if isinstance(error, RecursionError):
        return "its parts lie too deep in each other"
    if isinstance(error, ModuleNotFoundError):
        return f"this format needs the package {error.name}, which is not installed"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return " ".join(str(error).split())[:200] or type(error).__name__


def available_memory() -> float:
    """Return the memory available without swapping, bytes, as reported by the system; infinite if unknown."""
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
