"""Reader of Gmsh meshes with physical groups; a scene uses the mesh file directly and supplies the materials."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from softmark.interpreter.importers.imported_deck import Deck, MaterialPart, NotImported
from softmark.references.measured_data import Unreadable
from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh, keep_node_order, parse
from softmark.solvers.mesh.files.mesh_reader import read_cells as read_mesh


def read(path: Path) -> Deck:
    """Read a mesh and its groups. Raises Unreadable."""
    try:
        mesh = read_mesh(str(path), 1.0, named=True)
        data = parse(path)
        own, names = keep_node_order(data, path, 1.0), getattr(data, "field_data", {})
    except UnreadableMesh as error:
        raise Unreadable(path.name, str(error), error.remedy or "export the mesh again") from None
    part = MaterialPart(path.stem, np.arange(len(mesh.cells)), None)
    found = Deck(path.name, own.kind, own.points, own.cells, [part], static=False, mesh=path)
    for name, (_, dimension) in names.items():
        if dimension < 2:
            found.left.append(
                NotImported(f"the group `{name}`", "it contains points or lines; only cells and faces are supported")
            )
    for name, group in (mesh.groups or {}).items():
        if group.kind == "faces" and (group.inside or group.foreign or not len(group.members)):
            found.left.append(NotImported(f"the group `{name}`", f"{group.described}: not only faces of the surface"))
        elif len(group.members):
            found.groups.append(name)
    return found
