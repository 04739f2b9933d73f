"""The stress of a model that was solved on a mesh: nothing of it is imported or computed before it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

from softmark.interpreter.models.shared.prepared import Moved, Solution

if TYPE_CHECKING:
    from softmark.interpreter.language.scene import Declared, Scene
    from softmark.interpreter.models.shared.model import Model
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.stresses.field import Stresses


def stressed(scene: Scene, declared: Declared, case: Case, solution: Solution) -> Solution:
    """The solution, able to tell its stress: of a reduced model, by the law of what it reduces."""
    if solution.displacement is None or solution.mesh is None:
        return replace(
            solution, stress=None if isinstance(declared.thing.stress_law, str) else _at_rest_alone(solution)
        )
    of = declared.thing.reduces
    solid = declared if of is None else scene.declared[of]
    if of is not None:
        from softmark.interpreter.problem.case import case_for

        case = case_for(scene, solid)
    return replace(solution, stress=stress_of(solid.thing, case, solution.mesh))


def _at_rest_alone(solution: Solution) -> Callable[[], Stresses] | None:
    """The stress of a model without a mesh, which it tells of a state of rest."""

    def refused() -> Stresses:
        from softmark.solvers.stresses.sampled import NoStress

        raise NoStress("the stress of sections is known of beams at rest, and this is a motion")

    return solution.stress or (None if solution.displacement is None else refused)


def stress_of(model: Model, case: Case, mesh: Moved) -> Callable[[], Stresses]:
    """What tells the stress of a model from its mesh, made once. It raises NoStress, with a reason."""

    @cache
    def made() -> Stresses:
        from softmark.solvers.stresses.field import Stresses
        from softmark.solvers.stresses.sampled import NoStress, State

        how = model.stress_law
        if isinstance(how, str):
            raise NoStress(how)
        strain, way = how
        if case.remembers:
            raise NoStress("its stress is that of its past, which is not recovered to points: ask for forces")
        u = mesh.displacement.astype(float)  # of single precision too
        around = case.depth > 0.0
        state = State(mesh.mesh, case.material, strain, u, way, mesh.pressures, bool(case.planar), around)
        if not case.uniform:
            from softmark.interpreter.models.shared.graded import material_at

            state = replace(state, at=material_at)
        if not case.parts:
            return Stresses(state)
        from softmark.interpreter.models.shared.regions import owners
        from softmark.solvers.stresses.layers import Layers

        return Layers.of(state, case.materials, owners(case, mesh.mesh).cells)

    return made
