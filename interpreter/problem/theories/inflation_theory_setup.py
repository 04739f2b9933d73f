"""Setup of the theory of an inflated rubber ball."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.rubber_constants import rubber_of
from softmark.interpreter.problem.theories.inclusion_theory_setup import (
    check_symmetry_supports,
    depends_on_radius,
    holds_at_radius,
    inclusion_in_ball,
)
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.vocabulary.loads.pressure import PressureLoad
from softmark.references.rubber_inflation import BlownBall
from softmark.references.straight_cantilever import NotApplicable

PRESSED = "one `pressure(...)` on the whole inner surface, and no other load"


class InflationSetup(TheorySetup):
    """Makes the problem of a thick-walled rubber ball that an inner pressure inflates."""

    def problem_from(self, reference: Declared, case: Case) -> BlownBall:
        if case.parts:
            raise NotApplicable(
                f"`{case.body.name}` does not consist of one material", "use one material for the whole body"
            )
        inner, outer, centre = inclusion_in_ball(case)
        check_symmetry_supports(case, (0, 1, 2) if not case.planar else (1,), centre, outer)
        if len(case.loads) != 1 or not isinstance(case.loads[0].thing.action, PressureLoad):
            raise NotApplicable("its load is not one pressure", f"use {PRESSED}")
        load = case.loads[0]
        action, extent = load.thing.action, case.shape.diagonal
        around = depends_on_radius(action.where, centre, outer, bool(case.planar))
        if (
            not around
            or not holds_at_radius(action.where, centre, inner, extent)
            or holds_at_radius(action.where, centre, outer, extent)
        ):
            raise NotApplicable(
                f"the load `{load.name}` does not act on exactly the whole inner surface", f"use {PRESSED}"
            )
        return BlownBall(inner, outer, rubber_of(case), case.material.poisson, action.pressure, centre)

    def facts(self, solution: Any) -> Mapping[str, Any]:
        limit = solution.limit
        return {"limit": None if limit is None else {"stretch": limit[0], "pressure_Pa": limit[1]}}
