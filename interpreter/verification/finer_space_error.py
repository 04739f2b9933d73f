"""Error estimate by a finer space over the model's own cells, solved from the model's solution.

Four-node tetrahedra get ten nodes; other cells are divided into eight. No coarser mesh is needed, so the
estimate also works for mesh files. Nearly incompressible hexahedra with pointwise volume terms are compared
with hexahedra of mean volume, because finer hexahedra of their own kind lock too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark import resource_limits
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.postprocessing.mesh_stress import stress_of
from softmark.interpreter.models.shared import interaction_setup
from softmark.interpreter.models.shared.material_regions import representative_materials
from softmark.interpreter.models.shared.prepared_model import BuildContext, DeformedMesh, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.estimation_budget import Budget
from softmark.interpreter.verification.probe_errors import CachedField, Floats, NoErrorEstimate
from softmark.records import dataclass
from softmark.solvers.elements import element_of, finer_element

if TYPE_CHECKING:
    from softmark.interpreter.models.fem.fem_builder import PreparedSolid
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.linear.factorisations import Factor
    from softmark.solvers.mesh.mesh_refinement import FinerSpace
    from softmark.solvers.statics.finer_space_solve import CoarseLevel

SHARE = 0.6  # share of free memory that a finer space may use
MORE = 2  # extra modes, since their order may change on finer cells
FACTORS = 1.8  # exponent of the unknowns in the cost of factors, between those of meshes in 2D and in 3D
UNMATCHED = "the cells of the mesh do not match across their faces"
FREED = 0.4  # Poisson's ratio from which hexahedra lock visibly on finer meshes too


@dataclass(frozen=True)
class FinerState:
    """Solution on the finer space: model, mesh, problem and displacements (dofs,), m.

    `coarse` returns the coarse level of the preconditioner.
    """

    model: Fem
    case: Case
    space: FinerSpace
    static: PreparedSolid
    state: Floats
    coarse: Callable[[], CoarseLevel]
    budget: Budget

    @cached_property
    def solution(self) -> Solution:
        """Displacements, stress and nodal forces in the finer space, as for any other solution."""
        return solution_of_state(self.static, self.case, self.state)

    @cached_property
    def missed_load_fractions(self) -> Mapping[str, float]:
        """Fraction of each surface load that the finer mesh may miss, by name of the load."""
        from softmark.interpreter.problem.surface_selection.load_resultants import resultants

        return {name: r.missing for name, r in resultants(self.case, self.static).items() if r.area is not None}

    @cached_property
    def solver(self) -> tuple[Any, Any]:
        """Tangent of the finer space in its solved state, and a linear solver for it."""
        from softmark.solvers.statics.finer_space_solve import tangent_solver

        return tangent_solver(self.static.problem.assembly, self.state, self.coarse, self.budget.check)

    def frequencies(self, coarse: Assembly, x: Floats, known: Factor, count: int) -> Floats:
        """Return the `count` frequencies, Hz, of the finer space near those of the coarse state x.

        `known` is a factor of the coarse tangent. Raises NoErrorEstimate.
        """
        from softmark.interpreter.models.postprocessing.vibrations import free_mass_matrix
        from softmark.solvers.dynamics.vibration_modes import ModesNotFound, lowest_modes
        from softmark.solvers.linear.factorisations import Singular
        from softmark.solvers.statics.finer_space_solve import StateLost, lowest_squared_frequencies

        try:
            M, P = free_mass_matrix(self.static.mass(), self.static.problem.assembly), self.coarse().P
            taken = max(count, min(count + MORE, len(coarse.free) // 2 - 1))
            left = self.budget.left
            modes = P @ lowest_modes(coarse.tangent(x, 1.0), (P.T @ M @ P).tocsr(), taken, lambda: known)[1]
            self.budget.add_solution_time(left - self.budget.left)
            values = lowest_squared_frequencies(*self.solver, M, modes)[:count]
        except (ModesNotFound, StateLost, Singular, Undefined) as error:
            raise NoErrorEstimate(str(error) or "the finer space has no vibration modes") from error
        if not values[0] > 0.0:
            raise NoErrorEstimate("the state is unstable on the finer space, so there is no lowest frequency")
        found: Floats = np.sqrt(values) / (2.0 * np.pi)
        return found


def solve_finer_space(
    scene: Scene, declared: Declared, case: Case, solved: DeformedMesh, below: Callable[[], Any], budget: Budget
) -> FinerState:
    """Solve the finer space near the nodal displacements of the deformed mesh `solved`. Raises NoErrorEstimate.

    `below` returns the assembly of the coarse space and a factor of its tangent.
    """
    from softmark.interpreter.models.fem.fem_builder import build_static
    from softmark.solvers.linear.factorisations import Singular
    from softmark.solvers.mesh.mesh_refinement import UnmatchedFaces, build_finer_space, estimate_memory
    from softmark.solvers.statics.finer_space_solve import CoarseLevel, StateLost, solve_on_finer_space
    from softmark.solvers.statics.static_equilibrium import NotConverged, equilibrium

    model: Fem = declared.thing
    _require_free_memory(estimate_memory(solved.mesh))
    try:
        above = build_finer_space(solved.mesh, None if model.mesh is not None else case.shape)
        thing = _locking_free_model(model, representative_materials(case, solved.mesh), above.mesh.kind)
        budget.check()
        static, _ = build_static(thing, replace(declared, thing=thing), case, BuildContext(scene=scene), above.mesh)
        problem = static.problem
        x = static.unknowns.start_state(above.interpolate_displacements(solved.displacement).ravel())
        assert x is not None
        x[problem.fixed] = problem.target
        static = interaction_setup.recenter_stabilization(static, x)
        problem = static.problem
        _require_affordable_tangent(problem.assembly, solved, budget)
        coarse = _LazyValue(lambda: CoarseLevel.of(above.P, below()[0], problem.assembly, below()[1]))
        if problem.assembly.saddle:  # pressures start from zero, so the first step says little
            state = equilibrium(replace(problem, start=x, watch=budget.check)).x
        else:
            state = solve_on_finer_space(problem.assembly, x, coarse, budget.check)
    except NotConverged as error:
        raise NoErrorEstimate(
            f"no equilibrium was found on the finer space near this state ({error.reason})"
        ) from error
    except (UnmatchedFaces, StateLost, Singular) as error:
        raise NoErrorEstimate(str(error) or UNMATCHED) from error
    if not problem.sound(state):
        raise NoErrorEstimate("cells of the finer space are inverted")
    return FinerState(thing, case, above, static, state, coarse, budget)


def finer_cells(model: Fem, case: Case, solved: DeformedMesh) -> tuple[Fem, Callable[[], Any]]:
    """Return the same model over the cells of a finer space, and a function that makes its mesh.

    Raises NoErrorEstimate if it takes too much memory.
    """
    from softmark.solvers.mesh.mesh_refinement import UnmatchedFaces, build_finer_space, estimate_memory

    _require_free_memory(estimate_memory(solved.mesh))

    def make() -> Any:
        """Return the mesh of the finer space."""
        try:
            return build_finer_space(solved.mesh, None if model.mesh is not None else case.shape).mesh
        except UnmatchedFaces as error:
            raise NoErrorEstimate(str(error) or UNMATCHED) from error

    kind = finer_element(solved.mesh.element).name
    return _locking_free_model(model, representative_materials(case, solved.mesh), kind), make


def _require_affordable_tangent(assembly: Assembly, solved: DeformedMesh, budget: Budget) -> None:
    """Raise BudgetExceeded if factorising the finer tangent exceeds the remaining budget.

    The cost grows with a power of the number of unknowns.
    """
    from softmark.solvers.statics.finer_space_solve import SMALL, uses_direct_solver

    if uses_direct_solver(assembly) and len(assembly.free) > SMALL:
        budget.must_hold((assembly.dofs / solved.displacement.size) ** FACTORS)


def _require_no_friction(case: Case) -> None:
    if case.has_friction:
        raise NoErrorEstimate("friction depends on the earlier states, which were not computed on the finer space")


def _require_free_memory(needed: float) -> None:
    """Raise NoErrorEstimate if a finer space needs more than its allowed fraction of the free memory."""
    free = resource_limits.available_memory()
    if needed > SHARE * free:
        gigabytes = f"about {needed / 1e9:.2g} GB of memory, and {max(free, 0.0) / 1e9:.2g} GB are free"
        raise NoErrorEstimate(f"a solution on the finer space would need {gigabytes}")


def displacement_field(model: Fem, case: Case, mesh: DeformedMesh) -> CachedField:
    """Return the displacement field that a model found on a mesh."""
    from softmark.interpreter.models.shared.deformed_mesh import displacement_of

    return CachedField(displacement_of(mesh.mesh, mesh.displacement), stress_of(model, case, mesh), {})


def _locking_free_model(model: Fem, materials: tuple[Any, ...], kind: str) -> Fem:
    """Return the model for the finer cells, with an element that does not lock in place of one that does."""
    from softmark.solvers.materials import mixed_for

    thing = model.plain(element=kind)
    full = model.integration == "full" and model.formulation == "displacement" and model.rotation == "point"
    freed = "mean_dilatation" in element_of(kind).formulations
    tight = max(m.poisson for m in materials) >= FREED
    if freed and full and tight and all(mixed_for(m, model.strain) for m in materials):
        return replace(thing, formulation="mean_dilatation")
    return thing


class _LazyValue:
    """Value that a function computes on first use."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._make, self._made = make, None

    def __call__(self) -> Any:
        if self._made is None:
            self._made = self._make()
        return self._made


