"""Static equilibrium: finds the state in which the energy gradient vanishes on every free degree of freedom.

Three strategies are tried in this order.

1. Full Newton steps at full load. With the exact tangent of a corotational energy they reach a 60-degree bend in about
six steps, because this energy grows only with the stretch and not with its square. A stiffer law starts from the
equilibrium of its corotational twin, or from a given state. The result is accepted only if it is a stable equilibrium
without inverted cells.
2. Load stepping (`load_stepping.py`), where full steps diverge, as for large stretches, or where the corotational twin
collapses. From a collapsed twin half of a body may end rotated by 180 degrees and just as stable.
3. The careful strategy, again from rest: every step gives less energy than one of the MEMORY states before it (Armijo
1966; Grippo, Lampariello and Lucidi 1986), an indefinite tangent is made definite, and load steps shrink and grow. If
it ends at an unstable equilibrium, such as a straight column above its buckling load, it perturbs the state and
continues to a stable one.

If contact is possible, full steps oscillate in and out of contact. Then the first strategy decreases the energy
instead, and is left out if there are pressure unknowns. If these strategies fail for contact with rigid bodies, soft
barriers come first (`barrier_stiffness_ramp.py`), also in the careful strategy. Friction has its own method
(`friction_iteration.py`). A body held only by contact that moves away as a rigid body is refused
(`rigid_body_instability.py`).

With a cap only full steps are taken, up to that number of linear systems. With `arc_length` the path of equilibria is
followed from rest (`arc_length.py`). A solution whose digits are lost to rounding is refused (`condition`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats, VectorSpace
from softmark.solvers.linear import factorisations
from softmark.solvers.linear.factorisations import Singular, factor
from softmark.solvers.linear.linear_solver import LinearSolverOptions, LinearSystems
from softmark.solvers.statics import static_stability
from softmark.solvers.statics.arc_length import PathFollower
from softmark.solvers.statics.load_stepping import has_left_solution_branch, solve_in_load_steps
from softmark.solvers.statics.rigid_motion_predictor import predict_rigid_motion
from softmark.solvers.statics.static_newton import MEMORY, RIGID, TINY, Newton
from softmark.solvers.statics.static_problem import (
    HELD,
    SLIDES,
    CellsTooCoarseForRotation,
    Criterion,
    Equilibrium,
    Iteration,
    NotConverged,
    Statics,
    Watch,
)

__all__ = [
    "MEMORY", "RIGID", "TINY", "Criterion", "Equilibrium", "Iteration", "LinearSolverOptions", "NotConverged",
    "Statics", "Watch", "equilibrium",
]  # fmt: skip

DOUBTED = 1e-4  # condition number times eps above which the rounding error is measured
HOPELESS = 1e-3  # largest relative rounding error: fewer than three digits are refused
SOFT = 0.3  # relative stiffness against the load below which a limit point is likely
AWAY = 1e-9  # of the extent: supports of a start state farther off than this are moved first
SHORTEST, LONGEST = 1e-3, 0.05  # least and largest part of a support motion from a start state
WASTED = 2000  # largest number of iterations with contact: 20 times what successful ones take
BOLD, ROUGH = 20, 12  # largest numbers of full steps: with the law; with its twin or from a start state


def equilibrium(problem: Statics) -> Equilibrium:
    """Return the equilibrium under full load. Raises NotConverged with the history of all attempts."""
    history: list[Iteration] = []
    systems = LinearSystems(problem.linear)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if problem.cap is not None or problem.linear.cap is not None:
            return _solve_with_capped_steps(problem, history, systems)
        try:
            solve = _solve_by_load_control if problem.path == "load" else _solve_by_arc_length
            found = solve(problem, history, systems)
        except NotConverged as failure:
            raise _explain_failure(problem, history, failure) from failure
        if found.unstable is None or found.critical is not None:
            return found
        critical = static_stability.critical_load(problem, history, found.unstable)
    return replace(found, critical=critical, history=tuple(history))


def _explain_failure(problem: Statics, history: list[Iteration], failure: NotConverged) -> NotConverged:
    """Return the failure with the buckling load, or the motion without resistance, added if either is the cause."""
    left, facts, reason = failure.unstable, failure.facts, failure.reason
    critical = None if left is None else static_stability.critical_load(problem, history, left)
    if critical is not None:
        reason = f"it buckles at {100 * critical:.3g} % of the load, and no equilibrium was found beyond: {reason}"
        facts = {**facts, "critical_load": critical}
    slides = reason.startswith(SLIDES)
    loose = static_stability.loose_motion(problem) if left is None or slides else None
    if slides:  # a body on a stabilising spring gets its reason from free_body_stabilization.py
        reason += ", and nothing else holds it" if loose is not None else HELD
    return NotConverged(reason, tuple(history), facts, left, loose)


def _solve_by_load_control(problem: Statics, history: list[Iteration], systems: LinearSystems) -> Equilibrium:
    """Return the equilibrium at full load by the three strategies in turn. Raises NotConverged."""
    ways = [_solve_from_given_start] if problem.start is not None and problem.largest_load_step == 1.0 else []
    unstable = None
    turns = problem.largest_load_step < 1.0  # full steps would find an equilibrium that differs by whole turns
    crept = problem.may_contact and problem.assembly.saddle  # no energy decreases when contact begins and ends
    if problem.bold:
        ways += [] if turns or crept else [_solve_at_full_load]
        ways += [] if problem.has_friction else [_solve_in_load_steps]  # with friction full steps come last
        ways += [_solve_with_soft_barriers] if problem.has_rigid_bodies and not (problem.has_friction or turns) else []
    vain = None  # iterations from rest to full load that the careful strategy would repeat
    for way in ways:
        before = len(history)
        try:
            return way(problem, history, systems)
        except CellsTooCoarseForRotation:  # the careful strategy follows the same path
            raise
        except NotConverged as failure:  # the history has its iterations; the careful strategy starts from rest
            unstable = failure.unstable if unstable is None else unstable
            vain = len(history) - before if problem.has_friction and way is _solve_at_full_load else vain
    if unstable is not None and turns:
        return _solve_buckling_after_rotation(problem, history, systems, unstable)
    if unstable is not None and problem.has_stabilizing_spring:
        found = _leave_instability(problem, history, systems, unstable)
    else:
        found = _solve_safely(problem, history, systems, vain)
    return found if found.unstable is not None else replace(found, unstable=unstable)


# ------------------------------------------------------------------ full steps at full load


def _solve_at_full_load(problem: Statics, history: list[Iteration], systems: LinearSystems) -> Equilibrium:
    """Return the equilibrium at full load from rest, by full Newton steps or, with contact, by decreasing energy."""
    newton = Newton(problem, history, systems)
    start = _start_state(newton)
    x = newton.descend(start, 1.0) if problem.may_contact else newton.solve_by_full_steps(start, BOLD)
    return _accept_stable_state(newton, x)


def _solve_from_given_start(problem: Statics, history: list[Iteration], systems: LinearSystems) -> Equilibrium:
    """Return the equilibrium at full load from the given start state. Raises NotConverged."""
    newton = Newton(problem, history, systems)
    x = _move_given_start(newton)
    start = predict_rigid_motion(problem, x) if problem.may_contact else x
    x = newton.descend(start, 1.0) if problem.may_contact else newton.solve_by_full_steps(x, ROUGH)
    return replace(_accept_stable_state(newton, x), started=True)


def _minimize_energy(newton: Newton, x: Floats, load: float) -> Floats:
    """Return the equilibrium at a load factor by decreasing the energy from x. Raises NotConverged.

    With rigid bodies it starts with soft barriers.
    """
    if not newton.problem.has_rigid_bodies or newton.problem.has_friction:
        return newton.descend(x, load)
    from softmark.solvers.statics.barrier_stiffness_ramp import solve_with_stiffness_ramp

    return solve_with_stiffness_ramp(newton, x, load)


def _solve_with_soft_barriers(problem: Statics, history: list[Iteration], systems: LinearSystems) -> Equilibrium:
    """Return the equilibrium at full load, with soft barriers first. Raises NotConverged."""
    newton = Newton(problem, history, systems, "soft barriers")
    x = newton.impose_support_motion(problem.rest, 1.0) if problem.start is None else _move_given_start(newton)
    return _accept_stable_state(newton, _minimize_energy(newton, x, 1.0))


def _solve_in_load_steps(problem: Statics, history: list[Iteration], systems: LinearSystems) -> Equilibrium:
    """Return the equilibrium at full load by load stepping. Raises NotConverged."""
    newton = Newton(problem, history, systems, "steps of load")
    x, steps = solve_in_load_steps(newton)
    return replace(_accept_stable_state(newton, x), load_steps=steps)


def _start_state(newton: Newton, cap: int | None = None) -> Floats:
    """Return the start state for full steps. Raises NotConverged.

    It is the equilibrium of the corotational twin, up to `cap` linear systems, or the linear response to the supports.
    """
    problem = newton.problem
    if problem.twin is None or problem.has_friction:
        return newton.impose_support_motion(problem.rest, 1.0)
    rough = replace(problem, assembly=problem.twin, tolerance=1e-2)
    start = Newton(rough, newton.history, newton.systems, "corotational start")
    x = start.impose_support_motion(problem.rest, 1.0)
    if cap is None:
        x = start.descend(x, 1.0) if problem.may_contact else start.solve_by_full_steps(x, ROUGH)
        if not problem.near(x):
            raise NotConverged("the corotational first guess has cells of zero volume", tuple(newton.history))
    else:
        x, _, _ = start.full_steps(x, max(0, min(ROUGH, cap - newton.systems.solves)))
    newton.moved, newton.towed = start.moved, start.towed
    newton.predict_pressures(x)
    return x


def _move_given_start(newton: Newton) -> Floats:
    """Return the given start state moved with the supports. Raises NotConverged outside the domain of the law."""
    problem = newton.problem
    x = np.array(problem.start, dtype=problem.rest.dtype)
    if not np.all(np.isfinite(x)):
        raise NotConverged("the initial state is not finite", tuple(newton.history))
    newton.reset_predicted_pressures()
    left = problem.target - (x - problem.rest)[problem.fixed]
    if np.abs(left).max(initial=0.0) > AWAY * problem.extent:
        x = _move_with_supports(newton, x, left)  # with supports alone, cells next to them would be squeezed
    x[problem.fixed] = problem.rest[problem.fixed] + problem.target
    if not np.isfinite(newton.strain(x)):
        raise NotConverged("the initial state is outside the domain of the law", tuple(newton.history))
    newton.moved = float(np.linalg.norm((x - problem.rest) / problem.weights))
    return x


def _move_with_supports(newton: Newton, x: Floats, left: Floats) -> Floats:
    """Return a state x moved with its supports by increments `left` (c,). Raises NotConverged.

    If surfaces may meet, the motion is split into parts, with an equilibrium after each. Friction limits the parts:
    otherwise corners interlock that should slide past each other.
    """
    wandering = newton.assembly.pair_contacts.values()
    if not wandering:
        return newton.move_with_supports(x, left, 1.0)
    most = max(LONGEST, min(energy.largest_support_step for energy in wandering) / float(np.abs(left).max()))
    done, part = 0.0, min(1.0, most)
    while done < 1.0:
        part = min(part, 1.0 - done)
        try:
            x = newton.descend(newton.move_with_supports(x, part * left, 1.0), 1.0)
        except NotConverged:
            part *= 0.5
            if part < SHORTEST:
                raise
        else:
            done, part = done + part, min(most, 2.0 * part)
    return x


def _accept_stable_state(newton: Newton, x: Floats) -> Equilibrium:
    """Return the result x of full steps as an `Equilibrium` if it is stable. Raises NotConverged."""
    stable = True if newton.problem.convex else _is_stable(newton, x)
    if stable is False and newton.assembly.conservative:
        raise NotConverged("the equilibrium is unstable", tuple(newton.history), unstable=x)
    return _equilibrium_at(newton, x, 1, stable or None)


def _is_stable(newton: Newton, x: Floats) -> bool | None:
    """Return whether an equilibrium x is stable; None if unknown."""
    if not newton.problem.has_friction:
        return newton.is_tangent_definite(x)
    from softmark.solvers.statics.friction_iteration import is_stable_at_pressures

    return is_stable_at_pressures(newton, x)


def _solve_buckling_after_rotation(
    problem: Statics, history: list[Iteration], systems: LinearSystems, unstable: Floats
) -> Equilibrium:
    """Return the stable state to which a body buckles from an unstable equilibrium at the end of a rotation.

    Raises NotConverged if none is found: the careful strategy would end at the same unstable equilibrium.
    """
    newton = Newton(problem, history, systems, "buckling")
    try:
        x, stable = newton.find_stable_state(unstable)
    except NotConverged as failure:
        reason = f"the rotated body buckles, and no stable state was found near its equilibrium: {failure.reason}"
        raise NotConverged(reason, tuple(history), systems.facts, unstable) from failure
    return replace(_equilibrium_at(newton, x, 1, stable), unstable=newton.left if newton.left is not None else unstable)


def _leave_instability(
    problem: Statics, history: list[Iteration], systems: LinearSystems, unstable: Floats
) -> Equilibrium:
    """Return a stable state near an unstable equilibrium of a body held only by contact, if the body deforms.

    Raises NotConverged if the body moves away as a rigid body: load stepping would find no equilibrium either.
    """
    from softmark.solvers.statics.rigid_body_instability import describe_rigid_instability

    newton = Newton(problem, history, systems)
    try:
        x, stable = newton.find_stable_state(unstable)
        return replace(_equilibrium_at(newton, x, 1, stable), unstable=newton.left)
    except NotConverged as failure:
        away = describe_rigid_instability(newton, unstable)
        if away is not None:
            reason = f"the contact equilibrium is unstable: {away}"
            raise NotConverged(reason, tuple(history), systems.facts, unstable) from failure
    return _solve_safely(problem, history, systems)


# ------------------------------------------------------------------ full steps with a cap


def _solve_with_capped_steps(problem: Statics, history: list[Iteration], systems: LinearSystems) -> Equilibrium:
    """Return the state of full steps when the cap is reached, or the equilibrium if earlier. Raises NotConverged."""
    newton, started = Newton(problem, history, systems), problem.start is not None
    cap = problem.max_iterations if problem.cap is None else problem.cap
    x = _move_given_start(newton) if started else _start_state(newton, cap)
    x, done, residual = newton.full_steps(x, max(0, cap - systems.solves))
    if not np.isfinite(residual):
        raise NotConverged("full Newton steps lead to forces that are not finite", tuple(history), systems.facts)
    if done:
        return replace(_accept_stable_state(newton, x), started=started)
    state, _, residual = _evaluate_in_double_precision(newton, x)
    sound = bool(problem.sound(state))
    found = Equilibrium(state, residual, tuple(history), 1, "cap", None, systems.name, systems.facts)
    return replace(found, sound=sound, started=started)


# --------------------------------------------------------- careful strategy


def _solve_safely(
    problem: Statics, history: list[Iteration], systems: LinearSystems, vain: int | None = None
) -> Equilibrium:
    """Return the equilibrium by the careful strategy: load steps are halved where they fail. Raises NotConverged.

    `vain` is the number of iterations of an earlier failed step from rest to full load; this step is not tried again.
    """
    newton = Newton(problem, history, systems, "careful")
    x, load, step, steps, wasted = problem.rest, 0.0, problem.largest_load_step, 0, vain or 0
    if vain is not None:
        step *= 0.5
    while load < 1.0:
        target, before = min(1.0, load + step), len(history)
        try:
            begun = newton.impose_support_motion(x, target - load, target)
            there = _minimize_energy(newton, begun, target)
            if problem.way is not None and problem.bold and has_left_solution_branch(x, begun, there):
                raise NotConverged("the body springs back from the imposed rotation", tuple(history))
            if lost := problem.lost_turn_message(there, target):
                raise NotConverged(lost, tuple(history))
            if not problem.sound(there):
                raise NotConverged("the equilibrium has inverted cells", tuple(history))
            if problem.jumped(x, there):
                raise NotConverged("neighbouring nodes rotated past each other", tuple(history))
            x, load, steps = there, target, steps + 1
            step = min(2.0 * step, problem.largest_load_step)
        except NotConverged as failure:
            step, wasted = 0.5 * (target - load), wasted + len(history) - before
            if step < 1e-3 * problem.largest_load_step or (problem.may_contact and wasted > WASTED):
                reached = f"the load could be raised to only {100 * load:.4g} %: {failure.reason}"
                raise NotConverged(
                    f"{reached}{_describe_likely_cause(problem, history, x, load)}", tuple(history), systems.facts
                ) from failure
    if problem.assembly.conservative:
        x, stable = newton.find_stable_state(x)
        return replace(_equilibrium_at(newton, x, steps, stable), unstable=newton.left)
    return _equilibrium_at(newton, x, steps, _is_stable(newton, x) or None)


def _describe_likely_cause(problem: Statics, history: list[Iteration], x: Floats, load: float) -> str:
    """Return a text with a likely cause why the load cannot be raised: a limit point or a bifurcation, or ""."""
    known = (
        static_stability.current_stiffness(problem, history, x, load) if load > 0.0 and problem.way is None else None
    )
    if known is None or (known[0] > SOFT and not known[1]):
        return ""
    soft, negative = known
    what = (
        "equilibrium paths seem to intersect there (bifurcation)"
        if negative
        else "this looks like a limit point, since the stiffness in the load direction has fallen to "
        f"{100 * soft:.2g} %"
    )
    return f"; {what}: use `path = arc_length` in the analysis"


# ------------------------------------------------------------------ arc length and result


def _solve_by_arc_length(problem: Statics, history: list[Iteration], systems: LinearSystems) -> Equilibrium:
    """Return the first equilibrium under full load along the equilibrium path from rest. Raises NotConverged."""
    newton = static_stability.direct_newton(problem, history, "path")
    newton.systems = systems
    follower = PathFollower(newton)
    x = follower.to_full_load()
    stable: bool | None = newton.is_tangent_definite(x) or None
    if problem.assembly.conservative:
        x, stable = newton.find_stable_state(x)
    found = _equilibrium_at(newton, x, len(follower.path.points), stable)
    facts = found.facts | follower.path.facts
    meetings = [s.load for s in follower.path.limits if s.kind == "bifurcation"]
    critical = meetings[0] if meetings and newton.left is not None else None
    return replace(found, facts=facts, unstable=newton.left, critical=critical)


def _equilibrium_at(newton: Newton, x: Floats, steps: int, stable: bool | None) -> Equilibrium:
    """Return the solution x as an `Equilibrium`.

    Raises NotConverged if cells are inverted or single precision is too coarse.
    """
    problem, history, facts = newton.problem, tuple(newton.history), newton.systems.facts
    if not problem.sound(x):
        raise NotConverged("the equilibrium has inverted cells", history, facts)
    criterion = newton.criterion
    x, left, residual = _balance_resultant(newton, *_evaluate_in_double_precision(newton, x))
    if problem.exact is not None:
        criterion = "residual" if residual <= problem.tolerance else "rounding"
        if residual > problem.rounded:
            criterion, error = "energy", _energy_norm_error(problem.exact, x)
            if not error <= problem.rounded:
                reason = f"single precision leaves a residual of {residual:.1e}, above the limit {problem.rounded:.0e}"
                raise NotConverged(f"{reason}, and an error of {error:.1e} in the energy norm", history, facts)
    found = Equilibrium(x, residual, history, steps, criterion, stable, newton.systems.name, facts)
    # near an unstable equilibrium the direction is arbitrary: this is no rounding error
    known = _condition_and_rounding(newton, x) if newton.left is None else None
    condition, rounding = (None, None) if known is None else known
    follower = not problem.assembly.conservative
    return replace(found, follower=follower, condition=condition, rounding=rounding, left=left)


def _balance_resultant(newton: Newton, x: Floats, g: Floats, residual: float) -> tuple[Floats, Floats | None, float]:
    """Return a state whose resultant of residual forces also meets the tolerance, after up to two more steps.

    Residuals at many nodes may each be small while their sum is not. Also returns the next Newton step, or None, and
    the relative residual.
    """
    problem = newton.problem
    left = None if newton.left is not None else _next_newton_step(newton, g)
    if left is None or problem.resultant is None or residual > problem.tolerance:
        return x, left, residual
    for _ in range(2):
        free = np.zeros_like(g)
        free[problem.assembly.free] = g[problem.assembly.free]
        if problem.resultant(free) * residual <= problem.tolerance * float(np.linalg.norm(free)):
            break
        y = x + left
        there, nearer = newton.gradient_and_residual(y, 1.0)
        step = _next_newton_step(newton, there)
        if not nearer < residual or step is None:  # no better state can be represented
            break
        x, g, residual, left = y, there, nearer, step
    return x, left, residual


def _next_newton_step(newton: Newton, g: Floats) -> Floats | None:
    """Return the Newton step (dofs,) for residual forces g (dofs,) with the last factorisation; None without one."""
    problem, last = newton.problem, newton.last
    if last is None or last.tolerance or problem.exact is not None or not isinstance(problem.space, VectorSpace):
        return None
    d = np.zeros_like(g)
    d[problem.assembly.free] = -last.solve(g[problem.assembly.free])
    return d


def _condition_and_rounding(newton: Newton, x: Floats) -> tuple[float, float] | None:
    """Return the condition number of the last tangent, and the relative rounding error of the state x.

    The condition number times eps is a bound that slender bodies stay far below (a rod of 1 : 50 000 in 1000 segments
    has 2e-2 and is right to 1e-8), so if it is large the error is measured. Returns None without a direct factorisation
    or with pressure unknowns. Raises NotConverged if fewer than three digits are left.
    """
    last, K = newton.last, newton.matrix
    if last is None or K is None or last.tolerance or K.dtype != np.float64 or newton.assembly.saddle:
        return None
    try:
        found = factorisations.condition(K, last)
    except Singular:
        return None
    lost = found * float(np.finfo(np.float64).eps)
    if not lost <= DOUBTED:
        lost = min(lost, static_stability.rounding_error(newton, x, last))
    if not lost <= HOPELESS:
        reason = (
            f"the stiffness matrix is nearly singular (condition number {found:.0e}): rounding errors may "
            f"reach {lost:.1g} of the solution"
        )
        raise NotConverged(reason, tuple(newton.history), newton.systems.facts)
    return found, lost


def _energy_norm_error(exact: Assembly, x: Floats) -> float:
    """Return the error of a state in the energy norm, sqrt(r . K^-1 r / 2E); infinite if K is not definite.

    On fine meshes the residual r of a rounded state grows: rounding varies from node to node, and the stiffness K of
    such short waves is large. They hardly change the energy E.
    """
    g = exact.gradient(x, 1.0)[exact.free]
    try:
        found = factor(exact.tangent(x, 1.0), symmetric=exact.conservative)
        size = float(g @ found.solve(g))
    except Singular:
        return float("inf")
    energy = sum(e.value(x) for e in exact.internal)
    known = not found.negative_pivots and size >= 0.0 and energy > 0.0
    return float(np.sqrt(0.5 * size / energy)) if known else float("inf")


def _evaluate_in_double_precision(newton: Newton, x: Floats) -> tuple[Floats, Floats, float]:
    """Return the state with exact imposed values, its gradient and its residual, all in double precision."""
    problem = newton.problem
    if problem.exact is None:
        return x, *newton.gradient_and_residual(x, 1.0)
    x = np.asarray(x, dtype=np.float64)
    x[problem.fixed] = problem.rest[problem.fixed] + problem.target
    judge = Newton(replace(problem, assembly=problem.exact, rest=x), newton.history, newton.systems)
    judge.towed = newton.towed
    return x, *judge.gradient_and_residual(x, 1.0)
