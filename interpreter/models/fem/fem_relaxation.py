"""Viscoelastic solids in quasistatic analyses, solved as a sequence of equilibria in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.fem.fem_builder import PreparedSolid, build_static, elastic_of, mass_of
from softmark.interpreter.models.postprocessing import nodal_forces, vibrations
from softmark.interpreter.models.procedures.quasistatic_analysis import Loads, QuasistaticAnalysis, energies_in_time
from softmark.interpreter.models.procedures.quasistatic_times import LoadAndSupportAmplitudes, case_at_full_size
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.deformed_mesh import DeformedBody, displacement_of
from softmark.interpreter.models.shared.load_setup import nodal_forces_at_rest
from softmark.interpreter.models.shared.mesh_notes import mesh_facts
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.models.shared.support_constraints import held_values
from softmark.interpreter.models.shared.viscoelastic_limits import dissipation_warnings
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.external_loads import ScaledLoad
from softmark.solvers.energies.viscoelastic_memory import BodyHistory, ViscoelasticHistory
from softmark.solvers.materials.viscoelastic_increment import prony_series

if TYPE_CHECKING:
    from softmark.interpreter.models.fem.fem_declaration import Fem
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.quasistatic_history import StateInTime
    from softmark.solvers.statics.static_equilibrium import Equilibrium


@dataclass(frozen=True)
class DisplacementHistory:
    """History of nodal displacements: `times` (t,), s, and the displacements at each time (t, n, 3), m."""

    times: tuple[float, ...]
    states: tuple[Floats, ...]


@dataclass(frozen=True)
class MeshWithHistory(DeformedBody):
    """Deformed mesh with its displacement history; `aged` is the material state from which a later time continues."""

    past: DisplacementHistory | None = None
    aged: StateInTime | None = None
    pore_pressure: Floats | None = None  # (n,) Pa, fluid pressure, positive in compression

    def __getstate__(self) -> dict[str, Any]:
        """Return the mesh without the material state, for stored reports."""
        return self.__dict__ | {"aged": None}


@dataclass(frozen=True)
class SolidWithHistory(PreparedSolid):
    """Solid whose material has a history, with all loads at full size and with the instantaneous law."""

    inner_stages: ClassVar[tuple[float, ...]] = ()
    remedy: ClassVar[str] = "use a shorter step, a smaller load, a finer mesh or another strain measure"

    def scaled_forces(self, shares: Sequence[float]) -> list[Floats]:
        """Return the nodal forces (n, 3), N, of each load at a share of its full size, on the undeformed body."""
        scaled = (ScaledLoad(energy, share) for (_, energy), share in zip(self.applied, shares, strict=True))
        return [nodal_forces_at_rest(load, self.points) for load in scaled]

    def solution_in_time(self, found: Equilibrium, state: StateInTime, acting: Loads) -> Solution:
        """Return the solution of a state, with its energies and its history."""
        x = self.unknowns.moved(state.x)
        u = x.reshape(-1, 3)
        solution = static_result.solution_of(found, displacement_of(self.mesh, u))
        notes = (
            *self._large_rotation_warnings(x),
            *self._kirchhoff_compression_warnings(x),
            *static_result.uniqueness_warnings(self.declared, found),
            *dissipation_warnings(
                self.declared, np.array((0.0, *state.losses)), abs(state.work), state.memories.has_unknown_energy
            ),
        )
        left = None if found.left is None else self.unknowns.moved(found.left).reshape(-1, 3)
        pressures = self.unknowns.cell_pressures(self.solid, self.pieces, state.x)
        past = DisplacementHistory(state.times, tuple(self.unknowns.moved(y).reshape(-1, 3) for y in state.states))
        return replace(
            solution,
            facts=solution.facts | mesh_facts(self.mesh) | energies_in_time(state),
            notes=notes,
            mesh=MeshWithHistory(self.mesh, u, pressures=pressures, left=left, past=past, aged=state),
            vibrations=vibrations.undefined_frequencies("frequencies of a viscoelastic body are not available"),
            carried=cache(lambda: self.nodal_forces_in_time(state, x, acting)),
        )

    def nodal_forces_in_time(self, state: StateInTime, u: Floats, acting: Loads) -> nodal_forces.NodalForces:
        """Return the nodal forces in a state with displacements u (3 n,), m, under the `acting` loads and muscles."""
        if state.problem is None:
            raise ValueError("no step was solved")
        small, count = self.model.strain == "small", len(self.applied)
        loads, muscles = acting[:count], [energy for _, energy in acting[count:]]
        found = nodal_forces.on_mesh(
            self.mesh, state.x, u, state.problem.assembly, loads, small, True, self.axial, muscles
        )
        unknown = state.memories.has_unknown_energy
        stored, lost = (np.nan, np.nan) if unknown else (state.stored, state.dissipated)
        found = replace(found, energy=stored, dissipated=lost)
        return nodal_forces.add_foundation_forces(found, self.beds) if self.beds else found


# ------------------------------------------------------------------ building


def build_relaxation_dynamics(model: Fem, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the dynamic analysis of a viscoelastic solid. Raises Fault."""
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
    from softmark.interpreter.models.shared.solid_dynamics import solid_dynamics
    from softmark.solvers.dynamics.implicit_midpoint import Midpoint
    from softmark.solvers.dynamics.viscoelastic_step import ViscoelasticStep

    static, parts = build_static(model, declared, case, workshop)
    known = _energies_with_history(model, static)
    mass, pulling = mass_of(model, case, static.mesh, parts), len(static.muscles)
    assembly = static.problem.assembly.with_internal(known.energies)
    rest, loads = replace(static.problem, assembly=assembly), static.amplitude_scaled_energies
    problem = solid_dynamics(declared, case, static.mesh, rest, mass, loads, pulling)
    remembering = ViscoelasticStep(known, isinstance(problem.integrator, Midpoint))
    problem = replace(problem, remembering=remembering, lagged=False)
    return DynamicAnalysis(static, declared, case, problem)


