"""Time-step error of a motion, estimated from the vibration modes that its loads excite.

Small motions about rest are a sum of modes. Load-dependent Ritz vectors (Wilson, Yuan and Dickens 1982) approximate the
modes that loads, moving supports and the initial velocity excite, and how much they excite each. For every mode the
recurrence of the integrator is compared with the exact solution under the same amplitudes. The difference is the
time-step error of the mode, and the mode shapes give the error at any point. For large motions and contact this is an
estimate; for linear problems it lacks only modes that loads hardly excite.

Source: recurrences from Hughes (1987), section 9.1; Chung and Hulbert (1993); Hairer, Norsett and Wanner (1993),
section III.1.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg as dense

from softmark.records import dataclass
from softmark.solvers.dynamics.bdf2 import BDF2
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_forces import DynamicForces
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.generalized_alpha import GeneralizedAlpha
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.implicit_midpoint import Midpoint
from softmark.solvers.dynamics.load_amplitudes import Amplitude, Constant, linear_step_load
from softmark.solvers.dynamics.newmark import Newmark
from softmark.solvers.dynamics.time_step_resolution import RIGID, free_rigid_motions, shifted_solver
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.solvers.dynamics.integrator import Integrator

MODES = 40  # Ritz vectors, of all loads together
PARTS = 4  # parts of a step in which the exact solution takes an amplitude as linear
SAME = 1e-8  # relative length left of a vector that depends linearly on the previous ones
LONGEST = 200_000  # largest number of steps
LARGEST = 300_000  # largest number of unknowns for factorising the stiffness


@dataclass(frozen=True)
class StepError:
    """Time-step error as a sum of modes: u_h(t) - u(t) = shapes @ error(t).

    `shapes` (dofs, k), kg^-1/2, are zero at supports. `error` and `motion` (t, k), m kg^1/2, are the error and the
    exact motion of each mode at `times` (t,), s. `frequencies` (k,), rad/s, are ascending.
    """

    times: Floats
    shapes: Floats
    frequencies: Floats
    motion: Floats
    error: Floats

    @property
    def energy_norm_error(self) -> float:
        """Largest error over time in the strain energy norm, relative to the largest motion in this norm."""
        own = np.linalg.norm(self.motion * self.frequencies, axis=1).max(initial=0.0)
        off = np.linalg.norm(self.error * self.frequencies, axis=1).max(initial=0.0)
        return float(off / own) if own > 0.0 else 0.0


def estimate_step_error(problem: Dynamics, points: Floats, duration: float, step: float) -> StepError | None:
    """Return the time-step error for steps of `step`, s, over `duration`, s.

    `points` (n, 3), m, are the node positions. Returns None if nothing vibrates or the error cannot be estimated.
    """
    forces = DynamicForces(problem)
    steps = math.ceil(duration / step - 1e-9)
    if forces.impact is not None or steps > LONGEST or len(forces.free) > LARGEST:
        return None
    found = _excited_modes(forces, problem, points)
    if found is None:
        return None
    w, shapes, pushes, amplitudes, speed = found
    recurrence = _select_integration(problem.integrator)
    if recurrence is None:
        return None
    times = np.minimum(step * np.arange(steps + 1), duration)
    drag = problem.damping.alpha + problem.damping.beta * w**2
    with np.errstate(over="ignore", invalid="ignore"):
        exact = _exact_modal_motion(w, drag, pushes, amplitudes, speed, times)
        own = recurrence(_ModalEquations(w, problem.damping.alpha, drag, pushes, amplitudes), speed, times)
    if not (np.all(np.isfinite(exact)) and np.all(np.isfinite(own))):
        return None
    whole = np.zeros((forces.dofs, len(w)))
    whole[forces.free] = shapes
    return StepError(times, whole, w, exact, own - exact)


# ------------------------------------------------------------------ modes


def _excited_modes(
    forces: DynamicForces, problem: Dynamics, points: Floats
) -> tuple[Floats, Floats, Floats, list[Amplitude], Floats] | None:
    """Return frequencies (k,), shapes (free, k), modal loads (k, l), amplitudes, initial modal velocities (k,)."""
    free = forces.free
    patterns, amplitudes = _excitation_forces(forces, problem, points)
    K, M = forces.tangent(problem.rest, forces.factors(0.0)), forces.M_free
    speed = problem.velocity[free]
    starts = [f for f in (*patterns, M @ speed) if np.any(f)]
    if not (len(free) and starts and np.all(np.isfinite(K.data)) and np.all(np.isfinite(np.array(starts)))):
        return None
    shifted = shifted_solver(forces, K, M)
    if shifted is None:
        return None
    solve, top = shifted
    V = _ritz_vectors(M, solve, starts, free_rigid_motions(forces, points, M))
    if V is None:
        return None
    stiff = V.T @ (K @ V)
    squares, mixing = np.linalg.eigh(0.5 * (stiff + stiff.T))
    good = squares > RIGID * top
    if not np.any(good):
        return None
    shapes = V @ mixing[:, good]
    pushes = np.column_stack([shapes.T @ f for f in patterns]) if patterns else np.zeros((shapes.shape[1], 0))
    return np.sqrt(squares[good]), shapes, pushes, amplitudes, shapes.T @ (M @ speed)


def _excitation_forces(
    forces: DynamicForces, problem: Dynamics, points: Floats
) -> tuple[list[Floats], list[Amplitude]]:
    """Return the forces (free,), N, of every load at full size, and of moving supports, with their amplitudes."""
    patterns: list[Floats] = []
    amplitudes: list[Amplitude] = []
    for load, amplitude in zip(forces.loads, forces.amplitudes, strict=True):
        f = np.zeros(forces.dofs)
        load.add_gradient(problem.rest, f)
        patterns.append(-f[forces.free])
        amplitudes.append(amplitude)
    if np.any(begun := problem.direction):
        moved = problem.rest.astype(np.float64)
        eps = 1e-6 * float(np.ptp(points)) / float(np.abs(begun).max())
        moved[forces.fixed] += eps * begun
        f = (forces.within(moved) - forces.within(problem.rest)) / eps
        patterns.append(-f[forces.free])
        amplitudes.append(problem.support_amplitude)
    return patterns, amplitudes


def _ritz_vectors(
    M: Floats, solve: Callable[[Floats], Floats], starts: list[Floats], rigid: Floats | None
) -> Floats | None:
    """Return load-dependent Ritz vectors (free, k), orthonormal in the mass M, generated by forces `starts`, N."""
    basis: list[Floats] = [] if rigid is None else list(rigid.T)
    first = len(basis)
    block = starts
    while block and len(basis) - first < min(MODES, M.shape[0]):
        fresh = []
        for b in block:
            u = solve(b)
            size = math.sqrt(max(float(u @ (M @ u)), 0.0))
            if not (size > 0.0 and math.isfinite(size)):
                continue
            u = u / size
            for _ in range(2):
                for v in basis:
                    u = u - v * float(v @ (M @ u))
            left = math.sqrt(max(float(u @ (M @ u)), 0.0))
            if left < SAME:
                continue
            basis.append(u / left)
            fresh.append(M @ basis[-1])
        block = fresh
    return np.column_stack(basis[first:]) if len(basis) > first else None


# ------------------------------------------------------------------ exact solution and recurrences


@dataclass(frozen=True)
class _ModalEquations:
    """Modal equations q'' + drag q' + w^2 q = pushes @ amplitudes(t) of k modes under l loads."""

    w: Floats  # (k,) rad/s
    alpha: float  # mass-proportional part of the damping, 1/s
    drag: Floats  # (k,) 1/s
    pushes: Floats  # (k, l)
    amplitudes: list[Amplitude]

    def loads(self, begin: float, end: float, weight: float = 0.5, ahead: float = 0.0) -> list[Floats]:
        """Return five modal loads (k,) of a step: at start and end, mean, and for the first and last acceleration."""
        load = linear_step_load(self.amplitudes, begin, end, weight, ahead)
        return [self.pushes @ f for f in (load.start, load.end, load.mean, load.first, load.last)]

    def initial_accelerations(self, speed: Floats) -> Floats:
        """Return the modal accelerations (k,) at time 0, from rest with the modal velocities `speed` (k,)."""
        found: Floats = self.pushes @ np.array([c.at(0.0) for c in self.amplitudes]) - self.drag * speed
        return found


