"""Comparison of the region that a support selects with the facets and cells spanned by the nodes that it holds.

A selection has a volume, an area on the surface, or a length along edges. For each of these, the fraction in
cells (facets, edges) with only held nodes is computed. It is exact for plane borders, straight cells and flat
facets. Curved borders are approximated by pieces much smaller than a cell.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Border, Condition
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.mesh_group_conditions import (
    cell_membership,
    facet_membership,
    node_membership,
    split_by_groups,
)
from softmark.interpreter.problem.surface_selection.selected_pieces import (
    Bools,
    crossed_simplices,
    cut_pieces,
    selected_points,
    slack_of,
    undecided_simplices,
)
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.simplex_clipping import Pieces

if TYPE_CHECKING:
    from softmark.interpreter.problem.mesh_group_conditions import Members
    from softmark.solvers.mesh.mesh import Mesh

SMALL = 1e-6  # of the body: a smaller volume or area of a selection counts as zero
ASIDE = 1e-3  # of the size of a face: distance at which the slope of a level function is evaluated
WHOLE = 1e-9  # rounding of a fraction
ALONG = 1e-6  # of an edge that begins on the border: rounding of its selected part
MISSED = 0.02  # of a selection: more than a polygon inscribed in a circle by a usual mesh misses


@dataclass(frozen=True)
class SupportSelection:
    """Nodes of a mesh that a support holds, and how well they represent its selection.

    `held` is the fraction of the selection that the nodes span. `beyond` is the measure that they span outside the
    selection, relative to the selection. `layer` is set only for a selection thinner than a cell: the fraction of
    the mesh that is selected, and the fraction that is held.
    """

    nodes: Bools  # (n,)
    wide: Bools  # (n,) nodes of all cells and facets that are partly selected
    held: float
    beyond: float
    layer: tuple[float, float] | None = None

    @property
    def missed(self) -> bool:
        """True if the held part differs noticeably from the selection."""
        return 1.0 - self.held > MISSED or self.beyond > MISSED


def select_support(condition: Condition, mesh: Mesh) -> SupportSelection:
    """Return the nodes of a mesh that a support with this condition holds, and how well they represent it.

    The result is cached in the mesh.
    """
    key = SupportSelection, condition
    if key not in mesh.selections:
        mesh.selections[key] = _select_support_nodes(condition, mesh)
    found: SupportSelection = mesh.selections[key]
    return found


def select_supports(case: Case, mesh: Mesh) -> dict[str, SupportSelection]:
    """Return the selections of all supports of a case on a mesh, by name of the support."""
    return {support.name: select_support(support.thing.where, mesh) for support in case.supports}


def support_selection_warnings(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Return warnings if the nodes that a support holds do not represent the region that it selects."""
    return tuple(
        _support_selection_warning(declared, name, own)
        for name, own in select_supports(case, mesh).items()
        if own.missed
    )


def _support_selection_warning(declared: Declared, name: str, own: SupportSelection) -> Diagnostic:
    """Return the warning about one support whose held nodes differ from its selection."""
    at = declared.at("size" if declared.thing.own_mesh is None else "mesh")
    if own.layer is not None:
        asked, held = own.layer
        return diagnostic(
            "W375",
            at,
            f"`{name}` selects a layer thinner than the cells of `{declared.name}`: {_percent(asked)} of the mesh is "
            f"selected, {_percent(held) if held else 'no whole cell'} is held",
            "cells with only held nodes cannot deform",
            "select only the surface, or use cells as thin as the layer; `--stated` reports the effect",
        )
    less = f"{_percent(own.held) if own.held else 'none'} of its selection"
    parts = [less] if own.held < 1 - MISSED else []
    parts += [f"{_percent(own.beyond)} more than its selection"] if own.beyond > MISSED else []
    return diagnostic(
        "W375",
        at,
        f"on the mesh of `{declared.name}`, the support `{name}` holds {' and '.join(parts)}",
        "the selection ends inside facets or cells",
        "use a finer mesh, or one with nodes along the border of the selection; `--stated` reports the effect",
    )


