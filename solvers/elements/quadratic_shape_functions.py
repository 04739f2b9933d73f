"""Quadratic shape functions on squares and cubes [-1, 1]^d, from the local points of their nodes.

A coordinate of a node is -1, 0 or 1. Lagrange functions are products of the polynomials of three points. Serendipity
functions have no nodes in faces and in the centre: N = prod(1 + p_i xi_i) (p . xi - d + 1) / 2^d in a corner p, and (1
- xi_i^2) prod(1 + p_j xi_j) / 2^(d - 1) in the middle of an edge along i (Zienkiewicz, Taylor and Zhu 2013, 6).
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


def gauss_rule(d: int) -> tuple[Floats, Floats]:
    """Return three Gauss points along each direction (3^d, d) and weights (3^d,): exact to degree five in each
    coordinate.
    """
    t, w = (-(0.6**0.5), 0.0, 0.6**0.5), (5 / 9, 8 / 9, 5 / 9)
    return np.array(list(product(t, repeat=d))), np.prod(np.array(list(product(w, repeat=d))), axis=1)


def lagrange(places: Floats, xi: Floats) -> Floats:
    """Return N (m, a) of Lagrange nodes at `places` (a, d), at local points xi (m, d)."""
    found: Floats = _along(places, xi[:, None, :]).prod(axis=2)
    return found


def lagrange_gradient(places: Floats, xi: Floats) -> Floats:
    """Return dN/dxi (m, a, d) of Lagrange nodes."""
    return _product_rule(*_coordinate_polynomials(places, xi))


def _coordinate_polynomials(places: Floats, xi: Floats) -> tuple[Floats, Floats]:
    """Return the polynomials along each coordinate (m, a, d), and their derivatives."""
    p, t = places, xi[:, None, :]
    return _along(p, t), np.where(p == 0.0, -2.0 * t, t + 0.5 * p)


def _along(p: Floats, t: Floats) -> Floats:
    found: Floats = np.where(p == 0.0, 1.0 - t**2, 0.5 * t * (t + p))
    return found


def serendipity(places: Floats, xi: Floats) -> Floats:
    """Return N (m, a) of nodes at `places` (a, d), corners and middles of edges, at local points xi (m, d)."""
    found: Floats = _factors(places, xi[:, None, :]).prod(axis=2) * _slant(places, xi)
    return found


def serendipity_gradient(places: Floats, xi: Floats) -> Floats:
    """Return dN/dxi (m, a, d) of serendipity nodes."""
    f, df = _coordinate_factors(places, xi)
    corner = (places != 0.0).all(axis=1)[:, None]
    tilt = np.where(corner, places, 0.0) / 2 ** places.shape[1]
    found: Floats = _product_rule(f, df) * _slant(places, xi)[..., None] + f.prod(axis=2)[..., None] * tilt
    return found


def _coordinate_factors(places: Floats, xi: Floats) -> tuple[Floats, Floats]:
    """Return the factors along each coordinate (m, a, d), and their derivatives."""
    p, t = places, xi[:, None, :]
    return _factors(p, t), np.where(p == 0.0, -2.0 * t, p)


def _factors(p: Floats, t: Floats) -> Floats:
    found: Floats = np.where(p == 0.0, 1.0 - t**2, 1.0 + p * t)
    return found


def _slant(places: Floats, xi: Floats) -> Floats:
    """Return the last factor (m, a): for corners a plane through the middles of their edges."""
    d = places.shape[1]
    found: Floats = np.where((places != 0.0).all(axis=1), (xi @ places.T - d + 1) / 2**d, 1 / 2 ** (d - 1))
    return found


def _product_rule(f: Floats, df: Floats) -> Floats:
    """Return derivatives (m, a, d) of products of factors (m, a, d), each of one coordinate, with derivatives df."""
    d = f.shape[2]
    others = [np.prod([f[..., j] for j in range(d) if j != i], axis=0) for i in range(d)]
    found: Floats = df * np.stack(others, axis=2)
    return found
