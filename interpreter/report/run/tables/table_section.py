"""What the tables of regions, loads and supports share: a section of one table, by thing and by model, and forces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

from softmark.interpreter.language import units
from softmark.interpreter.language.number_formatting import round_significant
from softmark.interpreter.report.page.html_markup import section, tag, text

T = TypeVar("T")


def by_thing(known: Mapping[str, Mapping[str, T]]) -> dict[str, dict[str, T]]:
    """What each model says of each thing, by the thing and then by the model, in the order in which they come."""
    names = dict.fromkeys(name for own in known.values() for name in own)
    return {name: {model: own[name] for model, own in known.items() if name in own} for name in names}


def table_section(title: str, lead: str, heads: Sequence[str], rows: Sequence[str], below: str = "") -> str:
    """A section with one table under its title; `rows` and what stands `below` are markup. Empty without any rows."""
    if not rows:
        return ""
    head = tag("tr", *(tag("th", text(h), scope="col") for h in heads))
    table = tag("table", tag("caption", text(lead)), tag("thead", head), tag("tbody", *rows))
    return section(title.lower(), title, tag("div", table, class_="scroll"), below)


def row_head(name: str) -> str:
    """The name that a row is about."""
    return tag("th", tag("code", text(name)), scope="row")


def newtons(vector: Sequence[float], rounding: float, largest: float = 0.0) -> str:
    """Components in N to five digits; nothing where they are so small a part of the largest, or of what is given."""
    most = max(largest, *(abs(c) for c in vector))
    return _components(vector, 5, rounding * most).replace("-", "\N{MINUS SIGN}")


def _components(vector: Sequence[float], digits: int, nothing: float) -> str:
    """Components in N, those of no more than `nothing` as none."""
    return units.format_vector(
        [0.0 if abs(c) <= nothing else round_significant(c, digits) for c in vector], units.FORCE
    )


def pressing(force: Sequence[float], digits: int, rounding: float) -> str:
    """The size of a force in N, or, where it is along no axis, all of it: that of a part beside its mirrors is not."""
    size = math.hypot(*force)
    if round_significant(size, digits) == round_significant(
        max(map(abs, force)), digits
    ):  # what a metric along it comes to
        return units.format_value(round_significant(size, digits), units.FORCE)
    return _components(force, digits, rounding * size)
