"""From a static problem to a solution: one place that turns NotConverged into words."""

from __future__ import annotations

from collections.abc import Callable

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.models.prepared import Solution
from softmark.interpreter.scene import Declared
from softmark.solvers import linear
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics import Equilibrium, Iteration, NotConverged

CRITERIA = {
    "residual": "residual",
    "energy": "error in the energy norm, since rounding limits the residual",
    "rounding": "rounding limits the residual, and the last Newton step was below 1e-4 of the motion",
    "cap": "stopped by a cap, not solved",
}


def doubts(declared: Declared, found: Equilibrium) -> tuple[Diagnostic, ...]:
    """Warnings about an equilibrium that may not be the only one."""
    at = declared.at()
    if any(i.phase == "aside" for i in found.history):
        return (
            Diagnostic(
                "W314",
                f"`{declared.name}` buckled: the straight equilibrium is unstable",
                at.source,
                at.span,
                "one of several states",
                "the direction in which it went is arbitrary; an imperfection decides it",
            ),
        )
    if found.stable is None and found.solved and found.follower:
        return (
            Diagnostic(
                "W314",
                f"whether the equilibrium of `{declared.name}` is stable could not be established",
                at.source,
                at.span,
                "the load follows the surface",
                "there may be another state; vary the load and compare",
            ),
        )
    return ()


def solution(
    find: Callable[[], Equilibrium], remedy: str, finish: Callable[[Equilibrium], Solution]
) -> Solution:
    """What `find` comes to; not converged, with its history, where it finds no equilibrium."""
    try:
        found = find()
    except NotConverged as failure:
        known = facts(failure.history, None, 0) | failure.facts
        return Solution("not_converged", f"{failure.reason}; {remedy}", known)
    return finish(found)


def facts(history: tuple[Iteration, ...], residual: float | None, steps: int) -> dict[str, object]:
    """The `solve` part of a report."""
    shown = [
        {"phase": i.phase, "load": i.load, "residual": _number(i.residual), "length": i.length}
        for i in history[-200:]
    ]
    return {
        "iterations": len(history),
        "steps": steps,
        "residual": residual,
        "linear_solver": linear.NAME,
        "history": shown,
    }


def _number(value: float) -> float | None:
    return value if abs(value) < float("inf") else None


def found(state: Equilibrium, displacement: Callable[[Floats], Floats]) -> Solution:
    """A solution that met its tolerance, or one that a cap stopped."""
    known = facts(state.history, state.residual, state.load_steps)
    known["criterion"] = CRITERIA[state.criterion]
    known["stable"] = state.stable
    known["linear_solver"] = state.linear_solver
    known["started"] = state.started
    known |= state.facts
    if state.solved:
        return Solution("converged", None, known, displacement)
    reason = f"stopped by its cap at a residual of {state.residual:.1e}"
    inverted = "" if state.sound else ", with inverted cells"
    return Solution("capped", reason + inverted, known, displacement)
