"""The largest angular frequency of a body, which limits explicit steps."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from softmark.solvers.dynamics.forces import Forces
from softmark.solvers.dynamics.problem import Rayleigh
from softmark.solvers.dynamics.scheme import Motion
from softmark.solvers.energies.energy import Floats

EVERY = 64  # steps between estimates, where nothing tells of an earlier need
ACCURACY = 1e-3  # of the eigenvalue
SMALL = 12  # degrees of freedom that a dense eigenvalue solver takes at once


def largest_frequency(K: sparse.csr_matrix, mass: Floats) -> float:
    """sqrt of the largest eigenvalue of M^-1 K, rad/s, M = diag(mass), by Lanczos iteration (Lanczos 1950).

    It comes from below, with a relative error of about ACCURACY / 2 at most.
    """
    if not len(mass):
        return 0.0
    root = sparse.diags(1.0 / np.sqrt(mass))
    A = root @ K @ root
    if len(mass) <= SMALL:
        largest = float(np.linalg.eigvalsh(A.toarray())[-1])
    else:
        start = np.random.default_rng(0).standard_normal(len(mass))
        try:
            values = eigsh(A, k=1, which="LA", v0=start, tol=ACCURACY, return_eigenvectors=False)
            largest = float(values[0])
        except ArpackNoConvergence:  # the norm bounds every eigenvalue
            largest = float(abs(A).sum(axis=1).max())
    return float(np.sqrt(max(largest, 0.0)))


class Frequencies:
    """Keeps the critical step while the body moves."""

    def __init__(self, forces: Forces, damping: Rayleigh) -> None:
        self.forces, self.damping = forces, damping
        self.mass: Floats = forces.M.diagonal()[forces.free]
        self.omega = 0.0
        self._age = 0

    def critical_step(self, x: Floats, time: float) -> float:
        """2/w (sqrt(1 + z^2) - z) in the state x, s; infinite where nothing is stiff."""
        self.omega = largest_frequency(self.forces.tangent(x, time), self.mass)
        self._age = 0
        return self._critical()

    def _critical(self) -> float:
        z = 0.5 * self.damping.beta * self.omega
        return 2.0 / self.omega * (np.hypot(1.0, z) - z) if self.omega else np.inf

    def after(self, now: Motion, x: Floats, a: Floats, time: float) -> float:
        """The critical step after a step from `now` to x.

        Estimated anew every EVERY steps, and as soon as accelerations have changed over displacements by more
        than the largest frequency explains: |da| > w^2 |dx| in the norm of the mass.
        """
        self._age += 1
        free, weight = self.forces.free, np.sqrt(self.mass)
        jerk = np.linalg.norm(weight * (a - now.a)[free])
        way = np.linalg.norm(weight * (x - now.x)[free])
        if self._age >= EVERY or jerk > self.omega**2 * way:
            return self.critical_step(x, time)
        return self._critical()
