"""Reasons of validity edges, and remedies, derived from classes, codes, stated errors and other models.

To add a remedy, write a line in BY_CODE or BY_PART, or a function in RULES. The first rule with a result counts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

from softmark.interpreter.language import units
from softmark.interpreter.planning.varied_quantities import WalkedQuantity
from softmark.interpreter.study.robustness.robustness_record import ClassifiedPoint, ValidityEdge
from softmark.interpreter.verification.error_estimate import DOUBTS

LONGEST = 110  # maximum characters of a reason

BY_CODE: dict[str, str] = {
    "W301": "use tet10, `formulation = mixed`, or hex8 with `integration = selective`",
    "W302": "use another strain measure: `strain = corotational` or `finite`",
    "W304": "use `fem(...)` for a body that is not slender",
    "W305": "use a finer mesh, or a size that divides the body evenly",
    "W306": "use another strain measure: `strain = corotational` or `finite`",
    "W312": "use a finer mesh",
    "W314": "add an imperfection or a load that leads to the intended state",
    "W318": "use a smaller step",
    "W321": "use `stiffness = calibrated(...)`, or finite elements",
    "W322": "use `stiffness = calibrated(...)`, or finite elements",
    "W331": "train the reduced model over this range",
    "E304": "use a larger size",
    "E552": "use tet10 or hex8 with `formulation = mixed`, or a Poisson's ratio below 0.5",
}
BY_PART: dict[str, str] = {
    "discretisation": "use a finer mesh",
    "model": "use another strain measure or another model",
    "rounding": "use double precision, or constants of more similar magnitude",
    "solver": "use a smaller tolerance",
}


def reason_of(point: ClassifiedPoint) -> str:
    """Return a short text on why the result of a configuration is not right."""
    doubt = next((DOUBTS[w] for w in point.warnings if w in DOUBTS), None)
    if point.word == "inaccurate" and doubt is not None:
        return f"{doubt}: {_error(point)}"
    if point.word == "inaccurate":
        return f"{_error(point)}; {point.message}" if point.message else _error(point)
    if point.word == "silent":
        return f"{_error(point)}, without a warning"
    return _first_sentence(point.message or point.word.replace("_", " "))


def _error(point: ClassifiedPoint) -> str:
    if point.error is None:
        return "the error is not known"
    return f"error {100 * point.error:.3g} %" if point.error < 10 else f"error by a factor of {point.error:.2g}"


def _first_sentence(text: str) -> str:
    """Return the first part of a message, up to a semicolon or line break, shortened to LONGEST characters."""
    first = re.split(r"; |\n", text)[0]
    return first if len(first) <= LONGEST else first[: LONGEST - 3].rsplit(" ", 1)[0] + " ..."


# ------------------------------------------------------------------ remedies


def remedy_of(
    point: ClassifiedPoint,
    quantity: WalkedQuantity,
    outlines: Mapping[str, str],
    others: Sequence[str],
    edge: ValidityEdge,
) -> str | None:
    """Return the remedy for a validity edge in words, or None.

    It is the text of the first rule that applies, followed by the names of other models that are right at that
    value.
    """
    found = [text for rule in RULES if (text := rule(point, quantity, edge))][:1]
    if others:
        named = ", ".join(f"{m} ({outlines[m]})" if outlines.get(m) else m for m in others[:2])
        found.append(f"right at that point: {named}")
    return "; ".join(found) or None


Rule = Callable[[ClassifiedPoint, WalkedQuantity, ValidityEdge], str | None]


def _remedy_for_setting(point: ClassifiedPoint, quantity: WalkedQuantity, edge: ValidityEdge) -> str | None:
    """Return the remedy for an edge in a setting of the model: a limit for its step, size, segments or tolerance."""
    attribute = quantity.name.rpartition(".")[2]
    own = attribute in ("step", "size", "segments", "tolerance", "quality")
    if not own or edge.last_right is None or point.word in ("timed_out", "unjudged"):
        return None
    bound = "at most" if edge.direction == "up" else "at least"
    return f"use a `{attribute}` of {bound} {format_quantity_value(quantity, edge.last_right)}"


def format_quantity_value(quantity: WalkedQuantity, value: float) -> str:
    """Format a value of a varied quantity with its unit."""
    if quantity.kind == "gap" and value < 0.5 and 0.5 - value < 1e-3:
        return f"0.5 - {0.5 - value:.3g}"
    if quantity.kind == "integer":
        return str(int(value))
    if quantity.vector:
        return f"{value:.4g}x"
    return units.format_value(float(f"{value:.4g}"), quantity.dimension) if value else "0"


def _remedy_for_cost(point: ClassifiedPoint, quantity: WalkedQuantity, edge: ValidityEdge) -> str | None:
    if point.word == "timed_out":
        return "give a longer time limit, `--timeout`"
    if point.word == "failed" and "memory" in (point.message or ""):
        return "use a coarser mesh"
    return None


def _remedy_for_incompressibility(point: ClassifiedPoint, quantity: WalkedQuantity, edge: ValidityEdge) -> str | None:
    if quantity.kind == "gap" and edge.direction == "up" and point.word != "unjudged":
        return BY_CODE["E552" if point.code == "E552" else "W301"]
    return None


def _remedy_for_code(point: ClassifiedPoint, quantity: WalkedQuantity, edge: ValidityEdge) -> str | None:
    codes = (point.code, *point.warnings)
    return next((BY_CODE[c] for c in codes if c in BY_CODE), None)


def _remedy_for_largest_error_part(point: ClassifiedPoint, quantity: WalkedQuantity, edge: ValidityEdge) -> str | None:
    """Return the remedy for the largest part of the error that the model states."""
    parts = {n: v for n, v in (point.stated.parts if point.stated else {}).items() if v is not None}
    if point.word not in ("inaccurate", "silent") or not parts:
        return None
    return BY_PART.get(max(parts, key=lambda name: parts[name]))


def _remedy_from_message(point: ClassifiedPoint, quantity: WalkedQuantity, edge: ValidityEdge) -> str | None:
    """Return the help text at the end of the model's message."""
    if point.word not in ("not_converged", "diverged", "refused"):
        return None
    _, semicolon, help = (point.message or "").rpartition("; ")
    return help if semicolon else None


RULES: tuple[Rule, ...] = (
    _remedy_for_cost,
    _remedy_for_setting,
    _remedy_for_incompressibility,
    _remedy_for_largest_error_part,
    _remedy_for_code,
    _remedy_from_message,
)
