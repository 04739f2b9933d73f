"""Changes between two results of the same kind, and whether they exceed the noise.

Both are reports of `dsl run` (softmark-report/1) or comparisons of `dsl compare` (softmark-compare/1). Models and
references of a report are matched by name. Configurations of a comparison are matched by scene, model, study and
varied values, but not by their keys, because keys change with every source file.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from softmark.interpreter.results import json_validation
from softmark.interpreter.results.json_records import Json, JsonRecord, mapping_reader
from softmark.interpreter.study.analysis.comparison_point import Spread, ratio_of
from softmark.interpreter.study.configurations.task_outcome import PointError
from softmark.records import dataclass
from softmark.safe_files import read_regular

REPORT, COMPARISON = "softmark-report/1", "softmark-compare/1"
RELATIVE = 1e-6  # relative change of a metric due to rounding and the order of sums in threads
SLOWER = 0.05  # relative to the shorter time: smaller changes are noise
TIMES = ("setup_s", "solve_s", "step_s", "cpu_s", "wall_s")
UNNAMED = ("started", "created")  # entries of an environment that always differ


class NotComparable(ValueError):
    """Error: result files cannot be compared. The message names the file and the reason."""


def read_result(path: str | Path) -> Json:
    """Read a report or a comparison from a file. Raises NotComparable."""
    if os.path.exists(path) and not os.path.isfile(path):  # a device may have no end, a pipe no writer
        raise NotComparable(f"`{path}` is not a regular file")
    try:
        found = json.loads(read_regular(path).decode("utf-8"))
    except OSError as error:
        raise NotComparable(f"`{path}` cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise NotComparable(f"`{path}` is not JSON: {error}") from error
    kind_of(found, str(path))
    return dict(found)


def kind_of(found: Any, name: str) -> str:
    """Return the schema of a result: REPORT or COMPARISON. Raises NotComparable for any other JSON.

    `name` is the file name used in messages.
    """
    schema = found.get("schema") if isinstance(found, dict) else None
    if not isinstance(schema, str) or schema not in (REPORT, COMPARISON):
        named = f"`{schema[:80]}`" if isinstance(schema, str) else json_validation.describe_type(schema)
        said = f"its schema is {named}" if schema else "it has no `schema`"
        raise NotComparable(f"`{name}` is neither a {REPORT} nor a {COMPARISON}: {said}")
    if problem := json_validation.find_misfit(
        found, json_validation.REPORT if schema == REPORT else json_validation.COMPARISON
    ):
        raise NotComparable(f"`{name}` declares the schema {schema}, but {problem}")
    return str(schema)


# ------------------------------------------------------------------ changes


@dataclass(frozen=True)
class FactChange(JsonRecord):
    """Change of a fact other than a number, such as a version; a result without this fact has None."""

    what: str
    old: Any
    new: Any


@dataclass(frozen=True)
class StatusChange(JsonRecord):
    """Change of the status of a model or reference, with the message of the new status."""

    name: str
    old: str | None
    new: str | None
    message: str | None


@dataclass(frozen=True)
class MetricChange(JsonRecord):
    """Change of the value of a metric, classified by `verdict`.

    Verdicts: `changed`, `changed by less than the uncertainty`, `lost` and `found` (of the value), `added` and
    `removed` (of the metric).
    """

    name: str
    metric: str
    unit: str | None
    old: float | None
    new: float | None
    verdict: str
    relative: float | None = None
    uncertainty: float | None = None
    reason: str | None = None

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries that belong to the verdict."""
        named = {"name": self.name, "metric": self.metric, "unit": self.unit}
        ends, verdict = {"old": self.old, "new": self.new}, {"relative": self.relative, "verdict": self.verdict}
        if self.verdict in ("added", "removed"):
            return {**named, **verdict, **ends}
        if self.verdict in ("lost", "found"):
            return {**named, **ends, **verdict, "reason": self.reason}
        return {**named, **ends, "relative": self.relative, "uncertainty": self.uncertainty, "verdict": self.verdict}


