"""Compiled loops of the symbolic factorisation: elimination tree, fronts, and positions of all entries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.runtime.kernel_cache import allocating_kernel, kernel

Ints = NDArray[np.int64]
Places = NDArray[np.uint64]
Floats = NDArray[np.float64]
Entries = NDArray[np.int32] | NDArray[np.int64]  # indices of a CSR pattern


@kernel
def build_elimination_tree(
    indptr: Ints, indices: Ints, order: Ints, weights: Ints, parent: Ints, counts: Ints, lists: Ints
) -> None:  # fmt: skip
    """Compute the elimination tree of a graph and the column counts of its Cholesky factor, in the given arrays.

    `order` (n,) is replaced by a postorder of the tree, `parent` receives the parent of each node, and `counts` the
    entries in each column of the factor. Counts include the diagonal and are weighted by the number of unknowns of each
    node, `weights`. `lists` (11, n), filled with -1, is work memory.
    Source: Liu (1990) for the tree; Gilbert, Ng and Peyton (1994) for the counts.
    """
    n = len(order)
    place, ancestor, above, head, after = lists[0], lists[1], lists[2], lists[3], lists[4]
    rank, stack, old = lists[5], lists[6], lists[7]
    for k in range(n):
        place[order[k]] = k
    for k in range(n):
        for t in range(indptr[order[k]], indptr[order[k] + 1]):
            p = place[indices[t]]
            while p != -1 and p < k:
                following = ancestor[p]
                ancestor[p] = k
                if following == -1:
                    above[p] = k
                p = following
    # postorder; children stay in their order
    for k in range(n - 1, -1, -1):
        if above[k] >= 0:
            after[k] = head[above[k]]
            head[above[k]] = k
    number = 0
    for root in range(n):
        if above[root] >= 0:
            continue
        stack[0], top = root, 1
        while top > 0:
            k = stack[top - 1]
            if head[k] >= 0:
                stack[top] = head[k]
                head[k] = after[head[k]]
                top += 1
            else:
                rank[k] = number
                number += 1
                top -= 1
    for k in range(n):
        old[k] = order[k]
    for k in range(n):
        order[rank[k]] = old[k]
        parent[rank[k]] = rank[above[k]] if above[k] >= 0 else -1
    for k in range(n):
        place[order[k]] = k
    # column counts
    first, latest, leaf = lists[8], lists[9], lists[10]
    for k in range(n):
        ancestor[k] = k
        counts[k] = weights[order[k]] if first[k] == -1 else 0
        j = k
        while j != -1 and first[j] == -1:
            first[j] = k
            j = parent[j]
    for k in range(n):
        if parent[k] >= 0:
            counts[parent[k]] -= weights[order[k]]
        for t in range(indptr[order[k]], indptr[order[k] + 1]):
            i = place[indices[t]]
            if i <= k or first[k] <= latest[i]:
                continue
            latest[i] = first[k]
            counts[k] += weights[order[i]]
            q = leaf[i]
            leaf[i] = k
            if q >= 0:  # the row is counted twice in the least common ancestor of two leaves
                root = q
                while ancestor[root] != root:
                    root = ancestor[root]
                while q != root:
                    q, ancestor[q] = ancestor[q], root
                counts[root] -= weights[order[i]]
        if parent[k] >= 0:
            ancestor[k] = parent[k]
    for k in range(n):
        if parent[k] >= 0:
            counts[parent[k]] += counts[k]


def merge_supernodes(parent: Ints, counts: Ints, weights: Ints, columns_up_to: Ints, shares: Floats) -> Ints:
    """Return the first column of each front, and the number of columns, shape (fronts + 1,).

    Fronts are fundamental supernodes, merged with their last child if the merged front has few explicit zeros: at most
    the fraction `shares` of a front of up to `columns_up_to` columns. The function is plain Python: it takes 1 us per
    column and runs once per pattern.
    """
    n, relaxed = len(parent), list(zip(columns_up_to.tolist(), shares.tolist(), strict=True))
    only = np.bincount(parent[parent >= 0], minlength=n) == 1
    same = np.zeros(n, dtype=np.bool_)  # True if a column has the structure of the previous column, its only child
    same[1:] = only[1:] & (parent[:-1] == np.arange(1, n)) & (counts[:-1] == counts[1:] + weights[:-1])
    parents, fundamental = parent.tolist(), same.tolist()
    fronts: list[tuple[int, int, int, int]] = []  # first node, columns, rows below the pivots, explicit zeros
    for k, (width, height) in enumerate(zip(weights.tolist(), (counts - weights).tolist(), strict=True)):
        begin, w, z = k, width, 0
        if fronts and fundamental[k]:
            begin, before, _, z = fronts.pop()
            w += before
        while fronts and begin <= parents[begin - 1] <= k:
            start, other, tall, explicit = fronts[-1]
            joined = w + other
            explicit += z + other * (w + height - tall)
            share = next((s for limit, s in relaxed if joined <= limit), 0.0)
            if explicit > share * (0.5 * joined * (joined + 1) + joined * height):
                break
            fronts.pop()
            begin, w, z = start, joined, explicit
        fronts.append((begin, w, height, z))
    return np.array([front[0] for front in fronts] + [n], dtype=np.int64)


@kernel
def compute_front_structures(
    indptr: Ints, indices: Ints, order: Ints, place: Ints, owner: Ints, starts: Ints, offset: Ints, index_start: Ints,
    parents: Ints, filled: Ints, mark: Ints, index: Places, local: Places,
) -> None:  # fmt: skip
    """Compute the unknowns below each front's pivots (`index`), and their positions in the parent's front (`local`).

    A node is below the pivots of every front on the paths up the tree from its neighbours to its own front. Nodes are
    visited in elimination order, so no sorting is needed. `place` is the inverse of `order`, `owner` (n,) is the front
    of each node in that order, and `offset` (n + 1,) the first unknown of each node. On entry `filled` equals
    index_start and `mark` (fronts,) is -1.
    """
    for k in range(len(order)):
        for t in range(indptr[order[k]], indptr[order[k] + 1]):
            if place[indices[t]] > k:
                continue
            s = owner[place[indices[t]]]
            while s != owner[k] and mark[s] != k:
                mark[s] = k
                for unknown in range(offset[k], offset[k + 1]):
                    index[filled[s]] = unknown
                    filled[s] += 1
                s = parents[s]
    for s in range(len(parents)):
        p = parents[s]
        if p < 0:
            continue
        begin = offset[starts[p]]
        end = offset[starts[p + 1]]
        at = index_start[p]
        for t in range(index_start[s], index_start[s + 1]):
            below_it = np.int64(index[t])
            if below_it < end:
                local[t] = below_it - begin
            else:
                while np.int64(index[at]) < below_it:
                    at += 1
                local[t] = end - begin + at - index_start[p]


@kernel
def assign_entries_to_fronts(
    indptr: Entries, indices: Entries, unknowns: Ints, place: Ints, first: Ints, pivots: Ints, rows: Ints,
    panel: Ints, index_start: Ints, index: Places, source: Places, target: Places, entry_start: Ints, position: Ints,
) -> None:  # fmt: skip
    """Compute the matrix entries that each front assembles (`source`) and their positions in L (`target`).

    `position` (n,) is work memory.
    """
    at = 0
    for s in range(len(first)):
        entry_start[s] = at
        for i in range(pivots[s]):
            position[first[s] + i] = i
        for i in range(rows[s] - pivots[s]):
            position[index[index_start[s] + i]] = pivots[s] + i
        for i in range(pivots[s]):
            unknown = unknowns[first[s] + i]
            for t in range(indptr[unknown], indptr[unknown + 1]):
                p = place[indices[t]]
                if p >= first[s] + i:
                    source[at] = t
                    target[at] = panel[s] + i * rows[s] + position[p]
                    at += 1
    entry_start[len(first)] = at


def place_update_matrices(parents: Ints, sizes: Ints, update: Ints) -> int:
    """Compute the positions of the update matrices in memory (`update`), and return the length of that memory.

    The matrices lie in two stacks, chosen by the parity of a front's depth in the tree, so that no matrix overwrites
    those of its children.
    """
    above, squares = parents.tolist(), (sizes**2).tolist()
    side, places = [0] * len(above), [0] * len(above)
    for s in range(len(above) - 1, -1, -1):
        side[s] = 1 - side[above[s]] if above[s] >= 0 else 0
    top, peak = [0, 0], [0, 0]
    held: dict[int, int] = {}  # front -> position of its first child's update matrix
    for s, p in enumerate(above):
        if s in held:
            top[1 - side[s]] = held[s]
        places[s] = top[side[s]]
        if p >= 0:
            held.setdefault(p, top[side[s]])
        top[side[s]] += squares[s]
        peak[side[s]] = max(peak[side[s]], top[side[s]])
    update[:] = np.array(places, dtype=np.int64) + np.array(side, dtype=np.int64) * peak[0]
    return peak[0] + peak[1]


@allocating_kernel
def dissect(indptr: Ints, indices: Ints, points: Floats, leaf: int, order: Ints) -> int:
    """Compute a nested dissection of a graph by planes, with separators last in `order` (n,).

    Each part of more than `leaf` nodes is cut normal to one of the axes or to its longest direction, whichever gives
    the smallest separator. Return the number of nodes in no separator; these come first in `order`, unordered.
    Source: George (1973); Heath and Raghavan (1995).
    """
    n = len(order)
    nodes, rank = np.arange(n), np.full(n, -1, np.int64)
    begins, ends, pending = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64), 1
    ends[0] = n
    separators, held = np.empty(n, np.int64), n  # filled from the end
    inside = np.ones(n, np.bool_)
    while pending > 0:
        pending -= 1
        begin, size = begins[pending], ends[pending] - begins[pending]
        if size <= leaf:
            continue
        part = nodes[begin : begin + size].copy()
        best, cut, upper, fewest = part, 0, False, 0.3 * size
        axes = _cut_directions(points, part)
        for axis in range(4):
            by = part[np.argsort(_project_to_axis(points, part, axes[axis]), kind="mergesort")]
            at, above, cost = _find_best_separator(indptr, indices, by, rank)
            if cost < fewest:
                best, cut, upper, fewest = by, at, above, cost
        if cut == 0:
            continue
        for r in range(size):
            rank[best[r]] = r
        lower, higher = begin, begin + size
        for r in range(size):
            i = best[r]
            touches = False
            if (r >= cut) == upper:
                for e in range(indptr[i], indptr[i + 1]):
                    q = rank[indices[e]]
                    touches |= q >= 0 and (q >= cut) != upper
            if touches:
                held -= 1
                separators[held] = i
                inside[i] = False
            elif r < cut:
                nodes[lower] = i
                lower += 1
            else:
                higher -= 1
                nodes[higher] = i
        for r in range(size):
            rank[best[r]] = -1
        begins[pending], ends[pending] = begin, lower
        begins[pending + 1], ends[pending + 1] = higher, begin + size
        pending += 2
    order[held:] = separators[held:]
    order[:held] = np.flatnonzero(inside)
    return held


@allocating_kernel
def _find_best_separator(indptr: Ints, indices: Ints, by: Ints, rank: Ints) -> tuple[int, bool, float]:
    """Return the best cut of the nodes `by` (size,), which are sorted along one direction.

    The result is the number of nodes before the cut, whether the separator lies behind the cut, and the cost. The cost
    is the size of the separator, increased if the two parts differ in size.
    """
    size = len(by)
    reach = np.zeros((2, size + 2), np.int64)
    for r in range(size):
        rank[by[r]] = r
    for r in range(size):
        low, high = r, r
        for e in range(indptr[by[r]], indptr[by[r] + 1]):
            q = rank[indices[e]]
            if q >= 0:
                low, high = min(low, q), max(high, q)
        # a cut c parts ranks below c from the others: r touches these for r < c <= high, and those for low < c <= r
        reach[0, r + 1] += 1
        reach[0, high + 1] -= 1
        reach[1, low + 1] += 1
        reach[1, r + 1] -= 1
    for r in range(size):
        rank[by[r]] = -1
    at, above, cost = 0, False, np.inf
    touching = np.zeros(2, np.int64)
    for c in range(size):
        for k in range(2):
            touching[k] += reach[k, c]
        if c > 0.35 * size and c < 0.65 * size:
            lopsided = 1.0 + 4.0 * (c / size - 0.5) ** 2
            for k in range(2):
                if touching[k] * lopsided < cost:
                    at, above, cost = c, k == 1, touching[k] * lopsided
    return at, above, cost


@allocating_kernel
def _project_to_axis(points: Floats, part: Ints, axis: Floats) -> Floats:
    """Return the coordinates of the points with the numbers `part` (k,) along the vector `axis` (3,)."""
    t = np.empty(len(part))
    for k in range(len(part)):
        t[k] = points[part[k], 0] * axis[0] + points[part[k], 1] * axis[1] + points[part[k], 2] * axis[2]
    return t


@allocating_kernel
def _cut_directions(points: Floats, part: Ints) -> Floats:
    """Return four directions for cutting the points with the numbers `part`, shape (4, 3).

    These are x, y, z and the longest direction of the points, found by power iteration.
    """
    middle, spread = np.zeros(3), np.zeros((3, 3))
    for i in part:
        for a in range(3):
            middle[a] += points[i, a] / len(part)
    for i in part:
        for a in range(3):
            for b in range(3):
                spread[a, b] += (points[i, a] - middle[a]) * (points[i, b] - middle[b])
    axes = np.zeros((4, 3))
    axes[0, 0] = axes[1, 1] = axes[2, 2] = 1.0
    axes[3, 0], axes[3, 1], axes[3, 2] = 1.0, 0.7, 0.4
    for _ in range(30):
        x, y, z = axes[3, 0], axes[3, 1], axes[3, 2]
        size = 1e-300
        for a in range(3):
            axes[3, a] = spread[a, 0] * x + spread[a, 1] * y + spread[a, 2] * z
            size += axes[3, a] ** 2
        for a in range(3):
            axes[3, a] /= np.sqrt(size)
    return axes
