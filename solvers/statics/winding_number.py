"""Winding number of a body between rotating supports: whole turns, which end positions do not show.

A support rotated by 360 degrees looks like one that has not rotated. A path of equilibria followed in small steps keeps
the twist between two supports. A step that is too large, or an escape from an unstable equilibrium, may lose a whole
turn. To detect this, the rotation of each cell is fitted to its nodes (Kabsch 1976), and the rotations of neighbouring
cells are chained as quaternions from one support to the other. Each differs from the one before by less than half a
turn. So the chain ends at the quaternion of the last support, or at its negative if a whole turn is lost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_rotation import exponential, quaternion

MOST = 150.0  # degrees, largest rotation between neighbouring cells: near 180 the sense is ambiguous
SHARED = 3  # common nodes of neighbouring cells in space; two in a plane
LOST = "the rotation is lost: the body springs back by a full turn"
COARSE = f"neighbouring cells rotate by more than {MOST:.0f} degrees relative to each other: use smaller cells"


@dataclass(frozen=True)
class RotationSupport:
    """Support that fixes rotation: its nodes (k,), and its rotation vector (3,) at full load, rad."""

    nodes: Ints
    rotation: tuple[float, float, float]


@dataclass(frozen=True)
class CellChain:
    """Chain of neighbouring cells from one support to another: their nodes (k, a), and positions at rest, m."""

    cells: Ints
    X: Floats  # (k, a, 3)
    first: tuple[float, float, float]
    last: tuple[float, float, float]

    def lost_turn_message(self, u: Floats, share: float) -> str | None:
        """Return a message if displacements u (n, 3), m, do not show the rotations of both supports; else None.

        The rotations are those at the load fraction `share`.
        """
        ends = exponential(share * np.array([self.first, self.last]))
        chain = np.concatenate([ends[:1], quaternion(_best_fit_rotations(self.X, self.X + u[self.cells])), ends[1:]])
        cosines = np.einsum("ij,ij->i", chain[:-1], chain[1:])  # cosines of half the angle between neighbours
        if np.abs(cosines).min() < math.cos(math.radians(0.5 * MOST)):
            return COARSE
        return LOST if np.prod(np.sign(cosines)) < 0.0 else None


def find_cell_chains(points: Floats, cells: Ints, grips: Sequence[RotationSupport]) -> tuple[CellChain, ...]:
    """Return the shortest chain of cells (m, a) from the first support to each other support connected with it.

    A support counts if it contains nodes of a cell that do not lie on one line; in a plane, two nodes of a cell.
    """
    flat = bool(np.ptp(points[:, 2]) == 0.0)
    cells_of = [_find_cells_in_support(points, cells, grip, 1 if flat else 2) for grip in grips]
    held = [(grip, own) for grip, own in zip(grips, cells_of, strict=True) if len(own)]
    if len(held) < 2:
        return ()
    (first, begin), *others = held
    before, order = _shortest_path_tree(cells, begin, len(points), SHARED - flat)
    found = []
    for grip, own in others:
        reached = own[order[own] >= 0]
        if len(reached):
            numbers = [int(reached[np.argmin(order[reached])])]
            while before[numbers[-1]] >= 0:
                numbers.append(int(before[numbers[-1]]))
            route = cells[numbers[::-1]]
            found.append(CellChain(route, points[route], first.rotation, grip.rotation))
    return tuple(found)


def _find_cells_in_support(points: Floats, cells: Ints, grip: RotationSupport, rank: int) -> Ints:
    """Return the numbers of cells whose nodes in a support span a line (rank 1) or a plane (rank 2)."""
    inside = np.isin(cells, grip.nodes)
    some = np.nonzero(inside.sum(axis=1) > rank)[0]
    spans = [np.linalg.matrix_rank(np.diff(points[cells[i][inside[i]]], axis=0), 1e-6 * np.ptp(points)) for i in some]
    return np.asarray(some[np.array(spans, dtype=np.int64) >= rank], dtype=np.int64)


def _shortest_path_tree(cells: Ints, begin: Ints, nodes: int, shared: int) -> tuple[Ints, Ints]:
    """Return, for each cell, the next cell on the shortest path to the cells `begin`, and the number of steps.

    Both are -1 for cells without a path. Neighbouring cells share at least `shared` nodes.
    """
    rows = np.repeat(np.arange(len(cells)), cells.shape[1])
    touches = sparse.csr_array((np.ones(cells.size, dtype=np.int64), (rows, cells.ravel())), (len(cells), nodes))
    common = (touches @ touches.T).tocsr()
    before, order = np.full(len(cells), -1), np.full(len(cells), -1)
    order[begin], front, steps = 0, begin, 0
    while len(front):
        steps, ahead = steps + 1, list[int]()
        for i in front.tolist():
            part = slice(common.indptr[i], common.indptr[i + 1])
            near = common.indices[part][common.data[part] >= shared]
            new = near[order[near] < 0]
            order[new], before[new] = steps, i
            ahead += new.tolist()
        front = np.array(ahead, dtype=np.int64)
    return before, order


def _best_fit_rotations(X: Floats, x: Floats) -> Floats:
    """Return the rotations (k, 3, 3) that best map points X (k, a, 3) to x (k, a, 3), about their means.

    Source: Kabsch 1976.
    """
    centred = [p - p.mean(axis=1, keepdims=True) for p in (X, x)]
    U, _, Vt = np.linalg.svd(np.einsum("kai,kaj->kij", centred[1], centred[0]))
    U[:, :, 2] *= np.linalg.det(U @ Vt)[:, None]  # no reflection
    return np.asarray(U @ Vt)
