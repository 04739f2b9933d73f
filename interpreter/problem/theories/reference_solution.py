"""Problem that a reference of a scene solves, and its solution."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.problem.theories import theory_setup_of
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class TheorySolution(Protocol):
    """Protocol of the solution of a theory, as a reference uses it."""

    @property
    def estimated_error(self) -> float:
        """Estimated displacement error at any point, m."""

    @property
    def displacement(self) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
        """Displacement field: maps undeformed points (n, 3), m, to displacements (n, 3), m."""


def problem_of(reference: Declared, case: Case) -> Any:
    """Return the problem that a reference solves. Raises Fault if an assumption of its theory is violated."""
    setup = theory_setup_of(reference)
    try:
        setup.check_case(reference, case)
        return setup.problem_from(reference, case)
    except NotApplicable as refused:
        raise _assumption_fault(reference, refused) from refused


def solve_theory(reference: Declared, case: Case) -> TheorySolution:
    """Solve the problem of a reference. Raises Fault, and any error of the theory's solver."""
    problem = problem_of(reference, case)
    try:
        found: TheorySolution = reference.thing.solve(problem)
    except NotApplicable as refused:
        raise _assumption_fault(reference, refused) from refused
    return found


def _assumption_fault(reference: Declared, refused: NotApplicable) -> Fault:
    problem = f"`{reference.name}` does not apply to this scene: {refused.reason}"
    return fault("E503", reference.at(), problem, help=refused.remedy)
