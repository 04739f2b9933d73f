"""Base class of verifiers, with defaults for models that have no verification."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.models.shared.prepared_model import Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification import grid_convergence
from softmark.interpreter.verification.probe_errors import NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.records import dataclass
from softmark.solvers.independent_forces.solid_forces import ForceBalance

FINER = 2.0  # ratio of cell sizes of a coarser mesh and this one
NEAR, APART = 1.25, 1.6  # ratios of cell sizes: below NEAR the mesh is the same, from APART coarse enough


@dataclass(frozen=True)
class VerifiedSolution:
    """Solution that is being verified, with its model and case."""

    scene: Scene
    declared: Declared
    case: Case
    prepared: Prepared
    solution: Solution
    known: dict[Any, Any] = field(default_factory=dict, compare=False)  # cache, by function


class Verifier:
    """Base class of verifiers, one for each kind of model; the base class itself verifies nothing."""

    holds = False  # True if nodes lie exactly where supports prescribe displacements
    order = 2.0  # theoretical convergence order of displacements

    # ------------------------------------------------------------------ forces

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return additional facts about a solution for the report."""
        return {}

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Return the force balance by independent formulas, and the residual by the solver.

        Raises NoIndependentFormula.
        """
        raise NoIndependentFormula(
            found.declared.thing.reason_without_forces or "no independent formula is available for this model"
        )

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Return the reaction of every support by independent formulas, and their rounding error, N.

        Raises NoIndependentFormula.
        """
        raise NoIndependentFormula("no independent formula is available for this model")

    def rounding(self, found: VerifiedSolution) -> float:
        """Return the estimated rounding of the internal forces of cells, N; 0 if it is not known.

        Raises NoIndependentFormula.
        """
        return 0.0

    # ------------------------------------------------------------------ stated error

    def discretisation(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the discretisation error: the distance of a result from the limit of refinement.

        Raises NoErrorEstimate.
        """
        return error_from_coarser(self.coarser(answer), seen, self.order, answer)

    def remaining_load_error(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest, missing: float) -> float:
        """Return the part of the relative load error `missing` that the discretisation error does not include."""
        return missing

    def is_singular(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> bool:
        """Return whether a stress or strain at the probe grows without limit under refinement; True if unknown."""
        return True

    def coarser(self, answer: SolutionUnderTest) -> list[tuple[Solution, float]]:
        """Return one or two coarser solutions, each with its cell size relative to the solution before it.

        Raises NoErrorEstimate.
        """
        raise NoErrorEstimate("no coarser model of this kind is available")

    def model(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the model error: the distance of the limit of refinement from the exact model.

        Raises NoErrorEstimate.
        """
        raise NoErrorEstimate("no error estimate is available for this kind of model")

    def cells(self, answer: SolutionUnderTest) -> int:
        """Return the number of cells or segments of the body."""
        return max(1, int(answer.result.size.get("elements", 1)))


def error_from_coarser(
    coarser: list[tuple[Solution, float]], seen: ProbeResultUnderTest, order: float, answer: SolutionUnderTest
) -> float:
    """Return the error of a result, from one or two coarser solutions and the theoretical order.

    Raises NoErrorEstimate.
    """
    (first, ratio), *second = coarser
    near = seen.of(first)
    apart = seen.apart(near)
    grid_convergence.require_close_grids([apart], seen.comparison_scale(apart))
    farther = None
    if second and abs(second[0][1] - ratio) <= 0.25 * ratio:
        far = near.of(second[0][0])
        farther = near.apart(far)
        if isinstance(seen.metric, TensorMetric):  # three numbers do not agree by chance, and tensors need not
            apart, farther = seen.change(near), near.change(far)
    if seen.is_about_forces and answer.case.contacts:
        from softmark.interpreter.verification import contact_error

        found = contact_error.contact_error_index(seen, apart, ratio, farther)
        grid_convergence.require_close_grids([found], seen.comparison_scale(apart), grid_convergence.HOPELESS)
        return found
    if seen.is_about_forces and farther is not None and farther > apart * ratio ** (order + grid_convergence.NEAR):
        apart = farther / ratio  # closer than any order says: an energy may pass its limit, and come back
    found = grid_convergence.convergence_index(apart, ratio, order, farther)
    grid_convergence.require_close_grids([found], seen.comparison_scale(apart), grid_convergence.HOPELESS)
    return found


class SizedMeshVerifier(Verifier):
    """Verifier of models on meshes with a cell size."""

    def coarser(self, answer: SolutionUnderTest) -> list[tuple[Solution, float]]:
        """Return solutions on meshes with two and four times the cell size, each with its refinement ratio.

        The ratio compares a mesh with the next finer one: (cells of the finer mesh / cells)^(1/d) in d dimensions,
        about 2.
        Raises NoErrorEstimate if the mesh is read from a file, or no coarser mesh exists.
        """
        if answer.solid.thing.size is None:
            raise NoErrorEstimate("its mesh is read from a file, so there is no coarser one")
        found: list[tuple[Solution, float]] = []
        cells = self.cells(answer)
        for factor in (FINER, FINER**2):
            try:
                costs = factor**-1.5  # cells cost more than that, time and what is done once less
                solution, size = answer.solve_other_model(f"size {factor:g}", answer.sized(factor), answer.own, costs)
            except NoErrorEstimate:
                if not found:
                    raise
                break
            ratio = (cells / max(1, size["elements"])) ** (1.0 / answer.dimension)
            if ratio < (APART if factor > FINER else NEAR):
                break
            found.append((solution, ratio))
            cells = max(1, size["elements"])
        if not found:
            raise NoErrorEstimate("a larger cell size gives the same mesh")
        return found
