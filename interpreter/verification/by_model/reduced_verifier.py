"""Verification of models reduced from finite elements, against the equations of the full model."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.prepared_model import Solution
from softmark.interpreter.problem.body_case import case_for
from softmark.interpreter.results.json_records import to_plain_json
from softmark.interpreter.verification.by_model.solid_forces_check import balance_of, solid_state
from softmark.interpreter.verification.by_model.solid_verifier import SolidVerifier
from softmark.interpreter.verification.by_model.verifier import VerifiedSolution
from softmark.solvers.independent_forces.solid_forces import ForceBalance
from softmark.solvers.model_reduction.reduction_error import ReductionError

DOUBTFUL = 0.01  # estimated displacement error, relative to the displacement, from which a model warns of it
DOUBTFUL_RESIDUAL = 0.1  # residual of the full equations, relative to the forces, from which it warns as well
LARGEST = 0.2  # estimated error up to which one linear step tells it: the true one is then up to twice as large
LARGEST_RESIDUAL = 0.5  # residual up to which a state is an answer where no error can be estimated
MEASURES = "add modes or derivatives, train on states like this one, or use `{of}` itself"


class ReducedVerifier(SolidVerifier):
    """Verifier of reduced models, by the forces of the full model in the reduced state.

    The discretisation error is that of the full model.
    """

    holds = False

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return an empty dictionary, because reduced models report no further facts."""
        return {}

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Compute the force balance of the full model in the reduced state, and return also the reported residual.

        Raises NoIndependentFormula.
        """
        full, solution = found.scene.declared[found.declared.thing.reduces], found.solution
        reduced = solution.facts.get("reduced") or {}
        state = solid_state(full.thing, case_for(found.scene, full), solution.mesh)
        return balance_of(state), reduced.get("full_residual")


def check_reduced_solution(declared: Declared, solution: Solution) -> Solution:
    """Return the solution of a reduced model with its error in the equations of the full model.

    The solution counts as not converged if that error is large. The facts get `full_residual`, `estimated_error`
    (relative) and `estimated_error_m`, as in ReductionError.
    """
    assert solution.reduction_error is not None
    try:
        with np.errstate(all="ignore"):
            error = solution.reduction_error()
    except Exception as stopped:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        reason = f"its error in the full model could not be computed ({type(stopped).__name__}: {stopped})"
        return Solution("failed", reason, solution.facts, notes=solution.notes)
    reduced = (solution.facts.get("reduced") or {}) | error.facts
    facts = solution.facts | {"reduced": to_plain_json(reduced)}
    of = declared.thing.reduces
    if _is_error_too_large(error):
        reason = (
            f"the reduced basis cannot represent this state: {_format_reduction_error(error, of)}; "
            f"{MEASURES.format(of=of)}"
        )
        return Solution("not_converged", reason, facts, notes=solution.notes)
    return replace(solution, facts=facts, notes=(*solution.notes, *_residual_warning(declared, error, of)))


def _is_error_too_large(error: ReductionError) -> bool:
    if error.relative is None:
        return not error.residual <= LARGEST_RESIDUAL
    return not error.relative <= LARGEST


def _residual_warning(declared: Declared, error: ReductionError, of: str) -> list[Diagnostic]:
    """Return a warning if a state leaves a significant residual in the equations of the full model."""
    if (error.relative or 0.0) <= DOUBTFUL and error.residual <= DOUBTFUL_RESIDUAL:
        return []
    problem = f"`{declared.name}` does not balance the forces of the full model: {_format_reduction_error(error, of)}"
    return [diagnostic("W419", declared.at(), problem, "large residual in the full model", MEASURES.format(of=of))]


def _format_reduction_error(error: ReductionError, of: str) -> str:
    """Return the residual and the estimated error of a reduced model, as text."""
    residual = f"the residual in the equations of `{of}` is {_format_ratio(error.residual)} the forces"
    if error.relative is None:
        return residual
    size = f"{_format_ratio(error.relative)} its displacement"
    return f"{residual}, which corresponds to a displacement error of about {size}"


def _format_ratio(part: float) -> str:
    """Return a ratio as text, such as `3 % of` or `2.5 times`."""
    return f"{100 * part:.2g} % of" if part < 1.0 else f"{part:.2g} times"


VERIFIER = ReducedVerifier()
