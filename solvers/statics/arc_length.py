"""Arc-length method: follows the equilibrium path of a body past maximum loads and snap-through.

The path is a curve of states and load factors. Its points are a given length apart, measured in displacements and load
together (Keller 1977; Riks 1979). Each point is found by Newton's method in the plane normal to the tangent at the last
point (Ramm 1981). The equations for state and load are solved by block elimination (Crisfield 1981). The load may
decrease along the path; a point where it turns is a limit point. Where the number of negative eigenvalues of the
tangent stiffness changes and the load does not turn, another path crosses: this is a bifurcation, and the method
follows the original path.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Factor, Singular
from softmark.solvers.linear.linear_solver import TIGHTEST
from softmark.solvers.statics.static_newton import Newton
from softmark.solvers.statics.static_problem import NotConverged, Statics

FIRST = 0.1  # first step, relative to the length of a linear path to full load
FINEST = 1e-6  # shortest step, relative to the same length
STRIDE = 0.25  # longest step, relative to the same length; later RELATIVE times the path
RELATIVE = 0.05  # longest step, relative to the path so far
STEPS = 600  # points at most
CORRECTIONS, USUAL = 10, 4  # Newton iterations of a point at most, and as many as a step should take
TURN = 0.6  # least cosine between tangents of neighbouring points
EXACT = 1e-7  # relative residual of a point on the way
SHARP = 2e-4  # relative width of the bracket around a limit
FAR = 20.0  # extents of the body: a path that leads farther is given up
BACK = -1.0  # load at which a path is given up


@dataclass(frozen=True)
class CriticalPoint:
    """Critical point of an equilibrium path: its load factor and its kind, `limit point` or `bifurcation`."""

    load: float
    kind: str


@dataclass
class PathPoint:
    """Point of an equilibrium path: state x (dofs,), load factor, unit tangent and stability.

    The unit tangent consists of a motion (dofs,) and a change of the load factor. `negative` is the number of negative
    eigenvalues of the tangent stiffness, or None if unknown.
    """

    x: Floats
    load: float
    tangent: tuple[Floats, float]
    negative: int | None
    size: float  # m, the largest displacement
    iterations: int = 0


@dataclass
class Path:
    """Equilibrium path found so far: its points and its critical points."""

    points: list[PathPoint] = field(default_factory=list)
    limits: list[CriticalPoint] = field(default_factory=list)

    @property
    def facts(self) -> dict[str, Any]:
        """Data of the path for the report."""
        shown = [{"load": float(p.load), "displacement": p.size, "negative_pivots": p.negative} for p in self.points]
        return {"path": shown, "limits": [{"load": float(s.load), "kind": s.kind} for s in self.limits]}


def _mask_pressures(problem: Statics) -> NDArray[np.bool_]:
    """Return a mask (dofs,) of the unknowns that are pressures, not displacements."""
    found = np.zeros(problem.space.dofs, dtype=np.bool_)
    if problem.linear.spare is not None:
        found[problem.assembly.free] = problem.linear.spare != 0.0
    return found


class PathLost(Exception):
    """Raised if no point of the path is found at the required distance."""


class PathFollower:
    """Arc-length solver: follows the equilibrium path of one problem from the rest state."""

    def __init__(self, newton: Newton) -> None:
        self.newton = newton
        self.problem, self.assembly = newton.problem, newton.problem.assembly
        self.path = Path()
        self.scale = 1.0  # scale of motions: the linear response to full load
        self.origin = self.problem.rest
        weights = np.broadcast_to(self.problem.weights, (self.problem.space.dofs,)).astype(np.float64)
        self.weights = np.where(_mask_pressures(self.problem), np.inf, weights)  # pressures do not count in the length

    def to_full_load(self) -> Floats:
        """Return the first state (dofs,) of the path under full load. Raises NotConverged if there is none."""
        try:
            return self._follow_to_full_load()
        except PathLost as lost:
            raise self._make_failure(f"where it ends: {lost}") from lost

    def _follow_to_full_load(self) -> Floats:
        """Return the first state (dofs,) of the path under full load.

        Raises NotConverged if the path is given up, and PathLost if a point between two known ones is not found.
        """
        here, step, length = self._rest_point(), FIRST, 0.0
        self.path.points.append(here)
        while len(self.path.points) < STEPS:
            there, step = self._find_next_point(here, step)
            crossing = self._find_full_load_point(here, there, step)
            self._store_critical_points(here, there if crossing is None else crossing, step)
            self.path.points.append(there if crossing is None else crossing)
            if crossing is not None:
                return crossing.x
            self._check_path_point(there)
            length, here = length + step, there
            longest = max(STRIDE, RELATIVE * length)
            step = min(longest, step * float(np.clip(np.sqrt(USUAL / max(1, there.iterations)), 0.5, 1.6)))
        raise self._make_failure(f"up to the limit of {STEPS} points")

    # ------------------------------------------------------------------ points

    def _rest_point(self) -> PathPoint:
        """Return the first point of the path: the rest state without load."""
        x = np.array(self.problem.rest, dtype=np.float64)
        factor = self._factorise_tangent(x, 0.0)
        rate = self._state_rate(x, 0.0, factor)
        self.scale = float(np.linalg.norm(rate / self.weights)) or 1.0
        return PathPoint(x, 0.0, self._scale_to_unit_length(rate, 1.0), self._count_negative_eigenvalues(factor), 0.0)

    def _find_next_point(self, here: PathPoint, step: float) -> tuple[PathPoint, float]:
        """Return the next point of the path, and the step length that was used. Raises NotConverged.

        The step is shortened until a point is found and the tangent turns only little.
        """
        while True:
            try:
                there = self.at(here, step)
                if self._scaled_scalar_product(here.tangent, there.tangent) >= TURN or step < 100 * FINEST:
                    return there, step
            except PathLost as lost:
                if step <= FINEST:
                    raise self._make_failure(f"where it ends: {lost}") from lost
            step = max(0.5 * step, FINEST) if step > FINEST else 0.0
            if step == 0.0:
                raise self._make_failure("where it has a kink")

    def at(self, here: PathPoint, step: float) -> PathPoint:
        """Return the point of the path at the distance `step` along the tangent of another point. Raises PathLost."""
        ahead, lift = here.tangent
        d, up = step * ahead, step * lift
        x, load = self._move_state(here.x, d), here.load + up
        for number in range(CORRECTIONS + 1):
            g = self.assembly.gradient(x, load)
            if not np.all(np.isfinite(g)) or not np.isfinite(self.newton.strain(x)):
                raise PathLost("the law has no states beyond it")
            if number and self._is_balanced(x, load, g):
                return self._make_path_point(here, x, load, number)
            if number == CORRECTIONS or (number > 2 and np.hypot(*self._scaled_length_and_load((d, up))) > 10 * step):
                break
            missing = step - self._scaled_scalar_product(here.tangent, (d, up))
            more, rise = self._newton_correction(x, load, g, here.tangent, missing)
            x, load, d, up = self._move_state(x, more), load + rise, d + more, up + rise
        raise PathLost("Newton's method finds no further point")

    def _newton_correction(
        self, x: Floats, load: float, g: Floats, tangent: tuple[Floats, float], missing: float
    ) -> tuple[Floats, float]:
        """Return the Newton correction of a state (dofs,) and of its load factor in the plane normal to `tangent`.

        It also adds the length `missing` along the tangent. g (dofs,) are the residual forces. Raises PathLost.
        """
        factor = self._factorise_tangent(x, load)
        try:
            rate = self._state_rate(x, load, factor)
            balance = np.zeros_like(rate)
            balance[self.assembly.free] = -factor.solve(g[self.assembly.free])
        except Singular as error:
            raise PathLost(str(error)) from error
        along = self._scaled_scalar_product(tangent, (rate, 1.0))
        if along == 0.0 or not np.isfinite(along):
            raise PathLost("the tangent is singular")
        rise = (missing - self._scaled_scalar_product(tangent, (balance, 0.0))) / along
        self._record_iteration(load, g)
        return balance + rise * rate, rise

    def _move_state(self, x: Floats, d: Floats) -> Floats:
        """Return the state after a motion d (dofs,), and set the predicted pressures for the next tangent."""
        if self.newton.has_cell_energies:
            self.newton._promised = self.newton.pressure_predictor.with_predicted_pressures(self.assembly, x, d)
        self.newton.moved = self.newton._total_motion_length(d, 1.0)
        return self.problem.space.move(x, d)

    def _make_path_point(self, here: PathPoint, x: Floats, load: float, iterations: int) -> PathPoint:
        """Return a converged state as a point of the path; its tangent continues the direction of the last point."""
        self.newton._promised = None
        factor = self._factorise_tangent(x, load)
        try:
            tangent = self._scale_to_unit_length(self._state_rate(x, load, factor), 1.0)
        except Singular:
            tangent = here.tangent
        if self._scaled_scalar_product(tangent, here.tangent) < 0.0:
            tangent = -tangent[0], -tangent[1]
        return PathPoint(
            x, load, tangent, self._count_negative_eigenvalues(factor), self._largest_displacement(x), iterations
        )

    def _largest_displacement(self, x: Floats) -> float:
        """Return the largest displacement of a node in a state x, m.

        Rods also have rotations at nodes, which are left out.
        """
        moved = x - self.origin
        if len(x) == self.assembly.dofs:
            moved, width = moved[~_mask_pressures(self.problem)], 3
        else:
            width = 7
        if len(moved) % width:  # amplitudes of a reduced model
            return float(np.abs(moved).max(initial=0.0))
        u = moved.reshape(-1, width)[:, :3]
        return float(np.linalg.norm(u, axis=1).max(initial=0.0))

    # ------------------------------------------------------------------ equations

    def _factorise_tangent(self, x: Floats, load: float) -> Factor:
        """Return a factorisation of the tangent stiffness in a state x. Raises PathLost if it is singular."""
        newton = self.newton
        assembly = newton._promised if newton._promised is not None else self.assembly
        K = assembly.tangent(x, load)
        try:
            if self.assembly.conservative:
                newton.systems.solves += 1
                newton.last = newton.systems.direct(K)
            else:
                newton.last = newton.systems.factor(K, False, TIGHTEST)
        except Singular as error:
            raise PathLost(f"the tangent is singular ({error})") from error
        newton.matrix = K
        return newton.last

    def _count_negative_eigenvalues(self, factor: Factor) -> int | None:
        """Return the number of negative eigenvalues of the tangent; None for follower loads."""
        return factor.negative_pivots if self.assembly.conservative else None

    def _state_rate(self, x: Floats, load: float, factor: Factor) -> Floats:
        """Return the derivative dx/dload (dofs,) along the path.

        Imposed displacements change by their full-load values; all other degrees of freedom follow from the tangent.
        """
        problem, free = self.problem, self.assembly.free
        change = np.zeros(problem.space.dofs)
        for energy in self.assembly.loads:
            energy.add_gradient(x, change, 1.0)
        rate = np.zeros_like(change)
        if np.any(problem.target):
            rate[problem.fixed] = problem.target
            change += self._support_motion_forces(x, load, rate)
        rate[free] = -factor.solve(change[free])
        return rate

    def _support_motion_forces(self, x: Floats, load: float, d: Floats) -> Floats:
        """Return the derivative of the forces (dofs,) by a motion d (dofs,) of the supports, by central differences."""
        eps = 1e-6 * self.problem.extent / max(float(np.abs(d).max()), np.finfo(float).tiny)
        ahead, behind = (self.assembly.gradient(self.problem.space.move(x, s * d), load) for s in (eps, -eps))
        return (ahead - behind) / (2.0 * eps)

    def _is_balanced(self, x: Floats, load: float, g: Floats) -> bool:
        """Return whether residual forces g (dofs,) are small enough for a point on the path.

        They must be below EXACT times the larger of full load and reactions, or below their rounding error.
        """
        weights, external = self.problem.weights, np.zeros_like(g)
        for energy in self.assembly.loads:
            energy.add_gradient(x, external, 1.0)
        free, fixed = self.assembly.free, self.problem.fixed
        sizes = [float(np.linalg.norm(f)) for f in (external * weights, (g * weights)[fixed])]
        left = float(np.linalg.norm((g * weights)[free]))
        return left <= max(EXACT * max(sizes), 4.0 * self.assembly.rounding(x))

    def _scaled_scalar_product(self, a: tuple[Floats, float], b: tuple[Floats, float]) -> float:
        """Return the scalar product of two vectors of a motion (dofs,) and a load, with motions scaled."""
        w = self.weights * self.scale
        return float((a[0] / w) @ (b[0] / w)) + a[1] * b[1]

    def _scaled_length_and_load(self, a: tuple[Floats, float]) -> tuple[float, float]:
        """Return the scaled length of the motion, and the load, of a vector a of both."""
        return float(np.linalg.norm(a[0] / (self.weights * self.scale))), a[1]

    def _scale_to_unit_length(self, d: Floats, load: float) -> tuple[Floats, float]:
        """Return a motion d (dofs,) and a load, scaled to unit length together."""
        size = np.sqrt(self._scaled_scalar_product((d, load), (d, load)))
        return d / size, load / size

    def _record_iteration(self, load: float, g: Floats) -> None:
        """Add an iteration to the history of the solution."""
        left = float(np.linalg.norm((g * self.problem.weights)[self.assembly.free]))
        reactions = float(np.linalg.norm((g * self.problem.weights)[self.problem.fixed]))
        self.newton._record_iteration(load, len(self.path.points), left / max(reactions, left) if left else 0.0, 1.0)

    # ------------------------------------------------------------------ full load and critical points

    def _find_full_load_point(self, here: PathPoint, there: PathPoint, step: float) -> PathPoint | None:
        """Return the equilibrium under full load between two points of the path; None if there is none."""
        top = there
        if (
            there.load < 1.0 and here.tangent[1] > 0.0 > there.tangent[1]
        ):  # the load may have exceeded 1 and decreased again
            top, step = self._find_limit_point(here, there, step)
        if not here.load < 1.0 <= top.load:
            return None
        low, high = (0.0, here.load), (step, top.load)
        for _ in range(30):
            middle = low[0] + (high[0] - low[0]) * float(np.clip((1.0 - low[1]) / (high[1] - low[1]), 0.02, 0.98))
            near = self.at(here, middle)
            if abs(near.load - 1.0) < 1e-3 and (found := self._converge_at_full_load(here, near)) is not None:
                return found
            low, high = ((middle, near.load), high) if near.load < 1.0 else (low, (middle, near.load))
        raise self._make_failure("but the point at full load was not found")

    def _converge_at_full_load(self, here: PathPoint, near: PathPoint) -> PathPoint | None:
        """Return the converged point under full load near another point; None if Newton's method leads elsewhere."""
        newton = self.newton
        newton._promised = None
        try:
            x = self.problem.space.move(near.x, self._imposed_displacements(near.x, 1.0 - near.load))
            x, done, _ = newton.full_steps(x, CORRECTIONS)
        except NotConverged:
            return None
        strayed = np.linalg.norm(x - near.x) > 0.5 * np.linalg.norm(near.x - here.x) + 1e-9 * self.scale
        if not done or strayed:
            return None
        newton._promised = None
        return PathPoint(x, 1.0, near.tangent, near.negative, self._largest_displacement(x), near.iterations)

    def _imposed_displacements(self, x: Floats, part: float) -> Floats:
        """Return a fraction `part` of the imposed displacements, shape (dofs,)."""
        d = np.zeros(self.problem.space.dofs)
        d[self.problem.fixed] = part * self.problem.target
        return d

    def _store_critical_points(self, here: PathPoint, there: PathPoint, step: float) -> None:
        """Find critical points between two points of the path, and store them."""
        turns = here.tangent[1] * there.tangent[1] < 0.0
        known = here.negative is not None and there.negative is not None
        change = (there.negative or 0) - (here.negative or 0) if known else 0
        try:
            if turns:
                self.path.limits.append(CriticalPoint(self._find_limit_point(here, there, step)[0].load, "limit point"))
            if change and abs(change) != int(turns):
                self.path.limits.append(CriticalPoint(self._find_bifurcation_load(here, there, step), "bifurcation"))
        except PathLost:
            pass  # the tangents at both points already show that a critical point lies between

    def _find_limit_point(self, here: PathPoint, there: PathPoint, step: float) -> tuple[PathPoint, float]:
        """Return the limit point between two points of the path, and its distance from the first. Raises PathLost.

        It is found by false position on the load component of the tangent (Illinois method).
        """
        a, fa, b, fb = 0.0, here.tangent[1], step, there.tangent[1]
        best, at = there, step
        for _ in range(12):
            at = (a * fb - b * fa) / (fb - fa)
            best = self.at(here, at)
            f = best.tangent[1]
            if abs(f) * (b - a) < SHARP * max(abs(best.load), 1e-3) or f == 0.0:
                break
            if f * fb < 0.0:
                a, fa = b, fb
            else:
                fa *= 0.5
            b, fb = at, f
        return best, at

    def _find_bifurcation_load(self, here: PathPoint, there: PathPoint, step: float) -> float:
        """Return the load factor of the first bifurcation between two points of the path. Raises PathLost.

        The number of negative eigenvalues changes at the bifurcation, which is found by bisection.
        """
        low, high = (0.0, here), (step, there)
        while abs(high[1].load - low[1].load) > SHARP * abs(high[1].load) and high[0] - low[0] > 1e-6 * step:
            middle = 0.5 * (low[0] + high[0])
            point = self.at(here, middle)
            low, high = ((middle, point), high) if point.negative == here.negative else (low, (middle, point))
        return 0.5 * (low[1].load + high[1].load)

    # ------------------------------------------------------------------ end of the path

    def _check_path_point(self, there: PathPoint) -> None:
        """Raise NotConverged if the path at a point has inverted cells, a reversed load, or is too far from rest."""
        checks: tuple[tuple[bool, Callable[[], str]], ...] = (
            (not self.problem.sound(there.x), lambda: "where cells become inverted"),
            (there.load < BACK, lambda: "where the load changes sign"),
            (
                there.size > FAR * self.problem.extent,
                lambda: f"where the body moved more than {FAR:.0f} times its size",
            ),
        )
        for stop, why in checks:
            if stop:
                raise self._make_failure(why())

    def _make_failure(self, why: str) -> NotConverged:
        """Return the error for a path that does not reach full load, with the reason `why`."""
        highest = max((p.load for p in self.path.points), default=0.0)
        tops = [s.load for s in self.path.limits if s.kind == "limit point" and s.load > 0.0]
        last = self.path.points[-1].load if self.path.points else 0.0
        if tops:
            reason = f"the load has a maximum of {100 * max(tops):.4g} % (limit point)"
        else:
            reason = f"the equilibrium path reaches {100 * highest:.4g} % of the load"
        text = f"{reason}; the path was followed to {100 * last:.4g} %, {why}"
        return NotConverged(text, tuple(self.newton.history), self.newton.systems.facts | self.path.facts)
