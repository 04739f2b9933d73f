"""Newton's method for static equilibrium: full steps, steps that decrease the energy, and convergence criteria."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats, Space
from softmark.solvers.linear.factorisations import DeferredFactor, Factor, Singular
from softmark.solvers.linear.linear_solver import TIGHTEST, LinearSystems
from softmark.solvers.statics.contact_line_search import SHORTEST, least_fraction_into_contact
from softmark.solvers.statics.rigid_motion_predictor import force_change_of_rigid_motion
from softmark.solvers.statics.static_problem import Criterion, Iteration, NotConverged, Statics

MEMORY = 10  # number of last energies whose largest a step must stay below: bending has long curved valleys
RIGID = 1e-6  # least force scale, relative to the force if only the supports moved
VALLEY = 200  # least number of steps after instability: the energy of a square column hardly depends on direction
TINY = 1e-4  # of the motion so far: largest last Newton step if rounding limits the residual
BLIND = ("conjugate_gradients", "multigrid")  # linear solvers without pivot signs
Merit = Callable[[Floats, float], float]


class Newton:
    """Newton solver of one assembly; it keeps the last factorisation and records all iterations."""

    def __init__(self, problem: Statics, history: list[Iteration], systems: LinearSystems, phase: str = "free") -> None:
        self.problem = problem
        self.assembly = problem.assembly
        self.history = history
        self.systems = systems
        self.phase = phase
        self.last: Factor | None = None
        self.matrix: Any = None  # matrix of the last factorisation
        self.left: Floats | None = None  # unstable equilibrium that `stable` has left
        self.criterion: Criterion = "residual"
        self.eps = float(np.finfo(problem.rest.dtype).eps)
        self.moved = problem.travelled  # length of all steps so far
        self.towed = 0.0  # force that support motion causes if the body does not move
        self._close = self._tiny = False  # whether energy error and size of the last step were small
        self._before = np.inf
        self._strain: tuple[Floats, float] | None = None  # last state and its strain energy
        self.reached: Floats | None = None  # state of the last descent before its last step
        self._tried: tuple[Floats, Floats, float, Floats] | None = None  # last step and the state after it
        self._valued: tuple[Floats, float, float] | None = None  # the last state, load and energy
        self._promised: Assembly | None = None  # assembly with the pressures predicted by the last step
        self._goal = self._last_goal = TIGHTEST  # relative tolerance of the linear system
        self._last_residual = np.inf

    def gradient_and_residual(self, x: Floats, load: float) -> tuple[Floats, float]:
        """Return the gradient (dofs,) in x, and the residual relative to the larger of load and reactions.

        The residual is the norm of the gradient on free degrees of freedom.
        """
        internal, external = self.assembly.forces(x, load)
        g = internal + external
        weighted = g * self.problem.weights
        forces = (external * self.problem.weights, weighted[self.problem.fixed], weighted[self.assembly.free])
        load_size, reactions, size = (float(np.linalg.norm(f)) for f in forces)
        scale = max(load_size, reactions, RIGID * self.towed)
        return g, size / scale if scale > 0 else size

    def impose_support_motion(self, x: Floats, fraction: float, load: float = 1.0) -> Floats:
        """Return x after the last `fraction` of the support motion up to the load factor `load`.

        The body moves by its linear response to the support motion.
        """
        if not self.problem.has_imposed_motion:
            return x
        d = self._support_response(x, self.problem.imposed(load - fraction, load), load, True)
        return self._take_step(x, self._collision_free_motion(x, d, load - fraction, load), 1.0)

    def predict_equilibrium(self, x: Floats, fraction: float, load: float) -> Floats:
        """Return the state predicted from an equilibrium x at `load` for a load factor larger by `fraction`.

        It also predicts pressures for the next tangent. Raises NotConverged if the state leaves the domain of the law.
        """
        if not (self.problem.has_imposed_motion or self.problem.may_contact):
            self._promised = None
            return x
        return self.move_with_supports(x, self.problem.imposed(load, load + fraction), load, load + fraction)

    def move_with_supports(self, x: Floats, moved: Floats, load: float, to: float | None = None) -> Floats:
        """Return x after support increments `moved` (c,) at a load factor, by linear response. Raises NotConverged.

        If another load factor `to` is given, rigid bodies and the surfaces in contact move to their positions there
        too.
        """
        self._promised = None
        d = self._support_response(x, moved, load, False, to)
        y = self._take_step(x, self._collision_free_motion(x, d, load, load if to is None else to), 1.0)
        if not np.isfinite(self.strain(y)):
            raise NotConverged("the motion of the supports leaves the domain of the law", tuple(self.history))
        if self.has_cell_energies:
            self._promised = self.pressure_predictor.with_predicted_pressures(self.assembly, x, d)
        return y

    def _collision_free_motion(self, x: Floats, d: Floats, load: float, to: float) -> Floats:
        """Return the part of a motion d (dofs,) without intersections, as rigid bodies move from one load to another.

        Raises NotConverged if supports move too far, or if points would pass through a rigid body for any step.
        """
        part = self._moving_collision_free_fraction(x, d, load, to)
        if part == 0.0 or (part < 1.0 and np.any(d[self.problem.fixed])):
            raise NotConverged("the motion of the supports would make surfaces intersect", tuple(self.history))
        return d if part == 1.0 else part * d

    def _collision_free_fraction(self, x: Floats, d: Floats, load: float) -> float:
        """Return the fraction of a step d, at most 1, before surfaces meet or points pass through a rigid body.

        If not even a small fraction is possible, rigid bodies are ignored: points near a sharp edge are on both sides.
        """
        return self._moving_collision_free_fraction(x, d, load, load) or self.assembly.limit(x, d)

    def _moving_collision_free_fraction(self, x: Floats, d: Floats, load: float, to: float) -> float:
        """Return the collision-free fraction of d as rigid bodies move from one load to another; 0 if none."""
        part = self.assembly.limit(x, d)
        if not self.problem.has_rigid_bodies:
            return part
        from softmark.solvers.contact.continuous_collision import collision_free_fraction

        later = None if to == load else self._rigid_contacts(to)
        return part * collision_free_fraction(self._rigid_contacts(load), x, part * d, later)

    def _rigid_contacts(self, load: float) -> list[Any]:
        """Return the contacts with rigid bodies at a load factor."""
        return [*self.assembly.rigid_contacts_at(load).values()]

    def _support_response(
        self, x: Floats, moved: Floats, load: float, projected: bool, to: float | None = None
    ) -> Floats:
        """Return the linear response (dofs,) of displacements, m, to increments `moved` (c,) of supports, m.

        With `to`, rigid bodies also move, from their place at the load factor `load` to that at `to`.
        """
        problem, d = self.problem, np.zeros(self.space.dofs)
        d[problem.fixed] = moved
        eps = 1e-6 / max(1.0, float(np.abs(d).max()) * 1e3)
        exact, here = problem.exact or self.assembly, np.asarray(x, dtype=np.float64)
        g = exact.gradient(here, load)
        coupling = (exact.gradient(self.space.move(here, eps * d), load) - g) / eps
        self.towed = max(self.towed, float(np.linalg.norm(coupling)))
        self._goal = TIGHTEST
        if to is not None and self.problem.may_contact:
            coupling += force_change_of_rigid_motion(self.assembly, here, load, to)
        b = coupling[self.assembly.free].astype(x.dtype, copy=False)
        d[self.assembly.free] = -self._factorise_tangent(x, load, projected).solve(b)
        return d.astype(x.dtype, copy=False)

    @property
    def space(self) -> Space:
        """State space of the problem."""
        return self.problem.space

    def solve_by_full_steps(self, x: Floats, most: int, load: float = 1.0, least: float = 0.0) -> Floats:
        """Return the equilibrium by full Newton steps from x. Raises NotConverged.

        Steps are shortened only to the domain of the law, and not below the fraction `least`.
        """
        x, done, residual = self.full_steps(x, most, load, least)
        if done:
            return x
        raise NotConverged(f"full Newton steps stopped at a residual of {residual:.1e}", tuple(self.history))

    def full_steps(self, x: Floats, most: int, load: float = 1.0, least: float = 0.0) -> tuple[Floats, bool, float]:
        """Take at most `most` full steps; return the state, whether it is an equilibrium, and the residual."""
        self._close = self._tiny = False
        self._last_residual = np.inf
        for number in range(most + 1):
            g, residual = self.gradient_and_residual(x, load)
            done = self._has_converged(x, g, residual)
            if done or number == most or not np.isfinite(residual):
                break
            self._set_linear_tolerance(residual)
            d = self._newton_direction(x, g, self._factorise_tangent(x, load, projected=False))
            self._mark_small_step(x, g, d)
            x, length = self._step_within_domain(x, d, load)
            self._record_iteration(load, number, residual, length)
            if length < least:
                break
        return x, done, residual

    @property
    def minimizes_energy(self) -> bool:
        """True if stable states minimise the energy: not with follower loads or pressure unknowns."""
        return self.assembly.conservative and not self.assembly.saddle

    @property
    def has_cell_energies(self) -> bool:
        """True if some energies are those of cells, which may have pressures."""
        return any(e.integrates_cells for e in self.assembly.internal)

    @property
    def pressure_predictor(self) -> Any:
        """Module of the pressure predictor, imported on request."""
        from softmark.solvers.assembly import pressure_predictor

        return pressure_predictor

    def predict_pressures(self, x: Floats) -> None:
        """Predict the pressures of the next step from x, an equilibrium of the corotational twin.

        The pressures that the law itself gives there are far off.
        """
        if self.has_cell_energies:
            self._promised = self.pressure_predictor.with_predicted_pressures(self.assembly, x, None)

    def reset_predicted_pressures(self) -> None:
        """Use zero pressures in the next step, because pressures of an interpolated state are meaningless."""
        if self.has_cell_energies:
            self._promised = self.pressure_predictor.with_zero_pressures(self.assembly)

    def _set_linear_tolerance(self, residual: float) -> None:
        """Set the relative residual to which the next linear system is solved."""
        if self.systems.choice.iterative:
            goal = self.systems.next_tolerance(residual, self._last_residual, self._last_goal, self.problem.tolerance)
            self._goal = self._last_goal = goal
            self._last_residual = residual

    def _step_within_domain(self, x: Floats, d: Floats, load: float) -> tuple[Floats, float]:
        """Return the state after the fraction of a step d that stays in the domain of the law, and this fraction.

        Raises NotConverged.
        """
        length = self._collision_free_fraction(x, d, load)
        while length > 1e-3:
            y = self._state_along_step(x, d, length)
            if np.isfinite(self.strain(y)):
                if self.has_cell_energies:
                    self._promised = self.pressure_predictor.with_predicted_pressures(self.assembly, x, length * d)
                self.moved = self._total_motion_length(d, length)
                return y, length
            length *= 0.5
        raise NotConverged("no Newton step stays in the domain of the law", tuple(self.history))

    def strain(self, x: Floats) -> float:
        """Return the strain energy of a state, J; cached for the last state."""
        if self._strain is None or self._strain[0] is not x:
            self._strain = x, sum(e.value(x) for e in self.assembly.internal)
        return self._strain[1]

    def descend(self, x: Floats, load: float, patience: int = 0) -> Floats:
        """Return the equilibrium by Newton steps that decrease the energy (follower loads: the residual).

        Each step must fall below the largest of the last MEMORY values. The number of steps is limited to the
        problem's, or to `patience` if larger. Raises NotConverged.
        """
        if self.problem.has_friction:
            from softmark.solvers.statics.friction_iteration import solve_friction

            return solve_friction(self, x, load)
        merit = self._total_energy if self.minimizes_energy else self._half_squared_residual
        value = merit(x, load)
        if not np.isfinite(value):
            raise NotConverged("the motion of the supports inverts cells", tuple(self.history))
        self._close = self._tiny = False
        self._promised, self._last_residual = None, np.inf
        recent = deque([value], 1 if self.problem.may_contact else MEMORY)
        most = max(self.problem.max_iterations, patience)
        for number in range(most + 1):
            g, residual = self.gradient_and_residual(x, load)
            if self._has_converged(x, g, residual):
                return x
            if number == most or not np.isfinite(residual):
                break
            self._set_linear_tolerance(residual)
            self.reached = x
            x, value, length = self._line_step(x, load, g, max(recent), merit)
            recent.append(value)
            self._record_iteration(load, number, residual, length)
            if self.phase == "aside" and (lost := self._lost_rotation_message(x, load)):
                raise NotConverged(lost, tuple(self.history))
        reason = f"Newton's method did not converge within {number} iterations at {100 * load:.4g} % of the load"
        raise NotConverged(f"{reason}, residual {residual:.1e}", tuple(self.history))

    def _lost_rotation_message(self, x: Floats, load: float) -> str | None:
        """Return a message if the last step lost whole rotations of the supports; else None."""
        problem = self.problem
        if problem.way is not None and self.reached is not None and problem.jumped(self.reached, x):
            return "neighbouring nodes rotated past each other"
        return problem.lost_turn_message(x, load)

    def _has_converged(self, x: Floats, g: Floats, residual: float) -> bool:
        """Return whether x has converged: the tolerance is met, or only rounding is left (see `Statics`)."""
        self.criterion = "residual"
        if residual <= self.problem.tolerance:
            return True
        size, before = float(np.linalg.norm(g[self.assembly.free])), self._before
        self._before = size
        self.criterion = "energy" if self._close else "rounding"
        if not ((self._close or self._tiny) and 0.3 * before < size):
            return False
        floor = 4.0 * self.assembly.rounding(x)
        return size <= 4.0 * max(before, floor) and (self._close or size <= floor)

    def _mark_small_step(self, x: Floats, g: Floats, d: Floats, projected: bool = False) -> None:
        """Record whether the error in the energy norm, sqrt(-g . d), and the Newton step d are small."""
        close = not self.assembly.saddle and bool(0.0 <= -(g @ d) <= 2.0 * self.strain(x) * self.problem.tolerance**2)
        tiny = bool(np.linalg.norm(d / self.problem.weights) <= TINY * self.moved)
        definite = (close or tiny) and not projected and not self._is_tangent_indefinite()
        self._close, self._tiny = close and definite, tiny and definite

    def _is_tangent_indefinite(self) -> bool:
        """Return whether the last tangent has negative eigenvalues; always False for follower loads."""
        last = self.last
        return self.assembly.conservative and (isinstance(last, DeferredFactor) or bool(last and last.negative_pivots))

    def _take_step(self, x: Floats, d: Floats, length: float) -> Floats:
        """Return the state after a fraction `length` of a step d, and add its length to the total motion."""
        self.moved = self._total_motion_length(d, length)
        return self._state_along_step(x, d, length)

    def _total_motion_length(self, d: Floats, length: float) -> float:
        """Return the length of the total motion plus a fraction `length` of a step d."""
        return float(np.hypot(self.moved, length * np.linalg.norm(d / self.problem.weights)))

    def _state_along_step(self, x: Floats, d: Floats, length: float) -> Floats:
        """Return the state after a fraction `length` of a step d; cached for the last step."""
        tried = self._tried
        if tried is None or tried[0] is not x or tried[1] is not d or tried[2] != length:
            self._tried = tried = x, d, length, self.space.move(x, d if length == 1.0 else length * d)
        return tried[3]

    def _total_energy(self, x: Floats, load: float) -> float:
        """Return the total energy, J, of a state at a load factor; cached for the last one."""
        if self._valued is None or self._valued[0] is not x or self._valued[1] != load:
            loads = (scale * e.value(x) for e, scale in self.assembly.loads_with_factors(load) if scale != 0.0)
            self._valued = x, load, self.strain(x) + sum(loads)
        return self._valued[2]

    def _half_squared_residual(self, x: Floats, load: float) -> float:
        """Return half of the squared norm of the residual; infinite outside the domain of the law."""
        if not np.isfinite(self.strain(x)):
            return np.inf
        return 0.5 * float(np.linalg.norm(self.assembly.gradient(x, load)[self.assembly.free]) ** 2)

    def _line_step(self, x: Floats, load: float, g: Floats, value: float, merit: Merit) -> tuple[Floats, float, float]:
        """Return state, merit and step length after a line search. Raises NotConverged.

        It searches along the Newton direction, or along that of the definite tangent if the first fails.
        """
        for projected in (False, True):
            factor = self._factorise_tangent(x, load, projected)
            if not projected and self._is_tangent_indefinite():  # the Newton direction leads to a saddle point
                self._close = self._tiny = False
                continue
            d = self._newton_direction(x, g, factor)
            self._mark_small_step(x, g, d, projected)
            if not projected and self._is_tangent_indefinite():  # conjugate gradients detect this while they solve
                continue
            if self._close or self._tiny:  # energy differences are rounding errors now
                y = self._take_step(x, d, 1.0)
                return y, merit(y, load), 1.0
            slope = float(g @ d) if self.minimizes_energy else -2.0 * merit(x, load)
            left, may_enter = self.left if self.phase == "aside" else None, projected and self.problem.may_contact
            least = least_fraction_into_contact(self._rigid_contacts(load), left) if may_enter else SHORTEST
            length = self._armijo_fraction(x, load, d, value, slope, merit, least)
            if projected and length == 1.0:
                length = self._lengthen_step(x, load, d, merit)
            if length:
                y = self._take_step(x, d, length)
                return y, merit(y, load), length
        raise NotConverged("no Newton step decreases the energy", tuple(self.history))

    def _armijo_fraction(
        self, x: Floats, load: float, d: Floats, value: float, slope: float, merit: Merit, least: float
    ) -> float:
        """Return the fraction, above `least`, of a step d that decreases the merit enough (Armijo 1966), or else 0."""
        length = self._collision_free_fraction(x, d, load) if np.isfinite(slope) and slope < 0 else 0.0
        while length > least:
            enough = value + 1e-4 * length * slope + 50.0 * self.eps * abs(value)
            if merit(self._state_along_step(x, d, length), load) <= enough:
                return length
            length *= 0.5
        return 0.0

    def _lengthen_step(self, x: Floats, load: float, d: Floats, merit: Merit) -> float:
        """Return the multiple of a step d up to which the merit decreases, by doubling.

        Steps of a definite tangent would leave saddle points slowly.
        """
        length, value = 1.0, merit(self._state_along_step(x, d, 1.0), load)
        while length < 1e3 and (there := merit(self.space.move(x, 2.0 * length * d), load)) < value:
            if self._collision_free_fraction(x, 2.0 * length * d, load) < 1.0:
                break
            length, value = 2.0 * length, there
        return length

    def is_tangent_definite(self, x: Floats) -> bool | None:
        """Return whether the tangent in x has no negative eigenvalue; None if unknown.

        If the last step was tiny, the tangent before it is used. Under follower loads the symmetric part of the tangent
        is tested, with any linear solver, and the result is True or None: v . K v > 0 for all v excludes a neighbouring
        equilibrium and divergence (Hill 1958), but not flutter, which needs inertia. A tangent with an indefinite
        symmetric part may still be stable.
        """
        choice, conservative, last = self.systems.choice, self.assembly.conservative, self.last
        rough = choice.reuse or choice.precision == "single"
        blind = conservative and last is not None and last.negative_pivots is None and not rough
        if choice.method in BLIND or blind:
            return None
        if self._tiny and conservative and last is not None and last.negative_pivots == 0:
            return True
        exact = self.problem.exact
        K = self.assembly.tangent(x, 1.0) if exact is None else exact.tangent(x.astype(np.float64), 1.0)
        K = K if conservative else (0.5 * (K + K.T)).tocsr()
        try:
            found = self.systems.direct(K)
        except Singular:
            return False if conservative else None
        if conservative or rough:  # otherwise the tangent is used for condition and rounding
            self.last, self.matrix = found, K
        if found.negative_pivots is None or not conservative:
            return found.negative_pivots == 0 or None
        return found.negative_pivots == 0

    def find_stable_state(self, x: Floats) -> tuple[Floats, bool | None]:
        """Return x if it is stable, or else a stable equilibrium with less energy, and whether the result is stable.

        The second result is None if the stability is unknown. Raises NotConverged.
        """
        for _ in range(5):
            definite = self.is_tangent_definite(x)
            if definite is not False:
                return x, definite
            if self.assembly.saddle:  # no energy decreases
                raise NotConverged("the equilibrium found is unstable", tuple(self.history))
            if self.left is None:
                self.left = x
            self.phase = "aside"
            try:
                x = self.descend(self._leave_unstable_state(x), 1.0, VALLEY)
            except NotConverged as failure:
                failure.unstable = self.left
                raise
        raise NotConverged("every equilibrium found is unstable", tuple(self.history), unstable=self.left)

    def _leave_unstable_state(self, x: Floats) -> Floats:
        """Return a state with less energy along the least stiff direction. Raises NotConverged if there is none."""
        d = self.softest_direction(x)
        d *= 0.1 * self.problem.extent / np.abs(d / self.problem.weights).max()
        value = self._total_energy(x, 1.0)
        for length in 0.5 ** np.arange(20):
            y = self.space.move(x, length * d)
            if (
                self._total_energy(y, 1.0) < value - 1e-10 * abs(value)
                and self._collision_free_fraction(x, length * d, 1.0) == 1.0
            ):
                return y
        raise NotConverged(
            "the equilibrium is unstable, and no state with less energy was found near it", tuple(self.history)
        )

    def softest_direction(self, x: Floats) -> Floats:
        """Return the direction (dofs,) with the least stiffness in an unstable equilibrium. Raises NotConverged.

        It is found by power iteration on I - K+^-1 K, with K+ the definite tangent: only directions with negative
        eigenvalues of K grow.
        """
        free = self.assembly.free
        self._goal = TIGHTEST
        K, definite = self.assembly.tangent(x, 1.0), self._factorise_tangent(x, 1.0, projected=True)
        d = np.zeros(self.space.dofs, dtype=x.dtype)
        d[free] = np.random.default_rng(0).standard_normal(len(free))
        for _ in range(50):
            d[free] -= definite.solve(K @ d[free])
            d[free] /= np.linalg.norm(d[free])
        return d

    def _newton_direction(self, x: Floats, g: Floats, factor: Factor) -> Floats:
        """Return the Newton direction -K^-1 g (dofs,)."""
        d = np.zeros(self.space.dofs, dtype=x.dtype)
        try:
            d[self.assembly.free] = -factor.solve(g[self.assembly.free])
        except Singular as error:
            raise self._make_failure(str(error)) from error
        return d

    def _factorise_tangent(self, x: Floats, load: float, projected: bool) -> Factor:
        """Return the factorised tangent, with predicted pressures unless `projected`. Raises NotConverged."""
        assembly = self._promised if self._promised is not None and not projected else self.assembly
        K = assembly.tangent(x, load, projected)
        try:
            self.last = self.systems.factor(K, projected or self.assembly.conservative, self._goal)
            self.matrix = K
        except Singular as error:
            raise self._make_failure(f"the tangent is singular ({error})") from error
        return self.last

    def _make_failure(self, reason: str) -> NotConverged:
        """Return the error for a reason, with the history."""
        return NotConverged(reason, tuple(self.history), self.systems.facts)

    def _record_iteration(self, load: float, number: int, residual: float, length: float) -> None:
        """Add an iteration to the history."""
        self.history.append(iteration := Iteration(self.phase, load, number, residual, length))
        self.problem.watch(iteration)
