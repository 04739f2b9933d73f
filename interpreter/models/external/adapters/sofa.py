"""SOFA 24 (`runSofa`): runs the scene that `dsl export --to sofa` writes once in batch mode, and reads its VTU.

Its VTU has six digits of each displacement, in the order of our nodes; the residual that this causes is reported. The
log of its static solver states convergence. Its own clock begins after the first step, which is the only one here, so
that its time is that of its whole process. It reports no version. It was never run here: the format is taken from its
sources. Source: Component/IO/Mesh/VTKExporter.cpp, ODESolver/Backward/StaticSolver.cpp,
Engine/Transform/DifferenceEngine.inl and GUI/BatchGUI.cpp.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.models.external.adapters import executables
from softmark.interpreter.models.external.exporters import sofa_exporter as deck
from softmark.interpreter.models.external.external_problem import Answer, ExternalNotConverged, NoAnswer
from softmark.interpreter.models.external.external_process import LOG

if TYPE_CHECKING:
    from softmark.interpreter.models.external.external_problem import Problem

program = "runSofa"
install = "put `runSofa` of SOFA 24 (sofa-framework.org) on the PATH; there is no package for it in Debian or Python"
refuses = deck.refuses

ROUNDING = 5e-6  # of a number: half of the last of 6 digits
SETTLED, LOST, ITERATION = "[CONVERGED]", "[DIVERGED]", "Newton iteration #"


def version() -> str | None:
    """Return None if it is not installed; it reports no version."""
    return executables.UNKNOWN if places() else None


def places() -> tuple[Path, ...]:
    """Return the executable; empty if it is not installed."""
    return executables.places(program)


def write(problem: Problem, folder: Path) -> None:
    """Write its scene."""
    deck.export(problem, executables.NAMELESS, folder)
    executables.write_nodes(problem, folder)


def command(folder: Path) -> list[str]:
    """Return the command to run in the folder."""
    return [program, "-g", "batch", "-n", "1", deck.FILE]


def read(folder: Path) -> Answer:
    """Read its output from a folder. Raises NoAnswer, ExternalNotConverged."""
    log, files = executables.text(folder / LOG), sorted(folder.glob(f"{deck.ANSWER}*.vtu"))
    if LOST in log:
        why = log.partition(LOST)[2].partition("\n")[0].strip()[: executables.WIDE]
        raise ExternalNotConverged(make_visible(why) or "it diverged")
    if not files:
        raise NoAnswer(f"it wrote no {deck.ANSWER}*.vtu")
    told, u = executables.results(files[-1], deck.FIELD)
    nodes = executables.read_nodes(folder)
    if told.points.shape != nodes.shape or np.abs(told.points - nodes).max() > 2.0 * ROUNDING * np.abs(nodes).max():
        raise NoAnswer(f"the points of {files[-1].name} are not the nodes of the scene")
    return Answer(u[None], True if SETTLED in log else None, log.count(ITERATION) or None, {}, "", ROUNDING)
