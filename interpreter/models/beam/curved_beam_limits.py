"""Limits of beams with a curved axis: unsupported features, and the error of slender rod theory."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.interpreter.vocabulary.supports.support import UniformSupport
from softmark.solvers.mesh.shape import Prism

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.shape import Swept

HELP = (
    "use a static analysis with gravity, forces, or tractions and torques on an end, and hold whole "
    "sections; or use `fem(...)`"
)


def curved_beam_errors(declared: Declared, case: Case) -> list[Diagnostic]:
    """Return errors for features of a case that only straight beams support."""
    if isinstance(case.prism, Prism):
        return []
    found = []
    if isinstance(case.analysis, Dynamic):
        found.append(_straight_beam_error(declared, declared, "does not support dynamic analyses"))
    for load in case.loads:
        if not isinstance(load.thing.action, BodyForce | SurfaceTraction | PointLoad | MomentLoad):
            found.append(_straight_beam_error(declared, load, f"cannot represent the load `{load.name}`"))
    for support in case.supports:
        if not isinstance(support.thing, UniformSupport):
            found.append(_straight_beam_error(declared, support, f"cannot represent the support `{support.name}`"))
    return found


def _straight_beam_error(declared: Declared, at: Declared, what: str) -> Diagnostic:
    """Return the error that a feature, described by `what`, needs a straight beam."""
    problem = f"`{declared.name}` {what} for a curved axis"
    return diagnostic("E317", at.at(), problem, "only for straight beams", HELP)


def slender_rod_error(shape: Swept) -> float:
    """Return the relative error of slender rod theory for a rod that is curved at rest: (width / radius)^2.

    The width is that in the plane of the curve. Fibres on the inner side are shorter than the axis, so that stress
    is not linear over the section and stretch is coupled with bending. Both effects are of second order (Winkler
    1858; Timoshenko and Goodier 1970, section 29). The estimate is conservative: tests/interpreter/test_arcs.py
    compares it with solids.
    """
    return (max(shape.section.extents) * shape.axis_curvature) ** 2
