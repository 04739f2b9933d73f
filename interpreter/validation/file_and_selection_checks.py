"""Checks of files and selections that a run would refuse, using only names, file headers and bounds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Location, Scene
from softmark.interpreter.language.coordinate_conditions import Condition, Point
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case, Fault, case_for, describe_extent
from softmark.references.measured_curve import CurveFromFile
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.surface_bodies import SurfaceBody

CHEAP = 4_000_000  # bytes of a table that is read when a scene is checked
FINEST = 2e-3  # relative to the body's extent: smaller cells are not divided
MOST = 4000  # largest number of cells that are checked


def meshes(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors about the meshes of models.

    These are files that cannot contain a solid, surfaces that cannot be filled, shapes without a hexahedral mesh, and
    plane regions that a model cannot use.
    """
    said: set[Location | Diagnostic] = set()
    for model in scene.asked("model").values():
        if model.thing.mesh_key() is None:
            continue
        try:
            case = case_for(scene, model)
        except Fault:
            continue
        own = model.thing.own_mesh
        shape, at = (own, model.at("mesh")) if own is not None else (case.shape, case.shape_location)
        if isinstance(shape, SurfaceBody):
            from softmark.interpreter.validation import (
                filled_surface_checks,  # only imported for filled surfaces
            )

            found = filled_surface_checks.doubts(model, case, shape)
            yield from (d for d in found if d not in said)
            said.update(found)
        if own is None and not shape.fault and shape.no_hexahedra_reason:
            from softmark.interpreter.validation.tetrahedra_checks import check_hexahedral_mesh

            if (refusal := check_hexahedral_mesh(model, case, shape)) is not None:
                yield refusal
        path = shape.file if shape.prebuilt else ""
        here = path and not path.startswith("data:")
        if here and shape.flat:
            if at not in said and (refusal := _plane_region_error(model, case, shape)) is not None:
                said.add(at)
                yield refusal
            continue
        doubt = _file_error(path) if here else None
        if doubt is not None and at not in said:
            said.add(at)
            problem = f"the mesh of `{case.body.name}` cannot be used: {doubt[0]}"
            yield diagnostic("E403", at, problem, "not a solid mesh", doubt[1])


def _plane_region_error(model: Declared, case: Case, shape: Shape) -> Diagnostic | None:
    """Return the error if a model cannot use the plane region of a mesh file, or None.

    The file is read during checking because its position determines the supports.
    """
    from softmark.solvers.elements.plane import PLANE
    from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh

    try:
        shape.mesh_with_groups()
        if (element := getattr(model.thing, "element", None)) in PLANE:
            shape.mesh_with_groups(element)
    except UnreadableMesh as wrong:
        problem = f"the mesh of `{case.body.name}` cannot be used: {wrong}"
        return diagnostic(wrong.code, case.shape_location, problem, "not a plane region", wrong.remedy or "")
    return None


def _file_error(path: str) -> tuple[str, str] | None:
    """Return message and remedy for a file that cannot contain a solid, or None."""
    from softmark.solvers.mesh.files import mesh_formats  # only imported for mesh files

    return mesh_formats.find_format_problem(path)


def groups(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors about named groups that a mesh file lacks, or that are of the wrong kind."""
    said: set[str] = set()
    for model in scene.asked("model").values():
        try:
            case = case_for(scene, model)
        except Fault:
            continue
        shape = model.thing.own_mesh or case.shape
        if shape.prebuilt and case.groups and is_cheap_to_read([shape.file]) and shape.file not in said:
            said.add(shape.file)
            yield from _check_groups_of_case(case, shape)


def _check_groups_of_case(case: Case, shape: Shape) -> Iterator[Diagnostic]:
    """Yield errors of the groups of one case."""
    from softmark.interpreter.problem import (
        mesh_group_conditions,  # reads the mesh; only imported for scenes with groups
    )
    from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh

    try:
        mesh_group_conditions.check_mesh_groups(case.groups, shape.mesh_with_groups())
    except Fault as wrong:
        yield wrong.diagnostic
    except UnreadableMesh:
        return  # reported when models are built


def tables(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors about tables of tracked points and of curves that lack columns."""
    for reference in scene.of_kind("reference").values():
        if not is_cheap_to_read(reference.thing.files):
            continue
        if (unfit := reference.thing.unfit()) is not None:
            at, (reason, remedy) = reference.at("path"), unfit
            code = "E407" if isinstance(reference.thing, CurveFromFile) else "E395"
            problem = f"the table of `{reference.name}` cannot be used: {reason}"
            yield diagnostic(code, at, problem, reference.thing.table, remedy)


def is_cheap_to_read(files: Sequence[str]) -> bool:
    """Return whether all files are small enough to be read during checking."""
    here = [not name.startswith("data:") and Path(name).is_file() for name in files]
    return bool(files) and all(here) and sum(Path(name).stat().st_size for name in files) <= CHEAP


# ------------------------------------------------------------------ loads on surfaces


def loads(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors about surface loads that select only interior points."""
    for load in scene.of_kind("load").values():
        where = load.thing.action.surface
        if where is None or load.thing.body not in scene.declared:
            continue
        body = scene.declared[load.thing.body]
        if body.thing.shape.convex and not _may_meet_surface(where, body.thing.shape):
            at: Location = load.at("where")
            problem = f"`{load.name}` selects no part of the surface of `{body.name}`"
            spans = describe_extent(*body.thing.shape.bounds)
            help = f"select points of the surface: this selection lies inside; the body spans {spans}"
            yield diagnostic("E302", at, problem, "selects nothing", help)


def _may_meet_surface(condition: Condition, shape: Shape) -> bool:
    """Return whether a selection may include surface points of a convex body; False only if that is certain.

    The bounding box is halved repeatedly. Cells in which the condition holds nowhere, and cells whose corners all lie
    inside the body, contain no selected surface.
    """
    if shape.bounds is None:
        return True
    low, high = shape.bounds
    if not condition.over(low, high)[1]:
        return True  # selects nothing at all; reported elsewhere
    extent, cells, looked = math.dist(low, high), [(low, high)], 0
    while cells:
        low, high = cells.pop()
        looked += 1
        if not condition.over(low, high, extent)[1] or _is_inside(shape, low, high, 1e-6 * extent):
            continue
        if looked > MOST or math.dist(low, high) < FINEST * extent:
            return True
        cells += _halves(low, high)
    return False


def _is_inside(shape: Shape, low: Point, high: Point, margin: float) -> bool:
    """Return whether a cell with a margin around it lies in a convex body, judged by its corners."""
    sides = [(a - margin, b + margin) for a, b in zip(low, high, strict=True)]
    return all(shape.contains((x, y, z)) for x, y, z in product(*sides))


def _halves(low: Point, high: Point) -> list[tuple[Point, Point]]:
    """Return the two halves of a cell, cut across its longest side."""
    i = max(range(3), key=lambda k: high[k] - low[k])
    middle = 0.5 * (low[i] + high[i])
    upper, lower = list(high), list(low)
    upper[i] = lower[i] = middle
    return [(low, (upper[0], upper[1], upper[2])), ((lower[0], lower[1], lower[2]), high)]


def faults(scene: Scene, found: list[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield all errors of this module, except of declarations that already have errors."""
    blamed = {(d.source, d.span.line) for d in found if d.severity == "error" and d.span is not None}
    for ask in (meshes, groups, tables, loads):
        yield from (d for d in ask(scene) if d.span is None or (d.source, d.span.line) not in blamed)
