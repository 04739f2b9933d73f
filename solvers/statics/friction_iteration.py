"""Friction iteration: minimises energies with lagged pressures, then takes full Newton steps.

Friction depends on unknown pressures, and has no energy. With constant pressures and normals of an earlier iterate it
has an energy, which Newton's method minimises as in problems without friction. The result gives new pressures. Their
changes shrink from iteration to iteration, by a factor that depends on the coupling of pressure and shear (Jean 1999;
Li et al. 2020). Close to the solution, full steps with the present pressures and the complete, unsymmetric tangent
converge quadratically.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.barrier_stiffness_ramp import (
    SOFT,
    copy_solver_state,
    minimize_at_load,
    solve_in_stiffness_steps,
    solver_for,
    with_softer_barriers,
)
from softmark.solvers.statics.static_problem import SLIDES, NotConverged

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.statics.static_newton import Newton

MOST, WITHIN = 12, 20  # largest numbers of iterates, and of steps in each
BESIDE = 0.5  # largest residual for full steps at once
ROUGH, FINER = 1e-2, 0.05  # tolerance of an iterate: upper limit, and relative to the friction residual
EACH = 3, 6  # full steps from an iterate: number, and number while the residual falls
FALLS = 1, 2, 6  # the same between deformable surfaces, where full steps come too near


def solve_friction(newton: Newton, x: Floats, load: float) -> Floats:
    """Return the equilibrium with friction at a load factor, from a state x. Raises NotConverged."""
    rigid = _has_rigid_friction(newton.assembly)
    if rigid and newton.problem.start is not None and newton.gradient_and_residual(x, load)[1] < BESIDE:
        own = solver_for(newton, with_softer_barriers(newton.assembly, load, 1.0))
        try:
            found = _iterate_lagged_friction(own, x, load, None)
        except NotConverged:
            pass
        else:
            newton.moved = own.moved
            copy_solver_state(newton, own)
            return found
    try:
        return solve_in_stiffness_steps(newton, x, load, (SOFT, 1.0) if rigid else (1.0,), _solve_from_sticking_contact)
    except NotConverged as failure:
        raise _explain_sliding_failure(newton, failure, newton.reached, load) from failure


def _solve_from_sticking_contact(newton: Newton, x: Floats, load: float, before: Assembly | None) -> Floats:
    """Return the equilibrium of one barrier stiffness. Raises NotConverged.

    At the first stiffness (`before` is None) pressures are unknown, and all points stick.
    """
    return _iterate_lagged_friction(newton, x, load, before, grips=before is None)


def _iterate_lagged_friction(
    newton: Newton, x: Floats, load: float, before: Assembly | None, grips: bool = False
) -> Floats:
    """Return the equilibrium of one barrier stiffness by iteration with lagged pressures. Raises NotConverged.

    x is the equilibrium of the last stiffness and `before` its assembly. With `grips` all points stick at first.
    """
    residual = 1.0
    for _ in range(MOST):
        own = solver_for(newton, _with_lagged_friction(newton.assembly, x, before, grips), min(ROUGH, FINER * residual))
        own.problem = replace(own.problem, max_iterations=WITHIN)
        try:
            x, before, grips = minimize_at_load(own, x, load, grips), None, False
        finally:
            newton.reached = own.reached
        newton.moved = own.moved
        _, residual = newton.gradient_and_residual(x, load)
        found = _solve_with_full_tangent(newton, x, load, residual)
        if found is not None:
            return found
    reason = f"the friction iteration does not converge at {100 * load:.4g} % of the load, residual {residual:.1e}"
    raise NotConverged(reason, tuple(newton.history))


def _solve_with_full_tangent(newton: Newton, x: Floats, load: float, residual: float) -> Floats | None:
    """Return the equilibrium by full steps with the complete tangent; None if they do not converge."""
    moved, done = newton.moved, False
    for most in EACH if _has_rigid_friction(newton.assembly) else FALLS:
        try:
            x, done, left = newton.full_steps(x, most, load)
        except NotConverged:
            break
        if done or not left < residual:
            break
        residual = left
    if not done:
        newton.moved = moved
    return x if done else None


def _has_rigid_friction(assembly: Assembly) -> bool:
    """Return whether there is friction with rigid bodies; their barriers are softened first."""
    return any(e.has_friction for e in assembly.loads)


def _explain_sliding_failure(newton: Newton, failure: NotConverged, x: Floats | None, load: float) -> NotConverged:
    """Return the error, with a reason added if all points in contact slide where Newton's method stopped."""
    soft = with_softer_barriers(newton.assembly, load, SOFT)
    each: list[Any] = [e for e in (*soft.internal, *soft.loads) if e.has_friction]
    if x is None or any(e.holds(x) for e in each):
        return failure
    reason = f"{SLIDES} at {100 * load:.4g} % of the load"
    return NotConverged(reason, failure.history, failure.facts, failure.unstable, failure.loose)


def is_stable_at_pressures(newton: Newton, x: Floats) -> bool | None:
    """Return whether an equilibrium x is stable if its pressures stay constant; None if unknown."""
    return (
        solver_for(newton, _with_lagged_friction(newton.assembly, x, None, grips=False), 1.0).is_tangent_definite(x)
        or None
    )


def _with_lagged_friction(assembly: Assembly, x: Floats, before: Assembly | None, grips: bool) -> Assembly:
    """Return the assembly with friction lagged to the pressures in the state x.

    The pressures are those of the assembly `before`, if given. With `grips` all points in contact stick.
    """
    was = before or assembly

    def each(own: Any, known: Any) -> list[Any]:
        """Return energies with lagged friction."""
        return [e.lagged(x, e0, grips) if e.has_friction else e for e, e0 in zip(own, known, strict=True)]

    return assembly.with_internal_and_loads(each(assembly.internal, was.internal), each(assembly.loads, was.loads))
