"""Compilation by numba with a disk cache that never returns code compiled from older sources.

A kernel is a function that numba compiles to machine code. numba's own cache has three defects:

- It does not notice that a function called from another file has changed, and silently returns the old kernel.
- It reads, changes and writes the index of a function without a lock. Two processes that compile a function at once for
  different types can store the machine code of one under the types of the other.
- It executes a truncated or altered file.

So the cache folder is named by a digest of all solver sources, of the versions of numba and numpy, and of the
processor. Each kernel has its own file, named by everything that determines the kernel. The file begins with a checksum
of its other bytes; a kernel with a wrong checksum is compiled again. The folder name reflects the sources at the time
this module was loaded. numba's key of a function covers only the operations of its code. The key here also includes its
constants, its names, the values to which the names refer, and its source file when it was loaded. It includes the same
for the kernels that it calls.

Kernels are in modules named `*_kernels.py`, in `sparse` and in `corotational_tets.py`. Code that needs no kernels must
not import these, since numba is slow to load. A kernel is compiled only for the types with which it is called, so an
unused kernel costs a run nothing. Most of the compile time goes into the wrapper code that numba adds, so there are
three decorators: `kernel` for functions called from Python that create no array, `maker` for those that create arrays,
and `part` for functions called only by kernels.

numba does not guarantee the interface of the classes used here, so pyproject.toml bounds its version. The test
tests/solvers/test_numba.py shows whether a newer version still has this interface.
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

caching: Any = _caching  # numba has no type annotations
event: Any = _event
njit: Any = numba.njit  # its type stubs lack some options
serialize: Any = _serialize
runtime: Any = _runtime

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
SUFFIX = ".kernel"
CHECKSUM = hashlib.sha256().digest_size  # bytes


def sources() -> list[Path]:
    """Return every source file whose change must trigger recompilation."""
    return sorted(Path(__file__).parents[1].rglob("*.py"))


def digest(files: Iterable[Path], *facts: str) -> str:
    """Return a digest of the names and texts of `files` and of the texts `facts`: 16 hexadecimal digits of SHA-256."""
    h = hashlib.sha256("\0".join(facts).encode())
    for file in files:
        text = file.read_bytes()
        h.update(f"\0{file.name}\0{len(text)}\0".encode())
        h.update(text)
    return h.hexdigest()[:16]


def _describe_processor() -> str:
    """Return the model and the features of the processor, for which kernels are compiled."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor()
    return "\n".join(sorted({line for line in text.splitlines() if line.startswith(("model name", "flags"))}))


def cache_folder() -> Path:
    """Return the folder of the kernels of this version of the sources: $XDG_CACHE_HOME/softmark/kernels/<digest>."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    facts = (version("numba"), version("numpy"), sys.version, _describe_processor())
    return Path(home) / "softmark" / "kernels" / digest(sources(), *facts)


def _is_usable_folder(folder: Path) -> bool:
    """Return whether kernels can be read from the folder, which is created if needed.

    If not, kernels stay in memory. A read-only folder is usable: its kernels are loaded, and new ones are not saved.
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
CACHED = _is_usable_folder(FOLDER)


_made = 0  # kernels that this process has compiled


class _KernelFiles:
    """Disk files of the kernels of one function, one file for each combination of argument types.

    The class has the interface of numba's index and data files.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name

    def load(self, key: Any) -> Any:
        """Return the object saved under the key; None if its file is missing, damaged or incomplete."""
        try:
            data = self._path(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(data[CHECKSUM:]).digest() != data[:CHECKSUM]:
            return None
        own, kept = pickle.loads(data[CHECKSUM:])
        return kept if own == key else None

    def save(self, key: Any, kept: Any) -> None:
        """Save the object `kept` under the key, completely or not at all.

        A full or read-only disk raises no error; the object is then not saved.
        """
        global _made
        _made += 1
        data: bytes = serialize.dumps((key, kept))
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            _write_atomically(self._path(key), hashlib.sha256(data).digest() + data)

    def flush(self) -> None:
        """Delete all saved kernels of the function."""
        for file in self.folder.glob(f"{self.name}.*{SUFFIX}"):
            file.unlink(missing_ok=True)

    def _path(self, key: Any) -> Path:
        return self.folder / f"{self.name}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}{SUFFIX}"


def _write_atomically(path: Path, data: bytes) -> None:
    """Write a file under a temporary name, then rename it, so that no process reads half a file. Raises OSError."""
    handle, part = tempfile.mkstemp(dir=path.parent, prefix=".part-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(part, path)
    except BaseException:  # including KeyboardInterrupt
        Path(part).unlink(missing_ok=True)
        raise


class _CacheLocator(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """numba cache locator that always selects the folder FOLDER of this module.

    Other locators miss changes of called functions.
    """

    def __init__(self, function: Any, file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(FOLDER / self.get_suitable_cache_subpath(file))

    @classmethod
    def from_function(cls, function: Any, file: str) -> _CacheLocator:
        """Return this locator for a function, whether or not the folder can be written to."""
        return cls(function, file)

    def ensure_cache_path(self) -> None:
        """Do nothing: saving a kernel creates the folder, and kernels stay in memory if that fails."""


class _CompileResultData(caching.CompileResultCacheImpl):  # type: ignore[misc]
    """numba's conversion of compiled functions to and from stored bytes."""

    _locator_classes = (_CacheLocator,)


