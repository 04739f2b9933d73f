"""Damping forces and damping matrix of a time step: Rayleigh damping and dashpots."""

from __future__ import annotations

import numpy as np

from softmark.solvers.dynamics.dynamic_forces import DynamicForces
from softmark.solvers.dynamics.dynamic_problem import Rayleigh
from softmark.solvers.dynamics.integrator import ImplicitStepFormula, Motion
from softmark.solvers.energies.energy import DampedEnergy, Floats


class Damping:
    """Damping matrix C = alpha M + beta K plus the matrix of dashpots.

    M excludes free rigid bodies, which lose speed only by contact. K is the positive definite stiffness of the internal
    forces in the state to which the velocity belongs. In any other state a volume-preserving velocity would seem to
    change the volume by O(h), and the bulk modulus of a nearly incompressible body would turn this into spurious
    damping.
    """

    def __init__(self, forces: DynamicForces, rayleigh: Rayleigh, target: Floats) -> None:
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
        self._dashpots = [(e, slots) for e, slots in each if isinstance(e, DampedEnergy) and e.has_dashpots]

    @property
    def active(self) -> bool:
        """True if there is any damping."""
        return bool(self.rayleigh.alpha or self.rayleigh.beta or self._dashpots)

    def compute_matrix(self, x: Floats) -> None:
        """Compute the damping matrix C in the state x."""
        if not self.active:
            return
        alpha, beta = self.rayleigh.alpha, self.rayleigh.beta
        self._x = x
        if not beta and len(self.data):
            return
        self.data = beta * self.forces.drag(x) if beta else np.zeros(len(self.forces.pattern.indices))
        self.forces.add_damped_mass(self.data, alpha)
        for energy, slots in self._dashpots:
            energy.add_damping(self.data, slots)
        self._C = self.forces.pattern.matrix(self.data)
        if beta and self.length:
            self._towing = self._multiply_stiffness(self.direction)

    def predict_matrix(self, stage: ImplicitStepFormula) -> None:
        """Compute the damping matrix C of a step, from a prediction of its end state.

        If the prediction is outside the domain of the law, C is that of the start of the step.
        """
        start = stage.start
        self.compute_matrix(stage.acting(start.x + stage.step * start.v))
        if not np.all(np.isfinite(self.data)):
            self.compute_matrix(start.x)

    def update(self, stage: ImplicitStepFormula, motion: Motion) -> float:
        """Compute the damping matrix C at the end of a step, and return the change of the damping force, N."""
        v = stage.damping_velocity(motion.x, motion.v)
        before = self.force(v)
        self.compute_matrix(stage.acting(motion.x))
        return float(np.linalg.norm(self.force(v) - before))

    def rounding(self, v: Floats) -> float:
        """Return the norm of the rounding error of the damping force, N."""
        free = self.forces.free
        return float(np.finfo(np.float64).eps * np.linalg.norm(abs(self._C) @ np.abs(v[free]))) if self.active else 0.0

    def force(self, v: Floats) -> Floats:
        """Return the damping force C v (dofs,), N; zero on fixed degrees of freedom."""
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
            f[free] += self._dashpot_forces(supports)[free]
        return f

    def reaction(self, v: Floats) -> Floats:
        """Return the damping force C v (dofs,), N, on supports; zero elsewhere.

        It is computed by a difference of forces, with a relative accuracy of about 1e-7.
        """
        f = np.zeros_like(v)
        if self.active and self.length:
            fixed = self.forces.fixed
            f[fixed] = (self.rayleigh.alpha * (self.forces.M @ v) + self._dashpot_forces(v))[fixed]
            if self.rayleigh.beta:
                f[fixed] += self.rayleigh.beta * self._multiply_stiffness(v)[fixed]
        return f

    def _dashpot_forces(self, v: Floats) -> Floats:
        """Return the dashpot forces at velocities v (dofs,), N."""
        f = np.zeros_like(v)
        for energy, _ in self._dashpots:
            energy.add_drag(v, f)
        return f

    def _multiply_stiffness(self, d: Floats) -> Floats:
        """Return K d (dofs,) by a central difference of the internal forces."""
        largest = float(np.abs(d).max())
        if largest == 0.0:
            return np.zeros_like(d)
        eps = 1e-6 * max(1e-3, float(np.abs(self._x).max())) / largest
        ahead, back = (self.forces.within(self._x + s * eps * d) for s in (1.0, -1.0))
        return (ahead - back) / (2.0 * eps)
