"""Compilation by numba with a disk cache that never returns code compiled from older sources.

numba's own cache does not notice that a function called from another file has changed, and silently returns the old
kernel. So the cache folder is named by a digest of all solver sources, of numba's and numpy's version and of the
processor. numba's index of a function is also read, changed and written without a lock, so that two processes that
compile it at once for different types can store one's machine code under the other's types; and a truncated or altered
file is executed as it is. Here a kernel has its own file, named by everything that determines it, that begins with a
checksum of the rest: it is complete, or it is compiled anew. The folder name reflects the sources at the time this file
was loaded, and numba's key of a function only the operations of its code: the key here also includes its constants, its
names, the values they refer to, its file when it was loaded, and the same for the kernels it calls.

Kernels are in modules named `*_kernels.py`, in `sparse` and in `corotational_tets.py`; code that needs no kernels must
not import these, since numba is slow to load. A kernel is compiled only for the types that it is called with, so an
unused one costs a run nothing. The cost of a kernel is mostly the wrapper code that numba adds, so there are three
decorators: `kernel` for functions called from Python that make no array, `maker` for those that make some, and `part`
for functions called only by kernels.

numba does not guarantee the interface of the classes used here, so pyproject.toml bounds its version; tests/solvers/
test_numba.py reports what a newer one lacks before the bound is raised.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import os
import pickle
import platform
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from types import CodeType
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import caching as _caching
from numba.core import event as _event
from numba.core import runtime as _runtime
from numba.core import serialize as _serialize

from softmark.solvers.runtime.numba_pipeline import ShortPipeline

caching: Any = _caching  # without types of its own
event: Any = _event
njit: Any = numba.njit  # whose type stubs lack some options
serialize: Any = _serialize
runtime: Any = _runtime

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
SUFFIX = ".kernel"
CHECKSUM = hashlib.sha256().digest_size  # bytes


def sources() -> list[Path]:
    """Return every source file whose change must trigger recompilation."""
    return sorted(Path(__file__).parents[1].rglob("*.py"))


def digest(files: Iterable[Path], *facts: str) -> str:
    """Return the SHA-256 of the names and texts of `files` and of `facts`, as 16 hexadecimal digits."""
    h = hashlib.sha256("\0".join(facts).encode())
    for file in files:
        text = file.read_bytes()
        h.update(f"\0{file.name}\0{len(text)}\0".encode())
        h.update(text)
    return h.hexdigest()[:16]


def _processor() -> str:
    """Return the processor's model if known: kernels are compiled for it."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor()
    return "\n".join(sorted({line for line in text.splitlines() if line.startswith(("model name", "flags"))}))


