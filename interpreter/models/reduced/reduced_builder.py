"""Construction and solution of reduced-order models."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.fem import fem_builder
from softmark.interpreter.models.fem.fem_builder import PreparedSolid
from softmark.interpreter.models.procedures.derived_model import DerivedModel
from softmark.interpreter.models.reduced.reduced_declaration import PARTS, Modal, Pod
from softmark.interpreter.models.reduced.reduced_space import (
    Basis,
    FullModelAtRest,
    gradient_of,
    modal_space,
    pod_space,
)
from softmark.interpreter.models.reduced.training_states import (
    Training,
    extrapolation_warnings,
    is_in_training_set,
    scene_of,
    train,
    values_outside_training,
)
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.deformed_mesh import MeshData, displacement_of
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.problem.body_case import Case, case_for, fault
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats, Ints, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure, ScaledLoad
from softmark.solvers.linear.factorisations import Singular
from softmark.solvers.model_reduction.cell_energies import restrict_to_cells, restrict_to_loaded_nodes
from softmark.solvers.model_reduction.hyperreduction import CellSample, sample_cells
from softmark.solvers.model_reduction.projected_energy import DenseSolver, ProjectedEnergy, QuadraticEnergy
from softmark.solvers.model_reduction.reduction_error import ReducedMotion, dynamic_error, static_error
from softmark.solvers.statics.static_equilibrium import Equilibrium, NotConverged, Statics, equilibrium

if TYPE_CHECKING:
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
    from softmark.interpreter.models.procedures.dynamic_discretization import DisplacementField, MotionFields
    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.dynamics.integrator import Motion
    from softmark.solvers.statics.static_equilibrium import Watch

IDLE = 1e-9  # of the loads: smallest part that must act along the fields of the basis
NONE: Ints = np.zeros(0, dtype=np.int64)


# ------------------------------------------------------------------ the equations in the space


@dataclass(frozen=True)
class Equations:
    """Reduced equations: energies in terms of the coefficients of a basis, from all cells or from sampled cells."""

    static: PreparedSolid
    basis: Basis
    sample: CellSample | None = None

    @property
    def unknown_count(self) -> int:
        """Number of unknowns, including the one that scales imposed displacements."""
        return int(self.basis.fields.shape[1])

    @cached_property
    def cells(self) -> Ints:
        """Indices of the cells that are evaluated."""
        return np.arange(len(self.static.mesh.cells)) if self.sample is None else self.sample.cells

    @cached_property
    def nodes(self) -> Ints:
        """Indices of the nodes of evaluated cells."""
        return np.unique(self.static.mesh.cells[self.cells])

    def _rows(self, nodes: Ints) -> Floats:
        """Return the rows of the basis at the displacements of these nodes."""
        fields = self.basis.fields.reshape(-1, 3, self.unknown_count)
        return np.ascontiguousarray(fields[nodes].reshape(-1, self.unknown_count))

    def _restrict_to_evaluated_cells(self, energy: Energy) -> Energy:
        """Return an energy restricted to the evaluated cells, with their weights."""
        weights = np.ones(len(self.cells)) if self.sample is None else self.sample.weights
        return restrict_to_cells(energy, self.cells, weights, self.nodes)

    def internal(self, energies: Sequence[Energy]) -> list[Energy]:
        """Return the energies of cells in terms of reduced unknowns."""
        found: list[Energy] = [
            ProjectedEnergy(self._restrict_to_evaluated_cells(e), self._rows(self.nodes)) for e in energies
        ]
        if self.static.model.strain != "small":
            return found
        whole = Assembly(self.unknown_count, NONE, found, [])
        zero = np.zeros(self.unknown_count)
        return [QuadraticEnergy(whole.tangent(zero, 0.0).toarray(), whole.rounding(zero))]

    def load(self, load: Energy) -> Energy:
        """Return a load in terms of reduced unknowns, evaluated exactly as in the full model."""
        if isinstance(load, DeadForces):
            return DeadForces(load.f @ self.basis.fields)
        if isinstance(load, FollowerPressure):
            own, nodes = restrict_to_loaded_nodes(load)
            return ProjectedEnergy(own, self._rows(nodes))
        return ProjectedEnergy(load, self.basis.fields)

    def assembly(self, internal: Sequence[Energy], loads: Sequence[Energy]) -> Assembly:
        """Return energies and loads of the full model in terms of reduced unknowns; imposed displacements are held."""
        return Assembly(self.unknown_count, self.fixed, self.internal(internal), [self.load(load) for load in loads])

    @property
    def fixed(self) -> Ints:
        """Index of the unknown that scales imposed displacements, the last one; empty if nothing is imposed."""
        return NONE if self.basis.lift is None else np.array([self.unknown_count - 1])

    def sound(self) -> Any:
        """Function that tests whether no evaluated cell is inverted."""
        elastic: Any = restrict_to_cells(self.static.elastic, self.cells, np.ones(len(self.cells)), self.nodes)
        rows, whole = self._rows(self.nodes), fem_builder.inversion_test(self.static.model, elastic)
        return lambda q: whole(rows @ q)

    def statics(self) -> Statics:
        """Return the static problem of the reduced equations."""
        full, weights = self.static.problem, np.abs(self.basis.fields).max(axis=0)
        assembly = self.assembly(full.assembly.internal, full.assembly.loads)
        twin = None if full.twin is None else assembly.with_internal(self.internal(full.twin.internal))
        return Statics(
            assembly,
            VectorSpace(self.unknown_count),
            np.zeros(self.unknown_count),
            self.fixed,
            np.ones(len(self.fixed)),
            full.tolerance,
            full.max_iterations,
            twin,
            self.sound(),
            convex=full.convex,
            extent=full.extent,
            weights=1.0 / weights,
        )


def _reduced_equations(model: Modal | Pod, rest: FullModelAtRest, basis: Basis) -> Equations:
    """Return the reduced equations, with sampled cells if the model requests sampling. Raises NotConverged."""
    whole = Equations(rest.static, basis)
    if model.cells == "all":
        return whole
    states = _solutions_with_all_cells(whole) if basis.states is None else basis.states
    return replace(whole, sample=sample_cells(rest.assembly.internal, basis.V, states, rest.size, model.sampling))


def _solutions_with_all_cells(whole: Equations) -> Floats:
    """Return solutions (s, dofs) of the reduced model with all cells, at fractions of the load. Raises NotConverged."""
    problem, found = whole.statics(), []
    for share in PARTS:
        full = whole.static.problem.assembly
        loads = [ScaledLoad(load, share) for load in full.loads]
        at = replace(problem, assembly=whole.assembly(full.internal, loads), target=share * problem.target)
        found.append(whole.basis.fields @ equilibrium(at).x)
    return np.array(found)


# ------------------------------------------------------------------ what is solved


@dataclass(frozen=True)
class RecoveredMesh(MeshData):
    """Mesh of the full model with nodal displacements recovered from the reduced unknowns on first use."""

    fields: Floats
    q: Floats
    times: Floats | None = None
    frames: Floats | None = None
    pressures: Floats | None = None
    left: Floats | None = None
    interactions: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def displacement(self) -> Floats:
        """Nodal displacements (n, 3), m."""
        return (self.fields @ self.q).reshape(-1, 3)

    def at(self, X: Floats) -> Floats:
        """Return the displacements (n, 3), m, of material points X (n, 3), m."""
        return displacement_of(self.mesh, self.displacement)(X)


@dataclass(frozen=True)
class PreparedReduced(DerivedModel):
    """Reduced model ready to solve, with its reduced equations and a report of basis and equations.

    `static` is the full model. `failure` is the reason if there are no equations. `dynamics` are the reduced and the
    full dynamic problem, of a dynamic analysis.
    """

    declared: Declared
    static: PreparedSolid
    equations: Equations | None
    problem: Statics | None
    facts: dict[str, Any]
    notes: tuple[Diagnostic, ...] = ()
    failure: str = ""
    dynamics: tuple[Dynamics, Dynamics] | None = None

    @property
    def size(self) -> dict[str, int]:
        """Numbers of evaluated nodes and elements, and of unknowns."""
        if self.equations is None:
            return {"nodes": 0, "elements": 0, "dofs": 0}
        evaluated = 0 if self.static.model.strain == "small" else len(self.equations.cells)
        nodes = len(self.equations.nodes) if evaluated else 0
        return {"nodes": nodes, "elements": evaluated, "dofs": self.equations.basis.V.shape[1]}

    def warm(self) -> None:
        """Compile the kernels that the solution needs, before timing starts."""
        super().warm()
        if self.problem is not None:
            with suppress(NotConverged):  # it is for the solution to say so
                equilibrium(self.problem)

    @property
    def assembly(self) -> Assembly:
        """Energies and loads of the full model."""
        return self.static.assembly

    def solve(self, watch: Watch) -> Solution:
        """Return the static equilibrium of the reduced equations, starting from rest."""
        if self.problem is None:
            return Solution("not_converged", self.failure, self.model_facts)
        problem = replace(self.problem, watch=watch)
        remedy = "use a smaller load, more modes, or `cells = all`"
        found = static_result.solve_static(lambda: equilibrium(problem), remedy, self._finish)
        return replace(found, facts=found.facts | self.model_facts)

    def _finish(self, found: Equilibrium) -> Solution:
        """Return the solution of an equilibrium, with its residual in the full model's equations."""
        fields = self.problem_fields
        mesh = RecoveredMesh(self.static.mesh, fields, found.x)
        solution = static_result.solution_of(found, mesh.at)
        error = partial(static_error, self.static.problem, fields @ found.x)
        return replace(
            solution, notes=static_result.uniqueness_warnings(self.declared, found), mesh=mesh, reduction_error=error
        )

    @property
    def problem_fields(self) -> Floats:
        """Displacement fields (dofs, r), one for each unknown."""
        if self.equations is None:
            raise ValueError("the reduced model has no equations")
        return self.equations.basis.fields

    @property
    def model_facts(self) -> dict[str, Any]:
        """Report of the basis and of the equations."""
        return {"reduced": self.facts}

    def stored_state(self, problem: Dynamics, motion: Motion) -> Floats:
        """Return reduced displacements, velocities and accelerations (3, r)."""
        return np.array([motion.x, motion.v, motion.a])

    def motion_fields(self, times: Floats, states: Floats) -> MotionFields:
        """Return the displacement fields of reduced states (t, 3, r), with their error in the full equations."""
        assert self.dynamics is not None
        fields, (reduced, full) = self.problem_fields, self.dynamics
        q, v, a = (np.ascontiguousarray(states[:, k]) for k in range(3))
        found = self.static.motion_fields(times, np.array([fields @ one for one in q]))
        error = partial(dynamic_error, full, reduced, ReducedMotion(fields, times, q, v, a))
        return replace(found, reduction_error=error)

    def mode_field(self, problem: Dynamics, shape: Floats) -> DisplacementField:
        """Return the displacement field of a vibration mode `shape` (r,)."""
        return self.static.mode_field(problem, self.problem_fields @ shape)