def _exact_modal_motion(
    w: Floats, drag: Floats, pushes: Floats, amplitudes: list[Amplitude], speed: Floats, times: Floats
) -> Floats:
    """Return the modal displacements (t, k), exact for loads that are linear in each part of a step."""
    modal, z = _ModalEquations(w, 0.0, drag, pushes, amplitudes), np.zeros((len(w), 2))
    z[:, 1] = speed
    steady = all(isinstance(c, Constant) for c in amplitudes)
    parts = 1 if steady else PARTS
    found, known = [z[:, 0].copy()], (0.0, np.zeros(0))
    constant = modal.loads(0.0, 1.0) if steady else None
    for begin, end in itertools.pairwise(times):
        h = float(end - begin) / parts
        if abs(h - known[0]) > 1e-9 * h:
            known = h, _modal_propagators(w, drag, h)
        E = known[1]
        for part in range(parts):
            start, stop, *_ = constant or modal.loads(begin + part * h, begin + (part + 1) * h)
            z = np.einsum("kij,kj->ki", E[:, :2], np.stack([z[:, 0], z[:, 1], start, (stop - start) / h], axis=1))
        found.append(z[:, 0].copy())
    return np.array(found)


def _modal_propagators(w: Floats, drag: Floats, h: float) -> Floats:
    """Return matrices (k, 4, 4) that advance (q, q', load, slope of the load) by a time h, s."""
    A = np.zeros((len(w), 4, 4))
    A[:, 0, 1] = A[:, 1, 2] = A[:, 2, 3] = 1.0
    A[:, 1, 0], A[:, 1, 1] = -(w**2), -drag
    scale = np.diag([1.0, h, h**2, h**3])  # scales entries to similar size
    S, back = scale, np.diag(1.0 / np.diag(scale))
    E: Floats = back @ dense.expm(S @ (h * A) @ back) @ S
    return E


