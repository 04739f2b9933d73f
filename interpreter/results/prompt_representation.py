"""One-line representations of a report and its parts for prompts, debuggers and logs, without arrays.

The functions accept objects of any class, because the classes of results import this module.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SHOWN = 60  # characters of a title or of a message, and
NAMED = 8  # names that a line has


def represent_report(report: Any) -> str:
    """Return `<Report of 'A beam': models tets, rod converged; theory converged; 2 of 2 expectations met>`."""
    title = str(report.scene.get("title") or report.scene.get("file") or "a scene without a title")
    said = [
        *_group_by_status("model", report.models),
        *_group_by_status("reference", report.references),
        _met_count_phrase(report.expectations),
    ]
    unfinished = ", unfinished" if report.partial else ""
    return f"<{_class_name(report)} of {shorten(title)!r}{unfinished}: {'; '.join(said)}>"


def _group_by_status(noun: str, results: Mapping[str, Any]) -> list[str]:
    """Return one text for each status, with the names of the results that have it."""
    ends: dict[str, list[str]] = {}
    for name, result in results.items():
        ends.setdefault(_status_text(result), []).append(name)
    return [f"{noun}{'s' * (len(own) > 1)} {join_names(own)} {status}" for status, own in ends.items()]


def _status_text(result: Any) -> str:
    """Return the status of a result as text, with a remark if cells are inverted."""
    return f"{result.status} with inverted cells" if getattr(result, "inverted", 0) else str(result.status)


def _met_count_phrase(expectations: Sequence[Any]) -> str:
    if not expectations:
        return "no expectations"
    count = len(expectations)
    return f"{sum(e.passed is True for e in expectations)} of {count} expectation{'s' * (count != 1)} met"


def represent_outcome(result: Any) -> str:
    """Return `<ModelResult 'rod' converged; probes axis; metrics eta, tip>`."""
    said = f"{_status_text(result)}: {shorten(result.message)}" if result.message else _status_text(result)
    known = {"probes": result.probes, "metrics": result.metrics}
    parts = [said, *(f"{what} {join_names(list(own))}" for what, own in known.items() if own)]
    parts += [f"{len(result.states)} states"] if result.states else []
    return f"<{_class_name(result)} {result.name!r} {'; '.join(parts)}>"


def represent_probe(seen: Any) -> str:
    """Return `<ProbeResult: 41 points; points, displacement, position in m>`."""
    count, times = len(seen.points), "" if seen.times is None else f" at {len(seen.times)} times"
    return f"<{_class_name(seen)}: {count} point{'s' * (count != 1)}{times}; points, displacement, position in m>"


def represent_metric(metric: Any) -> str:
    """Return `<MetricResult: 0.0012 m>`, or the reason why there is no value."""
    if metric.value is None:
        return f"<{_class_name(metric)}: no value, {shorten(metric.reason or 'no reason given')}>"
    unit = "" if metric.unit in ("1", "") else f" {metric.unit}"
    return f"<{_class_name(metric)}: {metric.value:.6g}{unit}>"


def represent_curve(curve: Any) -> str:
    """Return `<PlottedCurve: 30 points, y in N over x in m>`."""
    across, up = curve.units
    return f"<{_class_name(curve)}: {len(curve.x)} points, y in {up} over x in {across}>"


def shorten(words: str) -> str:
    """Return text on a single line, shortened if it is long."""
    words = " ".join(words.split())
    return words if len(words) <= SHOWN else f"{words[: SHOWN - 1]}…"


def join_names(names: Sequence[str]) -> str:
    """Return the first names and the number of further names, as text."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _class_name(thing: object) -> str:
    return type(thing).__name__
