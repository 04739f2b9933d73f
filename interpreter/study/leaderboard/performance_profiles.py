"""Performance profiles (Dolan and Moré 2002, Math. Program. 91:201, equations 1 and 2) of a board.

The ratio of a model s on a case p is r(p, s) = t(p, s) / min over s of t(p, s), endless where it has no right answer;
its profile is rho(s, tau), the share of all cases with r(p, s) <= tau. At tau = 1 it is the share of cases that nobody
answers quicker, far right the share that it answers at all. Cases that no model answers are left out.

Errors have tolerances, so no best model is needed: their profile is the share of cases whose error is at most tau
tolerances (as the data profiles of Moré and Wild 2009 count what is reached).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from softmark.interpreter.study.leaderboard.leaderboard_cells import MET, Board
from softmark.records import dataclass

Costs = Mapping[str, Mapping[str, float]]  # by case, by model: what is to be small; who has no answer is not there
Steps = tuple[tuple[float, float], ...]  # (tau, share), where the share rises


@dataclass(frozen=True)
class Profile:
    """The shares of one model over `of` cases."""

    model: str
    steps: Steps
    of: int

    def at(self, tau: float) -> float:
        """The share of cases with a ratio of at most `tau`."""
        return max((share for limit, share in self.steps if limit <= tau), default=0.0)


def time_profiles(board: Board) -> list[Profile]:
    """Seconds to a right answer: the quickest of a model's settings counts."""
    right = ((c.case, c.model, c.time_s) for c in board.cells if c.verdict == MET and c.time_s)
    costs = least((case, model, float(time or 0.0)) for case, model, time in right)
    ratios = {case: relative(own) for case, own in costs.items()}
    return profiles(ratios, len(ratios), list(board.models))


def error_profiles(board: Board) -> list[Profile]:
    """Errors in tolerances: the most accurate of a model's settings counts."""
    limits = {name: case.tolerance for name, case in board.cases.items() if case.tolerance}
    known = (
        (c.case, c.model, c.error / limits[c.case]) for c in board.cells if c.error is not None and c.case in limits
    )
    ratios = least(known)
    return profiles(ratios, len(ratios), list(board.models))


def least(entries: Iterable[tuple[str, str, float]]) -> dict[str, dict[str, float]]:
    """The smallest of each case and model."""
    found: dict[str, dict[str, float]] = {}
    for case, model, value in entries:
        own = found.setdefault(case, {})
        own[model] = min(value, own.get(model, math.inf))
    return found


def relative(costs: Mapping[str, float]) -> dict[str, float]:
    """Costs of one case over the smallest of them."""
    best = min(costs.values())
    return {model: cost / best for model, cost in costs.items()}


def profiles(ratios: Costs, of: int, models: Sequence[str]) -> list[Profile]:
    """The profile of each model that has any answer, the largest share at last first."""
    found = []
    for model in models:
        own = sorted(case[model] for case in ratios.values() if model in case)
        if own:
            steps = {ratio: (i + 1) / of for i, ratio in enumerate(own)}
            found.append(Profile(model, tuple(steps.items()), of))
    return sorted(found, key=lambda p: (-p.steps[-1][1], -p.at(1.0)))
