"""Checks that output files of a command overwrite neither its input files nor each other."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import make_visible

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene

Place = tuple[str, Path]  # (option that names the file, or its role in words; path of the file)


def find_collision(outputs: Sequence[Place], inputs: Iterable[Place] = ()) -> str:
    """Return an error message if an output file is also an input file or another output file, else an empty text."""
    taken = {key: (what, path) for what, path in inputs if (key := _file_identity(path)) is not None}
    for option, path in outputs:
        key = _file_identity(path)
        if key is None:
            continue
        if key in taken:
            what, other = taken[key]
            return _message(option, path, what, other)
        taken[key] = f"what {option} writes", path
    return ""


def _message(option: str, path: Path, what: str, other: Path) -> str:
    same = "" if path == other else f", which is the same file as {other}"
    return make_visible(f"error[E394]: {option} would overwrite {path}{same}, which is {what}; "
                        f"choose another path with {option.split()[0].rstrip(',')}")  # fmt: skip


def _file_identity(path: Path) -> object:
    """Return an identity that is equal for all names of the same file.

    Return None for devices and pipes, which store nothing.
    """
    try:
        if path.exists() and not path.is_file():
            return None
        if path.exists():
            found = path.stat()
            return found.st_dev, found.st_ino
        return os.path.realpath(path)
    except (OSError, ValueError):  # another check reports that it cannot be written
        return None


def input_files(scene: Scene) -> list[Place]:
    """Return the files that a scene was read from, and the data files that it names."""
    from softmark.interpreter.study.configurations.source_digests import files_of

    modules = scene.table.modules if scene.table is not None else []
    texts = [("the scene" if not m.prefix else "a scene that is used", m.file) for m in modules]
    found = [(what, file) for what, file in texts if file is not None]
    named = (Path(n) for d in scene.declared.values() for n in files_of(d.thing) if not n.startswith("data:"))
    return [*found, *(("a file that the scene reads", path) for path in dict.fromkeys(named))]


def output_files(option: str, folder: Path | None, names: Sequence[str]) -> list[Place]:
    """Return the paths of the files `names` in an output folder; an empty list if `folder` is None."""
    return [] if folder is None else [(option, folder / name) for name in names]
