"""numba, with a cache on disk that never returns what an older source computed.

numba's cache does not notice that a function called from another file has changed: the old kernel answers, silently.
So the folder of the cache is named by a digest of all solver sources, of numba's and numpy's version and of the
processor. Kernels live in `kernels.py` files, in `sparse` and in `corotational_tets.py`; what needs none must not
import these, for numba is slow to load. A kernel is compiled for the types that it is called with and no others, so
one that a run does not call costs it nothing.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from collections.abc import Callable, Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


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


def _writable(folder: Path) -> bool:
    """Whether kernels can be kept in the folder, made if need be; without it they live in memory."""
    if not folder.is_absolute():  # there is no home, and "~" would be a folder right here
        return False
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return os.access(folder, os.W_OK)
    except OSError:
        return False


FOLDER = cache_folder()
CACHED = _writable(FOLDER)


def kernel(function: Kernel) -> Kernel:
    """Decorator of every kernel: compiled at its first call, kept on disk where that is possible.

    numba takes the folder of its cache when it decorates; whoever else uses numba in this process keeps theirs.
    """
    config: Any = numba.config
    theirs = config.CACHE_DIR
    config.CACHE_DIR = str(FOLDER)
    try:
        compiled_later: Any = numba.njit(cache=CACHED, nogil=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = theirs
    return cast(Kernel, compiled_later)


def compiled() -> bool:
    """Whether kernels of this version are on disk already: if not, the first run has to compile them."""
    return CACHED and any(FOLDER.rglob("*.nbc"))
