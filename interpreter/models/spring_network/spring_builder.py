"""Construction and solution of spring networks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem.fem_mesh import mesh_of
from softmark.interpreter.models.postprocessing import nodal_forces
from softmark.interpreter.models.postprocessing.vibrations import frequencies_about
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.deformed_mesh import DeformedBody, displacement_of
from softmark.interpreter.models.shared.load_setup import mass_matrix, merge_loads, single_loads
from softmark.interpreter.models.shared.mesh_based_model import MeshBasedModel
from softmark.interpreter.models.shared.mesh_notes import filled_notes, mesh_facts, sliver_note, volume_note
from softmark.interpreter.models.shared.perturbed_start import Disturbance, disturbance_of, recover_spring_equilibrium
from softmark.interpreter.models.shared.prepared_model import BuildContext, DeformedMesh, Prepared, Solution
from softmark.interpreter.models.shared.support_constraints import solid_supports
from softmark.interpreter.models.shared.support_selection import support_selection_warnings
from softmark.interpreter.models.spring_network.spring_declaration import Calibrated, MassSpring, Uniform
from softmark.interpreter.models.spring_network.stiffness_calibration import (
    Fit,
    FitTarget,
    NoFit,
    minimize_error,
    target_of,
)
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy, Floats, VectorSpace
from softmark.solvers.energies.spring_energy import Springs, stiffness_from_modulus
from softmark.solvers.linear import factorisations
from softmark.solvers.materials.small_strain import SmallStrain
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.spring_edges import SpringNetwork, build_spring_network
from softmark.solvers.statics.static_equilibrium import Equilibrium, Iteration, NotConverged, Statics, equilibrium

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape
    from softmark.solvers.statics.static_equilibrium import Watch

PATIENCE = 60  # Newton iterations of a trial; a network that does not collapse takes six to ten


@dataclass(frozen=True)
class PreparedSprings(MeshBasedModel):
    """Spring network: its mesh, its springs, its static problem, and the result of fitting its stiffness."""

    model: MassSpring
    declared: Declared
    shape: Shape
    mesh: Mesh
    parts: IntegrationPoints
    springs: Springs
    problem: Statics
    size: dict[str, int]
    notes: tuple[Diagnostic, ...]
    target: FitTarget | None = None
    fit: Fit | NoFit | None = None
    disturbance: Disturbance | None = None
    before: Floats | None = None  # nodal displacements (3 n,) of the previous state, m, used as start
    applied: tuple[tuple[Declared, Energy], ...] = ()  # each load separately
    density: float = 0.0  # kg/m^3

    def warm(self) -> None:
        """Compile or load all kernels, before timing starts."""
        with factorisations.warm_up_in_parallel(len(self.problem.assembly.pattern.indices)):
            warm_kernels()

    @property
    def assembly(self) -> Assembly:
        """Energies of springs and loads in terms of nodal displacements."""
        return self.problem.assembly

    def after(self, before: DeformedMesh) -> PreparedSprings:
        """Return the network with the previous state as its start; the network itself if it has a perturbed start."""
        return self if self.disturbance else replace(self, before=np.ravel(before.displacement))

    def solve(self, watch: Watch) -> Solution:
        """Return the static equilibrium, starting from rest or from the previous state."""
        if self.failure:
            return Solution("not_converged", self.failure, self.model_facts)
        problem = replace(self.problem, watch=watch, start=self.before)
        remedy = "use a smaller load, stiffer springs or another mesh: the network may have collapsed"
        solution = static_result.solve_static(
            lambda: self._find_equilibrium(problem), remedy, self._make_solution, self._describe_free_motion
        )
        return replace(solution, facts=solution.facts | self.model_facts | mesh_facts(self.mesh))

    def _find_equilibrium(self, problem: Statics) -> Equilibrium:
        """Return the equilibrium from rest, or from a perturbed start. Raises NotConverged."""
        if self.disturbance is None:
            return equilibrium(problem)
        cells = Elastic(self.mesh.cells, self.parts.dNdX, self.parts.w, SmallStrain(1.0, 1.0))
        return recover_spring_equilibrium(self.disturbance, problem, self.mesh.points, cells)

    def _describe_free_motion(self, d: Floats) -> str:
        """Return a description of a motion d (dofs,) that no spring resists."""
        return static_result.describe_free_motion(self.mesh.points, d.reshape(-1, 3))

    def _make_solution(self, found: Equilibrium) -> Solution:
        """Return the solution of an equilibrium, with its report and warnings."""
        solution = static_result.solution_of(found, displacement_of(self.mesh, found.x.reshape(-1, 3)))
        doubts = (*self._inverted_cell_warnings(found.x), *static_result.uniqueness_warnings(self.declared, found))
        modes = frequencies_about(self.problem.assembly, found.x, self.mass, self.problem.linear)
        moved = DeformedBody(self.mesh, found.x.reshape(-1, 3))
        seen = replace(solution, notes=doubts, mesh=moved, vibrations=modes if found.solved else None)
        return replace(seen, carried=cache(lambda: self._nodal_forces(found.x)))

    def mass(self) -> Floats:
        """Masses of the degrees of freedom (3 n,), kg."""
        found: Floats = mass_matrix(self.mesh, self.parts, self.density, "lumped")
        return found

    def _nodal_forces(self, x: Floats) -> nodal_forces.NodalForces:
        """Return the nodal forces in a state x (3 n,)."""
        return nodal_forces.on_mesh(self.mesh, x, x, self.assembly, self.applied, small=False)

    def _inverted_cell_warnings(self, x: Floats) -> tuple[Diagnostic, ...]:
        """Return a warning if cells are inverted, which springs do not resist."""
        H = np.einsum("mai,mqaJ->mqiJ", x.reshape(-1, 3)[self.mesh.cells], self.parts.dNdX)
        count = int((np.linalg.det(np.eye(3) + H) <= 0).any(axis=1).sum())
        if not count:
            return ()
        cells = f"{count} of {len(self.mesh.cells)} cells"
        return (
            diagnostic(
                "W324",
                self.declared.at(),
                f"{cells} of `{self.declared.name}` are inverted",
                "inverted cells",
                "springs do not resist inversion; do not trust the displacements near these cells",
            ),
        )

    @property
    def failure(self) -> str:
        """Reason why the stiffness could not be fitted; empty if it could."""
        return f"its stiffness could not be calibrated: {self.fit.reason}" if isinstance(self.fit, NoFit) else ""

    @property
    def model_facts(self) -> dict[str, Any]:
        """Report of the springs and of the fit of their stiffness."""
        k = self.springs.k
        facts: dict[str, Any] = {"springs": {"count": len(k), "least_N_per_m": float(k.min()),
                                             "largest_N_per_m": float(k.max())}}  # fmt: skip
        if self.target is None or self.fit is None:
            return facts
        trials = [{"factor": c, "value": value} for c, value in self.fit.trials]
        fit = {"metric": self.target.name, "load": self.model.stiffness.load, "solves": len(trials),
               "trials": trials}  # fmt: skip
        if isinstance(self.fit, Fit):
            fit |= {"factor": self.fit.factor, "value": self.fit.value, "unit": self.target.unit}
        return facts | {"fit": fit}


def warm_kernels() -> None:
    """Compile the kernels of springs by evaluating a single spring."""
    one = Springs(np.array([[0, 1]]), np.array([[1.0, 0.0, 0.0]]), np.ones(1))
    small = Assembly(6, np.zeros(0, dtype=np.int64), [one], [])
    small.gradient(np.zeros(6), 1.0)
    small.tangent(np.zeros(6), 1.0)


def load(model: MassSpring) -> None:
    """Import the libraries that `prepare` needs, so that their import does not count as building time."""
    import softmark.solvers.mesh.structured_meshes  # noqa: F401

    if isinstance(model.stiffness, Calibrated):  # the solutions of the fit are part of the preparation
        warm_kernels()


def prepare(model: MassSpring, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the static or dynamic spring network, and fit its stiffness if it is calibrated. Raises Fault."""
    mesh = mesh_of(model.solid, declared, case, workshop)
    parts = integrate_cells(mesh)
    springs = springs_of(model, case, mesh, build_spring_network(mesh, model.diagonals))
    problem = statics_of(case, mesh, parts, springs, workshop.measured)
    size = {"nodes": len(mesh.points), "elements": len(springs.k), "dofs": len(problem.assembly.free)}
    notes = (
        *volume_note(declared, case, mesh),
        *sliver_note(declared, model.mesh or case.shape, mesh),
        *filled_notes(declared, case, mesh),
        *support_selection_warnings(declared, case, mesh),
    )
    shape = model.mesh or case.shape
    built = PreparedSprings(model, declared, shape, mesh, parts, springs, problem, size, notes)
    applied = single_loads(case, mesh, parts, small=False, mass="lumped")
    known = {"applied": (*applied,), "density": case.material.density}
    built = replace(built, disturbance=disturbance_of(case), **known)
    if isinstance(model.stiffness, Calibrated):
        built = _fit_stiffness(built, case, workshop)
    if built.failure or not isinstance(case.analysis, Dynamic):
        return built
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
    from softmark.interpreter.models.shared.solid_dynamics import solid_dynamics

    moving = solid_dynamics(declared, case, mesh, built.problem, built.mass(), built.applied)
    return DynamicAnalysis(built, declared, case, moving)