def _percent(share: float) -> str:
    """Return a positive fraction as a percentage in text, with three digits or more and no exponent: `0.0031 %`."""
    percent = 100.0 * share
    text = f"{percent:.{max(0, 2 - math.floor(math.log10(percent)))}f}"
    return f"{text.rstrip('0').rstrip('.') if '.' in text else text} %"


# ------------------------------------------------------------------ of a mesh


@dataclass(frozen=True)
class _MeshEntities:
    """Cells, facets or edges of a mesh, for measuring which part of them a condition selects.

    `nodes` (m, k) are the nodes of each entity, `sizes` (m,) the volume, area or length, and `simplices` (m, s,
    c) the simplices into which it is split. The function `members` returns a mask of the entities in a named
    group.
    """

    nodes: Ints
    sizes: Floats
    simplices: Ints
    members: Members
    rings: bool = False  # around the y axis: every piece is weighted by its radius

    def sizes_of(self, pieces: Pieces) -> Floats:
        """Return the volumes, areas or lengths (p,) of pieces, weighted by radius for a body of revolution."""
        sizes: Floats = pieces.sizes * pieces.middles[:, 0] if self.rings else pieces.sizes
        return sizes


def _select_support_nodes(condition: Condition, mesh: Mesh) -> SupportSelection:
    """Return the nodes that a support with this condition holds, and how well they represent the selection."""
    nodes = np.zeros(len(mesh.points), dtype=np.bool_)
    for own, which in split_by_groups(condition, node_membership(mesh)):
        nodes[which] = selected_points(own, mesh.points[which], mesh.extent)
    wide = nodes.copy()
    volumes, areas = cells_of(mesh), _facets(mesh)
    looked = [(kind, selected_fractions(condition, kind, mesh)) for kind in (volumes, areas)]
    layer = _layer_fractions(*looked[0], nodes)
    if layer is not None and not layer[1] and looked[0][1].max() < MISSED < looked[1][1].max():
        looked, layer = looked[1:], None  # a selected surface, with a layer below it that is too thin to count
    for kind, f in looked:  # a selection without its border: nodes held inside are held up to the border
        nodes[_free_nodes_of_selected_cells(condition, kind.nodes[f >= 1.0 - WHOLE], nodes, mesh)] = True
    if not any(float(f @ kind.sizes) > SMALL * kind.sizes.sum() for kind, f in looked):
        edges = _edges(mesh)
        looked = [(edges, selected_fractions(condition, edges, mesh))]
    for kind, f in looked:
        wide[np.unique(kind.nodes[f > SMALL])] = True
    shares = [
        _spanned_fraction(kind, f, nodes) for kind, f in looked if float(f @ kind.sizes) > SMALL * kind.sizes.sum()
    ]
    held = min((held for held, _ in shares), default=1.0)
    return SupportSelection(
        nodes,
        wide | nodes,
        held,
        max((beyond for _, beyond in shares), default=0.0),
        layer,
    )


def _free_nodes_of_selected_cells(condition: Condition, whole: Ints, held: Bools, mesh: Mesh) -> Ints:
    """Return the nodes of wholly selected cells `whole` (c, k) that are not `held` but should be.

    A node counts only if its edges to held nodes are selected along their whole length. Volume fractions alone do
    not detect a corner outside the selection: it changes the fraction by the cube of its relative distance.
    """
    cell, corner = np.nonzero(~held[whole])
    own = whole[cell, corner]
    ends = np.stack([np.repeat(own, whole.shape[1]), whole[cell].ravel()], axis=1)
    ends = ends[held[ends[:, 1]]]
    if not len(ends):
        return own
    f = selected_fractions(condition, _lines(ends, mesh), mesh)
    return np.setdiff1d(own, ends[f < 1.0 - ALONG, 0])


