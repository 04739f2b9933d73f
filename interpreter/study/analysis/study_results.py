"""Answers to the `convergence` and `pareto` studies that a scene declares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from softmark.interpreter.results.json_records import Json, JsonRecord
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, Spread, unit_of
from softmark.interpreter.study.analysis.pareto_front import Candidate, find_pareto_front, judge_points
from softmark.interpreter.study.analysis.refinement_convergence import estimate_limit, refinement_of
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine, lines_of
from softmark.interpreter.vocabulary.study_words import Convergence, Pareto
from softmark.records import dataclass
from softmark.references.convergence_orders import ConvergenceEstimate

Study = Convergence | Pareto


def studies_from_json(known: Json) -> dict[str, Study]:
    """Return the convergence and Pareto studies of a scene by name; sweeps are left out."""
    found: dict[str, Study] = {}
    for name, study in known.items():
        if study["kind"] == "convergence":
            found[name] = Convergence(study["metric"], study["over"])
        elif study["kind"] == "pareto":
            found[name] = Pareto(study["error"], study.get("cost"), study.get("over"))
    return found


# ------------------------------------------------------------------ convergence


@dataclass(frozen=True)
class LineConvergence(JsonRecord):
    """Limit of a metric along one refinement line of a sweep, in `unit`.

    `reason` says why there is no limit. If the line is outside the asymptotic range, `refined` contains the reason.
    """

    line: str
    unit: str | None
    members: int | None = None
    finest: float | None = None
    refined: ConvergenceEstimate | None = None
    reason: str | None = None

    @property
    def limit(self) -> ConvergenceEstimate:
        """Estimated limit, or an unusable estimate with the reason."""
        return self.refined or ConvergenceEstimate("unusable", self.reason)

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries of the line, with the estimated limit if there is one."""
        own = {"line": self.line, "unit": self.unit}
        if self.refined is not None:
            return {**own, "members": self.members, "finest": self.finest, **self.refined.to_json()}
        counted = {} if self.members is None else {"members": self.members}
        return {**own, **counted, "asymptotic": False, "reason": self.reason}


@dataclass(frozen=True)
class ConvergenceAnswer(JsonRecord):
    """Answer to a `convergence` study: the limit of its metric along each line of the sweep."""

    study: str
    kind: str  # convergence
    metric: str
    over: str
    lines: list[LineConvergence]


def answer_convergence(name: str, asked: Convergence, points: Sequence[ComparedPoint]) -> ConvergenceAnswer:
    """Return order, limit and grid convergence index of a metric along each refinement line of the sweep."""
    unit = unit_of(points, asked.metric)
    lines = [
        _line_convergence(line, asked.metric, unit) for line in lines_of([p for p in points if p.study == asked.over])
    ]
    return ConvergenceAnswer(name, "convergence", asked.metric, asked.over, lines)


def _line_convergence(line: RefinementLine, metric: str, unit: str | None) -> LineConvergence:
    found = refinement_of(line)
    if isinstance(found, str):
        return LineConvergence(line.name, unit, reason=found)
    family = [(h, float(v)) for h, p in found.members if (v := p.metric(metric).value) is not None]
    if not family:
        return LineConvergence(line.name, unit, 0, reason=f"{metric} was not measured for this line")
    lengths = unit_of(line.members, metric) == "m"  # theoretical orders are those of displacements
    refined = estimate_limit(found, family, found.formal if lengths else None)
    return LineConvergence(line.name, unit, len(family), family[-1][1], refined)


# ------------------------------------------------------------------ pareto


@dataclass(frozen=True)
class FrontMember(JsonRecord):
    """Configuration on a Pareto front of error and effort."""

    key: str
    label: str
    cost: Spread
    error: float
    capped: bool


@dataclass(frozen=True)
class ParetoAnswer(JsonRecord):
    """Answer to a `pareto` study: the Pareto front of error and requested cost."""

    study: str
    kind: str  # pareto
    error: str
    cost: str | None
    over: str | None
    cost_unit: str | None
    cost_name: str
    error_unit: str | None
    front: list[FrontMember]
    counted: int  # configurations


def answer_pareto(
    name: str, asked: Pareto, points: Sequence[ComparedPoint], clock: str, allow_contaminated: bool = False
) -> ParetoAnswer:
    """Return the answer to a `pareto` study.

    The cost is the requested metric, by default the time of a step or, without steps, of the whole solution.
    """
    own = [p for p in points if asked.over in (None, p.study)]
    judged = judge_points(own, asked.error, UNKNOWNS if asked.cost else clock, allow_contaminated)
    if asked.cost is not None:
        what, unit = asked.cost, unit_of(own, asked.cost)
        candidates = _with_metric_as_effort(judged.candidates, asked.cost, own)
    elif clock == UNKNOWNS:
        what, unit, candidates = "unknowns", "1", list(judged.candidates.values())
    else:
        what, unit = "time", "s"
        candidates = [replace(c, effort=c.frame or c.effort) for c in judged.candidates.values()]
    best = [FrontMember(c.key, c.label, c.effort, c.measured, c.capped) for c in find_pareto_front(candidates)]
    error_unit = unit_of(own, asked.error)
    return ParetoAnswer(
        name, "pareto", asked.error, asked.cost, asked.over, unit, what, error_unit, best, len(candidates)
    )  # fmt: skip


def _with_metric_as_effort(
    candidates: Mapping[str, Candidate], metric: str, points: Sequence[ComparedPoint]
) -> list[Candidate]:
    """Return the candidates that have a value of the metric, with this value as their effort."""
    values = {p.key: p.metric(metric).value for p in points}
    return [replace(c, effort=Spread.exact(float(v))) for c in candidates.values() if (v := values[c.key]) is not None]


Answer = ConvergenceAnswer | ParetoAnswer
