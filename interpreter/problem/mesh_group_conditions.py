"""Conditions with named groups of a mesh file, which are split into conditions on coordinates.

There is one condition for each combination of groups. Conditions without groups stay unchanged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Remedy, did_you_mean
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.body_case import Fault, fault
from softmark.interpreter.problem.data_sets import download_shape
from softmark.solvers.elements.tet4 import Tet4

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.mesh import Floats, Mesh

    Mask = NDArray[np.bool_]
    Members = Callable[[str], Mask]

LISTED = 20  # groups of a file that a message names


def split_by_groups(condition: Condition, members: Members) -> Iterator[tuple[Condition, Any]]:
    """Yield conditions on coordinates, each with the items to which it applies.

    `members` returns a mask of the items in a group. A condition without groups applies to all items; otherwise there
    is one condition for each combination of groups.
    """
    if not condition.groups:
        yield condition, slice(None)
        return
    known = np.stack([members(name) for name in condition.groups], axis=1)  # (n, g)
    patterns, which = np.unique(known, axis=0, return_inverse=True)
    for i, pattern in enumerate(patterns.tolist()):
        yield condition.with_group_membership(dict(zip(condition.groups, pattern, strict=True))), which.ravel() == i


def cell_membership(mesh: Mesh) -> Members:
    """Return a function that gives the mask of cells in a named group (m,)."""
    return partial(_group_mask, "cells_in", mesh)


def facet_membership(mesh: Mesh) -> Members:
    """Return a function that gives the mask of boundary facets in a named group (f,).

    For a group of cells, these are the boundary facets of its cells.
    """
    return partial(_group_mask, "facets_in", mesh)


def node_membership(mesh: Mesh) -> Members:
    """Return a function that gives the mask of nodes in a named group (n,): the nodes of its cells or facets."""
    return partial(_group_mask, "nodes_in", mesh)


def point_membership(case: Case, X: Floats) -> Members:
    """Return a function that gives the mask of points X (n, 3), m, in the cells of a named group (n,)."""
    if not case.groups:
        return lambda name: np.zeros(len(X), dtype=np.bool_)
    from softmark.solvers.mesh.element_interpolation import locate_points
    from softmark.solvers.mesh.mesh_groups import group_cell_mask

    mesh = download_shape(case.shape, case.shape_location).mesh_with_groups(Tet4.name)
    nodes = locate_points(mesh, X).nodes
    return lambda name: group_cell_mask(mesh, name, nodes)


def _group_mask(of: str, mesh: Mesh, name: str) -> Mask:
    from softmark.solvers.mesh import mesh_groups  # no mesh without names needs it

    found: Mask = getattr(mesh_groups, of)(mesh, name)
    return found


# ------------------------------------------------------------------ checks


NAMELESS = (
    "the file has no groups: define physical groups of Gmsh, ELSET, NSET or SURFACE of Abaqus, or whole "
    "numbers on cells of VTU"
)


def check_mesh_groups(regions: Iterable[Declared], mesh: Mesh) -> None:
    """Refuse named groups that a mesh does not have or that are of the wrong kind. Raises Fault."""
    for region in regions:
        _require_group(region, mesh)
        _check_group_kind(region, mesh)


def _require_group(region: Declared, mesh: Mesh) -> None:
    known, name = mesh.groups or {}, region.thing.name
    if name in known:
        return
    listed = [f"`{n}` ({own.described})" for n, own in list(known.items())[:LISTED]]
    more = [f"and {len(known) - LISTED} more"] if len(known) > LISTED else []
    close = nearest(name, list(known))
    help: str | Remedy = NAMELESS
    if known:
        groups = f"groups of the file: {', '.join([*listed, *more])}"
        help = did_you_mean(close, f'"{close}"', f" {groups}") if close else groups
    problem = f"the mesh of `{region.thing.body}` has no group `{name}`"
    raise fault("E324", region.at("name"), problem, "not in the file", help)


def _check_group_kind(region: Declared, mesh: Mesh) -> None:
    own, name, at = (mesh.groups or {})[region.thing.name], region.thing.name, region.at("name")
    count = len(own.members) + own.foreign
    if not count:
        help = "write the mesh with something in this group, or remove the region"
        raise fault("E326", at, f"the group `{name}` is empty", "empty group", help)
    if own.kind != "cells" and region.thing.material is not None:
        problem = f"`{region.name}` is a group of {own.kind}, which cannot have a material"
        help = "use a group of cells for a material, or remove `material`"
        raise fault("E325", region.at("material"), problem, own.described, help)
    if own.foreign:
        what = "node" if own.kind == "nodes" else "face"
        problem = f"{own.foreign} of {count} members of the group `{name}` are not a {what} of a solid cell"
        help = (
            "write a group of faces of the mesh's own cells: shell elements and halves of hexahedron faces do not "
            "match these faces"
        )
        raise fault("E326", at, problem, own.described, help)
    if own.inside:
        problem = f"{own.inside} of {count} faces of the group `{name}` lie inside the body"
        help = "use faces of the surface, or the cells on one side: supports, loads and probes act on the surface"
        raise fault("E326", at, problem, own.described, help)


def group_of_points_fault(declared: Declared) -> Fault:
    """Return the Fault for a group condition in a declaration that selects points."""
    names = ", ".join(f"`{name}`" for name in declared.value("where").groups)
    problem = f"`{declared.name}` has single points, which {names} cannot select"
    help = "use a `surface` or a `volume`, or select by coordinates"
    return fault("E325", declared.at("where"), problem, "selects cells or faces", help)
