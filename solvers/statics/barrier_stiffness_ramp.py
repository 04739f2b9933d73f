"""Barrier stiffness ramp: solves contact with soft barriers first, and with stiffer ones from the result.

A barrier is thin, and behind it there is no resistance. When many nodes come into contact at once, Newton's method
oscillates between contact and separation. With a soft barrier that begins at the same gap, all loaded nodes lie behind
the surface, and full Newton steps lead there from any state nearby. The stiff barrier then moves the nodes only a
little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from softmark.solvers.contact.signed_distance.distance_function import depth_of_centroid
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.static_problem import NotConverged

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.statics.static_newton import Newton

SOFTEST, SOFT = 1e-4, 0.01  # first fractions of the stiffness: least normal one, and the next one
CLOSEST = 1.5  # least factor between two stiffnesses; the ramp fails below it
STEPS = 20  # largest number of full steps with pressure unknowns
WHOLE = 0.5  # least fraction of a full step in the domain of the law
BEHIND = 0.1  # of the depth of the centroid: where the softest barrier becomes stiff
NEAR = 1e-4  # relative residual for all stiffnesses except the last


def solve_with_stiffness_ramp(newton: Newton, x: Floats, load: float) -> Floats:
    """Return the frictionless equilibrium at a load factor, from x, by a stiffness ramp. Raises NotConverged."""

    def known(own: Newton, x: Floats, load: float, before: Assembly | None) -> Floats:
        """Return the equilibrium at one barrier stiffness; `before` is the assembly of the last one, if any."""
        return minimize_at_load(own, x, load, before is None)

    return solve_in_stiffness_steps(newton, x, load, (_initial_stiffness_fraction(newton.assembly), SOFT, 1.0), known)


def minimize_at_load(newton: Newton, x: Floats, load: float, first: bool) -> Floats:
    """Return the equilibrium at a load factor by steps that decrease the energy. Raises NotConverged.

    With pressure unknowns full Newton steps are tried first: then there is no energy that decreases while nodes come
    into contact and leave it, and steps that decrease the residual are short. If full steps leave the domain of the law
    at the `first` stiffness of a ramp, steps that decrease the residual follow. At a later stiffness the error is
    raised, because a smaller change of stiffness is faster.
    """
    if newton.assembly.saddle:
        try:
            return newton.solve_by_full_steps(x, STEPS, load, WHOLE)
        except NotConverged:
            if not first and newton.history[-1].length < WHOLE:
                raise
    return newton.descend(x, load)


def _initial_stiffness_fraction(assembly: Assembly) -> float:
    """Return the first fraction of the barrier stiffness in a ramp.

    It is as small as possible without nodes passing the centroid of a rigid body.
    """
    each = assembly.rigid_contacts.values()
    softest: Iterator[float] = (
        e.barrier.distance / max(BEHIND * depth_of_centroid(e.body), e.barrier.distance / SOFT) for e in each
    )
    return max((SOFTEST, *softest))


def solve_in_stiffness_steps(
    newton: Newton, x: Floats, load: float, softs: tuple[float, ...], find: Callable[..., Floats]
) -> Floats:
    """Return the equilibrium at a load factor at the last of the fractions `softs` of the barrier stiffness.

    The fractions are solved in turn, from the state x on. `find` solves one fraction: its arguments are a solver, the
    last state, the load factor, and the assembly of that state (None at first). If it fails, smaller changes of
    stiffness follow. Raises NotConverged.
    """
    known, left, before, own = 0.0, list(softs), None, newton
    while left:
        assembly = with_softer_barriers(newton.assembly, load, left[0])
        own = solver_for(newton, assembly, newton.problem.tolerance if left[0] == 1.0 else NEAR)
        try:
            y = find(own, x, load, before)
        except NotConverged:
            if not known or left[0] < CLOSEST * known:
                newton.reached = own.reached
                raise
            left.insert(0, (known * left[0]) ** 0.5)
            continue
        x, before, newton.moved, known = y, assembly, own.moved, left.pop(0)
    copy_solver_state(newton, own)
    return x


def solver_for(newton: Newton, assembly: Assembly, tolerance: float = 0.0) -> Newton:
    """Return a copy of a Newton solver for another assembly.

    `tolerance` replaces the tolerance of the solver if it is larger.
    """
    tolerance = max(newton.problem.tolerance, tolerance)
    problem = replace(newton.problem, assembly=assembly, tolerance=tolerance, exact=None)
    own = type(newton)(problem, newton.history, newton.systems, newton.phase)
    own.towed, own.moved = newton.towed, newton.moved
    return own


def copy_solver_state(newton: Newton, own: Newton) -> None:
    """Copy the last factorisation and the convergence criterion from one Newton solver, `own`, to another."""
    newton.last, newton.matrix, newton.criterion = own.last, own.matrix, own.criterion


def with_softer_barriers(assembly: Assembly, load: float, soft: float) -> Assembly:
    """Return the assembly at a load factor with softer barriers of rigid contacts and softer friction.

    `soft` is the fraction of the stiffness.
    """
    pairs: dict[str, Any] = {name: pair for name, pair in assembly.pair_contacts.items() if pair.has_friction}
    contacts = pairs | assembly.rigid_contacts_at(load)
    return assembly.with_energies({name: contact.with_scaled_stiffness(soft) for name, contact in contacts.items()})
