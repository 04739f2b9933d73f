"""Forces and energies of a solution: support reactions, work of loads, stored energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.postprocessing.nodal_forces import reactions, supported_nodes
from softmark.interpreter.models.shared.prepared_model import Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.results.reaction_results import EquilibriumForces
from softmark.interpreter.vocabulary.analysis_words import Dynamic


def forces_and_energies(declared: Declared, case: Case, prepared: Prepared, solution: Solution) -> EquilibriumForces:
    """Return the reactions, contact forces, work and energies of a solution."""
    if (seen := solution.followed) is not None:
        return replace(seen.final_forces, followed=seen)
    if (why := _missing_forces_reason(declared, case, solution)) is not None or solution.carried is None:
        return EquilibriumForces(reason=why)
    carried = solution.carried()
    held = reactions(carried, carried.holders or supported_nodes(case, prepared.mesh, declared.thing))
    most = max((float(np.linalg.norm(r.force)) for r in held.values()), default=0.0)
    moved = float(np.linalg.norm(carried.u, axis=1).max(initial=0.0))
    known = (held, carried.work, carried.energy, max(most, carried.largest_load_size), moved, carried.extent)
    return EquilibriumForces(*known, dissipated=carried.dissipated, fluid=carried.fluid,
                  touches=carried.touches)  # fmt: skip


def _missing_forces_reason(declared: Declared, case: Case, solution: Solution) -> str | None:
    """Return the reason why a solution has no forces; None if it has forces."""
    if solution.displacement is None:
        return "there is no solution"
    if solution.carried is None:
        if declared.thing.reason_without_forces is not None:
            found: str = declared.thing.reason_without_forces
            return found
        if isinstance(case.analysis, Dynamic):
            return "reactions need a static analysis"
        if declared.thing.reduces is not None:
            return "a reduced model balances forces only within its basis, so its reactions are not reliable"
        return "this kind of model does not provide reactions"
    return None
