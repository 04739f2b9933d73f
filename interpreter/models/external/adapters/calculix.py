"""CalculiX (`ccx`): writes input decks in the style of Abaqus, runs the program and reads its printed results.

Units are mm, Pa and uN (g, mm and s), because CalculiX ignores forces below 1e-6. It reads 20 characters of a number,
that is 14 digits, and prints 7 digits of each displacement. The restart file has double precision; its values are used
if they agree with the printed digits.
Source: Dhondt, "CalculiX CrunchiX User's Manual", version 2.20.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.models.external.adapters import PROGRAMS, executables
from softmark.interpreter.models.external.external_problem import Answer, ExternalNotConverged, NoAnswer

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import ExternalMaterial, Floats, Ints, Problem

title = PROGRAMS["calculix"].title
program = "ccx"
install = "install the package `calculix-ccx` (Debian, Ubuntu), or see calculix.de"

elements: Mapping[str, str] = {"tet4": "C3D4", "tet10": "C3D10", "hex8": "C3D8", "hex20": "C3D20"}
laws = PROGRAMS["calculix"].laws
others: Mapping[str, str] = {  # laws that have a namesake of its own, and why it is another one
    "neo_hookean": "its *HYPERELASTIC, NEO HOOKE is another law, mu/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2, which "
    "is called `neo_hookean_isochoric` here",
    "ogden": "its *HYPERELASTIC, OGDEN (version 2.20) does not converge from the undeformed state, where "
    "stretches are equal",
    "arruda_boyce": "its *HYPERELASTIC, ARRUDA-BOYCE has the volumetric energy K/2 ((J^2 - 1)/2 - ln J)",
}

JOB = "job"
LOG = "log.txt"  # output file of CalculiX
MM = 1e3  # mm in a metre, and uN in mN: a force of 1 N is 1e6 uN
UN = 1e6
DENSE = 1e-6  # g/mm^3 in a kg/m^3
VOID = 1e30  # D_n of an absent volumetric term; 0 would stand for a default
LEAST_SPARE = 1e-4  # smallest 1 - 2 nu: at 2e-4 results agree to 2e-9, at 2e-5 it does not converge (version 2.20)
SAID, WIDE = 4, 160  # number of its errors and warnings shown, and characters of each
PRINTED = 5e-7  # relative rounding of a number: half of the last of 7 digits
CLOCK = 1e-5  # tolerance of the time reached, which is printed with 6 digits
TRUST = 6e-7  # of the largest displacement: difference of printed (7 digits) and double precision values
_TROUBLE = re.compile(r"^\s*(\*(ERROR|WARNING)[^\n]*(?:\n {6,}\S[^\n]*)*)", re.M)
_PERIOD = re.compile(r"^\*STATIC\n[^,\n]*,([^,\n]*)", re.M)
_TIME = re.compile(r"Total CalculiX Time:\s*([0-9.eE+-]+)")


def version() -> str | None:
    """Return the version that `ccx` prints; None if it is not installed or prints none."""
    said = executables.program_output(program, "-v").split()
    return said[-1] if said else None


def places() -> tuple[Path, ...]:
    """Return the path of the executable; empty if it is not installed."""
    return executables.places(program)


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return unsupported features of a problem, with reasons; empty if all are supported."""
    found = []
    if problem.element not in elements:
        found.append((problem.element, f"it does not have this element; it has {', '.join(elements)}"))
    for stuff in problem.stuff:
        found += _unsupported_material_features(stuff, problem.strain)
    return found


def _unsupported_material_features(stuff: ExternalMaterial, strain: str) -> Iterator[tuple[str, str]]:
    """Yield the features of a material that CalculiX does not support, with reasons."""
    known = laws.get(strain, ())
    if stuff.law not in known:
        why = others.get(stuff.law) or f"it does not have this law; in {strain} strain it has {', '.join(known)}"
        yield stuff.law, why
    elif stuff.choices.get("volumetric", "squared") != "squared":
        yield f"volumetric = {stuff.choices['volumetric']}", "its volumetric energy is K/2 (J - 1)^2"
    elif stuff.law in _LAWS and 1.0 - 2.0 * stuff.constants["poisson"] < LEAST_SPARE:
        yield (
            f"poisson = {stuff.constants['poisson']:g}",
            "it does not converge for such a nearly incompressible material",
        )


