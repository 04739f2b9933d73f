"""Assembly: a sum of energies over shared degrees of freedom, with a precomputed sparsity pattern."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse

from softmark.solvers.assembly.sparsity_patterns import build_pattern, free_dofs
from softmark.solvers.energies.energy import DynamicPatternEnergy, Energy, Floats, Ints
from softmark.solvers.runtime.work_count import (
    count_contact_search,
    count_forces,
    count_rigid_contacts,
    count_setup,
    count_stiffness,
)


class Assembly:
    """Sum of `internal` energies and of `loads` times a load fraction, over shared degrees of freedom.

    Each energy has a name. Energies of a sequence are named by a word and their number. Value, gradient and tangent are
    computed in the floating-point type `kind`.
    """

    kind: Any = np.float64

    def __init__(
        self,
        dofs: int,
        fixed: Ints,
        internal: Mapping[str, Energy] | Sequence[Energy],
        loads: Mapping[str, Energy] | Sequence[Energy],
        points: Floats | None = None,
    ) -> None:
        """Compute the sparsity pattern of all energies over `dofs` degrees of freedom, of which some are `fixed`.

        `points` (dofs / 3, 3), m, are given only if the unknowns are three displacements of each point.
        """
        self.dofs = dofs
        inner = internal if isinstance(internal, Mapping) else number_energies("cells", internal)
        outer = loads if isinstance(loads, Mapping) else number_energies("load", loads)
        self.names = tuple(inner), tuple(outer)
        self.internal, self.loads = tuple(inner.values()), tuple(outer.values())
        self.free = free_dofs(dofs, fixed)
        self.points = points  # (dofs / 3, 3), m, if unknowns are three displacements of each point
        self.conservative = all(e.conservative for e in (*self.internal, *self.loads))
        self.saddle = any(e.saddle for e in self.internal)
        for energy in (*self.internal, *self.loads):
            count_setup(energy.stencils)
        self.pattern = build_pattern(dofs, fixed, [e.stencils for e in (*self.internal, *self.loads)])
        self._posed: tuple[Sequence[Energy], float, list[tuple[Energy, float]]] = (), 0.0, []

    def with_internal(self, internal: Sequence[Energy]) -> Assembly:
        """Return a copy with other internal energies on the same degrees of freedom; loads and pattern are the same."""
        other = copy(self)
        other.internal = tuple(internal)
        return other

    def with_internal_and_loads(self, internal: Sequence[Energy], loads: Sequence[Energy]) -> Assembly:
        """Return a copy with other internal energies and loads on the same degrees of freedom and pattern."""
        other = self.with_internal(internal)
        other.loads = tuple(loads)
        other.conservative = all(e.conservative for e in (*other.internal, *other.loads))
        return other

    def internal_energies(self, name: str) -> tuple[Energy, ...]:
        """Return all internal energies whose name is this word and a number, such as `cells 0` for `cells`."""
        return tuple(e for n, e in zip(self.names[0], self.internal, strict=True) if n.rpartition(" ")[0] == name)

    @property
    def rigid_contacts(self) -> dict[str, Any]:
        """Contacts with rigid bodies among the loads, by name."""
        return {n: e for n, e in zip(self.names[1], self.loads, strict=True) if e.not_proportional}

    @property
    def proportional_loads(self) -> dict[str, Energy]:
        """Loads that are proportional to the load factor, by name: all but contacts with rigid bodies."""
        return {n: e for n, e in zip(self.names[1], self.loads, strict=True) if not e.not_proportional}

    def rigid_contacts_at(self, load: float) -> dict[str, Any]:
        """Return the contacts with rigid bodies, moved to their positions at a load factor, by name."""
        return {name: contact.at(load) for name, contact in self.rigid_contacts.items()}

    @property
    def pair_contacts(self) -> dict[str, DynamicPatternEnergy]:
        """Contacts between deformable surfaces among the internal energies, by name."""
        pairs = zip(self.names[0], self.internal, strict=True)
        return {n: e for n, e in pairs if isinstance(e, DynamicPatternEnergy)}

    def with_energies(self, others: Mapping[str, Energy]) -> Assembly:
        """Return a copy in which the given energies replace those of the same names.

        Loads may act on other degrees of freedom within the sparsity pattern. Raises KeyError for unknown names.
        """
        if unknown := others.keys() - {name for names in self.names for name in names}:
            raise KeyError(f"there are no energies with the names {sorted(unknown)}")
        internal, loads = (
            [others.get(name, e) for name, e in zip(names, energies, strict=True)]
            for names, energies in zip(self.names, (self.internal, self.loads), strict=True)
        )
        return self.with_internal(internal).with_loads(loads)

    def with_loads(self, loads: Sequence[Energy]) -> Assembly:
        """Return a copy with other loads, which may act on other degrees of freedom.

        The sparsity pattern stays the same, and the new loads must lie within it.
        """
        number = np.full(self.dofs, -1)
        number[self.free] = np.arange(len(self.free))
        slots = [*self.pattern.slots]
        for i, (old, new) in enumerate(zip(self.loads, loads, strict=True), len(self.internal)):
            if not np.array_equal(old.stencils, new.stencils):
                slots[i] = self.pattern.places(number, new.stencils)
        other = self.with_internal_and_loads(self.internal, loads)
        other.pattern = replace(self.pattern, slots=tuple(slots))
        return other

    def rigid_body_modes(self) -> Floats | None:
        """Return the six rigid body modes of the f free degrees of freedom, shape (f, 6).

        Return None if the degrees of freedom are not known to be displacements of points.
        """
        from softmark.solvers.sparse.rigid_body_modes import rigid_motions

        return None if self.points is None else rigid_motions(self.points, self.free)

    def _energies_with_factors(self, load: float) -> list[tuple[Energy, float]]:
        """Return all energies, each with the factor by which it is multiplied at a load fraction."""
        return [(e, 1.0) for e in self.internal] + self.loads_with_factors(load)

    def loads_with_factors(self, load: float) -> list[tuple[Energy, float]]:
        """Return the loads, each with the factor by which it is multiplied at a load fraction.

        The factor is the load fraction. A load that is `not_proportional` is instead evaluated at the load fraction and
        has the factor 1. The result for the last load fraction is cached.
        """
        loads, share, known = self._posed
        if loads is not self.loads or share != load:
            each: list[Any] = list(self.loads)
            count_rigid_contacts(len(self.rigid_contacts))
            known = [(e.at(load), 1.0) if e.not_proportional else (e, load) for e in each]
            self._posed = self.loads, load, known
        return known

    def value(self, x: Floats, load: float) -> float:
        """Return the total potential energy, J; infinite outside the domain of a law."""
        return sum(scale * e.value(x) for e, scale in self._energies_with_factors(load) if scale != 0.0)

    def gradient(self, x: Floats, load: float) -> Floats:
        """Return the residual force on every degree of freedom (dofs,), N; at supports these are reactions."""
        internal, external = self.forces(x, load)
        return internal + external

    def forces(self, x: Floats, load: float) -> tuple[Floats, Floats]:
        """Return the internal forces and the negative external forces (dofs,), N; their sum is the gradient.

        Contacts with rigid bodies count as external.
        """
        internal: Floats = np.zeros(self.dofs, dtype=self.kind)
        external: Floats = np.zeros(self.dofs, dtype=self.kind)
        for energy in self.internal:
            count_forces(energy.stencils)
            energy.add_gradient(x, internal)
        for energy, scale in self.loads_with_factors(load):
            count_forces(energy.stencils)
            energy.add_gradient(x, external, scale)
        return internal, external

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error of the gradient at x, N."""
        return sum(e.rounding(x) for e in (*self.internal, *self.loads))

    def tangent(self, x: Floats, load: float, projected: bool = False) -> sparse.csr_matrix:
        """Return the sparse tangent stiffness over the free degrees of freedom, N/m.

        If `projected`, the local blocks are made positive semi-definite.
        """
        data: Floats = np.zeros(len(self.pattern.indices), dtype=self.kind)
        for (energy, scale), slots in zip(self._energies_with_factors(load), self.pattern.slots, strict=True):
            if energy.stencils.size:
                count_stiffness(energy.stencils)
                energy.add_hessian(x, data, slots, scale, projected)
        K = self.pattern.matrix(data)
        for energy, scale in self._energies_with_factors(load):
            if isinstance(energy, DynamicPatternEnergy):
                count_contact_search()
                K = (K + scale * energy.matrix(x, projected)[self.free][:, self.free]).astype(self.kind).tocsr()
        return K

    def limit(self, x: Floats, d: Floats) -> float:
        """Return the largest fraction, at most 1, of an increment d (dofs,) of x (dofs,) without collision.

        It is 1 without contact between deformable surfaces.
        """
        each = (e for e in (*self.internal, *self.loads) if isinstance(e, DynamicPatternEnergy))
        return min((e.limit(x, d) for e in each), default=1.0)


def number_energies(name: str, energies: Sequence[Energy]) -> dict[str, Energy]:
    """Return energies by a name with their index: `cells 0`, `cells 1`. No name of a scene contains a space."""
    return {f"{name} {number}": energy for number, energy in enumerate(energies)}