Recurrence = Callable[[_ModalEquations, Floats, Floats], Floats]


def _select_integration(integrator: Integrator) -> Recurrence | None:
    """Return the function that integrates modal equations like an integrator; None for an unknown one."""
    match integrator:
        case ImplicitEuler():
            return _integrate_euler
        case BDF2():
            return _integrate_bdf2
        case CentralDifferences():
            return _integrate_central_differences
        case GeneralizedAlpha(spectral_radius=r):
            m, f = (2.0 * r - 1.0) / (r + 1.0), r / (r + 1.0)
            return lambda *a: _integrate_newmark(
                *a, beta=0.25 * (1.0 - m + f) ** 2, gamma=0.5 - m + f, m=m, f=f, weight=0.5
            )
        case Trapezoidal() | Midpoint():
            return _integrate_trapezoidal
        case Newmark(beta=b, gamma=c):
            return (
                _integrate_trapezoidal
                if (b, c) == (0.25, 0.5)
                else lambda *a: _integrate_newmark(*a, beta=b, gamma=c, weight=c)
            )
    return None


def _advance_trapezoidal(modal: _ModalEquations, x: Floats, v: Floats, F: Floats, h: float) -> tuple[Floats, Floats]:
    """Return modal displacements and velocities (k,) after a trapezoidal step under the mean load F (k,)."""
    w, c = modal.w, modal.drag
    rest = (1.0 / h - 0.5 * c) * v - w**2 * x - 0.25 * h * w**2 * v + F
    end = rest / (1.0 / h + 0.5 * c + 0.25 * h * w**2)
    return x + 0.5 * h * (v + end), end


def _integrate_trapezoidal(modal: _ModalEquations, speed: Floats, times: Floats) -> Floats:
    """Return the modal displacements (t, k) by the trapezoidal rule."""
    x, v = np.zeros_like(speed), speed
    found = [x]
    for begin, end in itertools.pairwise(times):
        x, v = _advance_trapezoidal(modal, x, v, modal.loads(begin, end)[2], float(end - begin))
        found.append(x)
    return np.array(found)


