"""Fixed points on facets at which weights stand for any part of them: exact for a pressure on the part as it deforms.

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
    """Exponents of the monomials (q, 2): of a degree in all on triangles, in each coordinate on squares."""
    return FACETS[nodes].powers(FACETS[nodes].pressed)


@cache
def places(nodes: int) -> Floats:
    """The points (q, 2) of a facet of so many nodes, in its local coordinates."""
    return FACETS[nodes].lattice(FACETS[nodes].pressed)


@cache
def _coefficients(nodes: int) -> Floats:
    return np.asarray(np.linalg.inv(_monomials(nodes, places(nodes))), dtype=np.float64)


def _monomials(nodes: int, xi: Floats) -> Floats:
    found: Floats = np.prod(xi[:, None, :] ** _powers(nodes), axis=2)
    return found


def basis(nodes: int, xi: Floats) -> Floats:
    """The polynomials (m, q), each one at its own point, at local points xi (m, 2)."""
    found: Floats = _monomials(nodes, xi) @ _coefficients(nodes)
    return found


@cache
def whole(nodes: int) -> Floats:
    """The weights (q,) of a whole facet."""
    xi, w = fine(nodes)
    found: Floats = w @ basis(nodes, xi)
    return found


@cache
def fine(nodes: int, n: int = 10) -> tuple[Floats, Floats]:
    """n^2 Gauss points (q, 2) and weights (q,) of a whole facet, for what is smooth and no polynomial: its area."""
    x, w = np.polynomial.legendre.leggauss(n)
    a, b = (t.ravel() for t in np.meshgrid(x, x))
    return FACETS[nodes].folded(a, b, np.outer(w, w).ravel())
