"""HTML section with one table, used for regions, loads and supports, and formatting of forces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

from softmark.interpreter.language import units
from softmark.interpreter.language.number_formatting import round_significant
from softmark.interpreter.report.page.html_markup import section, tag, text

T = TypeVar("T")


def transpose_by_name(known: Mapping[str, Mapping[str, T]]) -> dict[str, dict[str, T]]:
    """Return values by name and then by model, given values by model and then by name, in order of appearance."""
    names = dict.fromkeys(name for own in known.values() for name in own)
    return {name: {model: own[name] for model, own in known.items() if name in own} for name in names}


def table_section(title: str, lead: str, heads: Sequence[str], rows: Sequence[str], below: str = "") -> str:
    """Return an HTML section with one table under its title; empty without rows.

    `lead` is the text above the table. `rows` and `below` are markup.
    """
    if not rows:
        return ""
    head = tag("tr", *(tag("th", text(h), scope="col") for h in heads))
    table = tag("table", tag("caption", text(lead)), tag("thead", head), tag("tbody", *rows))
    return section(title.lower(), title, tag("div", table, class_="scroll"), below)


def row_head(name: str) -> str:
    """Return the HTML of a row header."""
    return tag("th", tag("code", text(name)), scope="row")


def newtons(vector: Sequence[float], rounding: float, largest: float = 0.0) -> str:
    """Return the components of a force, N, as text with five digits; round-off residues are zero.

    A residue is at most `rounding` times the largest component, or times `largest`, N, if that is larger.
    """
    most = max(largest, *(abs(c) for c in vector))
    return _components(vector, 5, rounding * most).replace("-", "\N{MINUS SIGN}")


def _components(vector: Sequence[float], digits: int, nothing: float) -> str:
    """Return the components of a force, N, as text; components of at most `nothing`, N, are shown as zero."""
    return units.format_vector(
        [0.0 if abs(c) <= nothing else round_significant(c, digits) for c in vector], units.FORCE
    )


def format_force(force: Sequence[float], digits: int, rounding: float) -> str:
    """Return a force, N, as text: its magnitude if it acts along a coordinate axis, else all its components.

    A force is oblique if only a symmetric part of a body is modelled, for instance. Components of at most `rounding`
    times the magnitude are shown as zero.
    """
    size = math.hypot(*force)
    if round_significant(size, digits) == round_significant(
        max(map(abs, force)), digits
    ):  # the force acts along a coordinate axis
        return units.format_value(round_significant(size, digits), units.FORCE)
    return _components(force, digits, rounding * size)
