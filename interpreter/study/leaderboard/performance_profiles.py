"""Performance profiles of a leaderboard.

The performance ratio of a model s on a case p is r(p, s) = t(p, s) / min over s of t(p, s), with the time t; it is
infinite without a right answer. The profile of the model is rho(s, tau), the fraction of all cases with r(p, s) <= tau.
At tau = 1 it is the fraction of cases where no model is faster; for large tau it is the fraction that the model answers
at all. Cases that no model answers are left out.
Source: Dolan and Moré 2002, Math. Program. 91:201, equations 1 and 2.

For errors no best model is needed, because cases have tolerances. The profile of errors is the fraction of cases whose
error is at most tau times the tolerance, as in data profiles.
Source: Moré and Wild 2009.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from softmark.interpreter.study.leaderboard.leaderboard_cells import MET, Board
from softmark.records import dataclass

Costs = Mapping[str, Mapping[str, float]]  # cost by case and model; models without an answer are missing
Steps = tuple[tuple[float, float], ...]  # (tau, fraction), where the fraction rises


@dataclass(frozen=True)
class PerformanceProfile:
    """Performance profile of one model over `of` cases.

    `steps` are the performance ratios tau at which the fraction of cases rises, each with the new fraction.
    """

    model: str
    steps: Steps
    of: int

    def at(self, tau: float) -> float:
        """Return the fraction of cases with a performance ratio of at most `tau`."""
        return max((share for limit, share in self.steps if limit <= tau), default=0.0)


def time_profiles(board: Board) -> list[PerformanceProfile]:
    """Return the performance profiles of the time to a right answer.

    If a model is entered several times in a case, its fastest right answer counts.
    """
    right = ((c.case, c.model, c.time_s) for c in board.cells if c.verdict == MET and c.time_s)
    costs = find_smallest((case, model, float(time or 0.0)) for case, model, time in right)
    ratios = {case: relative_costs(own) for case, own in costs.items()}
    return make_profiles(ratios, len(ratios), list(board.models))


def error_profiles(board: Board) -> list[PerformanceProfile]:
    """Return the performance profiles of errors, as multiples of the tolerance of each case.

    If a model is entered several times in a case, its most accurate answer counts.
    """
    limits = {name: case.tolerance for name, case in board.cases.items() if case.tolerance}
    known = (
        (c.case, c.model, c.error / limits[c.case]) for c in board.cells if c.error is not None and c.case in limits
    )
    ratios = find_smallest(known)
    return make_profiles(ratios, len(ratios), list(board.models))


def find_smallest(entries: Iterable[tuple[str, str, float]]) -> dict[str, dict[str, float]]:
    """Return the smallest value for each case and model from (case, model, value) entries."""
    found: dict[str, dict[str, float]] = {}
    for case, model, value in entries:
        own = found.setdefault(case, {})
        own[model] = min(value, own.get(model, math.inf))
    return found


def relative_costs(costs: Mapping[str, float]) -> dict[str, float]:
    """Return the cost of each model in one case divided by the smallest of these costs."""
    best = min(costs.values())
    return {model: cost / best for model, cost in costs.items()}


def make_profiles(ratios: Costs, of: int, models: Sequence[str]) -> list[PerformanceProfile]:
    """Return the performance profile of each model that has an answer, the largest final fraction first.

    `ratios` are the performance ratios by case and model, and `of` is the number of cases.
    """
    found = []
    for model in models:
        own = sorted(case[model] for case in ratios.values() if model in case)
        if own:
            steps = {ratio: (i + 1) / of for i, ratio in enumerate(own)}
            found.append(PerformanceProfile(model, tuple(steps.items()), of))
    return sorted(found, key=lambda p: (-p.steps[-1][1], -p.at(1.0)))