# ------------------------------------------------------------------ making one


def load(model: Modal | Pod) -> None:
    """Do nothing, because importing this module has already imported all libraries that `prepare` needs."""


def prepare(model: Modal | Pod, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the basis, with training if needed, and the reduced equations. Raises Fault."""
    scene = scene_of(workshop, declared)
    full = scene.declared[model.of]
    own = replace(case_for(scene, full), analysis=case.analysis)
    static, parts = fem_builder.build_static(full.thing, full, own, workshop)
    mass = fem_builder.mass_of(full.thing, own, static.mesh, parts)
    rest = FullModelAtRest(static, sparse.diags(mass).tocsr() if mass.ndim == 1 else mass.tocsr())
    notes, facts = static.notes, {"of": model.of, "space": "pod" if isinstance(model, Pod) else "modal"}
    if isinstance(model, Modal):
        space = partial(modal_space, model, declared, rest)
    else:
        training = train(model, declared, own, static.mesh, workshop)
        outside_of = values_outside_training(training, scene)
        notes = (*notes, *extrapolation_warnings(declared, outside_of))
        facts |= _training_report(training, outside_of) | {"repeats": is_in_training_set(training, scene)}
        space = partial(pod_space, model, declared, rest, training)
    try:
        still = _build_reduced_model(model, declared, rest, space, facts, notes)
    except Singular as loose:
        raise fault(
            "E532",
            declared.at("of"),
            f"`{declared.name}` cannot be reduced: the stiffness of the undeformed body is singular",
            "free to move",
            f"add a support that holds `{own.body.name}`",
        ) from loose
    if still.failure or not isinstance(own.analysis, Dynamic):
        return still
    return _build_dynamics(still, rest.mass, full, own, workshop)


def _training_report(training: Training, outside_of: list[str]) -> dict[str, Any]:
    return {
        "training": list(training.settings),
        "ranges": training.ranges,
        "failed": list(training.failed),
        "training_s": training.seconds[0],
        "training_cpu_s": training.seconds[1],
        "extrapolates": outside_of,
    }


def _build_reduced_model(
    model: Modal | Pod,
    declared: Declared,
    rest: FullModelAtRest,
    space: Callable[[], Basis],
    facts: dict[str, Any],
    notes: tuple[Diagnostic, ...],
) -> PreparedReduced:
    """Return the reduced model, or one with the reason why there are no equations. Raises Fault."""
    try:
        equations = _reduced_equations(model, rest, _check_basis(rest, space()))
    except NotConverged as failed:
        return PreparedReduced(declared, rest.static, None, None, facts, notes, failed.reason)
    facts = facts | _equations_report(equations)
    return PreparedReduced(declared, rest.static, equations, equations.statics(), facts, notes)


def _check_basis(rest: FullModelAtRest, basis: Basis) -> Basis:
    """Return the basis. Raises NotConverged if the effect of the loads in the basis is only rounding."""
    forces = [gradient_of(load, np.zeros(rest.assembly.dofs)) for load in rest.assembly.loads]
    whole = np.linalg.norm(forces)
    inside = np.linalg.norm(np.array(forces) @ (basis.V / np.abs(basis.V).max(axis=0)))
    if basis.lift is None and inside <= IDLE * whole and whole > 0:
        raise NotConverged("the loads do no work on any mode of the reduced model: include such loads in its training")
    return basis


def _equations_report(equations: Equations) -> dict[str, Any]:
    """Return the report of the basis and of the sampled cells."""
    found = {"dimension": int(equations.basis.V.shape[1]), **equations.basis.facts}
    found |= {"cells": len(equations.cells), "of_cells": len(equations.static.mesh.cells)}
    if equations.static.model.strain == "small":
        found["cells"] = 0
    if equations.sample is not None:
        found["sampling_error"] = equations.sample.error
    return found


def _build_dynamics(
    still: PreparedReduced, M: sparse.csr_matrix, full: Declared, case: Case, workshop: BuildContext
) -> DynamicAnalysis:
    """Build the dynamic analysis with the basis of the static model. Raises Fault."""
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis

    whole: Any = fem_builder.prepare(full.thing, full, case, workshop)
    problem, equations, V = whole.problem, still.equations, still.problem_fields
    assert equations is not None
    mass = V.T @ (M @ V)
    moving = replace(
        problem,
        assembly=equations.assembly(problem.assembly.internal, problem.assembly.loads),
        mass=np.diag(mass).copy() if problem.integrator.explicit else sparse.csr_matrix(mass),
        rest=np.zeros(equations.unknown_count),
        velocity=_reduced_initial_velocity(equations, M, problem.velocity),
        fixed=equations.fixed,
        target=np.ones(len(equations.fixed)),
        sound=equations.sound(),
        linear=DenseSolver(),
        lagged=False,
        cap=None,
    )
    return DynamicAnalysis(replace(still, dynamics=(moving, problem)), still.declared, case, moving)


def _reduced_initial_velocity(equations: Equations, M: sparse.csr_matrix, velocity: Floats) -> Floats:
    """Return the reduced velocities that are nearest to a velocity field of the body, in the mass norm."""
    V = equations.basis.V
    own = V.T @ (M @ velocity)
    return np.append(own, np.zeros(len(equations.fixed)))
