"""Equilibrium with friction: energies with the pressures of the iterate before, and then whole steps with its own.

Forces of friction depend on pressures that are sought as well, and have no energy. With pressures and normals of an
earlier iterate they have one, which Newton's method descends as it does without friction; what that finds gives new
pressures, and the distances of one from the next shrink by the coupling of pressure and shear (Jean 1999; Li et al.
2020). When it is close, whole steps with the tangent of all of it, which is not symmetric, are quadratic.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.problem import NotConverged

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.statics.newton import Newton

MOST, WITHIN = 12, 20  # iterates, and steps of each
SOFT = 0.01  # of the stiffness across and along the surface: first soft, so that nodes come and go in whole steps
BESIDE = 0.5  # residual of a start from which it is found at once
CLOSEST = 1.5  # from one stiffness to the next: given up below
ROUGH, FINER = 1e-2, 0.05  # how well an iterate is worth solving: at most, and of the residual that friction leaves
NEAR = 1e-4  # residual to which the soft one is solved
EACH = 3, 6  # whole steps of all of it from an iterate: the second as long as the residual falls
FALLS = 1, 2, 6  # the same beside surfaces that deform, whose barriers whole steps go too near to


def rubbed(newton: Newton, x: Floats, load: float) -> Floats:
    """The equilibrium with friction at a load, from x. Raises NotConverged."""
    soft = _first(newton.assembly)
    if soft < 1.0 and newton.problem.start is not None and newton.residual(x, load)[1] < BESIDE:
        own = _like(newton, _softened(newton.assembly, load, 1.0), newton.problem.tolerance)
        try:
            found = _settled(own, x, load, None, grips=False)
        except NotConverged:
            pass
        else:
            newton.moved = own.moved
            _take(newton, own)
            return found
    soft, target, before, own = 0.0, soft, None, newton
    while soft < 1.0:
        assembly = _softened(newton.assembly, load, target)
        tolerance = newton.problem.tolerance if target == 1.0 else max(newton.problem.tolerance, NEAR)
        own = _like(newton, assembly, tolerance)
        try:
            y = _settled(own, x, load, before, before is None)
        except NotConverged as failure:
            if not soft or target < CLOSEST * soft:
                raise _slid(newton, failure, own.reached, load) from failure
            target = (soft * target) ** 0.5
            continue
        x, before, newton.moved, soft, target = y, assembly, own.moved, target, 1.0
    _take(newton, own)
    return x


def _settled(newton: Newton, x: Floats, load: float, before: Assembly | None, grips: bool) -> Floats:
    """The equilibrium of one stiffness, from that of the one before. Raises NotConverged."""
    residual, tolerance = 1.0, newton.problem.tolerance
    for _ in range(MOST):
        rough = max(tolerance, min(ROUGH, FINER * residual))
        own = _like(newton, _lagged(newton.assembly, x, before, grips), rough)
        try:
            x, before, grips = own.descend(x, load), None, False
        finally:
            newton.reached = own.reached
        newton.moved = own.moved
        _, residual = newton.residual(x, load)
        found = _whole(newton, x, load, residual)
        if found is not None:
            return found
    reason = f"friction does not settle at {100 * load:.4g} % of the load, residual {residual:.1e}"
    raise NotConverged(reason, tuple(newton.history))


def _whole(newton: Newton, x: Floats, load: float, residual: float) -> Floats | None:
    """The equilibrium by whole steps of all of it, from a residual; None where these do not lead there."""
    moved, done = newton.moved, False
    for most in EACH if _first(newton.assembly) < 1.0 else FALLS:
        try:
            x, done, left = newton.steps(x, most, load)
        except NotConverged:
            break
        if done or not left < residual:
            break
        residual = left
    if not done:
        newton.moved = moved
    return x if done else None


def _like(newton: Newton, assembly: Assembly, tolerance: float) -> Newton:
    """The same iteration over another assembly."""
    problem = replace(newton.problem, assembly=assembly, tolerance=tolerance, exact=None, max_iterations=WITHIN)
    own = type(newton)(problem, newton.history, newton.systems, newton.phase)
    own.towed, own.moved = newton.towed, newton.moved
    return own


def _take(newton: Newton, own: Newton) -> None:
    """What is asked of an iteration that has found an equilibrium."""
    newton.last, newton.matrix, newton.criterion = own.last, own.matrix, own.criterion


def _first(assembly: Assembly) -> float:
    """How soft to begin: rigid bodies alone let whole steps lead behind their surface."""
    return SOFT if any(e.rubs for e in assembly.loads) else 1.0


def _slid(newton: Newton, failure: NotConverged, x: Floats | None, load: float) -> NotConverged:
    """Why there is no equilibrium: that all that touches slides, if it does where Newton's method was left."""
    soft = _softened(newton.assembly, load, SOFT)
    each: list[Any] = [e for e in (*soft.internal, *soft.loads) if e.rubs]
    if x is None or any(e.holds(x) for e in each):
        return failure
    reason = f"all that touches slides at {100 * load:.4g} % of the load, and nothing else holds it"
    return NotConverged(reason, failure.history, failure.facts, failure.unstable, failure.loose)


def steady(newton: Newton, x: Floats) -> bool | None:
    """Whether an equilibrium is stable under the pressures that it has; None where that is not known."""
    return _like(newton, _lagged(newton.assembly, x, None, grips=False), 1.0).definite(x) or None


def _softened(assembly: Assembly, load: float, soft: float) -> Assembly:
    """With friction at a load that is so many times as stiff."""
    inner, outer = list[Any](assembly.internal), list[Any](assembly.loads)
    internal = [e.softened(soft) if e.rubs else e for e in inner]
    return assembly.acting(internal, [e.at(load).softened(soft) if e.rubs else e for e in outer])


def _lagged(assembly: Assembly, x: Floats, before: Assembly | None, grips: bool) -> Assembly:
    """With the pressures that those before have in x; at first, where nothing is known of them, everything sticks."""
    was = before or assembly

    def each(own: Any, known: Any) -> list[Any]:
        return [e.lagged(x, e0, grips) if e.rubs else e for e, e0 in zip(own, known, strict=True)]

    return assembly.acting(each(assembly.internal, was.internal), each(assembly.loads, was.loads))
