"""Selected parts of cells, facets and edges: simplices cut along the borders of a condition.

Plane borders are exact; curved borders are approximated by pieces that are small compared with a cell.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from softmark.interpreter.language.coordinate_conditions import RELATIVE_TOLERANCE, Border, Condition
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.simplex_clipping import Pieces, join_pieces

Bools = np.ndarray[Any, np.dtype[np.bool_]]

HALVINGS = {2: 0, 3: 4, 4: 2}  # edge halvings near a curved border, by the number of corners
GROUP = 16  # cells bounded together


def select_pieces(condition: Condition, whole: Pieces, extent: float) -> Pieces:
    """Return the selected parts of some simplices of a body with the given extent, m, in the order of the simplices.

    A curved border is located on the edges of simplices and straight between these points, so its accuracy depends on
    the size of the simplices.
    """
    corners = whole.corners
    crossed = np.zeros(len(corners), dtype=np.bool_)
    for border in condition.borders:
        crossed |= crossed_simplices(border, corners, extent)
    pieces = whole.chosen(np.flatnonzero(crossed))
    for border in condition.borders:
        pieces = cut_pieces(pieces, border, extent, halved=False)
    found = join_pieces(whole.chosen(np.flatnonzero(~crossed)), pieces)
    found = found.chosen(np.flatnonzero(selected_points(condition, found.middles, extent)))
    return found.chosen(np.argsort(found.of, kind="stable"))


def selected_points(condition: Condition, X: Floats, extent: float) -> Bools:
    """Return a mask of the points X (n, 3), m, that a condition selects (n,)."""
    x, y, z = X.T
    return np.array(np.broadcast_to(condition.holds(x, y, z, extent), len(X)), dtype=np.bool_)


def cut_pieces(pieces: Pieces, border: Border, extent: float, halved: bool = True) -> Pieces:
    """Cut the pieces along a border; with `halved`, those near a curved border are divided in several rounds."""
    dimension = pieces.corners.shape[1] - 1
    for _ in range(0 if border.plane or not halved else HALVINGS[dimension + 1] * dimension):
        beside = crossed_simplices(border, pieces.corners, extent)
        pieces = join_pieces(
            pieces.chosen(np.flatnonzero(~beside)), pieces.chosen(np.flatnonzero(beside)).bisect_longest_edges()
        )
    beside = crossed_simplices(border, pieces.corners, extent)
    rest, crossed = pieces.chosen(np.flatnonzero(~beside)), pieces.chosen(np.flatnonzero(beside))
    return join_pieces(rest, crossed.cut(_level(border), slack_of(border, extent), border.plane is None))


def _level(border: Border) -> Any:
    return lambda X: np.broadcast_to(border.at(*X.T), len(X))


def slack_of(border: Border, extent: float) -> float:
    """Return the level up to which a point counts as on a border."""
    return RELATIVE_TOLERANCE * float(extent) ** border.power


def crossed_simplices(border: Border, corners: Floats, extent: float) -> Bools:
    """Return a mask of the simplices (p, k, 3), m, that a border crosses (p,).

    A curved border counts as crossing if its level could reach zero between the corners, edge midpoints and centroid,
    judged by how much the values there differ.
    """
    if border.plane is not None:
        level = _level(border)(corners.reshape(-1, 3)).reshape(corners.shape[:2])
        slack = slack_of(border, extent)
        return np.asarray((level.min(axis=1) < -slack) & (level.max(axis=1) > slack))
    k = corners.shape[1]
    i, j = np.triu_indices(k, 1)
    looked = np.concatenate(
        [corners, 0.5 * (corners[:, i] + corners[:, j]), corners.mean(axis=1, keepdims=True)], axis=1
    )
    level = _level(border)(looked.reshape(-1, 3)).reshape(looked.shape[:2])
    low, high = level.min(axis=1), level.max(axis=1)
    return np.asarray((2.0 * low <= high) & (2.0 * high >= low))


def undecided_simplices(condition: Condition, corners: Floats, extent: float) -> Bools:
    """Return a mask of the simplices (p, k, 3), m, in whose bounding box the condition may change (p,)."""
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
