"""Analysis of a comparison: the function `analyse` and the classes of its results.

Numbers are in SI units. A result that does not exist is None, with a reason.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from softmark.interpreter.results.json_records import Json, JsonRecord
from softmark.interpreter.study.analysis.comparison_advice import (
    Advice,
    AdviceQuestion,
    Disagreement,
    advise,
    find_disagreements,
    training_remarks,
)
from softmark.interpreter.study.analysis.comparison_point import (
    UNKNOWNS,
    ComparedPoint,
    choose_effort_kind,
    error_metrics,
    reference_name_of_metric,
    unit_of,
)
from softmark.interpreter.study.analysis.configuration_pairs import (
    ChangeEffect,
    Distances,
    compute_distances,
    find_change_effects,
)
from softmark.interpreter.study.analysis.pareto_front import (
    RATES,
    BestInFrame,
    EffortEstimate,
    JudgedPoints,
    best_within,
    effort_to_reach,
    error_levels,
    find_pareto_front,
    judge_points,
)
from softmark.interpreter.study.analysis.refinement_convergence import LineOrders, orders_of
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine, lines_of
from softmark.interpreter.study.analysis.study_results import Answer, Study, answer_convergence, answer_pareto
from softmark.interpreter.study.configurations.task_outcome import SolvedReference
from softmark.interpreter.vocabulary.study_words import Pareto
from softmark.records import dataclass

References = Mapping[str, SolvedReference]  # by name


@dataclass(frozen=True)
class ComparisonTerms(JsonRecord):
    """Settings of an analysis: clock of the computing times, frame rates, and whether disturbed timings count."""

    allow_contaminated: bool = False  # disturbed timings count as well
    rates: tuple[float, ...] = RATES  # Hz
    clock: str | None = None  # cpu_s or wall_s; None: CPU time, and the number of unknowns where nothing was timed

    @classmethod
    def from_json(cls, known: Json | None) -> ComparisonTerms:
        """Read settings from JSON; missing settings have their defaults."""
        known = known or {}
        return cls(bool(known.get("allow_contaminated")), tuple(known.get("rates") or RATES), known.get("clock"))

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries without the clock, which is stored for each scene."""
        return {"allow_contaminated": self.allow_contaminated, "rates": self.rates}


# ------------------------------------------------------------------ results


@dataclass(frozen=True)
class EffortAtLevel(JsonRecord):
    """Effort that a refinement line needs to reach an error level.

    If the line does not reach the level, `reason` says why, and `least_error` is its smallest error.
    """

    line: str
    reached: EffortEstimate | None
    reason: str | None = None
    least_error: float | None = None

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries with the effort, or with the reason why there is none."""
        if (own := self.reached) is not None:
            return {"line": self.line, "effort": own.effort, "interpolated": own.interpolated, "keys": own.between}
        why = {"reason": self.reason, "least_error": self.least_error}
        return {"line": self.line, "effort": None, "interpolated": False, **why}


@dataclass(frozen=True)
class ErrorLevelEfforts(JsonRecord):
    """Efforts of all refinement lines to reach one error level."""

    level: float
    lines: list[EffortAtLevel]
    best: str | None  # line with the least effort


@dataclass(frozen=True)
class ErrorAnalysis(JsonRecord):
    """Analysis of one error metric: Pareto front, effort to reach error levels, and best model for frame rates."""

    unit: str
    against: str
    judged: JudgedPoints
    front: list[str]  # keys
    levels: list[ErrorLevelEfforts]
    rates: list[BestInFrame]

    @property
    def uncertainty(self) -> float:
        """Uncertainty of the reference, in the unit of the error; 0 if none is stated."""
        return self.judged.uncertainty

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries, with the excluded configurations and the reasons."""
        left_out = [{"key": k, "label": label, "reason": why} for k, (label, why) in self.judged.left_out.items()]
        return {
            "unit": self.unit, "against": self.against, "uncertainty": self.uncertainty or None,
            "effort": UNKNOWNS if self.judged.clock == UNKNOWNS else "s", "front": self.front, "left_out": left_out,
            "levels": self.levels, "rates": self.rates,
        }  # fmt: skip


