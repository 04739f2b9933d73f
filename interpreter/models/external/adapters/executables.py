"""Helper functions for programs on the PATH: find the executable, run it for its output, and read its text files."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.external.exporters.named_parts import NamedParts
from softmark.interpreter.models.external.external_problem import NoAnswer

if TYPE_CHECKING:
    from softmark.interpreter.models.external.external_problem import Floats, Problem
    from softmark.interpreter.models.imported_results.result_file import ResultFile

UNKNOWN = "unknown version"
NODES = "nodes.npy"  # our nodes, for matching an answer
NAMELESS = NamedParts({}, {}, {}, {})  # named parts for decks that need only nodes
WIDE = 300  # characters of its output that are shown


def places(program: str) -> tuple[Path, ...]:
    """Return the path of the executable of a program; empty if it is not installed."""
    found = shutil.which(program)
    return () if found is None else (Path(found).resolve(),)


def program_output(program: str, *options: str) -> str:
    """Return the output of a program run with `options`; empty if it cannot be started, or hangs."""
    try:
        return subprocess.run(
            [program, *options], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", timeout=20,
            check=False,
        ).stdout  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return ""


def text(path: Path) -> str:
    """Return the text of a file that a program has written. Raises NoAnswer if the file is missing."""
    try:
        return path.read_text(encoding="ascii", errors="replace")
    except OSError as error:
        raise NoAnswer(f"it wrote no {path.name} ({error.strerror})") from error


def write_nodes(problem: Problem, folder: Path) -> None:
    """Write the nodes of our mesh to the folder of an input deck."""
    np.save(folder / NODES, problem.points)


def read_nodes(folder: Path) -> Floats:
    """Return the nodes (n, 3), m, that `write_nodes` wrote. Raises NoAnswer if the program has overwritten them."""
    try:
        found: Floats = np.load(folder / NODES, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise NoAnswer(f"it overwrote {NODES}") from error
    return found


def read_vector_field(path: Path, field: str) -> tuple[ResultFile, Floats]:
    """Return a result file, and its vector field with the name `field` (p, 3). Raises NoAnswer."""
    from softmark.interpreter.models.imported_results import readers
    from softmark.references.measured_data import Unreadable

    try:
        told = readers.read(path)
    except Unreadable as why:
        raise NoAnswer(f"its result cannot be read: {why}") from why
    if field not in told.fields:
        raise NoAnswer(f"{path.name} has no vectors `{field}`")
    return told, told.fields[field][-1]
