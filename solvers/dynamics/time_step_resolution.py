"""Time-step resolution: steps per period of the slowest vibration that loads excite, and its integration error.

The vibration is the lowest mode that the loads excite. It is found by inverse iteration from their static deflection,
which continues Rayleigh's quotient (Rayleigh 1877, section 88). The effect of an integrator is known in closed form: in
a step h a mode of angular frequency w advances by a phase theta instead of w h and is scaled by |z|, with z the
principal eigenvalue of its amplification matrix (Hughes 1987, section 9.1; Hairer, Norsett and Wanner 1993).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.dynamics.bdf2 import BDF2
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_forces import DynamicForces
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.generalized_alpha import GeneralizedAlpha
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.newmark import Newmark
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Singular, factor

if TYPE_CHECKING:
    from softmark.solvers.dynamics.integrator import Integrator

ITERATIONS = 6  # iterations of inverse iteration: the relative error of the frequency is then below 1e-3
SHIFT = 1e-10  # of the largest ratio of stiffness to mass: shift that makes the matrix of a free body regular
RIGID = 1e-8  # of the same ratio: below it lie motions without strain
FEW = 10.0  # steps to a period
LEAST = 2.0  # least number of steps per time constant of an overdamped body
WRONG = 0.05  # of its swing, at the end


@dataclass(frozen=True)
class Resolution:
    """Slowest vibration that loads excite, and how well the time step resolves it.

    The fields contain the number of steps per period and the errors of time integration.
    """

    period: float  # s
    steps: float  # to a period
    slow: float  # relative error of the period; positive if it is too long
    kept: float  # amplitude after a period, relative to that with physical damping only
    error: float  # error at the end of the analysis, relative to the initial amplitude
    motion: str = "vibration"  # or `turn`: rotation of a free body; or `return`: overdamped return to rest
    few: float = FEW  # steps per period below which the resolution is doubtful

    @property
    def doubtful(self) -> bool:
        """True with fewer steps per period than `few`, or a final integration error above WRONG.

        The error is relative to the initial amplitude of the vibration.
        """
        return self.steps < self.few or self.error > WRONG

    @property
    def facts(self) -> dict[str, float | str]:
        """Return the facts shown in a report."""
        return {
            "of": self.motion, "period_s": self.period, "steps_per_period": self.steps, "period_error": self.slow,
            "kept_per_period": self.kept, "error_at_end": self.error,
        }  # fmt: skip


def find_resolution(problem: Dynamics, points: Floats, duration: float, step: float) -> Resolution | None:
    """Return how well steps of `step`, s, resolve the motion of a problem over `duration`, s.

    Returns None if loads excite only rigid motion, or the vibration is not found.
    """
    w = lowest_excited_frequency(DynamicForces(problem), problem, points)
    return None if w is None else resolve_vibration(problem.integrator, problem.damping, w, duration, step)


def resolve_vibration(
    integrator: Integrator, damping: Rayleigh, w: float, duration: float, step: float
) -> Resolution | None:
    """Return how well steps resolve a vibration of angular frequency w, rad/s; None for an unknown integrator."""
    z = amplification(integrator, w * step)
    if z is None:
        return None
    rate = 0.5 * damping.alpha + 0.5 * damping.beta * w**2  # 1/s, at which it fades
    if rate >= w:
        return _resolve_overdamped(integrator, w, rate, duration, step)
    count, turn = duration / step, cmath.phase(z)
    fade = math.exp(-min(rate * duration, 700.0))
    kept = math.exp(max(count * math.log(abs(z)), -700.0)) if abs(z) > 0.0 else 0.0
    lag = count * (w * step - turn)
    # two phases that differ; beyond half a period the error is at its maximum
    apart = abs(1.0 - kept * cmath.exp(1j * min(abs(lag), math.pi)))
    per = 2.0 * math.pi / (w * step)
    each = abs(z) ** (2.0 * math.pi / turn) if turn and abs(z) else 0.0
    slow = w * step / turn - 1.0 if turn else math.inf
    return Resolution(2.0 * math.pi / w, per, min(slow, 1e9), each, fade * apart)


def _resolve_overdamped(integrator: Integrator, w: float, rate: float, duration: float, step: float) -> Resolution:
    """Return how well steps resolve the slower of the two decays of an overdamped mode.

    There is no vibration, but a decay exp(-t / T), T = (rate + sqrt(rate^2 - w^2)) / w^2. Implicit Euler multiplies it
    by (1 + h / T)^-1 per step; the other integrators are close to the Pade approximation (1 - h / 2T) / (1 + h / 2T).
    """
    T = (rate + math.sqrt(rate**2 - w**2)) / w**2
    z = step / T
    kept = 1.0 / (1.0 + z) if isinstance(integrator, ImplicitEuler) else abs(1.0 - 0.5 * z) / (1.0 + 0.5 * z)
    count = duration / step
    error = abs(math.exp(-min(duration / T, 700.0)) - kept**count)
    return Resolution(T, 1.0 / z, 0.0, 1.0, error, "return", LEAST)


# ------------------------------------------------------------------ integrators


def amplification(integrator: Integrator, wh: float) -> complex | None:
    """Return the principal eigenvalue, near exp(i w h), of one step of an undamped vibration; None if unknown."""
    match integrator:
        case ImplicitEuler():
            return 1.0 / complex(1.0, -wh)
        case BDF2():  # (3/2 - i w h) z^2 - 2 z + 1/2 = 0
            return (2.0 + cmath.sqrt(1.0 + 2.0j * wh)) / complex(3.0, -2.0 * wh)
        case CentralDifferences():
            half = min(0.5 * wh, 1.0)
            return cmath.exp(2.0j * math.asin(half))
        case GeneralizedAlpha(spectral_radius=r):
            m, f = (2.0 * r - 1.0) / (r + 1.0), r / (r + 1.0)
            return _newmark_amplification(0.25 * (1.0 - m + f) ** 2, 0.5 - m + f, m, f, wh)
        case Newmark(beta=b, gamma=c):
            return _newmark_amplification(b, c, 0.0, 0.0, wh)
    from softmark.solvers.dynamics.implicit_midpoint import Midpoint
    from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal

    if isinstance(integrator, Midpoint | Trapezoidal):
        return cmath.exp(2.0j * math.atan(0.5 * wh))
    return None


def _newmark_amplification(beta: float, gamma: float, m: float, f: float, wh: float) -> complex:
    """Return the principal eigenvalue of Newmark's formulas with weights m and f; unknowns (x, h v, h^2 a)."""
    left = np.array([[1.0, 0.0, -beta], [0.0, 1.0, -gamma], [(1.0 - f) * wh**2, 0.0, 1.0 - m]])
    right = np.array([[1.0, 1.0, 0.5 - beta], [0.0, 1.0, 1.0 - gamma], [-f * wh**2, 0.0, -m]])
    values = np.linalg.eigvals(np.linalg.solve(left, right))
    turning = values[values.imag > 0.0]
    return (
        complex(min(turning, key=lambda z: abs(z - cmath.exp(1j * wh))))
        if len(turning)
        else complex(max(values, key=abs))
    )


