"""Validity edges of models: the limit of a quantity up to which results are right, and the class of results beyond it.

Edges are found by walks, which vary one quantity in one direction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from softmark.interpreter.planning.parameter_walk import Walk
from softmark.interpreter.planning.varied_quantities import WalkedQuantity
from softmark.interpreter.study.robustness.robustness_record import WORST, ChoiceEdge, ClassifiedPoint, ValidityEdge
from softmark.interpreter.study.robustness.validity_edge_remedies import reason_of, remedy_of

At = Callable[[str, str, float | str], ClassifiedPoint | None]  # model, quantity, value -> class of the point


def edge_of(
    model: str, quantity: WalkedQuantity, walk: Walk, at: At, outlines: Mapping[str, str], others: Mapping[str, Walk]
) -> ValidityEdge:  # fmt: skip
    """Return the validity edge that a walk along one quantity has found, with its reason and a remedy.

    `others` are the walks of other models in the same direction: a model that is still right is named in the
    remedy. `at` returns the class of a model at a value.
    """
    found, verdicts, ladder = walk.edge(), walk.summarize(), walk.ladder

    def value(t: float | None) -> float | None:
        return None if t is None else ladder.at(t) if t > 0 else float(quantity.nominal)

    first, word = value(found.first_wrong), found.word
    beyond = at(model, quantity.name, first) if first is not None else None
    if word == "unjudged" and found.first_blind is not None:
        beyond = at(model, quantity.name, value(found.first_blind) or 0.0)
    silence = value(found.first_silence)
    mute = at(model, quantity.name, silence) if silence is not None and silence != first else None
    edge = ValidityEdge(
        model, quantity.name, ladder.direction, value(found.last_right), first, word, value(found.last_answer), silence,
        None if mute is None else mute.word, None if beyond is None else reason_of(beyond), None, value(found.reached),
        verdicts.here, value(verdicts.first_right), verdicts.judged, verdicts.blind,
        value(found.first_blind) if word == "unjudged" else None,
    )  # fmt: skip
    if beyond is None or found.first_wrong is None:
        return edge
    right = [m for m, other in others.items() if (other.edge().last_right or 0.0) >= found.first_wrong > 0]
    return replace(edge, remedy=remedy_of(beyond, quantity, outlines, right, edge))


def _models_right_at(model: str, quantity: WalkedQuantity, value: str, at: At, models: Sequence[str]) -> list[str]:
    """Return the names of the other models whose results are right with an option of the quantity."""
    found = ((other, at(other, quantity.name, value)) for other in models if other != model)
    return [other for other, seen in found if seen is not None and seen.word == "right"]


def make_choice_edge(
    model: str, quantity: WalkedQuantity, seen: Mapping[str, ClassifiedPoint], at: At, outlines: Mapping[str, str],
    models: Sequence[str],
) -> ChoiceEdge:  # fmt: skip
    """Return the validity edge of a quantity with discrete options, with the reason and remedy of the worst option."""
    ranked = sorted((WORST.index(c.word), option) for option, c in seen.items() if c.word != "right")
    right = tuple(option for option in quantity.options if option in seen and seen[option].word == "right")
    classes = {option: c.word for option, c in seen.items()}
    edge = ChoiceEdge(model, quantity.name, "up", right=right, classes=classes)
    if not ranked:
        return edge
    option = ranked[0][1]
    worst = seen[option]
    edge = replace(edge, word=worst.word, reason=f"{option}: {reason_of(worst)}")
    if worst.word == "unjudged":  # an unknown reference is no failure of the model
        return edge
    others = _models_right_at(model, quantity, option, at, models)
    return replace(edge, remedy=remedy_of(worst, quantity, outlines, others, edge))
