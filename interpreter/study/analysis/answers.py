"""What the studies of a scene ask for: how a metric settles over a sweep, and which configurations no other beats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from softmark.interpreter.study.analysis.front import Candidate, judge, pareto
from softmark.interpreter.study.analysis.lineage import refinement_of, settled
from softmark.interpreter.study.analysis.point import (
    UNKNOWNS,
    Line,
    Point,
    Spread,
    frame_of,
    line_labels,
    lines_of,
    stated,
)


def answers(
    points: Sequence[Point],
    studies: Mapping[str, Mapping[str, Any]],
    clock: str,
    allow_contaminated: bool = False,
) -> list[dict[str, Any]]:
    """An answer for each `convergence` and each `pareto` that one scene declares, by its points."""
    found = []
    for name, study in studies.items():
        if study["kind"] == "convergence":
            found.append({"study": name, **study, "lines": _settling(points, study)})
        elif study["kind"] == "pareto":
            found.append({"study": name, **study, **_front(points, study, clock, allow_contaminated)})
    return found


def _value(point: Point, metric: str) -> float | None:
    """What a point has for a metric, error or not."""
    value = ((point.get("errors") or {}).get(metric) or {}).get("value")
    return None if value is None else float(value)


# ------------------------------------------------------------------ convergence


def _settling(points: Sequence[Point], study: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Order, limit and index of the metric along each line of the sweep."""
    lines = lines_of([p for p in points if p.get("study") == study["over"]])
    labels = line_labels(lines)
    metric = study["metric"]
    unit = stated(points, metric, "unit")
    named = zip(lines, labels, strict=True)
    return [{"line": label, "unit": unit, **_settles(line, metric)} for line, label in named]


def _settles(line: Line, metric: str) -> dict[str, Any]:
    """Outside of the asymptotic range, `asymptotic` is False and `doubt` or `reason` says why."""
    found = refinement_of(line)
    if isinstance(found, str):
        return {"asymptotic": False, "reason": found}
    family = [(h, value) for h, p in found.members if (value := _value(p, metric)) is not None]
    if not family:
        return {"members": 0, "asymptotic": False, "reason": f"{metric} was not measured on this line"}
    finest = family[-1][1]
    lengths = stated(line.members, metric, "unit") == "m"  # theory speaks of displacements
    formal = found.formal if lengths else None
    return {"members": len(family), "finest": finest, **settled(found, family, formal).to_json()}


# ------------------------------------------------------------------ pareto


def _front(
    points: Sequence[Point], study: Mapping[str, Any], clock: str, allow_contaminated: bool
) -> dict[str, Any]:  # fmt: skip
    """Who is on the front by the cost that is asked for: a metric, or the time of a step or of the whole solution."""
    own = [p for p in points if study.get("over") in (None, p.get("study"))]
    cost = study.get("cost")
    judged = judge(own, study["error"], UNKNOWNS if cost else clock, allow_contaminated)
    candidates = [c for c in judged.candidates.values() if cost is None]
    if cost is not None:
        by_key = {str(p["key"]): p for p in own}
        candidates = [
            replace(c, effort=Spread(value, value, value))
            for c in judged.candidates.values() if (value := _value(by_key[c.key], cost)) is not None
        ]  # fmt: skip
    elif clock != UNKNOWNS:
        frames = {str(p["key"]): frame_of(p) for p in own}
        candidates = [replace(c, effort=frames[c.key] or c.effort) for c in candidates]
    unit = stated(own, cost, "unit") if cost else "1" if clock == UNKNOWNS else "s"
    return {
        "cost_unit": unit,
        "cost_name": cost or ("unknowns" if clock == UNKNOWNS else "time"),
        "error_unit": stated(own, study["error"], "unit"),
        "front": [_member(c) for c in pareto(candidates)],
        "counted": len(candidates),
    }


def _member(c: Candidate) -> dict[str, Any]:
    return {
        "key": c.key,
        "label": c.label,
        "cost": c.effort.to_json(),
        "error": c.measured,
        "capped": c.capped,
    }