def cache_folder() -> Path:
    """Return the folder of this version's kernels: $XDG_CACHE_HOME/softmark/kernels/<digest>."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    facts = (version("numba"), version("numpy"), sys.version, _processor())
    return Path(home) / "softmark" / "kernels" / digest(sources(), *facts)


def _usable(folder: Path) -> bool:
    """Return whether the folder can be searched for kernels, creating it if needed; otherwise they stay in memory.

    A read-only folder may contain them: kernels compiled in addition are not saved.
    """
    if not folder.is_absolute():  # without a home folder "~" would be a folder in the working directory
        return False
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        return folder.is_dir() and os.access(folder, os.R_OK | os.X_OK)
    except OSError:
        return False


FOLDER = cache_folder()
CACHED = _usable(FOLDER)


_made = 0  # kernels that this process has compiled


class _KernelFiles:
    """Kernels of one function on disk, one file for each set of types, with the interface of numba's index and data
    files.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name

    def load(self, key: Any) -> Any:
        """Return the object saved under the key, None if it is missing or incomplete."""
        try:
            data = self._path(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(data[CHECKSUM:]).digest() != data[:CHECKSUM]:
            return None
        own, kept = pickle.loads(data[CHECKSUM:])
        return kept if own == key else None

    def save(self, key: Any, kept: Any) -> None:
        """Save it completely or not at all; nothing is saved on a full or read-only disk."""
        global _made
        _made += 1
        data: bytes = serialize.dumps((key, kept))
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            _replace(self._path(key), hashlib.sha256(data).digest() + data)

    def flush(self) -> None:
        """Delete all kernels of the function."""
        for file in self.folder.glob(f"{self.name}.*{SUFFIX}"):
            file.unlink(missing_ok=True)

    def _path(self, key: Any) -> Path:
        return self.folder / f"{self.name}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}{SUFFIX}"


def _replace(path: Path, data: bytes) -> None:
    """Write under another name, then rename, so that no process reads half a file. Raises OSError."""
    handle, part = tempfile.mkstemp(dir=path.parent, prefix=".part-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(part, path)
    except BaseException:  # an interrupt, too
        Path(part).unlink(missing_ok=True)
        raise


class _CacheLocator(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Locator that always selects our folder: numba's choice may fall back on folders that miss edited callees."""

    def __init__(self, function: Any, file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(FOLDER / self.get_suitable_cache_subpath(file))

    @classmethod
    def from_function(cls, function: Any, file: str) -> _CacheLocator:
        """Return our locator, whether or not its folder can be written to."""
        return cls(function, file)

    def ensure_cache_path(self) -> None:
        """Do nothing: saving creates the folder, or skips it if that fails."""


class _CompileResultData(caching.CompileResultCacheImpl):  # type: ignore[misc]
    """numba's conversion between compiled functions and stored data."""

    _locator_classes = (_CacheLocator,)


def _source(file: str) -> str:
    """Return the SHA-256 of a file's present content, "" for a missing file."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return ""


class _KernelCache(caching.FunctionCache):  # type: ignore[misc]
    """numba's cache of a function, on our files."""

    _impl_class = _CompileResultData

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._cache_file = _KernelFiles(Path(self._cache_path), self._impl.filename_base)
        self.source = _source(function.__code__.co_filename)  # now, while it is being loaded

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code on disk, or None; numba's version would first import its whole compiler, 0.3 s.

        Loaded code is linked only with numba's memory management and its C helpers; if there is nothing to load,
        compilation imports what it needs.
        """
        runtime.rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Return numba's key extended by what it omits; requested only when the function is to be compiled."""
        return (*super()._index_key(sig, codegen), self.source, kernel_digest(self._py_func))


def kernel_digest(function: Any) -> str:
    """Return the SHA-256 of all inputs of a kernel: code, constants, numbers of its module, kernels it calls."""
    return hashlib.sha256("\0".join(_describe_function(function, set())).encode()).hexdigest()


def _describe_function(function: Any, seen: set[Any]) -> list[str]:
    """Return the description of a function and of the kernels it calls, each once."""
    if function in seen:
        return [function.__qualname__]
    seen.add(function)
    told = [function.__qualname__, repr(function.__defaults__)]
    names: set[str] = set()
    codes: list[CodeType] = [function.__code__]
    for code in codes:  # which grows by the functions within
        codes += (c for c in code.co_consts if isinstance(c, CodeType))
        told += [code.co_code.hex(), repr(code.co_names)]
        told += [_describe_constant(c) for c in code.co_consts if not isinstance(c, CodeType)]
        names.update(code.co_names)
    for name in sorted(names & function.__globals__.keys()):
        told += [name, *_describe_value(function.__globals__[name], seen)]
    for cell in function.__closure__ or ():
        told += _describe_value(cell.cell_contents, seen)
    return told


def _describe_value(value: Any, seen: set[Any]) -> list[str]:
    """Return the description of a name's value, as far as machine code depends on it; the same in every process."""
    callee = getattr(value, "py_func", None) or getattr(value, "_defn", None)  # a kernel, an intrinsic
    if callee is not None:
        return [getattr(getattr(value, "_cache", value), "source", ""), *_describe_function(callee, seen)]
    if isinstance(value, np.ndarray):
        return [str(value.dtype), str(value.shape), hashlib.sha256(value.tobytes()).hexdigest()]
    if isinstance(value, tuple):
        return [str(len(value)), *(text for v in value for text in _describe_value(v, seen))]
    if isinstance(value, (bool, int, float, complex, str, bytes, np.generic)) or value is None:
        return [_describe_constant(value)]
    # a module, a type, a function of numpy
    return [type(value).__qualname__, str(getattr(value, "__name__", ""))]


def _describe_constant(value: Any) -> str:
    """Return a constant as text; a set is sorted, since it has no order."""
    return repr(sorted(map(repr, value))) if isinstance(value, frozenset) else repr(value)


class _GarbageCollectionPause(event.Listener):  # type: ignore[misc]
    """Suspends garbage collection while numba compiles, where it takes a tenth of the time."""

    def __init__(self) -> None:
        self._lock, self._depth, self._enabled = threading.Lock(), 0, False

    def on_start(self, event: Any) -> None:
        """Disable collection at the first compilation; kernels are compiled within others, and in other threads."""
        with self._lock:
            if not self._depth:
                self._enabled = gc.isenabled()
                gc.disable()
            self._depth += 1

    def on_end(self, event: Any) -> None:
        """Restore the original setting after the last one."""
        with self._lock:
            self._depth -= 1
            if not self._depth and self._enabled:
                gc.enable()


event.register("numba:compile", _GarbageCollectionPause())
_LEAN: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # no kernel is called from C
    "pipeline_class": ShortPipeline,
}


class _KernelPart:
    """A function that numba compiles within its calling kernels, and that Python runs directly."""

    def __init__(self, function: Any) -> None:
        self.py_func = function
        self.source = _source(function.__code__.co_filename)
        self._compiled = njit(**_LEAN, no_cpython_wrapper=True, _nrt=False)(function)
        self._numba_type_ = numba.types.Dispatcher(self._compiled)  # which holds a weak reference to it
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def kernel(function: Kernel) -> Kernel:
    """Decorate a kernel: it is compiled at its first call and saved on disk if possible.

    It counts no references: an array belongs to the caller, and none can be made.
    """
    return _with_disk_cache(function, njit(**_LEAN, _nrt=False)(function))


def maker(function: Kernel) -> Kernel:
    """Decorate a kernel that makes arrays."""
    return _with_disk_cache(function, njit(**_LEAN)(function))


def part(function: Kernel) -> Kernel:
    """Decorate a function that is compiled within kernels; Python runs it directly. It makes no array."""
    return cast(Kernel, _KernelPart(function))


def _with_disk_cache(function: Kernel, compiled_later: Any) -> Kernel:
    if CACHED:
        compiled_later._cache = _KernelCache(function)
    return cast(Kernel, compiled_later)


def is_compiled() -> bool:
    """Return whether kernels of this version are on disk; if not, the first run has to compile them."""
    return CACHED and any(FOLDER.rglob(f"*{SUFFIX}"))


def count_compiled() -> int:
    """Return how many kernels this process or its helper process has compiled so far, with all their parts."""
    return _made


def add_compiled(kernels: int) -> None:
    """Add the number of kernels that another process has compiled for this one."""
    global _made
    _made += kernels
