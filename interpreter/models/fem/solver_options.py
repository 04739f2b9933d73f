"""Checks of finite element options that exclude each other: elements, and options that affect speed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem import conforming_mesh
from softmark.interpreter.problem.body_case import other_body
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.solvers.elements import ELEMENTS, PLANE

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.models.fem.fem_declaration import Fem
    from softmark.interpreter.problem.body_case import Case

PACKAGES = {
    "pardiso": "pypardiso",
    "multigrid": "pyamg",
}  # what a linear solver needs; both are in softmark[fast]
SYMMETRIC = ("cholesky", "conjugate_gradients")

Clash = tuple[str, str, str, str]  # field, problem, label, help


def check_options(model: Fem, declared: Declared, case: Case) -> list[Diagnostic]:
    """Return errors for incompatible options, and for linear solvers that are not installed."""
    clashes = (
        *_check_elements(model, case),
        *_check_dynamics(model, case),
        *_check_static_options(model, case),
        *_check_linear_solver(model, case),
        *_check_arc_length(model, case),
    )
    found = (*clashes, *_not_installed(model))
    return [diagnostic("E508", declared.at(field), problem, label, help) for field, problem, label, help in found]


def join_words(words: Iterable[str], last: str) -> str:
    """Return words as a list in text, such as `a, b or c`."""
    *first, end = words
    return f"{', '.join(first)} {last} {end}" if first else end


def join_quoted(words: Iterable[str], last: str) -> str:
    """Return words as a list in text, each in backquotes."""
    return join_words((f"`{word}`" for word in words), last)


def unknown_element(declared: Declared, reason: object) -> Diagnostic:
    """Return the error for an element that does not exist."""
    at, problem = declared.at("element"), f"`{declared.name}` cannot be meshed: {reason}"
    help = f"use `element = {join_quoted(ELEMENTS, 'or')[1:]}"
    return diagnostic("E508", at, problem, "no such mesh", help)


def unused_size(model: Fem, declared: Declared, case: Case) -> list[Diagnostic]:
    """Return a warning about a `size` that has no effect because the body is already a mesh."""
    if model.size is None or model.mesh is not None or not case.shape.prebuilt:
        return []
    at, body = declared.at("size"), case.body.name
    problem = f"the `size` of `{declared.name}` is not used: `{body}` already is a mesh"
    help = "remove `size`, or mesh the body again with that size and name the new file"
    return [diagnostic("W376", at, problem, "has no effect", help)]


def check_grading(model: Fem, declared: Declared, case: Case) -> Diagnostic | None:
    """Return an error if the options of a graded mesh are incomplete or cannot be satisfied, else None."""
    if model.refine_factor is None or model.refine_at is None:
        given = next((name for name in ("refine_factor", "refine_at") if getattr(model, name) is not None), None)
        if given is None:
            return None
        help = (
            "`refine_at = x <= 0 mm` selects where"
            if given == "refine_factor"
            else "`refine_factor = 4` sets how many times"
        )
        return diagnostic(
            "E339",
            declared.at(given),
            f"`{declared.name}` has only `{given}`",
            "mesh grading incomplete",
            f"{help} cells are smaller: write both, or neither",
        )
    shape = case.shape
    if model.mesh is not None or not (shape.gradable_coordinates or shape.enclosed):
        return diagnostic("E340", declared.at("refine_factor"), f"the mesh of `{declared.name}` cannot be graded",
                          "not for this shape", "use a smaller `size`: only boxes, cylinders, tubes, cones, "
                                               "extruded polygons, spherical shells, quadrilaterals, "
                                               "quarter rings and filled surfaces can be graded")  # fmt: skip
    if conforming_mesh.graded_cuts(model.refine_at, shape, model.refine_factor):
        return None
    ways = ", ".join(f"`{name}`" for name in shape.gradable_coordinates)
    problem = f"the mesh of `{declared.name}` cannot be refined towards the region of `refine_at`"
    help = (
        f"write a region that ends at a constant {ways} inside the shape or at its ends, as in `refine_at = x <= 0 mm`"
    )
    return diagnostic("E341", declared.at("refine_at"), problem, "ends at no constant coordinate", help)


def _check_elements(model: Fem, case: Case) -> Iterator[Clash]:
    """Yield the first error about the options `integration` and `rotation`."""
    known = model.strain == "finite" and case.material.finite_law() is not None
    table = PLANE if model.element in PLANE else ELEMENTS
    fit = [name for name, element in table.items() if model.integration in element.integrations]
    if model.element not in fit:
        problem = f"{model.integration} integration is available for {join_words(fit, 'and')}, not for {model.element}"
        help = f"leave it out, or use {join_quoted(fit, 'or')}"
        yield "integration", problem, f"only with {join_words(fit, 'and')}", help
    elif model.integration == "selective" and known and case.material.finite_parts() is None:
        problem = f"the law of `{case.body.name}` has no separate isochoric and volumetric parts"
        yield (
            "integration",
            problem,
            "needs an isochoric-volumetric split",
            "use `integration = full`, or another material",
        )
    elif model.rotation == "element" and model.strain != "corotational":
        problem, help = (
            f"`strain = {model.strain}` has no `rotation` option",
            "leave it out, or write",
        )
        yield "rotation", problem, "only with corotational", f"{help} `strain = corotational`"


def _check_dynamics(model: Fem, case: Case) -> Iterator[Clash]:
    """Yield errors for options that are available only in static analyses."""
    if not isinstance(case.analysis, Dynamic):
        return
    steps = "time steps already reuse factorizations and start from the previous state"
    usual = {"precision": "double", "linear": "auto", "factorisation": "fresh", "initial_guess": None}
    for field, value in usual.items():
        if getattr(model, field) != value:
            help = "leave it out; control the cost of time steps by `step`, `tolerance` and `max_iterations`"
            yield field, f"`{field}` is only for static analyses: {steps}", "not in a dynamic analysis", help


def explicit_integrator_errors(model: Fem, declared: Declared, case: Case) -> list[Diagnostic]:
    """Return errors for an explicit integrator with a consistent mass matrix or with dashpots."""
    analysis = case.analysis
    if not isinstance(analysis, Dynamic) or not analysis.explicit:
        return []
    found = [_dashpot_error(declared, bed, analysis) for bed in case.beds if bed.thing.damping]
    if model.mass != "consistent":
        return found
    problem = f"`{declared.name}` needs a lumped mass matrix for {analysis.integrator}"
    help = "write `mass = lumped`, or use an implicit integrator"
    return [*found, diagnostic("E508", declared.at("mass"), problem, "consistent mass would have to be inverted", help)]


def _dashpot_error(declared: Declared, bed: Declared, analysis: Dynamic) -> Diagnostic:
    """Return the error about dashpots, which reduce the stable time step of an explicit integrator."""
    problem = f"`{declared.name}` cannot be integrated by {analysis.integrator} with the dashpots of `{bed.name}`"
    return diagnostic("E508", bed.at("damping"), problem, "not with explicit integration", "use an implicit integrator")


def _check_static_options(model: Fem, case: Case) -> Iterator[Clash]:
    """Yield errors for options of static analyses that exclude each other."""
    if isinstance(case.analysis, Dynamic):
        return
    if model.max_linear_iterations is not None and model.linear != "conjugate_gradients":
        help = "leave it out, or use `linear = conjugate_gradients`"
        yield (
            "max_linear_iterations",
            f"`linear = {model.linear}` has no iterations to limit",
            "only with conjugate_gradients",
            help,
        )
    if model.factorisation == "reused" and model.linear not in ("auto", "cholesky"):
        yield (
            "factorisation", f"`linear = {model.linear}` keeps no factorization between steps", "nothing to reuse",
            "remove one of the two",
        )  # fmt: skip
    if model.precision == "double":
        return
    if model.rotation == "element":
        problem = "one rotation per cell is available only in double precision"
        yield "precision", problem, "not with `rotation = element`", "remove one of the two"
    if model.factorisation == "reused":
        yield (
            "precision", "reused factorizations are corrected by residuals in double precision",
            "not with `factorisation = reused`", "remove one of the two: reused factorizations already use "
                                               "single precision",
        )  # fmt: skip
    if model.linear in PACKAGES:
        help = "use `linear = auto`, `cholesky`, `superlu` or `conjugate_gradients`"
        yield (
            "precision",
            f"`linear = {model.linear}` computes in double precision",
            f"not with {model.linear}",
            help,
        )


def _check_arc_length(model: Fem, case: Case) -> Iterator[Clash]:
    """Yield errors for options that arc length continuation excludes."""
    if case.analysis.path != "arc_length":
        return
    usual = {"max_iterations": None, "precision": "double", "factorisation": "fresh", "initial_guess": None}
    for field, value in usual.items():
        if getattr(model, field) != value:
            problem = (
                "`path = arc_length` needs a new factorization in each step, in double precision, from "
                f"rest: remove `{field}`"
            )
            yield field, problem, "not with `path = arc_length`", "leave it out, or use `path = load`"
    if model.linear in ("conjugate_gradients", "multigrid"):
        problem = f"`path = arc_length` passes through unstable states, which `linear = {model.linear}` cannot solve"
        yield "linear", problem, "not with `path = arc_length`", "use `linear = auto`, or `path = load`"


def _check_linear_solver(model: Fem, case: Case) -> Iterator[Clash]:
    """Yield an error if a linear solver for symmetric matrices is used with unsymmetric tangents."""
    reused, capped = model.factorisation == "reused", model.linear in SYMMETRIC
    follows = any(not load.thing.action.conservative for load in case.loads) and model.strain != "small"
    if isinstance(case.analysis, Dynamic) or not (reused or capped) or not (follows or model.rotation == "element"):
        return
    why = "one rotation for each cell" if model.rotation == "element" else "a load that follows the surface"
    field = "linear" if capped else "factorisation"
    word = f"`{field} = {getattr(model, field)}`"
    help = "use `linear = auto`, `superlu` or `pardiso`" if capped else "leave it out"
    yield field, f"{word} needs a symmetric matrix, but the matrix of {why} is not symmetric", "not symmetric", help


def _not_installed(model: Fem) -> Iterator[Clash]:
    """Yield an error if the linear solver is not installed."""
    package = PACKAGES.get(model.linear)
    if package is not None and find_spec(package) is None:
        problem, help = f"`linear = {model.linear}` needs the package `{package}`", "pip install 'softmark[fast]'"
        yield "linear", problem, "not installed", f"run `{help}`, or remove `linear`"


def check_initial_guess(scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
    """Return errors about the model whose solution is the initial guess."""
    if declared.thing.initial_guess is None:
        return []
    first = scene.declared[declared.thing.initial_guess]
    if other_body(scene, first, case) is None:
        return []
    problem = f"`{declared.name}` is a model of `{case.body.name}`, and `{first.name}` is not"
    return [
        diagnostic(
            "E508", declared.at("initial_guess"), problem, "different bodies", "start from a model of the same body"
        )
    ]
