"""Pareto front of configurations, effort to reach an error level, and smallest error within a frame time.

The rules for one error metric of one scene are:

- A configuration counts if it was solved, has an error and an effort, and its timing was not disturbed.
- An error below the uncertainty of its reference is replaced by that uncertainty, so that differences below it do not
  matter.
- A configuration is on the front unless another has no more effort *and* no more error, and less of one of the two.
- The error is interpolated linearly in logarithms, only between two neighbouring points of one refinement line.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from softmark.interpreter.results.json_records import JsonRecord
from softmark.interpreter.study.analysis.comparison_point import (
    INSIDE_OUT,
    READ,
    UNKNOWNS,
    ComparedPoint,
    Spread,
    uncertainty_of,
)
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine
from softmark.records import dataclass

RATES = (25.0, 300.0, 1000.0)  # Hz: display, tissue cutting, haptic feedback
RELATIVE = (0.1, 0.05, 0.01)
DISTURBED = "its timing was disturbed"
STATUS = {
    "not_converged": "it did not converge", "diverged": "it diverged", "failed": "it failed",
    "skipped": "it was skipped", "unsupported": "its program does not support the scene",
    "timed_out": "it ran out of time",
}  # fmt: skip


@dataclass(frozen=True)
class Candidate(JsonRecord):
    """Configuration that counts for the Pareto front, with its effort and its error.

    `measured` is the error itself. `error` is at least the uncertainty of the reference.
    """

    key: str
    label: str
    model: str
    effort: Spread
    error: float
    measured: float
    capped: bool = False
    contaminated: bool = False
    frame: Spread | None = None

    @property
    def within(self) -> bool:
        """True if the measured error is below the uncertainty of the reference."""
        return self.measured < self.error

    def beats(self, other: Candidate) -> bool:
        """Return whether this candidate dominates another.

        It then has no more effort and no more error, and less of one of the two.
        """
        no_worse = self.effort.median <= other.effort.median and self.error <= other.error
        return no_worse and (self.effort.median < other.effort.median or self.error < other.error)

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries: label, effort, error and the other fields."""
        return {
            "key": self.key, "label": self.label, "model": self.model, "effort": self.effort, "error": self.measured,
            "within_uncertainty": self.within, "capped": self.capped, "contaminated": self.contaminated,
        }  # fmt: skip


@dataclass(frozen=True)
class JudgedPoints:
    """Configurations of one scene that count for one error metric, and the excluded ones with reasons."""

    metric: str
    clock: str
    uncertainty: float
    candidates: dict[str, Candidate]  # by key
    left_out: dict[str, tuple[str, str]]  # key -> (label, reason)


def judge_points(
    points: Sequence[ComparedPoint], metric: str, clock: str, allow_contaminated: bool = False
) -> JudgedPoints:
    """Return the configurations of one scene that count for an error metric, and the excluded ones with reasons.

    `clock` is the kind of effort. Disturbed timings count only if `allow_contaminated`.
    """
    uncertainty = uncertainty_of(points, metric)
    judged = JudgedPoints(metric, clock, uncertainty, {}, {})
    first = {p.key: p for p in reversed(points)}  # of one configuration in several studies, the first gives the label
    for key in dict.fromkeys(p.key for p in points):
        found = _candidate_or_reason(first[key], metric, clock, uncertainty, allow_contaminated)
        if isinstance(found, Candidate):
            judged.candidates[key] = found
        else:
            judged.left_out[key] = first[key].label, found
    return judged


def _candidate_or_reason(
    point: ComparedPoint, metric: str, clock: str, uncertainty: float, allow_contaminated: bool
) -> Candidate | str:  # fmt: skip
    """Return a configuration as a candidate for the Pareto front, or the reason why it does not count."""
    error, effort = point.error(metric), point.effort(clock)
    if not point.solved:
        return STATUS.get(point.status, f"it is {point.status.replace('_', ' ')}")
    if point.inverted:
        return INSIDE_OUT
    if error is None:
        return point.metric(metric).reason or f"{metric} was not measured"
    if effort is None:
        return _reason_without_effort(point, clock)
    if point.cost.contaminated and not allow_contaminated:
        return DISTURBED
    return Candidate(
        point.key, point.label, point.model, effort, max(error, uncertainty), error,
        point.status == "capped", point.cost.contaminated, point.cost.frame,
    )  # fmt: skip


def _reason_without_effort(point: ComparedPoint, clock: str) -> str:
    if point.status == READ:
        return "it was read from a file and has no time"
    if clock != UNKNOWNS:
        return "it was not timed"
    return (
        "the number of unknowns of a reduced model is no measure of its cost"
        if point.reduced
        else "its number of unknowns is not known"
    )


# ------------------------------------------------------------------ the front


