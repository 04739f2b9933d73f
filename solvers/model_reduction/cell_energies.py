"""Energies over cells, split into single cells or restricted to chosen cells with weights.

They are the dataclasses of `energies` whose fields `cells`, `dNdX`, `w`, `G` and `K` have one row for each cell, or
sums of such energies. Their field `X` has one row for each node.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from softmark.solvers.energies.elastic_energy import EnergySum, VaryingLaw
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.external_loads import FollowerPressure

BY_CELL = ("cells", "dNdX", "w", "G", "K", "pressures", "hoop", "dNpdX")
LAWS = ("law", "volume", "drag")  # whose constants may have a row for each cell
MODULI = ("bulk", "compliance")  # one for all cells, or a row for each
SHAPES = ("Np",)  # the same in all cells (q, b), or of each (m, q, b)
BY_NODE = ("X",)
WEIGHED = ("w", "K")  # fields that the energy of a cell is proportional to


def nodes_of_cells(energy: Energy) -> Ints:
    """Return the node numbers of each cell (m, a)."""
    if isinstance(energy, EnergySum):
        return nodes_of_cells(energy.parts[0])
    known: Any = energy
    cells: Ints = known.cells
    return cells


def disconnect_cells(energy: Energy) -> Energy:
    """Return the energy on disconnected cells that share no nodes: node b of cell e gets the number a e + b.

    a is the number of nodes of a cell.
    """
    if isinstance(energy, EnergySum):
        return EnergySum(tuple(disconnect_cells(part) for part in energy.parts))
    known: Any = energy
    own = np.arange(known.cells.size).reshape(known.cells.shape)
    moved = {name: rows[known.cells.ravel()] for name, rows in _existing_fields(energy, BY_NODE).items()}
    split: Energy = replace(known, cells=own, **moved)
    return split


def restrict_to_cells(energy: Energy, which: Ints, weights: Floats, nodes: Ints) -> Energy:
    """Return the energy of the cells `which`, each multiplied by its entry in `weights`.

    `nodes` are their node numbers in ascending order. Nodes are renumbered by their position in `nodes`.
    """
    if isinstance(energy, EnergySum):
        return EnergySum(tuple(restrict_to_cells(own, which, weights, nodes) for own in energy.parts))
    known: Any = energy
    rows = fields_of_cells(energy, which)
    for name in set(WEIGHED) & set(rows):
        rows[name] = rows[name] * weights.reshape(-1, *(1,) * (rows[name].ndim - 1))
    rows["cells"] = np.searchsorted(nodes, rows["cells"])
    rows |= {name: values[nodes] for name, values in _existing_fields(energy, BY_NODE).items()}
    fewer: Energy = replace(known, **rows)
    return fewer


def fields_of_cells(energy: Energy, which: Any) -> dict[str, Any]:
    """Return those fields of an energy that differ from cell to cell, restricted to the cells `which`.

    They include the material laws whose constants vary.
    """
    rows: dict[str, Any] = {n: np.ascontiguousarray(a[which]) for n, a in _existing_fields(energy, BY_CELL).items()}
    rows |= {n: law.of(which) for n, law in _existing_fields(energy, LAWS).items() if isinstance(law, VaryingLaw)}
    rows |= {n: a[which] for n, a in _existing_fields(energy, SHAPES).items() if np.ndim(a) == 3}
    return rows | {n: a[which] for n, a in _existing_fields(energy, MODULI).items() if np.ndim(a)}


def _existing_fields(energy: Energy, names: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields of the energy, by name, that are among `names` and are not None."""
    known: Any = energy
    each = ((f.name, getattr(known, f.name)) for f in fields(known) if f.name in names)
    return {name: value for name, value in each if value is not None}


def restrict_to_loaded_nodes(load: FollowerPressure) -> tuple[FollowerPressure, Ints]:
    """Return a follower pressure defined only on the nodes of its facets, and the numbers of these nodes."""
    nodes, faces = np.unique(load.faces, return_inverse=True)
    return replace(load, points=load.points[nodes], faces=faces.reshape(load.faces.shape)), nodes
