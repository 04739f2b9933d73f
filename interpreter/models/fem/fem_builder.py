"""Construction and solution of solid finite element models."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cache, reduce
from operator import add
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem import element_formulations
from softmark.interpreter.models.fem.element_formulations import Unknowns
from softmark.interpreter.models.fem.fem_declaration import LARGE_ANGLE, Fem
from softmark.interpreter.models.fem.fem_mesh import mesh_of
from softmark.interpreter.models.fem.initial_guess import GuessModel, start_of
from softmark.interpreter.models.postprocessing import nodal_forces, vibrations
from softmark.interpreter.models.postprocessing.vibrations import frequencies_about
from softmark.interpreter.models.shared import interaction_setup, mesh_notes, self_intersections, static_result
from softmark.interpreter.models.shared.deformed_mesh import DeformedBody, displacement_of
from softmark.interpreter.models.shared.load_setup import mass_matrix, merge_loads, single_loads
from softmark.interpreter.models.shared.material_regions import (
    MaterialRegion,
    must_be_mirrored,
    regions_by_material,
    sample_regions,
    softness_note,
)
from softmark.interpreter.models.shared.material_regions import notes as notes_of_parts
from softmark.interpreter.models.shared.mesh_based_model import MeshBasedModel
from softmark.interpreter.models.shared.perturbed_start import Disturbance, disturbance_of, recover_solid
from softmark.interpreter.models.shared.prepared_model import BuildContext, DeformedMesh, Prepared, Solution
from softmark.interpreter.models.shared.support_constraints import solid_supports
from softmark.interpreter.models.shared.support_selection import support_selection_warnings
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly, number_energies
from softmark.solvers.assembly.elastic_energy_factory import elastic_energy, elastic_parts
from softmark.solvers.assembly.single_precision import SingleAssembly
from softmark.solvers.energies import element_corotational
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.element_corotational import ElementCorotational
from softmark.solvers.energies.energy import Energy, Floats, VectorSpace
from softmark.solvers.energies.stabilization_spring import STABILIZATION
from softmark.solvers.linear import factorisations, linear_solver
from softmark.solvers.materials import law_for
from softmark.solvers.materials.polar_decomposition import least_stretch, rotations
from softmark.solvers.materials.st_venant_kirchhoff import StVenantKirchhoff
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.model_reduction.cell_energies import fields_of_cells
from softmark.solvers.statics.residual_forces import resultant_on
from softmark.solvers.statics.static_equilibrium import Equilibrium, LinearSolverOptions, Statics, equilibrium

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.unsupported_bodies import UnsupportedBody
    from softmark.solvers.contact.interaction_state import InteractionState
    from softmark.solvers.contact.rigid_contact import RigidContact
    from softmark.solvers.energies.elastic_foundation import ElasticFoundation
    from softmark.solvers.mesh.shape import Shape
    from softmark.solvers.statics.static_equilibrium import Watch

FLAT = 0.25  # stretch of a cell below which a corotational state is no suitable start
GIVES_WAY = 3.0**-0.5  # stretch at which the compressive stress of a St Venant-Kirchhoff solid is largest


@dataclass(frozen=True)
class PreparedSolid(MeshBasedModel):
    """Finite element model on a mesh, with its elastic energies and its static problem.

    `elastic` evaluates the material law at all quadrature points.
    """

    model: Fem
    declared: Declared
    shape: Shape
    mesh: Mesh
    elastic: Elastic
    problem: Statics
    size: dict[str, int]
    notes: tuple[Diagnostic, ...]
    first: GuessModel | None = None  # model whose solution is the initial guess
    before: Floats | None = None  # nodal displacements (3 n,) of the previous state, m, used as start
    disturbance: Disturbance | None = None
    applied: tuple[tuple[Declared, Energy], ...] = ()  # each load separately
    pieces: tuple[MaterialRegion, ...] = ()  # the cells of every material
    beds: Mapping[str, ElasticFoundation] = field(default_factory=dict)  # foundations, ties and self-contacts, by name
    axial: bool = False  # it is a body of revolution
    muscles: tuple[tuple[Declared, Energy], ...] = ()  # active energy of each muscle
    contacts: Mapping[str, RigidContact] = field(default_factory=dict)  # contacts with rigid bodies, by name
    interactions: Mapping[str, InteractionState] = field(default_factory=dict)  # after the previous state, by name
    loose: UnsupportedBody | None = None  # set if supports leave the body free and contact must hold it

    @property
    def amplitude_scaled_energies(self) -> tuple[tuple[Declared, Energy], ...]:
        """Energies of loads and muscles, one of each, which are all energies that an amplitude scales."""
        return (*self.applied, *self.muscles)

    def warm(self) -> None:
        """Compile or load all kernels before timing: energies on one cell, and factorization if it is large."""
        entries = len(self.problem.assembly.pattern.indices)
        with factorisations.warm_up_in_parallel(entries):
            self._warm_cells()
        default = LinearSolverOptions(modes=self.problem.linear.modes)
        if entries >= factorisations.LARGE or self.problem.linear != default:
            linear_solver.warm_up(self.problem.linear, self.problem.rest.dtype)
        if self.first is not None:
            self.first.prepared.warm()

    def _warm_cells(self) -> None:
        """Compile the kernels of the energies on one cell."""
        twin = self.problem.twin
        for energy in (*self.solid, *(twin.internal_energies("cells") if twin else ())):
            one = _one_cell(energy)
            nodes = np.unique(one.stencils)
            rest = np.zeros(self.problem.assembly.dofs, dtype=self.problem.rest.dtype)
            small = Assembly(len(rest), np.setdiff1d(np.arange(len(rest)), nodes), [one], [])
            small = small if self.problem.exact is None else SingleAssembly.of(small)
            small.value(rest, 1.0)
            small.gradient(rest, 1.0)
            small.tangent(rest, 1.0)
        _one_cell(self.elastic).F(np.zeros(self.mesh.points.size))

    @property
    def assembly(self) -> Assembly:
        """Energies and loads in double precision."""
        return self.problem.exact or self.problem.assembly

    def after(self, before: DeformedMesh) -> PreparedSolid:
        """Return the model with the previous state as its start; the model itself if it has a perturbed start."""
        begun = self if self.disturbance else replace(self, first=None, before=np.ravel(before.displacement))
        return interaction_setup.resume_interactions(begun, before)

    def solve(self, watch: Watch) -> Solution:
        """Return the static equilibrium, from rest, from the previous state, or from another model's solution."""
        remedy = "use a smaller load, a finer mesh or another strain measure"
        remedy = remedy if self.loose is None else f"add a support or a contact that holds the body, or {remedy}"
        problem = replace(self.problem, watch=watch)
        if self.before is not None:
            problem = replace(problem, start=self.unknowns.start_state(self.before))
        if self.first is None:
            return static_result.solve_static(
                lambda: self._find_equilibrium(problem), remedy, self.make_solution, self.describe_free_motion
            )
        begun = self.first.solve_guess(self.mesh.points, watch)
        problem = replace(problem, start=self.unknowns.start_state(begun.x))
        found = static_result.solve_static(
            lambda: equilibrium(problem), remedy, self.make_solution, self.describe_free_motion
        )
        notes = begun.notes(self.declared, found)
        return replace(found, facts=found.facts | {"start": begun.facts(found)}, notes=(*notes, *found.notes))

    @property
    def unknowns(self) -> Unknowns:
        """Unknowns of a state: displacements and, in mixed formulations, pressures."""
        return Unknowns.of(self.solid, self.mesh)

    @property
    def solid(self) -> Sequence[Energy]:
        """Energies of the cells, one for each material."""
        return self.problem.assembly.internal_energies("cells")

    def _find_equilibrium(self, problem: Statics) -> Equilibrium:
        """Return the equilibrium from rest, or from a perturbed start. Raises NotConverged."""
        if self.contacts or self.loose is not None:
            return interaction_setup.find_equilibrium(self, problem)
        if self.disturbance is None:
            return equilibrium(problem)
        return recover_solid(self.disturbance, problem, self.mesh.points, self.elastic)

    def describe_free_motion(self, d: Floats) -> str:
        """Return a description of a motion d (dofs,) that no stiffness resists."""
        return static_result.describe_free_motion(self.mesh.points, self.unknowns.moved(d).reshape(-1, 3))

    def make_solution(self, found: Equilibrium) -> Solution:
        """Return the solution of an equilibrium, with functions for its results."""
        u = (x := self.unknowns.moved(found.x)).reshape(-1, 3)
        solution = static_result.solution_of(found, displacement_of(self.mesh, u))
        facts = solution.facts | mesh_notes.mesh_facts(self.mesh) | self_intersections.count_intersections(self.beds, x)
        facts |= interaction_setup.rigid_body_report(self, facts.pop("pressed", None))
        beside = interaction_setup.contacts_at_equilibrium(self, found)
        kept, adrift = interaction_setup.describe_free_motions(self, beside, x)
        pressures = self.unknowns.cell_pressures(self.solid, self.pieces, found.x)
        doubts = (
            *static_result.uniqueness_warnings(self.declared, found),
            *self_intersections.intersection_warnings(self.declared, facts),
            *kept,
        )
        soft = softness_note(self.declared, self.pieces, u, pressures)
        notes = (*self._large_rotation_warnings(x), *self._kirchhoff_compression_warnings(x), *soft, *doubts)
        left = None if found.left is None else self.unknowns.moved(found.left).reshape(-1, 3)
        message = "; ".join(filter(None, (solution.message, self._replaced_solver_message(found)))) or None
        states = interaction_setup.interaction_states(self, u, beside)
        moved = DeformedBody(self.mesh, u, pressures=pressures, left=left, interactions=states)
        modes = frequencies_about(
            interaction_setup.assembly_without_stabilization(self, beside), found.x, self.mass, self.problem.linear
        )
        if not found.solved:
            modes = vibrations.undefined_frequencies("it was stopped before it reached equilibrium")
        elif adrift:
            modes = vibrations.undefined_frequencies(f"no restoring force acts: it is free to {adrift}")
        elif "rigid" in facts:
            modes = vibrations.undefined_frequencies("a force-driven rigid body would move with it")
        elif self.model.strain == "small" and (self.applied or np.any(self.problem.target)):
            modes = vibrations.undefined_frequencies(
                "in small strain loads do not change the tangent stiffness: remove the loads, or use "
                "another strain measure"
            )
        seen = replace(solution, message=message, facts=facts, notes=notes, mesh=moved, vibrations=modes)
        return replace(seen, carried=cache(lambda: self._nodal_forces(found.x, x, beside, states)))

    def nodal_forces_in_state(self, state: Floats) -> nodal_forces.NodalForces:
        """Return the nodal forces in a state (dofs,), with contacts as they are initially and no friction history."""
        return self._nodal_forces(state, self.unknowns.moved(state), self.contacts, {})

    def mass(self) -> Any:
        """Mass matrix of the displacements, or its diagonal, kg."""
        return _mass(self.model, self.pieces)

    def _nodal_forces(
        self, state: Floats, u: Floats, beside: Mapping[str, RigidContact], states: Mapping[str, InteractionState]
    ) -> nodal_forces.NodalForces:
        """Return the nodal forces in a state with displacements u (3 n,), m.

        `beside` are the contacts in that state, and `states` are those of all interactions, each by name.
        """
        small, whole = self.model.strain == "small", self.model.rotation != "element"
        pulling = [energy for _, energy in self.muscles]
        assembly = interaction_setup.assembly_without_stabilization(self, beside)
        found = nodal_forces.on_mesh(self.mesh, state, u, assembly, self.applied, small, whole, self.axial, pulling)
        found = nodal_forces.add_foundation_forces(found, self.beds) if self.beds else found
        return interaction_setup.add_contact_forces(found, beside, self, states)

    def _replaced_solver_message(self, found: Equilibrium) -> str:
        """Return a message if Pardiso was requested but another linear solver was used, else an empty text."""
        if self.model.linear != "pardiso":
            return ""
        from softmark.solvers.sparse import pardiso

        why = pardiso.missing_reason()
        return (
            f"the library for `linear = pardiso` was not found ({why}): solved by {found.linear_solver}" if why else ""
        )

    def _kirchhoff_compression_warnings(self, x: Floats) -> tuple[Diagnostic, ...]:
        """Return a warning if a St Venant-Kirchhoff solid is compressed beyond the law's limit of stability."""
        least = min((least_stretch(energy.F(x)) for energy in self._kirchhoff()), default=1.0)
        if least > GIVES_WAY:
            return ()
        return (
            diagnostic(
                "W381",
                self.declared.at("strain"),
                f"`{self.declared.name}` compresses a St Venant-Kirchhoff solid to {max(0.0, least):.2g} of its size",
                f"the law is unstable below {GIVES_WAY:.3g}",
                "use `neo_hookean`: St Venant-Kirchhoff softens under further compression, and at a stretch of "
                "sqrt(1 + 1 / nu) it has no stiffness",
            ),
        )

    def _kirchhoff(self) -> Iterator[Elastic]:
        """Yield the energies of St Venant-Kirchhoff solids at finite strain."""
        for own in self.pieces:
            if self.model.strain == "finite" and isinstance(own.case.material.finite_law(), StVenantKirchhoff):
                yield elastic_of(own.case, own.mesh, own.parts, self.model.strain)

    def _large_rotation_warnings(self, x: Floats) -> tuple[Diagnostic, ...]:
        """Return a warning if rotations are large but the strain measure is small strain."""
        if self.model.strain != "small":
            return ()
        H = self.elastic.F(x) - np.eye(3)
        skew = 0.5 * (H - H.transpose(0, 2, 1))
        angle = float(np.sqrt(0.5 * np.sum(skew**2, axis=(1, 2))).max())
        if angle < LARGE_ANGLE:
            return ()
        return (
            diagnostic(
                "W306",
                self.declared.at("strain"),
                f"`{self.declared.name}` uses small strain, but rotations reach "
                f"{units.format_value(angle, units.ANGLE)}",
                "outside the validity of small strain",
                "do not use these results; write `strain = corotational` or `finite`",
            ),
        )


