"""Quadrature rules with few points and positive weights that preserve given moments of a rule with many points.

By Caratheodory's theorem (for quadrature: Tchakaloff 1957), a sum of n columns with positive weights equals a positive
sum of as many of these columns as are linearly independent. Points are processed one by one: each is added to a basis
of columns, or replaces a column whose weight becomes zero, as in the simplex method.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.runtime.kernel_cache import kernel

NOTHING = 1e-10  # relative to a column's coordinates: smaller ones are rounding
ALIKE = 1e-12  # relative to the largest eigenvalue of the Gram matrix: below it functions are dependent


def reduce_rules(cell: Ints, V: Floats, w: Floats, count: int) -> tuple[Ints, Floats, Floats]:
    """Reduce the quadrature rule of each cell to few points with positive weights that preserve given integrals.

    `cell` (n,), sorted, is the cell of each of n points, and `count` the number of cells. `V` (n, r) are the values of
    the functions whose integrals are preserved, and `w` (n,) the weights. Return the numbers (k,) of the kept points,
    their weights (k,), and the largest relative error of an integral in each cell (count,), which is due to rounding.
    """
    kept, starts = np.zeros(len(w)), np.searchsorted(cell, np.arange(count + 1))
    missed = np.zeros(count)
    for i in range(count):
        a, b = int(starts[i]), int(starts[i + 1])
        own = np.ascontiguousarray(V[a:b])
        scale = np.abs(own).T @ w[a:b]
        own = own / np.where(scale > NOTHING * scale.max(), scale, np.inf)  # zero functions are rounding
        order = _scattered_order(b - a)
        found = np.zeros(b - a)
        basis = _orthonormalise_functions(own, w[a:b])
        r = basis.shape[1]
        _reduce_rule(basis, w[a:b], order, np.eye(r), np.full(r, -1), np.zeros((2, r)), found)
        missed[i] = _correct_weights(own, own.T @ w[a:b], found)
        kept[a:b] = found
    which = np.flatnonzero(kept > 0.0)
    return which, kept[which], missed


def _orthonormalise_functions(V: Floats, w: Floats) -> Floats:
    """Return functions (n, k), orthonormal with the weights w (n,), that span the functions V (n, r) to rounding."""
    products = np.zeros((V.shape[1], V.shape[1]))
    _compute_gram_matrix(V, w, products)
    size, ways = np.linalg.eigh(products)
    kept = size > ALIKE * size[-1]
    found = np.zeros((len(V), int(kept.sum())))
    _multiply(V, np.ascontiguousarray(ways[:, kept] / np.sqrt(size[kept])), found)
    return found


def _correct_weights(V: Floats, moments: Floats, found: Floats) -> float:
    """Correct rounding errors of the weights `found` (n,) in place; return the largest remaining moment error.

    `V` (n, r) are the values of the functions and `moments` (r,) their integrals.
    """
    some = np.flatnonzero(found > 0.0)
    change = np.linalg.lstsq(V[some].T, moments - V[some].T @ found[some], rcond=1e-12)[0]
    if np.all(found[some] + change >= 0.0):
        found[some] += change
    return float(np.abs(V[some].T @ found[some] - moments).max(initial=0.0))


def _scattered_order(n: int) -> Ints:
    """Return the integers 0 to n - 1 in an order that separates neighbours, because close points form a poor basis."""
    return np.argsort((np.arange(n) * 0.6180339887498949) % 1.0).astype(np.int64)


@kernel
def _compute_gram_matrix(V: Floats, w: Floats, found: Floats) -> None:
    """Compute V^T diag(w) V into `found`, without threads, which cost more than they gain in parallel runs."""
    for k in range(len(V)):
        for i in range(V.shape[1]):
            a = w[k] * V[k, i]
            for j in range(V.shape[1]):
                found[i, j] += a * V[k, j]


@kernel
def _multiply(V: Floats, T: Floats, found: Floats) -> None:
    """Compute the matrix product V T into `found`."""
    for k in range(len(V)):
        for i in range(T.shape[0]):
            for j in range(T.shape[1]):
                found[k, j] += V[k, i] * T[i, j]


@kernel
def _reduce_rule(V: Floats, w: Floats, order: Ints, inverse: Floats, basis: Ints, own: Floats, kept: Floats) -> None:
    """Add to `kept` (n,) the weights of at most r points that preserve the weighted sums of the rows of V (n, r).

    `w` (n,) are the weights of the given rule and `order` the sequence of its points. `inverse` (r, r), the inverse of
    the basis, starts as the identity. `basis` (r,), the points in the basis, starts with -1 for columns that are no
    points and have weight zero. `own` (2, r) is work memory of zeros.
    """
    r = V.shape[1]
    weight, d = own[0], own[1]
    for k in order:
        left = w[k]
        if left <= 0.0:
            continue
        most = 0.0
        for i in range(r):
            s = 0.0
            for j in range(r):
                s += inverse[i, j] * V[k, j]
            d[i] = s
            most = max(most, abs(s))
        pivot, size = -1, 1e-8 * max(most, 1e-300)
        for i in range(r):  # a direction independent of the basis
            if basis[i] < 0 and abs(d[i]) > size:
                pivot, size = i, abs(d[i])
        if pivot < 0:
            t = left
            for i in range(r):
                if basis[i] >= 0 and d[i] < -1e-10 * most and weight[i] < -d[i] * t:
                    t, pivot = weight[i] / -d[i], i
            for i in range(r):
                if basis[i] >= 0:
                    weight[i] = max(0.0, weight[i] + t * d[i])
            left -= t
            if pivot < 0:
                continue
        basis[pivot], weight[pivot] = k, left
        for j in range(r):
            inverse[pivot, j] /= d[pivot]
        for i in range(r):
            if i != pivot and d[i] != 0.0:
                for j in range(r):
                    inverse[i, j] -= d[i] * inverse[pivot, j]
    for i in range(r):
        if basis[i] >= 0:
            kept[basis[i]] += weight[i]
