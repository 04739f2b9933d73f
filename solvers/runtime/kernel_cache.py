"""numba, with a cache on disk that never returns what an older source computed.

numba's cache does not notice that a function called from another file has changed: the old kernel answers, silently.
So the folder of the cache is named by a digest of all solver sources, of numba's and numpy's version and of the
processor. numba's index of a function is read, changed and written without a lock, too, so that two processes that
compile it at once for different types can leave the one's machine code under the other's types; and a file that was
cut off or altered is run as it is. Here a kernel has a file of its own, named by all that decides it, that begins with
a checksum of what follows: it is there whole, or it is compiled anew. The folder knows the sources as they were when
this file was loaded, and numba's key of a function the operations of its code alone: to the key belong, too, its
constants, its names, the numbers they stand for, its file when it was loaded, and all that of the kernels it calls.

Kernels live in `kernels.py` files, in `sparse` and in `corotational_tets.py`; what needs none must not
import these, for numba is slow to load. A kernel is compiled for the types that it is called with and no others, so
one that a run does not call costs it nothing. What one does cost is mostly what numba writes around it, so there are
three decorators: `kernel` of what is called from Python and makes no array, `maker` of what makes some, and `part` of
what only kernels call.

numba promises nothing of the classes that this is made of, so pyproject.toml bounds its version; tests/solvers/
test_numba.py says what a newer one lacks before the bound is raised.
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

from softmark.solvers.runtime.numba_pipeline import Passes

caching: Any = _caching  # without types of its own
event: Any = _event
njit: Any = numba.njit  # whose types do not know all of its options
serialize: Any = _serialize
runtime: Any = _runtime

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
SUFFIX = ".kernel"
CHECKSUM = hashlib.sha256().digest_size  # bytes


def sources() -> list[Path]:
    """Every source file whose change must make the kernels compile anew."""
    return sorted(Path(__file__).parents[1].rglob("*.py"))


def digest(files: Iterable[Path], *facts: str) -> str:
    """SHA-256 over the names and texts of `files` and over `facts`, as 16 hexadecimal digits."""
    h = hashlib.sha256("\0".join(facts).encode())
    for file in files:
        text = file.read_bytes()
        h.update(f"\0{file.name}\0{len(text)}\0".encode())
        h.update(text)
    return h.hexdigest()[:16]


def _processor() -> str:
    """The processor's model as far as it is known: kernels are compiled for it."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor()
    return "\n".join(sorted({line for line in text.splitlines() if line.startswith(("model name", "flags"))}))


