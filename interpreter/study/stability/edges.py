"""What walks have found, as JSON: for each model and quantity how far it is right, and what lies beyond."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from softmark.interpreter.plan.quantities import WalkedQuantity
from softmark.interpreter.plan.walks import Walk
from softmark.interpreter.study.stability.classify import Classified
from softmark.interpreter.study.stability.remedies import reason_of, remedy_of

Json = dict[str, Any]
At = Callable[[str, str, float | str], Classified | None]  # model, quantity, value -> what the point there is
WORST = ("silent", "failed", "timed_out", "diverged", "not_converged", "refused", "inaccurate", "unjudged")


def edge_of(
    model: str, quantity: WalkedQuantity, walk: Walk, at: At, outlines: Mapping[str, str], others: Mapping[str, Walk]
) -> Json:  # fmt: skip
    """The edges of one walk; `others` go the same way with other models, which may be right where this one is not."""
    found, verdicts, ladder = walk.edge(), walk.verdicts(), walk.ladder

    def value(t: float | None) -> float | None:
        return None if t is None else ladder.at(t) if t > 0 else float(quantity.nominal)

    first, word = value(found.first_wrong), found.word
    beyond = at(model, quantity.name, first) if first is not None else None
    if word == "unjudged" and found.first_blind is not None:
        beyond = at(model, quantity.name, value(found.first_blind) or 0.0)
    silence = value(found.first_silence)
    mute = at(model, quantity.name, silence) if silence is not None and silence != first else None
    edge: Json = {
        "model": model, "quantity": quantity.name, "direction": ladder.direction,
        "last_right": value(found.last_right), "first_wrong": first, "class": word,
        "last_answer": value(found.last_answer), "first_silence": silence,
        "silence": None if mute is None else mute.word,
        "reason": None if beyond is None else reason_of(beyond),
        "remedy": None, "reached": value(found.reached), "here": verdicts.here,
        "first_right": value(verdicts.first_right), "judged": verdicts.judged, "blind": verdicts.blind,
        "first_unjudged": value(found.first_blind) if word == "unjudged" else None,
    }  # fmt: skip
    if beyond is not None and found.first_wrong is not None:
        right = [m for m, other in others.items() if (other.edge().last_right or 0.0) >= found.first_wrong > 0]
        edge["remedy"] = remedy_of(beyond, model, quantity, outlines, right, edge)
    return edge


def _right_there(model: str, quantity: WalkedQuantity, value: str, at: At, models: Sequence[str]) -> list[str]:
    """Other models that are right with a choice with which this one is not."""
    found = ((other, at(other, quantity.name, value)) for other in models if other != model)
    return [other for other, seen in found if seen is not None and seen.word == "right"]


def choice_of(
    model: str, quantity: WalkedQuantity, seen: Mapping[str, Classified], at: At, outlines: Mapping[str, str],
    models: Sequence[str],
) -> Json:  # fmt: skip
    """The edge of a quantity that is chosen: the worst that a choice comes to."""
    ranked = sorted((WORST.index(c.word), option) for option, c in seen.items() if c.word != "right")
    wrong = [option for _, option in ranked if seen[option].word != "unjudged"]
    right = [option for option in quantity.options if option in seen and seen[option].word == "right"]
    worst = seen[ranked[0][1]] if ranked else None
    edge: Json = {
        "model": model, "quantity": quantity.name, "direction": "up", "last_right": None, "first_wrong": None,
        "class": worst.word if worst else None, "last_answer": None, "first_silence": None, "silence": None,
        "reason": None, "remedy": None, "reached": None, "right": right, "wrong": wrong,
        "unjudged": [option for option, c in seen.items() if c.word == "unjudged"],
        "classes": {option: c.word for option, c in seen.items()},
    }  # fmt: skip
    if worst is not None:
        option = ranked[0][1]
        edge["reason"] = f"{option}: {reason_of(worst)}"
        if worst.word != "unjudged":  # that nothing is known of the truth is no fault of the model
            others = _right_there(model, quantity, option, at, models)
            edge["remedy"] = remedy_of(worst, model, quantity, outlines, others, edge)
    return edge