# ------------------------------------------------------------------ writing


def write(problem: Problem, folder: Path) -> None:
    """Write the input deck, JOB.inp, to a folder. Raises ValueError for unsupported features."""
    (folder / f"{JOB}.inp").write_text("\n".join([*deck(problem), ""]), encoding="ascii")


def deck(problem: Problem, sets: Sequence[str] = ()) -> Iterator[str]:
    """Yield the lines of the input deck; `sets` are lines that define additional node and element sets.

    Raises ValueError for features that `refuses` returns.
    """
    if found := refuses(problem):
        raise ValueError("; ".join(f"{what}: {why}" for what, why in found))
    yield "** units: mm, Pa, uN (g, mm, s); nodes and elements count from 1"
    yield from nodes(MM * problem.points, 1, "ALL")
    for number, stuff in enumerate(problem.stuff, start=1):
        yield from cells(elements[problem.element], problem.cells[stuff.cells], 1, stuff.cells + 1, f"PART{number}")
    for number, stuff in enumerate(problem.stuff, start=1):
        yield f"*MATERIAL, NAME=M{number}"
        yield from (*law(stuff), *_density(stuff))
        yield f"*SOLID SECTION, ELSET=PART{number}, MATERIAL=M{number}"
    yield from (*sets, *_sets(problem))
    yield "*RESTART, WRITE, FREQUENCY=1"
    for share, period in zip(problem.shares, _step_durations(problem), strict=True):
        yield from _step(problem, share, period)


def number(value: float) -> str:
    """Return a number as text, with as many digits as CalculiX reads."""
    return f"{value:.13e}"


def nodes(points: Floats, first: int, name: str) -> list[str]:
    """Return the cards that define nodes at `points` (n, 3), m, numbered from `first`, as a set `name`."""
    rows = (",".join([str(first + i), *map(number, p)]) for i, p in enumerate(points.tolist()))
    return [f"*NODE, NSET={name}", *rows]


def cells(kind: str, members: Ints, node: int, numbers: Ints | Sequence[int], name: str) -> list[str]:
    """Return the cards that define elements of a type, 16 numbers per line.

    `members` (m, a) are their nodes, to whose indices `node` is added. `numbers` (m,) are the element numbers.
    """
    lines = [f"*ELEMENT, TYPE={kind}, ELSET={name}"]
    for own, cell in zip(np.asarray(numbers).tolist(), (np.asarray(members) + node).tolist(), strict=True):
        row = [str(own), *map(str, cell)]
        lines += [",".join(row)] if len(row) <= 16 else [",".join(row[:16]) + ",", ",".join(row[16:])]
    return lines


def cards_of_set(kind: str, name: str, numbers: Ints | Sequence[int]) -> list[str]:
    """Return the cards of a set of nodes (kind NSET) or elements (kind ELSET)."""
    return [f"*{kind}, {kind}={name}", *map(str, np.asarray(numbers).tolist())]


def law(stuff: ExternalMaterial) -> list[str]:
    """Return the cards of a material law. *ELASTIC is the St Venant-Kirchhoff law if the step has NLGEOM."""
    own = stuff.constants
    if stuff.law in ("linear_elastic", "st_venant_kirchhoff"):
        return ["*ELASTIC", f"{number(own['young'])},{number(own['poisson'])}"]
    word, shape = _LAWS[stuff.law]
    terms = shape(own)
    bulk = own["young"] / (3.0 * (1.0 - 2.0 * own["poisson"]))
    rest = [2.0 / bulk] + [VOID] * (2 if word == "YEOH" else 0)
    return [f"*HYPERELASTIC, {word}", ",".join(map(number, [*terms, *rest]))]


def _density(stuff: ExternalMaterial) -> list[str]:
    """Return the card of the density.

    Static analyses do not use it, because the weight is part of the nodal forces.
    """
    return [] if stuff.density is None else ["*DENSITY", number(DENSE * stuff.density)]


