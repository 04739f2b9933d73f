"""Performance profiles (Dolan and Moré 2002, Math. Program. 91:201, equations 1 and 2) of a leaderboard.

The ratio of a model s on a case p is r(p, s) = t(p, s) / min over s of t(p, s), infinite without a right answer; its
profile is rho(s, tau), the fraction of all cases with r(p, s) <= tau. At tau = 1 it is the fraction of cases where no
model is faster, for large tau the fraction that it answers at all. Cases that no model answers are left out.

Errors have tolerances, so no best model is needed: their profile is the fraction of cases whose error is at most tau
tolerances (as in the data profiles of Moré and Wild 2009).
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
    """Profile of one model over `of` cases."""

    model: str
    steps: Steps
    of: int

    def at(self, tau: float) -> float:
        """Return the fraction of cases with a ratio of at most `tau`."""
        return max((share for limit, share in self.steps if limit <= tau), default=0.0)


def time_profiles(board: Board) -> list[PerformanceProfile]:
    """Return profiles of the seconds to a right answer, with the fastest of each model's settings."""
    right = ((c.case, c.model, c.time_s) for c in board.cells if c.verdict == MET and c.time_s)
    costs = find_smallest((case, model, float(time or 0.0)) for case, model, time in right)
    ratios = {case: relative_costs(own) for case, own in costs.items()}
    return make_profiles(ratios, len(ratios), list(board.models))


def error_profiles(board: Board) -> list[PerformanceProfile]:
    """Return profiles of errors in tolerances, with the most accurate of each model's settings."""
    limits = {name: case.tolerance for name, case in board.cases.items() if case.tolerance}
    known = (
        (c.case, c.model, c.error / limits[c.case]) for c in board.cells if c.error is not None and c.case in limits
    )
    ratios = find_smallest(known)
    return make_profiles(ratios, len(ratios), list(board.models))


def find_smallest(entries: Iterable[tuple[str, str, float]]) -> dict[str, dict[str, float]]:
    """Return the smallest value of each case and model."""
    found: dict[str, dict[str, float]] = {}
    for case, model, value in entries:
        own = found.setdefault(case, {})
        own[model] = min(value, own.get(model, math.inf))
    return found


def relative_costs(costs: Mapping[str, float]) -> dict[str, float]:
    """Return the costs of one case divided by the smallest of them."""
    best = min(costs.values())
    return {model: cost / best for model, cost in costs.items()}


def make_profiles(ratios: Costs, of: int, models: Sequence[str]) -> list[PerformanceProfile]:
    """Return the profile of each model with any answer, the largest final fraction first."""
    found = []
    for model in models:
        own = sorted(case[model] for case in ratios.values() if model in case)
        if own:
            steps = {ratio: (i + 1) / of for i, ratio in enumerate(own)}
            found.append(PerformanceProfile(model, tuple(steps.items()), of))
    return sorted(found, key=lambda p: (-p.steps[-1][1], -p.at(1.0)))
