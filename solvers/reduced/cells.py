"""Energies over cells, taken apart: every cell by itself, or a chosen part of the cells with weights.

What is taken apart are the dataclasses of `energies` whose fields `cells`, `dNdX`, `w`, `G` and `K` have a row for each
cell, or whose `parts` do; `X` has a row for each node.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.loads import FollowerPressure

BY_CELL = ("cells", "dNdX", "w", "G", "K", "pressures")
WEIGHED = ("w", "K")  # what the energy of a cell is proportional to


def cells_of(energy: Energy) -> Ints:
    """Nodes of each cell (m, a)."""
    known: Any = energy
    cells: Ints = cells_of(known.parts[0]) if hasattr(known, "parts") else known.cells
    return cells


def apart(energy: Energy) -> Energy:
    """The same energy where no two cells share a node: node b of cell e is e a + b."""
    known: Any = energy
    if hasattr(known, "parts"):
        whole: Energy = replace(known, parts=tuple(apart(part) for part in known.parts))
        return whole
    own = np.arange(known.cells.size).reshape(known.cells.shape)
    moved = {"X": known.X[known.cells.ravel()]} if hasattr(known, "X") else {}
    split: Energy = replace(known, cells=own, **moved)
    return split


def part(energy: Energy, which: Ints, weights: Floats, nodes: Ints) -> Energy:
    """The energy of the cells `which` times their weights; nodes are numbered as they stand in `nodes`, ascending."""
    known: Any = energy
    if hasattr(known, "parts"):
        parts = tuple(part(own, which, weights, nodes) for own in known.parts)
        whole: Energy = replace(known, parts=parts)
        return whole
    names = [f.name for f in fields(known) if f.name in BY_CELL]
    rows: dict[str, Any] = {name: np.ascontiguousarray(getattr(known, name)[which]) for name in names}
    for name in set(WEIGHED) & set(rows):
        rows[name] = rows[name] * weights.reshape(-1, *(1,) * (rows[name].ndim - 1))
    rows["cells"] = np.searchsorted(nodes, rows["cells"])
    if hasattr(known, "X"):
        rows["X"] = known.X[nodes]
    fewer: Energy = replace(known, **rows)
    return fewer


def pressed(load: FollowerPressure) -> tuple[FollowerPressure, Ints]:
    """A follower pressure over the nodes of its facets alone, and these nodes."""
    nodes, faces = np.unique(load.faces, return_inverse=True)
    return replace(load, points=load.points[nodes], faces=faces.reshape(load.faces.shape)), nodes
