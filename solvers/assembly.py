"""Sum of energies over shared degrees of freedom, with a sparse pattern that is prepared once."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.energies.energy import Energy, Floats, Ints

COMPILED = 100_000  # local entries from which compiled loops make a pattern: below, loading them takes longer


@dataclass(frozen=True)
class Pattern:
    """The CSR structure of the free-free tangent and, for each energy, where its local entries go."""

    size: int
    indptr: Any  # int32, or int64 where there are too many entries
    indices: Any
    slots: tuple[
        Any, ...
    ]  # of the same type, one (n, k, k) per energy, -1 where a row or a column is constrained

    def matrix(self, data: Floats) -> sparse.csr_matrix:
        """The sparse matrix with these values, sharing the pattern."""
        return sparse.csr_matrix((data, self.indices, self.indptr), shape=(self.size, self.size), copy=False)


def prepare(dofs: int, fixed: Ints, stencils: Sequence[Ints]) -> Pattern:
    """The pattern of all stencils over the degrees of freedom that are not `fixed`."""
    number = np.full(dofs, -1, dtype=np.int64)
    free = _others(dofs, fixed)
    number[free] = np.arange(len(free))
    if sum(s.size * s.shape[1] for s in stencils) > COMPILED:
        return _compiled(number, len(free), stencils)
    local = [number[s] for s in stencils]
    structure = sum((_touched(s, len(free)) for s in local), sparse.csr_matrix((len(free), len(free))))
    structure.sort_indices()
    layout = (structure.indices, structure.indptr)
    place = sparse.csr_matrix((np.arange(structure.nnz), *layout), structure.shape)
    return Pattern(len(free), structure.indptr, structure.indices, tuple(_slots(s, place) for s in local))


def _others(dofs: int, fixed: Ints) -> Ints:
    """The degrees of freedom that are not `fixed`."""
    free = np.ones(dofs, dtype=np.bool_)
    free[fixed] = False
    return np.flatnonzero(free)


def _compiled(number: Ints, size: int, stencils: Sequence[Ints]) -> Pattern:
    """As `prepare`, by compiled loops over blocks of degrees of freedom that always come together, such as a node's."""
    from softmark.solvers.sparse import stencils as loops

    width = 3 if all(_in_threes(s) for s in stencils) else 1
    blocks = [np.ascontiguousarray(s[:, ::width]) // width for s in stencils]
    lengths = np.concatenate([np.full(len(b), b.shape[1]) for b in blocks])
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    count = -(-len(number) // width)
    begin, near = loops.neighbours(starts, np.concatenate([b.ravel() for b in blocks]), count)
    kind = np.int32 if width * width * len(near) < np.iinfo(np.int32).max else np.int64
    indptr, before = np.zeros(size + 1, dtype=kind), np.empty(len(near), dtype=np.int32)
    indices = np.empty(width * width * len(near), dtype=kind)
    loops.columns(begin, near, number, width, indptr, indices, before)
    slots = tuple(np.empty((*s.shape, s.shape[1]), dtype=kind) for s in stencils)
    for b, places in zip(blocks, slots, strict=True):
        loops.slots(b, begin, near, before, number, width, indptr, places)
    return Pattern(size, indptr, indices[: indptr[-1]].copy(), slots)


def _in_threes(stencil: Ints) -> bool:
    """Whether each stencil is made of runs 3 i, 3 i + 1, 3 i + 2."""
    if stencil.shape[1] % 3:
        return False
    first = stencil[:, ::3]
    same = all(np.array_equal(first + c, stencil[:, c::3]) for c in (1, 2))
    return same and not np.any(first % 3)


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
    slots = np.full(keep.shape, -1, dtype=np.int32 if place.nnz < np.iinfo(np.int32).max else np.int64)
    slots[keep] = np.asarray(place[rows[keep], columns[keep]]).ravel()
    return slots


class Assembly:
    """Value, gradient and tangent of `internal` energies plus `load` times the `loads`."""

    def __init__(
        self,
        dofs: int,
        fixed: Ints,
        internal: Sequence[Energy],
        loads: Sequence[Energy],
        points: Floats | None = None,
    ) -> None:
        self.dofs = dofs
        self.internal, self.loads = tuple(internal), tuple(loads)
        self.free = _others(dofs, fixed)
        self.points = points  # (dofs / 3, 3), where unknowns are three displacements of each point
        self.conservative = all(e.conservative for e in (*self.internal, *self.loads))
        self.saddle = any(getattr(e, "saddle", False) for e in self.internal)  # pressures are unknowns: of most energy
        self.pattern = prepare(dofs, fixed, [e.stencils for e in (*self.internal, *self.loads)])

    def with_internal(self, internal: Sequence[Energy]) -> Assembly:
        """The same loads and the same pattern, for other energies on the same stencils."""
        other = copy(self)
        other.internal = tuple(internal)
        return other

    def modes(self) -> Floats | None:
        """Rigid motions of the free degrees of freedom (n, 6); None where these are not known to be displacements."""
        from softmark.solvers.sparse.motions import rigid_motions

        return None if self.points is None else rigid_motions(self.points, self.free)

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
