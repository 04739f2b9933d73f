"""What the studies of a scene ask for: how a metric settles over a sweep, and which configurations no other beats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from softmark.interpreter.results.json_records import Json, Plain
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, Spread, unit_of
from softmark.interpreter.study.analysis.pareto_front import Candidate, judge, pareto
from softmark.interpreter.study.analysis.refinement_convergence import refinement_of, settled
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine, lines_of
from softmark.interpreter.vocabulary.study_words import Convergence, Pareto
from softmark.records import dataclass
from softmark.references.convergence_orders import Refined

Study = Convergence | Pareto


def studies_from_json(known: Json) -> dict[str, Study]:
    """What a scene's studies ask, by name; sweeps ask nothing."""
    found: dict[str, Study] = {}
    for name, study in known.items():
        if study["kind"] == "convergence":
            found[name] = Convergence(study["metric"], study["over"])
        elif study["kind"] == "pareto":
            found[name] = Pareto(study["error"], study.get("cost"), study.get("over"))
    return found


# ------------------------------------------------------------------ convergence


@dataclass(frozen=True)
class SettledLine(Plain):
    """Where a metric tends to along a line of a sweep, in `unit`; `reason` where nothing can be said.

    Outside of the asymptotic range, `refined` says so and why.
    """

    line: str
    unit: str | None
    members: int | None = None
    finest: float | None = None
    refined: Refined | None = None
    reason: str | None = None

    @property
    def limit(self) -> Refined:
        """What is known of it, be it why nothing is."""
        return self.refined or Refined("unusable", self.reason)

    def entries(self) -> Mapping[str, object]:
        """Everything that is known, None left out, but for the unit."""
        own = {"line": self.line, "unit": self.unit}
        if self.refined is not None:
            return {**own, "members": self.members, "finest": self.finest, **self.refined.to_json()}
        counted = {} if self.members is None else {"members": self.members}
        return {**own, **counted, "asymptotic": False, "reason": self.reason}


@dataclass(frozen=True)
class Settling(Plain):
    """The answer to a `convergence`: how its metric settles along each line of the sweep."""

    study: str
    kind: str  # convergence
    metric: str
    over: str
    lines: list[SettledLine]


def settling(name: str, asked: Convergence, points: Sequence[ComparedPoint]) -> Settling:
    """Order, limit and index of the metric along each line of the sweep, over all points of a scene."""
    unit = unit_of(points, asked.metric)
    lines = [_settled(line, asked.metric, unit) for line in lines_of([p for p in points if p.study == asked.over])]
    return Settling(name, "convergence", asked.metric, asked.over, lines)


def _settled(line: RefinementLine, metric: str, unit: str | None) -> SettledLine:
    found = refinement_of(line)
    if isinstance(found, str):
        return SettledLine(line.name, unit, reason=found)
    family = [(h, float(v)) for h, p in found.members if (v := p.metric(metric).value) is not None]
    if not family:
        return SettledLine(line.name, unit, 0, reason=f"{metric} was not measured on this line")
    lengths = unit_of(line.members, metric) == "m"  # theory speaks of displacements
    refined = settled(found, family, found.formal if lengths else None)
    return SettledLine(line.name, unit, len(family), family[-1][1], refined)


# ------------------------------------------------------------------ pareto


@dataclass(frozen=True)
class FrontMember(Plain):
    """A configuration that no other beats."""

    key: str
    label: str
    cost: Spread
    error: float
    capped: bool


@dataclass(frozen=True)
class Front(Plain):
    """The answer to a `pareto`: who is on the front, by the cost that is asked for."""

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


def front(
    name: str, asked: Pareto, points: Sequence[ComparedPoint], clock: str, allow_contaminated: bool = False
) -> Front:
    """Who is on the front by the cost that is asked for: a metric, or the time of a step or of the whole solution."""
    own = [p for p in points if asked.over in (None, p.study)]
    judged = judge(own, asked.error, UNKNOWNS if asked.cost else clock, allow_contaminated)
    if asked.cost is not None:
        what, unit = asked.cost, unit_of(own, asked.cost)
        candidates = _by_metric(judged.candidates, asked.cost, own)
    elif clock == UNKNOWNS:
        what, unit, candidates = "unknowns", "1", list(judged.candidates.values())
    else:
        what, unit = "time", "s"
        candidates = [replace(c, effort=c.frame or c.effort) for c in judged.candidates.values()]
    best = [FrontMember(c.key, c.label, c.effort, c.measured, c.capped) for c in pareto(candidates)]
    error_unit = unit_of(own, asked.error)
    return Front(
        name, "pareto", asked.error, asked.cost, asked.over, unit, what, error_unit, best, len(candidates)
    )  # fmt: skip


def _by_metric(candidates: Mapping[str, Candidate], metric: str, points: Sequence[ComparedPoint]) -> list[Candidate]:
    """Those that have a metric, with it as their effort."""
    values = {p.key: p.metric(metric).value for p in points}
    return [replace(c, effort=Spread.exact(float(v))) for c in candidates.values() if (v := values[c.key]) is not None]


Answer = Settling | Front
