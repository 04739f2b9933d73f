"""Verifier of finite element models of solids."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.metrics.contact import ContactArea
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.models.shared.material_regions import representative_materials
from softmark.interpreter.models.shared.prepared_model import Solution
from softmark.interpreter.problem.body_case import case_for
from softmark.interpreter.verification import finer_space_error, material_stability
from softmark.interpreter.verification.by_model.solid_forces_check import (
    SolidState,
    balance_of,
    mixed_solid,
    reactions_of,
    solid_state,
)
from softmark.interpreter.verification.by_model.verifier import (
    FINER,
    NEAR,
    SizedMeshVerifier,
    VerifiedSolution,
    error_from_coarser,
)
from softmark.interpreter.verification.cell_materials_check import split_by_material
from softmark.interpreter.verification.estimation_budget import NOT_ASKED, BudgetExceeded
from softmark.interpreter.verification.frequency_errors import FrequencyUnderTest
from softmark.interpreter.verification.grid_convergence import HIGHEST, HOPELESS, LEAST, error_from_finer
from softmark.interpreter.verification.probe_errors import (
    TRIFLE,
    CachedField,
    Floats,
    NoErrorEstimate,
    ProbeResultUnderTest,
)
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.solvers.elements import find_element
from softmark.solvers.independent_forces.solid_forces import ForceBalance

THEORY = 2.0  # times the distance of two strain measures on another mesh
ALIKE = 1.25  # the same on the mesh itself
PLENTY = 12.0  # solutions that can still be paid for: then one with another strain measure leaves enough for meshes
UNSURE = 1.5  # times what a finer mesh should cost by its cells: it may cost more
SOMEWHAT = 1.5  # times as fine a mesh, where one of half the size costs too much
FINE_EDGE = 0.5  # of half the area of facets at the edge of contact on finer cells: found in a third of it
COARSER = 0.5  # cost of a solution with another strain measure on a mesh of twice the size
TIGHT = 0.49  # Poisson's ratio from which quadratic cells converge more slowly
SEEPING = 2.0  # the order of pressures of fluid, which are linear in every cell, and of what follows them
AGREEING = 0.67  # of what cells differ by on their own: less is left of it on the finer space where a stress is smooth
SYSTEM = 0.6  # of a system of as many unknowns that is built and factored: what one that is iterated on takes, about
CHANCE = 0.5  # relative to the distance in the cells around it: as near may be the one point that is looked at
LOST = 1.7  # how much more they then leave: 1 / (1 - 2^-1/2) over 1 / (1 - 1/2), of order a half


def _needs_full_solve(answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> bool:
    """Return whether a finer model must be solved from the undeformed state rather than from the known solution.

    This is so in dynamics, with history-dependent states, with force-driven rigid bodies, and for forces in
    contact.
    """
    case = answer.case
    touching = seen.is_about_forces and bool(case.contacts or case.pairs)
    return answer.in_time or case.has_history or case.has_force_driven_body or touching


def _largest_poisson(answer: SolutionUnderTest) -> float:
    """Return the largest Poisson's ratio of the cells, including constants read from files."""
    mesh = None if answer.mesh is None else answer.mesh.mesh
    return float(max(material.poisson for material in representative_materials(answer.own, mesh)))