def _layer_fractions(kind: _MeshEntities, f: Floats, nodes: Bools) -> tuple[float, float] | None:
    """Return the fractions of the mesh that are selected and held, for a selection that contains no whole cell.

    The result is None for other selections. f (m,) are the selected fractions of cells and `nodes` (n,) the held
    nodes.
    """
    total, spanned = float(kind.sizes.sum()), nodes[kind.nodes].all(axis=1) & (f > SMALL)
    share = float(f @ kind.sizes) / total
    thin = kind.nodes.shape[1] >= 4 and share > SMALL and f.max() < 1.0 - WHOLE
    return (share, float(kind.sizes[spanned].sum()) / total) if thin else None


def _spanned_fraction(kind: _MeshEntities, f: Floats, nodes: Bools) -> tuple[float, float]:
    """Return the fraction of a selection that held nodes span, and the fraction that they span beyond its border.

    f (m,) are the selected fractions of cells and `nodes` (n,) marks the held nodes.
    """
    chosen, spanned = f * kind.sizes, nodes[kind.nodes].all(axis=1)
    total = float(chosen.sum())
    held = float(chosen[spanned].sum()) / total
    crossed = spanned & (f > SMALL) & (f < 1.0 - WHOLE)
    beyond = float(((1.0 - f) * kind.sizes)[crossed].sum()) / total
    return (1.0 if held > 1.0 - WHOLE else held), beyond


def cells_of(mesh: Mesh, depth: float = 0.0) -> _MeshEntities:
    """Return the cells of a mesh; for a body of revolution with a slice of `depth`, m, as whole rings."""
    corners = mesh.cells[:, : mesh.element.corners]
    simplices = corners[:, np.array(mesh.element.tetrahedra)]
    sizes = mesh.volumes
    if depth:
        from softmark.solvers.energies.axisymmetric import circumference_in_slices

        parts = integrate_cells(mesh)
        sizes = (parts.w * circumference_in_slices(mesh.points[mesh.cells, 0] @ parts.N.T, depth)).sum(axis=1)
    return _MeshEntities(mesh.cells, sizes, simplices, cell_membership(mesh), depth > 0.0)


def _facets(mesh: Mesh) -> _MeshEntities:
    """Return the facets of the surface."""
    triangles = mesh.facets[:, np.array(mesh.element.facet.triangles)]  # (f, s, 3)
    whole = Pieces(mesh.points[triangles.reshape(-1, 3)], np.repeat(np.arange(len(triangles)), triangles.shape[1]))
    areas: Floats = np.bincount(whole.of, whole.sizes, minlength=len(triangles)).astype(np.float64)
    return _MeshEntities(mesh.facets, areas, triangles, facet_membership(mesh))


def _edges(mesh: Mesh) -> _MeshEntities:
    """Return the edges of the surface triangles, each once."""
    sides = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return _lines(np.unique(np.sort(sides, axis=1), axis=0), mesh)


def _lines(ends: Ints, mesh: Mesh) -> _MeshEntities:
    """Return the straight lines between pairs of nodes `ends` (m, 2) as entities of a mesh.

    A line belongs to a named group if both its ends do.
    """
    lengths = np.linalg.norm(mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]], axis=1)

    def members(name: str) -> Bools:
        """Return which lines belong to a named group."""
        return np.asarray(node_membership(mesh)(name)[ends].all(axis=1))

    return _MeshEntities(ends, lengths, ends[:, None, :], members)


# ------------------------------------------------------------------ fractions of cells


