"""Checks of given reference values and of the metrics compared with them."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.scene_states import states_of
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.references.code_consensus import Consensus
from softmark.references.published_values import GivenValues

SHARES = ("uncertainty", "spread")  # fields that may be a share of the value
WIDE = {
    True: 1.0,
    False: 2.0,
}  # relative widths of a band of codes and of an uncertainty above which they are meaningless


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield all errors of given values, in the scene with all its states."""
    wrong: set[str] = set()
    blamed: set[str] = set()  # names already reported for a metric
    doubts: list[tuple[str, Diagnostic]] = []
    for reference in scene.of_kind("reference").values():
        if isinstance(reference.thing, GivenValues):
            told = [*_check_uncertainties(reference), *_check_value_count(scene, reference)] or [
                *_check_band(reference)
            ]
            refused = [d for d in told if d.severity == "error"]
            wrong |= {reference.name} if refused else set()
            doubts += [(reference.name, d) for d in told if d.severity != "error"]
            yield from refused
    for metric in scene.of_kind("metric").values():
        if isinstance(metric.thing, ErrorOfValue) and metric.thing.against not in wrong:
            yield from (refused := [*_check_metric(scene, metric)])
            blamed |= {metric.thing.against} if refused else set()
    yield from (d for name, d in doubts if name not in blamed)


# ------------------------------------------------------------------ the values


def _check_uncertainties(reference: Declared) -> Iterator[Diagnostic]:
    """Check that given values have a source, and as many uncertainties as values, relative or in the same dimension."""
    if not reference.thing.source_.strip():
        word = reference.constructor.name
        yield diagnostic("E206", reference.at("source"), f"`{word}` needs `source`", "no source",
                         "give the source: a paper and its table, a code and its version, or who measured it"
                         )  # fmt: skip
        return
    if isinstance(reference.thing, Consensus) and (fault := _band_error(reference)) is not None:
        yield fault
        return
    for field in reference.thing.lists:
        if reference.value(field) is not None:
            yield from _check_uncertainty_field(reference, field)


def _check_uncertainty_field(reference: Declared, field: str) -> Iterator[Diagnostic]:
    """Check one field that gives uncertainties."""
    values, own = reference.thing.values, reference.value(field)
    shares = field in SHARES
    due, given = values.dimension, own.dimension
    if given != due and not (shares and given == units.NONE):
        name, found = units.dimension_name(due), units.dimension_name(given)
        more = ", or a share in %" if shares else ""
        yield diagnostic("E204", reference.at(field), f"expected {name}, found {found}", found,
                         f"the values are {name}: give `{field}` in {units.usual_units(due)}{more}"
                         )  # fmt: skip
    count, each = len(values.values), len(own.values)
    if each not in (1, count):
        noun = "uncertainties" if field == "uncertainty" else f"entries in `{field}`"
        yield diagnostic(
            "E224",
            reference.at(field),
            f"`{reference.name}` has {_count(count, 'value')} but {each} {noun}",
            "needs one for each value",
            "give one for all values, or one per value in the same order",
        )


def _band_error(reference: Declared) -> Diagnostic | None:
    """Return the error for a band that is missing, given in two ways, or lacks one end, or None."""
    said = [field for field in reference.thing.lists if reference.value(field) is not None]
    if said in (["spread"], ["low", "high"]):
        return None
    name, why, at = reference.name, "`{}` does not give the range of the codes", reference.at()
    if "spread" in said:
        why, at = "the band of `{}` is given in two ways", reference.at("spread")
    elif said:
        other = "high" if said == ["low"] else "low"
        why, at = f"the band of `{{}}` has no `{other}`", reference.at(said[0])
    return diagnostic("E226", at, why.format(name), "unclear band",
                      "give `spread`, as an amount or a percentage on both sides, or `low` and `high`")  # fmt: skip


