"""Setup of beam theories: makes the straight cantilever of a case."""

from __future__ import annotations

import math
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import end_frame, single_selected_end
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.references.straight_cantilever import ALIGNMENT, Cantilever, Disc, NotApplicable, Rectangle, Ring
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.tubes import Tube


class CantileverSetup(TheorySetup):
    """Makes the problem of a straight beam with one clamped end that bends under its own weight."""

    admits_motion = True

    def problem_from(self, reference: Declared, case: Case) -> Cantilever:
        shape = case.shape
        if not isinstance(shape, Cylinder | Tube | Box):
            raise NotApplicable(f"`{case.body.name}` is not a straight body with a constant section",
                          "use a cylinder, a tube or a box")  # fmt: skip
        for part in case.parts:
            raise NotApplicable(f"the region `{part.name}` of `{case.body.name}` has another material",
                          "compare with a model, `self_converged(...)`: beam theory supports one material")  # fmt: skip
        for load in case.loads:
            if not isinstance(load.thing.action, BodyForce):
                raise NotApplicable(f"the load `{load.name}` is not gravity",
                              "remove this load: the reference supports only a beam under its own weight")  # fmt: skip
        if not any(case.gravity):
            raise NotApplicable("there is no gravity, so nothing bends the beam",
                          "add a load across the axis: `load weight = gravity(9.81 m/s^2)`")  # fmt: skip
        root, axis = clamped_end(case)
        young = reference.thing.own_young or case.material.young
        return Cantilever(shape.length, _declared_cross_section(case), young, case.material.poisson,
                          case.material.density, root, axis, case.gravity)  # fmt: skip


def clamped_end(case: Case) -> tuple[Any, Any]:
    """Return the centre of the clamped end, m, and the unit vector along the axis from it to the free end.

    Raises NotApplicable unless supports clamp exactly one end and hold nothing else.
    """
    shape = case.prism
    clamped = []
    for support in case.supports:
        thing = support.thing
        if not isinstance(thing, DisplacementSupport) or thing.moves or len(thing.components) < 3:
            raise NotApplicable(f"the support `{support.name}` is not a clamp",
                          "use `fixed(body, where = ...)` with all components")  # fmt: skip
        if (end := single_selected_end(thing.where, shape)) is None:
            raise NotApplicable(f"the support `{support.name}` does not clamp exactly one end face",
                          "hold one end only, as in `where = x <= 0 mm`")  # fmt: skip
        clamped.append(end)
    if len(set(clamped)) != 1:
        count = "no" if not clamped else "more than one"
        raise NotApplicable(f"{count} end of `{case.body.name}` is clamped",
                      "clamp one end: `fixed(body, where = x <= 0 mm)`")  # fmt: skip
    return end_frame(shape, clamped[0])


def _declared_cross_section(case: Case) -> Disc | Ring | Rectangle:
    """Return the cross-section by the radii of the scene, or by the side lengths of its box.

    Models compute their sections elsewhere, so that a mistake in their sections shows as a difference from the theory.
    """
    shape = case.shape
    if isinstance(shape, Cylinder):
        return Disc(shape.radius)
    if isinstance(shape, Tube):
        return Ring(shape.radius, shape.inner)
    if not isinstance(shape, Box):
        raise TypeError("neither a cylinder, a tube nor a box")
    first, second = (i for i in range(3) if abs(shape.axis[i]) < 0.5)
    pulls = abs(case.gravity[first]), abs(case.gravity[second])
    if min(pulls) > ALIGNMENT * math.hypot(*pulls):
        raise NotApplicable(
            "gravity is oblique to the sides of the section", "rotate gravity: the beam would bend sideways"
        )
    height, width = (first, second) if pulls[0] > pulls[1] else (second, first)
    return Rectangle(height=shape.size[height], width=shape.size[width])
