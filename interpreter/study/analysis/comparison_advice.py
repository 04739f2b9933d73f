"""Advice on which configuration of a scene to use: one sentence for each error metric, with its caveats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import combinations

from softmark.interpreter.language.field_schema import join_names
from softmark.interpreter.language.number_formatting import format_quantity, group_digits
from softmark.interpreter.results.json_records import JsonRecord
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, Spread
from softmark.interpreter.study.analysis.pareto_front import DISTURBED, Candidate, JudgedPoints
from softmark.records import dataclass

NAMED = 6  # maximum number of indistinguishable configurations named


@dataclass(frozen=True)
class AdviceQuestion:
    """Data from which advice is derived: one error metric of a scene, error levels, and all configurations.

    `doubts` maps the key of a configuration to the reason why its refinement study is outside the asymptotic range.
    """

    scene: str
    metric: str
    unit: str
    against: str
    levels: Sequence[float]
    judged: JudgedPoints
    doubts: Mapping[str, str]
    remarks: Mapping[str, Sequence[str]] = field(default_factory=dict)  # remarks on a point, by key

    def amount(self, value: float) -> str:
        """Format a value of the error metric with its unit."""
        return format_quantity(value, self.unit, 3, percent=True)

    @property
    def reference_phrase(self) -> str:
        """Phrase that names the reference of the error metric, such as " against `truth`"; empty if there is none."""
        return f" against `{self.against}`" if self.against else ""

    def effort(self, spread: Spread) -> str:
        """Format an effort, which is a time or a number of unknowns: `84 ms (80 to 91 ms)`, `4320 unknowns`."""
        if self.judged.clock == UNKNOWNS:
            return f"{group_digits(int(spread.median))} unknowns"
        said = format_quantity(spread.median, "s", 3)
        if spread.q1 == spread.q3:
            return said
        low, high = format_quantity(spread.q1, "s", 3), format_quantity(spread.q3, "s", 3)
        same = low.split("\u00a0")[1:] == high.split("\u00a0")[1:]
        return f"{said} ({low.split(chr(0xA0))[0] if same else low} to {high})"

    def error(self, candidate: Candidate) -> str:
        """Format the error of a candidate, such as `1.2 % error`.

        If the error is below the uncertainty of the reference, the text gives this uncertainty as a bound instead.
        """
        if candidate.within:
            return f"an error below the uncertainty ± {self.amount(self.judged.uncertainty)} of the reference"
        return f"{self.amount(candidate.measured)} error"


@dataclass(frozen=True)
class Advice(JsonRecord):
    """Recommended configuration of a scene for one error metric, as a sentence with the data behind it.

    `winner` is None if no configuration can be recommended.
    """

    question: AdviceQuestion
    sentence: str
    winner: Candidate | None
    runner_up: Candidate | None
    level: float | None
    decidable: bool
    caveats: list[str]  # caveats of the winner

    @property
    def text(self) -> str:
        """Recommendation followed by its caveats."""
        return " ".join([self.sentence, *self.caveats])

    @property
    def factor(self) -> float | None:
        """Ratio of the effort of the best configuration of another model to the effort of the winner."""
        if self.winner is None or self.runner_up is None or self.winner.effort.median <= 0:
            return None
        return self.runner_up.effort.median / self.winner.effort.median

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries of the advice, together with those of its question."""
        return {
            "scene": self.question.scene, "metric": self.question.metric, "against": self.question.against,
            "text": self.text, "level": self.level, "decidable": self.decidable, "factor": self.factor,
            "winner": self.winner, "runner_up": self.runner_up,
            "uncertainty": self.question.judged.uncertainty or None, "caveats": self.caveats,
        }  # fmt: skip


def advise(question: AdviceQuestion) -> Advice:
    """Return the advice on which configuration of a scene to use."""
    candidates = list(question.judged.candidates.values())
    if not candidates:
        return _advise_nothing(question)
    level = next((v for v in sorted(question.levels) if any(_is_accurate_enough(c, v) for c in candidates)), None)
    if level is None or level < question.judged.uncertainty:
        return _advise_most_accurate(question, candidates, level)
    able = sorted((c for c in candidates if _is_accurate_enough(c, level)), key=_effort_sort_key)
    return _advise_fastest(question, level, able)


def _is_accurate_enough(candidate: Candidate, level: float) -> bool:
    return candidate.error <= level


def _effort_sort_key(c: Candidate) -> tuple[float, float]:
    return c.effort.median, c.error


def _error_sort_key(c: Candidate) -> tuple[float, float]:
    return c.error, c.effort.median


