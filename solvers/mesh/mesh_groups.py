"""Operations on named groups of a mesh (cells, boundary faces, nodes), which survive splitting and refinement.

Faces are stored as a cell and the number of its side, and nodes as a cell and the node's number in the cell. These do
not change when nodes are renumbered or added.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from softmark.solvers.mesh.mesh import Ints, Mesh, _row_keys
from softmark.solvers.mesh.mesh_group import Group, Groups

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Element
    from softmark.solvers.mesh.mesh import Floats

    Bools = NDArray[np.bool_]

ON = 1e-9  # in local coordinates: tolerance of points on a side


def cells_in(mesh: Mesh, name: str) -> Bools:
    """Return a mask (m,) of the cells in the group `name`; all False for a group of faces or nodes."""
    group, found = (mesh.groups or {})[name], np.zeros(len(mesh.cells), dtype=np.bool_)
    if group.kind == "cells":
        found[group.members] = True
    return found


def facets_in(mesh: Mesh, name: str) -> Bools:
    """Return a mask (f,) of the boundary facets in the group `name`; all False for a group of nodes.

    For a group of cells these are the facets of its cells.
    """
    group = (mesh.groups or {})[name]
    if group.kind == "cells":
        return cells_in(mesh, name)[mesh.facet_cells]
    if group.kind == "nodes":
        return np.zeros(len(mesh.facets), dtype=np.bool_)
    return known_row_mask(
        _face_corners(mesh, group.members), np.sort(mesh.facets[:, : mesh.element.facet.corners], axis=1)
    )


def nodes_in(mesh: Mesh, name: str) -> Bools:
    """Return a mask (n,) of the nodes in the group `name`, including all nodes of its cells or faces."""
    group, found = (mesh.groups or {})[name], np.zeros(len(mesh.points), dtype=np.bool_)
    if group.kind == "cells":
        found[mesh.cells[group.members]] = True
    elif group.kind == "nodes":
        found[_nodes_of_group(mesh, group)] = True
    else:
        cell, side = group.members.T
        found[mesh.cells[cell[:, None], np.array(mesh.element.facets)[side]]] = True
    return found


def _nodes_of_group(mesh: Mesh, group: Group) -> Ints:
    """Return the nodes (k,) of a group of nodes.

    Members with a node number that the cells of this mesh do not have, such as midside nodes, are left out.
    """
    cell, local = group.members.T
    known = local < mesh.cells.shape[1]
    found: Ints = mesh.cells[cell[known], local[known]]
    return found


def nodes_as_members(cells: Ints, nodes: Ints) -> Ints:
    """Return nodes as members of a group: a cell that contains the node and its number there, shape (k, 2).

    `cells` (m, a) are the nodes of cells. Nodes of no cell are left out.
    """
    own, first = np.unique(cells.ravel(), return_index=True)
    place = np.minimum(np.searchsorted(own, nodes), len(own) - 1)
    known = first[place[own[place] == nodes]]
    return np.stack(np.divmod(known, cells.shape[1]), axis=1).astype(np.int64)


def group_cell_mask(mesh: Mesh, name: str, nodes: Ints) -> Bools:
    """Return a mask (n,) of the cells, given by their nodes in order (n, a), that belong to the group `name`."""
    return known_row_mask(mesh.cells[cells_in(mesh, name)], nodes)


def _face_corners(mesh: Mesh, members: Ints) -> Ints:
    """Return the corner nodes of faces `members` (k, 2), sorted by number, shape (k, c)."""
    cell, side = members.T
    sides = np.array(mesh.element.facets)[:, : mesh.element.facet.corners]
    found: Ints = np.sort(mesh.cells[cell[:, None], sides[side]], axis=1)
    return found


def known_row_mask(known: Ints, rows: Ints) -> Bools:
    """Return a mask (f,) of the rows of integers (f, c) that occur among the rows `known` (k, c)."""
    keys = _row_keys(np.concatenate([known, rows]))
    return np.isin(keys[len(known) :], keys[: len(known)])


def find_faces_by_corners(cells: Ints, element: type[Element], corners: Ints) -> tuple[Ints, int]:
    """Return the faces (k, 2) of cells (m, a) that have given corners (f, c), in any order.

    Return also the number of corner rows that belong to no face.
    """
    sides = np.array(element.facets)[:, : element.facet.corners]
    if not len(corners) or corners.shape[1] != sides.shape[1]:
        return np.zeros((0, 2), dtype=np.int64), len(corners)
    rows = np.unique(np.sort(corners, axis=1), axis=0)
    candidates = np.sort(cells[:, sides].reshape(-1, sides.shape[1]), axis=1)
    keys = _row_keys(np.concatenate([candidates, rows]))
    own, wanted = keys[: len(candidates)], keys[len(candidates) :]
    order = np.argsort(own, kind="stable")
    place = np.minimum(np.searchsorted(own[order], wanted), len(own) - 1)
    there = own[order][place] == wanted
    found = order[place[there]]
    return np.stack(np.divmod(found, len(sides)), axis=1).astype(np.int64), int((~there).sum())


def reorder_faces(faces: Ints, which: Bools, element: type[Element]) -> Ints:
    """Return faces (k, 2) with side numbers updated after nodes of some cells were reordered.

    `which` (m,) marks the cells whose nodes now have the order `element.mirrored_nodes`.
    """
    now = np.argsort(np.array(element.mirrored_nodes))  # new position of each node
    corners = element.facet.corners
    sides = [frozenset(side[:corners]) for side in element.facets]
    table = np.array([sides.index(frozenset(now[list(side[:corners])].tolist())) for side in element.facets])
    cell, side = faces.T
    return np.stack([cell, np.where(which[cell], table[side], side)], axis=1)


def reorder_nodes(nodes: Ints, which: Bools, element: type[Element]) -> Ints:
    """Return nodes (k, 2), each as cell and node number, updated after nodes of some cells were reordered.

    `which` (m,) marks the cells whose nodes now have the order `element.mirrored_nodes`.
    """
    now = np.argsort(np.array(element.mirrored_nodes))
    cell, local = nodes.T
    return np.stack([cell, np.where(which[cell], now[local], local)], axis=1)


# ------------------------------------------------------------------ groups of split and refined meshes


def transfer_groups_to_split(mesh: Mesh, new: Mesh) -> Mesh:
    """Return the mesh `new`, made by splitting the hexahedra of `mesh`, with the groups of `mesh`.

    Each hexahedron has equally many cells in `new`, in the order of the hexahedra.
    """
    if not mesh.groups:
        return new
    each = len(new.cells) // len(mesh.cells)
    triangles = np.array(new.element.facets)[:, :3]

    def carried(group: Group) -> Group:
        if group.kind == "cells":
            return replace(group, members=_children_of_cells(group.members, each))
        if group.kind == "nodes":
            return replace(group, members=nodes_as_members(new.cells, np.unique(_nodes_of_group(mesh, group))))
        quads = _face_corners(mesh, group.members)  # (k, 4)
        children = _children_of_cells(group.members[:, 0], each).reshape(-1, each)
        sides = new.cells[children][:, :, triangles]  # (k, each, 4, 3)
        on = (sides[..., None] == quads[:, None, None, None]).any(axis=-1).all(axis=-1)
        face, child, side = np.nonzero(on)
        return replace(group, members=np.stack([children[face, child], side], axis=1))

    return replace(new, groups={name: carried(group) for name, group in mesh.groups.items()})


def refine_groups(mesh: Mesh, new: type[Element], corners: Floats) -> Groups | None:
    """Return the groups of a mesh after each cell is refined into several cells of the element `new`.

    `corners` (c, a, 3) are the local points of the nodes of the c new cells.
    """
    if not mesh.groups:
        return None
    sides = corners[:, np.array(new.facets)[:, : new.facet.corners]]  # (c, t, k, 3)
    places = mesh.element.places()[np.array(mesh.element.facets)[:, :3]]  # (s, 3, 3)
    normal = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
    off = np.einsum("ctki,si->sctk", sides, normal) - np.einsum("si,si->s", places[:, 0], normal)[:, None, None, None]
    on = (np.abs(off) < ON).all(axis=-1)  # (s, c, t)
    far: Floats = np.abs(mesh.element.places()[:, None, None] - corners).max(axis=-1)  # (a, c, b)
    # for each node a child that contains it, and its number there
    children = np.array([(np.argwhere(one < ON).tolist() or [[-1, -1]])[0] for one in far])

    def carried(group: Group) -> Group:
        if group.kind == "cells":
            return replace(group, members=_children_of_cells(group.members, len(corners)))
        if group.kind == "nodes":
            cell, local = group.members.T
            there = children[local, 0] >= 0
            cell, (child, own) = cell[there], children[local[there]].T
            return replace(group, members=np.stack([len(corners) * cell + child, own], axis=1))
        cell, side = group.members.T
        face, child, own = np.nonzero(on[side])
        return replace(group, members=np.stack([len(corners) * cell[face] + child, own], axis=1))

    return {name: carried(group) for name, group in mesh.groups.items()}


def _children_of_cells(cells: Ints, each: int) -> Ints:
    found: Ints = (each * cells[:, None] + np.arange(each)).ravel()
    return found
