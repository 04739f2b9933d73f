"""Checks of references that solve the scene's own models on several meshes and extrapolate their results.

verification/refinement_family.py solves the models; this module uses no arrays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.problem.body_case import Case, Fault, body_of, case_for
from softmark.interpreter.problem.conforming_mesh import Cuts
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.references.convergence_orders import find_dissimilarity
from softmark.references.self_converged import SelfConverged

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape

LEAST = 3  # least number of sizes: two show no order
PARTS = 6  # parts of the largest possible size, from which sizes are proposed
RATIO = 1.3  # least ratio of neighbouring cell sizes (Celik et al. 2008, step 2 of the procedure)


@dataclass(frozen=True)
class Method:
    """Model that such a reference solves on several meshes, with its case."""

    declared: Declared
    case: Case

    @property
    def formal_order(self) -> int:
        """Theoretical convergence order of the element's displacements for smooth solutions."""
        order: int = self.declared.thing.order
        return order

    def at(self, size: float) -> Declared:
        """Return the declaration of the model with another cell size, m."""
        return replace(self.declared, thing=replace(self.declared.thing, size=size))


def methods_of(scene: Scene, reference: Declared) -> list[Method]:
    """Return the models that a reference refines. Raises Fault for an ambiguous body."""
    found = (scene.declared[name] for name in reference.thing.methods)
    return [Method(declared, case_for(scene, declared)) for declared in found]


# ------------------------------------------------------------------ errors


