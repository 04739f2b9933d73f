"""Verification of a solution before it becomes a result.

Forces at equilibrium are computed again by independent formulas (solvers/independent_forces/solid_forces.py). A state
whose forces do not balance as well as the solver reports is rejected. Inverted cells are counted, and solutions with
nonfinite numbers are rejected.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.capabilities import VARYING_CONSTANTS
from softmark.interpreter.models.shared.prepared_model import Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.results.json_records import to_plain_json
from softmark.interpreter.results.run_report import ModelResult
from softmark.interpreter.verification import material_stability, reaction_balance
from softmark.interpreter.verification.by_model import verifier_of
from softmark.interpreter.verification.by_model.solid_forces_check import LEFT
from softmark.interpreter.verification.by_model.verifier import VerifiedSolution, Verifier
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.solvers.elements import CELLS
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import CheckedBody

AGREES = 2.0  # allowed ratio to the residual that the solver claims
SAYS = 0.01  # relative residual above which a converged state is not an equilibrium
ACTS = 1e-6  # relative rounding below which forces are significant
SEEN = 0.005  # relative differences that three digits show


def verify_solution(scene: Scene, declared: Declared, case: Case, prepared: Prepared, solution: Solution) -> Solution:
    """Return the solution with the results of all force checks as `checks`; its status is `failed` if it violates them.

    If the solution failed because its material law reached the end of its validity, that is reported.
    """
    found = _verify(scene, declared, case, prepared, solution)
    ends = dict.fromkeys(end for m in case.materials if (end := getattr(m, "ends", None)) is not None)
    if found.status == "converged" or not ends:
        return found
    return replace(found, message=f"{found.message}; {'; '.join(ends)}")


def _verify(scene: Scene, declared: Declared, case: Case, prepared: Prepared, solution: Solution) -> Solution:
    facts = to_plain_json(solution.facts)
    solution = replace(solution, facts=facts)
    if solution.displacement is None:
        return solution
    if (reason := _describe_nonfinite_numbers(solution)) is not None:
        return _failed_solution(solution, reason)
    if solution.reduction_error is not None:
        from softmark.interpreter.verification.by_model.reduced_verifier import check_reduced_solution

        solution = check_reduced_solution(declared, solution)
        if solution.displacement is None:
            return solution
        facts = solution.facts
    try:
        with np.errstate(all="ignore"):
            found, reason = _check_forces(scene, declared, case, prepared, solution)
    except Exception as error:  # a failing check does not invalidate the solution
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        found, reason = (
            {"residual": None, "reason": f"the verification stopped with an error: {type(error).__name__}: {error}"},
            None,
        )
    facts = facts | {"checks": to_plain_json(found)}
    if reason is not None:
        return _failed_solution(replace(solution, facts=facts), reason)
    inverted = _inverted_cell_warnings(declared, solution, found)
    notes = (*solution.notes, *inverted, *material_stability.stability_warnings(declared, found),
             *_unverified_warnings(declared, found))  # fmt: skip
    return replace(solution, facts=facts, notes=notes)


def _failed_solution(solution: Solution, reason: str) -> Solution:
    return Solution("failed", reason, solution.facts, notes=solution.notes)


# ------------------------------------------------------------------ nonfinite numbers


def _describe_nonfinite_numbers(solution: Solution) -> str | None:
    """Return text that names the nonfinite numbers of a solution, or None."""
    mesh, history = solution.mesh, solution.history
    if mesh is not None and not solid_forces.is_finite([np.asarray(mesh.displacement)]):
        return "the displacements are not finite numbers"
    if mesh is not None and mesh.frames is not None and not solid_forces.is_finite([mesh.frames]):
        return "the displacements at intermediate times are not finite numbers"
    if mesh is not None and mesh.pressures is not None and not solid_forces.is_finite([mesh.pressures]):
        return "the pressures are not finite numbers"
    if history is None:
        return None
    if not solid_forces.is_finite(
        [np.asarray(history.times), np.asarray(history.step_s), np.asarray(history.step_cpu_s)]
    ):
        return "the times of the motion are not finite numbers"
    if not solid_forces.is_finite([np.asarray(e) for e in history.energies.values()]):
        return "the energies of the motion are not finite numbers"
    return None


def tolerance_warnings(scene: Scene, models: Mapping[str, ModelResult]) -> list[Diagnostic]:
    """Return a warning if the solver tolerance is coarser than the differences that metrics report."""
    if not (analyses := list(scene.of_kind("analysis").values())):
        return []
    analysis, tolerance = analyses[0], analyses[0].thing.tolerance
    for name, metric in scene.of_kind("metric").items():
        found = (m.metrics.get(name) for m in models.values() if m.status == "converged")
        values = sorted(m.value for m in found if m is not None and m.value is not None and m.meaningful)
        if metric.thing.unit != "1" or metric.thing.measured_from is None:
            continue
        gaps = (b - a for a, b in pairwise(values) if b - a > SEEN * abs(b))
        if (least := min(gaps, default=math.inf)) <= tolerance:
            return [
                _tolerance_warning(analysis, f"resolve a difference of {100 * least:.2g} % between models in `{name}`")
            ]
        if values and values[0] <= tolerance:
            return [_tolerance_warning(analysis, f"resolve an error of {100 * values[0]:.2g} % in `{name}`")]
    return []


def _tolerance_warning(analysis: Declared, what: str) -> Diagnostic:
    return diagnostic(
        "W352",
        analysis.at("tolerance"),
        f"a tolerance of {analysis.thing.tolerance:.0e} cannot {what}",
        "coarser than the compared differences",
        "write a tolerance well below the differences of interest; the usual value is 1e-8",
    )


# ------------------------------------------------------------------ checks


def _check_forces(
    scene: Scene, declared: Declared, case: Case, prepared: Prepared, solution: Solution
) -> tuple[dict[str, Any], str | None]:
    """Return the facts of all force checks, and the reason if the solution is invalid, else None."""
    verifier, looked = verifier_of(declared.thing), VerifiedSolution(scene, declared, case, prepared, solution)
    found = _check_cells(solution, case.depth) | verifier.facts(looked)
    found |= {n: v for n, v in (solution.facts.get("energy") or {}).items() if n in ("drift", "gained")}
    if isinstance(case.analysis, Dynamic):
        return found, None
    if case.contacts and solution.mesh is not None:
        from softmark.interpreter.verification import contact_forces_check, rigid_body_equilibrium_check

        for look in (contact_forces_check.check_contacts, rigid_body_equilibrium_check.check_rigid_bodies):
            own, behind = look(case, solution.mesh, np.asarray(solution.mesh.displacement, dtype=np.float64))
            found |= own
            if behind is not None:
                return found, behind
    if verifier.holds and solution.mesh is not None and solution.mesh.kind in CELLS:
        from softmark.interpreter.verification.support_reactions_check import support_deviation

        off, support = support_deviation(case, solution.mesh)
        found |= {"misplaced": off}
        if support is not None:
            return found, (
                f"`{support}` does not hold the body where it should: the deviation is {off:.1e} of the body size"
            )
    if (
        not case.uniform
        and solution.mesh is not None
        and solution.mesh.kind in CELLS
        and declared.thing.has_capability(VARYING_CONSTANTS)
    ):
        from softmark.interpreter.verification.heterogeneous_constants_check import check_integrals

        formulation = getattr(declared.thing, "formulation", "displacement")
        own, behind = check_integrals(case, solution.mesh, formulation != "displacement")
        found |= own
        if behind is not None:
            return found, behind
    try:
        result, claimed = verifier.balance(looked)
    except NoIndependentFormula as reason:
        return _check_balance(verifier, looked, {"residual": None, "reason": str(reason), **found})
    found = {"residual": result.residual, "rounding": result.rounding, "nodes": result.nodes, **found}
    if not math.isfinite(result.residual):
        return found, "the computed forces are not finite numbers"
    # meeting the tolerance is sufficient, even if the solver claimed more
    whole = (
        solution.status == "converged" and declared.thing.reduces is None
    )  # a reduced model has a residual in the full equations
    if whole and claimed is not None and result.rounding < ACTS:
        claimed = min(claimed, SAYS)
    allowed = max(AGREES * (claimed or 0.0), case.analysis.tolerance) + LEFT * result.rounding
    if claimed is None or result.residual <= allowed:
        return _check_balance(verifier, looked, found)
    problem = (
        f"its forces do not balance: independent formulas leave a residual of {result.residual:.1e} of "
        f"the loads, while the solver reports {claimed:.1e}"
    )
    return found, problem


def _check_balance(
    verifier: Verifier, looked: VerifiedSolution, found: dict[str, Any]
) -> tuple[dict[str, Any], str | None]:
    """Return the facts including the global balance, and the reason if a converged solution violates it, else None."""
    own, reason = reaction_balance.check_balance(verifier, looked)
    return found | own, reason if looked.solution.status == "converged" else None


def _check_cells(solution: Solution, depth: float) -> dict[str, Any]:
    """Return the number of inverted cells, and the least volume ratio at integration points and nodes.

    `depth`, m, is the thickness of the slice of a body of revolution, 0 for other bodies.
    """
    mesh = solution.mesh
    if mesh is None or mesh.kind not in CELLS:
        return {}
    u = np.asarray(mesh.displacement, dtype=np.float64)
    body = CheckedBody(mesh.points, mesh.cells, mesh.kind, u, (), 0.0, depth=depth)
    least, strain = body.volumes()
    return {
        "inverted": int((~(least > 0.0)).sum()), "of_cells": len(least), "worst_J": float(least.min()),
        "largest_strain": float(strain.max()),
    }  # fmt: skip


def _inverted_cell_warnings(declared: Declared, solution: Solution, found: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """Yield a warning about inverted cells, unless the model already gave one."""
    if not found.get("inverted") or any(note.code == "W324" for note in solution.notes):
        return
    yield diagnostic(
        "W351",
        declared.at(),
        f"{found['inverted']} of {found['of_cells']} cells of `{declared.name}` are inverted",
        "inverted cells",
        "inverted cells are physically impossible; do not trust the displacements near them",
    )


def _unverified_warnings(declared: Declared, found: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """Yield a warning for each force or contact that could not be verified."""
    if found.get("residual", 0.0) is None:
        yield _unverified_warning(
            declared, f"the forces of `{declared.name}` could not be verified independently: {found['reason']}"
        )
    elif "reason" in (pressed := found.get("pressed", {})):
        what = f"the force of loads on rigid bodies in `{declared.name}` could not be verified independently"
        yield _unverified_warning(declared, f"{what}: {pressed['reason']}")
    for name, contact in found.get("contact", {}).items():
        if "reason" in contact and found.get("residual", 0.0) is not None:
            what = f"the penetration between `{declared.name}` and the rigid body of `{name}` could not be checked"
            yield _unverified_warning(declared, f"{what}: {contact['reason']}")


def _unverified_warning(declared: Declared, what: str) -> Diagnostic:
    return diagnostic(
        "W353",
        declared.at(),
        what,
        "not verified independently",
        "compare with the result of another model",
    )