class SolidVerifier(SizedMeshVerifier):
    """Verifier of finite elements, by independent forces, a finer space, and the most accurate strain measure."""

    holds = True

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return the volume in which the law is unstable, and for an incompressible solid also the volume errors."""
        return material_stability.stability_facts(found) | self._volumes(found)

    def _volumes(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return the volume errors of an incompressible solid."""
        mesh = found.solution.mesh
        if mesh is None or found.case.largest_poisson < 0.5 or not found.case.uniform:
            return {}
        each = [(own, which) for own, which in split_by_material(found.case, mesh) if own.material.poisson >= 0.5]
        try:
            grown = [
                mixed_solid(found.declared.thing, own, mesh, which).largest_volume_changes() for own, which in each
            ]
        except NoIndependentFormula:  # the balance of forces says why
            return {}
        whole = {"body_volume": grown[0][1]} if not found.case.parts else {}
        return {"volume": max((most for most, _ in grown), default=0.0), **whole}

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Compute the force balance by solvers/independent_forces/solid_forces.py. Raises NoIndependentFormula."""
        return balance_of(self._verified_state(found)), found.solution.facts.get("residual")

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Compute the reactions from the cells around supported nodes. Raises NoIndependentFormula."""
        return reactions_of(self._verified_state(found))

    def rounding(self, found: VerifiedSolution) -> float:
        """Return the rounding error of forces at supported nodes, N: machine epsilon times the force at unit strain."""
        state = self._verified_state(found)
        return state.inside(np.flatnonzero(state.held.any(axis=1)))[2]

    def _verified_state(self, found: VerifiedSolution) -> SolidState:
        """Return the state under verification, built once. Raises NoIndependentFormula."""
        if SolidVerifier not in found.known:
            found.known[SolidVerifier] = solid_state(found.declared.thing, found.case, found.solution.mesh)
        known: SolidState = found.known[SolidVerifier]
        return known

    def cells(self, answer: SolutionUnderTest) -> int:
        """Return the number of cells of the mesh, whether or not forces are checked in them."""
        return super().cells(answer) if answer.mesh is None else len(answer.mesh.cells)

    # ------------------------------------------------------------------ discretisation

    def discretisation(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the discretisation error from finer cells, or from coarser meshes. Raises NoErrorEstimate."""
        try:
            return self._error_from_finer_space(answer, seen)
        except NoErrorEstimate as unknown:
            why = str(unknown)
        if why == NOT_ASKED:
            raise NoErrorEstimate(why)
        try:
            return self._error_from_coarser_meshes(answer, seen)
        except NoErrorEstimate as unknown:
            raise NoErrorEstimate(f"{why}; {unknown}" if why and why != str(unknown) else str(unknown)) from unknown

    def _error_from_finer_space(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the discretisation error from the distance to a solution on a finer space. Raises NoErrorEstimate."""
        fine: ProbeResultUnderTest
        leaves = self._error_ratio(answer)
        if isinstance(seen, FrequencyUnderTest):
            fine = replace(seen, vibrations=lambda count: self._finer_space_frequencies(answer, count))
        else:
            solution, leaves = self._finer_solution(answer, seen)
            fine = seen.of(solution)
        apart = fine.change(seen)
        if apart > TRIFLE * fine.size:
            apart = max(apart, CHANCE * self._distance_near_point(answer, seen))
        if seen.is_about_forces and (answer.case.contacts or answer.case.pairs):
            farther, ratio = self._change_from_coarser_mesh(
                answer, seen
            )  # the edge of contact in its cell may hide a difference
            apart = max(apart, farther / ratio**HIGHEST)
        if isinstance(seen.metric, TensorMetric) and apart > TRIFLE * fine.size:
            leaves = max(leaves, self._factor_by_observed_order(answer, seen, apart))
        size = max(fine.comparison_scale(apart), fine.acting)
        left = leaves * apart
        if not left <= HOPELESS * size:
            raise NoErrorEstimate(
                "the mesh is too coarse for an error estimate: the solution on a finer space differs by "
                f"{100 * apart / (size or apart):.3g} %"
            )
        if isinstance(seen.metric, ContactArea):
            from softmark.interpreter.verification.contact_error import contact_edge_error

            left = max(left, FINE_EDGE * contact_edge_error(seen.metric, fine))
        return left

    def _factor_by_observed_order(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest, apart: float) -> float:
        """Return the factor that turns the distance to the finer space into the error, by the observed order.

        The order follows from `apart`, the distance to the finer space, and the change from a coarser mesh. It is
        only used for slow convergence, since stresses at surfaces and edges may converge more slowly than the
        element's own factor assumes. Returns 0 without a coarser mesh, and if the coarser mesh is closer than the
        finer space: such meshes are too coarse or agree by chance, and show no order.
        """
        farther, ratio = self._change_from_coarser_mesh(answer, seen)
        if farther < apart:
            return 0.0
        order = max(math.log(farther / apart) / math.log(ratio), LEAST)
        return 1.0 / -math.expm1(-order * math.log(FINER))

    def _change_from_coarser_mesh(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> tuple[float, float]:
        """Return the change of a result from a coarser mesh, in the unit of its metric, and the ratio of cell sizes.

        The change is 0 without a coarser mesh.
        """
        try:
            (coarse, ratio), *_ = self.coarser(answer)
            return seen.change(seen.of(coarse)), ratio
        except NoErrorEstimate:
            return 0.0, FINER

    def _distance_near_point(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the distance to the finer space at nodes of the cells around the metric's point, in the metric's unit.

        At one point two inaccurate meshes may agree by chance where their difference changes sign, but not at all nodes
        around it. The distance is zero for metrics that are not about a single point.
        """
        mesh, tensors = answer.mesh, seen.is_tensor_at_point
        if mesh is None or not (seen.is_single_displacement or tensors):
            return 0.0
        X, cells = mesh.mesh.points, mesh.mesh.cells
        nearest = int(np.linalg.norm(X - seen.X[-1], axis=1).argmin())
        nodes = np.unique(cells[(cells == nearest).any(axis=1)])
        solution, _ = self._finer_solution(answer, seen)
        if tensors:
            return seen.around(X[nodes], solution)
        fine = solution.displacement
        assert fine is not None
        return seen.rms_displacement_change(np.asarray(fine(X[nodes])) - mesh.displacement[nodes])

    def is_singular(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> bool:
        """Return whether refinement barely reduces the stress jump between cells where the metric is evaluated.

        Where a stress grows like r^-a, halving the cells multiplies that jump by 2^a; where it is smooth, by 1/2 or
        less. Measured: 0.75 to 1.8 in a corner of 270 degrees, 0.04 to 0.6 where a stress has a limit. Returns False
        for a mean, and True if the jumps are not known.
        """
        metric: Any = seen.metric
        if metric.over == "mean":
            return False
        try:
            fine = seen.of(self._finer_solution(answer, seen)[0])
        except NoErrorEstimate:
            return True
        if seen.stress is None or fine.stress is None:
            return True
        own, finer = seen.stress(), fine.stress()
        place = int(np.abs(metric.values(finer.at(seen.X))).argmax())
        X = seen.X[place : place + 1]
        return bool(finer.unresolved(X)[0] > AGREEING * own.unresolved(X)[0])

    def _error_ratio(self, answer: SolutionUnderTest) -> float:
        """Return the ratio of the error to the distance to the finer space.

        The ratio is larger for nearly incompressible quadratic cells, which have too few displacements and lose an
        order.
        Source: Babuska and Suri 1992, "Locking effects in the finite element approximation of elasticity problems".
        """
        thing: Fem = answer.solid.thing
        element = find_element(thing.element)
        full = thing.integration == "full" and thing.formulation == "displacement"
        tight = full and element.order > 1 and not answer.own.material.thin and _largest_poisson(answer) >= TIGHT
        return element.leaves * (LOST if tight else 1.0)

    def _finer_state(self, answer: SolutionUnderTest) -> finer_space_error.FinerState:
        """Return the solved state of the finer space, computed once. Raises NoErrorEstimate."""
        own = (answer.scene, answer.solid, answer.own)

        def find() -> finer_space_error.FinerState:
            with answer.budget.reserving(answer.reserved_solution_cost):
                solved = answer.require_deformed_mesh(
                    SYSTEM * FINER**answer.dimension * answer.setup_and_solve_fraction
                )
                return finer_space_error.solve_finer_space(*own, solved, answer.tangent, answer.budget)

        above: finer_space_error.FinerState = answer.once("above", find)
        return above

    def _finer_solution(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> tuple[Solution, float]:
        """Return a solution on finer cells, and the ratio of the error to the distance from that solution.

        With deformation history or contacts, the finer model is solved from the undeformed state, otherwise from the
        known solution. Raises NoErrorEstimate.
        """
        nearby = not (seen.is_about_forces or _needs_full_solve(answer, seen))
        if nearby and not (answer.case.contacts or answer.case.pairs):
            return self._finer_state(answer).solution, self._error_ratio(answer)
        try:
            return self._solve_finer_model(answer)
        except BudgetExceeded:
            if nearby and answer.asked:
                return self._finer_state(answer).solution, self._error_ratio(answer)
            raise

    def _solve_finer_model(self, answer: SolutionUnderTest) -> tuple[Solution, float]:
        """Return a solution on finer cells, solved from the start, and the ratio of the error to the distance to it.

        Raises NoErrorEstimate.
        """
        case, dimension = answer.own, answer.dimension
        analysis: Any = case.analysis
        explicit = isinstance(analysis, Dynamic) and analysis.explicit
        if explicit:  # finer cells need shorter steps
            case = replace(case, analysis=replace(analysis, step=0.5 * analysis.step))
        costs = UNSURE * (2.0 if explicit else 1.0)
        with answer.budget.reserving(answer.reserved_solution_cost):
            nested = costs * FINER**dimension
            sized = answer.solid.thing.size is not None
            if answer.choose_for_all_states(
                "nested", not sized or nested * answer.budget.solution <= answer.budget.left
            ):
                model, make = finer_space_error.finer_cells(answer.solid.thing, case, answer.require_deformed_mesh())
                declared = replace(answer.solid, thing=model)
                return answer.solve_other_model("finer cells", declared, case, nested, mesh=make)[0], self._error_ratio(
                    answer
                )
            costs *= SOMEWHAT**dimension
            solution, size = answer.solve_other_model("finer mesh", answer.sized(1.0 / SOMEWHAT), case, costs)
        ratio = (size["elements"] / self.cells(answer)) ** (1.0 / dimension)
        if ratio < NEAR:
            raise NoErrorEstimate("a smaller cell size gives the same mesh")
        return solution, error_from_finer(1.0, ratio, self._order(answer))

    def _order(self, answer: SolutionUnderTest) -> float:
        """Return the convergence order assumed for displacements, or for the fluid pressure of a porous body."""
        return SEEPING if answer.case.porous else min(float(answer.solid.thing.order), HIGHEST)

    def _finer_displacement_field(self, answer: SolutionUnderTest) -> CachedField:
        found: CachedField = self._finer_state(answer).solution.displacement  # type: ignore[assignment]
        return found

    def _finer_space_frequencies(self, answer: SolutionUnderTest, count: int) -> Floats:
        def find() -> Floats:
            coarse, known = answer.tangent()
            return self._finer_state(answer).frequencies(coarse, answer.state, known, count)

        found: Floats = answer.once(f"tones {count}", find)
        return found

    def _error_from_coarser_meshes(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the discretisation error from one or two coarser meshes. Raises NoErrorEstimate."""
        thing: Fem = answer.solid.thing
        if not answer.own.material.thin and thing.locks_at(_largest_poisson(answer)):
            raise NoErrorEstimate("the element locks at this Poisson's ratio, so coarser meshes share the same error")
        order = SEEPING if answer.case.porous else float(thing.order)
        return error_from_coarser(self.coarser(answer), seen, order, answer)

    def remaining_load_error(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest, missing: float) -> float:
        """Return the part of the relative load error `missing` that the finer space has as well.

        The error estimate by the finer space does not include this part.
        """
        if _needs_full_solve(answer, seen):
            return missing
        try:
            finer = self._finer_state(answer).missed_load_fractions
        except NoErrorEstimate:
            return missing
        own = {name: load.missing for name, load in answer.result.loads.items()}
        return max((max(0.0, 2.0 * left - own[name]) for name, left in finer.items() if name in own), default=missing)

    # ------------------------------------------------------------------ strain measure

    def model(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the difference from the same model with the best strain measure that its material allows.

        Raises NoErrorEstimate.
        """
        thing: Fem = answer.solid.thing
        best = self._best_field_changes(answer, thing)
        if best == {}:
            return 0.0
        if _needs_full_solve(answer, seen):
            return self._history_measure_distance(answer, seen, thing, best)
        apart = self._distance_to_best_measure(
            answer, seen, thing, best
        )  # before a finer space takes what is left to spend
        return ALIKE * self._strain_error_growth(answer, seen) * apart if apart > 0.0 else 0.0

    def _history_measure_distance(
        self, answer: SolutionUnderTest, seen: ProbeResultUnderTest, thing: Fem, best: Mapping[str, Any]
    ) -> float:
        """Return the difference from the best strain measure for history-dependent states. Raises NoErrorEstimate.

        It is computed on the model's own mesh, or else on a coarser one. If neither can be solved, it is bounded by
        the strain and the square of the rotations, which the small-strain measure neglects.
        """
        try:
            answer.budget.must_hold(PLENTY)
            with answer.budget.reserving(answer.reserved_solution_cost):
                return ALIKE * self._distance_to_best_measure(answer, seen, thing, best)
        except NoErrorEstimate as unknown:
            if str(unknown) == NOT_ASKED:
                raise
        try:
            return THEORY * self._coarse_measure_distance(answer, seen, best)
        except NoErrorEstimate:
            return self._strain_measure_bound(answer) * seen.size

    def _strain_measure_bound(self, answer: SolutionUnderTest) -> float:
        """Return a bound of the relative error of the strain measure, computed from the strain of the solution.

        Raises NoErrorEstimate.
        """
        strain = (answer.result.solve.get("checks") or {}).get("largest_strain")
        if strain is None or THEORY * strain > HOPELESS:
            raise NoErrorEstimate(
                "the model with another strain measure took too long to solve, and its strain is not small"
            )
        return THEORY * float(strain)

    def _best_field_changes(self, answer: SolutionUnderTest, thing: Fem) -> dict[str, Any]:
        """Return the changes of fields that give the model its best strain measure; empty if it already has that."""
        whole = answer.own  # with the material that the model takes: another law is another question
        materials = whole.materials
        finite = [material.finite_law() is not None for material in materials]
        if any(finite) and not all(finite):
            raise NoErrorEstimate("no strain measure is the most accurate one for all its materials")
        strain = "finite" if all(finite) else "corotational"
        best: dict[str, Any] = {"strain": strain, "rotation": "point"}
        best |= {"mass": "consistent"} if thing.mass == "uniform" else {}
        if thing.integration == "selective" and strain == "finite" and any(m.finite_parts() is None for m in materials):
            best["integration"] = "full"
        return best if any(getattr(thing, n) != v for n, v in best.items()) else {}

    def _distance_to_best_measure(
        self, answer: SolutionUnderTest, seen: ProbeResultUnderTest, thing: Fem, best: Mapping[str, Any]
    ) -> float:
        """Return the difference from the result with the best strain measure on the same mesh. Raises NoErrorEstimate.

        Both solutions treat the volume in the same way.
        """
        own, alike = seen, self._common_volume_treatment(answer, thing, best)
        right = self._probe_changed_model(answer, seen, "best", thing, **best, **alike)
        if alike:
            own = self._probe_changed_model(answer, seen, "alike", thing, **alike)
        apart = right.change(own)
        if not apart <= HOPELESS * right.comparison_scale(apart):
            raise NoErrorEstimate("the most accurate strain measure for its material gives a very different solution")
        return apart

    def _common_volume_treatment(
        self, answer: SolutionUnderTest, thing: Fem, best: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the fields for a volume treatment that suits both strain measures; empty if none must change.

        Averaging the volume over cells would affect the two laws differently.
        """
        materials = answer.own.materials
        split = all(material.finite_parts() is not None for material in materials)
        if thing.formulation == "mean_dilatation" and best["strain"] == "finite" != thing.strain and split:
            return {"formulation": "displacement", "integration": "selective"}
        return {}

    def _probe_changed_model(
        self, answer: SolutionUnderTest, seen: ProbeResultUnderTest, key: str, thing: Fem, **changes: Any
    ) -> ProbeResultUnderTest:
        """Return the results of the same probe for a changed model on the same mesh. Raises NoErrorEstimate."""
        other = replace(answer.solid, thing=thing.plain(**changes))
        if _needs_full_solve(answer, seen) or isinstance(seen, FrequencyUnderTest):  # which needs its modes
            return seen.of(answer.solve_other_model(f"{key} at rest", other, case_for(answer.scene, other))[0])
        own = (answer.scene, other, case_for(answer.scene, other))
        found: Solution = answer.once(
            key,
            lambda: finer_space_error.solve_on_same_mesh(
                *own, answer.require_deformed_mesh(0.5), answer.tangent, answer.budget
            ),
        )
        return seen.of(found)

    def _strain_error_growth(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the factor by which the error of the strain measure grows from the model's mesh to the finer space.

        The error grows with the square of the displacement, which a mesh that is too stiff underestimates.
        """
        if seen.is_about_forces:
            return 1.0
        try:
            fine = seen.at(self._finer_displacement_field(answer))
        except NoErrorEstimate:
            return 1.0
        own = float(np.linalg.norm(seen.u))
        return max(1.0, (float(np.linalg.norm(fine.u)) / own) ** 2) if own > 0.0 else 1.0

    def _coarse_measure_distance(
        self, answer: SolutionUnderTest, seen: ProbeResultUnderTest, best: Mapping[str, Any]
    ) -> float:
        """Return the difference between the model's strain measure and the best one, both on a coarser mesh.

        It is scaled up by the square of the displacements, because the coarser mesh moves less. Raises
        NoErrorEstimate.
        """
        (solution, _), *_ = self.coarser(answer)
        better, own = answer.sized(FINER, **best), seen.of(solution)
        found = seen.of(answer.solve_other_model("best coarser", better, case_for(answer.scene, better), COARSER)[0])
        moved, less = float(np.linalg.norm(seen.u)), float(np.linalg.norm(own.u))
        grown = max(1.0, moved / less) ** 2 if less > 0.0 else 1.0
        return grown * found.change(own)


VERIFIER = SolidVerifier()
