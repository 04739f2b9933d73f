"""Quadratic shape functions on squares and cubes [-1, 1]^d, from the local points of their nodes.

Each coordinate of a node is -1, 0 or 1. Lagrange shape functions are products of quadratic polynomials in one
coordinate. Serendipity shape functions have nodes only at corners p and at the middles of edges. At a corner, N =
prod(1 + p_i xi_i) (p . xi - d + 1) / 2^d. In the middle of an edge along coordinate i, N = (1 - xi_i^2) prod(1 + p_j
xi_j) / 2^(d - 1).
Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
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


def three_point_tensor_gauss_rule(d: int) -> tuple[Floats, Floats]:
    """Return the points (3^d, d) and weights (3^d,) of the Gauss rule with three points along each direction.

    The rule is exact for polynomials of degree five in each coordinate.
    """
    t, w = (-(0.6**0.5), 0.0, 0.6**0.5), (5 / 9, 8 / 9, 5 / 9)
    return np.array(list(product(t, repeat=d))), np.prod(np.array(list(product(w, repeat=d))), axis=1)


def lagrange(places: Floats, xi: Floats) -> Floats:
    """Return the Lagrange shape functions N (m, a) of nodes at `places` (a, d), at local points xi (m, d)."""
    found: Floats = _evaluate_lagrange(places, xi[:, None, :]).prod(axis=2)
    return found


def lagrange_gradient(places: Floats, xi: Floats) -> Floats:
    """Return dN/dxi (m, a, d) of the Lagrange shape functions of nodes at `places` (a, d), at points xi (m, d)."""
    return _differentiate_products(*_polynomials_with_derivatives(places, xi))


def _polynomials_with_derivatives(places: Floats, xi: Floats) -> tuple[Floats, Floats]:
    """Return the Lagrange polynomial of each node in each coordinate, and its derivative, both (m, a, d)."""
    p, t = places, xi[:, None, :]
    return _evaluate_lagrange(p, t), np.where(p == 0.0, -2.0 * t, t + 0.5 * p)


def _evaluate_lagrange(p: Floats, t: Floats) -> Floats:
    """Return the values at t of the quadratic Lagrange polynomials of the nodes -1, 0 and 1.

    `p` selects the node, -1, 0 or 1, at which the polynomial is one.
    """
    found: Floats = np.where(p == 0.0, 1.0 - t**2, 0.5 * t * (t + p))
    return found


def serendipity(places: Floats, xi: Floats) -> Floats:
    """Return the serendipity shape functions N (m, a) of nodes at `places` (a, d), at local points xi (m, d).

    Nodes are corners and middles of edges.
    """
    found: Floats = _serendipity_factors(places, xi[:, None, :]).prod(axis=2) * _remaining_serendipity_factor(
        places, xi
    )
    return found


def serendipity_gradient(places: Floats, xi: Floats) -> Floats:
    """Return dN/dxi (m, a, d) of the serendipity shape functions of nodes at `places` (a, d), at xi (m, d)."""
    f, df = _factors_with_derivatives(places, xi)
    corner = (places != 0.0).all(axis=1)[:, None]
    tilt = np.where(corner, places, 0.0) / 2 ** places.shape[1]
    found: Floats = (
        _differentiate_products(f, df) * _remaining_serendipity_factor(places, xi)[..., None]
        + f.prod(axis=2)[..., None] * tilt
    )
    return found


def _factors_with_derivatives(places: Floats, xi: Floats) -> tuple[Floats, Floats]:
    """Return the factor of each serendipity function in each coordinate, and its derivative, both (m, a, d)."""
    p, t = places, xi[:, None, :]
    return _serendipity_factors(p, t), np.where(p == 0.0, -2.0 * t, p)


def _serendipity_factors(p: Floats, t: Floats) -> Floats:
    """Return one factor of each serendipity function at t: 1 - t^2 for a node coordinate p = 0, else 1 + p t."""
    found: Floats = np.where(p == 0.0, 1.0 - t**2, 1.0 + p * t)
    return found


def _remaining_serendipity_factor(places: Floats, xi: Floats) -> Floats:
    """Return the last factor (m, a) of each serendipity function at local points xi (m, d).

    For a corner it is a linear function that vanishes at the middles of the corner's edges; for a mid-edge node it is
    the constant 1 / 2^(d - 1).
    """
    d = places.shape[1]
    found: Floats = np.where((places != 0.0).all(axis=1), (xi @ places.T - d + 1) / 2**d, 1 / 2 ** (d - 1))
    return found


def _differentiate_products(f: Floats, df: Floats) -> Floats:
    """Return the derivatives (m, a, d) of products of factors.

    `f` (m, a, d) are the factors, each a function of one coordinate, and `df` (m, a, d) their derivatives.
    """
    d = f.shape[2]
    others = [np.prod([f[..., j] for j in range(d) if j != i], axis=0) for i in range(d)]
    found: Floats = df * np.stack(others, axis=2)
    return found
