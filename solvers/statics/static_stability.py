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
from softmark.solvers.linear.linear_solver import LinearSystems
from softmark.solvers.statics.arc_length import PathFollower, PathLost
from softmark.solvers.statics.static_newton import Newton
from softmark.solvers.statics.static_problem import Iteration, NotConverged, Statics

PHASE = "critical load"
STEPS = 20  # full steps to a state of the path from rest
LOOKS = 25  # largest number of states of the path from rest
CLOSE = 1e-3  # relative width of the bracket around a critical load
BESIDE = 2e-4  # relative distance of its two ends from the estimate
SHIFT = 1e-12  # of the stiffness: diagonal shift with which a singular matrix can be factorised
LOOSE = 1e-13  # of the stiffness: less is zero to rounding (slender parts have 1e-10)


@dataclass(frozen=True)
class _PathState:
    """State of the path from rest at a load factor; `found` is False if it is only assumed to be an equilibrium."""

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
    """Return a Newton solver in double precision with direct factorisations, even if the problem selects others."""
    method: Any = "auto" if problem.linear.method == "conjugate_gradients" else problem.linear.method
    choice = replace(problem.linear, method=method, precision="double", reuse=False, cap=None)
    assembly, rest = problem.exact or problem.assembly, np.asarray(problem.rest, dtype=np.float64)
    exact = replace(problem, assembly=assembly, exact=None, rest=rest, linear=choice)
    return Newton(exact, history, LinearSystems(choice), phase)


def critical_load(problem: Statics, history: list[Iteration], left: Floats) -> float | None:
    """Return the load factor below full load at which the tangent on the path from rest is first singular.

    The path is followed under fixed loads. Between a stable and an unstable state the tangent is assumed to be linear
    in the load; its least critical load is the next guess (Lanczos iteration). The number of negative eigenvalues at
    both ends shows that the bracket contains the critical load; it shrinks to the relative width CLOSE. `left` is an
    unstable equilibrium at full load, which need not lie on the path.

    Returns None if no state of the path is unstable, if the linear solver gives no eigenvalue count, and with contact,
    where tangents change abruptly.
    """
    if problem.may_contact:
        return None
    newton = direct_newton(problem, history, PHASE)
    try:
        low, high = _state_at_rest(newton), _factorise_state(newton, 1.0, left, False)
    except (Singular, NotConverged):
        return None
    if low.factor.negative_pivots != 0 or not high.factor.negative_pivots:
        return None
    for number in range(LOOKS):
        guess = _extrapolate_critical_load(newton, low, high)
        if high.found and high.load - low.load <= CLOSE * high.load:
            return guess
        beside = guess * (1.0 + (BESIDE if number % 2 else -BESIDE))
        inside = low.load + np.array([1e-4, 1.0 - 1e-4]) * (high.load - low.load)
        load = float(np.clip(beside, *inside)) if high.found else min(1.0, guess * (1.0 + BESIDE))
        state = _follow_to_load(newton, low, load)
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
    """Return a state x at a load factor with its tangent and factorisation."""
    x = np.asarray(x, dtype=np.float64)
    K = newton.assembly.tangent(x, load)
    newton.systems.solves += 1
    return _PathState(load, x, K, newton.systems.direct(K), found)


def _follow_to_load(newton: Newton, low: _PathState, load: float) -> _PathState | None:
    """Return the state of the path at a load factor, or as near as full Newton steps lead; None if they fail."""
    for _ in range(6):
        with suppress(NotConverged, Singular):
            newton._promised = None
            x = newton.impose_support_motion(low.x, load - low.load, load)
            x, done, _ = newton.full_steps(x, STEPS, load)
            if done:
                return _factorise_state(newton, load, x, True)
        load = 0.5 * (low.load + load)
    return None


def _extrapolate_critical_load(newton: Newton, low: _PathState, high: _PathState) -> float:
    """Return the load factor at which the tangent, linear between two states, is first singular.

    It follows from the least t > 0 with K_low v = t (K_low - K_high) v.
    """
    middle = 0.5 * (low.load + high.load)
    part = None if newton.assembly.saddle else least_singular_fraction(low.K, low.factor, high.K)
    return middle if part is None else low.load + part * (high.load - low.load)


def least_singular_fraction(K: sparse.csr_matrix, factor: Factor, other: sparse.csr_matrix) -> float | None:
    """Return the least fraction t in (0, 1) for which K + t (other - K) is singular; None if there is none.

    K is positive definite, with the factorisation `factor`.
    """
    n = K.shape[0]
    fall = (K - other).tocsr()
    if n <= 30:
        from scipy.linalg import eigh

        largest = float(eigh(fall.toarray(), K.toarray(), eigvals_only=True)[-1])
    else:
        # imported here: 0.14 s, not needed for stable bodies
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


# ------------------------------------------------------------------ stiffness against the load


def current_stiffness(problem: Statics, history: list[Iteration], x: Floats, load: float) -> tuple[float, int] | None:
    """Return the stiffness against the load relative to that at rest, and the number of negative eigenvalues.

    This is the current stiffness parameter of Bergan, Horrigmoe, Krakeland and Soreide (1978), which is zero at a
    maximum of the load. Returns None if it is unknown.
    """
    newton = direct_newton(problem, history, PHASE)
    try:
        work = [_compliance_with_negatives(newton, y, part) for y, part in ((problem.rest, 0.0), (x, load))]
    except (Singular, NotConverged, PathLost):
        return None
    (rest, _), (now, negative) = work
    if negative is None or rest == 0.0 or now == 0.0:
        return None
    return rest / now, negative


def _compliance_with_negatives(newton: Newton, x: Floats, load: float) -> tuple[float, int | None]:
    """Return the work of an additional load per squared load factor, J, and the number of negative eigenvalues."""
    follower = PathFollower(newton)
    here = np.asarray(x, dtype=np.float64)
    factor = follower._factorise_tangent(here, load)
    rate = follower._state_rate(here, load, factor)
    K = newton.assembly.tangent(here, load)
    inner = rate[newton.assembly.free]
    return float(inner @ (K @ inner)), follower._count_negative_eigenvalues(factor)


# ------------------------------------------------------------------ rounding error


def rounding_error(newton: Newton, x: Floats, factor: Factor) -> float:
    """Return the relative rounding error of a state x: its change if all its numbers change in the last digit.

    It is the largest of three values of |K^-1 (g(x (1 + eps r)) - g(x))| with random r = +-1, as in stochastic
    arithmetic (Vignes 1974), and of the next Newton step |K^-1 g(x)|, which is large if rounding has spoilt the
    factorisation. Both are relative to the motion from rest. It is infinite if it is not finite. Raises Unsolved.
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


# ------------------------------------------------------------------ motions without stiffness


def loose_motion(problem: Statics) -> Floats | None:
    """Return a motion (dofs,), of largest component 1, without stiffness at rest; None if there is none.

    It is found by inverse iteration with K + s I for a small s: each step reduces motions with stiffness by 1e-9.
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
