"""Checks of given values and of the metrics compared with them."""

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
    """Yield all errors of given values, for the scene with its states."""
    wrong: set[str] = set()
    blamed: set[str] = set()  # names already reported for a metric
    doubts: list[tuple[str, Diagnostic]] = []
    for reference in scene.of_kind("reference").values():
        if isinstance(reference.thing, GivenValues):
            told = [*_check_uncertainties(reference), *_as_many(scene, reference)] or [*_check_band(reference)]
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
    """Check that uncertainties have the dimension of the values, or are shares, and are as many."""
    if not reference.thing.source_.strip():
        word = reference.constructor.name
        yield diagnostic("E206", reference.at("source"), f"`{word}` needs `source`", "nobody says so",
                         "`source` is who says so: a paper and its table, a code and its version, who measured it"
                         )  # fmt: skip
        return
    if isinstance(reference.thing, Consensus) and (fault := _band(reference)) is not None:
        yield fault
        return
    for field in reference.thing.lists:
        if reference.value(field) is not None:
            yield from _field(reference, field)


def _field(reference: Declared, field: str) -> Iterator[Diagnostic]:
    """Check one uncertainty field."""
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
        noun = "uncertainties" if field == "uncertainty" else f"in `{field}`"
        yield diagnostic("E224", reference.at(field),
                         f"`{reference.name}` has {_count(count, 'value')} and {each} {noun}", "not one for each",
                         "give one that holds for all, or as many as values, in the same order")  # fmt: skip


def _band(reference: Declared) -> Diagnostic | None:
    """Return the error for a band that is missing, given in two ways, or lacks one end."""
    said = [field for field in reference.thing.lists if reference.value(field) is not None]
    if said in (["spread"], ["low", "high"]):
        return None
    name, why, at = reference.name, "nothing says how far the codes of `{}` lie apart", reference.at()
    if "spread" in said:
        why, at = "the band of `{}` is said in two ways", reference.at("spread")
    elif said:
        other = "high" if said == ["low"] else "low"
        why, at = f"the band of `{{}}` has no `{other}`", reference.at(said[0])
    return diagnostic("E226", at, why.format(name), "from where to where?",
                      "give `spread`, an amount or a share on both sides, or `low` and `high`")  # fmt: skip


def _check_band(reference: Declared) -> Iterator[Diagnostic]:
    """Check that a band contains the value, has a width, and is not so wide that it means nothing."""
    name, dimension = reference.name, reference.thing.values.dimension
    agreed = isinstance(reference.thing, Consensus)
    for known in reference.thing.each:
        low, high = known.ends
        value, *ends = (units.format_value(v, dimension) for v in (known.value, low, high))
        said = reference.thing.lists[0]
        at = reference.at(said if reference.value(said) is not None else "low" if known.value < low else "high")
        if not low <= known.value <= high:
            yield diagnostic("E227", at, f"the value of `{name}`, {value}, does not lie in its band, {ends[0]} to"
                             f" {ends[1]}", "beyond the value",
                             "that on which codes agreed lies between the least and the largest of theirs"
                             )  # fmt: skip
            return
        if low == high and reference.thing.kind != "theory":
            yield diagnostic("W359", at, f"no model will agree with `{name}`, which is said to be {value} to the last"
                             " digit", "no width",
                             "a printed number is known to half its last digit; `kind = theory` of `values` is exact"
                             )  # fmt: skip
            return
        if high - low > WIDE[agreed] * abs(known.value) > 0.0:
            one = f"the codes of `{name}` lie" if agreed else f"`{name}` lies anywhere"
            yield diagnostic("W360", at, f"{one} between {ends[0]} and {ends[1]}, which says little of {value}",
                             "as wide as the value", "to be within says little of a model: correct the band, or expect"
                             " nothing of it")  # fmt: skip
            return


def _as_many(scene: Scene, reference: Declared) -> Iterator[Diagnostic]:
    """Check that there is one value, or one for each state."""
    count, states = len(reference.thing.values.values), len(states_of(scene))
    if count in (1, states) or any(a.value("states") is not None and not states for a in _analyses(scene)):
        return
    moving = any(isinstance(a.thing, Dynamic) for a in _analyses(scene))
    has = f"the analysis {_count(states, 'state')}" if states else "the analysis has no states"
    help = "give a value for each state, in their order, or one that holds in every state"
    if not states:
        help = "give one value, or a reference for each; an analysis with states has a value for each:"
        help += " `static(states = [50, 100] %)`"
    if moving:
        help = 'a motion has one value; a history in time is a table: `curve("swing.csv", ...)`'
    yield diagnostic("E224", reference.at("values"), f"`{reference.name}` has {_count(count, 'value')}, and {has}",
                     "not one for each", help)  # fmt: skip


def _analyses(scene: Scene) -> list[Declared]:
    return list(scene.of_kind("analysis").values())


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


# ------------------------------------------------------------------ what is held against them


def _check_metric(scene: Scene, metric: Declared) -> Iterator[Diagnostic]:
    """Check that the metric has no reference of its own and the dimension of the values, none of which is zero."""
    thing, of = metric.thing, scene.declared[metric.thing.of]
    reference = scene.declared[thing.against]
    if not isinstance(reference.thing, GivenValues):
        return  # reported for all comparisons
    if of.thing.measured_from is not None:
        yield diagnostic("E509", metric.at("of"), f"`{of.name}` is an error already, and no measurement", "no number",
                         "name a metric that is measured from nothing: a displacement, a force")  # fmt: skip
        return
    if isinstance(of.thing, CurveMetric):
        yield diagnostic("E509", metric.at("of"), f"`{of.name}` is of the way through all states, and a value is of"
                         " one", "no number of one state",
                         f"expect it directly: `expect abs(MODEL.{of.name} - 12 %) < 1 %`")  # fmt: skip
        return
    due, given = units.parse_unit(of.thing.unit).dimension, reference.thing.values.dimension
    if due != given:
        name, found = units.dimension_name(due), units.dimension_name(given)
        yield diagnostic("E204", metric.at("against"), f"expected {name}, found {found}", f"`{reference.name}` is"
                         f" {found}", f"`{of.name}` is {name}; hold it against values in {units.usual_units(due)}"
                         )  # fmt: skip
        return
    yield from _check_divisor(metric, reference)


def _check_divisor(metric: Declared, reference: Declared) -> Iterator[Diagnostic]:
    """Check that the divisor of the difference is not zero."""
    by_value = metric.thing.relative_to == "value"
    sizes = [known.value if by_value else min(known.sides) for known in reference.thing.each]
    if all(sizes):
        return
    banded = isinstance(reference.thing, Consensus)
    one = "a value" if by_value else "a band that ends at its value, a side" if banded else "an uncertainty"
    help = "divide by the uncertainty instead: `relative_to = uncertainty`"
    if not by_value:
        help = f"give `{reference.name}` an uncertainty, in the unit of its values, or leave `relative_to` out"
        help = "give it a width on both sides, or leave `relative_to` out" if banded else help
    yield diagnostic("E225", metric.at("against"), f"`{reference.name}` has {one} of zero, and nothing is relative to"
                     " that", "zero", help)  # fmt: skip
