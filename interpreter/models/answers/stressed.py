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
        return solution
    of = declared.thing.reduces
    solid = declared if of is None else scene.declared[of]
    if of is not None:
        from softmark.interpreter.problem.case import case_for

        case = case_for(scene, solid)
    return replace(solution, stress=stress_of(solid.thing, case, solution.mesh))


def stress_of(model: Model, case: Case, mesh: Moved) -> Callable[[], Stresses]:
    """What tells the stress of a model from its mesh, made once. It raises NoStress, with a reason."""

    @cache
    def made() -> Stresses:
        from softmark.solvers.stresses.field import Stresses
        from softmark.solvers.stresses.sampled import NoStress, State

        if case.parts:  # what is recovered is continuous, and stress is not where they meet
            raise NoStress(
                "stress and strain at points are told of bodies of one material only, and this has parts of another"
            )
        how = model.stress_law
        if isinstance(how, str):
            raise NoStress(how)
        strain, way = how
        u = mesh.displacement.astype(float)  # of single precision too
        return Stresses(
            State(mesh.mesh, case.material, strain, u, way, mesh.pressures, bool(case.planar), case.depth > 0.0)
        )

    return made
