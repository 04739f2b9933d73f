"""Stress of a model that was solved on a mesh. It is imported and computed only on first use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from softmark.interpreter.models.shared.prepared_model import DeformedMesh, Solution
from softmark.interpreter.results.state_results import TimeState
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.values_in_states import in_state_of_value
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.models.shared.model_declaration import Model
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.stress_recovery.stress_field import Stresses

INSIDE = 1e-9  # of the duration: how long before the end amplitudes are evaluated


def add_stress(scene: Scene, declared: Declared, case: Case, solution: Solution) -> Solution:
    """Return the solution with a stress function added; a reduced model uses the law of its full model."""
    if solution.displacement is None or solution.mesh is None:
        return replace(
            solution, stress=None if isinstance(declared.thing.stress_law, str) else _stress_without_mesh(solution)
        )
    of = declared.thing.reduces
    solid = declared if of is None else scene.declared[of]
    if of is not None:
        from softmark.interpreter.problem.body_case import case_for

        case = case_for(scene, solid)
    return replace(solution, stress=stress_of(solid.thing, case, solution.mesh))


def _stress_without_mesh(solution: Solution) -> Callable[[], Stresses] | None:
    """Return the stress function of a model without a mesh; None in dynamic analyses, which do not provide one."""
    moved = StoredStress(None, "section stress needs a static analysis of the beam")
    return solution.stress or (None if solution.displacement is None else moved)


def stress_of(model: Model, case: Case, mesh: DeformedMesh) -> Callable[[], Stresses]:
    """Return a function that computes the stress of a model on its mesh, once.

    The function raises StressUnavailable with a reason.
    """
    return StressOfMesh(model, _case_at_end(case), mesh)


@dataclass(frozen=True, eq=False)
class StressOfMesh:
    """Function that computes the stress of a model on its mesh.

    If it is pickled for a report, only the stress is stored, not the case.
    """

    model: Model
    case: Case
    mesh: DeformedMesh

    def __call__(self) -> Stresses:
        """Return the stress. Raises StressUnavailable with a reason."""
        return self._computed_stress

    def __reduce__(self) -> tuple[Any, ...]:
        from softmark.solvers.stress_recovery.sampling_point_stress import StressUnavailable

        try:
            return StoredStress, (self._computed_stress, None)
        except StressUnavailable as none:
            return StoredStress, (None, str(none))

    @cached_property
    def _computed_stress(self) -> Stresses:
        from softmark.solvers.stress_recovery.sampling_point_stress import DeformedState, StressUnavailable
        from softmark.solvers.stress_recovery.stress_field import Stresses

        case, mesh, how = self.case, self.mesh, self.model.stress_law
        if isinstance(how, str):
            raise StressUnavailable(how)
        strain, way = how
        if case.porous:
            raise StressUnavailable(
                "the stress of a poroelastic body (skeleton and fluid) is not recovered at points: use forces"
            )
        if case.has_material_history:
            raise StressUnavailable("the stress of a viscoelastic body is not recovered at points: use forces")
        u = mesh.displacement.astype(float)  # also for states in single precision
        around = case.depth > 0.0
        state = DeformedState(mesh.mesh, case.material, strain, u, way, mesh.pressures, bool(case.planar), around)
        if not case.uniform:
            from softmark.interpreter.models.shared.heterogeneous_material import material_at

            state = replace(state, at=material_at)
        if not case.parts:
            return Stresses(state)
        from softmark.interpreter.models.shared.region_cells import materials_of_cells
        from softmark.solvers.stress_recovery.multi_material_recovery import MultiMaterialStresses

        return MultiMaterialStresses.of(state, case.materials, materials_of_cells(case, mesh.mesh).cells)


@dataclass(frozen=True, eq=False)
class StoredStress:
    """Function that returns a stored stress, or raises the reason why there is none."""

    stress: Stresses | None
    reason: str | None

    def __call__(self) -> Stresses:
        """Return the stress. Raises StressUnavailable with the reason."""
        if self.stress is None:
            from softmark.solvers.stress_recovery.sampling_point_stress import StressUnavailable

            raise StressUnavailable(self.reason)
        return self.stress


def _case_at_end(case: Case) -> Case:
    """Return a dynamic case with muscle activation as at its end, just before any jump; other cases unchanged."""
    analysis = case.analysis
    if not isinstance(analysis, Dynamic) or all(muscle.thing.amplitude is None for muscle in case.muscles):
        return case
    end = TimeState(analysis.duration * (1.0 - INSIDE))

    def seen(made: Declared) -> Declared:
        return replace(made, thing=made.thing.in_state(0, end))

    other = case.other_material
    if getattr(other, "amplitude", None) is not None:
        other = in_state_of_value(other, end)
    return replace(case, body=seen(case.body), parts=tuple(map(seen, case.parts)), other_material=other)
