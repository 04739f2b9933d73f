"""Operations on the local Hessian blocks of energies, and rod energies that are sums over elements."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from softmark.solvers.energies.energy import Energy, Floats, Ints


def add_blocks(blocks: Floats, slots: Ints, data: Floats) -> None:
    """Add local blocks (m, k, l) to the matrix values: data[slots] += blocks, with slots (m, k, l).

    Entries of fixed degrees of freedom have slot -1 and are skipped.
    """
    # that is shifted by one and dropped
    data += np.bincount(slots.ravel() + 1, blocks.ravel(), len(data) + 1)[1:]


def project_semidefinite(blocks: Floats) -> Floats:
    """Return the nearest positive semi-definite blocks (m, k, k): negative eigenvalues become zero."""
    w, V = np.linalg.eigh(blocks)
    found: Floats = (V * np.maximum(w, 0.0)[:, None, :]) @ V.swapaxes(1, 2)
    return found


def cross_matrix(a: Floats) -> Floats:
    """Return the cross-product matrices [a]x (..., 3, 3), with [a]x b = a x b."""
    m = np.zeros((*a.shape, 3))
    m[..., 0, 1], m[..., 0, 2], m[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    return m - m.swapaxes(-1, -2)


class RodElementEnergy(Energy):
    """An energy that is a sum over two-node rod elements; a state holds position and quaternion of each node."""

    if TYPE_CHECKING:

        @property
        def elements(self) -> Ints:
            """The two nodes of each element (m, 2)."""

    @cached_property
    def stencils(self) -> Ints:
        """Degrees of freedom of each element, six for each of its two nodes (m, 12)."""
        found: Ints = (6 * self.elements[:, :, None] + np.arange(6)).reshape(-1, 12)
        return found

    def local_forces(self, x: Floats) -> Floats:
        """Return the gradient of each element (m, 12), N and N m."""
        raise NotImplementedError(f"{type(self).__name__} gives no local forces")

    def local_hessians(self, x: Floats) -> Floats:
        """Return the Hessian of each element (m, 12, 12); it is symmetric even out of equilibrium."""
        raise NotImplementedError(f"{type(self).__name__} gives no local Hessians")

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the forces on the nodes, N, and the moments about the material axes, N m."""
        g += np.bincount(self.stencils.ravel(), (scale * self.local_forces(x)).ravel(), len(g))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the exact Hessian; `projected` sets negative local eigenvalues to zero."""
        local = self.local_hessians(x)
        add_blocks(scale * (project_semidefinite(local) if projected else local), slots, data)
