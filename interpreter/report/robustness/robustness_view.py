"""Display data of robustness studies: classes in words, and positions of values on a scale."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from softmark.interpreter.language.number_formatting import format_quantity, typeset_number
from softmark.interpreter.planning.varied_quantities import Value, WalkedQuantity
from softmark.interpreter.report.robustness.validity_range_text import options_by_class, range_ends
from softmark.interpreter.study.robustness.robustness_record import (
    ChoiceEdge,
    RobustnessPoint,
    RobustnessStudyRecord,
    ValidityEdge,
)
from softmark.records import dataclass


@dataclass(frozen=True)
class VerdictDisplay:
    """Display of a verdict on a point, such as `right` or `diverged`: its words, symbol and meaning.

    The symbol makes colour unnecessary.
    """

    words: str
    sign: str
    meaning: str


CLASSES: Mapping[str, VerdictDisplay] = {
    "right": VerdictDisplay("right", "✓", "error within the requested limit"),
    "inaccurate": VerdictDisplay(
        "inaccurate (reported)", "▲", "error above the limit, and the model reports that it may be"
    ),
    "silent": VerdictDisplay(
        "wrong without a warning", "!", "converged, but the error is above the limit and above the model's own estimate"
    ),
    "not_converged": VerdictDisplay("not converged", "×", "no equilibrium was found, and the model reports that"),
    "diverged": VerdictDisplay("diverged", "⤫", "the motion grew without bound, and the model reports that"),
    "refused": VerdictDisplay("refused", "–", "not run: the model does not apply to the scene"),
    "failed": VerdictDisplay("failed", "✗", "the solver stopped with an error, which is reported"),
    "timed_out": VerdictDisplay("timed out", "…", "no result within the time limit of a point"),
    "unjudged": VerdictDisplay("not judged", "?", "the reference has no result, or is not accurate enough"),
}


def verdict_display(name: object) -> VerdictDisplay:
    """Return the display of the verdict called `name`; an unknown verdict is shown by its name."""
    return CLASSES.get(str(name)) or VerdictDisplay(str(name).replace("_", " "), "?", "")


@dataclass(frozen=True)
class Ruler:
    """Scale that maps values of a quantity to positions from 0 to 1.

    It is logarithmic, logarithmic in the distance to a limit, linear, or evenly spaced.
    """

    name: str
    unit: str
    kind: str  # "log" | "gap" | "linear" | "turn"
    marks: tuple[Any, ...]  # values in order
    ends: tuple[float, float]

    def at(self, value: Any) -> float:
        """Return the position of a value: 0 for the lowest, 1 for the highest."""
        low, high = self.ends
        return (self._coordinate(value) - low) / (high - low) if high > low else 0.5

    def _coordinate(self, value: Any) -> float:
        return scale_coordinate(self.kind, value, self.marks)

    def value_text(self, value: Any) -> str:
        """Return a value as text in a suitable unit."""
        return format_value(value, self.unit)


DIGITS = 4  # edges are bisected to no more than two
GAP_LIMIT, LEAST_GAP = 0.5, 1e-10  # for Poisson's ratio, the only quantity varied by its distance to a limit


def scale_coordinate(kind: str, value: Any, marks: Sequence[Any]) -> float:
    """Return the coordinate of a value on a scale of the given kind, which increases along the scale.

    Kinds: `log` and `linear`; `gap`, logarithmic in the distance to the limit GAP_LIMIT; `turn`, evenly spaced in the
    order of `marks`.
    """
    if kind == "turn":
        return float(list(marks).index(value)) if value in marks else 0.0
    if kind == "gap":
        return -math.log10(max(GAP_LIMIT - float(value), LEAST_GAP))
    return math.log10(float(value)) if kind == "log" else float(value)


def ruler(asked: WalkedQuantity, values: Sequence[Any]) -> Ruler:
    """Return the scale that separates the given values of a quantity best."""
    numbers = all(isinstance(v, int | float) for v in values)
    marks = tuple(sorted(set(values)) if numbers else dict.fromkeys(values))
    kind = "turn"
    if numbers and asked.kind == "gap" and all(v <= GAP_LIMIT for v in marks):
        kind = "gap"
    elif numbers and marks:
        wide = marks[0] > 0 and marks[-1] > 8 * marks[0]
        mixed = marks[0] <= 0 and len(marks) > 2 and marks[-1] > 100 * min(v for v in marks if v > marks[0])
        kind = "log" if wide else "turn" if mixed else "linear"
    places = [scale_coordinate(kind, v, marks) for v in marks]
    return Ruler(asked.name, asked.unit, kind, marks, (min(places), max(places)))


def format_value(value: Any, unit: str) -> str:
    """Return a value as text with four digits; Poisson's ratios near 0.5 keep all their nines."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return str(value)
    if unit not in ("1", ""):
        return format_quantity(float(value), unit, DIGITS)
    return typeset_number(f"{value:.10g}" if 0.0 < GAP_LIMIT - value < 0.01 else f"{value:.{DIGITS}g}")


def valid_range(own: Collection[ValidityEdge], unit: str) -> list[str]:
    """Return both ends of the range in which a model is right as text, or the options with which it is right."""
    choice = next((e for e in own if isinstance(e, ChoiceEdge)), None)
    return range_ends(own, lambda value: format_value(value, unit)) if choice is None else list(choice.right)


def status_beyond(edge: ValidityEdge, unit: str) -> str | None:
    """Return the status beyond a validity edge and the value where it starts, as text.

    Return None if the model is right at all tested values.
    """
    if edge.word is None:
        return None
    words = verdict_display(edge.word).words
    if isinstance(edge, ChoiceEdge):
        others = [(word, own) for word, own in options_by_class(edge) if word != "right"]
        return "; ".join(f"{verdict_display(word).words} with {', '.join(own)}" for word, own in others)
    at_once = edge.word == "unjudged" and edge.last_right is None
    return words if edge.met is None or at_once else f"{words} from {format_value(edge.met, unit)}"


def points_along(
    study: RobustnessStudyRecord, model: str, quantity: WalkedQuantity
) -> list[tuple[Value, RobustnessPoint]]:
    """Return the points of a model along one quantity, with nominal values of all others, in no particular order."""
    nominal = {q.name: q.nominal for q in study.quantities}
    own = []
    for point in study.points:
        others = {name: v for name, v in point.values.items() if v != nominal.get(name)}
        if point.model == model and set(others) <= {quantity.name}:
            own.append((others.get(quantity.name, quantity.nominal), point))
    return own


def point_tooltip(point: RobustnessPoint) -> str:
    """Return the tooltip of a point: `rubber.poisson = 0.4999: right, error 0.3 %, states 2 %`."""
    found = point.found
    where = ", ".join(f"{n} = {t}" for n, t in (point.texts or point.values).items()) or "all values of the scene"
    pieces = [verdict_display(found.word).words]
    pieces += [f"error {percent(found.error)}"] if found.error is not None else []
    pieces += [f"estimated error {percent(found.states)}"] if found.states is not None else []
    pieces += [found.code] if found.code else []
    message = f"; {found.message}" if found.message else ""
    return f"{where}: {', '.join(pieces)}{message}"


def percent(value: float) -> str:
    """Return an error as per cent: `0.32 %`, `250 %`, `> 1000 %`."""
    return "> 1000 %" if value > 10 else f"{100 * value:.2g} %" if value < 1 else f"{100 * value:.0f} %"
