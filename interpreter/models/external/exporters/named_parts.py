"""Named parts of a scene for export: cells of materials, nodes of supports, and facets and forces of loads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.loaded_surface import surface_of
from softmark.interpreter.models.shared.support_constraints import selected_nodes
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.models.fem.fem_builder import PreparedSolid
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.mesh import Floats, Ints, Mesh


@dataclass(frozen=True)
class NamedParts:
    """Named parts of a scene: cells (k,) of materials, nodes (k,) of supports and forces (n, 3), N, of loads.

    `facets` (k, a) are, by name, the boundary facets with all nodes held by a support, or on which a load acts.
    """

    parts: Mapping[str, Ints]
    supports: Mapping[str, Ints]
    loads: Mapping[str, Floats]
    facets: Mapping[str, Ints]


def collect_named_parts(prepared: PreparedSolid, case: Case) -> NamedParts:
    """Return the named parts of a prepared model. Raises Fault."""
    mesh, every = prepared.mesh, np.arange(len(prepared.mesh.cells), dtype=np.int64)
    names = [case.body.name, *(part.name for part in case.parts)]
    parts = {names[own.number]: every[own.which] for own in prepared.pieces}
    supports = {s.name: np.flatnonzero(selected_nodes(case, s, mesh)) for s in case.named_supports}
    facets = {name: _enclosed_facets(mesh, nodes) for name, nodes in supports.items()}
    for load in case.loads:
        if (where := getattr(load.thing.action, "where", None)) is not None:
            facets[load.name] = np.unique(surface_of(case, load, where, mesh).selected_facets, axis=0)
    return NamedParts(parts, supports, {load.name: f for load, f in prepared.forces()}, facets)


def _enclosed_facets(mesh: Mesh, nodes: Ints) -> Ints:
    """Return the boundary facets all of whose nodes are among `nodes`."""
    inside = np.zeros(len(mesh.points), dtype=np.bool_)
    inside[nodes] = True
    found: Ints = mesh.facets[inside[mesh.facets].all(axis=1)]
    return found
