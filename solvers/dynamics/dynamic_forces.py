"""Forces and matrices of a dynamic problem at one time: an `Assembly` with load factors, and a mass matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.assembly.sparsity_patterns import Pattern, build_pattern
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.load_amplitudes import Amplitude, Constant, StepLoad, linear_step_load, mean_factors
from softmark.solvers.energies.elastic_energy import add_drag
from softmark.solvers.energies.energy import DynamicPatternEnergy, Energy, Floats, Ints
from softmark.solvers.runtime.work_count import count_forces, count_stiffness

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.dynamics.dynamic_contact import DynamicContacts


@dataclass(frozen=True)
class EnergyGradients:
    """Energy gradients (dofs,), N, which are negative forces, separately for internal forces and loads."""

    internal: Floats
    external: Floats

    @property
    def total(self) -> Floats:
        """Sum of all gradients (dofs,), N, which inertia and damping balance."""
        return self.internal + self.external


class DynamicForces:
    """Internal energies, and loads with time-dependent factors, on one sparsity pattern with the mass matrix."""

    def __init__(self, problem: Dynamics) -> None:
        assembly = problem.assembly
        contacts, plain, loads = assembly.rigid_contacts, assembly.proportional_loads, assembly.names[1]
        self.dofs, self.internal, self.loads = assembly.dofs, assembly.internal, tuple(plain.values())
        self.now: tuple[Energy, ...] | None = None  # viscoelastic energies at the start of a step
        amplitudes = dict(zip(loads, problem.amplitudes or (Constant(),) * len(loads), strict=True))
        self.amplitudes = tuple(amplitudes[name] for name in plain)
        self.conservative = all(e.conservative for e in (*self.internal, *self.loads))  # friction is lagged
        self.fixed = np.asarray(problem.fixed, dtype=np.int64)
        self.free = np.setdiff1d(np.arange(self.dofs), self.fixed)
        mass = problem.mass
        self.lumped: Floats | None = mass if isinstance(mass, np.ndarray) else None
        self.M = sparse.diags(mass).tocsr() if isinstance(mass, np.ndarray) else mass.tocsr()
        self.M_free = _canonical_matrix(self.M[self.free][:, self.free])
        self.pattern, self._mass_slots = _extend_pattern_by_mass(assembly, self)
        inner = len(self.internal)
        slots = dict(zip(loads, self.pattern.slots[inner : inner + len(loads)], strict=True))
        self._slots = (*self.pattern.slots[:inner], *(slots[name] for name in plain))
        self.impact: DynamicContacts | None = None
        if contacts or problem.meets:
            own = {name: (contact, amplitudes[name], slots[name]) for name, contact in contacts.items()}
            self.impact = self._make_contacts(own, problem.meets)
        self._repeats = problem.remembering is None and problem.turning is None  # forces depend on the state alone
        self._last: tuple[bytes, Floats] = (b"", np.zeros(0))
        self._blocks = _block_positions(self.pattern, self.free, problem.turning.where) if problem.turning else None

    def _make_contacts(
        self, rigid: Mapping[str, tuple[Any, Amplitude, Ints]], meets: Sequence[DynamicPatternEnergy]
    ) -> DynamicContacts:
        """Return the contacts with rigid bodies and between deformable surfaces.

        `rigid` has, by name, each rigid contact, the amplitude by which its body moves, and its tangent entries.
        """
        from softmark.solvers.dynamics.dynamic_contact import DynamicContacts

        contacts, amplitudes, slots = zip(*rigid.values(), strict=True) if rigid else ((), (), ())
        number = np.full(self.dofs, -1)
        number[self.free] = np.arange(len(self.free))
        return DynamicContacts(
            contacts, amplitudes, slots, meets, lambda stencils: self.pattern.places(number, stencils)
        )

    @property
    def rotates_without_contact(self) -> bool:
        """True if there are rotations among the unknowns and no contact."""
        return self._blocks is not None and self.impact is None

    def resultant(self, f: Floats) -> Floats:
        """Return the resultant (3,) of forces f (dofs,), N, on the deformable body, without free rigid bodies."""
        own = slice(None, None if self.impact is None else self.impact.free)
        found: Floats = f[own].reshape(-1, 3).sum(axis=0)
        return found

    def inertia(self, a: Floats) -> Floats:
        """Return M a (dofs,), N."""
        product: Floats = self.M @ a if self.lumped is None else self.lumped * a
        return product

    def factors(self, time: float) -> Floats:
        """Return the factors (l,) of all loads at a time, s."""
        return np.array([amplitude.at(time) for amplitude in self.amplitudes])

    def step_load(self, begin: float, end: float, weight: float = 0.5, ahead: float = 0.0) -> StepLoad:
        """Return the load factors of a step from `begin` to `end`, s (see `load_amplitudes.linear_step_load`)."""
        return linear_step_load(self.amplitudes, begin, end, weight, ahead)

    def mean(self, begin: float, end: float) -> Floats:
        """Return the mean load factors (l,) from `begin` to `end`, s."""
        return mean_factors(self.amplitudes, begin, end)

    def energies_with_factors(self, factors: Floats) -> list[tuple[Energy, float]]:
        """Return every energy with its load factor, 1 for internal energies, internal energies first."""
        return [(e, 1.0) for e in self.internal] + list(zip(self.loads, factors.tolist(), strict=True))

    def value(self, x: Floats, factors: Floats) -> float:
        """Return the potential energy under loads with `factors` (l,), J; infinite outside the domain of a law."""
        return sum(scale * e.value(x) for e, scale in self.energies_with_factors(factors) if scale != 0.0)

    def strain(self, x: Floats) -> float:
        """Return the energy of the internal forces, J."""
        return sum(e.value(x) for e in self.internal)

    def at(self, x: Floats, factors: Floats) -> EnergyGradients:
        """Return the energy gradients, with the loads multiplied by `factors` (l,)."""
        return EnergyGradients(self.within(x), self.load_gradient(x, factors))

    def gradients_at_step_start(self, x: Floats, factors: Floats) -> EnergyGradients:
        """Return the energy gradients at the start of a step, before viscoelastic relaxation in the step."""
        return EnergyGradients(
            self._sum_gradients(self.internal if self.now is None else self.now, x), self.load_gradient(x, factors)
        )

    def within(self, x: Floats) -> Floats:
        """Return the gradient (dofs,), N, of the internal energies in a state x; cached for the last state."""
        if not self._repeats:
            return self._sum_gradients(self.internal, x)
        if (key := x.tobytes()) != self._last[0]:
            self._last = key, self._sum_gradients(self.internal, x)
        return self._last[1]

    def _sum_gradients(self, energies: Sequence[Energy], x: Floats) -> Floats:
        """Return the sum (dofs,), N, of the gradients of some energies in a state x."""
        internal = np.zeros(self.dofs)
        for energy in energies:
            count_forces(energy.stencils)
            energy.add_gradient(x, internal)
        return internal

    def load_gradient(self, x: Floats, factors: Floats) -> Floats:
        """Return the gradient (dofs,), N, of the loads multiplied by `factors` (l,)."""
        external = np.zeros(self.dofs)
        for energy, scale in zip(self.loads, factors.tolist(), strict=True):
            if scale != 0.0:
                energy.add_gradient(x, external, scale)
        return external

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the forces, N."""
        return sum(e.rounding(x) for e in (*self.internal, *self.loads))

    def drag(self, x: Floats) -> Floats:
        """Return the entries (nnz,) of the stiffness matrix used for stiffness-proportional damping."""
        data = np.zeros(len(self.pattern.indices))
        for energy, slots in zip(self.internal, self.pattern.slots, strict=False):
            if energy.stencils.size:
                add_drag(energy, x, data, slots)
        return data

    def tangent(self, x: Floats, factors: Floats, projected: bool = False) -> sparse.csr_matrix:
        """Return the tangent stiffness of the free degrees of freedom under loads with `factors` (l,)."""
        data = np.zeros(len(self.pattern.indices))
        for (energy, scale), slots in zip(self.energies_with_factors(factors), self._slots, strict=True):
            if energy.stencils.size and scale != 0.0:
                count_stiffness(energy.stencils)
                energy.add_hessian(x, data, slots, scale, projected)
        return self.pattern.matrix(data)

    def add_mass(self, data: Floats, scale: float) -> None:
        """Add `scale` times the mass matrix to the entries data (nnz,)."""
        data[self._mass_slots] += scale * self.M_free.data

    def add_damped_mass(self, data: Floats, scale: float) -> None:
        """Add `scale` times the mass matrix of the deformable body to the entries data (nnz,).

        Free rigid bodies are left out: mass-proportional damping does not slow them down.
        """
        end = None if self.impact is None or self.impact.free is None else np.searchsorted(self.free, self.impact.free)
        own = slice(None, None if end is None else self.M_free.indptr[end])
        data[self._mass_slots[own]] += scale * self.M_free.data[own]

    def add_rotational_blocks(self, data: Floats, blocks: Floats) -> None:
        """Add blocks (n, 3, 3) of the rotational unknowns to the entries data (nnz,)."""
        assert self._blocks is not None
        which, places = self._blocks
        data[places] += blocks.ravel()[which]