@dataclass(frozen=True)
class Failure(JsonRecord):
    """Configuration (kind `model`) or reference (kind `reference`) without a solution, with the reason."""

    kind: str
    label: str
    key: str | None
    status: str
    message: str | None


@dataclass(frozen=True)
class TimingQuality(JsonRecord):
    """Quality of all timings: disturbed configurations, excluded runs, and how often each remark occurs."""

    timed: int
    of: int  # configurations
    contaminated: list[str]  # labels
    excluded_runs: int
    least_runs: int | None
    most_runs: int | None
    flags: dict[str, int]


@dataclass(frozen=True)
class SceneAnalysis(JsonRecord):
    """Analysis of configurations that are compared with each other: one scene with one reference solution."""

    scene: str
    problem: Mapping[str, str]
    answers: list[Answer]
    clock: str
    displacement_scale: float | None  # m
    lines: list[RefinementLine]
    metrics: dict[str, ErrorAnalysis]
    failures: list[Failure]
    distances: Distances
    levers: list[ChangeEffect]
    orders: list[LineOrders]
    timing: TimingQuality
    disagreements: list[Disagreement]
    advice: list[Advice]

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries without the advice, which is stored before the scenes."""
        return {name: value for name, value in super().entries().items() if name != "advice"}


@dataclass(frozen=True)
class Analysis(JsonRecord):
    """Analysis of a comparison, as the entry `analysis` of `softmark-compare/1`.

    Configurations are compared only within one group (`ComparedPoint.part`); each group is an entry of `scenes`.
    """

    options: ComparisonTerms
    scenes: dict[str, SceneAnalysis]

    @property
    def advice(self) -> list[Advice]:
        """Recommendations for all scenes of the comparison."""
        return [advice for own in self.scenes.values() for advice in own.advice]

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries, with the advice of all scenes first."""
        return {"options": self.options, "advice": self.advice, "scenes": self.scenes}


# ------------------------------------------------------------------ analysis


def analyse(
    points: Sequence[ComparedPoint],
    references: Mapping[str, References],
    studies: Mapping[str, Mapping[str, Study]] | None = None,
    terms: ComparisonTerms | None = None,
) -> Analysis:
    """Analyse the configurations of each scene separately.

    If a sweep changes the reference of the errors, the configurations with each of its values are also analysed
    separately. `references` are given by group (`ComparedPoint.part`), `studies` by scene.
    """
    own: dict[str, list[ComparedPoint]] = {part: [] for part in (*(p.part for p in points), *references)}
    for p in points:
        own[p.part].append(p)
    agreed = terms or ComparisonTerms()
    return Analysis(
        agreed, {part: _analyse_scene(part, own, references.get(part) or {}, studies or {}, agreed) for part in own}
    )


def _analyse_scene(
    part: str,
    parts: Mapping[str, Sequence[ComparedPoint]],
    references: References,
    studies: Mapping[str, Mapping[str, Study]],
    terms: ComparisonTerms,
) -> SceneAnalysis:
    points = parts[part]
    first = points[0] if points else None
    clock = choose_effort_kind(points, terms.clock)
    metrics, lines = error_metrics(points), lines_of(points)
    judged = {m: judge_points(points, m, clock, terms.allow_contaminated) for m in metrics}
    orders = [found for line in lines if (found := orders_of(line, metrics, points)) is not None]
    doubts = {m: {key: d for o in orders if (d := o.doubt_of(m)) for key in o.line.keys} for m in metrics}
    scale = displacement_scale(points, references)
    questions = [_advice_question(part, judged[m], points, scale, doubts[m]) for m in metrics]
    return SceneAnalysis(
        scene=first.scene if first else part,
        problem=first.problem if first else {},
        answers=_answers(part, parts, studies.get(first.scene) or {}, clock, terms) if first else [],
        clock=clock,
        displacement_scale=scale,
        lines=lines,
        metrics={q.metric: _error_analysis(q, lines, terms.rates) for q in questions},
        failures=find_failures(points, references),
        distances=compute_distances(points, references),
        levers=find_change_effects(points, metrics, clock),
        orders=orders,
        timing=assess_timing(points),
        disagreements=find_disagreements(judged),
        advice=[advise(q) for q in questions],
    )