@dataclass(frozen=True)
class TimeChange(JsonRecord):
    """Change of a computing time that exceeds the noise, classified by `verdict`.

    Verdicts: `slower`, `quicker`, and `undecided` if the noise is not known.
    """

    name: str
    clock: str
    old: Spread
    new: Spread
    verdict: str
    reason: str | None = None

    @property
    def ratio(self) -> float:
        """Ratio of the new to the old time."""
        return self.new.median / self.old.median

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries; the reason is included if there is one."""
        own = {"name": self.name, "clock": self.clock, "old": self.old, "new": self.new, "ratio": self.ratio}
        return {**own, "verdict": self.verdict} | ({"reason": self.reason} if self.reason else {})


@dataclass(frozen=True)
class Changes(JsonRecord):
    """All changes between two results of the same kind."""

    schema: str
    kind: str  # REPORT or COMPARISON
    files: tuple[str, str]
    environment: list[FactChange]
    scenes: list[FactChange]
    added: list[str]
    removed: list[str]
    status: list[StatusChange]
    metrics: list[MetricChange]
    times: list[TimeChange]
    expectations: list[FactChange]
    compared: int  # entries that both have


def find_changes(old: Json, new: Json, names: tuple[str, str] = ("the old file", "the new file")) -> Changes:
    """Return all changes from the result `old` to the result `new`, both as JSON. Raises NotComparable.

    `names` are the names of the files in messages.
    """
    kinds = kind_of(old, names[0]), kind_of(new, names[1])
    if kinds[0] != kinds[1]:
        raise NotComparable(
            f"`{names[0]}` is a {kinds[0]} and `{names[1]}` a {kinds[1]}: give two files of the same kind"
        )
    before, after = _subjects(old), _subjects(new)
    shared = [(name, before[name], after[name]) for name in before if name in after]
    return Changes(
        schema="softmark-changes/1",
        kind=kinds[0],
        files=names,
        environment=_fact_changes(old.get("environment") or {}, new.get("environment") or {}),
        scenes=_fact_changes(_scene_facts(old), _scene_facts(new)),
        added=[name for name in after if name not in before],
        removed=[name for name in before if name not in after],
        status=[StatusChange(n, a.status, b.status, b.message) for n, a, b in shared if a.status != b.status],
        metrics=[c for pair in shared for c in _metric_changes(*pair)],
        times=[c for pair in shared for c in _time_changes(*pair)],
        expectations=_fact_changes(_expectation_verdicts(old), _expectation_verdicts(new)),
        compared=len(shared),
    )


# ------------------------------------------------------------------ compared subjects


@dataclass(frozen=True)
class ComparedSubject:
    """Model, configuration or reference of a result, with the data that are compared."""

    status: str | None
    message: str | None
    errors: Mapping[str, PointError]
    times: Mapping[str, Spread]  # by clock
    disturbed: bool

    @classmethod
    def from_json(cls, found: Json, errors: Json | None, times: Json | None = None) -> ComparedSubject:
        """Read a model, configuration or reference with its metrics `errors` and computing times `times`."""
        known = times or {}
        spreads = {n: s for n in TIMES if isinstance(t := known.get(n), Mapping) and (s := Spread.read(t))}
        measured = mapping_reader(PointError.from_json)(errors or {})
        return cls(found.get("status"), found.get("message"), measured, spreads, bool(known.get("contaminated")))


def _subjects(result: Json) -> dict[str, ComparedSubject]:
    """Return the models, configurations and references of a result by unique names."""
    named: dict[str, ComparedSubject] = {}
    for name, own in _subjects_of_report(result) if result["schema"] == REPORT else _subjects_of_comparison(result):
        alike = sum(n == name or n.startswith(f"{name} #") for n in named)
        named[f"{name} #{alike + 1}" if alike else name] = own
    return named


def _subjects_of_report(result: Json) -> Iterator[tuple[str, ComparedSubject]]:
    for name, model in result["models"].items():
        yield name, ComparedSubject.from_json(model, model.get("metrics"), model.get("time"))
    for name, reference in result["references"].items():
        yield f"reference {name}", ComparedSubject.from_json(reference, reference.get("metrics"))


def _subjects_of_comparison(result: Json) -> Iterator[tuple[str, ComparedSubject]]:
    scenes = {str(p.get("scene")) for p in result["points"]} or set(result["references"])
    for point in result["points"]:
        name = ", ".join([str(point["model"]), *(f"{k} = {v}" for k, v in (point.get("variation") or {}).items())])
        name += f" ({point['study']})" if point.get("study") else ""
        name = f"{point['scene']}: {name}" if len(scenes) > 1 else name
        yield name, ComparedSubject.from_json(point, point.get("errors"), point.get("cost"))
    for scene, references in result["references"].items():
        for name, reference in references.items():
            said = f"{scene}: reference {name}" if len(result["references"]) > 1 else f"reference {name}"
            yield said, ComparedSubject.from_json(reference, None)


def _scene_facts(result: Json) -> Json:
    """Return the digests of scene texts and, for a report, the values of parameters."""
    if result["schema"] == COMPARISON:
        return {f"text of {s.get('file') or s.get('title')}": s.get("sha256") for s in result.get("scenes") or ()}
    scene = result.get("scene") or {}
    given = scene.get("parameters") or {}
    parameters = {f"parameter {n}": p.get("text", p.get("value")) for n, p in given.items()}
    return {"text": scene.get("sha256"), **parameters}


def _expectation_verdicts(result: Json) -> Json:
    words = {True: "met", False: "not met", None: "not judged"}
    return {e["text"]: words.get(e.get("passed")) for e in result.get("expectations") or ()}


def _fact_changes(old: Json, new: Json) -> list[FactChange]:
    """Return the facts that differ between two mappings from names to facts."""
    names = [n for n in dict.fromkeys([*old, *new]) if n not in UNNAMED]
    return [FactChange(n, old.get(n), new.get(n)) for n in names if old.get(n) != new.get(n)]


# ------------------------------------------------------------------ comparison


def _metric_changes(name: str, old: ComparedSubject, new: ComparedSubject) -> Iterable[MetricChange]:
    for metric in dict.fromkeys([*old.errors, *new.errors]):
        a, b = old.errors.get(metric), new.errors.get(metric)
        if a is not None and b is not None:
            if change := _metric_change(name, metric, a, b):
                yield change
        elif b is not None:
            yield MetricChange(name, metric, b.unit, None, b.value, "added")
        elif a is not None:
            yield MetricChange(name, metric, a.unit, a.value, None, "removed")


def _metric_change(name: str, metric: str, old: PointError, new: PointError) -> MetricChange | None:
    """Return the change of a metric, or None if its value is the same up to rounding."""
    a, b, unit = old.value, new.value, new.unit or old.unit
    if a is None and b is None:
        return None
    if a is None or b is None:
        verdict, reason = ("lost", new.reason) if b is None else ("found", old.reason)
        return MetricChange(name, metric, unit, a, b, verdict, reason=reason)
    if abs(b - a) <= RELATIVE * max(abs(a), abs(b)):
        return None
    uncertain = max((float(u) for m in (old, new) if (u := m.uncertainty) is not None), default=None)
    verdict = "changed by less than the uncertainty" if uncertain is not None and abs(b - a) <= uncertain else "changed"
    return MetricChange(name, metric, unit, a, b, verdict, ratio_of(b - a, abs(a)), uncertain)


def _time_changes(name: str, old: ComparedSubject, new: ComparedSubject) -> Iterable[TimeChange]:
    for clock in (n for n in old.times if n in new.times):
        a, b = old.times[clock], new.times[clock]
        if min(a.median, b.median) > 0 and (verdict := _time_verdict_with_reason(a, b, old.disturbed or new.disturbed)):
            yield TimeChange(name, clock, a, b, *verdict)


def _time_verdict_with_reason(a: Spread, b: Spread, disturbed: bool) -> tuple[str, str | None] | None:
    """Return the verdict on a change of time and its reason, or None if the change is within the noise."""
    low, high = sorted((a.median, b.median))
    if high / low - 1 <= SLOWER or not a.is_distinct_from(b):
        return None
    if disturbed:
        return "undecided", "a timing was disturbed"
    if min(int(s.runs or 1) for s in (a, b)) < 2:
        return "undecided", "timed once, so the noise is not known"
    return "slower" if b.median > a.median else "quicker", None
