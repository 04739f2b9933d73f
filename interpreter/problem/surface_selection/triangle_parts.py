"""Triangles of a surface cut at the border of a condition, so that partly selected triangles count by their part.

Triangles are cut exactly along planes. A curved border does not cut them: facets of a round side lie inside it, and
cutting all of them would concentrate a probe's points there. The area left out is reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.language.coordinate_conditions import RELATIVE_TOLERANCE, Condition
from softmark.interpreter.problem.mesh_group_conditions import split_by_groups
from softmark.interpreter.problem.surface_selection.facet_patches import Floats, Ints, Mask
from softmark.solvers.mesh.simplex_clipping import Pieces, join_pieces

if TYPE_CHECKING:
    from softmark.interpreter.problem.mesh_group_conditions import Members

ONE = 1e-9  # relative to the extent: closer points are merged


def clip_triangles(
    condition: Condition, X: Floats, triangles: Ints, members: Members | None = None
) -> tuple[Floats, Ints, float]:
    """Return points (n, 3), m, and triangles (t, 3) of the selected part of a surface, and the fraction they cover.

    `members` returns a mask of the triangles in a named group, for conditions with groups. Points keep the order of the
    surface. Without selected area, the result has only the selected points, if any. The fraction is relative to the
    area within the condition's borders, where curved borders are chords of the triangles that they cross.
    """
    extent = float(np.linalg.norm(np.ptp(X, axis=0)))
    if condition.groups and members is not None:
        found = [(own, triangles[which]) for own, which in split_by_groups(condition, members)]
        parts = [_pieces(own, Pieces(X[some], np.arange(len(some))), extent) for own, some in found]
        taken = reduce(join_pieces, [own for own, _ in parts])
        whole = sum(area for _, area in parts)
        return *_join_pieces(X, taken, ONE * extent), float(taken.sizes.sum()) / whole if whole else 1.0
    taken, whole = _pieces(condition, Pieces(X[triangles], np.arange(len(triangles))), extent)
    share = float(taken.sizes.sum()) / whole if whole else 1.0
    if not len(taken.of):
        x, y, z = X.T
        held = np.broadcast_to(condition.holds(x, y, z, extent), len(X))
        return X[held], np.zeros((0, 3), dtype=np.int64), share
    return *_join_pieces(X, taken.chosen(np.argsort(taken.of, kind="stable")), ONE * extent), share


def _pieces(condition: Condition, pieces: Pieces, extent: float) -> tuple[Pieces, float]:
    """Return the selected pieces, and the area within the condition's borders, m^2, with chords as curved borders.

    Pieces that a curved border crosses are neither cut nor selected, so the selected pieces may have a smaller area.
    """
    curved = [b for b, border in enumerate(condition.borders) if border.plane is None]
    for b in range(len(condition.borders)):
        pieces = pieces if b in curved else _cut_crossed(condition, b, pieces, extent)
    taken = pieces.chosen(np.flatnonzero(_are_selected(condition, pieces.corners, extent, curved)))
    for b in curved:
        pieces = _cut_crossed(condition, b, pieces, extent)
    if not curved:
        return taken, float(taken.sizes.sum())
    return taken, float(pieces.sizes[_are_selected(condition, pieces.corners, extent, [])].sum())


def cut_along(condition: Condition, pieces: Pieces, extent: float) -> Pieces:
    """Cut pieces along every border of a condition, so that each piece lies on one side of all borders.

    Curved borders are replaced by chords.
    """
    for b in range(len(condition.borders)):
        pieces = _cut_crossed(condition, b, pieces, extent)
    return pieces


def _cut_crossed(condition: Condition, b: int, pieces: Pieces, extent: float) -> Pieces:
    """Cut the pieces that border b crosses, judged by the levels at their corners."""
    border = condition.borders[b]
    slack = RELATIVE_TOLERANCE * extent**border.power
    return pieces.cut(lambda x: _levels(condition, b, x), slack, border.plane is None)


def _levels(condition: Condition, b: int, X: Floats) -> Floats:
    """Return the levels of border b at points X (..., 3), m."""
    with np.errstate(all="ignore"):
        found: Floats = np.broadcast_to(condition.borders[b].at(X[..., 0], X[..., 1], X[..., 2]), X.shape[:-1])
    return found


def _are_selected(condition: Condition, corners: Floats, extent: float, uncut: Sequence[int]) -> Mask:
    """Return a mask of the selected pieces (p, 3, 3), m.

    For a border in `uncut`, which did not cut the pieces, all corners must be on the selected side. For other borders
    the corner farthest from the border decides.
    """
    levels = []
    for b in range(len(condition.borders)):
        level = _levels(condition, b, corners)
        farthest = level[np.arange(len(level)), np.abs(level).argmax(axis=1)]
        levels.append(level if b in uncut else np.repeat(farthest[:, None], 3, axis=1))
    held = np.broadcast_to(condition.holds_for_levels(levels, extent), corners.shape[:2])
    found: Mask = np.asarray(held.all(axis=1), dtype=np.bool_)
    return found


def _join_pieces(X: Floats, pieces: Pieces, near: float) -> tuple[Floats, Ints]:
    """Return pieces as points (n, 3), m, and triangles (t, 3): first points of the surface, then those of cuts."""
    corners = pieces.corners.reshape(-1, 3)
    keys, first, number = np.unique(
        np.round(np.concatenate([X, corners]) / near), axis=0, return_index=True, return_inverse=True
    )
    number = number.ravel()[len(X) :]
    used = np.zeros(len(keys), dtype=np.bool_)
    used[number] = True
    order = np.flatnonzero(used)[np.argsort(first[used], kind="stable")]
    place = np.zeros(len(keys), dtype=np.int64)
    place[order] = np.arange(len(order))
    triangles = place[number].reshape(-1, 3)
    a, b, c = triangles.T
    points = np.concatenate([X, corners])[first[order]]
    return points, triangles[(a != b) & (b != c) & (c != a)]
