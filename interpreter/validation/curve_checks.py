"""Checks of measured curves and of the metrics compared with them, from the scene and its tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.displacement import Displacement
from softmark.interpreter.metrics.hysteresis import Hysteresis
from softmark.interpreter.validation.file_and_selection_checks import is_cheap_to_read
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic
from softmark.references.code_consensus import ConsensusCurve
from softmark.references.measured_curve import CurveFromFile
from softmark.references.measured_data import Unreadable

NEAR = 1e-9  # relative tolerance for the ends of a range


def faults(scene: Scene, found: list[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield all errors about curves, except of declarations that already have errors."""
    for reference in _curves(scene):
        told = list(_check_uncertainty(reference))
        yield from told or _check_column_units(reference)
    for metric in scene.of_kind("metric").values():
        blamed = any(d.severity == "error" and metric.contains(d) for d in found)
        if isinstance(metric.thing, CurveMetric) and not blamed:
            yield from _check_metric(scene, metric)


def _curves(scene: Scene) -> list[Declared]:
    """Return the references of a scene that are measured curves."""
    return [d for d in scene.of_kind("reference").values() if isinstance(d.thing, CurveFromFile)]


# ------------------------------------------------------------------ the curve


def _check_uncertainty(reference: Declared) -> Iterator[Diagnostic]:
    """Check the uncertainty of a measured curve, and the dimensions of its amounts."""
    thing: CurveFromFile = reference.thing
    if isinstance(thing, ConsensusCurve) and (fault := _band_error(reference)) is not None:
        yield fault
    elif thing.uncertainty is None and not thing.uncertainty_columns and thing.repeats == 1:
        yield diagnostic("E408", reference.at(), f"`{reference.name}` has no uncertainty", "no uncertainty",
                         "give `uncertainty = 2 %` or an amount; or name the column of uncertainties with "
                         "`deviation`; or give repeated measurements: `path = [...]` or `y = [...]`")  # fmt: skip
    for field, of in (("x_origin", "x"), ("y_origin", "y"), ("uncertainty", "y")):
        given, due = reference.value(field), reference.value(f"{of}_unit").dimension
        allowed = (due, units.NONE) if field == "uncertainty" else (due,)
        if given is not None and given.dimension not in allowed:
            found, more = units.dimension_name(given.dimension), ", or a share in %" if field == "uncertainty" else ""
            yield diagnostic("E204", reference.at(field), f"expected {units.dimension_name(due)}, found {found}", found,
                             f"column {of} is {units.dimension_name(due)}: give `{field}` in"
                             f" {units.usual_units(due)}{more}")  # fmt: skip


def _band_error(reference: Declared) -> Diagnostic | None:
    """Return the error of a curve's band, which needs both ends, given in one way, and the number of codes."""
    thing: ConsensusCurve = reference.thing
    ends = [field for field in ("low", "high") if getattr(thing, field)]
    why, field = "", ends[0] if ends else ""
    if len(ends) == 1:
        why = f"the band of `{reference.name}` has no `{'high' if ends == ['low'] else 'low'}`"
    elif ends and (thing.deviation or thing.uncertainty is not None or thing.repeats > 1):
        why = f"the band of `{reference.name}` is given in two ways"
    if why:
        return diagnostic("E226", reference.at(field), why, "unclear band",
                          "give the columns `low` and `high` of one table, or `deviation` or `uncertainty`, or one "
                          "curve per code")  # fmt: skip
    if thing.code_count < 2:
        return diagnostic(
            "E226",
            reference.at(),
            f"`{reference.name}` does not state how many codes agreed",
            "number of codes missing",
            "give `codes`, or one curve per code: `path = [...]` or `y = [...]`",
        )
    if thing.codes is not None and 1 < thing.repeats != thing.codes:
        return diagnostic(
            "E226",
            reference.at("codes"),
            f"`{reference.name}` has {thing.repeats} curves, but `codes` is {thing.codes}",
            "different from the number of curves",
            "remove `codes`: each curve counts as one code",
        )
    return None


def _check_column_units(reference: Declared) -> Iterator[Diagnostic]:
    """Check for a unit in a column's name that contradicts the scene, as `Load (N)` does `y_unit = 1 kN`."""
    thing: CurveFromFile = reference.thing
    for field, names, unit in (("x_unit", (thing.x,), thing.x_unit), ("y_unit", thing.y, thing.y_unit)):
        for name in names:
            if not units.has_conflicting_unit(name, unit.value, unit.dimension):
                continue
            yield diagnostic("W334", reference.at(field), f"the column name `{name}` states a different unit",
                             f"`{field}` is {units.format_value(unit.value, unit.dimension)}",
                             "correct the unit or the name of the column")  # fmt: skip
            break


# ------------------------------------------------------------------ metrics compared with a curve


def _check_metric(scene: Scene, metric: Declared) -> Iterator[Diagnostic]:
    """Check one metric that is a curve, alone or compared with a measured curve.

    It must have a curve, of the same dimensions as the measured one and over its range. A hysteresis metric also
    needs a measured curve with unloading.
    """
    thing: CurveMetric = metric.thing
    reference, of = scene.declared.get(thing.measured_from or ""), scene.declared[thing.of]
    analysis = next((a.thing for a in scene.of_kind("analysis").values()), None)
    if reference is not None and not isinstance(reference.thing, CurveFromFile):
        return
    refusal = _missing_curve_error(scene, metric, of, isinstance(analysis, Dynamic), isinstance(analysis, Quasistatic))
    if refusal is None and isinstance(thing, Hysteresis):
        refusal = _unloading_error(metric, reference)
    if refusal is not None:
        yield refusal
    elif reference is not None:
        yield from _check_dimensions(scene, metric, of, reference, analysis)