def check_refinements(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors and warnings of every reference of a scene that refines models."""
    for reference in scene.of_kind("reference").values():
        if isinstance(reference.thing, SelfConverged):
            sizes = list(_check_sizes(reference))
            found = sizes + list(_methods(scene, reference, well_sized=not sizes))
            with suppress(Fault):  # an ambiguous body is reported for the model
                yield from found or _refinement_warnings(scene, reference)


def _check_sizes(reference: Declared) -> Iterator[Diagnostic]:
    sizes = reference.thing.sizes
    if sizes.dimension != units.LENGTH:
        given = units.dimension_name(sizes.dimension)
        yield diagnostic("E204", reference.at("sizes"), f"expected a length, found {given}", given,
                         "give sizes of cells as lengths, such as `[12, 9, 6] mm`")  # fmt: skip
    elif len(sizes.values) < LEAST:
        count = f"{len(sizes.values)} size" + ("" if len(sizes.values) == 1 else "s")
        yield diagnostic("E531", reference.at("sizes"),
                         f"`{reference.name}` has {count}, but an order of convergence needs three",
                         "too few", "add a finer size, such as half the finest")  # fmt: skip
    elif any(b >= a for a, b in pairwise(sizes.values)) or min(sizes.values) <= 0:
        yield diagnostic("E531", reference.at("sizes"),
                         f"the sizes of `{reference.name}` do not go from coarse to fine",
                         "not decreasing", "write the largest first, such as `[12, 9, 6] mm`")  # fmt: skip


def _methods(scene: Scene, reference: Declared, well_sized: bool) -> Iterator[Diagnostic]:
    if len(reference.thing.methods) < 2:
        yield diagnostic(
            "E531",
            reference.at("methods"),
            f"`{reference.name}` refines one model only",
            "nothing to compare with",
            "name two models with different elements or integration, so that each checks the other",
        )
        return
    seen: dict[tuple[str, str], Declared] = {}
    for name in reference.thing.methods:
        declared = scene.declared[name]
        found = _refinement_obstacle(scene, reference, declared)
        if found is None:
            first = seen.setdefault((declared.thing.element, declared.thing.integration), declared)
            found = _common_error_diagnostic(reference, declared, first, next(iter(seen.values())))
        if found is None and well_sized:
            found = _memory_error(scene, reference, declared)
        if found is not None:
            yield found


def _refinement_obstacle(scene: Scene, reference: Declared, declared: Declared) -> Diagnostic | None:
    """Return the error if a model cannot be refined, or None."""
    name, thing = declared.name, declared.thing
    problem = label = help = ""
    if not isinstance(thing, Fem):
        problem = f"`{name}` is {declared.constructor.name}, not a finite element model with a `size`"
        label, help = "does not converge to the solid", "name `fem(...)` models: this model converges to another theory"
    elif thing.size is None:
        problem, label = f"`{name}` has its own mesh and no `size` to refine", "cannot be refined"
        help = "give the model a `size` instead of its mesh"
    elif thing.mass == "uniform":
        problem, label = f"`{name}` puts the same mass on every node and does not converge", "no limit"
        help = "use `mass = consistent` or `mass = lumped`"
    elif any(isinstance(a.thing, Dynamic) for a in scene.of_kind("analysis").values()):
        problem, label = (
            f"`{reference.name}` needs a static analysis, but the analysis is dynamic",
            "a dynamic analysis",
        )
        help = "refine the step and the mesh in a study, or use a static analysis"
    if problem:
        return diagnostic("E531", reference.at("methods"), problem, label, help)
    return _other_body_error(scene, reference, declared)


def _other_body_error(scene: Scene, reference: Declared, declared: Declared) -> Diagnostic | None:
    """Return the error if a model is of another body than the reference, or None."""
    try:
        own, theirs = body_of(scene, reference), body_of(scene, declared)
    except Fault:  # reported elsewhere
        return None
    if own == theirs:
        return None
    return diagnostic("E505", reference.at("methods"),
                      f"`{reference.name}` refers to `{own}`, but `{declared.name}` to `{theirs}`",
                      "different bodies", "name models of one body")  # fmt: skip


def _common_error_diagnostic(
    reference: Declared, declared: Declared, twin: Declared, first: Declared
) -> Diagnostic | None:
    """Return the error if two models of a reference cannot check each other, or None.

    The model `twin` has the same element and integration as `declared`, so that both have the same errors. The `first`
    model has another strain measure or material than `declared`, so that the two converge to different limits.
    """
    mine, theirs = declared.thing, first.thing
    if twin is not declared:
        both = f"`{twin.name}` and `{declared.name}`"
        return diagnostic("E531", reference.at("methods"),
                          f"{both} have the same element and integration", "models with the same errors",
                          "use another element, or hex8 with `integration = selective`")  # fmt: skip
    for field in ("strain", "material"):
        if getattr(mine, field) != getattr(theirs, field):
            return diagnostic(
                "E531",
                reference.at("methods"),
                f"`{first.name}` and `{declared.name}` differ in `{field}`",
                "different limits",
                f"use the same `{field}` in both: the limit is unique only for one problem",
            )
    return None


def _memory_error(scene: Scene, reference: Declared, declared: Declared) -> Diagnostic | None:
    """Return the error if the finest mesh does not fit in memory, or None."""
    try:
        case = case_for(scene, declared)
    except Fault:
        return None
    finest = Method(declared, case).at(reference.thing.sizes.values[-1])
    found: Diagnostic | None = finest.thing.coarse(finest, case)
    if found is None or found.code != "E304":
        return None
    at = reference.at("sizes")
    return replace(found, source=at.source, span=at.span)


# ------------------------------------------------------------------ warnings


def extrapolation_obstacle(shape: Shape, sizes: Sequence[float], cuts: Cuts = ()) -> str | None:
    """Return why results on meshes of these cell sizes, m, cannot be extrapolated; None if they can.

    The meshes must be similar to each other, and each clearly finer than the one before.
    """
    found = [shape.counts(size, cuts) for size in sizes[-LEAST:]]
    counts = [own for own in found if own is not None]
    if len(counts) < len(found):
        return None
    means = [math.prod(own) ** (1 / len(own)) for own in counts]
    ratio, place = min((b / a, i) for i, (a, b) in enumerate(pairwise(means)))
    if ratio >= 0.98 * RATIO:
        return find_dissimilarity(counts)
    a, b = (units.format_value(size, units.LENGTH) for size in sizes[-LEAST:][place : place + 2])
    return f"cells of {b} are only {ratio:.3g} times finer than those of {a}, but an order needs a factor of {RATIO:g}"


def _refinement_warnings(scene: Scene, reference: Declared) -> Iterator[Diagnostic]:
    """Yield warnings about meshes that show no convergence order, and about models that all lock."""
    methods = methods_of(scene, reference)
    first, sizes = methods[0], reference.thing.sizes.values
    shape, cuts = first.case.shape, first.declared.thing.cuts(first.case)
    if (why := extrapolation_obstacle(shape, sizes, cuts)) is not None:
        at = reference.at("sizes")
        yield diagnostic("W332", at, f"the meshes of `{reference.name}` give no order of convergence",
                         "nothing is extrapolated", _propose_sizes(shape, cuts), (why,))  # fmt: skip
    nu = first.case.largest_poisson
    if all(own.declared.thing.locks_at(nu) for own in methods):
        at = reference.at("methods")
        yield diagnostic("W333", at, f"all methods of `{reference.name}` lock at a Poisson's ratio of {nu:g}",
                         "may agree and be too stiff",
                         "use one that does not: tet10, or hex8 with `integration = selective` or `formulation = "
                         "mean_dilatation`")  # fmt: skip


def _propose_sizes(shape: Shape, cuts: Cuts) -> str:
    """Return text that proposes cell sizes with similar meshes, if some are known."""
    largest = shape.similar_mesh_size or 0.0
    for part in range(1, PARTS + 1) if largest else ():
        sizes = tuple(float(f"{largest / part / k:.5g}") for k in (1, 2, 3))
        if extrapolation_obstacle(shape, sizes, cuts) is None:
            return f"use sizes that give similar meshes, such as {units.format_vector(sizes, units.LENGTH)}"
    return "use sizes of which each is half the one before, and that divide the body into whole cells"
