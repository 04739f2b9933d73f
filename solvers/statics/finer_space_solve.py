"""Equilibrium on a finer finite element space over the same mesh, by Newton's method from the coarse equilibrium.

The linear systems of the finer space are solved by conjugate gradients with two levels: smooth errors are reduced by
the factorised coarse tangent in the same state, and rough errors by the diagonal. The angle between a space and its
complement in a finer space does not depend on the mesh size, and so neither does the number of iterations (Bank 1996).
The error of the result is only a fraction of the distance between coarse and fine equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import linalg as dense
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import Factor, factor
from softmark.solvers.runtime.thread_limits import ALONE
from softmark.solvers.runtime.work_count import count_product
from softmark.solvers.sparse.conjugate_gradients import dot

SMALL = 20_000  # largest number of unknowns for a direct factorisation
LARGER = 40_000  # the same if conjugate gradients fail
CLOSE = 2e-2  # relative residual of the systems, and their error in the energy norm
NEAR = 0.1  # the same for modes, whose error enters the frequency squared
SETTLED = 0.03  # of the first step: Newton's method ends at a step this short
NEARBY = 1e-3  # the same for modified Newton steps, which are cheap
ROUNDED = 1e-12  # of the displacements: a step this short is rounding
CRAWL = 3.0  # times the tolerance: largest sum of the last DELAY steps relative to x after convergence
STEPS = 10  # largest number of Newton steps
AWAY = 5.0  # times the first step: a longer step leads away
DELAY = 10  # iterations over which energy and displacements must hardly change
MOST = 400  # iterations of conjugate gradients in a step
ALIKE = 1e-10  # of the largest eigenvalue: smaller ones are dependent vectors


LOST = "conjugate gradients do not converge on the finer space"
Solve = Callable[[Floats], Floats]


class StateLost(Exception):
    """Raised if the finer space has no equilibrium near the coarse state, or it was not found."""


@dataclass(frozen=True)
class CoarseLevel:
    """Coarse level of the preconditioner: factorised tangent and prolongation to the fine level.

    The prolongation P maps the free unknowns of the coarse level to those of the fine level.
    """

    factor: Factor
    P: sparse.csr_matrix  # (fine free, coarse free)

    @classmethod
    def of(cls, P: sparse.csr_matrix, coarse: Assembly, fine: Assembly, factor: Factor) -> CoarseLevel:
        """Return the coarse level for a prolongation P of nodal values, shape (fine nodes, coarse nodes)."""
        three = sparse.kron(P, sparse.identity(3), format="csr")
        return cls(factor, three[fine.free][:, coarse.free].tocsr())


def solve_on_finer_space(
    assembly: Assembly, x: Floats, below: Callable[[], CoarseLevel], watch: Callable[[], None] = lambda: None
) -> Floats:
    """Return the equilibrium (dofs,) of the finer space near the coarse state x (dofs,).

    `below` returns the coarse level, and `watch` is called in every iteration. The last step is at most SETTLED times
    the first. Raises StateLost, Singular, and the errors of `watch`.
    """
    first = 0.0
    with np.errstate(all="ignore"), ALONE:
        for number in range(STEPS):
            watch()
            d = np.zeros_like(x)
            g = assembly.gradient(x, 1.0)[assembly.free]
            d[assembly.free], solve = _newton_step(assembly, x, g, below, watch)
            size = float(np.linalg.norm(d))
            first = first or size
            if not size <= AWAY * first:
                raise StateLost("Newton's method on the finer space leads away from the state")
            x = _move_within_domain(assembly, x, d)
            rounded = size <= ROUNDED * float(np.linalg.norm(x))
            if rounded or size <= SETTLED * first or (number == 0 and _is_next_step_short(assembly, x, solve, size)):
                return x
    raise StateLost(f"{STEPS} Newton steps on the finer space do not reach equilibrium")


def solve_with_known_tangent(
    assembly: Assembly, x: Floats, known: Factor, watch: Callable[[], None] = lambda: None
) -> Floats:
    """Return the equilibrium (dofs,) near x by modified Newton steps with the factorised tangent of another law.

    `watch` is called before every step. Raises StateLost if a step is longer than half of the last one or leaves the
    domain of the law, and the errors of `watch`.
    """
    first = before = 0.0
    with np.errstate(all="ignore"), ALONE:
        for _ in range(STEPS):
            watch()
            d = np.zeros_like(x)
            d[assembly.free] = -known.solve(assembly.gradient(x, 1.0)[assembly.free])
            size = float(np.linalg.norm(d))
            if before and not size <= 0.5 * before:
                break
            x, first, before = _move_within_domain(assembly, x, d), first or size, size
            if size <= ROUNDED * float(np.linalg.norm(x)) or size <= NEARBY * first:
                return x
    raise StateLost("modified Newton steps with the tangent of the other law do not converge")


def tangent_solver(
    assembly: Assembly, x: Floats, below: Callable[[], CoarseLevel], watch: Callable[[], None] = lambda: None
) -> tuple[sparse.csr_matrix, Solve]:
    """Return the tangent stiffness in a state x, and a function that solves linear systems with it.

    The function raises StateLost. Raises Singular, and the errors of `watch`.
    """
    K = assembly.tangent(x, 1.0)
    watch()
    if uses_direct_solver(assembly):
        return K, factor(K, symmetric=assembly.conservative).solve
    nearly = _two_level_preconditioner(K, below(), watch)

    def solve(b: Floats) -> Floats:
        """Return the solution of K d = b by conjugate gradients. Raises StateLost."""
        if (found := _conjugate_gradients(K, b, nearly, NEAR)) is None:
            raise StateLost(LOST)
        return found

    return K, solve


def lowest_squared_frequencies(K: sparse.csr_matrix, solve: Solve, M: sparse.csr_matrix, modes: Floats) -> Floats:
    """Return squared frequencies w^2 (m,), (rad/s)^2, of K phi = w^2 M phi on the finer space. Raises StateLost.

    `modes` (n, m) are the modes of a coarser space, prolongated to the finer one. Each mode gets one step of inverse
    iteration, which reduces its part in a faster mode j to w^2 / w_j^2. Modes and steps are then combined by the
    Rayleigh-Ritz method (Bathe 2014, section 10.3.2). The error of w^2 is quadratic in the error of the modes.
    """
    with np.errstate(all="ignore"), ALONE:
        stiff, heavy = K @ modes, M @ modes
        values = (modes * stiff).sum(axis=0) / (modes * heavy).sum(axis=0)
        steps = np.stack([solve(b) for b in (heavy * values - stiff).T], axis=1)
        return _rayleigh_ritz(K, M, np.hstack([modes, steps]))[: modes.shape[1]]


def _rayleigh_ritz(K: sparse.csr_matrix, M: sparse.csr_matrix, basis: Floats) -> Floats:
    """Return w^2, in ascending order, of modes in the span of the vectors `basis` (n, k). Raises StateLost."""
    basis = basis / np.maximum(np.sqrt((basis * (M @ basis)).sum(axis=0)), np.finfo(np.float64).tiny)
    if not np.all(np.isfinite(basis)):
        raise StateLost("the modes of the finer space are not finite")
    sizes, axes = np.linalg.eigh(basis.T @ (M @ basis))
    known = sizes > ALIKE * sizes[-1]
    basis = basis @ (axes[:, known] / np.sqrt(sizes[known]))
    found: Floats = dense.eigvalsh(basis.T @ (K @ basis))
    return found


def _is_next_step_short(assembly: Assembly, x: Floats, solve: Solve, size: float) -> bool:
    """Return whether the next Newton step, with the last linear solver, would be short compared with `size`, m.

    The energy is no measure of this, because the finer space first changes the volume of cells, which says little about
    bending.
    """
    next_step = solve(assembly.gradient(x, 1.0)[assembly.free])
    return bool(np.isfinite(next_step).all()) and dot(next_step, next_step) <= (SETTLED * size) ** 2


def _move_within_domain(assembly: Assembly, x: Floats, d: Floats) -> Floats:
    """Return the state x + s d with the largest s of 1, 1/2, 1/4 in the domain of the law. Raises StateLost."""
    length = 1.0
    while length > 0.2:
        y = x + length * d
        if np.isfinite(sum(e.value(y) for e in assembly.internal)):
            return y
        length *= 0.5
    raise StateLost("the state is outside the domain of the material law on the finer space")


def _newton_step(
    assembly: Assembly, x: Floats, g: Floats, below: Callable[[], CoarseLevel], watch: Callable[[], None]
) -> tuple[Floats, Solve]:
    """Return the Newton step of the free unknowns, and the linear solver used for it. Raises StateLost.

    g are the residual forces of the free unknowns. If the tangent is indefinite, a definite approximation replaces it.
    """
    if not np.all(np.isfinite(g)):
        raise StateLost("the forces of the finer space are not finite")
    direct = uses_direct_solver(assembly)
    for definite in (False,) if direct else (False, True):
        K = assembly.tangent(x, 1.0, definite)
        if not np.all(np.isfinite(K.data)):
            raise StateLost("the stiffness of the finer space is not finite")
        watch()
        if direct:
            known = factor(K, symmetric=assembly.conservative)
            return -known.solve(g), known.solve
        nearly = _two_level_preconditioner(K, below(), watch)
        if (d := _conjugate_gradients(K, -g, nearly)) is not None:
            return d, nearly
    if len(g) > LARGER:
        raise StateLost(LOST)
    known = factor(assembly.tangent(x, 1.0))
    return -known.solve(g), known.solve


def uses_direct_solver(assembly: Assembly) -> bool:
    """Return whether the linear systems of an assembly are solved by factorisation instead of iteration."""
    return len(assembly.free) <= SMALL or not assembly.conservative or assembly.saddle


def _conjugate_gradients(K: sparse.csr_matrix, b: Floats, precondition: Solve, close: float = CLOSE) -> Floats | None:
    """Return x with K x = b by preconditioned conjugate gradients.

    Returns None if K is not positive definite, or after MOST iterations. The residual is dominated by stiff modes, such
    as volume changes, while bending is soft. So convergence also requires that the energy has stopped growing over
    DELAY iterations (Strakos and Tichy 2002), and that x has stopped changing. For nearly incompressible materials
    almost all the energy may be in volume changes while the error of x is as large as x.
    """
    x, r, p, rz = np.zeros_like(b), b.copy(), np.zeros_like(b), 1.0
    gained: list[float] = []
    moved: list[float] = []
    goal = close**2 * dot(b, b)
    for number in range(MOST):
        settled = dot(r, r) <= goal and sum(gained[-DELAY:]) <= close**2 * sum(gained)
        if settled and sum(moved[-DELAY:]) <= CRAWL * close * dot(x, x) ** 0.5:
            return x
        count_product(K.nnz)
        z = precondition(r)
        rz, before = dot(r, z), rz
        p = z + (rz / before if number else 0.0) * p
        q = K @ p
        curvature = dot(p, q)
        if not (curvature > 0.0 and rz > 0.0):
            return None
        gained.append(rz * rz / curvature)
        moved.append(rz / curvature * dot(p, p) ** 0.5)
        x += (rz / curvature) * p
        r -= (rz / curvature) * q
    return None


def _two_level_preconditioner(K: sparse.csr_matrix, below: CoarseLevel, watch: Callable[[], None]) -> Solve:
    """Return the two-level preconditioner: the diagonal for rough errors, the coarse tangent for smooth errors."""
    rough, down = 1.0 / K.diagonal(), below.P.T.tocsr()

    def precondition(r: Floats) -> Floats:
        """Return the preconditioned residual of r."""
        watch()
        there: Floats = rough * r + below.P @ below.factor.solve(down @ r)
        return there

    return precondition
