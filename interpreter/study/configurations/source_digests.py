"""Digests of everything outside the scene that decides a result: sources, library versions, and files."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from softmark.interpreter.language.field_schema import _fields_of_class
from softmark.interpreter.language.loaded_plugin import FILES

PARTS = ("grammar", "interpreter", "references", "solvers")
SILENT = ("cli", "report")  # packages that only present results
NUMERICS = (  # libraries that may affect results, installed or not
    "numpy", "scipy", "numba", "llvmlite", "lark", "meshio", "trimesh", "ipctk", "pyamg", "pypardiso", "mkl", "h5py",
    "scikit-image", "pynrrd", "nibabel", "pydicom", "pytetwild", "manifold3d",
)  # fmt: skip


@lru_cache(maxsize=1)
def digest_sources() -> str:
    """Return the SHA-256 of all sources that can change a number, and of the versions of Python and libraries."""
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
    """Return the time when a source file was last changed, s since 1970.

    A process that started before this time may have loaded an older version.
    """
    files = (p for folder in _folders() for p in folder.rglob("*.py"))
    return max((p.stat().st_mtime for p in files), default=0.0)


def _folders() -> list[Path]:
    """Return the folders of softmark's packages, installed or in a checkout."""
    import importlib

    return [Path(importlib.import_module(f"softmark.{part}").__path__[0]).resolve() for part in PARTS]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def digest_file(name: str) -> str:
    """Return the SHA-256 of a file, of all files in a folder, or of the public data set named `data:...`."""
    from softmark.references.data_download import PREFIX, TABLE

    if name.startswith(PREFIX):
        entry = TABLE.get(name.removeprefix(PREFIX))
        return entry.sha256 if entry else "unknown"
    path = Path(name)
    if path.is_dir():
        inner = sorted(p for p in path.rglob("*") if p.is_file())
        return _digest_lines(f"{p.relative_to(path).as_posix()} {_digest_regular_file(*_file_state(p))}" for p in inner)
    return _digest_regular_file(*_file_state(path))


def digest_program(name: str) -> str:
    """Return the version of an external program as text, with the digest of the plugin that defines its adapter."""
    from softmark.interpreter.models.external.adapters import adapter

    return f" {name} {_program_version(name)}{_digest_plugin_module(adapter(name))}"


@cache
def digest_installed(name: str) -> str:
    """Return the digest of an external program's files, and of the list of installed Python packages.

    Files are used because a changed copy may have the same version.
    """
    from softmark.interpreter.models.external.adapters import adapter

    files = (p for place in adapter(name).places() for p in (place.rglob("*") if place.is_dir() else (place,)))
    own = sorted(repr(_file_state(p)) for p in files if p.suffix != ".pyc" and p.is_file())
    beside = sorted({p.name for folder in sys.path for p in Path(folder).glob("*.dist-info")})
    return _digest_lines((*own, *beside))


@cache
def _program_version(name: str) -> str | None:
    from softmark.interpreter.models.external.adapters import adapter

    found: str | None = adapter(name).version()
    return found


def _digest_lines(lines: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _file_state(path: Path) -> tuple[str, int, int]:
    try:
        found = path.stat()
    except OSError:
        return str(path), -1, -1
    return str(path), found.st_mtime_ns, found.st_size


@cache
def _digest_regular_file(path: str, changed: int, size: int) -> str:
    """Return the SHA-256 of one file, cached until its modification time or size changes."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "missing"


def files_of(thing: Any) -> Iterator[str]:
    """Yield every file name in a declared object and in the objects that it contains."""
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
    """Return the SHA-256 of the plugins that define a declared object or its parts; empty if there are none."""
    if not FILES:
        return ""
    if isinstance(thing, tuple):
        return "".join(digest_plugins(value) for value in thing)
    if not is_dataclass(thing):
        return ""
    inner = "".join(digest_plugins(getattr(thing, f.name)) for f in fields(thing))
    return _digest_plugin_module(sys.modules.get(type(thing).__module__)) + inner


def _digest_plugin_module(module: Any) -> str:
    """Return the SHA-256 of the file of a plugin module; empty for other modules."""
    file = getattr(module, "__file__", None) or ""
    return f" {digest_file(file)}" if file in FILES else ""


@cache
def _file_fields(cls: Any) -> frozenset[str]:
    """Return the fields of a constructor's class that contain file names."""
    if _digest_plugin_module(sys.modules.get(cls.__module__)):
        return frozenset(f.attribute for f in _fields_of_class(cls) if f.form in ("file", "files"))
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    for kind, table in CATALOGUE.items():
        for name, known in table.items():
            constructor = CATALOGUE.constructor(kind, name) if known is cls else None
            if constructor is not None:
                return frozenset(f.attribute for f in constructor.fields if f.form in ("file", "files"))
    return frozenset()
