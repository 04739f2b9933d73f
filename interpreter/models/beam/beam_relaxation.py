"""Viscoelastic beams: forces and moments of cross-sections relax like the stress of the material.

Cross-sections stay plane and strains are small. Stretch and bending therefore relax with Young's modulus, and
shear and torsion with the shear modulus. If the bulk modulus does not relax, these two moduli have different
series.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.beam_builder import PreparedBeam, build_static
from softmark.interpreter.models.beam.beam_nodal_forces import nodal_forces_of_beam
from softmark.interpreter.models.beam.beam_supports import held_values
from softmark.interpreter.models.postprocessing import vibrations
from softmark.interpreter.models.postprocessing.mesh_stress import StoredStress
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.prepared_model import BuildContext, Meshless, Prepared, Solution
from softmark.interpreter.models.shared.quasistatic_times import LoadAndSupportAmplitudes, case_at_full_size
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.implicit_midpoint import Midpoint
from softmark.solvers.dynamics.viscoelastic_step import ViscoelasticStep
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.rod_state import displacement_at
from softmark.solvers.energies.viscoelastic_memory import BodyHistory
from softmark.solvers.energies.viscoelastic_rod import RodHistory
from softmark.solvers.materials.viscoelastic import Viscoelastic
from softmark.solvers.materials.youngs_relaxation import young_series
from softmark.solvers.statics.quasistatic_history import StateInTime, advance_through, state_at_rest

if TYPE_CHECKING:
    from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
    from softmark.solvers.statics.static_equilibrium import Watch

NO_STRESS = "section stress of a viscoelastic beam is not available: use forces"


@dataclass(frozen=True)
class BeamHistory:
    """Displacement field of a viscoelastic beam at the present time, with the fields `past` at `times` (t,), s."""

    now: Callable[[Floats], Floats]
    times: tuple[float, ...]
    past: tuple[Callable[[Floats], Floats], ...]

    def __call__(self, X: Floats) -> Floats:
        """Return the displacements of points X (n, 3), m."""
        return self.now(X)


@dataclass(frozen=True)
class ViscoelasticBeam(Meshless):
    """Viscoelastic beam in a quasistatic analysis.

    `static` is the same beam with all loads at full size and with the instantaneous stiffness.
    """

    static: PreparedBeam
    case: Case
    memories: BodyHistory
    timed: LoadAndSupportAmplitudes

    @property
    def size(self) -> dict[str, int]:
        """Numbers of nodes, elements and degrees of freedom, by name."""
        return self.static.size

    @property
    def points(self) -> Floats:
        """Undeformed nodes of the axis (n, 3), m."""
        return self.static.points

    def forces(self) -> list[tuple[Declared, Floats]]:
        """Return each load at the present time with its forces and moments (n, 6), N and N m."""
        shares = self.timed.at(self.timed.analysis.now, False).shares
        return [(load, share * f) for (load, f), share in zip(self.static.forces(), shares, strict=True)]

    def warm(self) -> None:
        """Load the libraries that the static beam needs, before timing starts."""
        self.static.warm()

    def solve(self, watch: Watch) -> Solution:
        """Return the solution at the present time, by time steps from the start."""
        remedy = "use a shorter step, more segments or a smaller load"
        problem = replace(self.static.problem, watch=watch)
        came: list[StateInTime] = []

        def find() -> Any:
            """Return the equilibrium at the present time."""
            came.append(advance_through(problem, state_at_rest(problem, self.memories), self.timed.after(None)))
            found: Any = came[0].found
            return replace(found, history=came[0].history)

        return static_result.solve_static(find, remedy, lambda found: self._make_solution(found, came[0]))

    def _make_solution(self, found: Any, state: StateInTime) -> Solution:
        """Return the solution of a state, with its energies and its history."""
        rest, along = self.static.rest, self.static.along

        def moved(x: Floats) -> Callable[[Floats], Floats]:
            """Return the displacement field of a state x (nodes * 7,)."""
            return lambda X: displacement_at(x, rest, X, along)

        solution = static_result.solution_of(
            found, BeamHistory(moved(state.x), state.times, tuple(map(moved, state.states)))
        )
        energies = {"work_J": state.work, "stored_J": state.stored, "dissipated_J": state.dissipated,
                    "time_s": state.time, "steps_in_time": len(state.times)}  # fmt: skip
        facts = solution.facts | {"energies_in_time": energies}
        ring = vibrations.undefined_frequencies("frequencies of a viscoelastic beam are not available")
        seen = replace(
            solution,
            facts=facts,
            notes=static_result.uniqueness_warnings(self.static.declared, found),
            vibrations=ring,
            stress=StoredStress(None, NO_STRESS),
        )
        return replace(seen, carried=cache(lambda: self._nodal_forces(state)))

    def _nodal_forces(self, state: StateInTime) -> Any:
        """Return the nodal forces in a state."""
        assert state.problem is not None
        acting = self.timed.acting(self.static.applied, state.time)
        found = nodal_forces_of_beam(replace(state.problem, rest=self.static.rest), state.x, acting)
        return replace(found, energy=state.stored, dissipated=state.dissipated)


def prepare(model: Beam6Dof, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the quasistatic or dynamic analysis of a viscoelastic beam. Raises Fault."""
    if isinstance(case.analysis, Dynamic):
        return _build_dynamics(model, declared, case)
    whole = case_at_full_size(case)
    static = build_static(model, declared, whole)
    problem = static.problem
    loads = [energy for _, energy in static.applied]
    assembly = Assembly(problem.assembly.dofs, problem.fixed, [static.elastic], loads)
    static = replace(static, problem=replace(problem, assembly=assembly))
    g, tau = section_relaxation_series(case.material)
    memories = BodyHistory((RodHistory.at_rest(static.elastic, g, tau),))
    held = held_values(whole, static.stations.tolist())
    owners = [held[dof][1] for dof in problem.fixed.tolist()]
    return ViscoelasticBeam(
        static, case, memories, LoadAndSupportAmplitudes.of(whole, static.applied, owners, problem.target)
    )


def _build_dynamics(model: Beam6Dof, declared: Declared, case: Case) -> Prepared:
    """Build the dynamic analysis of a viscoelastic beam."""
    from softmark.interpreter.models.beam.beam_dynamics import build_beam_dynamics

    static = build_static(model, declared, case)
    made = build_beam_dynamics(static, declared, case, static.elastic, static.problem, static.mass(), static.applied)
    rods: Any = made.problem.assembly.internal[0]
    memories = BodyHistory((RodHistory.at_rest(rods, *section_relaxation_series(case.material)),))
    remembering = ViscoelasticStep(memories, isinstance(made.problem.integrator, Midpoint))
    return replace(made, problem=replace(made.problem, remembering=remembering))


def section_relaxation_series(material: Viscoelastic) -> tuple[Floats, Floats]:
    """Return the relaxing fractions (k, 6) of the section stiffnesses, and their relaxation times (k,), s.

    The six stiffnesses are those of stretch, two shears, twist and two bendings.
    """
    g, tau = (np.array(column) for column in zip(*material.branches, strict=True))
    if material.of == "whole" or material.poisson == 0.5:
        return np.tile(g[:, None], (1, 6)), tau
    own, late = young_series(g, tau, material.shear_modulus, material.bulk_modulus)
    stretched, sheared = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 1.0]), np.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    return np.concatenate([np.outer(own, stretched), np.outer(g, sheared)]), np.concatenate([late, tau])
