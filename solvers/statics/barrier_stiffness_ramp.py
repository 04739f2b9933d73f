"""Barrier stiffness ramp: solves contact with soft barriers first, and starts stiffer ones from there.

A barrier is thin, and behind it there is no resistance: when many nodes come into contact at once, Newton's method
oscillates between contact and separation. With a soft barrier that begins at the same gap all loaded nodes lie behind
the surface, and full Newton steps lead there from anywhere near; the stiff barrier then moves them only little.
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

SOFTEST, SOFT = 1e-4, 0.01  # of the stiffness, across the surface and along it: to begin with
CLOSEST = 1.5  # from one stiffness to the next: given up below
STEPS = 20  # whole ones, where pressures are unknowns as well
WHOLE = 0.5  # of a step: where less of it is in the domain of the law, they lead nowhere
BEHIND = 0.1  # of how deep the middle of a rigid body is: where the softest barrier begins to bear much
NEAR = 1e-4  # residual to which all but the last are solved


def ramp_barrier(newton: Newton, x: Floats, load: float) -> Floats:
    """Return the frictionless equilibrium at a load, from x, by a stiffness ramp. Raises NotConverged."""

    def known(own: Newton, x: Floats, load: float, before: Assembly | None) -> Floats:
        return minimize_at_load(own, x, load, before is None)

    return solve_in_stiffness_steps(newton, x, load, (_softest_fraction(newton.assembly), SOFT, 1.0), known)


def minimize_at_load(newton: Newton, x: Floats, load: float, first: bool) -> Floats:
    """Return the equilibrium at a load by decreasing the energy; with pressure unknowns, by full Newton steps first.

    With pressure unknowns no energy decreases as nodes come into contact and leave it, and steps that decrease the
    residual are short. If full steps leave the domain of the law at the `first` stiffness, such steps follow; at a
    later one it stops, since a smaller change of stiffness is faster. Raises NotConverged.
    """
    if newton.assembly.saddle:
        try:
            return newton.whole_steps(x, STEPS, load, WHOLE)
        except NotConverged:
            if not first and newton.history[-1].length < WHOLE:
                raise
    return newton.descend(x, load)


def _softest_fraction(assembly: Assembly) -> float:
    """Return the first stiffness fraction: as soft as possible without a body passing the middle of a rigid body."""
    each: list[Any] = [e for e in assembly.loads if e.driven]
    softest: Iterator[float] = (
        e.barrier.distance / max(BEHIND * depth_of_centroid(e.body), e.barrier.distance / SOFT) for e in each
    )
    return max((SOFTEST, *softest))


def solve_in_stiffness_steps(
    newton: Newton, x: Floats, load: float, softs: tuple[float, ...], find: Callable[..., Floats]
) -> Floats:
    """Return the equilibrium at a load, from x, at the last of the fractions `softs` of the barrier stiffness.

    The fractions are solved in turn by `find`, which gets a solver, a state, the load, and the assembly of that state
    (None at first). Where it fails, smaller steps follow. Raises NotConverged.
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
    copy_result(newton, own)
    return x


def solver_for(newton: Newton, assembly: Assembly, tolerance: float = 0.0) -> Newton:
    """Return a Newton solver like another, for another assembly; `tolerance` replaces its tolerance if it is larger."""
    tolerance = max(newton.problem.tolerance, tolerance)
    problem = replace(newton.problem, assembly=assembly, tolerance=tolerance, exact=None)
    own = type(newton)(problem, newton.history, newton.systems, newton.phase)
    own.towed, own.moved = newton.towed, newton.moved
    return own


def copy_result(newton: Newton, own: Newton) -> None:
    """Copy the last factorisation and criterion from a solver that has found an equilibrium."""
    newton.last, newton.matrix, newton.criterion = own.last, own.matrix, own.criterion


def with_softer_barriers(assembly: Assembly, load: float, soft: float) -> Assembly:
    """Return the assembly at a load with a fraction of the stiffness of all rigid contacts and of friction."""
    inner, outer = list[Any](assembly.internal), list[Any](assembly.loads)
    internal = [e.softened(soft) if e.rubs else e for e in inner]
    return assembly.acting(internal, [e.at(load).softened(soft) if e.driven else e for e in outer])