def hash_source(file: str) -> str:
    """Return the SHA-256 of the present content of a file, "" for a missing file."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return ""


class _KernelCache(caching.FunctionCache):  # type: ignore[misc]
    """numba's cache of one function, with the files of `_KernelFiles` instead of numba's."""

    _impl_class = _CompileResultData

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._cache_file = _KernelFiles(Path(self._cache_path), self._impl.filename_base)
        self.source = hash_source(function.__code__.co_filename)  # now, while it is being loaded

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code on disk for the argument types `sig`, or None.

        numba's own method would first import its whole compiler, 0.3 s. Loaded code is linked only with numba's memory
        management and its C helpers. If there is no code to load, compilation imports the modules that it needs.
        """
        runtime.rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Return numba's key for the argument types `sig`, extended by the digest of the function.

        The digest is computed only when the function is loaded or compiled.
        """
        return (*super()._index_key(sig, codegen), self.source, kernel_digest(self._py_func))


def kernel_digest(function: Any) -> str:
    """Return the SHA-256 of all inputs of a kernel: its code, constants, global values and called kernels."""
    return hashlib.sha256("\0".join(_describe_function(function, set())).encode()).hexdigest()


def _describe_function(function: Any, seen: set[Any]) -> list[str]:
    """Return text lines from which a function and the kernels that it calls can be told apart from changed versions.

    Functions in `seen` are described by their names only.
    """
    if function in seen:
        return [function.__qualname__]
    seen.add(function)
    told = [function.__qualname__, repr(function.__defaults__)]
    names: set[str] = set()
    codes: list[CodeType] = [function.__code__]
    for code in codes:  # grows by the nested functions
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
    """Return text lines with everything about the value of a global name on which machine code depends.

    They are the same in every process.
    """
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
    """Return a constant as text; the items of a set are sorted, because their order may vary."""
    return repr(sorted(map(repr, value))) if isinstance(value, frozenset) else repr(value)


class _GarbageCollectionPause(event.Listener):  # type: ignore[misc]
    """Listener that suspends garbage collection while numba compiles, which saves a tenth of the compile time."""

    def __init__(self) -> None:
        self._lock, self._depth, self._enabled = threading.Lock(), 0, False

    def on_start(self, event: Any) -> None:
        """Disable garbage collection at the first of several nested or simultaneous compilations."""
        with self._lock:
            if not self._depth:
                self._enabled = gc.isenabled()
                gc.disable()
            self._depth += 1

    def on_end(self, event: Any) -> None:
        """Restore the original setting after the last compilation."""
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
    """A function that numba compiles as part of the kernels that call it; Python calls run it uncompiled."""

    def __init__(self, function: Any) -> None:
        self.py_func = function
        self.source = hash_source(function.__code__.co_filename)
        self._compiled = njit(**_LEAN, no_cpython_wrapper=True, _nrt=False)(function)
        self._numba_type_ = numba.types.Dispatcher(self._compiled)  # holds only a weak reference to it
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def kernel(function: Kernel) -> Kernel:
    """Decorate a function as a kernel, which is compiled at its first call and saved on disk if possible.

    The kernel does no reference counting, so it must not create arrays. Its array arguments belong to the caller.
    """
    return _with_disk_cache(function, njit(**_LEAN, _nrt=False)(function))


def allocating_kernel(function: Kernel) -> Kernel:
    """Decorate a function as a kernel that may create arrays."""
    return _with_disk_cache(function, njit(**_LEAN)(function))


def kernel_part(function: Kernel) -> Kernel:
    """Decorate a function that numba compiles as part of the kernels that call it.

    Python calls run it uncompiled. The function must not create arrays.
    """
    return cast(Kernel, _KernelPart(function))


def _with_disk_cache(function: Kernel, compiled_later: Any) -> Kernel:
    if CACHED:
        compiled_later._cache = _KernelCache(function)
    return cast(Kernel, compiled_later)


def is_compiled() -> bool:
    """Return whether any kernel of this version is on disk; if not, the first run has to compile the kernels."""
    return CACHED and any(FOLDER.rglob(f"*{SUFFIX}"))


def count_compiled() -> int:
    """Return the number of kernels that this process and its helper process have compiled so far."""
    return _made


def add_compiled(kernels: int) -> None:
    """Add the number of kernels compiled by a helper process to the count of this process."""
    global _made
    _made += kernels
