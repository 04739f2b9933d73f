"""A point that is to be computed, and what came of it: as they go to other processes and to the journal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, ClassVar

from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.json_records import Plain, by_name, several
from softmark.records import dataclass

Triples = Sequence[Sequence[float]]  # (n, 3)

SAME = 1e-9  # of the extent of a probe: points nearer than this are the same


@dataclass(frozen=True)
class TruthAsked(Plain):
    """Of a stability study: a model that is taken as right, and the metric that does so."""

    model: str
    metric: str


@dataclass(frozen=True)
class PointTask(Plain):
    """What performing one configuration needs: the text of the scene and the overrides."""

    READ: ClassVar = {"models": tuple, "overrides": tuple, "truth": TruthAsked.from_json, "plugins": tuple}
    SELDOM: ClassVar = ("limit_s", "truth", "stated", "alone", "plugins")

    key: str
    scene: str = ""  # its name
    model: str = ""
    models: tuple[str, ...] = ()  # that are computed with it
    text: str = ""
    shown: str = ""  # the name of the text in messages
    file: str | None = None
    folder: str = "."
    overrides: tuple[str, ...] = ()
    limit_s: float | None = None  # CPU s that it has at least: it may compile what others then find
    truth: TruthAsked | None = None
    stated: bool = False  # whether the model is asked what error it states
    alone: bool = False  # whether errors of other models are no affair of it
    plugins: tuple[str, ...] = ()  # that its words may be of


@dataclass(frozen=True)
class Truth(Plain):
    """What a model that is taken as right says of itself, in the terms of the metric."""

    READ: ClassVar = {"stated": StatedError.from_json}

    status: str
    message: str | None
    stated: StatedError | None


@dataclass(frozen=True)
class ProbeTrace(Plain):
    """Points of a probe (n, 3) and their displacements, m."""

    points: Triples = ()
    displacement: Triples = ()

    def alike(self, other: ProbeTrace) -> bool:
        """Whether the two have the same points, to rounding, and a displacement for each."""
        p, q = self.points, other.points
        if len({len(p), len(q), len(self.displacement), len(other.displacement)}) != 1 or not p:
            return False
        extent = max(abs(c) for point in p for c in point) or 1.0
        return all(math.dist(a, b) <= SAME * extent for a, b in zip(p, q, strict=True))


@dataclass(frozen=True)
class SolvedReference(Plain):
    """A reference: where it comes from, what it came to, with an estimate of its own error in m, and its shape."""

    READ: ClassVar = {"probes": by_name(ProbeTrace.from_json)}

    kind: str | None = None
    source: str | None = None
    status: str = "converged"  # one that says nothing of it has a solution
    message: str | None = None
    estimated_error: float | None = None
    probes: Mapping[str, ProbeTrace] = field(default_factory=dict)


class Attempt(Plain):
    """What came of a task, however much of it is kept."""

    unfinished: bool
    limit_s: float | None

    @property
    def status(self) -> str:
        """Of the point."""
        raise NotImplementedError

    def again(self, timeout: float | None) -> bool:
        """Whether it is worth another try: its process was killed, or it may have more time now."""
        late = self.status == "timed_out"
        return bool(self.unfinished) and (not late or timeout is None or timeout > (self.limit_s or 0.0))


@dataclass(frozen=True)
class PointOutcome(Attempt):
    """What came of a task: `point` is its entry in `softmark-compare/1`, and the seconds that it took.

    One that is `unfinished` was lost, or had no more than `limit_s`: another try may have a result.
    """

    READ: ClassVar = {"references": by_name(SolvedReference.from_json), "truths": by_name(Truth.from_json)}
    SELDOM: ClassVar = ("truths", "unfinished", "limit_s")

    key: str
    point: Mapping[str, Any]
    references: Mapping[str, SolvedReference] = field(default_factory=dict)
    truths: Mapping[str, Truth] | None = None
    wall_s: float | None = None
    cpu_s: float | None = None
    unfinished: bool = False
    limit_s: float | None = None

    @property
    def status(self) -> str:
        """Of the point."""
        return str(self.point["status"])


# ------------------------------------------------------------------ what of a point decides its class


@dataclass(frozen=True)
class PointError(Plain):
    """What a metric gave: an error where it measures `against` something, in `unit`; or why there is no value."""

    SELDOM: ClassVar = ("reason", "uncertainty", "by_itself")

    value: float | None = None
    unit: str | None = None
    against: str | None = None
    reason: str | None = None
    uncertainty: float | None = None  # what the reference leaves open
    by_itself: bool | None = None  # True of what displacements of no probe tell: forces, energies, frequencies


@dataclass(frozen=True)
class PointWarning(Plain):
    """A warning about a point."""

    code: str
    message: str


@dataclass(frozen=True)
class PointStated(StatedError):
    """What a model states of the first relative metric against something, and `of` all."""

    SELDOM: ClassVar = ("unit", "metric", "of")
    READ: ClassVar = {**StatedError.READ, "of": by_name(StatedError.from_json)}

    metric: str | None = None
    of: Mapping[str, StatedError] | None = None


@dataclass(frozen=True)
class PointSummary(Plain):
    """A point without its fields."""

    READ: ClassVar = {
        "errors": by_name(PointError.from_json), "warnings": several(PointWarning.from_json),
        "stated": PointStated.from_json,
    }  # fmt: skip
    SELDOM: ClassVar = ("stated",)

    status: str
    message: str | None = None
    outline: str = ""
    size: Mapping[str, int] = field(default_factory=dict)
    errors: Mapping[str, PointError] = field(default_factory=dict)
    warnings: tuple[PointWarning, ...] = ()
    stated: PointStated | None = None