def selected_fractions(condition: Condition, kind: _MeshEntities, mesh: Mesh) -> Floats:
    """Return the fraction (m,), from 0 to 1, of each cell, facet or edge that a condition selects."""
    if condition.groups:
        known = np.zeros(len(kind.nodes))
        for alone, which in split_by_groups(condition, kind.members):
            part = replace(kind, nodes=kind.nodes[which], sizes=kind.sizes[which], simplices=kind.simplices[which])
            known[which] = selected_fractions(alone, part, mesh)
        return known
    number = np.repeat(np.arange(len(kind.nodes)), kind.simplices.shape[1])
    corners = kind.simplices.reshape(-1, kind.simplices.shape[2])
    crossed = np.zeros(len(kind.nodes), dtype=np.bool_)
    followed = _border_following_fractions(condition, kind, mesh)
    beside = np.arange(len(corners))
    if not all(border.plane for border in condition.borders):
        beside = np.flatnonzero(undecided_simplices(condition, mesh.points[corners], mesh.extent))
    for border in condition.borders:
        crossed[number[beside[crossed_simplices(border, mesh.points[corners[beside]], mesh.extent)]]] = True
    whole = Pieces(mesh.points[kind.simplices[:, 0]], np.arange(len(kind.nodes)))
    f = selected_points(condition, whole.middles, mesh.extent).astype(float)
    crossed &= np.isnan(followed)
    some = crossed[number]
    pieces = Pieces(mesh.points[corners[some]], number[some])
    for border in condition.borders:
        pieces = cut_pieces(pieces, border, mesh.extent)
    chosen = selected_points(condition, pieces.middles, mesh.extent)
    size, count = kind.sizes_of(pieces), len(kind.nodes)
    total = np.bincount(pieces.of, size, minlength=count)
    own = np.bincount(pieces.of[chosen], size[chosen], minlength=count)
    found: Floats = np.where(crossed & (total > 0.0), own / np.where(total > 0.0, total, 1.0), f)
    return np.where(np.isnan(followed), found, followed)


def _border_following_fractions(condition: Condition, kind: _MeshEntities, mesh: Mesh) -> Floats:
    """Return selected fractions (m,) of curved cells that have a whole face on the border; nan for other cells.

    The part of such a cell beyond the border is thin: its volume is the integral of its depth over the face.
    """
    found, element = np.full(len(kind.nodes), np.nan), mesh.element
    if len(condition.borders) != 1 or kind.nodes.shape[1] != element.nodes or element.nodes == element.corners:
        return found
    border, sides = condition.borders[0], np.array(element.facets)
    if border.plane is not None:
        return found
    level, slack = border.at(*mesh.points.T)[kind.nodes], slack_of(border, mesh.extent)
    on = (np.abs(level) <= slack)[:, sides].all(axis=2)  # (m, s)
    cells = np.flatnonzero(on.any(axis=1) & ((level.min(axis=1) >= -slack) | (level.max(axis=1) <= slack)))
    if len(cells):
        inside = selected_points(condition, mesh.points[kind.nodes[cells]].mean(axis=1), mesh.extent)
        at, side = np.nonzero(on[cells])
        faces = kind.nodes[cells[at][:, None], sides[side]]
        share = (
            np.bincount(at, _volume_beyond_border(border, mesh.points[faces], mesh), minlength=len(cells))
            / kind.sizes[cells]
        )
        found[cells] = np.where(inside, 1.0 - share, share)
    return found


def _volume_beyond_border(border: Border, faces: Floats, mesh: Mesh) -> Floats:
    """Return the volumes (f,), m^3, between cell faces and a border that lies on the inner side of the faces.

    `faces` (f, k, 3), m, are the nodes of faces whose normals point outward.
    """
    facet = mesh.element.facet
    xi, w = facet.quadrature()
    X = np.einsum("qk,fki->fqi", facet.shape(xi), faces)
    t = np.einsum("qkj,fki->jfqi", facet.gradient(xi), faces)
    n = np.cross(t[0], t[1])
    area = np.linalg.norm(n, axis=2)
    step = ASIDE * float(np.sqrt(area.max()))
    up, down = (border.at(*np.moveaxis(X + s * n / area[..., None], 2, 0)) for s in (step, -step))
    way = border.at(*np.moveaxis(X, 2, 0)) * 2.0 * step
    depth = np.divide(way, up - down, out=np.zeros_like(way), where=up != down)  # as high on both sides: |x| at x = 0
    volume: Floats = (np.maximum(depth, 0.0) * area) @ w
    return volume
