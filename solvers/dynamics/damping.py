"""Damping of a step: Rayleigh's, and of dashpots."""

from __future__ import annotations

import numpy as np

from softmark.solvers.dynamics.dynamic_forces import Forces
from softmark.solvers.dynamics.dynamic_problem import Rayleigh
from softmark.solvers.dynamics.integrator import Motion, Stage
from softmark.solvers.energies.energy import DampedEnergy, Floats


class Damping:
    """C = alpha M + beta K and the matrix of dashpots; M without free rigid bodies, which nothing brakes but a touch.

    K is the definite stiffness of the internal forces in the state to which the velocity belongs: in any other state a
    velocity that keeps the volume seems to change it, by O(h), and the bulk modulus of a nearly
    incompressible body makes a brake of that.
    """

    def __init__(self, forces: Forces, rayleigh: Rayleigh, target: Floats) -> None:
        self.forces, self.rayleigh = forces, rayleigh
        self.direction = np.zeros(forces.dofs)  # in which supports move
        if len(target):
            self.direction[forces.fixed] = target
        self.length = float(self.direction @ self.direction)
        self.data = np.zeros(0)  # of C in the shared pattern
        self._C = forces.pattern.matrix(np.zeros(len(forces.pattern.indices)))
        self._towing = np.zeros(forces.dofs)  # K direction
        self._x = np.zeros(0)
        self._none = np.zeros(forces.dofs)
        each = zip(forces.internal, forces.pattern.slots, strict=False)
        self._dashpots = [(e, slots) for e, slots in each if isinstance(e, DampedEnergy) and e.damps]

    @property
    def active(self) -> bool:
        """Whether there is any."""
        return bool(self.rayleigh.alpha or self.rayleigh.beta or self._dashpots)

    def begin(self, x: Floats) -> None:
        """Set C to that of the state x."""
        if not self.active:
            return
        alpha, beta = self.rayleigh.alpha, self.rayleigh.beta
        self._x = x
        if not beta and len(self.data):
            return
        self.data = beta * self.forces.drag(x) if beta else np.zeros(len(self.forces.pattern.indices))
        self.forces.add_braked(self.data, alpha)
        for energy, slots in self._dashpots:
            energy.add_damping(self.data, slots)
        self._C = self.forces.pattern.matrix(self.data)
        if beta and self.length:
            self._towing = self._stiffness_times(self.direction)

    def foresee(self, stage: Stage) -> None:
        """Set C for a step, in the state to which its start leads; where there is no stiffness, in the start."""
        start = stage.start
        self.begin(stage.acting(start.x + stage.step * start.v))
        if not np.all(np.isfinite(self.data)):
            self.begin(start.x)

    def renew(self, stage: Stage, motion: Motion) -> float:
        """Set C anew where a step has ended; by how much its force differs now, N."""
        v = stage.speeding(motion.x, motion.v)
        before = self.force(v)
        self.begin(stage.acting(motion.x))
        return float(np.linalg.norm(self.force(v) - before))

    def rounding(self, v: Floats) -> float:
        """Norm of what rounding leaves in its force, N."""
        free = self.forces.free
        return float(np.finfo(np.float64).eps * np.linalg.norm(abs(self._C) @ np.abs(v[free]))) if self.active else 0.0

    def force(self, v: Floats) -> Floats:
        """C v on the free degrees of freedom, zero on the others (dofs,), N."""
        if not self.active:
            return self._none
        f = np.zeros_like(v)
        free, fixed = self.forces.free, self.forces.fixed
        f[free] = self._C @ v[free]
        if self.length:
            supports = np.zeros_like(v)
            supports[fixed] = v[fixed]
            rate = float(supports @ self.direction) / self.length
            f[free] += (self.rayleigh.alpha * (self.forces.M @ supports) + self.rayleigh.beta * rate * self._towing)[
                free
            ]
            f[free] += self._dragged(supports)[free]
        return f

    def reaction(self, v: Floats) -> Floats:
        """C v on the supports, zero elsewhere (dofs,), N; by a difference of forces, good to about 1e-7."""
        f = np.zeros_like(v)
        if self.active and self.length:
            fixed = self.forces.fixed
            f[fixed] = (self.rayleigh.alpha * (self.forces.M @ v) + self._dragged(v))[fixed]
            if self.rayleigh.beta:
                f[fixed] += self.rayleigh.beta * self._stiffness_times(v)[fixed]
        return f

    def _dragged(self, v: Floats) -> Floats:
        """What dashpots take at speeds v (dofs,), N."""
        f = np.zeros_like(v)
        for energy, _ in self._dashpots:
            energy.add_drag(v, f)
        return f

    def _stiffness_times(self, d: Floats) -> Floats:
        """K d by a central difference of the internal forces."""
        largest = float(np.abs(d).max())
        if largest == 0.0:
            return np.zeros_like(d)
        eps = 1e-6 * max(1e-3, float(np.abs(self._x).max())) / largest
        ahead, back = (self.forces.within(self._x + s * eps * d) for s in (1.0, -1.0))
        return (ahead - back) / (2.0 * eps)
