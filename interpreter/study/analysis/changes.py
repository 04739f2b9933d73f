"""`changes`: what differs between two results of the same kind, and what of it is more than noise.

Both may be reports of `dsl run` (softmark-report/1) or comparisons of `dsl compare` (softmark-compare/1). Things are
matched by name: models and references of a report by theirs, configurations of a comparison by scene, model, study
and what was varied, never by their keys, which change with every source file.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from softmark.interpreter.results import forms
from softmark.interpreter.study.analysis.point import Spread, ratio_of, spread_of

REPORT, COMPARISON = "softmark-report/1", "softmark-compare/1"
RELATIVE = 1e-6  # a metric that changes by less is the same: rounding, and threads that add in another order
SLOWER = 0.05  # a time that changes by less is the same
TIMES = ("setup_s", "solve_s", "step_s", "cpu_s", "wall_s")
UNNAMED = ("started", "created")  # of an environment: these always differ and explain nothing

Json = Mapping[str, Any]


class Foreign(ValueError):
    """Files that cannot be compared; the message says which and why."""


def read(path: str | Path) -> dict[str, Any]:
    """A report or a comparison from a file. Raises Foreign."""
    if os.path.exists(path) and not os.path.isfile(path):  # a device may have no end, a pipe no writer
        raise Foreign(f"`{path}` is not a regular file")
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise Foreign(f"`{path}` cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise Foreign(f"`{path}` is not JSON: {error}") from error
    kind_of(found, str(path))
    return dict(found)


def kind_of(found: Any, name: str) -> str:
    """The schema of a file. Raises Foreign if it is none of ours."""
    schema = found.get("schema") if isinstance(found, dict) else None
    if not isinstance(schema, str) or schema not in (REPORT, COMPARISON):
        named = f"`{schema[:80]}`" if isinstance(schema, str) else forms.said(schema)
        said = f"its schema is {named}" if schema else "it has no `schema`"
        raise Foreign(f"`{name}` is neither a {REPORT} nor a {COMPARISON}: {said}")
    if problem := forms.misfit(found, forms.REPORT if schema == REPORT else forms.COMPARISON):
        raise Foreign(f"`{name}` says that it is a {schema}, but {problem}")
    return str(schema)


def changes(old: Json, new: Json, names: tuple[str, str] = ("the old file", "the new file")) -> dict[str, Any]:
    """All changes from one result to another of the same kind, as JSON. Raises Foreign."""
    kinds = kind_of(old, names[0]), kind_of(new, names[1])
    if kinds[0] != kinds[1]:
        raise Foreign(f"`{names[0]}` is a {kinds[0]} and `{names[1]}` a {kinds[1]}: give two files of one kind")
    before, after = _subjects(old), _subjects(new)
    shared = [name for name in before if name in after]
    return {
        "schema": "softmark-changes/1",
        "kind": kinds[0],
        "files": list(names),
        "environment": _facts(old.get("environment") or {}, new.get("environment") or {}),
        "scenes": _facts(_texts(old), _texts(new)),
        "added": [name for name in after if name not in before],
        "removed": [name for name in before if name not in after],
        "status": [c for n in shared if (c := _status(n, before[n], after[n]))],
        "metrics": [c for n in shared for c in _metrics(n, before[n], after[n])],
        "times": [c for n in shared for c in _times(n, before[n], after[n])],
        "expectations": _facts(_expectations(old), _expectations(new)),
        "compared": len(shared),
    }


# ------------------------------------------------------------------ what is matched


def _subjects(result: Json) -> dict[str, dict[str, Any]]:
    """Models, configurations and references by what they are called."""
    report = result["schema"] == REPORT
    found = _of_report(result) if report else _of_comparison(result)
    named: dict[str, dict[str, Any]] = {}
    for name, own in found:
        alike = sum(n == name or n.startswith(f"{name} #") for n in named)
        named[f"{name} #{alike + 1}" if alike else name] = own
    return named


def _of_report(result: Json) -> Iterable[tuple[str, dict[str, Any]]]:
    for name, model in result["models"].items():
        yield name, {**model, "errors": model.get("metrics") or {}, "times": model.get("time") or {}}
    for name, reference in result["references"].items():
        yield f"reference {name}", {**reference, "errors": reference.get("metrics") or {}}


def _of_comparison(result: Json) -> Iterable[tuple[str, dict[str, Any]]]:
    scenes = {str(p.get("scene")) for p in result["points"]} or set(result["references"])
    for point in result["points"]:
        name = ", ".join([str(point["model"]), *(f"{k} = {v}" for k, v in (point.get("variation") or {}).items())])
        name += f" ({point['study']})" if point.get("study") else ""
        name = f"{point['scene']}: {name}" if len(scenes) > 1 else name
        yield name, {**point, "times": point.get("cost") or {}}
    for scene, references in result["references"].items():
        for name, reference in references.items():
            said = f"{scene}: reference {name}" if len(result["references"]) > 1 else f"reference {name}"
            yield said, {**reference, "errors": {}}


def _texts(result: Json) -> dict[str, Any]:
    """What scenes are: digests of their texts, and the parameters of a report."""
    if result["schema"] == COMPARISON:
        return {f"text of {s.get('file') or s.get('title')}": s.get("sha256") for s in result.get("scenes") or ()}
    scene = result.get("scene") or {}
    given = scene.get("parameters") or {}
    parameters = {f"parameter {n}": p.get("text", p.get("value")) for n, p in given.items()}
    return {"text": scene.get("sha256"), **parameters}


def _expectations(result: Json) -> dict[str, Any]:
    words = {True: "met", False: "not met", None: "not judged"}
    return {e["text"]: words.get(e.get("passed")) for e in result.get("expectations") or ()}


def _facts(old: Json, new: Json) -> list[dict[str, Any]]:
    """Facts by name that are not the same; None where one of the two does not have it."""
    names = [n for n in dict.fromkeys([*old, *new]) if n not in UNNAMED]
    return [{"what": n, "old": old.get(n), "new": new.get(n)} for n in names if old.get(n) != new.get(n)]


# ------------------------------------------------------------------ what is compared


def _status(name: str, old: Json, new: Json) -> dict[str, Any] | None:
    if old.get("status") == new.get("status"):
        return None
    return {"name": name, "old": old.get("status"), "new": new.get("status"), "message": new.get("message")}


def _metrics(name: str, old: Json, new: Json) -> Iterable[dict[str, Any]]:
    before, after = old.get("errors") or {}, new.get("errors") or {}
    for metric in dict.fromkeys([*before, *after]):
        if metric in before and metric in after:
            if change := _metric(before[metric], after[metric]):
                yield {"name": name, "metric": metric, **change}
        else:
            own = after[metric] if metric in after else before[metric]
            verdict = "added" if metric in after else "removed"
            known = {
                "name": name,
                "metric": metric,
                "unit": own.get("unit"),
                "relative": None,
                "verdict": verdict,
            }
            yield known | _ends(before.get(metric), after.get(metric))


def _ends(old: Json | None, new: Json | None) -> dict[str, Any]:
    return {"old": old.get("value") if old else None, "new": new.get("value") if new else None}


def _metric(old: Json, new: Json) -> dict[str, Any] | None:
    """`verdict`: changed, changed below the uncertainty, lost its value, or got one; None if nothing did."""
    a, b = old.get("value"), new.get("value")
    unit = new.get("unit") or old.get("unit")
    if a is None and b is None:
        return None
    if a is None or b is None:
        own = {
            "unit": unit,
            "old": a,
            "new": b,
            "relative": None,
            "verdict": "lost" if b is None else "found",
        }
        return {**own, "reason": (new if b is None else old).get("reason")}
    if abs(b - a) <= RELATIVE * max(abs(a), abs(b)):
        return None
    uncertain = max((float(u) for m in (old, new) if (u := m.get("uncertainty")) is not None), default=None)
    below = uncertain is not None and abs(b - a) <= uncertain
    return {
        "unit": unit, "old": a, "new": b, "relative": ratio_of(b - a, abs(a)), "uncertainty": uncertain,
        "verdict": "changed, below the uncertainty" if below else "changed",
    }  # fmt: skip


def _times(name: str, old: Json, new: Json) -> Iterable[dict[str, Any]]:
    before, after = old.get("times") or {}, new.get("times") or {}
    disturbed = before.get("contaminated") or after.get("contaminated")
    for clock in TIMES:
        a, b = (_clock(known.get(clock)) for known in (before, after))
        if a is None or b is None or min(a[0].median, b[0].median) <= 0:
            continue
        if verdict := _verdict(a, b, bool(disturbed)):
            yield {
                "name": name, "clock": clock, "old": a[0].to_json(), "new": b[0].to_json(),
                "ratio": b[0].median / a[0].median, **verdict,
            }  # fmt: skip


def _clock(known: Any) -> tuple[Spread, int] | None:
    """A spread, and of how many runs."""
    spread = spread_of(known) if isinstance(known, Mapping) else None
    return None if spread is None else (spread, int(known.get("runs") or 1))


def _verdict(a: tuple[Spread, int], b: tuple[Spread, int], disturbed: bool) -> dict[str, Any] | None:
    """Slower or quicker beyond noise; undecided, with a reason, where the noise is not known; None within it."""
    if abs(b[0].median / a[0].median - 1) <= SLOWER or not a[0].apart(b[0]):
        return None
    if disturbed:
        return {"verdict": "undecided", "reason": "a timing was disturbed"}
    if min(a[1], b[1]) < 2:
        return {"verdict": "undecided", "reason": "timed once, so the noise is not known"}
    return {"verdict": "slower" if b[0].median > a[0].median else "quicker"}