def find_pareto_front(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return the candidates that no other dominates, the fastest first, in O(n log n).

    If several candidates have equal effort and error, all of them are included.
    """
    ordered = sorted(candidates, key=lambda c: (c.effort.median, c.error))
    front: list[Candidate] = []
    for c in ordered:
        last = front[-1] if front else None
        same = last is not None and (last.effort.median, last.error) == (c.effort.median, c.error)
        if last is None or c.error < last.error or same:
            front.append(c)
    return front


# ------------------------------------------------------------------ effort to reach an error


@dataclass(frozen=True)
class EffortEstimate:
    """Effort at which a refinement line reaches an error level.

    `between` has the keys of the two configurations between which it is interpolated, or one key if it is computed.
    """

    effort: Spread
    between: tuple[str, ...]  # one key: a computed point

    @property
    def interpolated(self) -> bool:
        """True if the effort is interpolated between two computed configurations."""
        return len(self.between) > 1


def effort_to_reach(level: float, line: RefinementLine, judged: JudgedPoints) -> EffortEstimate | str:
    """Return the least effort at which a refinement line reaches an error level, or the reason why it does not.

    Efforts t are interpolated between neighbours a and b with errors ea and eb: log t = log ta + s (log tb - log ta),
    s = log(level / ea) / log(eb / ea).
    """
    if level < judged.uncertainty:
        return "the uncertainty of the reference is larger"
    members = [judged.candidates.get(key) for key in line.keys]
    usable = [c for c in members if c is not None]
    if not usable:
        return _reason_without_candidates(line, judged)
    found = [EffortEstimate(c.effort, (c.key,)) for c in usable if c.error <= level]
    found += [r for a, b in pairwise(members) if (r := _interpolate_effort(level, a, b)) is not None]
    if not found:
        return "not reached"
    return min(found, key=lambda r: r.effort.median)


def _reason_without_candidates(line: RefinementLine, judged: JudgedPoints) -> str:
    reasons = dict.fromkeys(judged.left_out[key][1] for key in line.keys if key in judged.left_out)
    return "; ".join(reasons) or "it has no points"


def _interpolate_effort(level: float, a: Candidate | None, b: Candidate | None) -> EffortEstimate | None:
    """Return the interpolated effort where the segment from a to b crosses an error level; None if it does not."""
    if a is None or b is None or a.error <= 0 or b.error <= 0:
        return None
    if not min(a.error, b.error) < level < max(a.error, b.error):
        return None
    s = (math.log(level) - math.log(a.error)) / (math.log(b.error) - math.log(a.error))
    low, middle, high = (_interpolate_logarithmically(x, y, s) for x, y in _quartile_pairs(a.effort, b.effort))
    return EffortEstimate(Spread(middle, low, high), (a.key, b.key))


def _quartile_pairs(a: Spread, b: Spread) -> list[tuple[float, float]]:
    return [(a.q1, b.q1), (a.median, b.median), (a.q3, b.q3)]


def _interpolate_logarithmically(x: float, y: float, s: float) -> float:
    return math.exp((1 - s) * math.log(x) + s * math.log(y)) if x > 0 and y > 0 else 0.0


def error_levels(unit: str, scale: float | None, errors: Iterable[float]) -> list[float]:
    """Return error levels that are useful in a recommendation, the largest first.

    For dimensionless errors they are 10, 5 and 1 %. For lengths they are round values near 10, 5 and 1 % of
    `scale`, the largest displacement, m. For other units they are at most three powers of ten within the range of
    `errors`.
    """
    if unit in ("1", ""):
        return list(RELATIVE)
    if unit == "m" and scale:
        return list(dict.fromkeys(nearest_round_number(part * scale) for part in RELATIVE))
    positive = [e for e in errors if e > 0]
    if not positive:
        return []
    low, high = (math.floor(math.log10(f(positive))) for f in (min, max))
    return [float(f"1e{k}") for k in range(high, low - 1, -1)][:3]


def nearest_round_number(value: float) -> float:
    """Return the number nearest to `value`, by ratio, that is 1, 2 or 5 times a power of ten."""
    decade = math.floor(math.log10(value))
    choices = [float(f"{m}e{decade + k}") for k in (0, 1) for m in (1, 2, 5)]
    return min(choices, key=lambda c: abs(math.log(c / value)))


# ------------------------------------------------------------------ smallest error within a frame time


@dataclass(frozen=True)
class BestInFrame(JsonRecord):
    """Most accurate configuration whose time fits into a frame, and the next most accurate one.

    A time fits if its third quartile is at most the frame time.
    """

    hz: float
    best: Candidate | None
    runner_up: Candidate | None
    reason: str | None = None
    unsure: tuple[str, ...] = ()  # labels whose median fits and whose third quartile does not
    takes: Spread | None = None  # seconds of the best

    @property
    def margin(self) -> float | None:
        """Fraction of the frame time that the computation leaves unused."""
        return None if self.takes is None else 1.0 - self.takes.q3 * self.hz

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries; entries without a value are omitted."""
        best, other, found = self.best, self.runner_up, {"hz": self.hz, "frame_s": 1.0 / self.hz, "key": None}
        own: dict[str, object] = {**found, "reason": self.reason, "unsure": self.unsure}
        if best is not None:
            own |= {"key": best.key, "label": best.label, "error": best.measured, "within_uncertainty": best.within}
            own |= {"takes": self.takes, "margin": self.margin}
        if other is not None:
            own["runner_up"] = {"key": other.key, "label": other.label, "error": other.measured}
        return own


def best_within(hz: float, judged: JudgedPoints) -> BestInFrame:
    """Return the most accurate configuration whose third quartile of time is at most 1/hz, hz in Hz.

    Of configurations with equal errors the fastest is returned.
    """
    framed = [(c, c.frame) for c in judged.candidates.values() if c.frame is not None]
    limit = 1.0 / hz
    fitting = [(c.error, f.median, c.key, c) for c, f in framed if f.q3 <= limit]
    unsure = tuple(c.label for c, f in framed if f.median <= limit < f.q3)
    if not fitting:
        return BestInFrame(hz, None, None, _reason_too_slow(framed), unsure)
    ranked = [c for *_, c in sorted(fitting, key=lambda entry: entry[:3])]
    other = next((c for c in ranked if c.model != ranked[0].model), None)
    return BestInFrame(hz, ranked[0], other, None, unsure, ranked[0].frame)


def _reason_too_slow(framed: Sequence[tuple[Candidate, Spread]]) -> str:
    if not framed:
        return "no valid timing"
    c, frame = min(framed, key=lambda pair: pair[1].q3)
    return f"the fastest, `{c.label}`, takes {1e3 * frame.q3:.3g} ms"
