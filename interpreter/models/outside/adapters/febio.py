"""FEBio 4 (`febio4`, .feb of specification 4.0): a deck that was never run here, and its answer.

In mm, Pa and uN (g, mm, s), for a residual below 1e-20 is nothing to it. State k of a problem is at time k. Its lists
have commas between their numbers; a table of nodes goes by the place of a node in its set. Displacements come out as
`u.csv`, in mm with 12 digits, a block for each step of time.
Source: FEBio User Manual 4, "Free format input"; laws as in FEBioMech/FENeoHookean.cpp and FEIsotropicElastic.cpp;
what it writes as in FECore/DataRecord.cpp and FEBioLib/FEBioModel.cpp.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import visible
from softmark.interpreter.models.outside.adapters import PROGRAMS, on_path
from softmark.interpreter.models.outside.problem import Answer, NoAnswer, NotSettled

if TYPE_CHECKING:
    from softmark.interpreter.models.outside.decks.named import Named
    from softmark.interpreter.models.outside.problem import Floats, Ints, Problem, Stuff

title = PROGRAMS["febio"].title
program = "febio4"
install = "put `febio4` of FEBio 4 on the PATH (febio.org): no package of Debian or Python has it"

FILE, TABLE = "model.feb", "u.csv"
DIGITS = 5e-12  # of a number: half of the last of 12
MM, UN = 1e3, 1e6  # its units in a metre and in a newton
STEPS = 10  # of the load, to each state
LAWS = {"neo_hookean": "neo-Hookean", "st_venant_kirchhoff": "isotropic elastic"}  # both have these energies there
ELEMENTS = ("tet4", "hex8")
AXES = "xyz"


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """What of a problem it does not have, or not as it is meant."""
    found = []
    if problem.element not in ELEMENTS:
        found.append((problem.element, f"its quadrature may be another; tried are {', '.join(ELEMENTS)}"))
    if problem.strain == "small":
        found.append(("strain = small", "its solids are always of finite strain"))
        return found
    for stuff in problem.stuff:
        if stuff.law not in LAWS:
            found.append((stuff.law, f"of ours it has {', '.join(LAWS)}; others are of three fields there"))
    return found


def write_named(problem: Problem, named: Named, folder: Path) -> None:
    """Its input."""
    export(problem, named, folder)


def export(problem: Problem, named: Named, folder: Path) -> list[str]:
    """The deck, with sets of nodes that have the names of supports."""
    (folder / FILE).write_text("\n".join([*deck(problem, named), ""]), encoding="ascii")
    return [FILE]


def deck(problem: Problem, named: Named) -> Iterator[str]:
    """Its lines."""
    yield '<?xml version="1.0" encoding="ISO-8859-1"?>'
    yield "<!-- units: mm, Pa, uN (g, mm, s) -->"
    yield from ('<febio_spec version="4.0">', '<Module type="solid"/>')
    yield from _control(problem)
    yield from _block("Material", (_material(i, own) for i, own in enumerate(problem.stuff, start=1)))
    yield from _block("Mesh", _mesh(problem, named))
    parts = range(1, len(problem.stuff) + 1)
    yield from _block("MeshDomains", (f'<SolidDomain name="PART{i}" mat="M{i}"/>' for i in parts))
    yield from _block("MeshData", _tables(problem))
    yield from _block("Boundary", _boundary(problem))
    if np.any(problem.forces):
        load = '<nodal_load name="load" type="nodal_force" node_set="loaded">'
        yield from _block("Loads", (load, '<value lc="1" type="map">forces</value>', "</nodal_load>"))
    yield from _block("LoadData", _course(problem.shares))
    yield from ("<Output>", "<logfile>", f'<node_data data="ux;uy;uz" delim="," file="{TABLE}"/>', "</logfile>")
    yield from ('<plotfile type="febio">', '<var type="displacement"/>', "</plotfile>", "</Output>", "</febio_spec>")


def _block(name: str, lines: Iterator[str] | Sequence[str]) -> Iterator[str]:
    """Lines in an element; nothing of none."""
    if inner := list(lines):
        yield from (f"<{name}>", *inner, f"</{name}>")


def _control(problem: Problem) -> Iterator[str]:
    yield from ("<Control>", "<analysis>STATIC</analysis>", f"<time_steps>{STEPS * len(problem.shares)}</time_steps>")
    yield from (f"<step_size>{1 / STEPS:g}</step_size>", '<solver type="solid">')
    yield from ("<dtol>1e-9</dtol>", "<etol>0</etol>", "<rtol>0</rtol>")  # of the last step; nothing of the others
    yield from ("<max_refs>50</max_refs>", '<qn_method type="BFGS">', "<max_ups>0</max_ups>", "</qn_method>")
    yield from ("</solver>", "</Control>")


def _material(number: int, stuff: Stuff) -> str:
    constants = f"<E>{stuff.constants['young']!r}</E><v>{stuff.constants['poisson']!r}</v>"
    density = f"<density>{1e-6 * (stuff.density or 0.0)!r}</density>"  # g/mm^3
    return f'<material id="{number}" name="M{number}" type="{LAWS[stuff.law]}">{density}{constants}</material>'


def _mesh(problem: Problem, named: Named) -> Iterator[str]:
    yield '<Nodes name="all">'
    for i, p in enumerate((MM * problem.points).tolist(), start=1):
        yield f'<node id="{i}">{_row(p)}</node>'
    yield "</Nodes>"
    for number, stuff in enumerate(problem.stuff, start=1):
        yield f'<Elements type="{problem.element}" name="PART{number}">'
        for own, cell in zip((stuff.cells + 1).tolist(), (problem.cells[stuff.cells] + 1).tolist(), strict=True):
            yield f'<elem id="{own}">{_row(cell)}</elem>'
        yield "</Elements>"
    for name, nodes in _sets(problem).items():
        yield f'<NodeSet name="{name}">{_row((nodes + 1).tolist())}</NodeSet>'
    for i, (name, nodes) in enumerate(named.supports.items(), start=1):
        plain = re.sub(r"[^A-Za-z0-9]", "_", visible(name))
        yield f'<NodeSet name="S{i}_{plain}">{_row((nodes + 1).tolist())}</NodeSet>'


def _row(values: Sequence[float]) -> str:
    return ",".join(map(repr, values))


def _sets(problem: Problem) -> dict[str, Ints]:
    """Nodes that are held in each direction, moved, and loaded; none that are empty."""
    found = {}
    for c in range(3):
        own = problem.held[:, 1] == c
        found[f"held_{AXES[c]}"] = problem.held[own & (problem.values == 0.0), 0]
        found[f"moved_{AXES[c]}"] = problem.held[own & (problem.values != 0.0), 0]
    found["loaded"] = np.flatnonzero(problem.forces.any(axis=1))
    return {name: nodes for name, nodes in found.items() if len(nodes)}


def _tables(problem: Problem) -> Iterator[str]:
    """Forces, and displacements of what is moved, by the place of nodes in their sets."""
    for name, nodes in _sets(problem).items():
        if name == "loaded":
            yield from _table("forces", name, "vec3", UN * problem.forces[nodes])
        elif name.startswith("moved"):
            own = (problem.held[:, 1] == AXES.index(name[-1])) & (problem.values != 0.0)
            yield from _table(name, name, "scalar", MM * problem.values[own][:, None])


def _table(name: str, nodes: str, kind: str, rows: Floats) -> Iterator[str]:
    yield f'<NodeData name="{name}" node_set="{nodes}" data_type="{kind}">'
    yield from (f'<node lid="{i}">{_row(own)}</node>' for i, own in enumerate(rows.tolist(), start=1))
    yield "</NodeData>"


def _boundary(problem: Problem) -> Iterator[str]:
    for name in _sets(problem):
        kind, _, axis = name.partition("_")
        if kind == "held":
            yield f'<bc name="{name}" type="zero displacement" node_set="{name}">'
            yield from (f"<{c}_dof>{int(c == axis)}</{c}_dof>" for c in AXES)
            yield "</bc>"
        elif kind == "moved":
            yield f'<bc name="{name}" type="prescribed displacement" node_set="{name}">'
            yield from (f"<dof>{axis}</dof>", f'<value lc="1" type="map">{name}</value>', "<relative>0</relative>")
            yield "</bc>"


def _course(shares: Sequence[float]) -> Iterator[str]:
    """The share of the load at time k is that of state k."""
    yield from ('<load_controller id="1" name="course" type="loadcurve">', "<interpolate>LINEAR</interpolate>")
    yield from ("<points>", *(f"<pt>{k},{s!r}</pt>" for k, s in enumerate((0.0, *shares))), "</points>")
    yield "</load_controller>"


# ------------------------------------------------------------------ running and reading


def version() -> str | None:
    """That of the banner that it begins with; None where it is not on the PATH."""
    return on_path.version(program, ("-info",), r"[Vv]ersion\s+(\d[\w.]*)")


def places() -> tuple[Path, ...]:
    """The file that is run."""
    return on_path.places(program)


def command(folder: Path) -> list[str]:
    """What is run in the folder."""
    return [program, "-i", FILE]


def read(folder: Path) -> Answer:
    """What it has left in a folder. Raises NoAnswer, NotSettled."""
    log, told = on_path.log(folder), on_path.text(folder / FILE)
    said = on_path.lines(log, r"(?i)^[\s*]*(error|warning|fatal)\b|negative jacobian|diverg|failed to converge")
    if "E R R O R   T E R M I N A T I O N" in log:
        raise NotSettled(f"it ended by error{': ' if said else ''}{said}")
    count, asked = told.count("<node id="), told.count("<pt>") - 1
    tables = dict(_tables_of(on_path.text(folder / TABLE)))
    if missing := [k for k in range(1, asked + 1) if k not in tables]:
        raise NoAnswer(f"{TABLE} has nothing of state {missing[0]} of {asked}{': ' if said else ''}{said}")
    u = [tables[k] for k in range(1, asked + 1)]
    if short := [len(own) for own in u if len(own) != count]:
        raise NoAnswer(f"{TABLE} has displacements of {short[0]} nodes, of {count}")
    iterations = re.search(r"Total number of equilibrium iterations[ .]*:\s*(\d+)", log)
    spent = re.search(r"Total elapsed time[ .]*:[^(\n]*\(([0-9.eE+-]+) sec", log)
    settled = True if "N O R M A L   T E R M I N A T I O N" in log else None
    clocks = {"whole_s": float(spent[1])} if spent else {}
    return Answer(np.array(u) / MM, settled, int(iterations[1]) if iterations else None, clocks, said, DIGITS)


def _tables_of(told: str) -> Iterator[tuple[int, Floats]]:
    """Displacements (n, 3), mm, at whole times, which are those of states. Raises NoAnswer."""
    for block in re.split(r"^\*Step[^\n]*\n", told, flags=re.M)[1:]:
        time = re.search(r"^\*Time\s*=\s*(\S+)", block, flags=re.M)
        rows = [line.split(",") for line in block.splitlines() if line.strip() and not line.startswith("*")]
        try:
            at, table = float(time[1] if time else ""), np.array(rows, dtype=np.float64)
        except ValueError as error:
            raise NoAnswer(f"{TABLE} holds what is no table of displacements") from error
        if table.ndim != 2 or table.shape[1] != 4 or (table[:, 0] != np.arange(1, len(table) + 1)).any():
            raise NoAnswer(f"{TABLE} does not have the displacements of all nodes in turn")
        if abs(at - round(at)) < 0.01 / STEPS:
            yield round(at), table[:, 1:]
