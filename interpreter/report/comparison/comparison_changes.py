"""Terminal text of the changes between two result files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from softmark.grammar.diagnostic import make_all_visible
from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.study.analysis.comparison_point import Spread
from softmark.interpreter.study.analysis.result_changes import (
    Changes,
    FactChange,
    MetricChange,
    StatusChange,
    TimeChange,
)

STYLES = {"bold": "1", "good": "32", "bad": "31", "quiet": "2"}
WORSE = ("not_converged", "diverged", "failed", "timed_out")
NOTHING = "No changes: same models, statuses and values; no time differs by more than its noise."


def changes_table(changes: Changes, colour: bool) -> str:
    """Return the terminal text of all changes between two result files.

    It has one block of lines for each kind of change. The first blocks are changes that may have caused the others:
    those of the environment and of the scene. If no results changed, the text ends with a sentence that states this.
    """
    found = make_all_visible(changes)
    paint = colour and not os.environ.get("NO_COLOR")
    blocks = [
        _block("environment", _fact_rows(found.environment), paint),
        _block("scene", _fact_rows(found.scenes), paint),
        _block("added", [(n,) for n in found.added], paint),
        _block("removed", [(n,) for n in found.removed], paint),
        _block("status", [_status_row(c, paint) for c in found.status], paint),
        _block("values", [_metric_row(c) for c in found.metrics], paint),
        _block("times", [_time_row(c, paint) for c in found.times], paint),
        _block("expectations", _fact_rows(found.expectations), paint),
    ]
    head = _apply_ansi_style(" -> ".join(found.files), "bold", paint)
    told = [block for block in blocks if block]
    results = any(blocks[2:])
    return "\n\n".join([head, *told, *([] if results else [NOTHING])])


def _apply_ansi_style(words: str, name: str, paint: bool) -> str:
    return f"\x1b[{STYLES[name]}m{words}\x1b[0m" if paint else words


def _block(heading: str, rows: Sequence[Sequence[str]], paint: bool) -> str:
    """Return rows as aligned columns of text under a heading; the last cell of a row may have any width."""
    if not rows:
        return ""
    fixed = max(len(row) for row in rows) - 1
    widths = [max((len(row[i]) for row in rows if i < len(row) - 1), default=0) for i in range(fixed)]
    lines = [
        "  " + "  ".join([*(f"{c:<{w}}" for c, w in zip(row[:-1], widths, strict=False)), row[-1]]).rstrip()
        for row in rows
    ]
    return "\n".join([_apply_ansi_style(heading, "bold", paint), *lines])


def _fact_rows(facts: Sequence[FactChange]) -> list[tuple[str, str]]:
    return [(f.what, f"{plain_fact(f.old)} -> {plain_fact(f.new)}") for f in facts]


def plain_fact(known: Any) -> str:
    """Return a value of the environment or scene, such as a version, as text.

    A SHA-256 digest is cut to 12 digits.
    """
    said = "nothing" if known is None else str(known)
    return said[:12] if len(said) == 64 and set(said) <= set("0123456789abcdef") else said  # a digest


def _status_row(change: StatusChange, paint: bool) -> tuple[str, str]:
    said = f"{change.old} -> {change.new}".replace("_", " ")
    worse = change.new in WORSE
    reason = f": {change.message}" if worse and change.message else ""
    return change.name, _apply_ansi_style(said + reason, "bad" if worse else "good", paint)


def _metric_row(change: MetricChange) -> tuple[str, str, str, str]:
    unit, verdict = change.unit or "1", change.verdict
    if change.relative is not None:
        verdict = f"{verdict} ({100 * change.relative:+.3g} %)"
    elif change.reason:
        verdict = f"{verdict}: {change.reason}"
    return (
        change.name,
        change.metric,
        f"{format_value_with_unit(change.old, unit)} -> {format_value_with_unit(change.new, unit)}",
        verdict,
    )


def format_value_with_unit(number: float | None, unit: str) -> str:
    """Return a number with its unit as text."""
    return "none" if number is None else format_quantity(number, unit, 6, percent=True).replace("\u00a0", " ")


def _time_row(change: TimeChange, paint: bool) -> tuple[str, str, str, str]:
    course, clock = (
        f"{format_time_spread(change.old)} -> {format_time_spread(change.new)}",
        change.clock.removesuffix("_s"),
    )
    factor, words = (change.ratio, "longer") if change.ratio >= 1 else (1 / change.ratio, "shorter")
    style = {"undecided": "quiet", "slower": "bad"}.get(change.verdict, "good")
    said = f"{change.verdict}, {factor:.3g} times" + (f" {words}: {change.reason}" if change.reason else "")
    return change.name, clock.replace("_", " "), course, _apply_ansi_style(said, style, paint)


def format_time_spread(spread: Spread) -> str:
    """Return a median time as text, with its quartiles if they differ."""
    said, low, high = (format_quantity(s, "s", 3) for s in (spread.median, spread.q1, spread.q3))
    return (said if low == high else f"{said} [{low}-{high}]").replace("\u00a0", " ")
