"""What part of its selection a support holds on a mesh: nodes stand for the facets and cells that they span.

A selection has a volume, an area on the surface of the body, or else a length along its edges: of each the share is
taken that lies in cells (facets, edges) all of whose nodes are held. Exact for borders that are planes, on straight
cells and flat facets; curved ones are followed by pieces of a fraction of a cell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.conditions import RELATIVE_TOLERANCE, Border, Condition
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.problem.case import Case
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.mesh.clip import Pieces, joined

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh

Bools = np.ndarray[Any, np.dtype[np.bool_]]

SMALL = 1e-6  # of the body: a selection with less volume, or area, has none
WHOLE = 1e-9  # what rounding leaves of a share
MISSED = 0.02  # of a selection: a polygon with as many sides as a mesh has around a circle misses no more
HALVINGS = {2: 0, 3: 4, 4: 2}  # of the edges of pieces near a curved border, by the corners of a piece
GROUP = 16  # cells that are bounded together
SIX = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))  # of a hexahedron


@dataclass(frozen=True)
class Grip:
    """What a support holds of a mesh with n nodes.

    `held` is the share of the selection that its nodes span, `beyond` what they span beyond it, as a part of it. A
    selection that has no cell as a whole is a `layer` thinner than one: its part of the mesh, and that which is held.
    """

    nodes: Bools  # (n,)
    wide: Bools  # (n,) those of all cells and facets that the selection has a part of
    held: float
    beyond: float
    layer: tuple[float, float] | None = None

    @property
    def missed(self) -> bool:
        """Whether something else is held than was selected."""
        return 1.0 - self.held > MISSED or self.beyond > MISSED


def grip(condition: Condition, mesh: Mesh) -> Grip:
    """What a condition holds of a mesh; found once for each mesh."""
    key = Grip, condition
    if key not in mesh.selections:
        mesh.selections[key] = _found(condition, mesh)
    found: Grip = mesh.selections[key]
    return found


def grips(case: Case, mesh: Mesh) -> dict[str, Grip]:
    """Those of all supports of a case, by name."""
    return {support.name: grip(support.thing.where, mesh) for support in case.supports}


def held_notes(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Warnings where a mesh holds another part of the body than its supports select."""
    return tuple(_note(declared, name, own) for name, own in grips(case, mesh).items() if own.missed)


def _note(declared: Declared, name: str, own: Grip) -> Diagnostic:
    at = declared.at("size" if declared.thing.own_mesh is None else "mesh")
    if own.layer is not None and own.beyond > MISSED:
        asked, held = (100 * part for part in own.layer)
        return diagnostic(
            "W375",
            at,
            f"`{name}` selects {asked:.2g} % of the mesh of `{declared.name}`, a layer thinner than its cells, "
            f"and cells with {held:.2g} % are held",
            "cells all of whose nodes are held are held as a whole",
            "select the surface alone, or use cells as thin as the layer; `--stated` says what it makes",
        )
    parts = [f"{100 * own.held:.3g} % of what `{name}` selects"] if 1.0 - own.held > MISSED else []
    parts += [f"{100 * own.beyond:.3g} % more than `{name}` selects"] if own.beyond > MISSED else []
    return diagnostic(
        "W375",
        at,
        f"the mesh of `{declared.name}` holds {' and '.join(parts)}",
        "its facets and cells do not end there",
        "use a finer mesh, or one with nodes along the border of the selection; `--stated` says what it makes",
    )


# ------------------------------------------------------------------ of a mesh


@dataclass(frozen=True)
class _Kind:
    """Cells, facets or edges of a mesh: nodes (m, k) of each, its size (m,), and simplices (m, s, c) of its nodes."""

    nodes: Ints
    sizes: Floats
    simplices: Ints


