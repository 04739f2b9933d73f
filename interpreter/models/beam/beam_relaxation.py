"""Viscoelastic beams: forces and moments of cross-sections relax like the stress of the material.

Cross-sections stay plane and strains are small. Stretch and bending therefore relax with Young's modulus, and
shear and torsion with the shear modulus. If the bulk modulus does not relax, these two moduli have different
series.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.beam_builder import PreparedBeam, build_static
from softmark.interpreter.models.beam.beam_nodal_forces import nodal_forces_of_beam
from softmark.interpreter.models.beam.beam_supports import held_values
from softmark.interpreter.models.postprocessing import vibrations
from softmark.interpreter.models.postprocessing.mesh_stress import StoredStress
from softmark.interpreter.models.procedures.quasistatic_analysis import Loads, QuasistaticAnalysis, energies_in_time
from softmark.interpreter.models.procedures.quasistatic_times import LoadAndSupportAmplitudes, case_at_full_size
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.implicit_midpoint import Midpoint
from softmark.solvers.dynamics.viscoelastic_step import ViscoelasticStep
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.viscoelastic_memory import BodyHistory
from softmark.solvers.energies.viscoelastic_rod import RodHistory
from softmark.solvers.materials.viscoelastic import Viscoelastic
from softmark.solvers.materials.youngs_relaxation import young_series

if TYPE_CHECKING:
    from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
    from softmark.interpreter.models.postprocessing.nodal_forces import NodalForces
    from softmark.solvers.statics.quasistatic_history import StateInTime
    from softmark.solvers.statics.static_equilibrium import Equilibrium

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
class BeamWithHistory(PreparedBeam):
    """Viscoelastic beam, with all loads at full size and with the instantaneous stiffness."""

    inner_stages: ClassVar[tuple[float, ...]] = ()
    remedy: ClassVar[str] = "use a shorter step, more segments or a smaller load"
    describe_free_motion: ClassVar[None] = None

    @property
    def amplitude_scaled_energies(self) -> tuple[tuple[Declared, Energy], ...]:
        """Energy of each load."""
        return self.applied

    def scaled_forces(self, shares: Sequence[float]) -> list[Floats]:
        """Return forces and moments (n, 6), N and N m, of each load at a share of its full size."""
        return [share * f for (_, f), share in zip(self.forces(), shares, strict=True)]

    def solution_in_time(self, found: Equilibrium, state: StateInTime, acting: Loads) -> Solution:
        """Return the solution of a state, with its energies and its history."""
        past = tuple(map(self.displacement_field, state.states))
        moved = BeamHistory(self.displacement_field(state.x), state.times, past)
        solution = static_result.solution_of(found, moved)
        return replace(
            solution,
            facts=solution.facts | energies_in_time(state),
            notes=static_result.uniqueness_warnings(self.declared, found),
            vibrations=vibrations.undefined_frequencies("frequencies of a viscoelastic beam are not available"),
            stress=StoredStress(None, NO_STRESS),
            carried=cache(lambda: self._nodal_forces_in_time(state, acting)),
        )

    def _nodal_forces_in_time(self, state: StateInTime, acting: Loads) -> NodalForces:
        """Return the nodal forces in a state under the `acting` loads."""
        assert state.problem is not None
        found = nodal_forces_of_beam(replace(state.problem, rest=self.rest), state.x, acting)
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
    known = {f.name: getattr(static, f.name) for f in fields(static)}
    beam = BeamWithHistory(**known | {"problem": replace(problem, assembly=assembly)})
    g, tau = section_relaxation_series(case.material)
    memories = BodyHistory((RodHistory.at_rest(static.elastic, g, tau),))
    held = held_values(whole, static.stations.tolist())
    owners = [held[dof][1] for dof in problem.fixed.tolist()]
    timed = LoadAndSupportAmplitudes.of(whole, static.applied, owners, problem.target)
    return QuasistaticAnalysis(beam, case, memories, timed)


def _build_dynamics(model: Beam6Dof, declared: Declared, case: Case) -> Prepared:
    """Build the dynamic analysis of a viscoelastic beam."""
    from softmark.interpreter.models.beam.beam_dynamics import beam_dynamics
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis

    static = build_static(model, declared, case)
    problem = beam_dynamics(case, static.elastic, static.problem, static.mass(), static.applied)
    rods: Any = problem.assembly.internal[0]
    memories = BodyHistory((RodHistory.at_rest(rods, *section_relaxation_series(case.material)),))
    remembering = ViscoelasticStep(memories, isinstance(problem.integrator, Midpoint))
    return DynamicAnalysis(static, declared, case, replace(problem, remembering=remembering))


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