def cache_folder() -> Path:
    """Where this version of the kernels is kept: $XDG_CACHE_HOME/softmark/kernels/<digest>."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    facts = (version("numba"), version("numpy"), sys.version, _processor())
    return Path(home) / "softmark" / "kernels" / digest(sources(), *facts)


def _usable(folder: Path) -> bool:
    """Whether kernels can be looked for in the folder, made if need be; without it they live in memory.

    A folder that is there but cannot be written to may have them: what is compiled beside them is not kept.
    """
    if not folder.is_absolute():  # there is no home, and "~" would be a folder right here
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


class _Files:
    """Kernels of one function on disk, a file for each set of types: what numba asks of its index and data files."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name

    def load(self, key: Any) -> Any:
        """What was saved under the key, None where there is nothing or not all of it."""
        try:
            data = self._path(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(data[CHECKSUM:]).digest() != data[:CHECKSUM]:
            return None
        own, kept = pickle.loads(data[CHECKSUM:])
        return kept if own == key else None

    def save(self, key: Any, kept: Any) -> None:
        """Keep it, whole or not at all; a disk that is full or read-only keeps nothing."""
        global _made
        _made += 1
        data: bytes = serialize.dumps((key, kept))
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            _replace(self._path(key), hashlib.sha256(data).digest() + data)

    def flush(self) -> None:
        """Forget all kernels of the function."""
        for file in self.folder.glob(f"{self.name}.*{SUFFIX}"):
            file.unlink(missing_ok=True)

    def _path(self, key: Any) -> Path:
        return self.folder / f"{self.name}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}{SUFFIX}"


def _replace(path: Path, data: bytes) -> None:
    """Write under another name, then rename: nobody ever reads half a file. Raises OSError."""
    handle, part = tempfile.mkstemp(dir=path.parent, prefix=".part-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(part, path)
    except BaseException:  # an interrupt, too
        Path(part).unlink(missing_ok=True)
        raise


class _Place(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Our folder and no other: numba's own choice falls back on folders in which an edited callee goes unnoticed."""

    def __init__(self, function: Any, file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(FOLDER / self.get_suitable_cache_subpath(file))

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Place:
        """Ours, whether or not it can be written to."""
        return cls(function, file)

    def ensure_cache_path(self) -> None:
        """Saving makes the folder, and does without where it cannot."""


class _Machinery(caching.CompileResultCacheImpl):  # type: ignore[misc]
    """How numba makes data of a compiled function and a function of data."""

    _locator_classes = (_Place,)


def _source(file: str) -> str:
    """SHA-256 of a file as it is now, "" where there is none."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return ""


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    """numba's cache of a function, on our files."""

    _impl_class = _Machinery

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._cache_file = _Files(Path(self._cache_path), self._impl.filename_base)
        self.source = _source(function.__code__.co_filename)  # now, while it is being loaded

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code on disk, None without; numba's own would import its whole compiler here first, 0.3 s.

        What is loaded is linked with numba's memory management and its helpers in C alone, and where there is nothing
        to load, compiling imports what it needs.
        """
        runtime.rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """numba's, and what it leaves out; asked for where the function is to be compiled, and no sooner."""
        return (*super()._index_key(sig, codegen), self.source, stamp(self._py_func))


def stamp(function: Any) -> str:
    """SHA-256 of all that a kernel computes with: code, constants, numbers it finds in its module, kernels it calls."""
    return hashlib.sha256("\0".join(_told(function, set())).encode()).hexdigest()


def _told(function: Any, seen: set[Any]) -> list[str]:
    """Of a function and of the kernels it calls, each once."""
    if function in seen:
        return [function.__qualname__]
    seen.add(function)
    told = [function.__qualname__, repr(function.__defaults__)]
    names: set[str] = set()
    codes: list[CodeType] = [function.__code__]
    for code in codes:  # which grows by the functions within
        codes += (c for c in code.co_consts if isinstance(c, CodeType))
        told += [code.co_code.hex(), repr(code.co_names)]
        told += [_plain(c) for c in code.co_consts if not isinstance(c, CodeType)]
        names.update(code.co_names)
    for name in sorted(names & function.__globals__.keys()):
        told += [name, *_value(function.__globals__[name], seen)]
    for cell in function.__closure__ or ():
        told += _value(cell.cell_contents, seen)
    return told


def _value(value: Any, seen: set[Any]) -> list[str]:
    """What a name stands for, as far as machine code depends on it; the same in every process."""
    callee = getattr(value, "py_func", None) or getattr(value, "_defn", None)  # a kernel, an intrinsic
    if callee is not None:
        return [getattr(getattr(value, "_cache", value), "source", ""), *_told(callee, seen)]
    if isinstance(value, np.ndarray):
        return [str(value.dtype), str(value.shape), hashlib.sha256(value.tobytes()).hexdigest()]
    if isinstance(value, tuple):
        return [str(len(value)), *(text for v in value for text in _value(v, seen))]
    if isinstance(value, (bool, int, float, complex, str, bytes, np.generic)) or value is None:
        return [_plain(value)]
    # a module, a type, a function of numpy
    return [type(value).__qualname__, str(getattr(value, "__name__", ""))]


def _plain(value: Any) -> str:
    """A constant in words: a set has no order of its own."""
    return repr(sorted(map(repr, value))) if isinstance(value, frozenset) else repr(value)


class _Pause(event.Listener):  # type: ignore[misc]
    """No search for garbage while numba compiles: through all that numba holds, it takes a tenth of the time."""

    def __init__(self) -> None:
        self._lock, self._depth, self._enabled = threading.Lock(), 0, False

    def on_start(self, event: Any) -> None:
        """Kernels are compiled within others, and in other threads."""
        with self._lock:
            if not self._depth:
                self._enabled = gc.isenabled()
                gc.disable()
            self._depth += 1

    def on_end(self, event: Any) -> None:
        """As it was before the first."""
        with self._lock:
            self._depth -= 1
            if not self._depth and self._enabled:
                gc.enable()


event.register("numba:compile", _Pause())
_LEAN: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # nobody calls a kernel from C
    "pipeline_class": Passes,
}


class _Part:
    """What numba compiles where a kernel calls it, and Python runs as it is written."""

    def __init__(self, function: Any) -> None:
        self.py_func = function
        self.source = _source(function.__code__.co_filename)
        self._compiled = njit(**_LEAN, no_cpython_wrapper=True, _nrt=False)(function)
        self._numba_type_ = numba.types.Dispatcher(self._compiled)  # which knows it by a weak reference
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def kernel(function: Kernel) -> Kernel:
    """Decorator of a kernel: compiled at its first call, kept on disk where that is possible.

    It counts no references: an array belongs to the caller, and none can be made.
    """
    return _kept(function, njit(**_LEAN, _nrt=False)(function))


def maker(function: Kernel) -> Kernel:
    """Decorator of a kernel that makes arrays."""
    return _kept(function, njit(**_LEAN)(function))


def part(function: Kernel) -> Kernel:
    """Decorator of a piece of kernels, compiled within them; called from Python it runs there. It makes no array."""
    return cast(Kernel, _Part(function))


def _kept(function: Kernel, compiled_later: Any) -> Kernel:
    if CACHED:
        compiled_later._cache = _Cache(function)
    return cast(Kernel, compiled_later)


def compiled() -> bool:
    """Whether kernels of this version are on disk already: if not, the first run has to compile them."""
    return CACHED and any(FOLDER.rglob(f"*{SUFFIX}"))


def made() -> int:
    """How many kernels this process has compiled so far, or has had compiled beside it, with all their parts."""
    return _made


def count(kernels: int) -> None:
    """Add those that another process has made for this one."""
    global _made
    _made += kernels