# its word, and what it has for the shape
_LAWS: Mapping[str, tuple[str, Callable[[Mapping[str, float]], list[float]]]] = {
    "neo_hookean_isochoric": ("NEO HOOKE", lambda own: [own["young"] / (1.0 + own["poisson"]) / 4.0]),
    "mooney_rivlin": ("MOONEY-RIVLIN", lambda own: [own["c1"], own["c2"]]),
    "yeoh": ("YEOH", lambda own: [own["c1"], own["c2"], own["c3"]]),
}


def _sets(problem: Problem) -> Iterator[str]:
    """Yield the cards of sets of fixed nodes, one set for each direction."""
    for c in range(3):
        still = problem.held[(problem.held[:, 1] == c) & (problem.values == 0.0), 0]
        if len(still):
            yield from cards_of_set("NSET", f"HELD{c + 1}", still + 1)
            yield from ("*BOUNDARY", f"HELD{c + 1},{c + 1},{c + 1}")


def _step_durations(problem: Problem) -> list[float]:
    """Return the duration of each step: differences of the times of the states if these increase, else 1."""
    rising = [b - a for a, b in pairwise((0.0, *problem.values_of_states))]
    return rising if len(rising) == len(problem.shares) and min(rising) > 0.0 else [1.0] * len(problem.shares)


def _step(problem: Problem, share: float, period: float) -> Iterator[str]:
    """Yield the cards of the step that applies the fraction `share` of the load, with a duration `period`."""
    finite = problem.strain == "finite"
    yield from ("*STEP, NLGEOM, INC=10000", "*STATIC") if finite else ("*STEP", "*STATIC")
    yield f"{0.1 * period:.12g},{period:.12g},{1e-6 * period:.12g}" if finite else f"{period:.12g},{period:.12g}"
    if finite:  # residual and correction, by their means, at which an iteration is the last: 0.005 and 0.01 by default
        yield from ("*CONTROLS, PARAMETERS=FIELD", f"{problem.tolerance:.3e},1e-4")
    moved = np.flatnonzero(problem.values)
    if len(moved):
        yield "*BOUNDARY"
        for (node, c), value in zip(problem.held[moved].tolist(), (MM * share * problem.values[moved]).tolist(),
                                    strict=True):  # fmt: skip
            yield f"{node + 1},{c + 1},{c + 1},{number(value)}"
    loaded = np.argwhere(problem.forces)
    if len(loaded):
        yield "*CLOAD"
        for node, c in loaded.tolist():
            yield f"{node + 1},{c + 1},{number(UN * share * problem.forces[node, c])}"
    yield from ("*NODE PRINT, NSET=ALL, FREQUENCY=99999", "U")
    yield from ("*NODE FILE, FREQUENCY=99999", "U", "*END STEP")


def export(problem: Problem, named: NamedParts, folder: Path) -> list[str]:
    """Write the deck with sets of nodes and elements that are named as in the scene. Return the file names."""
    known = [("NSET", "S", named.supports), ("ELSET", "P", named.parts)]
    sets = []
    for kind, letter, each in known:
        for i, (name, own) in enumerate(each.items(), start=1):
            sets += cards_of_set(kind, f"{letter}{i}_{re.sub(r'[^A-Za-z0-9]', '_', name)[:60]}", own + 1)
    (folder / f"{JOB}.inp").write_text("\n".join([*deck(problem, sets), ""]), encoding="ascii")
    return [f"{JOB}.inp"]


# ------------------------------------------------------------------ running and reading


def command(folder: Path) -> list[str]:
    """Return the command that runs CalculiX in the folder."""
    return [program, "-i", JOB]


