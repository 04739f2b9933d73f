"""Equilibrium on a finer space over the same mesh, by Newton's method from the state on the coarse space.

The systems of the finer space are solved by conjugate gradients. Smooth errors are reduced by the factor of the coarse
tangent in the same state, rough ones by the diagonal. The angle between a space and its complement in a finer one does
not depend on the mesh size, so the number of iterations does not grow with it (Bank 1996). The state is found only to
a fraction of the distance between the two.
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
from softmark.solvers.sparse.conjugate_gradients import dot

SMALL = 20_000  # unknowns up to which a factor takes hardly more than iterations, and less where volumes are kept
LARGER = 40_000  # the same where iterations lead nowhere
CLOSE = 2e-2  # relative residual of the systems, and their error in the energy norm
NEAR = 0.1  # the same of a step to a mode, whose frequency it changes by its square
SETTLED = 0.03  # of the first step: a step this short is the last
NEARBY = 1e-3  # the same where steps cost next to nothing
ROUNDED = 1e-12  # of the displacements: a step this short is rounding, and those after it are no shorter
CRAWL = 3.0  # times that, of the way so far: what the steps of DELAY iterations may add up to where they have settled
STEPS = 10  # of Newton's method at most
AWAY = 5.0  # times the first step: a longer one does not lead to a state nearby
DELAY = 10  # iterations over which the energy and the displacements must have come to rest
MOST = 400  # iterations of conjugate gradients in a step
ALIKE = 1e-10  # of the largest: a smaller direction among vectors is one that they have already


LOST = "conjugate gradients do not converge on the finer space"
Solve = Callable[[Floats], Floats]


class StateLost(Exception):
    """Raised if the finer space has no equilibrium near the coarse state, or it was not found."""


@dataclass(frozen=True)
class CoarseLevel:
    """Coarse level: factor of its tangent, and prolongation P of its free unknowns to those of the fine level."""

    factor: Factor
    P: sparse.csr_matrix  # (fine free, coarse free)

    @classmethod
    def of(cls, P: sparse.csr_matrix, coarse: Assembly, fine: Assembly, factor: Factor) -> CoarseLevel:
        """Return the coarse level for a prolongation P of nodal values (fine nodes, coarse nodes)."""
        three = sparse.kron(P, sparse.identity(3), format="csr")
        return cls(factor, three[fine.free][:, coarse.free].tocsr())


def solve_on_finer_space(
    assembly: Assembly, x: Floats, below: Callable[[], CoarseLevel], watch: Callable[[], None] = lambda: None
) -> Floats:
    """Return the equilibrium (dofs,) near x, to SETTLED of its distance. Raises StateLost, Singular, `watch` errors."""
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
            x = _step_within_domain(assembly, x, d)
            rounded = size <= ROUNDED * float(np.linalg.norm(x))
            if rounded or size <= SETTLED * first or (number == 0 and _next_step_is_short(assembly, x, solve, size)):
                return x
    raise StateLost(f"{STEPS} Newton steps on the finer space do not reach equilibrium")


def solve_with_known_tangent(
    assembly: Assembly, x: Floats, known: Factor, watch: Callable[[], None] = lambda: None
) -> Floats:
    """Return the equilibrium (dofs,) near x by modified Newton steps, with the factorised tangent of another law.

    Raises StateLost if a step is longer than half of the last one or leaves the domain of the law, and any error of
    `watch`.
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
            x, first, before = _step_within_domain(assembly, x, d), first or size, size
            if size <= ROUNDED * float(np.linalg.norm(x)) or size <= NEARBY * first:
                return x
    raise StateLost("modified Newton steps with the tangent of the other law do not converge")


def tangent_solver(
    assembly: Assembly, x: Floats, below: Callable[[], CoarseLevel], watch: Callable[[], None] = lambda: None
) -> tuple[sparse.csr_matrix, Solve]:
    """Return the tangent in a state, and a solver for it, which raises StateLost. Raises Singular, `watch` errors."""
    K = assembly.tangent(x, 1.0)
    watch()
    if is_direct(assembly):
        return K, factor(K, symmetric=assembly.conservative).solve
    nearly = _two_level_preconditioner(K, below(), watch)

    def solve(b: Floats) -> Floats:
        if (found := _conjugate_gradients(K, b, nearly, NEAR)) is None:
            raise StateLost(LOST)
        return found

    return K, solve


