"""What is wrong with values that a scene gives and with what is held against them, as far as the text tells."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.language.states import states_of
from softmark.interpreter.metrics.of_curves import OfCurves
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.references.values import Values


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """All of it, of the scene with its states."""
    wrong: set[str] = set()
    for reference in scene.of_kind("reference").values():
        if isinstance(reference.thing, Values):
            told = [*_uncertain(reference), *_as_many(scene, reference)]
            wrong |= {reference.name} if told else set()
            yield from told
    for metric in scene.of_kind("metric").values():
        if isinstance(metric.thing, ErrorOfValue) and metric.thing.against not in wrong:
            yield from _held(scene, metric)


# ------------------------------------------------------------------ the values


def _uncertain(reference: Declared) -> Iterator[Diagnostic]:
    """An uncertainty that is neither of the dimension of the values nor a share, or of another number of values."""
    thing: Values = reference.thing
    due, given = thing.values.dimension, thing.uncertainty.dimension
    if given not in (due, units.NONE):
        name, found = units.named(due), units.named(given)
        yield diagnostic("E204", reference.at("uncertainty"), f"expected {name}, found {found}", found,
                         f"the values are {name}: give `uncertainty` in {units.usual(due)}, or a share in %"
                         )  # fmt: skip
    count, own = len(thing.values.values), len(thing.uncertainty.values)
    if own not in (1, count):
        yield diagnostic("E224", reference.at("uncertainty"),
                         f"`{reference.name}` has {_count(count, 'value')} and {own} uncertainties", "not one for each",
                         "give one that holds for all, or as many as values, in the same order")  # fmt: skip


def _as_many(scene: Scene, reference: Declared) -> Iterator[Diagnostic]:
    """As many values as the analysis has states, or one."""
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
        help = 'a motion has one value; a course in time is a table: `curve("swing.csv", ...)`'
    yield diagnostic("E224", reference.at("values"), f"`{reference.name}` has {_count(count, 'value')}, and {has}",
                     "not one for each", help)  # fmt: skip


def _analyses(scene: Scene) -> list[Declared]:
    return list(scene.of_kind("analysis").values())


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


# ------------------------------------------------------------------ what is held against them


def _held(scene: Scene, metric: Declared) -> Iterator[Diagnostic]:
    """The metric must be measured from nothing, and of the dimension of the values, none of which is zero."""
    thing, of = metric.thing, scene.declared[metric.thing.of]
    reference = scene.declared[thing.against]
    if not isinstance(reference.thing, Values):
        return  # said of all comparisons
    if of.thing.measured_from is not None:
        yield diagnostic("E509", metric.at("of"), f"`{of.name}` is an error already, and no measurement", "no number",
                         "name a metric that is measured from nothing: a displacement, a force")  # fmt: skip
        return
    if isinstance(of.thing, OfCurves):
        yield diagnostic("E509", metric.at("of"), f"`{of.name}` is of the way through all states, and a value is of"
                         " one", "no number of one state",
                         f"expect it directly: `expect abs(MODEL.{of.name} - 12 %) < 1 %`")  # fmt: skip
        return
    due, given = units.parse(of.thing.unit).dimension, reference.thing.values.dimension
    if due != given:
        name, found = units.named(due), units.named(given)
        yield diagnostic("E204", metric.at("against"), f"expected {name}, found {found}", f"`{reference.name}` is"
                         f" {found}", f"`{of.name}` is {name}; hold it against values in {units.usual(due)}"
                         )  # fmt: skip
        return
    yield from _relative(metric, reference)


def _relative(metric: Declared, reference: Declared) -> Iterator[Diagnostic]:
    """What the difference is relative to must not be zero."""
    by_value = metric.thing.relative_to == "value"
    sizes = [known.value if by_value else known.uncertainty for known in reference.thing.each]
    if all(sizes):
        return
    one = "a value" if by_value else "an uncertainty"
    help = "divide by the uncertainty instead: `relative_to = uncertainty`"
    if not by_value:
        help = f"give `{reference.name}` an uncertainty, in the unit of its values, or leave `relative_to` out"
    yield diagnostic("E225", metric.at("against"), f"`{reference.name}` has {one} of zero, and nothing is relative to"
                     " that", "zero", help)  # fmt: skip