def _advise_nothing(question: AdviceQuestion) -> Advice:
    reasons: dict[str, int] = {}
    for _, reason in question.judged.left_out.values():
        reasons[reason] = reasons.get(reason, 0) + 1
    why = (
        "; ".join(f"{reason} ({n} configuration{'s' if n > 1 else ''})" for reason, n in reasons.items())
        or "there are no configurations"
    )
    said = f"No recommendation by `{question.metric}`{question.reference_phrase}: {why}."
    said += (
        " Other processes ran at the same time; `--allow-contaminated` uses these timings all the same."
        if DISTURBED in reasons
        else ""
    )
    return Advice(question, said, None, None, None, True, [])


def _advise_fastest(question: AdviceQuestion, level: float, able: Sequence[Candidate]) -> Advice:
    """Recommend the fastest configuration whose error is at most `level`, and name the fastest of another model."""
    winner = able[0]
    other = next((c for c in able[1:] if c.model != winner.model), None)
    few = "smallest" if question.judged.clock == UNKNOWNS else "fastest"
    said = (
        f"For an error of {question.amount(level)} or less in `{question.metric}`{question.reference_phrase}, "
        f"`{winner.label}` is the {few}: "
        f"{question.effort(winner.effort)}, {question.error(winner)}"
    )
    decided = other is None or _is_difference_clear(question, winner, other)
    said += _compare_with_next_model(question, winner, other, decided) + _describe_cheaper(question, level, winner)
    return Advice(question, said, winner, other, level, decided, _caveats(question, winner, winner.within))


def _describe_cheaper(question: AdviceQuestion, level: float, winner: Candidate) -> str:
    """Return a sentence on the fastest configuration at the next larger error level.

    The text is empty if that configuration is the winner at all larger levels.
    """
    for above in sorted(v for v in question.levels if v > level):
        able = [c for c in question.judged.candidates.values() if _is_accurate_enough(c, above)]
        first = min(able, key=_effort_sort_key)
        if first.key != winner.key:
            said = f" If {question.amount(above)} is sufficient, use `{first.label}`: "
            return said + f"{question.effort(first.effort)}, {question.error(first)}."
    return ""


def _is_difference_clear(question: AdviceQuestion, winner: Candidate, other: Candidate) -> bool:
    return question.judged.clock == UNKNOWNS or winner.effort.is_distinct_from(other.effort)


def _compare_with_next_model(
    question: AdviceQuestion, winner: Candidate, other: Candidate | None, decided: bool
) -> str:
    """Return a clause that compares the effort of the winner with that of the best other model."""
    if other is None:
        models = {c.model for c in question.judged.candidates.values()}
        return "; no other model is that accurate." if len(models) > 1 else "."
    factor = other.effort.median / winner.effort.median
    if not decided:
        return (
            f"; `{other.label}` ({question.effort(other.effort)}, {question.error(other)}) differs from it by less "
            f"than the timing noise, so it is undecided which of the two is faster."
        )
    much, as_ = ("unknowns", "as many") if question.judged.clock == UNKNOWNS else ("time", "as much")
    takes = f"{factor:.3g} times the {much}" if f"{factor:.3g}" != "1" else f"{as_} {much}"
    return f"; the next model, `{other.label}`, takes {takes} ({question.error(other)})."


def _advise_most_accurate(question: AdviceQuestion, candidates: Sequence[Candidate], level: float | None) -> Advice:
    """Recommend the configuration with the smallest error.

    This advice is given if no configuration reaches an error level, or if the level is below the reference's
    uncertainty.
    """
    ranked = sorted(candidates, key=_error_sort_key)
    winner = ranked[0]
    other = next((c for c in ranked[1:] if c.model != winner.model), None)
    if winner.within:
        return _advise_indistinguishable(question, [c for c in ranked if c.error == winner.error], other, level)
    lowest = (
        f"no configuration has an error of {question.amount(max(question.levels))} or less" if question.levels else ""
    )
    begin = f"{lowest}; " if level is None and lowest else ""
    said = (
        f"By `{question.metric}`{question.reference_phrase}, {begin}`{winner.label}` is the closest: "
        f"{question.error(winner)}, {question.effort(winner.effort)}"
    )
    tied = other is not None and other.error == winner.error
    if other is not None and tied:
        said += (
            f"; within the uncertainty of the reference `{other.label}` is as close, at {question.effort(other.effort)}"
        )
    elif other is not None:
        said += f"; the next model, `{other.label}`, has {question.error(other)} in {question.effort(other.effort)}"
    return Advice(question, said + ".", winner, other, None, not tied, _caveats(question, winner))


