"""Sum of energies over shared degrees of freedom, with a sparse pattern that is prepared once."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Energy, Floats, Ints


@dataclass(frozen=True)
class Pattern:
    """The CSR structure of the free-free tangent and, for each energy, where its local entries go."""

    size: int
    indptr: Ints
    indices: Ints
    slots: tuple[Ints, ...]  # one (n, k, k) per energy, -1 where a row or a column is constrained

    def matrix(self, data: Floats) -> sparse.csr_matrix:
        """The sparse matrix with these values, sharing the pattern."""
        return sparse.csr_matrix((data, self.indices, self.indptr), shape=(self.size, self.size), copy=False)


def prepare(dofs: int, fixed: Ints, stencils: Sequence[Ints]) -> Pattern:
    """The pattern of all stencils over the degrees of freedom that are not `fixed`."""
    number = np.full(dofs, -1, dtype=np.int64)
    free = np.setdiff1d(np.arange(dofs), fixed)
    number[free] = np.arange(len(free))
    local = [number[s] for s in stencils]
    structure = sum((_touched(s, len(free)) for s in local), sparse.csr_matrix((len(free), len(free))))
    structure.sort_indices()
    layout = (structure.indices, structure.indptr)
    place = sparse.csr_matrix((np.arange(structure.nnz), *layout), structure.shape)
    return Pattern(len(free), structure.indptr, structure.indices, tuple(_slots(s, place) for s in local))


def _touched(stencil: Ints, size: int) -> sparse.csr_matrix:
    """Non-zero where two degrees of freedom share a stencil: B B^T, B their incidence with the stencils."""
    which, column = np.nonzero(stencil >= 0)
    rows = stencil[which, column]
    B = sparse.csr_matrix((np.ones(len(rows)), (rows, which)), shape=(size, len(stencil)))
    return B @ B.T


def _slots(stencil: Ints, place: sparse.csr_matrix) -> Ints:
    """Where every local entry goes (n, k, k), -1 where its row or its column is constrained."""
    rows, columns = np.broadcast_arrays(stencil[:, :, None], stencil[:, None, :])
    keep = (rows >= 0) & (columns >= 0)
    slots = np.full(keep.shape, -1, dtype=np.int64)
    slots[keep] = np.asarray(place[rows[keep], columns[keep]]).ravel()
    return slots


class Assembly:
    """Value, gradient and tangent of `internal` energies plus `load` times the `loads`."""

    def __init__(self, dofs: int, fixed: Ints, internal: Sequence[Energy], loads: Sequence[Energy]) -> None:
        self.dofs = dofs
        self.internal, self.loads = tuple(internal), tuple(loads)
        self.free = np.setdiff1d(np.arange(dofs), fixed)
        self.conservative = all(e.conservative for e in (*self.internal, *self.loads))
        self.pattern = prepare(dofs, fixed, [e.stencils for e in (*self.internal, *self.loads)])

    def with_internal(self, internal: Sequence[Energy]) -> Assembly:
        """The same loads and the same pattern, for other energies on the same stencils."""
        other = copy(self)
        other.internal = tuple(internal)
        return other

    def _scaled(self, load: float) -> list[tuple[Energy, float]]:
        return [(e, 1.0) for e in self.internal] + [(e, load) for e in self.loads]

    def value(self, x: Floats, load: float) -> float:
        """Total potential energy, J; infinite outside the domain of a law."""
        return sum(scale * e.value(x) for e, scale in self._scaled(load) if scale != 0.0)

    def gradient(self, x: Floats, load: float) -> Floats:
        """Out-of-balance force on every degree of freedom (dofs,), supports included (there: reactions)."""
        g = np.zeros(self.dofs)
        for energy, scale in self._scaled(load):
            energy.add_gradient(x, g, scale)
        return g

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient, N."""
        return sum(e.rounding(x) for e in (*self.internal, *self.loads))

    def tangent(self, x: Floats, load: float, projected: bool = False) -> sparse.csr_matrix:
        """Tangent stiffness over the free degrees of freedom."""
        data = np.zeros(len(self.pattern.indices))
        for (energy, scale), slots in zip(self._scaled(load), self.pattern.slots, strict=True):
            if energy.stencils.size:
                energy.add_hessian(x, data, slots, scale, projected)
        return self.pattern.matrix(data)