def springs_of(model: MassSpring, case: Case, mesh: Mesh, net: SpringNetwork) -> Springs:
    """Return the undeformed springs, with their stiffness before any fit."""
    D = mesh.points[net.edges[:, 1]] - mesh.points[net.edges[:, 0]]
    if isinstance(model.stiffness, Uniform):
        return Springs(net.edges, D, np.full(len(D), model.stiffness.value))
    k = stiffness_from_modulus(case.material.young, net.weight, np.linalg.norm(D, axis=1))
    return Springs(net.edges, D, k)


def statics_of(
    case: Case, mesh: Mesh, parts: IntegrationPoints, springs: Springs, measured: Mapping[str, Any]
) -> Statics:
    """Return the static problem of springs, with the supports and loads of a solid on the same mesh. Raises Fault."""
    fixed, target, way = solid_supports(case, mesh, measured)
    dofs = mesh.points.size
    loads = merge_loads(single_loads(case, mesh, parts, small=False, mass="lumped"), dofs)
    return Statics(
        Assembly(dofs, fixed, [springs], loads),
        VectorSpace(dofs),
        np.zeros(dofs),
        fixed,
        target,
        case.analysis.tolerance,
        case.analysis.max_iterations,
        extent=mesh.extent,
        path=case.analysis.path,
        way=way,
    )