def _found(condition: Condition, mesh: Mesh) -> Grip:
    nodes = _selects(condition, mesh.points, mesh)
    wide = nodes.copy()
    volumes, areas = cells_of(mesh), _facets(mesh)
    looked = [(kind, fractions(condition, kind, mesh)) for kind in (volumes, areas)]
    for kind, f in looked:  # a selection without its border: what is held inside is held up to there
        nodes[np.unique(kind.nodes[f >= 1.0 - WHOLE])] = True
    if not any(float(f @ kind.sizes) > SMALL * kind.sizes.sum() for kind, f in looked):
        edges = _edges(mesh)
        looked = [(edges, fractions(condition, edges, mesh))]
    for kind, f in looked:
        wide[np.unique(kind.nodes[f > SMALL])] = True
    shares = [_share(kind, f, nodes) for kind, f in looked if float(f @ kind.sizes) > SMALL * kind.sizes.sum()]
    held = min((held for held, _ in shares), default=1.0)
    return Grip(
        nodes, wide | nodes, held, max((beyond for _, beyond in shares), default=0.0), _layer(*looked[0], nodes)
    )


def _layer(kind: _Kind, f: Floats, nodes: Bools) -> tuple[float, float] | None:
    """Where what is selected has a volume and yet no whole cell: its part of all, and that of the cells held by it."""
    total, spanned = float(kind.sizes.sum()), nodes[kind.nodes].all(axis=1) & (f > SMALL)
    share = float(f @ kind.sizes) / total
    thin = kind.nodes.shape[1] >= 4 and share > SMALL and f.max() < 1.0 - WHOLE
    return (share, float(kind.sizes[spanned].sum()) / total) if thin else None


def _share(kind: _Kind, f: Floats, nodes: Bools) -> tuple[float, float]:
    """What nodes span of the selected fractions f (m,), and what they span beside it where a border passes."""
    chosen, spanned = f * kind.sizes, nodes[kind.nodes].all(axis=1)
    total = float(chosen.sum())
    held = float(chosen[spanned].sum()) / total
    crossed = spanned & (f > SMALL) & (f < 1.0 - WHOLE)
    beyond = float(((1.0 - f) * kind.sizes)[crossed].sum()) / total
    return (1.0 if held > 1.0 - WHOLE else held), beyond


def cells_of(mesh: Mesh) -> _Kind:
    corners = mesh.cells[:, : mesh.element.corners]
    simplices = corners[:, None, :] if corners.shape[1] == 4 else corners[:, np.array(SIX)]
    return _Kind(mesh.cells, mesh.volumes, simplices)


def _facets(mesh: Mesh) -> _Kind:
    triangles = mesh.facets[:, np.array(mesh.element.facet.triangles)]  # (f, s, 3)
    whole = Pieces(mesh.points[triangles.reshape(-1, 3)], np.repeat(np.arange(len(triangles)), triangles.shape[1]))
    areas: Floats = np.bincount(whole.of, whole.sizes, minlength=len(triangles)).astype(np.float64)
    return _Kind(mesh.facets, areas, triangles)


def _edges(mesh: Mesh) -> _Kind:
    """Sides of the triangles of the surface, each once."""
    sides = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ends = np.unique(np.sort(sides, axis=1), axis=0)
    lengths = np.linalg.norm(mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]], axis=1)
    return _Kind(ends, lengths, ends[:, None, :])


# ------------------------------------------------------------------ fractions of cells


