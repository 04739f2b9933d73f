"""What changed between two results, for the terminal."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from softmark.grammar.diagnostic import all_visible
from softmark.interpreter.language.amounts import quantity

STYLES = {"bold": "1", "good": "32", "bad": "31", "quiet": "2"}
WORSE = ("not_converged", "diverged", "failed", "timed_out")
NOTHING = "Nothing changed: the same models, statuses and values; no time differs by more than its noise."


def changes_table(found: Mapping[str, Any], colour: bool) -> str:
    """A block for each kind of change, what explains it first; a sentence where there is none."""
    found = all_visible(found)
    paint = colour and not os.environ.get("NO_COLOR")
    blocks = [
        _block("environment", _facts(found["environment"]), paint),
        _block("scene", _facts(found["scenes"]), paint),
        _block("added", [(n,) for n in found["added"]], paint),
        _block("removed", [(n,) for n in found["removed"]], paint),
        _block("status", [_status(c, paint) for c in found["status"]], paint),
        _block("values", [_metric(c) for c in found["metrics"]], paint),
        _block("times", [_time(c, paint) for c in found["times"]], paint),
        _block("expectations", _facts(found["expectations"]), paint),
    ]
    head = _style(f"{found['files'][0]} -> {found['files'][1]}", "bold", paint)
    told = [block for block in blocks if block]
    results = any(found[k] for k in ("added", "removed", "status", "metrics", "times", "expectations"))
    return "\n\n".join([head, *told, *([] if results else [NOTHING])])


def _style(words: str, name: str, paint: bool) -> str:
    return f"\x1b[{STYLES[name]}m{words}\x1b[0m" if paint else words


def _block(heading: str, rows: Sequence[Sequence[str]], paint: bool) -> str:
    """Aligned rows under a heading; the last cell of a row is free."""
    if not rows:
        return ""
    fixed = max(len(row) for row in rows) - 1
    widths = [max((len(row[i]) for row in rows if i < len(row) - 1), default=0) for i in range(fixed)]
    lines = [
        "  " + "  ".join([*(f"{c:<{w}}" for c, w in zip(row[:-1], widths, strict=False)), row[-1]]).rstrip()
        for row in rows
    ]
    return "\n".join([_style(heading, "bold", paint), *lines])


def _facts(facts: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    return [(str(f["what"]), f"{_plain(f['old'])} -> {_plain(f['new'])}") for f in facts]


def _plain(value: Any) -> str:
    said = "nothing" if value is None else str(value)
    return said[:12] if len(said) == 64 and set(said) <= set("0123456789abcdef") else said  # a digest


def _status(change: Mapping[str, Any], paint: bool) -> tuple[str, str]:
    said = f"{change['old']} -> {change['new']}".replace("_", " ")
    reason = f": {change['message']}" if change["new"] in WORSE and change.get("message") else ""
    return str(change["name"]), _style(said + reason, "bad" if change["new"] in WORSE else "good", paint)


def _metric(change: Mapping[str, Any]) -> tuple[str, str, str, str]:
    unit = str(change.get("unit") or "1")
    course = f"{_value(change['old'], unit)} -> {_value(change['new'], unit)}"
    relative = change.get("relative")
    verdict = str(change["verdict"])
    if relative is not None:
        verdict = f"{verdict} ({100 * relative:+.3g} %)"
    elif change.get("reason"):
        verdict = f"{verdict}: {change['reason']}"
    return str(change["name"]), str(change["metric"]), course, verdict


def _value(value: float | None, unit: str) -> str:
    return "none" if value is None else quantity(value, unit, 6, percent=True).replace("\u00a0", " ")


def _time(change: Mapping[str, Any], paint: bool) -> tuple[str, str, str, str]:
    course = f"{_seconds(change['old'])} -> {_seconds(change['new'])}"
    verdict, ratio = str(change["verdict"]), float(change["ratio"])
    factor = ratio if ratio >= 1 else 1 / ratio
    words = "longer" if ratio >= 1 else "shorter"
    if verdict == "undecided":
        said = f"undecided, {factor:.3g} times {words}: {change['reason']}"
        return str(change["name"]), _clock(change), course, _style(said, "quiet", paint)
    style = "bad" if verdict == "slower" else "good"
    return str(change["name"]), _clock(change), course, _style(f"{verdict}, {factor:.3g} times", style, paint)


def _clock(change: Mapping[str, Any]) -> str:
    return str(change["clock"]).removesuffix("_s").replace("_", " ")


def _seconds(spread: Mapping[str, float]) -> str:
    said = quantity(spread["median"], "s", 3)
    low, high = quantity(spread["q1"], "s", 3), quantity(spread["q3"], "s", 3)
    return (said if low == high else f"{said} [{low}-{high}]").replace("\u00a0", " ")
