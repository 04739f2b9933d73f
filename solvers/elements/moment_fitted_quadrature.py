"""Moment-fitted quadrature on a part of a facet: fixed points, with weights that depend on the part.

For a pressure on the part, the rule stays exact while the facet deforms. The weight of a point is the integral over the
part of a basis polynomial, which is one at this point and zero at all other points.
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
def _monomial_exponents(nodes: int) -> Floats:
    """Return the exponents (q, 2) of the monomials for a facet with `nodes` nodes.

    They span the integrands of a pressure: a shape function times the area vector.
    """
    return FACETS[nodes].monomial_exponents(FACETS[nodes].integrand_degree)


@cache
def point_positions(nodes: int) -> Floats:
    """Return the local coordinates (q, 2) of the quadrature points on a facet with `nodes` nodes."""
    return FACETS[nodes].lattice(FACETS[nodes].integrand_degree)


@cache
def _basis_coefficients(nodes: int) -> Floats:
    """Return the coefficients (q, q) of the basis polynomials with respect to the monomials."""
    return np.asarray(np.linalg.inv(_monomial_values(nodes, point_positions(nodes))), dtype=np.float64)


def _monomial_values(nodes: int, xi: Floats) -> Floats:
    """Return the values (m, q) of the monomials at local points xi (m, 2)."""
    found: Floats = np.prod(xi[:, None, :] ** _monomial_exponents(nodes), axis=2)
    return found


def basis_polynomials(nodes: int, xi: Floats) -> Floats:
    """Return the values (m, q) of the basis polynomials at local points xi (m, 2) of a facet with `nodes` nodes.

    Each polynomial is one at one quadrature point and zero at all others.
    """
    found: Floats = _monomial_values(nodes, xi) @ _basis_coefficients(nodes)
    return found


@cache
def full_facet_weights(nodes: int) -> Floats:
    """Return the weights (q,) of the quadrature points for the whole facet."""
    xi, w = gauss_rule(nodes)
    found: Floats = w @ basis_polynomials(nodes, xi)
    return found


@cache
def gauss_rule(nodes: int, n: int = 10) -> tuple[Floats, Floats]:
    """Return a Gauss rule of a facet with n^2 points (q, 2) and weights (q,), for functions that are no polynomials.

    The area of a curved facet is the integral of such a function.
    """
    x, w = np.polynomial.legendre.leggauss(n)
    a, b = (t.ravel() for t in np.meshgrid(x, x))
    return FACETS[nodes].rule_from_square(a, b, np.outer(w, w).ravel())
