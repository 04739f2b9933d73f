"""Initial guess of a finite element model from another model's solution, and the report of its cost."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.problem.body_case import case_for, fault
from softmark.interpreter.results.state_results import SOLVED
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.solvers.statics.static_equilibrium import Watch


@dataclass(frozen=True)
class InitialGuess:
    """Initial guess: another model's solution at the nodes of this model (dofs,), m, and its cost.

    The solution is None if the other model failed.
    """

    model: str
    solution: Solution
    x: Floats | None
    seconds: tuple[float, float]  # wall and CPU time, s, including interpolation

    def facts(self, found: Solution) -> dict[str, Any]:
        """Return the `start` part of a report: the other model, its cost, and whether its solution was used."""
        return {
            "model": self.model,
            "status": self.solution.status,
            "iterations": self.solution.facts.get("iterations"),
            "wall_s": self.seconds[0],
            "cpu_s": self.seconds[1],
            "used": self._was_used(found),
        }

    def _was_used(self, found: Solution) -> bool:
        """Return whether Newton's method converged from this initial guess."""
        return self.x is not None and bool(found.facts.get("started"))

    def notes(self, declared: Declared, found: Solution) -> tuple[Diagnostic, ...]:
        """Return a warning if the initial guess was not used."""
        if self._was_used(found):
            return ()
        at, failed = declared.at("initial_guess"), self.x is None
        why = f"`{self.model}` has no solution" if failed else "Newton's method does not converge from there"
        return (
            diagnostic(
                "W341",
                at,
                f"`{declared.name}` could not start from the solution of `{self.model}`",
                "it started from rest",
                f"{why}; the computing time includes this attempt: remove `initial_guess`, or start from a finer model",
            ),
        )


@dataclass(frozen=True)
class GuessModel:
    """Model that provides the initial guess, ready to solve."""

    name: str
    prepared: Prepared

    def solve_guess(self, X: Floats, watch: Watch) -> InitialGuess:
        """Solve the model, and return its solution at nodes X (n, 3), m, of the other mesh."""
        wall, cpu = time.perf_counter(), time.process_time()
        solution = self.prepared.solve(watch)
        x = None
        if solution.displacement is not None and solution.status in SOLVED:
            x = np.asarray(solution.displacement(X)).ravel()
        spent = time.perf_counter() - wall, time.process_time() - cpu
        return InitialGuess(self.name, solution, x, spent)


def start_of(declared: Declared, workshop: BuildContext) -> GuessModel:
    """Build the model that provides the initial guess, for the same scene. Raises Fault."""
    name = declared.thing.initial_guess
    if workshop.scene is None:
        raise fault(
            "E508",
            declared.at("initial_guess"),
            f"`{declared.name}` was built without a scene, so that `{name}` cannot be looked up",
        )
    other = workshop.scene.declared[name]
    if workshop.build is None:
        raise ValueError("the workshop cannot build another model: make models by `builders.build`")
    return GuessModel(name, workshop.build(other, case_for(workshop.scene, other), workshop))
