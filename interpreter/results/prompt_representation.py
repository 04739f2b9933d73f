"""How a report and its parts read at a prompt, in a debugger and in a log: one line each, never their arrays.

They are taken as they are, without their classes, which are made from this.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SHOWN = 60  # characters of a title or of a message, and
NAMED = 8  # names that a line has


def told(report: Any) -> str:
    """`<Report of 'A beam': models tets, rod converged; reference theory converged; 2 of 2 expectations met>`."""
    title = str(report.scene.get("title") or report.scene.get("file") or "a scene without a title")
    said = [*_ends("model", report.models), *_ends("reference", report.references), _expected(report.expectations)]
    unfinished = ", unfinished" if report.partial else ""
    return f"<{_name(report)} of {cut(title)!r}{unfinished}: {'; '.join(said)}>"


def _ends(noun: str, results: Mapping[str, Any]) -> list[str]:
    """How many ended in each way, and who."""
    ends: dict[str, list[str]] = {}
    for name, result in results.items():
        ends.setdefault(_ended(result), []).append(name)
    return [f"{noun}{'s' * (len(own) > 1)} {listed(own)} {status}" for status, own in ends.items()]


def _ended(result: Any) -> str:
    """Return the status of a result, as text, and whether cells are inverted."""
    return f"{result.status} with cells inside out" if getattr(result, "inverted", 0) else str(result.status)


def _expected(expectations: Sequence[Any]) -> str:
    if not expectations:
        return "nothing was expected"
    count = len(expectations)
    return f"{sum(e.passed is True for e in expectations)} of {count} expectation{'s' * (count != 1)} met"


def outcome(result: Any) -> str:
    """`<ModelResult 'rod' converged; probes axis; metrics eta, tip>`."""
    said = f"{_ended(result)}: {cut(result.message)}" if result.message else _ended(result)
    known = {"probes": result.probes, "metrics": result.metrics}
    parts = [said, *(f"{what} {listed(list(own))}" for what, own in known.items() if own)]
    parts += [f"{len(result.states)} states"] if result.states else []
    return f"<{_name(result)} {result.name!r} {'; '.join(parts)}>"


def probed(seen: Any) -> str:
    """`<ProbeResult: 41 points; points, displacement, position in m>`."""
    count, times = len(seen.points), "" if seen.times is None else f" at {len(seen.times)} times"
    return f"<{_name(seen)}: {count} point{'s' * (count != 1)}{times}; points, displacement, position in m>"


def measured(metric: Any) -> str:
    """`<MetricResult: 0.0012 m>`, or why there is no value."""
    if metric.value is None:
        return f"<{_name(metric)}: no value, {cut(metric.reason or 'and no reason was given')}>"
    unit = "" if metric.unit in ("1", "") else f" {metric.unit}"
    return f"<{_name(metric)}: {metric.value:.6g}{unit}>"


def drawn(curve: Any) -> str:
    """`<SeenCurve: 30 points, y in N over x in m>`."""
    across, up = curve.units
    return f"<{_name(curve)}: {len(curve.x)} points, y in {up} over x in {across}>"


def cut(words: str) -> str:
    """On one line, and not a long one."""
    words = " ".join(words.split())
    return words if len(words) <= SHOWN else f"{words[: SHOWN - 1]}…"


def listed(names: Sequence[str]) -> str:
    """The first names, and how many follow."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _name(thing: object) -> str:
    return type(thing).__name__