def solution_of_state(static: PreparedSolid, case: Case, state: Floats) -> Solution:
    """Return the solution of a solid in a given state: displacements anywhere, stress and nodal forces."""
    from softmark.interpreter.models.postprocessing.reaction_and_work import forces_and_energies
    from softmark.interpreter.models.shared.deformed_mesh import DeformedBody

    pressures = static.unknowns.cell_pressures(static.solid, static.pieces, state)
    mesh = DeformedBody(static.mesh, static.unknowns.moved(state).reshape(-1, 3), pressures=pressures)
    field = displacement_field(static.model, case, mesh)
    found = Solution(
        "converged", None, {}, field, stress=field.stress, carried=cache(lambda: static.nodal_forces_in_state(state))
    )
    return replace(
        found, at_rest=forces_and_energies(replace(static.declared, thing=static.model), case, static, found)
    )


def solve_on_same_mesh(
    scene: Scene, declared: Declared, case: Case, solved: DeformedMesh, tangent: Callable[[], Any], budget: Budget
) -> Solution:
    """Solve another model on the mesh `solved`, starting from its state. Raises NoErrorEstimate.

    `tangent` returns the assembly of the solved model and a factor of its tangent. Iterations with that factor find a
    nearby state; only where they fail, Newton's method computes new tangents.
    """
    from softmark.interpreter.models.fem.fem_builder import build_static
    from softmark.solvers.statics.finer_space_solve import StateLost, solve_with_known_tangent
    from softmark.solvers.statics.static_equilibrium import NotConverged, equilibrium

    _require_no_friction(case)
    static, _ = build_static(declared.thing, declared, case, BuildContext(scene=scene), solved.mesh)
    u = np.ascontiguousarray(solved.displacement, dtype=np.float64).ravel()
    try:
        own, known = tangent()
        if own.dofs == static.problem.assembly.dofs and not case.contacts:
            return solution_of_state(
                static, case, solve_with_known_tangent(static.problem.assembly, u, known, budget.check)
            )
    except (NoErrorEstimate, StateLost):
        pass  # Newton's method below
    try:
        result = equilibrium(replace(static.problem, start=static.unknowns.start_state(u), watch=budget.check))
    except NotConverged as error:
        raise NoErrorEstimate(
            f"the same model with its most accurate strain measure has no solution ({error.reason})"
        ) from error
    return solution_of_state(static, case, result.x)
