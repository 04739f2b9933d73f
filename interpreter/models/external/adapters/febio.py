"""FEBio 4 (`febio4`): runs the input deck that `dsl export --to febio` writes, and reads its displacements.

The table of displacements has 12 digits, in one block for each time step. The blocks at whole-numbered times are the
requested states. The log shows whether FEBio finished, and its solution time. It was never run here: the format is
taken from the source code.
Source: FEBio User Manual 4, "Running FEBio from a command line" and "Logfile"; FECore/DataRecord.cpp,
FEBioLib/FEBioModel.cpp and FEBio/FEBioApp.cpp.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.models.external.adapters import executables
from softmark.interpreter.models.external.exporters import febio_exporter as deck
from softmark.interpreter.models.external.external_problem import Answer, ExternalNotConverged, NoAnswer

if TYPE_CHECKING:
    from softmark.interpreter.models.external.external_problem import Floats, Problem

program = "febio4"  # the deck is of a specification that none before has
install = "put `febio4` of FEBio 4 (febio.org) on the PATH; there is no package for it in Debian or Python"
refuses = deck.refuses

TABLE, LOG = "u.csv", "model.log"
ROUNDING = 5e-12  # relative rounding of a number: half of the last of 12 digits
SAME = 1e-6  # of a time step: tolerance of the time of a state, which is a sum of steps
GOOD, BAD = "N O R M A L   T E R M I N A T I O N", "E R R O R   T E R M I N A T I O N"
_BOX = re.compile(r"^ ?\* +(?:(?:FATAL )?ERROR|WARNING) +\*\n((?: ?\*[^*\n][^\n]*\*\n)+)", re.M)
_NUMBER = r"(\d+(?:\.\d*)?(?:e[+-]?\d+)?)"
_REACHED = re.compile(rf"^-+ converged at time : {_NUMBER}", re.M)
_ITERATIONS = re.compile(r"Total number of equilibrium iterations \.+ : (\d{1,9})\b")
_CLOCK = re.compile(rf"(Input|Initialization|Solve) time \.+ : \S+ \({_NUMBER} sec\)")
CLOCKS = {"Input": "io_s", "Initialization": "setup_s", "Solve": "solve_s"}


def version() -> str | None:
    """Return the version that `febio4` prints; None if it is not installed."""
    if not places():
        return None
    found = re.search(r"FEBio version\s*=\s*(\S+)", executables.program_output(program, "-info", "-norun"))
    return make_visible(found[1]) if found else executables.UNKNOWN


def places() -> tuple[Path, ...]:
    """Return the path of the executable; empty if it is not installed."""
    return executables.places(program)


def write(problem: Problem, folder: Path) -> None:
    """Write the input deck to a folder."""
    deck.export(problem, executables.NAMELESS, folder)


def command(folder: Path) -> list[str]:
    """Return the command that runs FEBio in the folder; OMP_NUM_THREADS sets its number of threads."""
    return [program, "-i", deck.FILE, "-nosplash"]


def read(folder: Path) -> Answer:
    """Return the results read from the output in a folder. Raises NoAnswer, ExternalNotConverged."""
    told, log = executables.text(folder / deck.FILE), executables.text(folder / LOG)
    said = _join_messages(log)
    reached = [*map(float, _REACHED.findall(log))]
    if BAD in log:
        why = f"error termination, after time {max(reached, default=0.0):g} of {told.count('<pt>') - 1}"
        raise ExternalNotConverged(f"{why}{': ' if said else ''}{said}")
    if GOOD not in log:
        raise NoAnswer(f"its log reports no normal termination{': ' if said else ''}{said}")
    blocks = dict(_blocks(executables.text(folder / TABLE)))
    u = [_state(blocks, k, told.count("<node id=")) for k in range(1, told.count("<pt>"))]
    iterations = _ITERATIONS.search(log)
    clocks = {CLOCKS[name]: float(spent) for name, spent in _CLOCK.findall(log)}
    return Answer(np.array(u) / deck.MM, True, int(iterations[1]) if iterations else None, clocks, said, ROUNDING)


def _join_messages(log: str) -> str:
    """Return the errors and warnings of a log on one line."""
    boxes = (" ".join(line.strip(" *") for line in box.splitlines()).split() for box in _BOX.findall(log))
    return make_visible("; ".join(dict.fromkeys(" ".join(words) for words in boxes)))[: executables.WIDE]


def _blocks(table: str) -> list[tuple[float, str]]:
    """Return the blocks of a table of displacements: the time and the text of each. Raises NoAnswer."""
    try:
        parts = re.split(r"^\*Step[^\n]*\n\*Time\s*=\s*(\S+)\n\*Data[^\n]*\n", table, flags=re.M)[1:]
        return [(float(time), rows) for time, rows in zip(parts[::2], parts[1::2], strict=True)]
    except ValueError as error:
        raise NoAnswer(f"{TABLE} is not a table of times") from error


def _state(blocks: dict[float, str], time: int, count: int) -> Floats:
    """Return the displacements (n, 3), mm, of `count` nodes at a time, from the blocks of a table. Raises NoAnswer."""
    rows = next((own for at, own in blocks.items() if abs(at - time) <= SAME), None)
    if rows is None:
        raise NoAnswer(f"{TABLE} has no displacements at time {time}")
    try:
        table = np.array([line.split(",") for line in rows.splitlines() if line.strip()], dtype=np.float64)
    except ValueError as error:
        raise NoAnswer(f"{TABLE} contains something that is not a table of displacements") from error
    if table.shape != (count, 4) or (table[:, 0] != np.arange(1, count + 1)).any():
        raise NoAnswer(f"{TABLE} does not list the displacements of all {count} nodes in order")
    found: Floats = table[:, 1:]
    return found