def _integrate_euler(modal: _ModalEquations, speed: Floats, times: Floats) -> Floats:
    """Return the modal displacements (t, k) by the implicit Euler method."""
    x, v = np.zeros_like(speed), speed
    found = [x]
    for begin, end in itertools.pairwise(times):
        h = float(end - begin)
        v = (v / h + modal.loads(begin, end)[2] - modal.w**2 * x) / (1.0 / h + modal.drag + h * modal.w**2)
        x = x + h * v
        found.append(x)
    return np.array(found)


def _integrate_bdf2(modal: _ModalEquations, speed: Floats, times: Floats) -> Floats:
    """Return the modal displacements (t, k) by the second backward difference formula."""
    x, v, last, length = np.zeros_like(speed), speed, np.zeros_like(speed), 0.0
    before: tuple[Floats, Floats] | None = None
    found = [x]
    for begin, end in itertools.pairwise(times):
        h, mean = float(end - begin), modal.loads(begin, end)[2]
        if before is None:
            after = _advance_trapezoidal(modal, x, v, mean, h)
        else:
            r = h / length
            c0, c2 = (1.0 + 2.0 * r) / (1.0 + r) / h, r**2 / (1.0 + r) / h
            F = mean + r / (1.0 + r) * (mean - last)
            old = -(c0 + c2) * x + c2 * before[0], -(c0 + c2) * v + c2 * before[1]  # x1 = (v1 - old) / c0
            v1 = (F - old[1] + modal.w**2 * old[0] / c0) / (c0 + modal.drag + modal.w**2 / c0)
            after = (v1 - old[0]) / c0, v1
        before, last, length = (x, v), mean, h
        x, v = after
        found.append(x)
    return np.array(found)


def _integrate_newmark(
    modal: _ModalEquations, speed: Floats, times: Floats, *, beta: float, gamma: float, weight: float, m: float = 0.0,
    f: float = 0.0,
) -> Floats:  # fmt: skip
    """Return the modal displacements (t, k) by Newmark's formulas with alpha_m = m and alpha_f = f."""
    w, c = modal.w, modal.drag
    x, v, a = np.zeros_like(speed), speed, modal.initial_accelerations(speed)
    factors: Floats | None = None
    found = [x]
    for begin, end in itertools.pairwise(times):
        h = float(end - begin)
        start, stop, _, first, last = modal.loads(begin, end, weight, m - f)
        a = a + (
            first - (modal.pushes @ np.array([k.at(0.0) for k in modal.amplitudes]) if factors is None else factors)
        )
        factors = last
        coast = x + h * v + h**2 * (0.5 - beta) * a
        soon = v + h * (1.0 - gamma) * a
        right = (1.0 - f) * (stop - c * soon - w**2 * coast) + f * (start - c * v - w**2 * x) - m * a
        a = right / (1.0 - m + (1.0 - f) * (gamma * h * c + beta * h**2 * w**2))
        x, v = coast + beta * h**2 * a, soon + gamma * h * a
        found.append(x)
    return np.array(found)


def _integrate_central_differences(modal: _ModalEquations, speed: Floats, times: Floats) -> Floats:
    """Return the modal displacements (t, k) by central differences."""
    w, alpha = modal.w, modal.alpha
    x, v, a = np.zeros_like(speed), speed, modal.initial_accelerations(speed)
    factors: Floats | None = None
    found = [x]
    for begin, end in itertools.pairwise(times):
        h = float(end - begin)
        *_, first, last = modal.loads(begin, end)
        a = a + (
            first - (modal.pushes @ np.array([k.at(0.0) for k in modal.amplitudes]) if factors is None else factors)
        )
        factors = last
        half = v + 0.5 * h * a
        x = x + h * half
        a = last - w**2 * x - (modal.drag - alpha) * half
        v = (half + 0.5 * h * a) / (1.0 + 0.5 * alpha * h)
        a = a - alpha * v
        found.append(x)
    return np.array(found)
