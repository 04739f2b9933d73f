"""Checks of material regions that use only the scene, before anything is built."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.capabilities import REGIONS, unsupported_feature_errors
from softmark.interpreter.problem.body_case import Fault, case_for, case_of
from softmark.interpreter.problem.material_layers import find_common_point, overlap_fault, unordered_overlaps
from softmark.solvers.mesh.shape import Prism

SELECT = ("region", "support", "load", "probe")  # kinds whose declarations have a `where`


def check_owners(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of regions that are used for another body than their own."""
    for declared in (d for kind in SELECT for d in scene.of_kind(kind).values()):
        used = [("over", name) for name in declared.value("over") or ()]
        where, body = declared.value("where"), declared.value("body")
        used += [("where", name) for name in (where.regions if where is not None else ())]
        for field, name in used:
            owner = scene.declared[name].thing.body
            if body is None or owner == body:
                continue
            problem = f"`{name}` is a region of `{owner}`, but `{declared.name}` refers to `{body}`"
            yield diagnostic("E591", declared.at(field), problem, "of another body",
                             f"declare a region of `{body}`: `region NAME = part({body}, where = ...)`")  # fmt: skip


def check_groups(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of named mesh groups of a body without a mesh file."""
    for region in scene.of_kind("region").values():
        body = scene.declared.get(region.thing.body)
        if region.thing.group is not None and body is not None and not body.thing.shape.prebuilt:
            yield diagnostic("E324", region.at("name"),
                             f"`{body.name}` has no group `{region.thing.group}`: its mesh is generated, not read "
                             "from a file",
                             "no mesh file",
                             f"select by coordinates, `region {region.name} = part({body.name}, where = ...)`, or take "
                             "the body's shape from a `mesh(...)`")  # fmt: skip


def check_order(scene: Scene) -> Iterator[Diagnostic]:
    """Yield warnings about an order of regions that has no effect, since one of them has no material of its own."""
    for region in scene.of_kind("region").values():
        for name in region.thing.over:
            lacking = region.name if region.thing.material is None else name
            if scene.declared[lacking].thing.material is None:
                yield diagnostic("W392", region.at("over"), f"`over` ranks materials, but `{lacking}` has none",
                                 "no effect",
                                 f"give `{lacking}` a `material`, or remove `over`")  # fmt: skip


def check_overlaps(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of regions of different materials that overlap in a box."""
    for body in scene.of_kind("body"):
        case = case_of(scene, body)
        shape = case.shape
        if not isinstance(shape, Prism):  # points outside are only known when it is built
            continue
        for a, b in unordered_overlaps(case):
            at = find_common_point(a.thing.where, b.thing.where, *shape.bounds)
            if at is not None and shape.contains(at):
                yield overlap_fault(a, b, f"both include {units.format_vector(at, units.LENGTH)}").diagnostic


def check_models(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of models that do not support the materials of the regions of their body.

    These are models with one material, and models with `mass = uniform` if the regions have different densities.
    """
    for model in scene.asked("model").values():
        try:
            case = case_for(scene, model)
        except Fault:
            continue
        if not case.parts:
            continue
        names = ", ".join(f"`{part.name}`" for part in case.parts)
        if refused := list(unsupported_feature_errors(model, case, (REGIONS,))):
            yield from refused
        elif (
            "mass" in model.fields
            and str(model.value("mass")) == "uniform"
            and len({m.density for m in case.materials}) > 1
        ):
            yield diagnostic(
                "E593",
                model.at("mass"),
                f"`{model.name}` gives every node the same mass, but regions "
                f"of `{case.body.name}` differ in density: {names}",
                "one density only",
                "use `mass = lumped` or `consistent`",
            )
        elif model.thing.other_material is not None:
            yield diagnostic(
                "E593",
                model.at("material"),
                f"`{model.name}` replaces the material of `{case.body.name}`, which has regions of other "
                f"materials: {names}",
                "replaces which material?",
                "remove `material`, and vary the materials of the scene",
            )