def _block_positions(pattern: Pattern, free: Ints, where: Ints) -> tuple[Ints, Ints]:
    """Return the entries of blocks (n, 3, 3) on free unknowns, and their positions in the sparsity pattern.

    `where` (n, 3) are the unknowns of the blocks.
    """
    number = np.full(max(int(where.max(initial=0)), int(free.max(initial=0))) + 1, -1)
    number[free] = np.arange(len(free))
    rows, columns = np.broadcast_arrays(number[where][:, :, None], number[where][:, None, :])
    which: Ints = np.flatnonzero((rows >= 0) & (columns >= 0))
    wanted = rows.ravel()[which] * pattern.size + columns.ravel()[which]
    places: Ints = np.searchsorted(_entry_numbers(pattern.size, pattern), wanted)
    return which, places


def _extend_pattern_by_mass(assembly: Assembly, forces: DynamicForces) -> tuple[Pattern, Ints]:
    """Return the pattern extended by missing entries of the mass matrix, and the positions of the mass entries."""
    pattern, energies = assembly.pattern, (*assembly.internal, *assembly.loads)
    slots = _entry_positions(pattern, forces.M_free)
    if slots is None:
        entries = forces.M.tocoo()
        pairs = np.stack([entries.row, entries.col], axis=1).astype(np.int64)
        pattern = build_pattern(forces.dofs, forces.fixed, [*(e.stencils for e in energies), pairs])
        slots = _entry_positions(pattern, forces.M_free)
    if slots is None:
        raise ValueError("the shape of the mass matrix does not match the degrees of freedom")
    return pattern, slots


def _entry_positions(pattern: Pattern, M: sparse.csr_matrix) -> Ints | None:
    """Return the positions of the entries of M in the pattern; None if one is missing."""
    known, wanted = _entry_numbers(pattern.size, pattern), _entry_numbers(pattern.size, M)
    places: Ints = np.searchsorted(known, wanted)
    inside = places < len(known)
    if not np.all(inside) or not np.array_equal(known[places], wanted):
        return None
    return places


def _entry_numbers(size: int, M: Pattern | sparse.csr_matrix) -> Ints:
    """Return, for each entry (nnz,) of a matrix, the number row * size + column.

    The numbers are ascending, because rows and columns are sorted.
    """
    numbers: Ints = np.repeat(np.arange(size), np.diff(M.indptr)) * size + M.indices
    return numbers


def _canonical_matrix(M: sparse.csr_matrix) -> sparse.csr_matrix:
    """Return the matrix in canonical order, without explicit zeros."""
    M = M.tocsr()
    M.sum_duplicates()
    M.eliminate_zeros()
    M.sort_indices()
    return M
