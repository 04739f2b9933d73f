"""One sentence of advice for each error of a scene, with the numbers that it rests on and what they leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import combinations

from softmark.interpreter.language.field_schema import join_names
from softmark.interpreter.language.number_formatting import format_quantity, group_digits
from softmark.interpreter.results.json_records import Plain
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, Spread
from softmark.interpreter.study.analysis.pareto_front import DISTURBED, Candidate, Judged
from softmark.records import dataclass

NAMED = 6  # configurations that are named where they are not told apart


@dataclass(frozen=True)
class Question:
    """What advice is asked about: an error of a scene, the levels of it that matter, and what is known of each point.

    `doubts` has a sentence for points whose study is outside the asymptotic range, by key.
    """

    scene: str
    metric: str
    unit: str
    against: str
    levels: Sequence[float]
    judged: Judged
    doubts: Mapping[str, str]
    remarks: Mapping[str, Sequence[str]] = field(default_factory=dict)  # what must be said of a point, by key

    def amount(self, value: float) -> str:
        """An error in words."""
        return format_quantity(value, self.unit, 3, percent=True)

    @property
    def measured_from(self) -> str:
        """` against the reference`."""
        return f" against `{self.against}`" if self.against else ""

    def effort(self, spread: Spread) -> str:
        """`84 ms (80 to 91 ms)`, or a number of unknowns."""
        if self.judged.clock == UNKNOWNS:
            return f"{group_digits(int(spread.median))} unknowns"
        said = format_quantity(spread.median, "s", 3)
        if spread.q1 == spread.q3:
            return said
        low, high = format_quantity(spread.q1, "s", 3), format_quantity(spread.q3, "s", 3)
        same = low.split("\u00a0")[1:] == high.split("\u00a0")[1:]
        return f"{said} ({low.split(chr(0xA0))[0] if same else low} to {high})"

    def error(self, candidate: Candidate) -> str:
        """`1.2 %`, or what stands for it where the reference does not know better."""
        if candidate.within:
            return f"an error within the ± {self.amount(self.judged.uncertainty)} of the reference"
        return f"{self.amount(candidate.measured)} error"


@dataclass(frozen=True)
class Advice(Plain):
    """A sentence, who it is about, and what it rests on; `winner` is None where nothing can be recommended."""

    question: Question
    sentence: str
    winner: Candidate | None
    runner_up: Candidate | None
    level: float | None
    decidable: bool
    caveats: list[str]  # what must be said about the winner

    @property
    def text(self) -> str:
        """The sentence with its caveats."""
        return " ".join([self.sentence, *self.caveats])

    @property
    def factor(self) -> float | None:
        """How many times the effort of the winner the next model takes."""
        if self.winner is None or self.runner_up is None or self.winner.effort.median <= 0:
            return None
        return self.runner_up.effort.median / self.winner.effort.median

    def entries(self) -> Mapping[str, object]:
        """With what it was asked about."""
        return {
            "scene": self.question.scene, "metric": self.question.metric, "against": self.question.against,
            "text": self.text, "level": self.level, "decidable": self.decidable, "factor": self.factor,
            "winner": self.winner, "runner_up": self.runner_up,
            "uncertainty": self.question.judged.uncertainty or None, "caveats": self.caveats,
        }  # fmt: skip


def advise(question: Question) -> Advice:
    """What to take."""
    candidates = list(question.judged.candidates.values())
    if not candidates:
        return _nothing(question)
    level = next((v for v in sorted(question.levels) if any(_reaches(c, v) for c in candidates)), None)
    if level is None or level < question.judged.uncertainty:
        return _nearest(question, candidates, level)
    able = sorted((c for c in candidates if _reaches(c, level)), key=_by_effort)
    return _quickest(question, level, able)


def _reaches(candidate: Candidate, level: float) -> bool:
    return candidate.error <= level


def _by_effort(c: Candidate) -> tuple[float, float]:
    return c.effort.median, c.error


def _by_error(c: Candidate) -> tuple[float, float]:
    return c.error, c.effort.median


def _nothing(question: Question) -> Advice:
    reasons: dict[str, int] = {}
    for _, reason in question.judged.left_out.values():
        reasons[reason] = reasons.get(reason, 0) + 1
    why = "; ".join(f"{reason} ({n})" for reason, n in reasons.items()) or "there are no configurations"
    said = f"By `{question.metric}`{question.measured_from}, nothing can be recommended: {why}."
    said += " With `--allow-contaminated` disturbed timings count as well." if DISTURBED in reasons else ""
    return Advice(question, said, None, None, None, True, [])


def _quickest(question: Question, level: float, able: Sequence[Candidate]) -> Advice:
    """The quickest that is at or below a level, and the quickest of another model."""
    winner = able[0]
    other = next((c for c in able[1:] if c.model != winner.model), None)
    few = "smallest" if question.judged.clock == UNKNOWNS else "quickest"
    said = (
        f"For `{question.metric}`{question.measured_from} of {question.amount(level)} or less, "
        f"`{winner.label}` is the {few}: "
        f"{question.effort(winner.effort)}, {question.error(winner)}"
    )
    decided = other is None or _decided(question, winner, other)
    said += _against(question, winner, other, decided) + _cheaper(question, level, winner)
    return Advice(question, said, winner, other, level, decided, _caveats(question, winner, winner.within))


def _cheaper(question: Question, level: float, winner: Candidate) -> str:
    """What a larger error is had for: the quickest at the next level above at which it is another one."""
    for above in sorted(v for v in question.levels if v > level):
        able = [c for c in question.judged.candidates.values() if _reaches(c, above)]
        first = min(able, key=_by_effort)
        if first.key != winner.key:
            said = f" Where {question.amount(above)} will do, `{first.label}` is enough: "
            return said + f"{question.effort(first.effort)}, {question.error(first)}."
    return ""


def _decided(question: Question, winner: Candidate, other: Candidate) -> bool:
    return question.judged.clock == UNKNOWNS or winner.effort.apart(other.effort)


def _against(question: Question, winner: Candidate, other: Candidate | None, decided: bool) -> str:
    """How far off the next model is."""
    if other is None:
        models = {c.model for c in question.judged.candidates.values()}
        return "; no other model gets there." if len(models) > 1 else "."
    factor = other.effort.median / winner.effort.median
    if not decided:
        return (
            f"; `{other.label}` ({question.effort(other.effort)}, {question.error(other)}) differs from it by less "
            "than the noise of the timing, so which of the two is quicker is not decidable here."
        )
    much, as_ = ("unknowns", "as many") if question.judged.clock == UNKNOWNS else ("time", "as much")
    takes = f"{factor:.3g} times the {much}" if f"{factor:.3g}" != "1" else f"{as_} {much}"
    return f"; the next model, `{other.label}`, takes {takes} ({question.error(other)})."


def _nearest(question: Question, candidates: Sequence[Candidate], level: float | None) -> Advice:
    """No level is reached, or none has a meaning: who errs least."""
    ranked = sorted(candidates, key=_by_error)
    winner = ranked[0]
    other = next((c for c in ranked[1:] if c.model != winner.model), None)
    if winner.within:
        return _not_told_apart(question, [c for c in ranked if c.error == winner.error], other, level)
    lowest = f"no configuration gets to {question.amount(max(question.levels))}" if question.levels else ""
    begin = f"{lowest}; " if level is None and lowest else ""
    said = (
        f"By `{question.metric}`{question.measured_from}, {begin}`{winner.label}` is the closest: "
        f"{question.error(winner)}, {question.effort(winner.effort)}"
    )
    tied = other is not None and other.error == winner.error
    if other is not None and tied:
        said += f"; `{other.label}` is as close as the reference can tell, at {question.effort(other.effort)}"
    elif other is not None:
        said += f"; the next model, `{other.label}`, has {question.error(other)} in {question.effort(other.effort)}"
    return Advice(question, said + ".", winner, other, None, not tied, _caveats(question, winner))


def _not_told_apart(
    question: Question, alike: Sequence[Candidate], other: Candidate | None, level: float | None
) -> Advice:
    """The reference knows less than the errors that it finds: no level below that can be judged, nobody is closest."""
    winner = alike[0]
    several = len(alike) > 1
    named = join_names([f"`{c.label}`" for c in alike], NAMED)
    lost = level is None and bool(question.levels)
    blind = f", so no error of {question.amount(max(question.levels))} can be judged" if lost else ""
    few = "smallest" if question.judged.clock == UNKNOWNS else "quickest"
    said = (
        f"`{question.metric}`{question.measured_from} is known to ± {question.amount(question.judged.uncertainty)} "
        f"only{blind}; within it {'are' if several else 'is'} {named}"
        + (f", not told apart, of which `{winner.label}` is the {few}" if several else "")
        + f": {question.effort(winner.effort)}."
    )
    return Advice(question, said, winner, other, None, not several, _caveats(question, winner))


def _caveats(question: Question, winner: Candidate, within: bool = False) -> list[str]:
    """What must be said about a recommended point; `within` the reference's uncertainty, where nothing says so yet."""
    found = []
    if winner.contaminated:
        found.append("Its timing was disturbed: do not trust the time.")
    if winner.capped:
        found.append("Its solution was stopped by a cap, so its error is that of an unfinished iteration.")
    if within:
        found.append("Its error is below the uncertainty of the reference: nothing can be told to be more accurate.")
    if doubt := question.doubts.get(winner.key):
        found.append(f"Its study is outside the asymptotic range ({doubt}): its error need not go on falling.")
    return [*found, *question.remarks.get(winner.key, ())]


