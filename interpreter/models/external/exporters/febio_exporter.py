"""Export of an input deck for FEBio 4 (.feb, specification 4.0); the deck was never run in FEBio here.

Units are mm, Pa and uN (g, mm, s), because FEBio treats a residual below 1e-20 as zero. State k of a problem is at time
k. Lists have commas between numbers; a table of nodal values has the order of the nodes in their set. Displacements are
written to `u.csv`, in mm, in one block for each time step.
Source: FEBio User Manual 4, "Free format input"; laws as in FEBioMech/FENeoHookean.cpp and FEIsotropicElastic.cpp.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import make_visible

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import ExternalMaterial, Floats, Ints, Problem

FILE = "model.feb"
MM, UN = 1e3, 1e6  # its units in a metre and in a newton
STEPS = 10  # number of load steps to each state
LAWS = {"neo_hookean": "neo-Hookean", "st_venant_kirchhoff": "isotropic elastic"}  # laws with equal energies
ELEMENTS = ("tet4", "hex8")
AXES = "xyz"


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return features of a problem that FEBio does not have, or defines differently."""
    found = []
    if problem.element not in ELEMENTS:
        found.append((problem.element, f"its quadrature may differ; tested elements are {', '.join(ELEMENTS)}"))
    if problem.strain == "small":
        found.append(("strain = small", "its solid elements always use finite strain"))
        return found
    for stuff in problem.stuff:
        if stuff.law not in LAWS:
            found.append(
                (
                    stuff.law,
                    f"of the laws of softmark it has {', '.join(LAWS)}; its other laws use three-field elements",
                )
            )
    return found


def export(problem: Problem, named: NamedParts, folder: Path) -> list[str]:
    """Write the deck with a node set for each support. Return the file names."""
    (folder / FILE).write_text("\n".join([*deck(problem, named), ""]), encoding="ascii")
    return [FILE]


def deck(problem: Problem, named: NamedParts) -> Iterator[str]:
    """Yield the lines of the FEBio input deck."""
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
    yield from ("<Output>", "<logfile>", '<node_data data="ux;uy;uz" delim="," file="u.csv"/>', "</logfile>")
    yield from ('<plotfile type="febio">', '<var type="displacement"/>', "</plotfile>", "</Output>", "</febio_spec>")


def _block(name: str, lines: Iterator[str] | Sequence[str]) -> Iterator[str]:
    """Yield lines enclosed in an XML element; nothing if there are no lines."""
    if inner := list(lines):
        yield from (f"<{name}>", *inner, f"</{name}>")


def _control(problem: Problem) -> Iterator[str]:
    """Yield the `Control` element: analysis type, time steps and solver parameters."""
    yield from ("<Control>", "<analysis>STATIC</analysis>", f"<time_steps>{STEPS * len(problem.shares)}</time_steps>")
    yield from (f"<step_size>{1 / STEPS:g}</step_size>", '<solver type="solid">')
    yield from ("<dtol>1e-9</dtol>", "<etol>0</etol>", "<rtol>0</rtol>")  # of the last step; nothing of the others
    yield from ("<max_refs>50</max_refs>", '<qn_method type="BFGS">', "<max_ups>0</max_ups>", "</qn_method>")
    yield from ("</solver>", "</Control>")


def _material(number: int, stuff: ExternalMaterial) -> str:
    """Return the FEBio XML element `material` with this number."""
    constants = f"<E>{stuff.constants['young']!r}</E><v>{stuff.constants['poisson']!r}</v>"
    density = f"<density>{1e-6 * (stuff.density or 0.0)!r}</density>"  # g/mm^3
    return f'<material id="{number}" name="M{number}" type="{LAWS[stuff.law]}">{density}{constants}</material>'


def _mesh(problem: Problem, named: NamedParts) -> Iterator[str]:
    """Yield the `Mesh` element: nodes, elements and node sets."""
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
        plain = re.sub(r"[^A-Za-z0-9]", "_", make_visible(name))
        yield f'<NodeSet name="S{i}_{plain}">{_row((nodes + 1).tolist())}</NodeSet>'


def _row(values: Sequence[float]) -> str:
    """Return numbers separated by commas, with all digits."""
    return ",".join(map(repr, values))


def _sets(problem: Problem) -> dict[str, Ints]:
    """Return the non-empty sets of nodes, by name: held in each direction, moved, and loaded."""
    found = {}
    for c in range(3):
        own = problem.held[:, 1] == c
        found[f"held_{AXES[c]}"] = problem.held[own & (problem.values == 0.0), 0]
        found[f"moved_{AXES[c]}"] = problem.held[own & (problem.values != 0.0), 0]
    found["loaded"] = np.flatnonzero(problem.forces.any(axis=1))
    return {name: nodes for name, nodes in found.items() if len(nodes)}


def _tables(problem: Problem) -> Iterator[str]:
    """Yield the tables of nodal forces and imposed displacements, in the order of nodes in their sets."""
    for name, nodes in _sets(problem).items():
        if name == "loaded":
            yield from _table("forces", name, "vec3", UN * problem.forces[nodes])
        elif name.startswith("moved"):
            own = (problem.held[:, 1] == AXES.index(name[-1])) & (problem.values != 0.0)
            yield from _table(name, name, "scalar", MM * problem.values[own][:, None])


def _table(name: str, nodes: str, kind: str, rows: Floats) -> Iterator[str]:
    """Yield one table of nodal values (k,) or (k, 3) for a node set."""
    yield f'<NodeData name="{name}" node_set="{nodes}" data_type="{kind}">'
    yield from (f'<node lid="{i}">{_row(own)}</node>' for i, own in enumerate(rows.tolist(), start=1))
    yield "</NodeData>"


def _boundary(problem: Problem) -> Iterator[str]:
    """Yield the boundary conditions: fixed and moved nodes."""
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
    """Yield the load curve, which has the load fraction of state k at time k."""
    yield from ('<load_controller id="1" name="course" type="loadcurve">', "<interpolate>LINEAR</interpolate>")
    yield from ("<points>", *(f"<pt>{k},{s!r}</pt>" for k, s in enumerate((0.0, *shares))), "</points>")
    yield "</load_controller>"
