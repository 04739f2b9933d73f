"""numba, with a cache on disk that never returns what an older source computed.

numba's cache does not notice that a function called from another file has changed: the old kernel answers, silently.
So the folder of the cache is named by a digest of all solver sources, of numba's and numpy's version and of the
processor. numba's index of a function is read, changed and written without a lock, too, so that two processes that
compile it at once for different types can leave the one's machine code under the other's types; and a file that was
cut off or altered is run as it is. Here a kernel has a file of its own, named by all that decides it, that begins with
a checksum of what follows: it is there whole, or it is compiled anew.

Kernels live in `kernels.py` files, in `sparse` and in `corotational_tets.py`; what needs none must not
import these, for numba is slow to load. A kernel is compiled for the types that it is called with and no others, so
one that a run does not call costs it nothing.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import platform
import sys
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import caching as _caching
from numba.core import serialize as _serialize

caching: Any = _caching  # without types of its own
serialize: Any = _serialize

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
SUFFIX = ".kernel"
CHECKSUM = hashlib.sha256().digest_size  # bytes


def sources() -> list[Path]:
    """Every source file whose change must make the kernels compile anew."""
    return sorted(Path(__file__).parent.rglob("*.py"))


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


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    """numba's cache of a function, on our files."""

    _impl_class = _Machinery

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._cache_file = _Files(Path(self._cache_path), self._impl.filename_base)


def kernel(function: Kernel) -> Kernel:
    """Decorator of every kernel: compiled at its first call, kept on disk where that is possible."""
    compiled_later: Any = numba.njit(nogil=True, error_model="numpy")(function)
    if CACHED:
        compiled_later._cache = _Cache(function)
    return cast(Kernel, compiled_later)


def compiled() -> bool:
    """Whether kernels of this version are on disk already: if not, the first run has to compile them."""
    return CACHED and any(FOLDER.rglob(f"*{SUFFIX}"))
