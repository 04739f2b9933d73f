"""Largest angular frequency of a body, which limits explicit time steps, updated while the body moves."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from softmark.solvers.dynamics.dynamic_forces import DynamicForces
from softmark.solvers.dynamics.dynamic_problem import Rayleigh
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.energies.energy import Floats

EVERY = 64  # steps between estimates at most
SOONEST = 4  # least number of steps between estimates, unless accelerations change too much
CHANGE = 0.005  # relative change of the frequency between two estimates: after a larger one the next comes sooner
ACCURACY = 1e-3  # of the eigenvalue
SMALL = 12  # largest number of unknowns for a dense eigenvalue solver
WARM = 24  # Lanczos vectors from a start that is nearly right


def largest_mode(K: sparse.csr_matrix, mass: Floats, start: Floats | None = None) -> tuple[float, Floats]:
    """Return the largest angular frequency, rad/s, and its vector sqrt(M) u.

    It is the square root of the largest eigenvalue of M^-1 K, M = diag(mass), by Lanczos iteration (Lanczos 1950), from
    the vector `start` of a nearby state if given. The estimate is from below, with a relative error of about ACCURACY /
    2 at most. It is infinite if K or 1/M is not finite.
    """
    if not len(mass):
        return 0.0, np.zeros(0)
    if not (np.all(np.isfinite(K.data)) and np.all(mass > 0.0)):
        return np.inf, np.ones(len(mass))
    root = sparse.diags(1.0 / np.sqrt(mass))
    A = root @ K @ root
    if len(mass) <= SMALL:
        values, vectors = np.linalg.eigh(A.toarray())
        largest, vector = float(values[-1]), vectors[:, -1]
    else:
        found = None if start is None else _largest_eigenpair_by_lanczos(A, start)
        largest, vector = found or _largest_eigenpair_by_arpack(A, start)
    return float(np.sqrt(max(largest, 0.0))), vector


def _largest_eigenpair_by_arpack(A: sparse.csr_matrix, start: Floats | None) -> tuple[float, Floats]:
    """Return the largest eigenvalue of A and its vector.

    If the iteration does not converge, the matrix norm, an upper bound, replaces the eigenvalue.
    """
    first = np.random.default_rng(0).standard_normal(A.shape[0]) if start is None else start
    try:
        values, vectors = eigsh(A, k=1, which="LA", v0=first, tol=ACCURACY)
    except ArpackNoConvergence:
        return float(abs(A).sum(axis=1).max()), first
    return float(values[0]), vectors[:, 0]


def _largest_eigenpair_by_lanczos(A: sparse.csr_matrix, start: Floats) -> tuple[float, Floats] | None:
    """Return the largest eigenvalue of A and its vector, from a nearly correct start vector.

    Ten per cent of noise is mixed into the start, because another mode may have become the fastest. Returns None if
    WARM vectors are not enough.
    """
    noise = np.random.default_rng(1).standard_normal(len(start))
    q = start / np.linalg.norm(start) + 0.1 * noise / np.linalg.norm(noise)
    Q = np.zeros((min(WARM, len(start)) + 1, len(start)))
    Q[0] = q / np.linalg.norm(q)
    alpha: list[float] = []
    beta: list[float] = []
    for k in range(len(Q) - 1):
        r = A @ Q[k]
        alpha.append(float(r @ Q[k]))
        r -= Q[: k + 1].T @ (Q[: k + 1] @ r)
        r -= Q[: k + 1].T @ (Q[: k + 1] @ r)  # twice is enough (Parlett 1980, section 6-9)
        size = float(np.linalg.norm(r))
        T = np.diag(alpha) + np.diag(beta, 1) + np.diag(beta, -1)
        values, vectors = np.linalg.eigh(T)
        if (k >= 5 and size * abs(vectors[-1, -1]) <= ACCURACY * abs(values[-1])) or size == 0.0:
            return float(values[-1]), vectors[:, -1] @ Q[: k + 1]
        beta.append(size)
        Q[k + 1] = r / size
    return None


class CriticalStepTracker:
    """Critical time step of central differences, updated while the body moves."""

    def __init__(self, forces: DynamicForces, damping: Rayleigh) -> None:
        self.forces, self.damping = forces, damping
        self.mass: Floats = forces.M.diagonal()[forces.free]
        self.omega = 0.0
        self.definite = 0.0  # largest angular frequency, rad/s, of the stiffness used for damping
        self._modes: dict[str, Floats] = {}
        self._age, self._interval = 0, SOONEST

    def critical_step(self, x: Floats, time: float) -> float:
        """Return the critical time step, s, in the state x (dofs,) at `time`, s.

        The largest frequencies are estimated again. The critical step is infinite without stiffness, and 2/w without
        damping, where w, rad/s, is the largest angular frequency of the tangent stiffness K. Let the damping matrix be
        b K', where b, s, is the damping coefficient, K' is the positive definite tangent and w', rad/s, its largest
        angular frequency. The critical step h then satisfies h^2 w^2 + 2 b h w'^2 = 4. With K' = K it is 2/w (sqrt(1 +
        z^2) - z), z = b w / 2 (Belytschko et al. 2014, section 6.2).
        """
        before, spent = self.omega, self._age
        K = self.forces.tangent(x, self.forces.factors(time))
        self.omega = self.definite = self._largest_frequency(
            "tangent", 0.5 * (K + K.T) if self.forces.rotates_without_contact else K
        )
        if self.damping.beta:
            data = self.forces.drag(x)
            self.definite = self._largest_frequency("definite", self.forces.pattern.matrix(data))
        self._age, self._interval = 0, self._steps_until_update(before, spent)
        return self.critical

    def _largest_frequency(self, name: str, K: sparse.csr_matrix) -> float:
        """Return the largest angular frequency, rad/s, of the stiffness matrix K.

        Its eigenvector is stored under `name`, to start the next estimate.
        """
        omega, self._modes[name] = largest_mode(K, self.mass, self._modes.get(name))
        return omega

    def _steps_until_update(self, before: float, spent: int) -> int:
        """Return the number of steps until the next estimate of the largest angular frequency.

        After this number of steps, the frequency will have changed by the fraction CHANGE if it continues to change at
        its recent rate. `before`, rad/s, is the previous estimate and `spent` the number of steps since then.
        """
        if not (before and spent):
            return SOONEST
        change = abs(self.omega / before - 1.0)
        longest = min(EVERY, 2 * max(self._interval, SOONEST))
        return int(np.clip(spent * CHANGE / change, SOONEST, longest)) if change else longest

    @property
    def critical(self) -> float:
        """Critical time step, s, from the last estimate of the largest frequencies."""
        w, b = self.omega, self.damping.beta * self.definite**2
        if not np.isfinite(w) or not np.isfinite(b):
            return 0.0
        return 4.0 / (np.hypot(b, 2.0 * w) + b) if w or b else np.inf

    def after(self, now: Motion, x: Floats, a: Floats, time: float) -> float:
        """Return the critical time step, s, after a step from the motion `now` to the state x with accelerations a.

        The largest angular frequency w is estimated again after at most EVERY steps, sooner if it changes. It is
        estimated at once if accelerations change by more than w can explain: |da| > w^2 |dx| in the mass norm.
        """
        self._age += 1
        free, weight = self.forces.free, np.sqrt(self.mass)
        jerk = np.linalg.norm(weight * (a - now.a)[free])
        way = np.linalg.norm(weight * (x - now.x)[free])
        if self._age >= self._interval or jerk > self.omega**2 * way:
            return self.critical_step(x, time)
        return self.critical
