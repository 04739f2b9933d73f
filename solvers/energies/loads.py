"""Loads: dead nodal forces, which have an energy, and follower pressure, which has none."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import moments
from softmark.solvers.elements.facets import FACETS
from softmark.solvers.energies.energy import Energy, Floats, Ints, no_stencils


@dataclass(frozen=True)
class DeadForces(Energy):
    """Nodal forces `f` (dofs,) in N that keep their direction: E = -f . x."""

    f: Floats
    conservative: bool = True

    @property
    def stencils(self) -> Ints:
        """None: it has no Hessian."""
        return no_stencils()

    def value(self, x: Floats) -> float:
        """Potential of the forces, J."""
        return -float(self.f @ x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """g -= scale f."""
        g -= scale * self.f

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Nothing: the forces are constant."""

    def rounding(self, x: Floats) -> float:
        """None: the forces are constant."""
        return 0.0


@dataclass(frozen=True)
class FollowerPressure(Energy):
    """Pressure `p` (Pa) on facets `faces` (f, k) of three, six or four nodes, along their current inward normal.

    Force on node a: -p int N_a (dx/dxi x dx/deta) dxi deta, by a quadrature that is exact for it; its tangent is
    not symmetric on a surface with a free edge (Bonet and Wood 2008, section 9.5), so there is no energy. `weights`
    are there where it acts on parts of facets: at the points of `elements.moments`, exact for it as well.
    """

    points: Floats  # (n, 3) undeformed
    faces: Ints
    p: float
    weights: Floats | None = None  # (f, q)
    conservative: bool = False

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom for each node of a facet (f, 3 k)."""
        return (3 * self.faces[:, :, None] + np.arange(3)).reshape(len(self.faces), -1)

    @cached_property
    def _rule(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Shape functions N, dN/dxi and dN/deta (q, k), and weights (1 or f, q)."""
        nodes = self.faces.shape[1]
        facet = FACETS[nodes]
        xi, weights = facet.quadrature()
        if self.weights is not None:
            xi, weights = moments.places(nodes), self.weights
        dN = facet.gradient(xi)
        return facet.shape(xi), dN[:, :, 0], dN[:, :, 1], np.atleast_2d(weights)

    def value(self, x: Floats) -> float:
        """There is none: follower forces on an open surface have no potential."""
        raise TypeError("a follower load has no energy")

    def _tangents(self, x: Floats) -> tuple[Floats, Floats]:
        """dx/dxi and dx/deta (f, q, 3)."""
        _, first, second, _ = self._rule
        y = (self.points + x.reshape(-1, 3))[self.faces]
        return np.einsum("qk,fki->fqi", first, y), np.einsum("qk,fki->fqi", second, y)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Minus the nodal forces, N."""
        N, _, _, w = self._rule
        minus_force = np.einsum("qa,fqi->fai", N, w[:, :, None] * np.cross(*self._tangents(x)))
        minus_force *= scale * self.p
        np.add.at(g.reshape(-1, 3), self.faces, minus_force)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Load stiffness, not symmetric; left out of a projected tangent, which must stay definite."""
        if projected:
            return
        N, first, second, w = self._rule
        a, b = (w[:, :, None] * tangent for tangent in self._tangents(x))
        # d(a x b) = -[b]x da + [a]x db
        block = np.einsum("qa,qb,fqij->faibj", N, second, _cross_matrix(a), optimize=True)
        block -= np.einsum("qa,qb,fqij->faibj", N, first, _cross_matrix(b), optimize=True)
        block *= scale * self.p
        keep = slots >= 0
        np.add.at(data, slots[keep], block.reshape(slots.shape)[keep])

    def rounding(self, x: Floats) -> float:
        """Far below that of the body that carries it."""
        return 0.0


def _cross_matrix(a: Floats) -> Floats:
    """[a]x (..., 3, 3) with [a]x b = a x b."""
    m = np.zeros((*a.shape, 3))
    m[..., 0, 1], m[..., 0, 2], m[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    return m - m.swapaxes(-1, -2)