def _answers(
    part: str,
    parts: Mapping[str, Sequence[ComparedPoint]],
    asked: Mapping[str, Study],
    clock: str,
    terms: ComparisonTerms,
) -> list[Answer]:
    """Return the answers to the studies of a scene.

    Each group of configurations has its own Pareto fronts. Convergence is answered once, over all groups of the
    scene.
    """
    scene = parts[part][0].scene
    own = {name: points for name, points in parts.items() if points and points[0].scene == scene}
    found: list[Answer] = []
    for name, study in asked.items():
        if isinstance(study, Pareto):
            found.append(answer_pareto(name, study, own[part], clock, terms.allow_contaminated))
        elif part == next(iter(own)):
            found.append(answer_convergence(name, study, [p for points in own.values() for p in points]))
    return found


def _advice_question(
    part: str, judged: JudgedPoints, points: Sequence[ComparedPoint], scale: float | None, doubts: Mapping[str, str]
) -> AdviceQuestion:  # fmt: skip
    metric = judged.metric
    unit = unit_of(points, metric) or "1"
    levels = error_levels(unit, scale, [e for p in points if (e := p.error(metric)) is not None])
    remarks = {p.key: training_remarks(p) for p in points}
    return AdviceQuestion(
        part, metric, unit, reference_name_of_metric(points, metric) or "", levels, judged, doubts, remarks
    )


def displacement_scale(points: Sequence[ComparedPoint], references: References) -> float | None:
    """Return the largest displacement at the probes of the references, m.

    If the references have no displacements, return the largest displacement of the configurations, or None.
    """
    for owners in ([r.probes for r in references.values()], [p.probes for p in points if p.solved]):
        moved = [u for probes in owners for probe in probes.values() for u in probe.displacement]
        largest = max((sum(c * c for c in u) ** 0.5 for u in moved), default=0.0)
        if largest > 0:
            return float(largest)
    return None


def _error_analysis(question: AdviceQuestion, lines: Sequence[RefinementLine], rates: Sequence[float]) -> ErrorAnalysis:
    judged = question.judged
    return ErrorAnalysis(
        question.unit, question.against, judged, [c.key for c in find_pareto_front(judged.candidates.values())],
        [_efforts_at_level(level, lines, judged) for level in question.levels],
        [best_within(float(hz), judged) for hz in rates],
    )  # fmt: skip


def _efforts_at_level(level: float, lines: Sequence[RefinementLine], judged: JudgedPoints) -> ErrorLevelEfforts:
    found = [_effort_at_level(level, line, judged) for line in lines]
    efforts = [(own.reached.effort.median, own.line) for own in found if own.reached is not None]
    return ErrorLevelEfforts(level, found, min(efforts, key=lambda pair: pair[0])[1] if efforts else None)


def _effort_at_level(level: float, line: RefinementLine, judged: JudgedPoints) -> EffortAtLevel:
    found = effort_to_reach(level, line, judged)
    if isinstance(found, EffortEstimate):
        return EffortAtLevel(line.name, found)
    errors = [judged.candidates[key].measured for key in line.keys if key in judged.candidates]
    return EffortAtLevel(line.name, None, found, min(errors, default=None))


def find_failures(points: Sequence[ComparedPoint], references: References) -> list[Failure]:
    """Return the configurations and references that have no solution."""
    found = [Failure("model", p.label, p.key, p.status, p.message) for p in points if not p.solved]
    lost = {name: r for name, r in references.items() if r.status != "converged"}
    return found + [Failure("reference", name, None, r.status, r.message) for name, r in lost.items()]


def assess_timing(points: Sequence[ComparedPoint]) -> TimingQuality:
    """Return a summary of the quality of all timings."""
    flags: dict[str, int] = {}
    for flag in (flag for p in points for flag in p.cost.flags):
        flags[flag] = flags.get(flag, 0) + 1
    runs = [int(p.cost.runs) for p in points if p.cost.runs]
    return TimingQuality(
        timed=sum(p.timed for p in points),
        of=len(points),
        contaminated=[p.label for p in points if p.cost.contaminated],
        excluded_runs=sum(p.cost.excluded_runs for p in points),
        least_runs=min(runs, default=None),
        most_runs=max(runs, default=None),
        flags=flags,
    )
