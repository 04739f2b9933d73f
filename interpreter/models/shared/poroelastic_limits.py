"""Checks of poroelastic bodies: invalid materials, and models, analyses and options that do not support pore fluid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.option_limits import POROELASTIC_OPTIONS
from softmark.interpreter.problem.body_case import porous
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.solvers.elements import find_element

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case

ANALYSIS_EXAMPLE = "`analysis wait = quasistatic(duration = 100 s, step = 1 s)`"


def check_material(case: Case) -> Iterator[Diagnostic]:
    """Yield the error about an invalid poroelastic material of a case, or about one in plane stress."""
    if case.planar == "plane_stress":
        yield diagnostic(
            "E435",
            case.body.at("material"),
            f"`{case.body.name}` is in plane stress, which a poroelastic material does not support",
            "not in plane stress",
            "use `plane_strain`, a `solid` as thick as the plate, or only the drained law",
        )
    elif problem := next(filter(None, map(_material_problem, case.typical)), None):
        yield diagnostic(
            "E370",
            case.body.at("material"),
            f"the poroelastic material of `{case.body.name}` is invalid: {problem[0]}",
            problem[1],
            problem[2],
        )


def check_model(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors if the analysis, a varying material or the options of a model do not allow a poroelastic body."""
    if not isinstance(case.analysis, Quasistatic):
        yield diagnostic("E373", declared.at(), f"`{case.body.name}` is poroelastic, which needs a "
                                                "quasistatic analysis", "needs a quasistatic analysis",
                         f"write {ANALYSIS_EXAMPLE}, or use only the drained law")  # fmt: skip
    elif case.parts or not case.uniform or getattr(case.material.law, "turning", False):
        yield diagnostic(
            "E375",
            case.body.at("material"),
            f"`{case.body.name}` is poroelastic, but its material varies in space",
            "needs one material",
            "remove the regions and fields of the body",
        )
    else:
        yield from _solid_option_errors(declared, case)


def _material_problem(material: Any) -> tuple[str, str, str] | None:
    """Return the problem, label and help of an error about a material; None if the material is valid."""
    if not porous(material):
        return None
    law = material.law
    if porous(law) or not hasattr(material, "permeable_slope"):
        return (
            "`biphasic` is nested in another material",
            "nested biphasic material",
            "write `biphasic(LAW, ...)` with an elastic law",
        )
    if law.branches:
        return "its skeleton is viscoelastic", "cannot be combined", "use an elastic law for the skeleton"
    if hasattr(law, "passive"):
        return "its skeleton is an active material", "cannot be combined", "use an elastic law for the skeleton"
    if law.incompressible:
        return ("its skeleton is incompressible, so no fluid can leave it", "no drained volume",
                "write the drained Poisson's ratio of the law, such as 0.2")  # fmt: skip
    return None


def _solid_option_errors(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for options of a finite element model, supports and plane stress that do not allow pore fluid.

    Also yields the warning W395 about a body from which no fluid can leave.
    """
    model = declared.thing
    if find_element(model.element).pressures != "corners":
        flat = case.planar != ""
        help = "use `tri6` or `quad9`" if flat else "use `tet10`, `hex20` or `hex27`"
        yield diagnostic(
            "E374",
            declared.at("element"),
            f"{model.element} has no continuous pressure interpolation, which pore pressure needs",
            "no Taylor-Hood element",
            help,
        )
    yield from POROELASTIC_OPTIONS.excluded_value_errors(declared, case)
    if model.strain == "corotational":
        yield diagnostic(
            "E374",
            declared.at("strain"),
            f"`{declared.name}` with corotational strain does not support fluid",
            "not with fluid",
            "use `strain = finite` or `small`",
        )
    if model.strain == "small" and (case.material.exponent or case.material.stiffening):
        yield diagnostic("E374", declared.at("strain"), f"the permeability of `{case.body.name}` depends on "
                                                        "the volume change, which small strain does not "
                                                        "represent", "ignored by small strain",
                         "use `strain = finite`, or remove `exponent` and `stiffening`")  # fmt: skip
    if turning := next((s for s in case.supports if s.thing.rotates), None):
        yield diagnostic("E374", turning.at(), f"`{turning.name}` rotates a poroelastic body", "not with fluid",
                         "use `displaced(...)` instead")  # fmt: skip
    if not case.drains:
        yield diagnostic("W395", case.body.at(), f"no fluid can leave `{case.body.name}`: all its faces are sealed",
                         "keeps its volume", "let the fluid out: `support open = drained("
                         f"{case.body.name}, where = z >= 10 mm)`")  # fmt: skip
    if case.planar == "plane_stress":
        yield diagnostic("E374", case.body.at(), f"`{case.body.name}` is in plane stress, so fluid would "
                                                 "leave through its faces",
                         "not in plane stress", "use a thin solid, or `plane_strain`")  # fmt: skip
