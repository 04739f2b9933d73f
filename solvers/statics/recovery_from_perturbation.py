"""Recovery of equilibrium from any perturbed state: scrambled, flat, collapsed, inverted or spun.

The states are made in perturbed_states.py.

The method decreases the energy from the given state; it never replaces this state by the rest state. If the law has a
finite energy in the state, this energy is minimised by Newton steps with a definite tangent (Teran et al. 2005). If it
has none (such as ln J in inverted cells), or the descent ends with inverted cells, the stable neo-Hookean energy of
Smith, De Goes and Kim (2018) is minimised first. This energy is finite and resists deformation everywhere. The law
takes over once no cell is inverted.

The stable neo-Hookean energy has a few bad minima too. There the nodes of cells that are inverted or strained most are
interpolated harmonically between the nodes around them, and perturbed at random. The interpolated region grows with
each attempt, up to half of the body. Recovery fails after ATTEMPTS of these.

Recovery succeeds only with a stable equilibrium without inverted cells whose energy is that of the equilibrium without
perturbation. Without loads this is the rest state, with zero energy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.linear.factorisations import Singular, condition, factor
from softmark.solvers.linear.linear_solver import LinearSystems
from softmark.solvers.materials.stable_neo_hookean import StableNeoHookean
from softmark.solvers.statics.static_equilibrium import equilibrium
from softmark.solvers.statics.static_newton import RIGID, Newton
from softmark.solvers.statics.static_problem import Equilibrium, Iteration, NotConverged, Statics

ATTEMPTS = 12  # largest number of interpolations or random perturbations
STEPS = 250  # largest number of steps of one descent
SHIFT = 1e-8  # of the largest diagonal entry, added to a tangent that is only semi-definite
SHAKE = 1e-3  # of the extent: random perturbation of degenerate states, such as a point
FLAT = 1e-6  # det F below which a cell is flat
SETTLED = 1e-3  # relative change of the energy, in CALM successive steps, near a minimum
CALM = 3
AT_REST, NEARLY = 1e-9, 1e-6  # of the energy at unit strain: largest energy at rest, and near rest
OTHER = 1e-6  # relative energy difference between two equilibria
APART = 1e-3  # of the extent: displacement difference between two states
STRAINED = 0.1  # of the largest energy density: nodes of cells above it are interpolated again
UNIT = StableNeoHookean(young=2.6, poisson=0.3, density=1.0)  # shear modulus 1 Pa: its value has no effect
NAMED = 5  # largest number of cells named in a message
NO_CELLS: Ints = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class PerturbedBody:
    """Body in a perturbed `state` (dofs,) that satisfies its supports.

    `cells` are its cells under any law; None for bodies whose cells cannot invert (springs, rods). `inverted` returns
    the numbers of inverted cells in a state; `seed` determines every random choice. Pressure unknowns come after the
    displacements.
    """

    state: Floats
    cells: Elastic | None = None
    inverted: Callable[[Floats], Ints] = field(default=lambda x: NO_CELLS)
    count: int = 0  # number of cells, for messages
    seed: int = 1


def find_inverted_cells(elastic: Elastic, x: Floats) -> Ints:
    """Return the numbers of cells with det F <= 0 at an integration point."""
    J = np.linalg.det(elastic.F(x)).reshape(elastic.w.shape)
    return np.flatnonzero(~(J > 0.0).all(axis=1))


def recover_equilibrium(problem: Statics, tangled: PerturbedBody) -> Equilibrium:
    """Return the equilibrium recovered from a perturbed body.

    Raises NotConverged, whose reason is the state that was found instead.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _Recovery(problem, tangled).descend_and_repair_cells()


