"""Conversion of a static equilibrium, or of a failure to converge, to a solution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.prepared_model import Solution
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear import factorisations
from softmark.solvers.statics.static_equilibrium import Equilibrium, Iteration, NotConverged

CRITERIA = {
    "residual": "residual",
    "energy": "error in the energy norm, since rounding limits the residual",
    "rounding": "rounding limits the residual, and the last Newton step was below 1e-4 of the displacement",
    "cap": "stopped at the iteration limit, not solved",
}


def uniqueness_warnings(declared: Declared, found: Equilibrium) -> tuple[Diagnostic, ...]:
    """Return warnings if an equilibrium may not be unique."""
    at = declared.at()
    if found.facts.get("recovery", {}).get("elsewhere"):
        return (
            diagnostic(
                "W314",
                at,
                f"`{declared.name}` recovered to another state than without the disturbance, with the same energy",
                "one of several states",
                "add an imperfection to select one: which state is found is arbitrary",
            ),
        )
    if found.facts.get("pressed", {}).get("gave_way"):
        return (
            diagnostic(
                "W314",
                at,
                f"`{declared.name}` could not resist the force-driven rigid body, which moved on to "
                "another equilibrium",
                "one of several states",
                "raise the load in `states`: an earlier equilibrium may exist at part of the load",
            ),
        )
    if found.critical is not None or any(i.phase == "aside" for i in found.history):
        part = "" if found.critical is None else f" at {found.critical:.3g} of the load"
        return (
            diagnostic(
                "W314",
                at,
                f"`{declared.name}` buckled{part}: the straight equilibrium is unstable",
                "one of several states",
                "add an imperfection to select one: the direction of buckling is arbitrary",
            ),
        )
    if found.stable is None and found.solved and found.follower:
        return (
            diagnostic(  # unlike W314, no admission of an error of this state (`dsl robustness`)
                "W319",
                at,
                f"the stability of the equilibrium of `{declared.name}` could not be determined",
                "a load has no potential energy",
                "compute other load levels: the body may have several equilibria",
            ),
        )
    return ()


def solve_static(
    find: Callable[[], Equilibrium],
    remedy: str,
    finish: Callable[[Equilibrium], Solution],
    words: Callable[[Floats], str] | None = None,
) -> Solution:
    """Return the solution of the equilibrium that `find` computes, converted by `finish`.

    If `find` raises NotConverged, the solution has no displacements but the history of iterations, the reason and the
    `remedy`. `words` is a function that describes a motion (dofs,) that no stiffness resists; its text is added to the
    reason.
    """
    try:
        found = find()
    except NotConverged as failure:
        known = solver_report(failure.history, None, 0) | failure.facts
        loose = "" if failure.loose is None or words is None else f"; {words(failure.loose)}"
        return Solution("not_converged", f"{failure.reason}{loose}; {remedy}", known)
    return finish(found)


def describe_free_motion(X: Floats, d: Floats) -> str:
    """Return a description of a motion d (n, 3) of points X (n, 3), m, that no stiffness resists."""
    size = np.linalg.norm(d, axis=1)
    moving = np.flatnonzero(size > 0.5 * size.max())
    first = ", ".join(units.format_vector(X[n].tolist(), units.LENGTH) for n in moving[:3])
    more = ", ..." if len(moving) > 3 else ""
    return f"no stiffness against a motion of {len(moving)} of its {len(X)} nodes, at {first}{more}"


def solver_report(history: tuple[Iteration, ...], residual: float | None, steps: int) -> dict[str, object]:
    """Return the `solve` part of a report: history of iterations, last residual and number of load steps."""
    shown = [
        {"phase": i.phase, "load": i.load, "residual": _finite_or_none(i.residual), "length": i.length}
        for i in history[-200:]
    ]
    return {
        "iterations": len(history),
        "steps": steps,
        "residual": residual,
        "linear_solver": factorisations.NAME,
        "history": shown,
    }


def _finite_or_none(value: float) -> float | None:
    """Return a value for a report; None if it is not finite."""
    return value if abs(value) < float("inf") else None


def solution_of(state: Equilibrium, displacement: Callable[[Floats], Floats]) -> Solution:
    """Return the solution of an equilibrium: converged, or stopped at the iteration limit with the reason."""
    known = solver_report(state.history, state.residual, state.load_steps)
    known["criterion"] = CRITERIA[state.criterion]
    known["stable"] = state.stable
    known["linear_solver"] = state.linear_solver
    known["started"] = state.started
    known |= {"critical_load": state.critical} if state.critical is not None else {}
    if state.condition is not None:
        known |= {"condition": _finite_or_none(state.condition), "rounding": state.rounding}
    known |= state.facts
    if state.solved:
        return Solution("converged", None, known, displacement)
    reason = f"stopped at the iteration limit with a residual of {state.residual:.1e}"
    inverted = "" if state.sound else ", with inverted cells"
    return Solution("capped", reason + inverted, known, displacement)