def lowest_frequencies(K: sparse.csr_matrix, solve: Solve, M: sparse.csr_matrix, modes: Floats) -> Floats:
    """Return w^2 (m,), (rad/s)^2, of K phi = w^2 M phi near `modes` (n, m) of a coarser space. Raises StateLost.

    Each mode gets one step of inverse iteration, which leaves w^2 / w_j^2 of its faster parts; modes and steps together
    are combined by the Rayleigh-Ritz method (Bathe 2014, section 10.3.2). The error of w^2 is quadratic in that of
    modes.
    """
    with np.errstate(all="ignore"), ALONE:
        stiff, heavy = K @ modes, M @ modes
        values = (modes * stiff).sum(axis=0) / (modes * heavy).sum(axis=0)
        steps = np.stack([solve(b) for b in (heavy * values - stiff).T], axis=1)
        return _rayleigh_ritz(K, M, np.hstack([modes, steps]))[: modes.shape[1]]


def _rayleigh_ritz(K: sparse.csr_matrix, M: sparse.csr_matrix, basis: Floats) -> Floats:
    """Return w^2 in ascending order in the span of vectors (n, k). Raises StateLost."""
    basis = basis / np.maximum(np.sqrt((basis * (M @ basis)).sum(axis=0)), np.finfo(np.float64).tiny)
    if not np.all(np.isfinite(basis)):
        raise StateLost("the modes of the finer space are not finite")
    sizes, axes = np.linalg.eigh(basis.T @ (M @ basis))
    known = sizes > ALIKE * sizes[-1]
    basis = basis @ (axes[:, known] / np.sqrt(sizes[known]))
    found: Floats = dense.eigvalsh(basis.T @ (K @ basis))
    return found


def _next_step_is_short(assembly: Assembly, x: Floats, solve: Solve, size: float) -> bool:
    """Return whether the next step, with the solver of the last, would be short compared with `size`, m.

    The energy is no measure of that: the finer space first changes the volume of cells, which says little about
    bending.
    """
    next_step = solve(assembly.gradient(x, 1.0)[assembly.free])
    return bool(np.isfinite(next_step).all()) and dot(next_step, next_step) <= (SETTLED * size) ** 2


def _step_within_domain(assembly: Assembly, x: Floats, d: Floats) -> Floats:
    """Return the state after as much of the step as stays in the domain of the law. Raises StateLost."""
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
    """Return the Newton step of the free unknowns, by a tangent or a definite one, and its solver. Raises StateLost."""
    if not np.all(np.isfinite(g)):
        raise StateLost("the forces of the finer space are not finite")
    direct = is_direct(assembly)
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


def is_direct(assembly: Assembly) -> bool:
    """Return whether the systems of an assembly are factorised, not iterated."""
    return len(assembly.free) <= SMALL or not assembly.conservative or assembly.saddle


def _conjugate_gradients(K: sparse.csr_matrix, b: Floats, precondition: Solve, close: float = CLOSE) -> Floats | None:
    """Return x with K x = b by conjugate gradients; None if K is not definite, or after MOST iterations.

    The residual is dominated by stiff modes, such as volume changes, while bending is soft. So convergence also
    requires that the energy has stopped growing over DELAY iterations (Strakos and Tichy 2002), and that x has stopped
    moving. Near incompressibility almost all the energy may be in volume changes while the error of x is as large as x.
    """
    x, r, p, rz = np.zeros_like(b), b.copy(), np.zeros_like(b), 1.0
    gained: list[float] = []
    moved: list[float] = []
    goal = close**2 * dot(b, b)
    for number in range(MOST):
        settled = dot(r, r) <= goal and sum(gained[-DELAY:]) <= close**2 * sum(gained)
        if settled and sum(moved[-DELAY:]) <= CRAWL * close * dot(x, x) ** 0.5:
            return x
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
    """Return the two-level preconditioner: diagonal for rough errors, coarse factor for smooth ones."""
    rough, down = 1.0 / K.diagonal(), below.P.T.tocsr()

    def precondition(r: Floats) -> Floats:
        watch()
        there: Floats = rough * r + below.P @ below.factor.solve(down @ r)
        return there

    return precondition
