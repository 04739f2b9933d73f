"""Checks of a compiled scene before anything is built; value_warnings.py has the warnings.

To add a check: a function that yields diagnostics, and a line in LOCAL, or in WHOLE if it needs all declarations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Location, Scene, is_rigid
from softmark.interpreter.language.compiler import recompile
from softmark.interpreter.language.coordinate_conditions import Point
from softmark.interpreter.language.expectation_conditions import find_metrics
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.message_limit import shorten
from softmark.interpreter.language.parameter_overrides import Override
from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.models.shared.capabilities import (
    ANISOTROPY,
    NETWORKS,
    VARYING_CONSTANTS,
    unsupported_feature_errors,
)
from softmark.interpreter.models.shared.perturbed_start import check_perturbed_start as disturbed
from softmark.interpreter.problem import symmetry_planes
from softmark.interpreter.problem.body_case import Case, Fault, body_of, case_for, case_of, describe_extent
from softmark.interpreter.problem.theories.reference_solution import problem_of
from softmark.interpreter.validation import file_and_selection_checks as given
from softmark.interpreter.validation import plane_body_checks, state_checks, used_scene_checks, value_warnings
from softmark.interpreter.validation.amplitude_resolution import check_amplitude_resolution
from softmark.interpreter.validation.dynamic_contact_checks import metric_faults
from softmark.interpreter.validation.load_checks import check_loads
from softmark.interpreter.validation.reference_checks import check_comparisons
from softmark.interpreter.validation.refinement_checks import check_refinements as doubts_of_refined
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.probe_words import MeshNodes
from softmark.references.measured_curve import CurveFromFile
from softmark.references.published_values import GivenValues


def check(scene: Scene, complete: bool = True) -> list[Diagnostic]:
    """Return all errors and warnings of a scene; if it is not `complete`, those of its valid parts."""
    found: list[Diagnostic] = [*state_checks.faults(scene), *_check_given_values(scene)] if complete else []
    where = state_checks.state_of_largest_load(scene)
    for test in LOCAL + (WHOLE if complete else ()):
        found += test(where, found)
    if where is not scene and complete:
        found += given.tables(scene)
    return shorten(list(dict.fromkeys(found)))


Found = list[Diagnostic]  # diagnostics of earlier checks


def _has_error(declared: Declared, found: Found) -> bool:
    """Return whether a declaration already has an error, so that consequences of the error are not reported."""
    return any(d.severity == "error" and declared.contains(d) for d in found)


def _check_single_analysis(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    for extra in list(scene.of_kind("analysis").values())[1:]:
        yield diagnostic("E222", extra.at(), "the scene already has an analysis",
                         "the second analysis",
                         "keep one analysis, and put the other one into a separate scene")  # fmt: skip


def _check_selections(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check by bounds for conditions that select nothing, and supports that hold the whole body."""
    everywhere: dict[str, list[Declared]] = {}
    for declared in (d for kind in ("region", "support", "load") for d in scene.of_kind(kind).values()):
        condition = declared.value("where")
        body = scene.declared.get(declared.value("body") or "")
        if condition is None or body is None or is_rigid(body) or body.thing.shape.bounds is None:
            continue
        if (
            declared.kind == "load" and "where" not in declared.fields
        ):  # the default `everywhere` is only for a rigid body
            yield diagnostic("E206", declared.at(), f"`{declared.constructor.name}` needs `where`", "incomplete",
                             "select a part of its surface by coordinates before deformation")  # fmt: skip
            continue
        low, high = body.thing.shape.bounds
        false, true = condition.over(low, high)
        if not true:
            yield diagnostic("E302", declared.at("where"),
                             f"`{declared.name}` selects no part of `{body.name}`", "selects nothing",
                             f"the body spans {describe_extent(low, high)}")  # fmt: skip
        elif not false and declared.kind == "support":
            everywhere.setdefault(body.name, []).append(declared)
    for name, supports in everywhere.items():
        if len({c for support in supports for c in support.thing.components}) == 3:
            last = supports[-1]
            help = "select a part of the body, or leave components free: nothing would be left to deform"
            problem = f"`{last.name}` selects all of `{name}`"
            yield diagnostic("E303", last.at("where"), problem, "selects everything", help)


