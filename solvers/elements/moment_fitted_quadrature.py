"""Moment-fitted quadrature on parts of facets: fixed points, with weights exact for a pressure on the deforming part.

The weight of a point is the integral over the part of the polynomial that is one there and zero at the other points.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from softmark.solvers.elements.boundary_facets import FACETS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


@cache
def _powers(nodes: int) -> Floats:
    """Return exponents of the monomials (q, 2): of a total degree on triangles, in each coordinate on squares."""
    return FACETS[nodes].powers(FACETS[nodes].pressed)


@cache
def point_positions(nodes: int) -> Floats:
    """Return the points (q, 2) of a facet with `nodes` nodes, in its local coordinates."""
    return FACETS[nodes].lattice(FACETS[nodes].pressed)


@cache
def _coefficients(nodes: int) -> Floats:
    return np.asarray(np.linalg.inv(_monomials(nodes, point_positions(nodes))), dtype=np.float64)


def _monomials(nodes: int, xi: Floats) -> Floats:
    found: Floats = np.prod(xi[:, None, :] ** _powers(nodes), axis=2)
    return found


def basis_polynomials(nodes: int, xi: Floats) -> Floats:
    """Return the polynomials (m, q), each one at its own point, at local points xi (m, 2)."""
    found: Floats = _monomials(nodes, xi) @ _coefficients(nodes)
    return found


@cache
def full_facet_weights(nodes: int) -> Floats:
    """Return the weights (q,) of a whole facet."""
    xi, w = gauss_rule(nodes)
    found: Floats = w @ basis_polynomials(nodes, xi)
    return found


@cache
def gauss_rule(nodes: int, n: int = 10) -> tuple[Floats, Floats]:
    """Return n^2 Gauss points (q, 2) and weights (q,) of a facet, for smooth non-polynomial functions (its area)."""
    x, w = np.polynomial.legendre.leggauss(n)
    a, b = (t.ravel() for t in np.meshgrid(x, x))
    return FACETS[nodes].folded(a, b, np.outer(w, w).ravel())