def fractions(condition: Condition, kind: _Kind, mesh: Mesh) -> Floats:
    """What part of each cell a condition selects (m,), from 0 to 1."""
    number = np.repeat(np.arange(len(kind.nodes)), kind.simplices.shape[1])
    corners = kind.simplices.reshape(-1, kind.simplices.shape[2])
    crossed = np.zeros(len(kind.nodes), dtype=np.bool_)
    near = np.arange(len(corners))
    if not all(border.plane for border in condition.borders):
        near = np.flatnonzero(_open(condition, mesh.points[corners], mesh.extent))
    for border in condition.borders:
        crossed[number[near[_near(border, mesh.points[corners[near]], mesh.extent)]]] = True
    whole = Pieces(mesh.points[kind.simplices[:, 0]], np.arange(len(kind.nodes)))
    f = _selects(condition, whole.middles, mesh).astype(float)
    some = crossed[number]
    pieces = Pieces(mesh.points[corners[some]], number[some])
    for border in condition.borders:
        pieces = _cut(pieces, border, mesh.extent)
    chosen = _selects(condition, pieces.middles, mesh)
    size, count = pieces.sizes, len(kind.nodes)
    total = np.bincount(pieces.of, size, minlength=count)
    own = np.bincount(pieces.of[chosen], size[chosen], minlength=count)
    found: Floats = np.where(crossed & (total > 0.0), own / np.where(total > 0.0, total, 1.0), f)
    return found


def _selects(condition: Condition, X: Floats, mesh: Mesh) -> Bools:
    """Which points X (n, 3) a condition selects (n,)."""
    x, y, z = X.T
    return np.array(np.broadcast_to(condition.holds(x, y, z, mesh.extent), len(X)), dtype=np.bool_)


def _cut(pieces: Pieces, border: Border, extent: float) -> Pieces:
    """The pieces cut by a border, those near a curved one in several rounds."""
    dimension = pieces.corners.shape[1] - 1
    for _ in range(0 if border.plane else HALVINGS[dimension + 1] * dimension):
        near = _near(border, pieces.corners, extent)
        pieces = joined(pieces.chosen(np.flatnonzero(~near)), pieces.chosen(np.flatnonzero(near)).refined())
    near = _near(border, pieces.corners, extent)
    rest, crossed = pieces.chosen(np.flatnonzero(~near)), pieces.chosen(np.flatnonzero(near))
    return joined(rest, crossed.cut(_level(border), _slack(border, extent), border.plane is None))


def _level(border: Border) -> Any:
    return lambda X: np.broadcast_to(border.at(*X.T), len(X))


def _slack(border: Border, extent: float) -> float:
    return RELATIVE_TOLERANCE * float(extent) ** border.power


def _near(border: Border, corners: Floats, extent: float) -> Bools:
    """Which simplices (p, k, 3) a border crosses (p,).

    A curved one may where the level could reach zero beyond what it is at corners, middles of edges and the centroid:
    it is looked for as far beyond these values as they differ.
    """
    if border.plane is not None:
        level = _level(border)(corners.reshape(-1, 3)).reshape(corners.shape[:2])
        slack = _slack(border, extent)
        return np.asarray((level.min(axis=1) < -slack) & (level.max(axis=1) > slack))
    k = corners.shape[1]
    i, j = np.triu_indices(k, 1)
    looked = np.concatenate(
        [corners, 0.5 * (corners[:, i] + corners[:, j]), corners.mean(axis=1, keepdims=True)], axis=1
    )
    level = _level(border)(looked.reshape(-1, 3)).reshape(looked.shape[:2])
    low, high = level.min(axis=1), level.max(axis=1)
    return np.asarray((2.0 * low <= high) & (2.0 * high >= low))


def _open(condition: Condition, corners: Floats, extent: float) -> Bools:
    """Which simplices (p, k, 3) lie in boxes in which a condition is not known to be the same everywhere (p,)."""
    found = np.zeros(len(corners), dtype=np.bool_)
    low, high = corners.min(axis=1), corners.max(axis=1)
    pending = [np.arange(len(corners))] if len(corners) else []
    while pending:
        group = pending.pop()
        false, true = condition.over(_point(low[group].min(axis=0)), _point(high[group].max(axis=0)), extent)
        if not (false and true):
            continue
        if len(group) <= GROUP:
            found[group] = True
        else:
            middle = (low + high)[group]
            order = np.argsort(middle[:, np.ptp(middle, axis=0).argmax()])
            pending += np.array_split(group[order], 2)
    return found


def _point(x: Floats) -> tuple[float, float, float]:
    a, b, c = x.tolist()
    return a, b, c