def _check_shapes(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that the field values of each shape are compatible."""
    for body in (*scene.of_kind("body").values(), *scene.of_kind("rigid").values()):
        problem = body.thing.shape.fault
        if problem:
            at = body.at("region" if body.thing.planar else "shape")
            yield diagnostic("E581", at, f"`{body.name}` has an impossible shape: {problem}", "impossible shape")
        elif not body.thing.shape.meshed and not body.thing.planar and body.value("material") is not None:
            yield diagnostic("E610", body.at("shape"), f"`{body.name}` is deformable, but its shape cannot be meshed",
                             "only for rigid bodies",
                             "use a `box`, `cylinder`, `cone` or another shape with a mesh; declare an instrument "
                             "that does not deform as `rigid(...)`, without a material")  # fmt: skip


def _check_plane_bodies(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check plane regions and plane bodies, and actions normal to their plane."""
    yield from plane_body_checks.shapes(scene)
    yield from plane_body_checks.check_conditions(scene)
    yield from plane_body_checks.check_actions(scene)


def _check_supports_of_bodies(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that supports fit their bodies, and that the loads and motions of half models are symmetric."""
    for support in scene.of_kind("support").values():
        body = scene.declared.get(support.value("body") or "")
        if body is None or _has_error(support, found):
            continue
        if fault := support.thing.body_fault(support.name, body.name, body.thing.shape):
            code, (field, *texts) = fault
            yield diagnostic(code, support.at(field), *texts)
        if support.thing.mirror_plane is not None:
            for analysis in scene.of_kind("analysis").values():
                if (error := symmetry_planes.initial_motion_error(support, analysis)) is not None:
                    yield error
            for load in scene.acting("load", body.name):
                if (error := symmetry_planes.asymmetric_load_error(support, load)) is not None:
                    yield error
                if (doubt := symmetry_planes.point_force_warning(support, load, body.thing.shape.bounds)) is not None:
                    yield doubt


def _check_points_inside(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that probes and point forces lie inside their body."""
    for declared in (*scene.of_kind("probe").values(), *scene.of_kind("load").values()):
        points = _points_of_declaration(scene, declared)
        if not points:
            continue
        body = scene.declared[declared.thing.body]
        if body.thing.shape.fault or not body.thing.shape.meshed:
            continue
        shape = body.thing.shape
        outside = {field: point for field, point in reversed(points) if not shape.contains(point)}
        bare: str | None = ""
        if outside and all(map(shape.hollow_at, outside.values())):
            from softmark.interpreter.validation.hollow_section_checks import axis_point_refusal

            bare = axis_point_refusal(scene, declared)
        for field, point in reversed(outside.items()) if bare is not None else ():
            does = "acts at" if declared.kind == "load" else "is evaluated at"
            where = units.format_vector(point, units.LENGTH)
            spans = describe_extent(*shape.bounds) + ("" if shape.convex else f"; it is {shape.gap}")
            problem = f"`{declared.name}` {does} {where}, outside `{body.name}`"
            remedy = bare or f"the body spans {spans}"
            yield diagnostic("E504", declared.at(field), problem, "outside the body", remedy)


def _points_of_declaration(scene: Scene, declared: Declared) -> list[tuple[str, Point]]:
    """Return the fields and points that decide whether a probe or load is inside its body; for a line its ends."""
    if declared.kind == "load":
        return list(declared.thing.action.points)
    stations, ends = declared.thing.stations or (), declared.thing.ends
    if ends is None:
        return [("at", point) for point in stations]
    named = list(zip(("from", "to"), ends, strict=True))
    convex = scene.declared[declared.thing.body].thing.shape.convex
    return named if convex else [*named, *(("to", point) for point in stations[1:-1])]


def _check_mesh_node_probes(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that probes of mesh nodes belong to a body whose shape has nodes."""
    for probe in scene.of_kind("probe").values():
        if isinstance(probe.thing, MeshNodes) and not probe.thing.mesh.prebuilt:
            yield diagnostic("E507", probe.at("mesh"), f"the `mesh` of `{probe.name}` is a shape without cells",
                             "not a mesh", 'name a file: `mesh = mesh("file.msh", unit = 1 mm)`')  # fmt: skip


# ------------------------------------------------------------------ checks of several declarations


def _check_bodies_of_models(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that the body of each model and reference is unambiguous."""
    for declared in _models_and_references(scene):
        try:
            body_of(scene, declared)
        except Fault as unclear:
            yield unclear.diagnostic


def _models_and_references(scene: Scene) -> list[Declared]:
    return [*scene.asked("model").values(), *scene.of_kind("reference").values()]


def _cases(scene: Scene, kind: str, valid: bool = True) -> Iterator[tuple[Declared, Case]]:
    """Yield the models or references of unambiguous bodies with their cases; if `valid`, only of valid shapes."""
    for declared in scene.asked(kind).values():
        try:
            case = case_for(scene, declared)
        except Fault:
            continue
        if not (valid and case.shape.fault):  # reported for the body
            yield declared, case


def _check_supports(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    cases = [case for _, case in _cases(scene, "model") if not isinstance(case.analysis, Dynamic)]
    loose = {case.body.name: case for case in cases if not (case.named_supports or case.beds or case.contacts)}
    for case in loose.values():
        body = case.body.name
        remedy = f"add a support: `support wall = fixed({body}, where = x <= 0 mm)`"
        problem = f"`{body}` has no support: it is free to move and rotate"
        yield diagnostic("E306", case.body.at(), problem, "no support", remedy)


def _check_undeformed_bodies(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check for bodies that are solved although nothing deforms them and no frequency is requested."""
    if any(_has_error(contact, found) for contact in scene.of_kind("contact").values()):
        return  # the effect of contacts with errors is not known
    asked = (metric.thing for metric in scene.of_kind("metric").values())
    ringing = {thing.subject_name for thing in asked if not isinstance(thing, ForceMetric)}
    cases = (case for _, case in _cases(scene, "model") if not case.loads and not _deforms_without_loads(case))
    still = {case.body.name: case for case in cases if case.body.name not in ringing}
    for case in still.values():
        body = case.body.name
        yield diagnostic("W313", case.body.at(), f"`{body}` has no load: it stays at rest", "no load",
                         "add one, such as `load weight = gravity(9.81 m/s^2)`")  # fmt: skip


def _deforms_without_loads(case: Case) -> bool:
    moved = any(support.thing.moves for support in (*case.supports, *case.drains))
    away = case.analysis.disturbed != "none" or any(hasattr(m, "passive") for m in case.materials)  # active muscle
    moved |= any(touch.driven for touch in case.contacts)
    return moved or away or isinstance(case.analysis, Dynamic)  # an initial velocity is possible


def _check_equilibrium_paths(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Refuse reduced models on equilibrium paths, because their basis does not contain the motions along a path."""
    for model, case in _cases(scene, "model"):
        if case.analysis.path == "arc_length" and model.thing.reduces is not None:
            problem = f"`{model.name}` is a reduced model, whose basis does not contain the motions along a path"
            yield diagnostic("E541", model.at(), problem, "not along a path",
                             f"follow the path with `{model.thing.reduces}`, or use `path = load`")  # fmt: skip


def _check_models(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check models, and report an error that several models share only once."""
    first: dict[tuple[object, ...], tuple[Diagnostic, list[str]]] = {}
    for model, case in _cases(scene, "model"):
        if not case.shape.meshed or (_has_error(case.body, found) and case.shape.flat != bool(case.planar)):
            continue  # no further errors for an invalid body
        whole = () if model.thing.reads_file else (plane_body_checks.model, _check_body)
        unfit = [doubt for of in whole for doubt in of(model, case)]
        yield from unfit
        if unfit:
            continue
        blamed = [d for d in (*case.supports, *case.loads) if _has_error(d, found)]
        own = (*model.thing.diagnostics(model, case), *disturbed(scene, model, case))
        for doubt in (*own, *_check_in_scene(scene, model, case)):
            if any(d.contains(doubt) for d in blamed):
                continue
            key = (doubt.code, doubt.source, doubt.span, doubt.label, doubt.help)
            first.setdefault(key, (doubt, []))[1].append(model.name)
    for doubt, names in first.values():
        others = ", ".join(f"`{n}`" for n in names[1:])
        alone = not others or f"`{names[0]}`" not in doubt.message
        yield doubt if alone else replace(doubt, notes=(*doubt.notes, f"the same applies to {others}"))


def _check_body(model: Declared, case: Case) -> Iterator[Diagnostic]:
    """Check that a model supports networks and materials with fibre directions."""
    yield from unsupported_feature_errors(model, case, (NETWORKS, ANISOTROPY))


def _check_in_scene(scene: Scene, model: Declared, case: Case) -> list[Diagnostic]:
    """Return the errors of a model that need the whole scene, for example the data to which it is fitted."""
    doubts: list[Diagnostic] = model.thing.scene_diagnostics(scene, model, case)
    return doubts


def _check_references(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    for reference, case in _cases(scene, "reference"):
        if reference.thing.how != "solved":  # measured: independent of supports
            continue
        if case.shape.wired and not reference.thing.supports_networks:
            from softmark.interpreter.validation import frame_checks

            yield from frame_checks.reference(reference, case)
            continue
        loose = not case.supports and _has_error(case.body, found)
        if loose or any(_has_error(d, found) for d in (*case.supports, *case.loads)):
            continue
        try:
            problem_of(reference, case)
        except Fault as refused:
            yield refused.diagnostic


def _check_metrics(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that a metric compares its probe with a reference of the same body, and that it suits plane bodies."""
    yield from plane_body_checks.metrics(scene)
    yield from metric_faults(scene)
    yield from used_scene_checks.metric_faults(scene)
    if any(body.thing.shape.wired for body in scene.of_kind("body").values()):
        from softmark.interpreter.validation import frame_checks

        yield from frame_checks.check_metrics_and_probes(scene)
    for metric in scene.of_kind("metric").values():
        against = metric.thing.measured_from
        if against is None:
            continue
        looked, known = _compared_body(scene, metric.name), _body_name_or_none(scene, against)
        if None not in (looked, known) and looked != known:
            yield diagnostic("E505", metric.at("against"),
                             f"`{metric.name}` compares points of `{looked}` with a solution for `{known}`",
                             "different bodies", "use a probe and a reference of the same body")  # fmt: skip


def _check_fluid_metrics(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check fluid metrics; the module for these checks is imported only for scenes with fluid."""
    words = ("drained", "pore_pressure", "outflow")
    if any(d.constructor.name in words for kind in ("support", "metric") for d in scene.of_kind(kind).values()):
        from softmark.interpreter.validation import fluid_checks

        yield from fluid_checks.metrics(scene)


def _check_expectations(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that an expectation uses a metric of a model or reference of the same body."""
    for expectation in scene.expectations:
        for name in find_metrics(expectation.node):
            if name.text in scene.parameters:
                continue
            owner, metric = name.parts
            looked, known = _compared_body(scene, metric), _body_name_or_none(scene, owner)
            if None not in (looked, known) and looked != known:
                at = Location(expectation.location.source, name.span)
                problem = f"`{owner}` refers to `{known}`, but `{metric}` is evaluated on `{looked}`"
                remedy = "use a metric whose probe is of the same body"
                yield diagnostic("E505", at, problem, "different bodies", remedy)


def _check_published_columns(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that a column of published values has one value per model, with the metric's dimension."""
    for column in scene.of_kind("published").values():
        thing, unit = column.thing, scene.declared[column.thing.metric].thing.unit
        due = units.parse_unit(unit).dimension
        if len(thing.of) != len(thing.values.values):
            models, values = _count(len(thing.of), "model"), _count(len(thing.values.values), "value")
            yield diagnostic("E506", column.at("values"), f"`{column.name}` has {models} and {values}",
                             "not one per model", "give as many values as models, in the same order")  # fmt: skip
        elif thing.values.dimension != due:
            name, given = units.dimension_name(due), units.dimension_name(thing.values.dimension)
            yield diagnostic("E204", column.at("values"), f"expected {name}, found {given}", given,
                             f"`{thing.metric}` is {name}; give the values in {units.usual_units(due)}")  # fmt: skip


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


def _check_comparisons(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    yield from check_comparisons(scene)


def _check_curves(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check measured curves and the metrics compared with them."""
    loops = any(m.thing.of_all_states for m in scene.of_kind("metric").values())
    if loops or any(isinstance(d.thing, CurveFromFile) for d in scene.of_kind("reference").values()):
        from softmark.interpreter.validation import curve_checks

        yield from curve_checks.faults(scene, found)


def _check_given_values(scene: Scene) -> Iterator[Diagnostic]:
    """Check given values in all states, and the metrics compared with them."""
    if any(isinstance(d.thing, GivenValues) for d in scene.of_kind("reference").values()):
        from softmark.interpreter.validation import value_checks

        yield from value_checks.faults(scene)


def _check_refinements(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    yield from doubts_of_refined(scene)


def _check_amplitudes(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check that moving supports of a body share one amplitude in dynamics, and that steps resolve all amplitudes."""
    moved: dict[str, Declared] = {}
    analyses = list(scene.of_kind("analysis").values())
    for support in scene.of_kind("support").values():
        if not analyses or not isinstance(analyses[0].thing, Dynamic):
            continue
        if not support.thing.follows_amplitude:
            continue
        first = moved.setdefault(support.thing.body, support)
        if first.thing.amplitude != support.thing.amplitude:
            yield diagnostic("E501", support.at("amplitude"),
                             f"`{support.name}` and `{first.name}` have different amplitudes",
                             "differs from the first",
                             "give the same `amplitude` to all supports that move")  # fmt: skip
    yield from check_amplitude_resolution(scene)


def _check_contacts(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    if scene.of_kind("contact") or scene.of_kind("rigid"):
        from softmark.interpreter.validation import contact_checks

        yield from contact_checks.faults(scene)


def _check_friction_and_motion(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    if scene.of_kind("contact") or scene.of_kind("rigid"):
        from softmark.interpreter.validation import dynamic_contact_checks, free_body_checks, friction_checks

        for checks in (free_body_checks, dynamic_contact_checks, friction_checks):
            yield from checks.faults(scene)


def _compared_body(scene: Scene, metric: str) -> str | None:
    """Return the body whose points a metric compares."""
    body: str | None = scene.declared[metric].thing.body_in(scene)
    return body


def _body_name_or_none(scene: Scene, worker: str) -> str | None:
    try:
        return body_of(scene, scene.declared[worker])
    except Fault:
        return None


def _check_values(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    for lint in value_warnings.LINTS:
        yield from lint(scene)


def _check_regions(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    if scene.of_kind("region"):
        from softmark.interpreter.validation import region_checks

        named = (region_checks.check_owners, region_checks.check_groups, region_checks.check_order)
        for ask in (*named, region_checks.check_overlaps, region_checks.check_models):
            yield from ask(scene)


def _check_varying_materials(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check materials that vary in space; the module is imported only for scenes with such a material."""
    if any(not case_of(scene, body).uniform for body in scene.of_kind("body")):
        from softmark.interpreter.problem import heterogeneity_limits

        yield from heterogeneity_limits.check_ranges(scene)
        for model, case in _cases(scene, "model", valid=False):
            yield from unsupported_feature_errors(model, case, (VARYING_CONSTANTS,))


def _check_directions(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Check materials with fibre directions; the module is imported only for scenes with such a material."""
    if any(getattr(declared.thing, "directed", False) for declared in scene.of_kind("material").values()):
        from softmark.interpreter.problem import anisotropy_limits

        yield from anisotropy_limits.check_fiber_materials(scene)


def _check_unused_declarations(scene: Scene, found: Found) -> Iterator[Diagnostic]:
    """Report declarations that nothing uses, if the scene has no errors."""
    if not any(d.severity == "error" for d in found):
        yield from value_warnings.find_idle_models(scene)
        yield from value_warnings.find_unused_names(scene)


Check = Callable[[Scene, Found], Iterator[Diagnostic]]
LOCAL: tuple[Check, ...] = (
    _check_single_analysis, _check_shapes, _check_contacts, _check_plane_bodies, _check_supports_of_bodies,
    _check_selections, _check_points_inside, _check_mesh_node_probes, _check_values,
)  # fmt: skip
WHOLE: tuple[Check, ...] = (
    _check_friction_and_motion, _check_bodies_of_models, _check_regions, _check_directions,
    _check_varying_materials, given.faults, check_loads, _check_supports, _check_undeformed_bodies,
    _check_equilibrium_paths, _check_models, _check_references, _check_refinements, _check_metrics,
    _check_fluid_metrics, _check_comparisons, _check_curves, _check_amplitudes, _check_published_columns,
    _check_expectations, _check_unused_declarations,
)  # fmt: skip


def apply_overrides(scene: Scene, more: Sequence[Override]) -> tuple[Scene, list[Diagnostic]]:
    """Return a valid scene with further overrides, and all its diagnostics except those of its studies."""
    other, diagnostics = recompile(scene, more)
    if check not in other.known:
        complete = not any(d.severity == "error" for d in diagnostics)
        other.known[check] = check(other, complete)
    return other, diagnostics + other.known[check]
