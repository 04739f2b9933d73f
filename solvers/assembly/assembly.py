"""Sum of energies over shared degrees of freedom, with a sparsity pattern that is prepared once."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.assembly.sparsity_patterns import others, prepare
from softmark.solvers.energies.energy import DynamicPatternEnergy, Energy, Floats, Ints


class Assembly:
    """Value, gradient and tangent of `internal` energies plus `load` times the `loads`, in numbers of one `kind`."""

    kind: Any = np.float64

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
        self.free = others(dofs, fixed)
        self.points = points  # (dofs / 3, 3), where unknowns are three displacements of each point
        self.conservative = all(e.conservative for e in (*self.internal, *self.loads))
        self.saddle = any(e.saddle for e in self.internal)
        self.pattern = prepare(dofs, fixed, [e.stencils for e in (*self.internal, *self.loads)])
        self._posed: tuple[Sequence[Energy], float, list[tuple[Energy, float]]] = (), 0.0, []

    def with_internal(self, internal: Sequence[Energy]) -> Assembly:
        """The same loads and the same pattern, for other energies on the same stencils."""
        other = copy(self)
        other.internal = tuple(internal)
        return other

    def acting(self, internal: Sequence[Energy], loads: Sequence[Energy]) -> Assembly:
        """The same pattern for other energies and other loads on the same stencils."""
        other = self.with_internal(internal)
        other.loads = tuple(loads)
        other.conservative = all(e.conservative for e in (*other.internal, *other.loads))
        return other

    def joined(self, loads: Sequence[Energy]) -> Assembly:
        """The same for other loads, of which some have more stencils than before, or fewer, of the same elements."""
        number = np.full(self.dofs, -1)
        number[self.free] = np.arange(len(self.free))
        slots = [*self.pattern.slots]
        for i, (old, new) in enumerate(zip(self.loads, loads, strict=True), len(self.internal)):
            if not np.array_equal(old.stencils, new.stencils):
                slots[i] = self.pattern.places(number, new.stencils)
        other = self.acting(self.internal, loads)
        other.pattern = replace(self.pattern, slots=tuple(slots))
        return other

    def modes(self) -> Floats | None:
        """Rigid motions of the free degrees of freedom (n, 6); None where these are not known to be displacements."""
        from softmark.solvers.sparse.rigid_body_modes import rigid_motions

        return None if self.points is None else rigid_motions(self.points, self.free)

    def _scaled(self, load: float) -> list[tuple[Energy, float]]:
        return [(e, 1.0) for e in self.internal] + self.loaded(load)

    def loaded(self, load: float) -> list[tuple[Energy, float]]:
        """The loads at their share, and what each is to be multiplied by: those that are driven are what they are.

        Those of the last share are kept, with all that they have found out there.
        """
        loads, share, known = self._posed
        if loads is not self.loads or share != load:
            each: list[Any] = list(self.loads)
            known = [(e.at(load), 1.0) if e.driven else (e, load) for e in each]
            self._posed = self.loads, load, known
        return known

    def value(self, x: Floats, load: float) -> float:
        """Total potential energy, J; infinite outside the domain of a law."""
        return sum(scale * e.value(x) for e, scale in self._scaled(load) if scale != 0.0)

    def gradient(self, x: Floats, load: float) -> Floats:
        """Out-of-balance force on every degree of freedom (dofs,), supports included (there: reactions)."""
        g: Floats = np.zeros(self.dofs, dtype=self.kind)
        for energy, scale in self._scaled(load):
            energy.add_gradient(x, g, scale)
        return g

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient, N."""
        return sum(e.rounding(x) for e in (*self.internal, *self.loads))

    def tangent(self, x: Floats, load: float, projected: bool = False) -> sparse.csr_matrix:
        """Tangent stiffness over the free degrees of freedom."""
        data: Floats = np.zeros(len(self.pattern.indices), dtype=self.kind)
        for (energy, scale), slots in zip(self._scaled(load), self.pattern.slots, strict=True):
            if energy.stencils.size:
                energy.add_hessian(x, data, slots, scale, projected)
        K = self.pattern.matrix(data)
        for energy, scale in self._scaled(load):
            if isinstance(energy, DynamicPatternEnergy):
                K = (K + scale * energy.matrix(x, projected)[self.free][:, self.free]).astype(self.kind).tocsr()
        return K

    def limit(self, x: Floats, d: Floats) -> float:
        """The part of an increment d (dofs,), at most 1, that can be gone before bodies would meet."""
        each = (e for e in (*self.internal, *self.loads) if isinstance(e, DynamicPatternEnergy))
        return min((e.limit(x, d) for e in each), default=1.0)
