"""Problem that a reference solves for a case of a scene, and its solution."""

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
    """Protocol of the solution of a theory: displacement field and estimated error."""

    @property
    def estimated_error(self) -> float:
        """Estimated displacement error at any point, m."""

    @property
    def displacement(self) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
        """Displacement field: maps undeformed points (n, 3), m, to displacements (n, 3), m."""


def problem_of(reference: Declared, case: Case) -> Any:
    """Return the input of `reference.thing.solve` for a case.

    Raises Fault if the case violates an assumption of the theory.
    """
    setup = theory_setup_of(reference)
    try:
        setup.check_case(reference, case)
        return setup.problem_from(reference, case)
    except NotApplicable as refused:
        raise _assumption_fault(reference, refused) from refused


def solve_theory(reference: Declared, case: Case) -> TheorySolution:
    """Return the solution of a reference for a case.

    Raises Fault if the case violates an assumption of the theory, and any error of the theory's solver.
    """
    problem = problem_of(reference, case)
    try:
        found: TheorySolution = reference.thing.solve(problem)
    except NotApplicable as refused:
        raise _assumption_fault(reference, refused) from refused
    return found


def _assumption_fault(reference: Declared, refused: NotApplicable) -> Fault:
    """Return the error E503: a reference does not apply to the scene, with reason and remedy of the theory."""
    problem = f"`{reference.name}` does not apply to this scene: {refused.reason}"
    return fault("E503", reference.at(), problem, help=refused.remedy)