# ------------------------------------------------------------------ bodies


def lowest_excited_frequency(forces: DynamicForces, problem: Dynamics, points: Floats) -> float | None:
    """Return the angular frequency, rad/s, of the lowest mode that loads, supports or the initial velocity excite."""
    free = forces.free
    K, M = forces.tangent(problem.rest, forces.factors(0.0)), forces.M_free
    push = _excitation_forces(forces, problem, points)
    if not (len(free) and np.all(np.isfinite(K.data)) and np.all(np.isfinite(push)) and np.any(push)):
        return None
    shifted = shifted_solver(forces, K, M)
    if shifted is None:
        return None
    solve, top = shifted
    return _frequency_by_inverse_iteration(K, M, solve, push, free_rigid_motions(forces, points, M), RIGID * top)


def shifted_solver(
    forces: DynamicForces, K: sparse.csr_matrix, M: sparse.csr_matrix
) -> tuple[Callable[[Floats], Floats], float] | None:
    """Return a function that solves systems with K + SHIFT top M, and the number `top`, (rad/s)^2.

    `top` is the largest ratio of diagonal entries of K and M. Returns None if the matrix is singular.
    """
    top = float(np.max(K.diagonal() / np.maximum(M.diagonal(), 1e-300)))
    try:
        return factor((K + SHIFT * top * M).tocsr(), symmetric=forces.conservative).solve, top
    except (Singular, ValueError):
        return None


