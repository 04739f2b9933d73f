"""One walk: a model along one quantity in one direction, outward rung by rung, then each edge bisected.

A walk asks (`wanted`) and is told (`tell`); it computes nothing, and knows neither scenes nor solvers.
"""

from __future__ import annotations

from dataclasses import field
from itertools import pairwise
from typing import Literal

from softmark.interpreter.planning.parameter_scale import Ladder
from softmark.interpreter.results.state_results import SOLVED
from softmark.records import dataclass

Until = Literal["failure", "inaccuracy"]
ANSWERS = ("right", "inaccurate", "silent")
COSTLY = ("unjudged", "timed_out")  # no edge of a model: one of the truth, and one of patience
BLIND = 3  # points in a row without a truth after which a walk that looks for accuracy gives up


@dataclass(frozen=True)
class PointClass:
    """What a point turned out to be: its class, and whether the model had an answer (None: not known)."""

    word: str
    answered: bool | None

    @classmethod
    def of(cls, word: str, status: str | None = None) -> PointClass:
        """By the class; where the reference has no answer, by the model's own status."""
        if word == "unjudged":
            known = None if status is None else status in SOLVED
            return cls(word, known)
        return cls(word, word in ANSWERS)


@dataclass(frozen=True)
class Edge:
    """Where a walk has found the edges, as positions t of its ladder; 0 is the scene as it is."""

    last_right: float | None
    first_wrong: float | None
    word: str | None  # the class beyond
    last_answer: float | None
    first_silence: float | None  # the first t without an answer
    first_blind: float | None  # the first t beyond what is right that cannot be judged
    reached: float


@dataclass(frozen=True)
class Verdicts:
    """How much of a walk was judged at all; positions t of its ladder."""

    here: str  # the class of the scene as it is
    first_right: float | None  # the position nearest to the scene at which the model is right
    judged: int  # points of the walk that were judged
    blind: int  # points this side of the farthest that is right that were not


@dataclass
class Walk:
    """The state of one walk; `seen` by position, with what the scene as it is came to at 0."""

    ladder: Ladder
    until: Until
    seen: dict[float, PointClass] = field(default_factory=dict)

    def tell(self, t: float, seen: PointClass) -> None:
        """What the point at t turned out to be."""
        self.seen[t] = seen

    def wanted(self) -> float | None:
        """The next position to look at; None when all is known."""
        rung = self._outward()
        if rung is not None:
            return rung
        for a, b in self._brackets():
            between = self.ladder.between(a, b)
            if between is not None:
                return between
        return None

    def _outward(self) -> float | None:
        """The next rung that was not looked at, or None at the end of the walk."""
        if self._ends(0.0):
            return None
        for rung in self.ladder.rungs:
            if rung not in self.seen:
                return rung
            if self._ends(rung):
                return None
        return None

    def _ends(self, t: float) -> bool:
        """Whether the walk goes no farther than this position."""
        seen = self.seen[t]
        if self.until == "failure":
            return seen.answered is False
        visited = [self.seen[r].word for r in (0.0, *self.ladder.rungs) if r in self.seen and r <= t]
        blind = visited[-BLIND:] == ["unjudged"] * BLIND
        return blind or seen.word not in ("right", "unjudged")

    # ------------------------------------------------------------------ edges

    def _brackets(self) -> list[tuple[float, float]]:
        """Neighbouring positions with an edge between them: of what is right, and of what is answered."""
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
        """What the walk knows by now."""
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

    def verdicts(self) -> Verdicts:
        """What of the walk was judged by now: a point without a truth is neither right nor wrong."""
        last = self.edge().last_right
        right = [t for t, s in self.seen.items() if s.word == "right" and last is not None and t <= last]
        blind = [t for t, s in self.seen.items() if s.word == "unjudged"]
        before = sum(t < last for t in blind) if last is not None else 0
        return Verdicts(self.seen[0.0].word, min(right, default=None), len(self.seen) - len(blind), before)
