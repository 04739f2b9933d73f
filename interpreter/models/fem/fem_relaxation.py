"""Viscoelastic solids in quasistatic analyses, solved as a sequence of equilibria in time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.fem.fem_builder import PreparedSolid, build_static, elastic_of, mass_of
from softmark.interpreter.models.postprocessing import nodal_forces, vibrations
from softmark.interpreter.models.shared import solid_dynamics, static_result
from softmark.interpreter.models.shared.deformed_mesh import DeformedBody, displacement_of
from softmark.interpreter.models.shared.mesh_based_model import MeshBasedModel
from softmark.interpreter.models.shared.mesh_notes import mesh_facts
from softmark.interpreter.models.shared.prepared_model import BuildContext, DeformedMesh, Prepared, Solution
from softmark.interpreter.models.shared.quasistatic_times import LoadAndSupportAmplitudes, case_at_full_size
from softmark.interpreter.models.shared.support_constraints import held_values
from softmark.interpreter.models.shared.viscoelastic_limits import dissipation_warnings
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.viscoelastic_memory import BodyHistory, ViscoelasticHistory
from softmark.solvers.materials.viscoelastic_increment import prony_series
from softmark.solvers.statics.quasistatic_history import (
    InstantLoading,
    StateInTime,
    advance_in_time,
    advance_through,
    state_at_rest,
)

if TYPE_CHECKING:
    from softmark.interpreter.models.fem.fem_declaration import Fem
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.mesh.shape import Shape
    from softmark.solvers.statics.static_equilibrium import Watch


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
class PreparedViscoelastic(MeshBasedModel):
    """Viscoelastic solid in a quasistatic analysis.

    `static` is the same body with all loads at full size and with the instantaneous law.
    """

    static: PreparedSolid
    case: Case
    memories: BodyHistory
    timed: LoadAndSupportAmplitudes  # amplitudes of loads and muscles
    before: StateInTime | None = None

    @property
    def shape(self) -> Shape:  # type: ignore[override]
        """Shape of the body."""
        return self.static.shape

    @property
    def mesh(self) -> Mesh:  # type: ignore[override]
        """Mesh of the body."""
        return self.static.mesh

    @property
    def applied(self) -> tuple[tuple[Declared, Energy], ...]:  # type: ignore[override]
        """Energies of the loads at the present time, one for each load."""
        acting = self.timed.acting(self.static.amplitude_scaled_energies, self._now)[: len(self.case.loads)]
        return tuple((load, energy) for load, (_, energy) in zip(self.case.loads, acting, strict=True))

    @property
    def muscle_energies(self) -> list[Energy]:
        """Active energies of muscles at the present time, each separately."""
        return [
            energy
            for _, energy in self.timed.acting(self.static.amplitude_scaled_energies, self._now)[len(self.case.loads) :]
        ]

    @property
    def size(self) -> dict[str, int]:
        """Numbers of nodes, elements and degrees of freedom, by name."""
        return self.static.size

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings found while the static model was built."""
        return self.static.notes

    @property
    def assembly(self) -> None:
        """Energies in terms of nodal displacements: None, because they differ at every time."""
        return

    @property
    def analysis(self) -> Quasistatic:
        """Quasistatic analysis at one of its output times."""
        return self.timed.analysis

    @property
    def _now(self) -> float:
        """Present time, s."""
        return self.analysis.now

    def after(self, before: DeformedMesh) -> PreparedViscoelastic:
        """Return the model that continues from the state at the previous output time."""
        return replace(self, before=before.aged) if isinstance(before, MeshWithHistory) else self

    def warm(self) -> None:
        """Compile the code that the solution needs, before timing starts."""
        self.static.warm()
        for own in self.memories.each:
            if isinstance(own, ViscoelasticHistory):
                own.over(0.0).add_gradient(self.static.problem.rest, np.zeros_like(self.static.problem.rest))

    # ------------------------------------------------------------------ time

    def step_loadings(self) -> list[InstantLoading]:
        """Return loads and supports at the end of every time step since the previous output time."""
        return self.timed.after(None if self.before is None else self.before.time)

    # ------------------------------------------------------------------ solving

    def solve(self, watch: Watch) -> Solution:
        """Return the solution at the present time, by time steps from the start or from the previous state."""
        remedy = "use a shorter step, a smaller load, a finer mesh or another strain measure"
        problem = replace(self.static.problem, watch=watch)
        first = self.before if self.before is not None else state_at_rest(problem, self.memories)
        came: list[StateInTime] = [first]

        def find() -> Any:
            """Return the equilibrium at the present time."""
            came[0] = advance_through(problem, first, self.step_loadings())
            if came[0].found is None:
                came[0] = advance_in_time(problem, came[0], self.timed.at(self._now, False))
            found: Any = came[0].found
            return replace(found, history=came[0].history[len(first.history) :])

        return static_result.solve_static(
            find, remedy, lambda found: self._finish(found, came[0]), self.static._describe_free_motion
        )

    def _finish(self, found: Any, state: StateInTime) -> Solution:
        """Return the solution of a state, with its energies and its history."""
        static = self.static
        x = static.unknowns.moved(state.x)
        u = x.reshape(-1, 3)
        solution = static_result.solution_of(found, displacement_of(static.mesh, u))
        notes = (
            *static._large_rotation_warnings(x),
            *static._kirchhoff_compression_warnings(x),
            *static_result.uniqueness_warnings(static.declared, found),
            *self._dissipation_warnings(state),
        )
        none = state.memories.has_unknown_energy
        stored, lost = (np.nan, np.nan) if none else (state.stored, state.dissipated)
        energies = {"work_J": state.work, "stored_J": None if none else stored, "dissipated_J": None if none else lost,
                    "time_s": state.time, "steps_in_time": len(state.times)}  # fmt: skip
        facts = solution.facts | mesh_facts(static.mesh) | {"energies_in_time": energies}
        left = None if found.left is None else static.unknowns.moved(found.left).reshape(-1, 3)
        pressures = static.unknowns.cell_pressures(static.solid, static.pieces, state.x)
        moved = MeshWithHistory(
            static.mesh, u, pressures=pressures, left=left, past=self._displacement_history(state), aged=state
        )
        ring = vibrations.undefined_frequencies("frequencies of a viscoelastic body are not available")
        seen = replace(solution, facts=facts, notes=notes, mesh=moved, vibrations=ring)
        return replace(seen, carried=cache(lambda: self._nodal_forces(state, x, stored, lost)))

    def _displacement_history(self, state: StateInTime) -> DisplacementHistory:
        """Return the history of nodal displacements."""
        each = tuple(self.static.unknowns.moved(x).reshape(-1, 3) for x in state.states)
        return DisplacementHistory(state.times, each)

    def _nodal_forces(self, state: StateInTime, u: Floats, stored: float, lost: float) -> nodal_forces.NodalForces:
        """Return the nodal forces in a state with `stored` and dissipated (`lost`) energy, J."""
        small = self.static.model.strain == "small"
        if state.problem is None:
            raise ValueError("no step was solved")
        found = nodal_forces.on_mesh(self.mesh, state.x, u, state.problem.assembly, self.applied, small, True,
                                self.static.axial, self.muscle_energies)  # fmt: skip
        found = replace(found, energy=stored, dissipated=lost)
        return nodal_forces.add_foundation_forces(found, self.static.beds) if self.static.beds else found

    def _dissipation_warnings(self, state: StateInTime) -> Iterator[Diagnostic]:
        """Yield a warning if the dissipated energy decreases in time, which is physically impossible."""
        yield from dissipation_warnings(self.static.declared, np.array((0.0, *state.losses)), abs(state.work),
                             state.memories.has_unknown_energy)  # fmt: skip


# ------------------------------------------------------------------ building


def build_relaxation_dynamics(model: Fem, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the dynamic analysis of a viscoelastic solid. Raises Fault."""
    from softmark.solvers.dynamics.implicit_midpoint import Midpoint
    from softmark.solvers.dynamics.viscoelastic_step import ViscoelasticStep

    static, parts = build_static(model, declared, case, workshop)
    known = _energies_with_history(model, static)
    mesh, mass, pulling = static.mesh, mass_of(model, case, static.mesh, parts), len(static.muscles)
    made = solid_dynamics.build_solid_dynamics(
        static, declared, case, mesh, mass, known.energies, static.amplitude_scaled_energies, static.problem, pulling
    )
    remembering = ViscoelasticStep(known, isinstance(made.problem.integrator, Midpoint))
    return replace(made, problem=replace(made.problem, remembering=remembering, lagged=False))


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
    static = replace(static, problem=replace(problem, assembly=assembly, twin=None))
    owners = support_of_each_dof(whole, static.mesh, workshop, problem.fixed)
    return PreparedViscoelastic(
        static,
        case,
        memories,
        LoadAndSupportAmplitudes.of(whole, static.amplitude_scaled_energies, owners, problem.target),
    )


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
