"""Material point: a homogeneous state of a law with some stretches imposed and given stresses on the other axes.

The deformation gradient F is diagonal except for one shear. Imposed values are exact. Every other stretch is found such
that its axis has the prescribed nominal stress, mostly zero, by Newton's method on the law with a handful of unknowns
and no mesh. An incompressible solid has a pressure as additional unknown for its volume constraint.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.materials.constitutive_law import Law
from softmark.solvers.materials.volumetric_constraints import Constraint, VolumeRatioConstraint
from softmark.solvers.statics.isotropic_material_point import PrincipalStretchSolver, is_applicable
from softmark.solvers.statics.material_point_state import (
    FARTHEST,
    HALVINGS,
    HELD,
    ROUNDING,
    SETTLED,
    STILL,
    Floats,
    ImposedDeformation,
    NoState,
    PointState,
)

__all__ = ["FLAT", "Floats", "ImposedDeformation", "MaterialPoint", "NoState", "PointState"]

AXES = (0, 4, 8)  # positions of diagonal entries in nine components
MOST = 20  # largest number of iterations for a part of the path from rest
SHORTEST = 1e-3  # shortest part of the path from rest
BISECTIONS = 30  # number of bisections for the first unstable state
NOTHING = 1e-6  # least volume ratio: flatter states have no stress in some laws
FLAT = 1e-9  # of the stiffness at rest: lower stiffness is unstable


@dataclass(frozen=True, eq=False)
class MaterialPoint:
    """Law at one point, from which homogeneous states are solved.

    For an incompressible solid, `law` is its isochoric law and `constraint` its volume constraint. For a compressible
    solid `constraint` is None.
    """

    law: Law
    constraint: Constraint | None = None
    linear: bool = False  # small strains

    def state(self, drive: ImposedDeformation, iterations: int = 50) -> PointState:
        """Return the state under an imposed deformation. Raises NoState."""
        with np.errstate(all="ignore"):  # outside its domain a law returns inf or NaN
            if not any(drive.stresses.tolist()):
                way = self._select_solver(drive)
                found = self._accept_stable_state(way, drive, way.newton(drive, way.guess(drive), iterations))
                if found is not None:
                    return found
            return self._follow_from_rest(drive, iterations)

    def first_unstable_state(self, drive: ImposedDeformation) -> PointState:
        """Return the first unstable state on the way from rest to an imposed deformation.

        The state under the full imposed deformation must be unstable. Raises NoState.
        """
        return self._first_violating_state(drive, lambda found: found.freed > FLAT)

    def first_drucker_unstable_state(self, drive: ImposedDeformation) -> PointState:
        """Return the first state on the way from rest to an imposed deformation that violates Drucker stability.

        The state under the full imposed deformation must violate it. Raises NoState.
        """
        return self._first_violating_state(drive, self.is_drucker_stable)

    def is_drucker_stable(self, state: PointState) -> bool:
        """Return whether the law satisfies Drucker stability in a state.

        Laws without such a check count as stable (materials/drucker_stability.py).
        """
        from softmark.solvers.materials.batched_stability import VolumePressure
        from softmark.solvers.materials.drucker_stability import find_instability

        held = None
        if self.constraint is not None:
            held = VolumePressure(self.constraint, math.inf, np.array([state.pressure]))
        found = None if self.linear else find_instability(self.law, state.F[None], held)
        return found is None or not bool(found[0])

    def _first_violating_state(self, drive: ImposedDeformation, holds: Callable[[PointState], bool]) -> PointState:
        """Return the first state on the way from rest for which the condition `holds` is false, by bisection."""
        low, high, state = 0.0, 1.0, self.state(drive)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            found = self.state(drive.at(middle))
            if holds(found):
                low = middle
            else:
                high, state = middle, found
        return state

    # ------------------------------------------------------------------ path to a state

    def _select_solver(self, drive: ImposedDeformation) -> MaterialPoint | PrincipalStretchSolver:
        """Return the solver for an imposed deformation: the one in principal axes if it applies, else this one."""
        known = None if self.linear else self._principal_stretch_solver
        return known if known is not None and is_applicable(drive) else self

    @cached_property
    def _principal_stretch_solver(self) -> PrincipalStretchSolver | None:
        """Solver in principal axes; None if the law has no form in principal stretches."""
        free = self.constraint is None or isinstance(self.constraint, VolumeRatioConstraint)
        return PrincipalStretchSolver(self.law, self.constraint) if free and hasattr(self.law, "principal") else None

    def _follow_from_rest(self, drive: ImposedDeformation, iterations: int) -> PointState:
        """Return the state under an imposed deformation, through intermediate states from rest. Raises NoState."""
        reached, step, total, found = 0.0, 0.125, 0, None
        start: tuple[Floats, float] = (np.ones(3), 0.0)
        while reached < 1.0:
            share = min(1.0, reached + step)
            part = drive.at(share)
            way = self._select_solver(part)
            then = self._accept_stable_state(way, part, way.newton(part, start, min(iterations, MOST)))
            if then is not None:
                reached, found, step = share, then, min(2.0 * step, 0.25)
                start, total = (then.F.diagonal(), then.pressure), total + then.iterations
            elif (step := 0.5 * step) < SHORTEST:
                raise NoState(reached, start[0])
        return replace(found or self.complete_state(drive, (*start, 0)), iterations=total)

    def _accept_stable_state(self, way: Any, drive: ImposedDeformation, found: Any) -> PointState | None:
        """Return a solution `found` as a state if it is stable and in the domain of the law, else None."""
        told: PointState | None = None if found is None else way.complete_state(drive, found)
        if told is None or self.linear:
            return told
        sound = math.isfinite(told.psi) and told.held > 0.0 and told.volume > NOTHING
        return told if sound else None

    # ------------------------------------------------------------------ Newton's method on arrays, for any law

    def newton(
        self, drive: ImposedDeformation, start: tuple[Any, float], most: int
    ) -> tuple[Floats, float, int] | None:
        """Return stretches (3,), pressure and number of iterations of the solution; None without convergence.

        `start` has initial stretches and pressure; `most` is the largest number of iterations.
        """
        free = np.flatnonzero(np.isnan(drive.stretches))
        t, p = np.where(np.isnan(drive.stretches), start[0], drive.stretches), start[1]
        if not len(free):
            return self._solve_imposed_stretches(drive, t)
        with np.errstate(all="ignore"):
            left = self._residual(drive, t, p, free)
            for number in range(most):
                try:
                    step: Floats = np.linalg.solve(self._residual_jacobian(drive, t, p, free), -left).astype(np.float64)
                except np.linalg.LinAlgError:
                    return None
                moved = self._line_step(drive, (t, p, left), free, step)
                if moved is None:
                    settled = np.abs(left).max() <= SETTLED * self._largest_stiffness
                    return (t, p, number) if settled else None
                t, p, left = moved
                short = np.abs(step[: len(free)]).max() <= STILL
                if short or np.abs(left).max() <= ROUNDING * self._largest_stiffness:
                    return t, p, number + 1
        return None

    def _line_step(
        self, drive: ImposedDeformation, at: tuple[Floats, float, Floats], free: NDArray[np.intp], step: Floats
    ) -> tuple[Floats, float, Floats] | None:
        """Return the first point with a smaller residual along a Newton step, by halving; None if there is none.

        `at` and the result have stretches (3,), a pressure, Pa, and the residual; `free` are the free axes.
        """
        t, p, left = at
        if not np.all(np.isfinite(step)):
            return None
        part, size = 1.0, float(np.linalg.norm(left))
        for _ in range(HALVINGS):
            now = t.copy()
            if self.linear:
                now[free] += part * step[: len(free)]
            else:
                now[free] *= np.exp(np.clip(part * step[: len(free)], -FARTHEST, FARTHEST))
            pressure = p if self.constraint is None else p + part * float(step[-1])
            then = self._residual(drive, now, pressure, free)
            if np.all(np.isfinite(then)) and np.linalg.norm(then) < size:
                return now, pressure, then
            part *= 0.5
        return None

    def _solve_imposed_stretches(self, drive: ImposedDeformation, t: Floats) -> tuple[Floats, float, int] | None:
        """Return the solution for imposed stretches t (3,) on all axes; None if they violate the volume constraint.

        The pressure makes the stress on the relieved axis zero.
        """
        if self.constraint is None:
            return t, 0.0, 0
        F, c = drive.F(t), drive.relieved
        if not abs(float(self.constraint.value(F)[0])) <= HELD:
            return None
        return t, -float(self.law.P(F)[0, c, c] / self.constraint.gradient(F)[0, c, c]), 0

    def _residual(self, drive: ImposedDeformation, t: Floats, p: float, free: NDArray[np.intp]) -> Floats:
        """Return the residual: Kirchhoff stresses on free axes minus the prescribed ones, Pa, and the constraint.

        The volume constraint is multiplied by the stiffness at rest, Pa. The unknowns are logarithms of stretches, in
        which a volume change is linear. For small strain they are the stretches, with nominal stresses.
        """
        left = self._unbalanced_stresses(drive, t, p)[free]
        left = left if self.linear else t[free] * left
        if self.constraint is None:
            return left
        return np.append(left, self._largest_stiffness * self.constraint.value(drive.F(t)))

    def _residual_jacobian(self, drive: ImposedDeformation, t: Floats, p: float, free: NDArray[np.intp]) -> Floats:
        """Return the Jacobian of the residual by logarithms of free stretches and by the pressure.

        For small strain it is the derivative by the stretches.
        """
        F, own = drive.F(t), np.ones(len(free)) if self.linear else t[free]
        H = own[:, None] * self._energy_hessian(F, p)[np.ix_(free, free)] * own
        if not self.linear:
            H = H + np.diag(own * self._unbalanced_stresses(drive, t, p)[free])
        if self.constraint is None:
            return H
        g = own * self.constraint.gradient(F)[0].diagonal()[free]
        found = np.zeros((len(free) + 1, len(free) + 1))
        found[:-1, :-1], found[:-1, -1], found[-1, :-1] = H, g, self._largest_stiffness * g
        return found

    def _unbalanced_stresses(self, drive: ImposedDeformation, t: Floats, p: float) -> Floats:
        """Return the nominal stresses (3,) along the axes minus the prescribed ones, Pa."""
        F = drive.F(t)
        stress: Floats = self.law.P(F)[0].diagonal() - drive.stresses
        return stress if self.constraint is None else stress + p * self.constraint.gradient(F)[0].diagonal()

    def _energy_hessian(self, F: Floats, p: float) -> Floats:
        """Return the second derivative (3, 3), Pa, of the energy by the stretches along the axes."""
        found: Floats = self.law.dPdF(F)[0].reshape(9, 9)[np.ix_(AXES, AXES)]
        if self.constraint is not None:
            found = found + self.constraint.curvature(F, np.array([p]))[0].reshape(9, 9)[np.ix_(AXES, AXES)]
        return found

    def guess(self, drive: ImposedDeformation) -> tuple[Floats, float]:
        """Return initial stretches (3,), from the linear law for logarithmic strains, and zero pressure."""
        free = np.isnan(drive.stretches)
        given = np.where(free, 1.0, drive.stretches)
        if not free.any() or np.any(given <= 0.0):
            return np.ones(3), 0.0
        log, H = np.log(given), self._stiffness_at_rest
        if self.constraint is not None:
            return np.exp(np.where(free, -log.sum() / free.sum(), log)), 0.0
        log[free] = np.linalg.solve(H[np.ix_(free, free)], -H[np.ix_(free, ~free)] @ log[~free])
        return np.exp(log), 0.0

    @cached_property
    def _stiffness_at_rest(self) -> Floats:
        """Stiffness of the undeformed law along the axes (3, 3), Pa."""
        return self._energy_hessian(np.eye(3)[None], 0.0)

    @cached_property
    def _largest_stiffness(self) -> float:
        """Largest stiffness of the undeformed law, Pa."""
        return float(np.abs(self._stiffness_at_rest).max())

    # ------------------------------------------------------------------ results

    def complete_state(self, drive: ImposedDeformation, found: tuple[Floats, float, int]) -> PointState:
        """Return the complete state of a solution `found` of `newton`."""
        t, p, iterations = found
        F, free = drive.F(t), np.flatnonzero(np.isnan(drive.stretches))
        P, normal = self.law.P(F)[0], np.zeros(3)
        if self.constraint is not None:
            g = self.constraint.gradient(F)[0]
            P, normal = P + p * g, g.diagonal()
        left = np.abs(P.diagonal()[free] - drive.stresses[free]).max(initial=0.0)
        H, scale = self._energy_hessian(F, p), self._shear_modulus(self._stiffness_at_rest)
        held = _least_restricted_eigenvalue(H, normal, free) / scale
        if drive.shear is not None:
            a, b, _ = drive.shear
            freed = float(self.law.dPdF(F)[0, a, b, a, b]) / scale
        else:
            freed = _least_restricted_eigenvalue(H, normal, np.union1d(free, drive.driven)) / scale
        largest = float(np.abs(P).max())
        return PointState(F[0], P, float(self.law.psi(F)[0]), p, float(left) / largest if largest else 0.0, iterations,
                          held, freed)  # fmt: skip

    @staticmethod
    def _shear_modulus(H: Floats) -> float:
        """Return the shear modulus mu, Pa, from the stiffness H (3, 3), Pa, of the undeformed law along the axes."""
        return 0.5 * float(H[0, 0] - H[0, 1])


def _least_restricted_eigenvalue(H: Floats, normal: Floats, some: NDArray[np.intp]) -> float:
    """Return the least eigenvalue of H (3, 3) restricted to the axes `some`; inf without axes.

    With a constraint gradient `normal` (3,), only directions perpendicular to it count.
    """
    if not len(some):
        return float("inf")
    part, n = H[np.ix_(some, some)], normal[some]
    if np.any(n):
        across = np.linalg.svd(n[None])[2][1:]  # rows that span the plane
        if not len(across):
            return float("inf")
        part = across @ part @ across.T
    return float(np.linalg.eigvalsh(part)[0])