def free_rigid_motions(forces: DynamicForces, points: Floats, M: sparse.csr_matrix) -> Floats | None:
    """Return the rigid motions (free, 6) of a free body.

    Returns None for a body with supports or on a foundation, and in reduced coordinates.
    """
    loose = (
        not len(forces.fixed)
        and points.size == forces.dofs
        and not any(e.resists_rigid_motion for e in forces.internal)
    )
    return rigid_motions(points, forces.free, M) if loose else None


def _excitation_forces(forces: DynamicForces, problem: Dynamics, points: Floats) -> Floats:
    """Return the forces (free,), N, that excite vibrations; loads, supports and velocity have equal weight."""
    pushes = [forces.inertia(problem.velocity)]
    for load in forces.loads:
        f = np.zeros(forces.dofs)
        load.add_gradient(problem.rest, f)
        pushes.append(-f)
    if np.any(begun := problem.direction):
        moved = problem.rest.astype(np.float64)
        size = float(np.abs(begun).max())
        eps = 1e-6 * float(np.ptp(points)) / size
        moved[forces.fixed] += eps * begun
        pushes.append(-(forces.within(moved) - forces.within(problem.rest)))
    total = np.zeros(len(forces.free))
    for number, f in enumerate(pushes):
        size = float(np.linalg.norm(f[forces.free]))
        if size > 0.0:  # unequal weights: equal and opposite causes still count
            total += (1.0 + 0.1 * number) / size * f[forces.free]
    return total


def rigid_motions(points: Floats, free: np.ndarray, M: sparse.csr_matrix) -> Floats:
    """Return the rigid motions (free, 6) of nodes at `points` (n, 3), m, orthonormal in the mass matrix M."""
    centre = points - points.mean(axis=0)
    shifts = np.tile(np.eye(3), (len(points), 1))
    turns = np.stack([np.cross(axis, centre).ravel() for axis in np.eye(3)], axis=1)
    R = np.concatenate([shifts, turns / max(float(np.abs(centre).max()), 1e-300)], axis=1)[free]
    values, vectors = np.linalg.eigh(R.T @ (M @ R))
    good = values > 1e-12 * values.max()
    basis: Floats = R @ (vectors[:, good] / np.sqrt(values[good]))
    return basis


def _frequency_by_inverse_iteration(
    K: sparse.csr_matrix,
    M: sparse.csr_matrix,
    solve: Callable[[Floats], Floats],
    push: Floats,
    rigid: Floats | None,
    least: float,
) -> float | None:
    """Return the angular frequency, rad/s, by inverse iteration from the static deflection under `push` (free,), N.

    Rigid motions are removed. Returns None if no deflection remains.
    """

    def strained(u: Floats) -> Floats:
        """Return displacements u (free,) without their rigid motion."""
        return u if rigid is None else u - rigid @ (rigid.T @ (M @ u))

    b = push if rigid is None else push - M @ (rigid @ (rigid.T @ push))
    if np.linalg.norm(b) <= 1e-9 * np.linalg.norm(push):
        return None
    square = 0.0
    for _ in range(ITERATIONS):
        u = strained(solve(b))
        mass = float(u @ (M @ u))
        if not (mass > 0.0 and math.isfinite(mass)):
            return None
        u /= math.sqrt(mass)
        square, b = float(u @ (K @ u)), M @ u
    return math.sqrt(square) if square > least else None