def remarks_of(point: ComparedPoint) -> list[str]:
    """What must be said of a reduced model: what its error rests on, and what its time leaves out."""
    reduced, setup = point.reduced, point.cost.setup_s
    if reduced is None:
        return []
    found = []
    if reduced.extrapolates:
        found.append(f"It extrapolates: {', '.join(f'`{n}`' for n in reduced.extrapolates)} is outside its training.")
    if reduced.repeats:
        found.append(
            f"It was trained on `{reduced.of}` in this very state: its error says how well it repeats that, "
            "and nothing of other loads."
        )
    if setup is not None:
        spent = format_quantity(setup.median, "s", 3)
        found.append(f"Its time leaves out {spent} in which it is made from `{reduced.of}`.")
    return found


# ------------------------------------------------------------------ metrics that disagree


@dataclass(frozen=True)
class Disagreement(Plain):
    """Two errors that rank configurations differently: `discordant` of `pairs` the other way round."""

    metrics: list[str]
    text: str
    discordant: int
    pairs: int


def disagreements(judged: Mapping[str, Judged]) -> list[Disagreement]:
    """Pairs of errors by which another model's best configuration comes first, with how many pairs they order apart."""
    found = []
    for (one, a), (two, b) in combinations(judged.items(), 2):
        shared = [key for key in a.candidates if key in b.candidates]
        pairs = list(combinations(shared, 2))
        apart = sum(_sign(a, x, y) * _sign(b, x, y) < 0 for x, y in pairs)
        first, second = _closest(a, shared), _closest(b, shared)
        if not first or not second or not apart or {c.model for c in first} & {c.model for c in second}:
            continue
        said = (
            f"`{one}` and `{two}` rank differently: by the one `{first[0].label}` is the closest, by the other "
            f"`{second[0].label}`; they order {apart} of {len(pairs)} pairs of configurations the other way round."
        )
        found.append(Disagreement([one, two], said, apart, len(pairs)))
    return found


def _sign(judged: Judged, x: str, y: str) -> int:
    a, b = judged.candidates[x].error, judged.candidates[y].error
    return (a > b) - (a < b)


def _closest(judged: Judged, keys: Sequence[str]) -> list[Candidate]:
    """Those that err least, as far as the reference can tell, the quickest of them first."""
    found = sorted((judged.candidates[key] for key in keys), key=_by_error)
    return [c for c in found if c.error == found[0].error]
