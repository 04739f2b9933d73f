"""Equilibrium beside barriers that are soft at first: what is sought with stiff ones is found from there.

A barrier is thin, and what lies behind it bears nothing: of nodes that come to press at once, Newton's method sends
some off, and fetches them back by turns. Of a soft one, which begins at the same gap, all that presses lies behind the
surface, and whole steps lead there from anywhere near; the stiff one then has little left to move.
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


def hardened(newton: Newton, x: Floats, load: float) -> Floats:
    """The equilibrium without friction at a load, from x. Raises NotConverged."""

    def known(own: Newton, x: Floats, load: float, before: Assembly | None) -> Floats:
        return fallen(own, x, load, before is None)

    return in_steps(newton, x, load, (_softest(newton.assembly), SOFT, 1.0), known)


def fallen(newton: Newton, x: Floats, load: float, first: bool) -> Floats:
    """The equilibrium at a load that energy falls to; with pressures as unknowns that to which whole steps lead.

    No energy falls on the way in and out of contact then, and where forces have to, steps are short. So where whole
    ones lead out of the domain of the law, of all but the `first` stiffness, a smaller change of stiffness is sooner
    there. Raises NotConverged.
    """
    if newton.assembly.saddle:
        try:
            return newton.whole_steps(x, STEPS, load, WHOLE)
        except NotConverged:
            if not first and newton.history[-1].length < WHOLE:
                raise
    return newton.descend(x, load)


def _softest(assembly: Assembly) -> float:
    """The first part: so soft that nothing comes behind the middle of a rigid body, and out at the other side."""
    each: list[Any] = [e for e in assembly.loads if e.driven]
    softest: Iterator[float] = (
        e.barrier.distance / max(BEHIND * depth_of_centroid(e.body), e.barrier.distance / SOFT) for e in each
    )
    return max((SOFTEST, *softest))


def in_steps(newton: Newton, x: Floats, load: float, softs: tuple[float, ...], find: Callable[..., Floats]) -> Floats:
    """What `find` finds at a load from x, as barriers take on these parts of their stiffness in turn.

    Where it finds nothing, by smaller steps. It is given a state, the load, and the assembly that the state is of.
    Raises NotConverged.
    """
    known, left, before, own = 0.0, list(softs), None, newton
    while left:
        assembly = softened(newton.assembly, load, left[0])
        own = like(newton, assembly, newton.problem.tolerance if left[0] == 1.0 else NEAR)
        try:
            y = find(own, x, load, before)
        except NotConverged:
            if not known or left[0] < CLOSEST * known:
                newton.reached = own.reached
                raise
            left.insert(0, (known * left[0]) ** 0.5)
            continue
        x, before, newton.moved, known = y, assembly, own.moved, left.pop(0)
    take(newton, own)
    return x


def like(newton: Newton, assembly: Assembly, tolerance: float = 0.0) -> Newton:
    """The same iteration over another assembly, to its tolerance, or a rougher one."""
    tolerance = max(newton.problem.tolerance, tolerance)
    problem = replace(newton.problem, assembly=assembly, tolerance=tolerance, exact=None)
    own = type(newton)(problem, newton.history, newton.systems, newton.phase)
    own.towed, own.moved = newton.towed, newton.moved
    return own


def take(newton: Newton, own: Newton) -> None:
    """What is asked of an iteration that has found an equilibrium."""
    newton.last, newton.matrix, newton.criterion = own.last, own.matrix, own.criterion


def softened(assembly: Assembly, load: float, soft: float) -> Assembly:
    """With all barriers of rigid bodies, and all friction, so soft, as they are at a load."""
    inner, outer = list[Any](assembly.internal), list[Any](assembly.loads)
    internal = [e.softened(soft) if e.rubs else e for e in inner]
    return assembly.acting(internal, [e.at(load).softened(soft) if e.driven else e for e in outer])
