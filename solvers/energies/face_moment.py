"""A moment on a part of a surface, without a force, that keeps its size and its direction in space."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints

_CROSS = np.zeros((3, 3, 3))  # (a x b)_i = _CROSS[i, j, k] a_j b_k
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _CROSS[_i, _j, _k], _CROSS[_i, _k, _j] = 1.0, -1.0


@dataclass(frozen=True)
class FaceMoment(Energy):
    """Traction t = c x (x - middle) per undeformed area on a part of a surface, x where it is now.

    `nodes` (k,) are those of its facets, `products` (k, k) the integrals of N_a N_b over its undeformed area, m^2. With
    m = products less what moves with the middle, y = m x and J = int |r|^2 I - r r^T of the part as it lies now,

        f_a = c x y_a,  J c = moment:

    the forces sum to nothing and their moment is what is given, in every state. This is the moment that coupling
    elements put on a surface by equal weights per area; it has no energy, since it stays in space. The tangent has an
    entry for every pair of nodes, and is not symmetric.
    """

    points: Floats  # (n, 3) undeformed
    nodes: Ints
    products: Floats
    moment: Floats  # (3,) N m
    conservative: bool = False

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom of every node of the part (1, 3 k)."""
        found: Ints = (3 * self.nodes[:, None] + np.arange(3)).reshape(1, -1)
        return found

    @cached_property
    def _about_middle(self) -> Floats:
        """m (k, k)."""
        n = self.products.sum(axis=1)
        found: Floats = self.products - np.outer(n, n) / n.sum()
        return found

    def _state(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """y (k, 3), J (3, 3) and c (3,)."""
        r = (self.points + x.reshape(-1, 3))[self.nodes]
        y = self._about_middle @ r
        spread = y.T @ r
        J = np.trace(spread) * np.eye(3) - spread
        return y, J, np.linalg.solve(J, self.moment)

    def value(self, x: Floats) -> float:
        """There is none: what such a moment does depends on the way."""
        raise TypeError("a moment that stays in space has no energy")

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Minus the nodal forces, N."""
        y, _, c = self._state(x)
        g.reshape(-1, 3)[self.nodes] -= scale * np.cross(c, y)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """-[c]x m_ab - [y_a]x J^-1 (2 c y_b^T - (y_b . c) I - y_b c^T); left out of a projected tangent."""
        if projected:
            return
        y, J, c = self._state(x)
        changes = 2.0 * np.einsum("i,bj->bij", c, y) - np.einsum("bi,j->bij", y, c)
        changes -= (y @ c)[:, None, None] * np.eye(3)
        across = np.einsum("ijk,aj->aik", _CROSS, y)
        block = -np.einsum("aik,bkj->aibj", across, np.linalg.inv(J) @ changes, optimize=True)
        block -= np.einsum("ab,ij->aibj", self._about_middle, np.einsum("ikj,k->ij", _CROSS, c))
        # what is held, at -1, is counted in front and left out
        data += np.bincount(slots.ravel() + 1, block.ravel(), len(data) + 1)[1:] * scale

    def rounding(self, x: Floats) -> float:
        """Far below that of the body that carries it."""
        return 0.0