class _Recovery:
    """Recovery of the equilibrium from one perturbed state."""

    def __init__(self, problem: Statics, tangled: PerturbedBody) -> None:
        self.problem = replace(problem, max_iterations=max(problem.max_iterations, STEPS))
        self.tangled = tangled
        self.random = np.random.default_rng([tangled.seed, 1])
        self.history: list[Iteration] = []
        self.systems = LinearSystems(problem.linear)
        self.newton = Newton(self.problem, self.history, self.systems, "recovery")
        self.stable: bool | None = None
        self.attempts = self.filled = 0
        self.soft = None if tangled.cells is None else _stable_neo_hookean_assembly(problem, tangled.cells)
        self.moving = problem.space.dofs if self.soft is None else self.soft.dofs  # unknowns without pressures
        if self.is_unloaded:  # no load or reaction sets a force scale: use forces at a strain of 1e-3
            self.newton.towed = 1e-3 * self._unit_strain_force(problem.assembly) / RIGID

    def descend_and_repair_cells(self) -> Equilibrium:
        """Return the recovered equilibrium: descend in energy, check and repair cells, repeat. Raises NotConverged."""
        x = self._initial_state()
        lawful = self.newton.minimizes_energy and self._has_finite_energy(x)
        doubt = "no energy minimization finished"
        for self.attempts in range(ATTEMPTS + 1):
            if self.attempts:
                x = self._perturb_worst_cells(x)
            if self.soft is not None and (self.attempts or not lawful):
                x = self._minimize_neo_hookean_energy(self.soft, x)
            try:
                x = self._find_stable_equilibrium(x)
            except NotConverged as failure:
                doubt = self._describe_inverted_cells(x) or failure.reason
                continue
            found = self._describe_mismatch(x)
            if found is None:
                return self._finish_equilibrium(x)
            doubt = found
        reason = f"it does not recover from the disturbed state after {self.attempts} more attempts: {doubt}"
        raise NotConverged(reason, tuple(self.history), self.systems.facts | self._report_facts)

    # ------------------------------------------------------------------ descent

    def _initial_state(self) -> Floats:
        """Return the state from which recovery begins: the given state, perturbed slightly at random if cells are flat.

        Bodies without cells are perturbed too.
        """
        x, cells = self.tangled.state, self.tangled.cells
        if cells is None or np.any(np.abs(np.linalg.det(cells.F(x[: self.moving]))) < FLAT):
            return self._perturb_randomly(x, SHAKE)
        return x

    def _perturb_randomly(self, x: Floats, size: float) -> Floats:
        """Return the state x with every free node moved at random, by about `size` times the extent of the body."""
        free = self.problem.assembly.free
        free = free[free < self.moving]
        weights = np.broadcast_to(self.problem.weights, (self.problem.space.dofs,))
        d = np.zeros(self.problem.space.dofs)
        d[free] = size * self.problem.extent * weights[free] * self.random.standard_normal(len(free))
        return self.problem.space.move(x, d)

    def _has_finite_energy(self, x: Floats) -> bool:
        """Return whether the strain energy of the law is finite in a state x."""
        return bool(np.isfinite(self.newton.strain(x)))

    def _minimize_neo_hookean_energy(self, soft: Assembly, x: Floats) -> Floats:
        """Return a state that minimises the stable neo-Hookean energy `soft` without loads.

        The descent starts from the state x. `soft` depends on displacements only. If the state also has pressures, the
        returned pressures are zero. Prescribed unknowns keep their values in x.
        """
        found = np.zeros_like(x)
        found[: self.moving] = self._descend(soft, x[: self.moving], 0.0, "untangling")
        found[self.problem.fixed] = x[self.problem.fixed]
        return found

    def _descend(self, assembly: Assembly, x: Floats, load: float, phase: str) -> Floats:
        """Return a state after steps with a definite tangent that decrease the energy, until it hardly changes."""
        value, calm, unit = assembly.value(x, load), 0, self._unit_strain_force(assembly)
        for number in range(STEPS):
            g = assembly.gradient(x, load)
            d = self._descent_step(assembly, x, load, g)
            length, before = self._armijo_fraction(assembly, x, load, d, value, float(g @ d)), value
            if not length:
                break
            x = self._move(x, length * d)
            value = assembly.value(x, load)
            self._record_iteration(phase, load, number, float(np.linalg.norm(g[assembly.free])) / unit, length)
            settled = before - value <= SETTLED * abs(before) or abs(value) <= NEARLY * unit * self.problem.extent
            calm = calm + 1 if settled else 0
            if calm == CALM:
                break
        return x

    def _descent_step(self, assembly: Assembly, x: Floats, load: float, g: Floats) -> Floats:
        """Return the step -K+^-1 g (dofs,), with K+ the definite tangent plus a small diagonal shift.

        If K+ is singular, it is replaced by its diagonal.
        """
        K, d = assembly.tangent(x, load, projected=True), np.zeros(assembly.dofs)
        diagonal = K.diagonal()
        self.systems.solves += 1
        shift = SHIFT * max(float(np.abs(diagonal).max(initial=0.0)), np.finfo(float).tiny)
        try:
            shifted = (K + shift * sparse.identity(K.shape[0], format="csr")).tocsr()
            d[assembly.free] = -factor(shifted, modes=self.problem.linear.modes).solve(g[assembly.free])
        except Singular:
            d[assembly.free] = -g[assembly.free] / np.maximum(diagonal, shift)
        return d

    def _armijo_fraction(
        self, assembly: Assembly, x: Floats, load: float, d: Floats, value: float, slope: float
    ) -> float:  # fmt: skip
        """Return the fraction of a step d that decreases the energy enough (Armijo 1966); 0 if there is none."""
        length = 1.0 if np.isfinite(slope) and slope < 0.0 else 0.0
        while length > 1e-10:
            if assembly.value(self._move(x, length * d), load) <= value + 1e-4 * length * slope:
                return length
            length *= 0.5
        return 0.0

    def _move(self, x: Floats, d: Floats) -> Floats:
        """Return the state x (dofs,) after a displacement increment d (dofs,)."""
        return self.problem.space.move(x, d) if len(d) == self.problem.space.dofs else x + d

    def _record_iteration(self, phase: str, load: float, number: int, residual: float, length: float) -> None:
        """Add an iteration to the history of the solution."""
        iteration = Iteration(phase, load, number, residual, length)
        self.history.append(iteration)
        self.problem.watch(iteration)

    def _unit_strain_force(self, assembly: Assembly) -> float:
        """Return the order of magnitude of the nodal forces at unit strain, N: the scale of rounding errors."""
        rest = self.problem.rest if assembly is self.problem.assembly else np.zeros(assembly.dofs)
        size = sum(e.rounding(rest) for e in assembly.internal) / float(np.finfo(np.float64).eps)
        return max(float(size), float(np.finfo(np.float64).tiny))

    # ------------------------------------------------------------------ equilibrium under the loads

    def _find_stable_equilibrium(self, x: Floats) -> Floats:
        """Return the stable equilibrium of the law under the loads, by descent from x. Raises NotConverged."""
        if not self._has_finite_energy(x):
            raise NotConverged("the energy of the law is not finite in this state", tuple(self.history))
        self.newton.moved = self.problem.extent * float(np.sqrt(self.problem.space.dofs))
        if self.newton.minimizes_energy:
            x = self._descend(self.problem.assembly, x, 1.0, "recovery")
            x, self.stable = self.newton.find_stable_state(self.newton.descend(x, 1.0))
            return x
        x = self._solve_follower_loads(x)
        self.stable = self.newton.is_tangent_definite(x) or None
        return x

    def _solve_follower_loads(self, x: Floats) -> Floats:
        """Return the equilibrium under follower loads, in one load step or several. Raises NotConverged."""
        load, step = 0.0, 1.0
        while load < 1.0:
            try:
                x = self.newton.descend(x, min(1.0, load + step))
                load, step = min(1.0, load + step), 2.0 * step
            except NotConverged:
                step *= 0.25
                if step < 1e-2:
                    raise
        return x

    # ------------------------------------------------------------------ checks of the result

    def _describe_mismatch(self, x: Floats) -> str | None:
        """Return a message why an equilibrium x is not the expected one; None if it is."""
        if folded := self._describe_inverted_cells(x):
            return folded
        if self.stable is False or not self.problem.sound(x):
            return "the equilibrium is unstable" if self.stable is False else "it has inverted cells"
        return self._describe_energy_difference(x)

    def _describe_inverted_cells(self, x: Floats) -> str | None:
        """Return a message about inverted cells; None if there are none."""
        cells = self.tangled.inverted(x)
        if not len(cells):
            return None
        named = ", ".join(str(int(c)) for c in cells[:NAMED]) + (", ..." if len(cells) > NAMED else "")
        return f"{len(cells)} of {self.tangled.count} cells remain inverted (cells {named})"

    def _describe_energy_difference(self, x: Floats) -> str | None:
        """Return a message if the energy differs from that of the equilibrium without perturbation; else None."""
        if self._unperturbed_equilibrium is None:
            return None
        if not self.newton.minimizes_energy:
            return (
                "it is another equilibrium than without the disturbance" if self._has_other_displacements(x) else None
            )
        energy, least = (
            self.problem.assembly.value(x, 1.0),
            self.problem.assembly.value(self._unperturbed_equilibrium, 1.0),
        )
        room = AT_REST * self._unit_strain_force(self.problem.assembly) * self.problem.extent
        if abs(energy - least) <= max(room, OTHER * abs(least)):
            return None
        than = "more" if energy > least else "less"
        return f"an equilibrium with {abs(energy - least):.2g} J {than} energy than the one without the disturbance"

    def _has_other_displacements(self, x: Floats) -> bool:
        """Return whether the displacements of x differ from those of the equilibrium without perturbation."""
        if self._unperturbed_equilibrium is None:
            return False
        away = np.abs(x - self._unperturbed_equilibrium)[: None if self.soft is None else self.moving]
        return bool(away.max(initial=0.0) > APART * self.problem.extent)

    @cached_property
    def is_unloaded(self) -> bool:
        """True if the rest state is the equilibrium: there are no loads and no imposed displacements."""
        if np.any(self.problem.target):
            return False
        pull = self.problem.assembly.gradient(self.problem.rest, 1.0)[self.problem.assembly.free]
        return bool(np.linalg.norm(pull) <= 4.0 * self.problem.assembly.rounding(self.problem.rest))

    @cached_property
    def _unperturbed_equilibrium(self) -> Floats | None:
        """Equilibrium (dofs,) without perturbation, to compare with; None if it is not found.

        It is computed only after recovery has found an equilibrium.
        """
        if self.is_unloaded:
            return self.problem.rest
        try:
            return equilibrium(self.problem).x
        except NotConverged:
            return None

    def _finish_equilibrium(self, x: Floats) -> Equilibrium:
        """Return the recovered state x as an `Equilibrium`, with the data for the report."""
        problem, newton = self.problem, self.newton
        facts = self.systems.facts | self._report_facts
        facts["recovery"]["elsewhere"] = self._has_other_displacements(x)
        found = Equilibrium(
            x, newton.gradient_and_residual(x, 1.0)[1], tuple(self.history), 1, newton.criterion, self.stable
        )
        follower = not problem.assembly.conservative
        found = replace(found, linear_solver=self.systems.name, facts=facts, follower=follower, started=True)
        return replace(found, condition=self._condition_number())

    def _condition_number(self) -> float | None:
        """Return the condition number of the last tangent; None without a direct factorisation."""
        last, K = self.newton.last, self.newton.matrix
        if last is None or K is None or last.tolerance:
            return None
        try:
            return condition(K, last)
        except Singular:
            return None

    @property
    def _report_facts(self) -> dict[str, Any]:
        """Data of the recovery for the report."""
        inverted = len(self.tangled.inverted(self.tangled.state))
        return {
            "recovery": {
                "inverted_at_start": inverted,
                "attempts": self.attempts,
                "filled": self.filled,
                "judged": self._unperturbed_equilibrium is not None,
            }
        }

    # ------------------------------------------------------------------ escape from bad minima

    def _perturb_worst_cells(self, x: Floats) -> Floats:
        """Return the state x with the nodes of the worst cells moved.

        These nodes are interpolated between the nodes around them, and perturbed at random. The interpolated region
        grows with every attempt.
        """
        cells = self.tangled.cells
        if cells is None:
            return self._perturb_randomly(x, 0.02 * self.attempts)
        u = x[: self.moving]
        nodes = _nodes_around(cells.cells, self._find_worst_cells(cells, u), self.attempts // 2, len(u) // 3)
        if nodes is None:
            return self._perturb_randomly(x, 0.02 * self.attempts)
        self.filled = max(self.filled, len(nodes))
        free = np.zeros(len(x), dtype=np.bool_)
        free[self.problem.assembly.free] = True
        filled = np.concatenate([_interpolate_harmonically(cells, u, nodes, free[: self.moving]), x[self.moving :]])
        return self._perturb_randomly(filled, SHAKE)

    def _find_worst_cells(self, cells: Elastic, x: Floats) -> Ints:
        """Return the numbers of the cells that are inverted or strained most."""
        density = np.max(UNIT.psi(cells.F(x)).reshape(cells.w.shape), axis=1)
        bad = density > STRAINED * density.max()
        bad[find_inverted_cells(cells, x)] = True
        return np.flatnonzero(bad)


def _stable_neo_hookean_assembly(problem: Statics, cells: Elastic) -> Assembly:
    """Return the assembly of the stable neo-Hookean energy of the cells, with the same supports and no loads."""
    energy, moving = Elastic(cells.cells, cells.dNdX, cells.w, UNIT), 3 * (int(cells.cells.max()) + 1)
    fixed = problem.fixed[problem.fixed < moving]
    return Assembly(moving, fixed, [energy], [], problem.assembly.points)


def _nodes_around(cells: Ints, seeds: Ints, rings: int, nodes: int) -> Ints | None:
    """Return the nodes of the cells `seeds` and of `rings` layers of cells around them.

    At most half of all nodes are returned: layers beyond that are left out. Returns None if `seeds` alone have more.
    """
    chosen = np.zeros(nodes, dtype=np.bool_)
    chosen[cells[seeds]] = True
    if chosen.sum() > nodes // 2:
        return None
    for _ in range(rings):
        wider = chosen.copy()
        wider[cells[chosen[cells].any(axis=1)]] = True
        if wider.sum() > nodes // 2:
            break
        chosen = wider
    return np.flatnonzero(chosen)


def _interpolate_harmonically(cells: Elastic, x: Floats, nodes: Ints, free: Any) -> Floats:
    """Return displacements x (dofs,) with those of `nodes` replaced by a harmonic interpolation between all others.

    The equations are sum w grad N_a . grad N_b u_b = 0; only degrees of freedom in the mask `free` change.
    """
    local = np.einsum("mq,mqai,mqbi->mab", cells.w, cells.dNdX, cells.dNdX)
    rows, columns = np.broadcast_arrays(cells.cells[:, :, None], cells.cells[:, None, :])
    L = sparse.csr_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(len(x) // 3,) * 2)
    u = x.reshape(-1, 3).copy()
    for c in range(3):
        inner = nodes[free.reshape(-1, 3)[nodes, c]]
        outer = np.setdiff1d(np.arange(len(u)), inner)
        if len(inner):
            u[inner, c] = factor(L[inner][:, inner].tocsr()).solve(-(L[inner][:, outer] @ u[outer, c]))
    return u.ravel()
