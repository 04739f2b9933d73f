"""Static stability from the tangent: buckling load, current stiffness parameter, rounding error, and free motions."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Factor, Singular
from softmark.solvers.linear.linear_solver import Systems
from softmark.solvers.statics.arc_length import PathFollower, PathLost
from softmark.solvers.statics.static_newton import Newton
from softmark.solvers.statics.static_problem import Iteration, NotConverged, Statics

PHASE = "critical load"
STEPS = 20  # whole steps to a state of the primary path
LOOKS = 25  # states of the primary path that are looked at
CLOSE = 1e-3  # relative width of the bracket around a critical load
BESIDE = 2e-4  # relative distance of its two ends from the estimate
SHIFT = 1e-12  # of the stiffness: makes a singular matrix one that can be factorised
LOOSE = 1e-13  # of the stiffness: below it a motion is not resisted, to rounding; slender parts resist 1e-10 of it


@dataclass(frozen=True)
class _PathState:
    """Equilibrium of the primary path, or a state assumed to be its end (`found` False)."""

    load: float
    x: Floats
    K: sparse.csr_matrix
    factor: Factor
    found: bool = True

    @property
    def stable(self) -> bool:
        """True if no eigenvalue of the tangent is negative."""
        return not self.factor.negative_pivots


def direct_newton(problem: Statics, history: list[Iteration], phase: str) -> Newton:
    """Return a Newton solver in double precision with direct factors, whatever the problem selects."""
    method: Any = "auto" if problem.linear.method == "conjugate_gradients" else problem.linear.method
    choice = replace(problem.linear, method=method, precision="double", reuse=False, cap=None)
    assembly, rest = problem.exact or problem.assembly, np.asarray(problem.rest, dtype=np.float64)
    exact = replace(problem, assembly=assembly, exact=None, rest=rest, linear=choice)
    return Newton(exact, history, Systems(choice), phase)


def critical_load(problem: Statics, history: list[Iteration], left: Floats) -> float | None:
    """Return the load factor below full load at which the tangent on the path from rest is first singular.

    The path is followed under fixed loads. Between a stable and an unstable state the tangent is assumed linear in the
    load; its least critical load is the next guess (Lanczos). The bracket shrinks to CLOSE around it, with the inertia
    of both ends. `left` is an unstable equilibrium at full load, which need not lie on that path. None if no state of
    the path is unstable, or the linear solver cannot tell; and with contact, where tangents change abruptly.
    """
    if problem.touches:
        return None
    newton = direct_newton(problem, history, PHASE)
    try:
        low, high = _state_at_rest(newton), _factorise_state(newton, 1.0, left, False)
    except (Singular, NotConverged):
        return None
    if low.factor.negative_pivots != 0 or not high.factor.negative_pivots:
        return None
    for number in range(LOOKS):
        guess = _critical_guess(newton, low, high)
        if high.found and high.load - low.load <= CLOSE * high.load:
            return guess
        beside = guess * (1.0 + (BESIDE if number % 2 else -BESIDE))
        inside = low.load + np.array([1e-4, 1.0 - 1e-4]) * (high.load - low.load)
        load = float(np.clip(beside, *inside)) if high.found else min(1.0, guess * (1.0 + BESIDE))
        state = _reach_load(newton, low, load)
        if state is None:
            return None
        if state.stable:
            low = state
        else:
            high = state
        if not high.found and low.load >= 1.0:
            return None
    return None


def _state_at_rest(newton: Newton) -> _PathState:
    """Return the state of the path at rest."""
    return _factorise_state(newton, 0.0, newton.problem.rest, True)


def _factorise_state(newton: Newton, load: float, x: Floats, found: bool) -> _PathState:
    """Return a state at a load with its tangent and factor."""
    x = np.asarray(x, dtype=np.float64)
    K = newton.assembly.tangent(x, load)
    newton.systems.solves += 1
    return _PathState(load, x, K, newton.systems.direct(K), found)


def _reach_load(newton: Newton, low: _PathState, load: float) -> _PathState | None:
    """Return the state of the path at a load, or as close as full Newton steps lead; None if they fail."""
    for _ in range(6):
        with suppress(NotConverged, Singular):
            newton._promised = None
            x = newton.impose(low.x, load - low.load, load)
            x, done, _ = newton.steps(x, STEPS, load)
            if done:
                return _factorise_state(newton, load, x, True)
        load = 0.5 * (low.load + load)
    return None


def _critical_guess(newton: Newton, low: _PathState, high: _PathState) -> float:
    """Return where K, linear between two states, is first singular: K_low v = t (K_low - K_high) v, least t > 0."""
    middle = 0.5 * (low.load + high.load)
    part = None if newton.assembly.saddle else least_part(low.K, low.factor, high.K)
    return middle if part is None else low.load + part * (high.load - low.load)


def least_part(K: sparse.csr_matrix, factor: Factor, other: sparse.csr_matrix) -> float | None:
    """Return the least t in (0, 1) for which K + t (other - K) is singular, K definite; None if none is found."""
    n = K.shape[0]
    fall = (K - other).tocsr()
    if n <= 30:
        from scipy.linalg import eigh

        largest = float(eigh(fall.toarray(), K.toarray(), eigvals_only=True)[-1])
    else:
        # 0.14 s that a stable body need not wait for
        from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

        solve = LinearOperator((n, n), matvec=factor.solve, dtype=np.float64)
        start = np.random.default_rng(0).standard_normal(n)
        try:
            largest = float(
                eigsh(fall, k=1, M=K, Minv=solve, which="LA", v0=start, tol=1e-6, return_eigenvectors=False)[0]
            )
        except (ArpackError, Singular):
            return None
    return 1.0 / largest if largest > 1.0 else None


# ------------------------------------------------------------------ where loads cannot be raised


def current_stiffness(problem: Statics, history: list[Iteration], x: Floats, load: float) -> tuple[float, int] | None:
    """Return the stiffness against the load relative to that at rest, and the number of negative eigenvalues.

    This is the current stiffness parameter of Bergan, Horrigmoe, Krakeland and Soreide (1978): zero at a maximum of the
    load. None if it is unknown.
    """
    newton = direct_newton(problem, history, PHASE)
    try:
        work = [_compliance(newton, y, part) for y, part in ((problem.rest, 0.0), (x, load))]
    except (Singular, NotConverged, PathLost):
        return None
    (rest, _), (now, negative) = work
    if negative is None or rest == 0.0 or now == 0.0:
        return None
    return rest / now, negative


def _compliance(newton: Newton, x: Floats, load: float) -> tuple[float, int | None]:
    """Return the work of additional load per load squared, J, and the number of negative eigenvalues."""
    follower = PathFollower(newton)
    here = np.asarray(x, dtype=np.float64)
    factor = follower._factor(here, load)
    rate = follower._rate(here, load, factor)
    K = newton.assembly.tangent(here, load)
    inner = rate[newton.assembly.free]
    return float(inner @ (K @ inner)), follower._negative(factor)


# ------------------------------------------------------------------ what rounding leaves


def rounding_error(newton: Newton, x: Floats, factor: Factor) -> float:
    """Return the relative rounding error of a state: its change when all its numbers change by one digit.

    |K^-1 (g(x (1 + eps r)) - g(x))| over the motion from rest, r = +-1 at random, the largest of three, as in
    stochastic arithmetic (Vignes 1974); or the next Newton step |K^-1 g(x)|, which is large for a factor spoilt by
    rounding. Infinite if it is not finite; raises Unsolved.
    """
    problem, free = newton.problem, newton.assembly.free
    x = np.asarray(x, dtype=np.float64)
    weights = np.broadcast_to(problem.weights, (problem.space.dofs,))[free]
    random, eps = np.random.default_rng(0), float(np.finfo(np.float64).eps)
    g = newton.assembly.gradient(x, 1.0)[free]
    worst = float(np.linalg.norm(factor.solve(g) / weights))
    for _ in range(3):
        shaken = x * (1.0 + eps * random.choice([-1.0, 1.0], len(x)))
        d = factor.solve(newton.assembly.gradient(shaken, 1.0)[free] - g)
        worst = max(worst, float(np.linalg.norm(d / weights)))
    size = max(newton.moved, float(np.linalg.norm(problem.target)))
    return worst / size if size > 0.0 and np.isfinite(worst) else float("inf")


# ------------------------------------------------------------------ what nothing resists


def loose_motion(problem: Statics) -> Floats | None:
    """Return a motion (dofs,) of largest component 1 without stiffness at rest; None if there is none.

    Inverse iteration with K + s I, s small: each step reduces motions with stiffness by 1e-9.
    """
    newton = direct_newton(problem, [], PHASE)
    if newton.assembly.saddle:
        return None
    K = newton.assembly.tangent(newton.problem.rest, 0.0)
    if not np.all(np.isfinite(K.data)) or not K.shape[0]:
        return None
    stiff = float(np.abs(K.diagonal()).max())
    v = np.random.default_rng(0).standard_normal(K.shape[0])
    try:
        factor = newton.systems.direct((K + SHIFT * stiff * sparse.eye(K.shape[0])).tocsr())
        for _ in range(4):
            v = factor.solve(v)
            v /= np.linalg.norm(v)
    except Singular:
        return None
    if not abs(float(v @ (K @ v))) <= LOOSE * stiff:
        return None
    d = np.zeros(problem.space.dofs)
    d[newton.assembly.free] = v / np.abs(v).max()
    return d
