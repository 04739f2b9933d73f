"""PolyFEM (`PolyFEM_bin`): runs the deck that `dsl export --to polyfem` writes, and reads its VTU and statistics.

The VTU has separate nodes for each cell, in double precision and in PolyFEM's order: they are matched by position.
PolyFEM stops at a gradient of 1e-8 of its own units, and the option for another tolerance differs between versions:
loads below about 1 mN may remain unsolved, which is reported. PolyFEM reports no version. It was never run here: the
format is taken from its source code.
Source: PolyFEM's src/main.cpp, io/OutData.cpp, io/VTUWriter.cpp; polysolve's nonlinear/Solver.cpp.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.models.external.adapters import executables
from softmark.interpreter.models.external.exporters import polyfem_exporter as deck
from softmark.interpreter.models.external.external_problem import Answer, ExternalNotConverged, NoAnswer
from softmark.interpreter.models.external.external_process import LOG

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import Floats, Problem

program = "PolyFEM_bin"
install = "put `PolyFEM_bin` (polyfem.github.io) on the PATH; there is no package for it in Debian or Python"

FIELD = "solution"
NEAR = 1e-9  # of the size of the body: tolerance for matching nodes
ALIKE = 1e-9  # of the largest displacement: largest difference between the cells of a node
_ERROR = re.compile(r"\[error\]\s*(.*)")
_SOLVED = re.compile(r"^.*\bFinished: .*$", re.M)  # log line of the nonlinear solver; the last one is that of the body
CLOCKS = {
    "io_s": ("loading_mesh",),
    "setup_s": ("building_basis", "assigning_rhs"),
    "solve_s": ("assembling_stiffness_mat", "solving"),
}


def version() -> str | None:
    """Return a placeholder for the version, which PolyFEM does not report; None if it is not installed."""
    return executables.UNKNOWN if places() else None


def places() -> tuple[Path, ...]:
    """Return the path of the executable; empty if it is not installed."""
    return executables.places(program)


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return features of a problem, including loads, that a PolyFEM deck cannot express."""
    return deck.refuses(problem) or deck.unsupported_loads(problem, _require_named_parts(problem))


def write(problem: Problem, folder: Path) -> None:
    """Write the deck and the mesh to a folder."""
    deck.export(problem, _require_named_parts(problem), folder)
    executables.write_nodes(problem, folder)


def _require_named_parts(problem: Problem) -> NamedParts:
    """Return the named parts of a problem, which PolyFEM's deck needs."""
    assert problem.named is not None  # as its line in PROGRAMS asks for
    return problem.named


def command(folder: Path) -> list[str]:
    """Return the command that runs PolyFEM in the folder.

    A shell sets the number of threads, because no environment variable limits it.
    """
    return ["sh", "-c", f'exec {program} --json {deck.FILE} --output_dir . --log_level info'
            ' --max_threads "${OMP_NUM_THREADS:-1}"']  # fmt: skip


def read(folder: Path) -> Answer:
    """Return the results read from the output in a folder. Raises NoAnswer, ExternalNotConverged."""
    log = executables.text(folder / LOG)
    errors, solved = _ERROR.findall(log), _SOLVED.findall(log)
    said = make_visible("; ".join(dict.fromkeys(own.strip() for own in errors)))[: executables.WIDE]
    settled = "[error]" not in solved[-1] if solved else None
    if not (folder / deck.ANSWER).exists():
        if settled is False or any(word in said for word in ("iteration limit", "find minimizer")):
            raise ExternalNotConverged(said)
        raise NoAnswer(f"it wrote no {deck.ANSWER}{': ' if said else ''}{said}")
    told, found = executables.read_vector_field(folder / deck.ANSWER, FIELD)
    u = _match_displacements(told.points, found, executables.read_nodes(folder))
    return Answer(u[None], settled, None, _read_timings(folder / deck.STATISTICS), said)


def _match_displacements(points: Floats, found: Floats, nodes: Floats) -> Floats:
    """Return the displacements (n, 3), m, of softmark's `nodes`, matched by position to nodes of PolyFEM.

    PolyFEM's nodes are at `points` and have the displacements `found`. Raises NoAnswer if a node has no match.
    """
    from scipy.spatial import cKDTree

    distance, node = cKDTree(nodes).query(points)
    own = distance <= NEAR * np.linalg.norm(np.ptp(nodes, axis=0))
    u = np.full(nodes.shape, np.nan)
    u[node[own]] = found[own]
    if lost := int(np.isnan(u[:, 0]).sum()):
        raise NoAnswer(f"{deck.ANSWER} has no point at {lost} of {len(nodes)} nodes")
    if np.abs(u[node[own]] - found[own]).max() > ALIKE * np.abs(u).max():
        raise NoAnswer(f"{deck.ANSWER} has several displacements for one node")
    return u


def _read_timings(path: Path) -> dict[str, float]:
    """Return the times in a file of PolyFEM's statistics, s; empty if there are none."""
    try:
        told = json.loads(executables.text(path))
        return {name: sum(float(told[f"time_{own}"]) for own in parts) for name, parts in CLOCKS.items()}
    except (NoAnswer, ValueError, KeyError, TypeError, RecursionError):
        return {}
