"""`analyse`: everything that a comparison says about its points; plain dictionaries, SI, None with a reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from softmark.interpreter.study.analysis.advice import Question, advise, disagreements, remarks_of
from softmark.interpreter.study.analysis.answers import answers
from softmark.interpreter.study.analysis.front import (
    RATES,
    Judged,
    Reached,
    best_within,
    effort_to,
    judge,
    levels_of,
    pareto,
    within_json,
)
from softmark.interpreter.study.analysis.lineage import orders_of
from softmark.interpreter.study.analysis.pairs import distances, levers
from softmark.interpreter.study.analysis.point import (
    SOLVED,
    UNKNOWNS,
    Line,
    Point,
    clock_of,
    contaminated,
    error_metrics,
    label_of,
    line_labels,
    lines_of,
    measured,
    part_of,
    stated,
)

References = Mapping[str, Mapping[str, Mapping[str, Any]]]


def analyse(
    points: Sequence[Point],
    references: References,
    options: Mapping[str, Any] | None = None,
    studies: Mapping[str, Mapping[str, Mapping[str, Any]]] | None = None,
) -> dict[str, Any]:
    """The analysis of `softmark-compare/1`, by scenes; where a sweep changes what errors are measured from, by its
    values as well: such configurations do not compete.

    `options`: `clock` ("cpu_s", "wall_s"; by default CPU time, and the number of unknowns where nothing was timed);
    `allow_contaminated`; `rates` in Hz.
    """
    given = dict(options or {})
    scenes = dict.fromkeys([*map(part_of, points), *references])
    own: dict[str, list[Point]] = {s: [] for s in scenes}
    for p in points:
        own[part_of(p)].append(p)
    found = {s: _scene(s, own[s], references.get(s) or {}, given) for s in scenes}
    for scene, asked in (studies or {}).items():
        _answer(found, {s: [p for p in own[s] if str(p["scene"]) == scene] for s in scenes}, asked, given)
    return {
        "options": {
            "allow_contaminated": bool(given.get("allow_contaminated")),
            "rates": list(given.get("rates") or RATES),
        },
        "advice": [a for scene in found.values() for a in scene.pop("advice")],
        "scenes": found,
    }


def _scene(
    scene: str, points: Sequence[Point], references: Mapping[str, Any], options: Mapping[str, Any]
) -> dict[str, Any]:
    clock = clock_of(points, options.get("clock"))
    metrics, lines = error_metrics(points), lines_of(points)
    judged = {m: judge(points, m, clock, bool(options.get("allow_contaminated"))) for m in metrics}
    labels = line_labels(lines)
    orders = [orders_of(line, label, metrics, points) for line, label in zip(lines, labels, strict=True)]
    doubts = {key: o["doubt"] for line, o in zip(lines, orders, strict=True) if o["doubt"] for key in line.keys}
    scale = displacement_scale(points, references)
    questions = [_question(scene, m, judged[m], points, scale, doubts) for m in metrics]
    rates = [float(hz) for hz in options.get("rates") or RATES]
    return {
        "scene": str(points[0]["scene"]) if points else scene,
        "problem": dict(points[0].get("problem") or {}) if points else {},
        "answers": [],
        "clock": clock,
        "displacement_scale": scale,
        "lines": [_line(line, label) for line, label in zip(lines, labels, strict=True)],
        "metrics": {q.metric: _metric(q, lines, labels, rates) for q in questions},
        "failures": failures(points, references),
        "distances": distances(points, references),
        "levers": levers(points, metrics, clock),
        "orders": [o for o in orders if o["varied"] is not None],
        "timing": timing(points),
        "disagreements": disagreements(judged),
        "advice": [advise(q) for q in questions],
    }


def _answer(
    found: Mapping[str, dict[str, Any]],
    parts: Mapping[str, Sequence[Point]],
    asked: Mapping[str, Mapping[str, Any]],
    options: Mapping[str, Any],
) -> None:
    """Answers to what one scene asks: who beats whom for each part, how a metric settles once, over all of them."""
    filled = [s for s, own in parts.items() if own]
    everything = [p for s in filled for p in parts[s]]
    allowed = bool(options.get("allow_contaminated"))
    for part in filled:
        clock, entries = found[part]["clock"], []
        for name, study in asked.items():
            whole = study["kind"] != "pareto"
            if not whole or part == filled[0]:
                entries += answers(everything if whole else parts[part], {name: study}, clock, allowed)
        found[part]["answers"] = entries


def _question(
    scene: str,
    metric: str,
    judged: Judged,
    points: Sequence[Point],
    scale: float | None,
    doubts: Mapping[str, str],
) -> Question:
    unit = str(stated(points, metric, "unit") or "1")
    errors = [e for p in points if (e := measured(p, metric)) is not None]
    against = str(stated(points, metric, "against") or "")
    remarks = {str(p["key"]): remarks_of(p) for p in points}
    return Question(scene, metric, unit, against, levels_of(unit, scale, errors), judged, doubts, remarks)


def displacement_scale(points: Sequence[Point], references: Mapping[str, Any]) -> float | None:
    """The largest displacement of a reference's probes, m; of the points' where references have none."""
    for owners in (list(references.values()), [p for p in points if p.get("status") in SOLVED]):
        moved = [u for o in owners for probe in (o.get("probes") or {}).values() for u in probe["displacement"]]
        largest = max((sum(c * c for c in u) ** 0.5 for u in moved), default=0.0)
        if largest > 0:
            return float(largest)
    return None


def _line(line: Line, label: str) -> dict[str, Any]:
    return {
        "label": label, "model": line.model, "study": line.study, "varied": line.varied,
        "fixed": dict(line.fixed), "keys": line.keys,
    }  # fmt: skip


def _metric(question: Question, lines: Sequence[Line], labels: Sequence[str], rates: Sequence[float]) -> dict[str, Any]:
    judged = question.judged
    named = list(zip(lines, labels, strict=True))
    levels = [_level(level, named, judged) for level in question.levels]
    return {
        "unit": question.unit,
        "against": question.against,
        "uncertainty": judged.uncertainty or None,
        "effort": UNKNOWNS if judged.clock == UNKNOWNS else "s",
        "front": [c.key for c in pareto(judged.candidates.values())],
        "left_out": [{"key": k, "label": label, "reason": why} for k, (label, why) in judged.left_out.items()],
        "levels": levels,
        "rates": [within_json(best_within(hz, judged)) for hz in rates],
    }


def _level(level: float, lines: Sequence[tuple[Line, str]], judged: Judged) -> dict[str, Any]:
    reached = [_reached(level, line, label, judged) for line, label in lines]
    return {"level": level, "lines": reached, "best": _best(reached)}


def _reached(level: float, line: Line, label: str, judged: Judged) -> dict[str, Any]:
    found = effort_to(level, line, judged)
    if not isinstance(found, Reached):
        errors = [judged.candidates[key].measured for key in line.keys if key in judged.candidates]
        own = {"line": label, "effort": None, "interpolated": False, "reason": found}
        return {**own, "least_error": min(errors, default=None)}
    return {
        "line": label, "effort": found.effort.to_json(), "interpolated": found.interpolated,
        "keys": list(found.between),
    }  # fmt: skip


def _best(lines: Sequence[Mapping[str, Any]]) -> str | None:
    """The line that needs least."""
    reached = [entry for entry in lines if entry["effort"] is not None]
    return str(min(reached, key=lambda e: float(e["effort"]["median"]))["line"]) if reached else None


def failures(points: Sequence[Point], references: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Configurations without a solution and references without one, with what happened."""
    found = [
        {"kind": "model", "label": label_of(p), "key": str(p["key"]), "status": str(p["status"]),
         "message": p.get("message")}
        for p in points if p["status"] not in SOLVED
    ]  # fmt: skip
    return found + [
        {"kind": "reference", "label": name, "key": None, "status": str(r["status"]),
         "message": r.get("message")}
        for name, r in references.items() if r.get("status", "converged") != "converged"
    ]  # fmt: skip


def timing(points: Sequence[Point]) -> dict[str, Any]:
    """How good the timings are: what was disturbed, how many runs were left out, and what was flagged, how often."""
    costs = [p["cost"] for p in points if p.get("cost")]
    flags: dict[str, int] = {}
    for cost in costs:
        for flag in cost.get("flags") or ():
            flags[str(flag)] = flags.get(str(flag), 0) + 1
    runs = [int(s["runs"]) for cost in costs if (s := cost.get("cpu_s") or cost.get("wall_s")) and s.get("runs")]
    return {
        "timed": len(costs),
        "of": len(points),
        "contaminated": [label_of(p) for p in points if contaminated(p)],
        "excluded_runs": sum(int(cost.get("excluded_runs") or 0) for cost in costs),
        "least_runs": min(runs, default=None),
        "most_runs": max(runs, default=None),
        "flags": flags,
    }
