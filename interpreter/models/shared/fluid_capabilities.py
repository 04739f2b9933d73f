"""Checks of which models and analyses support poroelastic bodies, that is bodies filled with fluid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import porous
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.solvers.elements import find_element

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case

TIMED = "`analysis wait = quasistatic(duration = 100 s, step = 1 s)`"
# levers that change how a state is solved, and what they may be
PLAIN = {
    "formulation": "displacement",
    "integration": "full",
    "rotation": "point",
    "precision": "double",
    "initial_guess": None,
    "max_iterations": None,
    "max_linear_iterations": None,
    "factorisation": "fresh",
}
LINEAR = ("conjugate_gradients", "multigrid")


def refusals(model: Any, declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors of a model of a body that contains fluid."""
    if case.planar == "plane_stress":
        yield diagnostic("E435", case.body.at("material"), f"`{case.body.name}` is in plane stress, which is not known"
                         " of a material full of fluid", "not in plane stress", "use `plane_strain`, a `solid` as thick"
                         " as the plate, or the drained law by itself")  # fmt: skip
        return
    if problem := next(filter(None, map(_invalid_material, case.typical)), None):
        yield diagnostic("E370", case.body.at("material"), f"the material of `{case.body.name}` holds no fluid:"
                         f" {problem[0]}", problem[1], problem[2])  # fmt: skip
    elif not getattr(model, "soaks", False):
        yield diagnostic("E372", declared.at(), f"`{declared.name}` knows no fluid, and `{case.body.name}` is full of"
                         " it", "a model of solids alone",
                         "use `fem(tet10, ...)`, or the drained law by itself")  # fmt: skip
    elif not isinstance(case.analysis, Quasistatic):
        yield diagnostic("E373", declared.at(), f"fluid seeps through `{case.body.name}` in time, and the analysis"
                         " follows none without inertia", "needs a time history",
                         f"declare {TIMED}, or use the drained law by itself")  # fmt: skip
    elif case.parts or not case.uniform or getattr(case.material.law, "turning", False):
        yield diagnostic("E375", case.body.at("material"), f"`{case.body.name}` is full of fluid, and not the same"
                         " everywhere", "of one material", "leave out its parts and fields")  # fmt: skip
    else:
        yield from _refuse_solid_options(model, declared, case)


def refuse_unused_drains(case: Case) -> Iterator[Diagnostic]:
    """Yield errors for fluid supports on a body without fluid."""
    for drain in case.drains:
        yield diagnostic("E371", drain.at(), f"`{drain.name}` lets fluid through `{case.body.name}`, and there is none"
                         " in it", "no fluid", "make it of `biphasic(LAW, permeability = 1e-15 m^4/(N*s))`, or leave"
                         " the support out")  # fmt: skip


def _invalid_material(material: Any) -> tuple[str, str, str] | None:
    """Return the problem, label and help of an error about a material; None if the material is valid."""
    if not porous(material):
        return None
    law = material.law
    if porous(law) or not hasattr(material, "permeable_slope"):
        return "it is biphasic within another material", "one in another", "use `biphasic(LAW, ...)` of an elastic law"
    if law.branches:
        return "the law of its skeleton relaxes", "not together", "use an elastic law for the skeleton"
    if hasattr(law, "passive"):
        return "the law of its skeleton pulls", "not together", "use an elastic law for the skeleton"
    if law.incompressible:
        return ("its skeleton keeps its volume, so that nothing can leave it", "no drained volume",
                "give the law the Poisson's ratio that it has once drained, such as 0.2")  # fmt: skip
    return None


def _refuse_solid_options(model: Any, declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for options of a finite element model that do not support fluid."""
    if find_element(model.element).pressures != "corners":
        flat = case.planar != ""
        help = "use `tri6` or `quad9`" if flat else "use `tet10`, `hex20` or `hex27`"
        yield diagnostic("E374", declared.at("element"), f"{model.element} has no pressures that are continuous, and"
                         " those of fluid are", "no Taylor-Hood element", help)  # fmt: skip
    for lever, plain in PLAIN.items():
        if (given := getattr(model, lever)) != plain:
            yield _refuse_option(declared, lever, given, case)
    if model.linear in LINEAR:
        yield _refuse_option(declared, "linear", model.linear, case)
    if model.strain == "corotational":
        yield diagnostic("E374", declared.at("strain"), f"`{declared.name}` turns with its cells, and fluid in them is"
                         " not followed", "not with fluid", "use `strain = finite` or `small`")  # fmt: skip
    if model.strain == "small" and (case.material.exponent or case.material.stiffening):
        yield diagnostic("E374", declared.at("strain"), f"the permeability of `{case.body.name}` changes with the"
                         f" volume, and small strain knows of no such change", "not followed",
                         "use `strain = finite`, or leave `exponent` and `stiffening` out")  # fmt: skip
    if turning := next((s for s in case.supports if s.thing.turns), None):
        yield diagnostic("E374", turning.at(), f"`{turning.name}` turns a body full of fluid", "not with fluid",
                         "move it by `displaced(...)`")  # fmt: skip
    if not case.drains:
        yield diagnostic("W395", case.body.at(), f"no fluid can leave `{case.body.name}`: all its faces are sealed",
                         "keeps its volume", "let it out: `support open = drained("
                         f"{case.body.name}, where = z >= 10 mm)`")  # fmt: skip
    if case.planar == "plane_stress":
        yield diagnostic("E374", case.body.at(), f"`{case.body.name}` is a plate, whose fluid would leave by its faces",
                         "not in plane stress", "use a solid that is thin, or `plane_strain`")  # fmt: skip


def _refuse_option(declared: Declared, lever: str, given: Any, case: Case) -> Diagnostic:
    """Return the error for an option of the model that does not support fluid."""
    return diagnostic("E374", declared.at(lever), f"`{lever} = {given}` does not go with the fluid in"
                      f" `{case.body.name}`", "not with fluid", "leave it out")  # fmt: skip