def prepare(model: Fem, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the quasistatic or dynamic analysis of a viscoelastic solid. Raises Fault."""
    if isinstance(case.analysis, Dynamic):
        return build_relaxation_dynamics(model, declared, case, workshop)
    whole = case_at_full_size(case)
    static, _ = build_static(model, declared, whole, workshop)
    loads, problem = [energy for _, energy in static.amplitude_scaled_energies], static.problem
    memories, old = _energies_with_history(model, static), problem.assembly
    internal = dict(zip(old.names[0], memories.energies, strict=True))
    assembly = Assembly(old.dofs, problem.fixed, internal, static.unknowns.loads(loads), old.points)
    solid = SolidWithHistory(**fields_of(static) | {"problem": replace(problem, assembly=assembly, twin=None)})
    owners = support_of_each_dof(whole, static.mesh, workshop, problem.fixed)
    timed = LoadAndSupportAmplitudes.of(whole, static.amplitude_scaled_energies, owners, problem.target)
    return QuasistaticAnalysis(solid, case, memories, timed)


def fields_of(static: PreparedSolid) -> dict[str, Any]:
    """Return the fields of a static model, of which models with a history are made."""
    return {f.name: getattr(static, f.name) for f in fields(static)}


def support_of_each_dof(case: Case, mesh: Mesh, workshop: BuildContext, fixed: Ints) -> list[Declared]:
    """Return the support that imposes each of the held degrees of freedom `fixed` (c,)."""
    held = held_values(case, mesh, workshop.measured)
    return [held[dof][1] for dof in fixed.tolist()]


def _energies_with_history(model: Fem, static: PreparedSolid) -> BodyHistory:
    """Return the energies of regions and foundations, with history variables for materials that relax."""
    found: list[ViscoelasticHistory | Energy] = []
    for own, energy in zip(static.pieces, static.solid, strict=True):
        material = own.case.material
        if not material.branches:
            found.append(energy)
            continue
        plain: Any = energy
        if model.formulation == "displacement":
            plain = elastic_of(own.case, own.mesh, own.parts, model.strain)
        found.append(ViscoelasticHistory.at_rest(plain, prony_series(material, model.strain)))
    return BodyHistory((*found, *static.beds.values()))
