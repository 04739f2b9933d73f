"""Walk of a robustness study: the search for the values of one parameter, in one direction, at which a model fails.

The parameter moves away from its value in the scene, rung by rung of its scale, and the model is solved at
each rung. Then the walk refines each edge by bisection. An edge is the position at which the result changes
from right to wrong, or from a solution to none. The class `Walk` proposes the next position (`next_position`)
and stores the outcome (`record_outcome`). It solves nothing itself and is independent of scenes and solvers.
"""

from __future__ import annotations

from dataclasses import field
from itertools import pairwise
from typing import Literal

from softmark.interpreter.planning.parameter_scale import ParameterScale
from softmark.interpreter.results.state_results import SOLVED
from softmark.records import dataclass

Until = Literal["failure", "inaccuracy"]
ANSWERS = ("right", "inaccurate", "silent")
COSTLY = ("unjudged", "timed_out")  # not the model's fault, so no edge: no reference, or no time
BLIND = 3  # consecutive points without a true value after which a walk gives up


@dataclass(frozen=True)
class PointClass:
    """Class of the result at one position of a walk, and whether the model had a solution there (None if unknown)."""

    word: str
    answered: bool | None

    @classmethod
    def of(cls, word: str, status: str | None = None) -> PointClass:
        """Return the outcome with class `word`, such as `right`.

        If the result could not be judged (`unjudged`), the `status` of the model decides whether it had a solution.
        """
        if word == "unjudged":
            known = None if status is None else status in SOLVED
            return cls(word, known)
        return cls(word, word in ANSWERS)


@dataclass(frozen=True)
class Edge:
    """Edges that a walk has found: positions t on the scale of its parameter; t = 0 is the unchanged scene.

    The accuracy edge lies between `last_right` and `first_wrong`. The solution edge lies between `last_answer`
    and `first_silence`, the first position without a solution. `word` is the class of the results beyond the
    accuracy edge, and `reached` the farthest position.
    """

    last_right: float | None
    first_wrong: float | None
    word: str | None  # class of the results beyond the edge
    last_answer: float | None
    first_silence: float | None  # the first t without an answer
    first_blind: float | None  # the first unjudged t beyond `last_right`
    reached: float  # the farthest t


@dataclass(frozen=True)
class WalkSummary:
    """Summary of a walk: class of the unchanged scene, nearest right position, and numbers of solved positions."""

    here: str  # class of the unchanged scene
    first_right: float | None  # the position nearest to the scene at which the model is right
    judged: int  # points of the walk that were judged
    blind: int  # unjudged points before the farthest right one


@dataclass
class Walk:
    """State of one walk along the scale of a parameter.

    `seen` has the outcome at each position t; the unchanged scene is at t = 0.
    """

    ladder: ParameterScale
    until: Until
    seen: dict[float, PointClass] = field(default_factory=dict)

    def record_outcome(self, t: float, seen: PointClass) -> None:
        """Store the outcome of the solution at position t."""
        self.seen[t] = seen

    def next_position(self) -> float | None:
        """Return the next position t at which the model must be solved; None if the walk is complete."""
        rung = self._next_rung()
        if rung is not None:
            return rung
        for a, b in self._edge_brackets():
            between = self.ladder.between(a, b)
            if between is not None:
                return between
        return None

    def _next_rung(self) -> float | None:
        """Return the position of the next rung that has no outcome yet; None if the walk has reached its end."""
        if self._is_end(0.0):
            return None
        for rung in self.ladder.rungs:
            if rung not in self.seen:
                return rung
            if self._is_end(rung):
                return None
        return None

    def _is_end(self, t: float) -> bool:
        """Return whether the walk need not go beyond position t."""
        seen = self.seen[t]
        if self.until == "failure":
            return seen.answered is False
        visited = [self.seen[r].word for r in (0.0, *self.ladder.rungs) if r in self.seen and r <= t]
        blind = visited[-BLIND:] == ["unjudged"] * BLIND
        return blind or seen.word not in ("right", "unjudged")

    # ------------------------------------------------------------------ edges

    def _edge_brackets(self) -> list[tuple[float, float]]:
        """Return the pairs of neighbouring positions between which an edge lies."""
        found = []
        ts = sorted(self.seen)
        for a, b in pairwise(ts):
            if self.seen[b].word != "right":
                if self.seen[a].word == "right" and self.seen[b].word not in COSTLY:
                    found.append((a, b))
                break
        if self.until == "failure":
            for a, b in pairwise(ts):
                if self.seen[b].answered is False:
                    if self.seen[a].answered and self.seen[b].word not in COSTLY:
                        found.append((a, b))
                    break
        return found

    def edge(self) -> Edge:
        """Return the validity edge found so far: the last position with right results and the first with wrong ones."""
        ts = sorted(self.seen)
        wrong = next((t for t in ts if self.seen[t].word not in ("right", "unjudged")), None)
        right = [t for t in ts if self.seen[t].word == "right" and (wrong is None or t < wrong)]
        silence = next((t for t in ts if self.seen[t].answered is False), None)
        answered = [t for t in ts if self.seen[t].answered and (silence is None or t < silence)]
        word = None if wrong is None else self.seen[wrong].word
        if wrong is None and (not right or right[-1] < ts[-1]):
            word = "unjudged"
        farthest = max(right, default=None)
        blind = next((t for t in ts if self.seen[t].word == "unjudged" and t > (farthest or -1.0)), None)
        return Edge(farthest, wrong, word, max(answered, default=None), silence, blind, ts[-1])

    def summarize(self) -> WalkSummary:
        """Return the summary of the walk so far; positions whose reference has no value are neither right nor wrong."""
        last = self.edge().last_right
        right = [t for t, s in self.seen.items() if s.word == "right" and last is not None and t <= last]
        blind = [t for t, s in self.seen.items() if s.word == "unjudged"]
        before = sum(t < last for t in blind) if last is not None else 0
        return WalkSummary(self.seen[0.0].word, min(right, default=None), len(self.seen) - len(blind), before)
