"""Export of a problem as VTU, in m and N, with loads and constraints as nodal fields."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import meshio
import numpy as np

from softmark.solvers.elements import element_of

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import Problem

FILE = "problem.vtu"
# which meshio 5 writes, and has left out of this table of its own
meshio._mesh.topological_dimension.setdefault("wedge15", 3)


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return no unsupported features, because the format does not contain material laws."""
    return []


def export(problem: Problem, named: NamedParts, folder: Path) -> list[str]:
    """Write the mesh with nodal fields. Return the file names.

    The fields are `forces`, N, in total and for each load; `held`, 1 or 0 in each direction; and imposed `values`,
    m.
    """
    held, values = np.zeros_like(problem.points), np.zeros_like(problem.points)
    held[tuple(problem.held.T)] = 1.0
    values[tuple(problem.held.T)] = problem.values
    fields = {"forces": problem.forces, "held": held, "values": values}
    fields |= {f"force_{name}": f for name, f in named.loads.items()}
    for name, nodes in named.supports.items():
        fields[f"support_{name}"] = np.bincount(nodes, minlength=len(problem.points)).astype(np.float64)
    material = np.zeros(len(problem.cells))
    for number, stuff in enumerate(problem.stuff):
        material[stuff.cells] = number
    kind = element_of(problem.element).meshio
    mesh = meshio.Mesh(problem.points, [(kind, problem.cells)], fields, {"material": [material]})
    mesh.write(folder / FILE)
    return [FILE]