def _check_band(reference: Declared) -> Iterator[Diagnostic]:
    """Check that a band contains the value, has a width, and is not too wide to be meaningful."""
    name, dimension = reference.name, reference.thing.values.dimension
    agreed = isinstance(reference.thing, Consensus)
    for known in reference.thing.each:
        low, high = known.ends
        value, *ends = (units.format_value(v, dimension) for v in (known.value, low, high))
        said = reference.thing.lists[0]
        at = reference.at(said if reference.value(said) is not None else "low" if known.value < low else "high")
        if not low <= known.value <= high:
            yield diagnostic("E227", at, f"the value of `{name}`, {value}, lies outside its band, {ends[0]} to "
                                         f"{ends[1]}", "excludes the value",
                             "correct the value or the band: a value on which codes agree lies between their "
                             "smallest and largest"
                             )  # fmt: skip
            return
        if low == high and reference.thing.kind != "theory":
            yield diagnostic(
                "W359",
                at,
                f"no model can agree with `{name}`: its value {value} has no uncertainty",
                "zero width",
                "give half of the last printed digit as uncertainty; `values` with `kind = theory` are exact",
            )
            return
        if high - low > WIDE[agreed] * abs(known.value) > 0.0:
            one = f"the codes of `{name}` range" if agreed else f"`{name}` ranges"
            yield diagnostic("W360", at, f"{one} from {ends[0]} to {ends[1]}, too wide for the value {value}",
                             "as wide as the value", "narrow the band, or remove the expectation: a model could "
                                                     "hardly fail it")  # fmt: skip
            return


def _check_value_count(scene: Scene, reference: Declared) -> Iterator[Diagnostic]:
    """Check that a reference has one value, or one for each state."""
    count, states = len(reference.thing.values.values), len(states_of(scene))
    if count in (1, states) or any(a.value("states") is not None and not states for a in _analyses(scene)):
        return
    moving = any(isinstance(a.thing, Dynamic) for a in _analyses(scene))
    has = f"the analysis has {_count(states, 'state')}" if states else "the analysis has no states"
    help = "give one value per state, in order, or one value for all states"
    if not states:
        help = "give one value, or a reference for each; with states, give one value per state:"
        help += " `static(states = [50, 100] %)`"
    if moving:
        help = 'give one value; for a time history use a table: `curve("swing.csv", ...)`'
    yield diagnostic("E224", reference.at("values"), f"`{reference.name}` has {_count(count, 'value')}, but {has}",
                     "not one per state", help)  # fmt: skip


def _analyses(scene: Scene) -> list[Declared]:
    return list(scene.of_kind("analysis").values())


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


# ------------------------------------------------------------------ metrics compared with them


def _check_metric(scene: Scene, metric: Declared) -> Iterator[Diagnostic]:
    """Check one metric that compares another metric, `of`, with a given value.

    The metric `of` must be neither an error nor a curve, the dimensions must agree, and a relative difference needs a
    nonzero divisor.
    """
    thing, of = metric.thing, scene.declared[metric.thing.of]
    reference = scene.declared[thing.against]
    if not isinstance(reference.thing, GivenValues):
        return  # reported for all comparisons
    if of.thing.measured_from is not None:
        yield diagnostic(
            "E509",
            metric.at("of"),
            f"`{of.name}` is itself an error, not a measured quantity",
            "not a quantity",
            "name a metric that needs no reference, such as a displacement or a force",
        )
        return
    if isinstance(of.thing, CurveMetric):
        yield diagnostic("E509", metric.at("of"), f"`{of.name}` is computed from all states, but a value belongs to "
                                                  "one state", "not a value of one state",
                         f"expect it directly: `expect abs(MODEL.{of.name} - 12 %) < 1 %`")  # fmt: skip
        return
    due, given = units.parse_unit(of.thing.unit).dimension, reference.thing.values.dimension
    if due != given:
        name, found = units.dimension_name(due), units.dimension_name(given)
        yield diagnostic("E204", metric.at("against"), f"expected {name}, found {found}", f"`{reference.name}` is"
                         f" {found}", f"compare `{of.name}`, which is {name}, with values in {units.usual_units(due)}"
                         )  # fmt: skip
        return
    yield from _check_divisor(metric, reference)


def _check_divisor(metric: Declared, reference: Declared) -> Iterator[Diagnostic]:
    """Check that the divisor of a relative difference is not zero."""
    by_value = metric.thing.relative_to == "value"
    sizes = [known.value if by_value else min(known.sides) for known in reference.thing.each]
    if all(sizes):
        return
    banded = isinstance(reference.thing, Consensus)
    one = "value" if by_value else "band" if banded else "uncertainty"
    side = " on one side" if banded and not by_value else ""
    help = "divide by the uncertainty instead: `relative_to = uncertainty`"
    if not by_value:
        help = f"give `{reference.name}` an uncertainty in the unit of its values, or remove `relative_to`"
        help = "give the band a width on both sides, or remove `relative_to`" if banded else help
    yield diagnostic("E225", metric.at("against"), f"`{metric.name}` would be divided by the {one} of "
                                                   f"`{reference.name}`, which is zero{side}",
                     "zero divisor", help)  # fmt: skip