AnyEnergy = TypeVar("AnyEnergy")


def _one_cell(energy: AnyEnergy) -> AnyEnergy:
    """Return an energy with only its first cell, by which its kernels are compiled at negligible cost."""
    if isinstance(energy, EnergySum):
        return replace(energy, parts=tuple(_one_cell(part) for part in energy.parts))
    known: Any = energy  # one of the dataclasses of solvers/energies over cells
    one: AnyEnergy = replace(known, **fields_of_cells(known, slice(0, 1)))
    return one


def load(model: Fem) -> None:
    """Import the libraries that `prepare` needs, so that their import does not count as building time."""
    import softmark.solvers.mesh.structured_meshes  # noqa: F401


def prepare(model: Fem, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the static or dynamic model of a case. Raises Fault."""
    static, parts = build_static(model, declared, case, workshop)
    if not isinstance(case.analysis, Dynamic):
        return apply_options(static, workshop, disturbance_of(case))
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
    from softmark.interpreter.models.shared.solid_dynamics import include_free_rigid_bodies, solid_dynamics

    mass, loads, pulling = (
        mass_of(model, case, static.mesh, parts),
        static.amplitude_scaled_energies,
        len(static.muscles),
    )
    problem = solid_dynamics(declared, case, static.mesh, static.problem, mass, loads, pulling)
    return include_free_rigid_bodies(DynamicAnalysis(static, declared, case, problem))


def build_static(
    model: Fem, declared: Declared, case: Case, workshop: BuildContext, mesh: Mesh | None = None
) -> tuple[PreparedSolid, IntegrationPoints]:
    """Return the static model of a case and the integration over its mesh. Raises Fault.

    The mesh is generated unless it is given.
    """
    mesh = mesh_of(model, declared, case, workshop) if mesh is None else mesh
    parts = integrate_cells(mesh)
    elastic = elastic_of(case.plain, mesh, parts, model.strain)
    each = sample_regions(regions_by_material(case, mesh, parts), model.formulation != "displacement")
    element_formulations.must_be_compressible(declared, each)
    passive, tensions = separate_muscles(each)
    internal, twins = element_formulations.energies_of_regions(model, passive, energies)
    fixed, target, way = solid_supports(case, mesh, workshop.measured)
    must_be_mirrored(each)
    applied = single_loads(case, mesh, parts, small=model.strain == "small", mass=model.mass)
    unknowns = Unknowns.of(internal, mesh)
    dofs, points = unknowns.all, None if unknowns.pressures else mesh.points
    beds = interaction_setup.create_surface_interactions(case, mesh)
    contacts = interaction_setup.create_rigid_contacts(case, mesh)
    loose = interaction_setup.find_unsupported_body(case, mesh, parts, workshop.measured, dofs, beds)
    beyond: dict[str, Energy] = beds if loose is None else {**beds, **number_energies(STABILIZATION, [loose.spring])}
    loads = unknowns.loads([*merge_loads(applied, mesh.points.size), *(energy for _, energy in tensions)])
    inner, outer = {**number_energies("cells", internal), **beyond}, {**number_energies("load", loads), **contacts}
    assembly = Assembly(dofs, fixed, inner, outer, points)
    element_formulations.must_determine_pressure(declared, case, each, assembly)
    problem = Statics(
        assembly,
        VectorSpace(dofs),
        np.zeros(dofs),
        fixed,
        target,
        case.analysis.tolerance,
        case.analysis.max_iterations,
        None if twins is None else assembly.with_internal([*twins, *beyond.values()]),
        unknowns.extend_function(inversion_test(model, elastic)),
        unknowns.extend_function(lambda x: least_stretch(elastic.F(x)) > FLAT),
        convex=model.strain == "small" and assembly.conservative and not contacts and not case.pairs,
        extent=mesh.extent,
        path=case.analysis.path,
        way=way,
        linear=element_formulations.saddle_point_solver(LinearSolverOptions(), assembly),
        resultant=unknowns.extend_function(resultant_on(mesh.points)),
    )
    size = {"nodes": len(mesh.points), "elements": len(mesh.cells), "dofs": len(assembly.free)}
    shape = model.mesh or case.shape
    notes = (
        *mesh_notes.volume_note(declared, case, mesh),
        *mesh_notes.sliver_note(declared, shape, mesh),
        *mesh_notes.filled_notes(declared, case, mesh),
        *support_selection_warnings(declared, case, mesh),
        *notes_of_parts(declared, case, mesh),
    )
    known = (model, declared, shape, mesh, elastic, problem, size, notes)
    made = PreparedSolid(*known, applied=(*applied,), pieces=each, beds=beds, axial=case.depth > 0.0,
                         muscles=(*tensions,), contacts=contacts, loose=loose)  # fmt: skip
    return made, parts


def separate_muscles(each: Sequence[MaterialRegion]) -> tuple[Sequence[MaterialRegion], list[tuple[Declared, Energy]]]:
    """Return the regions with the passive law of each muscle, and the active energy of each muscle.

    An active energy is defined over all cells of the body.
    """
    if not any(getattr(own.case.material, "pulls", False) for own in each):
        return each, []
    passive, tensions = [], list[tuple[Declared, Energy]]()
    for own in each:
        material = own.case.material
        if getattr(material, "pulls", False):
            pull = replace(own.case, other_material=material.pull)
            energy = elastic_of(pull, own.mesh, own.parts, "finite")
            tensions.append((replace(own.case.body, thing=material), energy))
            material = material.passive
        passive.append(replace(own, case=replace(own.case, other_material=material)))
    return passive, tensions


def apply_options(
    static: PreparedSolid, workshop: BuildContext, disturbance: Disturbance | None = None
) -> PreparedSolid:
    """Return the model with the options that trade accuracy for speed or set the start. Raises Fault.

    These are precision, caps on iterations, the linear solver, and an initial guess or a perturbed start.
    """
    model, problem = static.model, static.problem
    reuse, modes = model.factorisation == "reused", problem.assembly.rigid_body_modes
    choice = LinearSolverOptions(model.linear, model.precision, model.max_linear_iterations, reuse, modes)
    choice = element_formulations.saddle_point_solver(choice, problem.assembly)
    problem = replace(problem, cap=model.max_iterations, linear=choice)
    if model.precision == "single":
        twin = None if problem.twin is None else SingleAssembly.of(problem.twin)
        rest: Any = problem.rest.astype(np.float32)
        exact, assembly = problem.assembly, SingleAssembly.of(problem.assembly)
        problem = replace(problem, assembly=assembly, twin=twin, rest=rest, exact=exact)
    first = None if model.initial_guess is None else start_of(static.declared, workshop)
    return replace(static, problem=problem, first=first, disturbance=disturbance)


def inversion_test(model: Fem, elastic: Elastic) -> Callable[[Floats], bool]:
    """Return a function that tests whether no cell is inverted at any integration point.

    For small strain the function always returns True.
    """

    def sound(x: Floats) -> bool:
        """Return whether all determinants of the deformation gradient are positive."""
        return model.strain == "small" or bool(np.all(np.linalg.det(elastic.F(x)) > 0))

    return sound


def elastic_of(case: Case, mesh: Mesh, parts: IntegrationPoints, strain: str) -> Elastic:
    """Return the elastic energy of a case at quadrature points; axisymmetric for a body of revolution."""
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(case.material, strain))
    if not case.depth:
        return elastic
    from softmark.solvers.energies.axisymmetric import AxisymmetricElastic

    return AxisymmetricElastic.of(elastic, parts.N, mesh.points, case.depth)


def energies(model: Fem, case: Case, mesh: Mesh, parts: IntegrationPoints) -> tuple[Energy, Energy | None]:
    """Return the elastic energy that a model requests and, for a finite-strain law, a corotational energy."""
    if model.formulation != "displacement" or case.porous:
        return element_formulations.energies(model, case, mesh, parts)
    elastic = elastic_of(case, mesh, parts, model.strain)
    if model.rotation == "element":
        return _element_corotational_energy(model, case, mesh, elastic), None
    selective = model.integration == "selective"
    energy = elastic_energy(mesh, elastic, case.material, model.strain, selective)
    if model.strain != "finite":
        return energy, None
    return energy, elastic_energy(mesh, elastic, case.material, "corotational", selective)


def _element_corotational_energy(model: Fem, case: Case, mesh: Mesh, elastic: Elastic) -> ElementCorotational:
    """Return the corotational energy with one rotation per cell and its initial stiffness.

    The stiffness is that of full or selective integration.
    """
    G, rest = element_corotational.mean_gradients(elastic.dNdX, elastic.w), np.eye(3)[None]
    parts = elastic_parts(mesh, elastic, case.material, "small", model.integration == "selective")
    K = np.sum([_initial_stiffness(e, rest) for e in parts], axis=0)
    return ElementCorotational(mesh.points, mesh.cells, G, K, rotations)


def _initial_stiffness(e: Elastic, rest: Floats) -> Floats:
    """Return the initial stiffness matrix of each cell (m, 3a, 3a), N/m; varying moduli enter as weights."""
    if not e.has_varying_constants:
        return element_corotational.element_stiffness(e.dNdX, e.w, e.law.dPdF(rest)[0])
    law: Any = e.law
    unit = (replace(law.law, mu=1.0, lam=0.0), replace(law.law, mu=0.0, lam=1.0))
    each = ((law.law.mu, unit[0]), (law.law.lam, unit[1]))
    K: Floats = np.sum(
        [element_corotational.element_stiffness(e.dNdX, e.w * c, one.dPdF(rest)[0]) for c, one in each], axis=0
    )
    return K


def mass_of(model: Fem, case: Case, mesh: Mesh, parts: IntegrationPoints) -> Any:
    """Return the mass matrix of a model, kg: sparse (3n, 3n) if it is consistent, else its diagonal (3n,)."""
    return _mass(model, regions_by_material(case, mesh, parts))


def _mass(model: Fem, each: Sequence[MaterialRegion]) -> Any:
    """Return the mass matrix of all regions, kg, or its diagonal."""
    return reduce(add, (mass_matrix(p.mesh, p.parts, p.density, model.mass) for p in each))
