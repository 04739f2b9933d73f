"""SOFA 24 (`runSofa`): runs once, in batch mode, the scene that `dsl export --to sofa` writes, and reads the VTU.

The VTU has six digits of each displacement, in the order of our nodes; the residual that this rounding causes is
reported. The log of SOFA's static solver states whether it converged. SOFA's own clock begins after the first step,
which is the only one here, so that the reported time is that of the whole process. SOFA reports no version. It was
never run here: the format is taken from its source code.
Source: Component/IO/Mesh/VTKExporter.cpp, ODESolver/Backward/StaticSolver.cpp, Engine/Transform/DifferenceEngine.inl
and GUI/BatchGUI.cpp.
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

ROUNDING = 5e-6  # relative rounding of a number: half of the last of 6 digits
SETTLED, LOST, ITERATION = "[CONVERGED]", "[DIVERGED]", "Newton iteration #"


def version() -> str | None:
    """Return a placeholder for the version, which SOFA does not report; None if it is not installed."""
    return executables.UNKNOWN if places() else None


def places() -> tuple[Path, ...]:
    """Return the path of the executable; empty if it is not installed."""
    return executables.places(program)


def write(problem: Problem, folder: Path) -> None:
    """Write the SOFA scene to a folder."""
    deck.export(problem, executables.NAMELESS, folder)
    executables.write_nodes(problem, folder)


def command(folder: Path) -> list[str]:
    """Return the command that runs SOFA in the folder."""
    return [program, "-g", "batch", "-n", "1", deck.FILE]


def read(folder: Path) -> Answer:
    """Return the results read from the output in a folder. Raises NoAnswer, ExternalNotConverged."""
    log, files = executables.text(folder / LOG), sorted(folder.glob(f"{deck.ANSWER}*.vtu"))
    if LOST in log:
        why = log.partition(LOST)[2].partition("\n")[0].strip()[: executables.WIDE]
        raise ExternalNotConverged(make_visible(why) or "it diverged")
    if not files:
        raise NoAnswer(f"it wrote no {deck.ANSWER}*.vtu")
    told, u = executables.read_vector_field(files[-1], deck.FIELD)
    nodes = executables.read_nodes(folder)
    if told.points.shape != nodes.shape or np.abs(told.points - nodes).max() > 2.0 * ROUNDING * np.abs(nodes).max():
        raise NoAnswer(f"the points of {files[-1].name} are not the nodes of the scene")
    return Answer(u[None], True if SETTLED in log else None, log.count(ITERATION) or None, {}, "", ROUNDING)