def _unloading_error(metric: Declared, reference: Declared | None) -> Diagnostic | None:
    """Return the error if a measured curve has no unloading, or None."""
    if reference is None or not is_cheap_to_read(reference.thing.files):
        return None
    try:
        repeats, _ = reference.thing.read()
    except Unreadable:
        return None  # reported by the checks of files
    if all(one.loop is not None for one in repeats):
        return None
    return diagnostic("E509", metric.at("against"), f"`{reference.name}` has no unloading branch", "no loop",
                      "use a table that includes unloading: the loss is the area of the loop")  # fmt: skip


def _check_dimensions(
    scene: Scene, metric: Declared, of: Declared, reference: Declared, analysis: Any
) -> Iterator[Diagnostic]:
    """Check the dimensions of both axes, and whether a dynamic analysis covers the measured range."""
    thing: CurveMetric = metric.thing
    along = units.TIME
    if thing.over is not None:
        along = units.parse_unit(scene.declared[thing.over].thing.unit).dimension
    own = units.parse_unit(of.thing.unit).dimension
    for axis, due, given in (("x", along, reference.thing.x_unit), ("y", own, reference.thing.y_unit)):
        if given.dimension != due:
            name, found = units.dimension_name(due), units.dimension_name(given.dimension)
            yield diagnostic(
                "E518",
                metric.at("against"),
                f"`{metric.name}` has {name} on the {axis} axis, but `{reference.name}` has {found}",
                f"{axis} is {found}",
                f"use a curve whose `{axis}_unit` is {name}, in {units.usual_units(due)}",
            )
            return
    if isinstance(analysis, Dynamic | Quasistatic) and thing.over is None:
        yield from _check_time_range(metric, reference, analysis.duration)


def _missing_curve_error(scene: Scene, metric: Declared, of: Declared, moving: bool, timed: bool) -> Diagnostic | None:
    """Return the error if a metric has no curve, or None.

    There is no curve of a metric that is an error. In dynamics there is none of a metric without time history. In
    statics there is none without the field `over`.
    """
    thing: CurveMetric = metric.thing
    for field, other in (("of", of), ("over", scene.declared.get(thing.over or ""))):
        if other is not None and (other.thing.measured_from is not None or isinstance(other.thing, CurveMetric)):
            return diagnostic("E509", metric.at(field), f"`{other.name}` is itself an error, not a measured quantity",
                              "has no curve",
                              "name a metric that needs no reference, such as a displacement or a force")  # fmt: skip
    if thing.over == thing.of and not moving:
        return diagnostic("E509", metric.at("over"), f"the curve of `{of.name}` over itself is a straight line",
                          "the same metric", "name the metric of the other axis: `over = travel`, where `metric travel"
                          " = displacement(grip, along = +z)`")  # fmt: skip
    if moving and isinstance(thing, Hysteresis):
        return diagnostic("E509", metric.at(), f"`{metric.name}` needs a static analysis, but the analysis is dynamic",
                          "no states", "use states that load and unload: `static(states = [25, 50, 75, 100, 75, 50, "
                                       "25] %)`")  # fmt: skip
    if moving and thing.over is not None:
        return diagnostic("E509", metric.at("over"),
                          f"in a dynamic analysis the x axis of the curve of `{of.name}` is time",
                          "only for static analyses", "remove `over`")  # fmt: skip
    if moving and of.thing.followed and not of.thing.in_time:
        return diagnostic(
            "E509",
            metric.at("of"),
            f"`{of.name}` has one value for the whole motion: the {of.thing.when}",
            "one value",
            f"name a metric with a value at each time: `{of.constructor.name}(...)` without `over`",
        )
    if moving and not (isinstance(of.thing, Displacement) or of.thing.followed):
        return diagnostic("E509", metric.at("of"), f"`{of.name}` is not recorded over time: it is a "
                                                   f"`{of.constructor.name}`", "no time history",
                          "use a displacement, `displacement(tip, along = -z)`, or a contact metric: `force(touch, "
                          "along = +z)`")  # fmt: skip
    if not moving and thing.over is None and not (timed and not isinstance(thing, Hysteresis)):
        return diagnostic("E509", metric.at(), f"`{metric.name}` has no metric for the horizontal axis of its curve",
                          "`over` is missing",
                          "name the metric of the horizontal axis: `over = travel`, where `metric travel = "
                          "displacement(grip, along = +z)`")  # fmt: skip
    return None


def _check_time_range(metric: Declared, reference: Declared, duration: float) -> Iterator[Diagnostic]:
    """Warn about the part of a measured history that the analysis does not reach."""
    if not is_cheap_to_read(reference.thing.files):
        return
    try:
        low, high = reference.thing.span
    except Unreadable:
        return  # reported by the checks of files
    if low >= duration:
        yield diagnostic(
            "E518",
            metric.at("against"),
            f"`{reference.name}` begins after the end of the analysis",
            f"it begins at {units.format_value(low, units.TIME)}",
            f"use a longer `duration`: the analysis ends at {units.format_value(duration, units.TIME)}",
        )
    elif high > duration * (1.0 + NEAR):
        share = (duration - max(low, 0.0)) / (high - low)
        yield diagnostic(
            "W328",
            metric.at("against"),
            f"the analysis covers only {100.0 * share:.3g} % of `{reference.name}`",
            f"the data end at {units.format_value(high, units.TIME)}",
            f"use a longer `duration`: data after {units.format_value(duration, units.TIME)} are not compared",
        )
