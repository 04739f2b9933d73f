"""Digests of everything outside the scene that decides a result: softmark's sources, library versions, and files."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from softmark.interpreter.language.field_schema import _fields
from softmark.interpreter.language.loaded_plugin import FILES

PARTS = ("grammar", "interpreter", "references", "solvers")
SILENT = ("cli", "report")  # packages that only present results
NUMERICS = (  # libraries that may affect results, installed or not
    "numpy", "scipy", "numba", "llvmlite", "lark", "meshio", "trimesh", "ipctk", "pyamg", "pypardiso", "mkl", "h5py",
    "scikit-image", "pynrrd", "nibabel", "pydicom", "pytetwild", "manifold3d",
)  # fmt: skip


@lru_cache(maxsize=1)
def digest_sources() -> str:
    """Return the SHA-256 of all sources that can change a number, and the versions of Python and of the libraries."""
    h = hashlib.sha256(f"{sys.implementation.name} {sys.version}\0".encode())
    for name in NUMERICS:
        h.update(f"{name} {_version(name)}\0".encode())
    for folder in _folders():
        for file in sorted(p for p in folder.rglob("*") if p.suffix in (".py", ".lark")):
            inner = file.relative_to(folder)
            if inner.parts[0] not in SILENT:
                text = file.read_bytes()
                h.update(f"{folder.name}/{inner.as_posix()}\0{len(text)}\0".encode() + text)
    return h.hexdigest()


def newest_change() -> float:
    """Return when a source was last changed, s since 1970: a process may have loaded an older one."""
    files = (p for folder in _folders() for p in folder.rglob("*.py"))
    return max((p.stat().st_mtime for p in files), default=0.0)


def _folders() -> list[Path]:
    """Return the folders of the packages, as installed or in a checkout."""
    import importlib

    return [Path(importlib.import_module(f"softmark.{part}").__path__[0]).resolve() for part in PARTS]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def digest_file(name: str) -> str:
    """Return the SHA-256 of a file, of all files of a folder, or of the public data set that `data:...` names."""
    from softmark.references.data_download import PREFIX, TABLE

    if name.startswith(PREFIX):
        entry = TABLE.get(name.removeprefix(PREFIX))
        return entry.sha256 if entry else "unknown"
    path = Path(name)
    if path.is_dir():
        inner = sorted(p for p in path.rglob("*") if p.is_file())
        return _joined(f"{p.relative_to(path).as_posix()} {_of_regular(*_state(p))}" for p in inner)
    return _of_regular(*_state(path))


def digest_program(name: str) -> str:
    """Return the version of an external program, or that it is missing, and the plugin of its adapter."""
    from softmark.interpreter.models.external.adapters import adapter

    return f" {name} {_of_version(name)}{_of_module(adapter(name))}"


@cache
def digest_installed(name: str) -> str:
    """Return the digest of one of our programs on disk, and of all packages installed with it.

    The version may stay the same in a changed copy.
    """
    from softmark.interpreter.models.external.adapters import adapter

    files = (p for place in adapter(name).places() for p in (place.rglob("*") if place.is_dir() else (place,)))
    own = sorted(repr(_state(p)) for p in files if p.suffix != ".pyc" and p.is_file())
    beside = sorted({p.name for folder in sys.path for p in Path(folder).glob("*.dist-info")})
    return _joined((*own, *beside))


@cache
def _of_version(name: str) -> str | None:
    from softmark.interpreter.models.external.adapters import adapter

    found: str | None = adapter(name).version()
    return found


def _joined(lines: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _state(path: Path) -> tuple[str, int, int]:
    try:
        found = path.stat()
    except OSError:
        return str(path), -1, -1
    return str(path), found.st_mtime_ns, found.st_size


@cache
def _of_regular(path: str, changed: int, size: int) -> str:
    """Return the SHA-256 of one file, cached until it changes."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "missing"


def files_of(thing: Any) -> Iterator[str]:
    """Yield every file that a declared object names, also in its parts."""
    if isinstance(thing, tuple):
        for value in thing:
            yield from files_of(value)
    if not is_dataclass(thing):
        return
    cls: Any = type(thing)
    named = _file_fields(cls)
    for f in fields(thing):
        value = getattr(thing, f.name)
        if f.name in named and isinstance(value, str | tuple):
            yield from (value,) if isinstance(value, str) else value
        else:
            yield from files_of(value)


def digest_plugins(thing: Any) -> str:
    """Return the SHA-256 of the plugins that define a declared object or its parts; "" for our own."""
    if not FILES:
        return ""
    if isinstance(thing, tuple):
        return "".join(digest_plugins(value) for value in thing)
    if not is_dataclass(thing):
        return ""
    inner = "".join(digest_plugins(getattr(thing, f.name)) for f in fields(thing))
    return _of_module(sys.modules.get(type(thing).__module__)) + inner


def _of_module(module: Any) -> str:
    """Return the SHA-256 of a plugin from its module, "" for our own."""
    file = getattr(module, "__file__", None) or ""
    return f" {digest_file(file)}" if file in FILES else ""


@cache
def _file_fields(cls: Any) -> frozenset[str]:
    """Return the fields of a constructor's class that hold the name of a file."""
    if _of_module(sys.modules.get(cls.__module__)):
        return frozenset(f.attribute for f in _fields(cls) if f.form in ("file", "files"))
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    for kind, table in CATALOGUE.items():
        for name, known in table.items():
            constructor = CATALOGUE.constructor(kind, name) if known is cls else None
            if constructor is not None:
                return frozenset(f.attribute for f in constructor.fields if f.form in ("file", "files"))
    return frozenset()