# ------------------------------------------------------------------ fitting


def _fit_stiffness(built: PreparedSprings, case: Case, workshop: BuildContext) -> PreparedSprings:
    """Return the network with its stiffness multiplied by the fitted factor. Raises Fault."""
    if workshop.scene is None:
        raise fault(
            "E521",
            built.declared.at("stiffness"),
            f"`{built.declared.name}` was built without a scene, which its calibration needs",
        )
    target = target_of(workshop.scene, built.declared, case, workshop.measured)
    trial = statics_of(target.case, built.mesh, built.parts, built.springs, workshop.measured)
    fit = minimize_error(lambda factor: _metric_at_factor(factor, built, trial, target))
    if isinstance(fit, NoFit):
        return replace(built, target=target, fit=fit)
    springs = replace(built.springs, k=fit.factor * built.springs.k)
    problem = replace(built.problem, assembly=built.problem.assembly.with_internal([springs]))
    return replace(built, springs=springs, problem=problem, target=target, fit=fit)


def _metric_at_factor(factor: float, built: PreparedSprings, trial: Statics, target: FitTarget) -> float | None:
    """Return the metric of the network with its stiffness multiplied by a factor.

    The result is None if no equilibrium is found within PATIENCE iterations.
    """
    springs = replace(built.springs, k=factor * built.springs.k)
    assembly = trial.assembly.with_internal([springs])
    try:
        found = equilibrium(replace(trial, assembly=assembly, watch=_IterationLimit().watch))
    except NotConverged:
        return None
    return target.measure(displacement_of(built.mesh, found.x.reshape(-1, 3)))


@dataclass
class _IterationLimit:
    """Limit on the Newton iterations of one trial of the stiffness fit.

    A network that collapses may need hundreds of iterations.
    """

    iterations: int = 0

    def watch(self, iteration: Iteration) -> None:
        """Count an iteration. Raises NotConverged after PATIENCE iterations."""
        self.iterations += 1
        if self.iterations > PATIENCE:
            raise NotConverged("the network seems to have collapsed")
