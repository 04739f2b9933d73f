"""One material point: a homogeneous state of a law, some of its stretches imposed, the others free of stress.

F is diagonal but for one shear. What is imposed is imposed exactly; each other stretch is what leaves its axis the
nominal stress that acts there, mostly none: Newton's method on the law, a handful of unknowns, no mesh. A solid that
keeps its volume has a pressure for its constraint.
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
from softmark.solvers.materials.volumetric_constraints import Constraint, OfVolume
from softmark.solvers.statics.isotropic_material_point import PrincipalPoint, in_reach
from softmark.solvers.statics.material_point_state import (
    FARTHEST,
    HALVINGS,
    HELD,
    ROUNDING,
    SETTLED,
    STILL,
    Drive,
    Floats,
    NoState,
    PointState,
)

__all__ = ["FLAT", "Drive", "Floats", "MaterialPoint", "NoState", "PointState"]

AXES = (0, 4, 8)  # the entries aa of nine
MOST = 20  # iterations for a part of the way
SHORTEST = 1e-3  # of the way from rest: a part below is not tried again
BISECTIONS = 30  # of the way from rest, to where a state is first unstable
NOTHING = 1e-6  # of a volume: what is left of less is flat, and some laws have no stress across that
FLAT = 1e-9  # of the stiffness at rest: what resists less gives way


@dataclass(frozen=True, eq=False)
class MaterialPoint:
    """A law at one point; of a solid that keeps its volume, the law of its shape and the constraint."""

    law: Law
    constraint: Constraint | None = None
    linear: bool = False  # strains are small: no stretch is too far

    def state(self, drive: Drive, iterations: int = 50) -> PointState:
        """The state under what is imposed. Raises NoState."""
        with np.errstate(all="ignore"):  # beyond its domain a law says inf or NaN
            if not any(drive.stresses.tolist()):
                way = self._way(drive)
                found = self._sound(way, drive, way.newton(drive, way.guess(drive), iterations))
                if found is not None:
                    return found
            return self._followed(drive, iterations)

    def first_lost(self, drive: Drive) -> PointState:
        """The state on the way from rest from which on it gives way: of one that does in the end. Raises NoState."""
        return self._first(drive, lambda found: found.freed > FLAT)

    def first_unsteady(self, drive: Drive) -> PointState:
        """The state from which on it is not stable after Drucker: of one that is not in the end. Raises NoState."""
        return self._first(drive, self.steady)

    def steady(self, state: PointState) -> bool:
        """Whether its law is stable after Drucker in a state, or is not asked (materials/drucker_stability.py)."""
        from softmark.solvers.materials.batched_stability import Held
        from softmark.solvers.materials.drucker_stability import lost

        held = None
        if self.constraint is not None:
            held = Held(self.constraint, math.inf, np.array([state.pressure]))
        found = None if self.linear else lost(self.law, state.F[None], held)
        return found is None or not bool(found[0])

    def _first(self, drive: Drive, holds: Callable[[PointState], bool]) -> PointState:
        """The first state on the way from rest of which something does not hold, as it does not in the end."""
        low, high, state = 0.0, 1.0, self.state(drive)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            found = self.state(drive.at(middle))
            if holds(found):
                low = middle
            else:
                high, state = middle, found
        return state

    # ------------------------------------------------------------------ the way to a state

    def _way(self, drive: Drive) -> MaterialPoint | PrincipalPoint:
        """What finds it: plain numbers in principal axes where that can be, else arrays."""
        known = None if self.linear else self._principal
        return known if known is not None and in_reach(drive) else self

    @cached_property
    def _principal(self) -> PrincipalPoint | None:
        free = self.constraint is None or isinstance(self.constraint, OfVolume)
        return PrincipalPoint(self.law, self.constraint) if free and hasattr(self.law, "principal") else None

    def _followed(self, drive: Drive, iterations: int) -> PointState:
        """The state by way of others from rest."""
        reached, step, total, found = 0.0, 0.125, 0, None
        start: tuple[Floats, float] = (np.ones(3), 0.0)
        while reached < 1.0:
            share = min(1.0, reached + step)
            part = drive.at(share)
            way = self._way(part)
            then = self._sound(way, part, way.newton(part, start, min(iterations, MOST)))
            if then is not None:
                reached, found, step = share, then, min(2.0 * step, 0.25)
                start, total = (then.F.diagonal(), then.pressure), total + then.iterations
            elif (step := 0.5 * step) < SHORTEST:
                raise NoState(reached, start[0])
        return replace(found or self.told(drive, (*start, 0)), iterations=total)

    def _sound(self, way: Any, drive: Drive, found: Any) -> PointState | None:
        """What is said of a state that lies in the law's domain and does not give way as it is held."""
        told: PointState | None = None if found is None else way.told(drive, found)
        if told is None or self.linear:
            return told
        sound = math.isfinite(told.psi) and told.held > 0.0 and told.volume > NOTHING
        return told if sound else None

    # ------------------------------------------------------------------ Newton's method on arrays, for any law

    def newton(self, drive: Drive, start: tuple[Any, float], most: int) -> tuple[Floats, float, int] | None:
        """Stretches, pressure and iterations from a start; None where it comes to no rest."""
        free = np.flatnonzero(np.isnan(drive.stretches))
        t, p = np.where(np.isnan(drive.stretches), start[0], drive.stretches), start[1]
        if not len(free):
            return self._relieved(drive, t)
        with np.errstate(all="ignore"):
            left = self._left(drive, t, p, free)
            for number in range(most):
                try:
                    step: Floats = np.linalg.solve(self._slope(drive, t, p, free), -left).astype(np.float64)
                except np.linalg.LinAlgError:
                    return None
                moved = self._searched(drive, (t, p, left), free, step)
                if moved is None:
                    settled = np.abs(left).max() <= SETTLED * self._stiff
                    return (t, p, number) if settled else None
                t, p, left = moved
                short = np.abs(step[: len(free)]).max() <= STILL
                if short or np.abs(left).max() <= ROUNDING * self._stiff:
                    return t, p, number + 1
        return None

    def _searched(self, drive: Drive, at: tuple[Floats, float, Floats], free: NDArray[np.intp], step: Floats,
                  ) -> tuple[Floats, float, Floats] | None:  # fmt: skip
        """Along a step to what lowers what is left; None where nothing does."""
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
            then = self._left(drive, now, pressure, free)
            if np.all(np.isfinite(then)) and np.linalg.norm(then) < size:
                return now, pressure, then
            part *= 0.5
        return None

    def _relieved(self, drive: Drive, t: Floats) -> tuple[Floats, float, int] | None:
        """A state with no stretch left to find, if it keeps a volume that must be kept."""
        if self.constraint is None:
            return t, 0.0, 0
        F, c = drive.F(t), drive.relieved
        if not abs(float(self.constraint.value(F)[0])) <= HELD:
            return None
        return t, -float(self.law.P(F)[0, c, c] / self.constraint.gradient(F)[0, c, c]), 0

    def _left(self, drive: Drive, t: Floats, p: float, free: NDArray[np.intp]) -> Floats:
        """What is left of Kirchhoff's stress on free axes, Pa, and of the constraint, times the stiffness at rest.

        By logarithms of stretches, in which a change of volume is linear; of small strains the nominal stress.
        """
        left = self._unbalanced(drive, t, p)[free]
        left = left if self.linear else t[free] * left
        if self.constraint is None:
            return left
        return np.append(left, self._stiff * self.constraint.value(drive.F(t)))

    def _slope(self, drive: Drive, t: Floats, p: float, free: NDArray[np.intp]) -> Floats:
        """Its derivative by logarithms of free stretches, of small strains by these, and by the pressure."""
        F, own = drive.F(t), np.ones(len(free)) if self.linear else t[free]
        H = own[:, None] * self._hessian(F, p)[np.ix_(free, free)] * own
        if not self.linear:
            H = H + np.diag(own * self._unbalanced(drive, t, p)[free])
        if self.constraint is None:
            return H
        g = own * self.constraint.gradient(F)[0].diagonal()[free]
        found = np.zeros((len(free) + 1, len(free) + 1))
        found[:-1, :-1], found[:-1, -1], found[-1, :-1] = H, g, self._stiff * g
        return found

    def _unbalanced(self, drive: Drive, t: Floats, p: float) -> Floats:
        """The nominal stress along the axes less what acts there (3,), Pa."""
        F = drive.F(t)
        stress: Floats = self.law.P(F)[0].diagonal() - drive.stresses
        return stress if self.constraint is None else stress + p * self.constraint.gradient(F)[0].diagonal()

    def _hessian(self, F: Floats, p: float) -> Floats:
        """The second derivative of the energy by the stretches along the axes (3, 3), Pa."""
        found: Floats = self.law.dPdF(F)[0].reshape(9, 9)[np.ix_(AXES, AXES)]
        if self.constraint is not None:
            found = found + self.constraint.curvature(F, np.array([p]))[0].reshape(9, 9)[np.ix_(AXES, AXES)]
        return found

    def guess(self, drive: Drive) -> tuple[Floats, float]:
        """What free stretches would be if strains were logarithmic and small."""
        free = np.isnan(drive.stretches)
        given = np.where(free, 1.0, drive.stretches)
        if not free.any() or np.any(given <= 0.0):
            return np.ones(3), 0.0
        log, H = np.log(given), self._at_rest
        if self.constraint is not None:
            return np.exp(np.where(free, -log.sum() / free.sum(), log)), 0.0
        log[free] = np.linalg.solve(H[np.ix_(free, free)], -H[np.ix_(free, ~free)] @ log[~free])
        return np.exp(log), 0.0

    @cached_property
    def _at_rest(self) -> Floats:
        return self._hessian(np.eye(3)[None], 0.0)

    @cached_property
    def _stiff(self) -> float:
        """The stiffness at rest, Pa."""
        return float(np.abs(self._at_rest).max())

    # ------------------------------------------------------------------ what is told of it

    def told(self, drive: Drive, found: tuple[Floats, float, int]) -> PointState:
        """All that is said of a state."""
        t, p, iterations = found
        F, free = drive.F(t), np.flatnonzero(np.isnan(drive.stretches))
        P, normal = self.law.P(F)[0], np.zeros(3)
        if self.constraint is not None:
            g = self.constraint.gradient(F)[0]
            P, normal = P + p * g, g.diagonal()
        left = np.abs(P.diagonal()[free] - drive.stresses[free]).max(initial=0.0)
        H, scale = self._hessian(F, p), self._shear(self._at_rest)
        held = _least(H, normal, free) / scale
        if drive.shear is not None:
            a, b, _ = drive.shear
            freed = float(self.law.dPdF(F)[0, a, b, a, b]) / scale
        else:
            freed = _least(H, normal, np.union1d(free, drive.driven)) / scale
        largest = float(np.abs(P).max())
        return PointState(F[0], P, float(self.law.psi(F)[0]), p, float(left) / largest if largest else 0.0, iterations,
                          held, freed)  # fmt: skip

    @staticmethod
    def _shear(H: Floats) -> float:
        """mu, Pa, of the stiffness at rest along the axes."""
        return 0.5 * float(H[0, 0] - H[0, 1])


def _least(H: Floats, normal: Floats, some: NDArray[np.intp]) -> float:
    """The least eigenvalue of H among some axes, in the plane normal to what a constraint holds; inf of nothing."""
    if not len(some):
        return float("inf")
    part, n = H[np.ix_(some, some)], normal[some]
    if np.any(n):
        across = np.linalg.svd(n[None])[2][1:]  # rows that span the plane
        if not len(across):
            return float("inf")
        part = across @ part @ across.T
    return float(np.linalg.eigvalsh(part)[0])