def read(folder: Path) -> Answer:
    """Return the results read from the output and the log (LOG) in a folder. Raises NoAnswer, ExternalNotConverged."""
    log = executables.text(folder / LOG) if (folder / LOG).exists() else ""
    said = _join_messages(log)
    told = executables.text(folder / f"{JOB}.inp")
    periods = [float(own) for own in _PERIOD.findall(told)]
    asked, count = len(periods), told.partition("*ELEMENT")[0].count("\n") - 2
    iterations, reached = _iterations_and_time_reached(folder / f"{JOB}.sta")
    printed = list(_printed_displacements(folder / f"{JOB}.dat")) if (folder / f"{JOB}.dat").exists() else []
    if not iterations:
        raise NoAnswer(f"it did not start to solve{': ' if said else ''}{said}")
    if reached < sum(periods) * (1.0 - CLOCK):
        why = f"it stopped after a fraction of {reached / sum(periods):.3g} of all states"
        raise ExternalNotConverged(f"{why}, in {iterations} iterations{': ' if said else ''}{said}")
    if len(printed) != asked:
        raise NoAnswer(f"it wrote {len(printed)} of {asked} states{': ' if said else ''}{said}")
    if short := [len(own) for own in printed if len(own) != count]:
        raise NoAnswer(f"it wrote displacements of {short[0]} of {count} nodes")
    whole = _double_precision_displacements(folder / f"{JOB}.rout", printed)
    rounding = PRINTED if any(u is own for u, own in zip(whole, printed, strict=True)) else 0.0
    u = np.array(whole)
    if not np.isfinite(u).all():
        raise NoAnswer("some of its displacements are not finite numbers")
    spent = _TIME.search(log)
    clocks = {"whole_s": float(spent[1])} if spent else {}
    return Answer(u / MM, "Job finished" in log if log else None, iterations, clocks, said, rounding)


def _join_messages(log: str) -> str:
    """Return the errors of a log, followed by its warnings, on one line; at most SAID messages."""
    found = sorted(dict.fromkeys((kind, " ".join(own.split())[:WIDE]) for own, kind in _TROUBLE.findall(log)),
                   key=lambda own: own[0])  # fmt: skip
    more = f"; and {len(found) - SAID} more" if len(found) > SAID else ""
    return make_visible("; ".join(text for _, text in found[:SAID]) + more)


def _iterations_and_time_reached(path: Path) -> tuple[int, float]:
    """Return the total number of iterations, and the time that the analysis reached. Raises NoAnswer."""
    rows = [line.split() for line in executables.text(path).splitlines()[2:]]
    try:
        kept = [row for row in rows if not row[2].endswith("U")]
        return sum(int(row[3]) for row in rows), max((float(row[4]) for row in kept), default=0.0)
    except (ValueError, IndexError) as error:
        raise NoAnswer(f"{path.name} is not a table of increments") from error


def _printed_displacements(path: Path) -> Iterator[Floats]:
    """Yield the printed displacements of each state (n, 3), mm, with 7 digits. Raises NoAnswer."""
    blocks = re.split(r"^ displacements[^\n]*\n", executables.text(path), flags=re.M)[1:]
    for block in blocks:
        rows = [line.split() for line in block.splitlines() if line.strip()]
        try:
            table = np.array(rows, dtype=np.float64)
        except ValueError as error:
            raise NoAnswer(f"{path.name} contains something that is not a table of displacements") from error
        if table.ndim != 2 or table.shape[1] != 4 or (table[:, 0] != np.arange(1, len(table) + 1)).any():
            raise NoAnswer(f"{path.name} does not list the displacements of all nodes in order")
        yield table[:, 1:]


def _double_precision_displacements(path: Path, printed: Sequence[Floats]) -> list[Floats]:
    """Return the displacements of each state (n, 3) in double precision, read from the restart file.

    `printed` are the displacements of each state with 7 digits. A state whose displacements agree with no record of the
    restart file keeps the printed ones. Each record has four values per node: a temperature and three displacements.
    """
    found, records = list(printed), iter(_records(path, 32 * len(printed[0])))
    for i, own in enumerate(printed):
        most = float(np.abs(own).max(initial=0.0))
        for whole in records:
            u = np.frombuffer(whole).reshape(-1, 4)[:, 1:]
            if np.abs(u - own).max(initial=0.0) <= TRUST * most:
                found[i] = u
                break
    return found


def _records(path: Path, size: int) -> Iterator[bytes]:
    """Yield the records with a size of `size` bytes of an unformatted Fortran file, up to the first invalid record."""
    if not path.exists():
        return
    with path.open("rb") as file:
        while len(head := file.read(4)) == 4:
            length = int.from_bytes(head, "little", signed=True)
            if length < 0:  # of records in several parts, beyond 2 GB
                return
            whole = file.read(size) if length == size else b""
            file.seek(length - len(whole), 1)
            if file.read(4) != head:
                return
            if length == size:
                yield whole