def _advise_indistinguishable(
    question: AdviceQuestion, alike: Sequence[Candidate], other: Candidate | None, level: float | None
) -> Advice:
    """Name the configurations whose errors are below the uncertainty of the reference, the fastest first.

    None of them can be called the most accurate.
    """
    winner = alike[0]
    several = len(alike) > 1
    named = join_names([f"`{c.label}`" for c in alike], NAMED)
    lost = level is None and bool(question.levels)
    blind = f", so an error of {question.amount(max(question.levels))} cannot be resolved" if lost else ""
    few = "smallest" if question.judged.clock == UNKNOWNS else "fastest"
    said = (
        f"`{question.metric}`{question.reference_phrase} has an uncertainty of ± "
        f"{question.amount(question.judged.uncertainty)}{blind}; the error{'s' if several else ''} of {named} "
        + (f"are below it and cannot be ranked; `{winner.label}` is the {few} of them" if several else "is below it")
        + f": {question.effort(winner.effort)}."
    )
    return Advice(question, said, winner, other, None, not several, _caveats(question, winner))


def _caveats(question: AdviceQuestion, winner: Candidate, within: bool = False) -> list[str]:
    """Return the caveats of a recommended configuration as sentences.

    `within` adds the caveat that the error is below the uncertainty of the reference.
    """
    found = []
    if winner.contaminated:
        found.append("Its timing was disturbed by other processes: the time is unreliable.")
    if winner.capped:
        found.append("Its solution was stopped by `max_iterations` before convergence, which is included in its error.")
    if within:
        found.append("Its error is below the uncertainty of the reference: a smaller error cannot be resolved.")
    if doubt := question.doubts.get(winner.key):
        found.append(
            f"Its study is outside the asymptotic range ({doubt}): refinement may not reduce the error further."
        )
    return [*found, *question.remarks.get(winner.key, ())]


def training_remarks(point: ComparedPoint) -> list[str]:
    """Return remarks on the training of a reduced model: its range, its load state, and its time."""
    reduced, setup = point.reduced, point.cost.setup_s
    if reduced is None:
        return []
    found = []
    if reduced.extrapolates:
        found.append(
            f"It extrapolates: {', '.join(f'`{n}`' for n in reduced.extrapolates)} is outside its training range."
        )
    if reduced.repeats:
        found.append(
            f"It was trained on `{reduced.of}` in this same state: its error shows only how well it reproduces that "
            f"state, not other loads."
        )
    if setup is not None:
        spent = format_quantity(setup.median, "s", 3)
        found.append(f"Its time excludes {spent} of training from `{reduced.of}`.")
    return found


# ------------------------------------------------------------------ disagreement of metrics


@dataclass(frozen=True)
class Disagreement(JsonRecord):
    """Two error metrics that rank configurations differently.

    Of `pairs` configuration pairs, `discordant` are in opposite order.
    """

    metrics: list[str]
    text: str
    discordant: int
    pairs: int


def find_disagreements(judged: Mapping[str, JudgedPoints]) -> list[Disagreement]:
    """Return the pairs of error metrics whose most accurate configurations belong to different models."""
    found = []
    for (one, a), (two, b) in combinations(judged.items(), 2):
        shared = [key for key in a.candidates if key in b.candidates]
        pairs = list(combinations(shared, 2))
        apart = sum(_compare_errors(a, x, y) * _compare_errors(b, x, y) < 0 for x, y in pairs)
        first, second = _most_accurate_candidates(a, shared), _most_accurate_candidates(b, shared)
        if not first or not second or not apart or {c.model for c in first} & {c.model for c in second}:
            continue
        said = (
            f"`{one}` and `{two}` rank configurations differently: the most accurate is `{first[0].label}` by the "
            f"first and `{second[0].label}` by the second; {apart} of {len(pairs)} pairs of configurations are in "
            f"opposite order."
        )
        found.append(Disagreement([one, two], said, apart, len(pairs)))
    return found


def _compare_errors(judged: JudgedPoints, x: str, y: str) -> int:
    a, b = judged.candidates[x].error, judged.candidates[y].error
    return (a > b) - (a < b)


def _most_accurate_candidates(judged: JudgedPoints, keys: Sequence[str]) -> list[Candidate]:
    """Return the candidates with the smallest error, the fastest first.

    Errors below the uncertainty of the reference are equal.
    """
    found = sorted((judged.candidates[key] for key in keys), key=_error_sort_key)
    return [c for c in found if c.error == found[0].error]
