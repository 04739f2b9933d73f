"""Tasks and their outcomes, as sent to other processes and written to the journal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, ClassVar

from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.json_records import JsonRecord, list_reader, mapping_reader
from softmark.records import dataclass

Triples = Sequence[Sequence[float]]  # (n, 3)

SAME = 1e-9  # relative to the extent of a probe: closer points are equal


@dataclass(frozen=True)
class TruthRequest(JsonRecord):
    """Model that serves as the reference of a robustness study, and the metric that compares others with it."""

    model: str
    metric: str


@dataclass(frozen=True)
class PointTask(JsonRecord):
    """Task of computing one configuration: the text of a scene, a model, and the overrides."""

    READ: ClassVar = {"models": tuple, "overrides": tuple, "truth": TruthRequest.from_json, "plugins": tuple}
    SELDOM: ClassVar = ("limit_s", "truth", "stated", "alone", "plugins")

    key: str
    scene: str = ""  # its name
    model: str = ""
    models: tuple[str, ...] = ()  # models computed with it
    text: str = ""
    shown: str = ""  # the name of the text in messages
    file: str | None = None
    folder: str = "."
    overrides: tuple[str, ...] = ()
    limit_s: float | None = None  # minimum CPU s allowed: it may compile kernels for others
    truth: TruthRequest | None = None
    stated: bool = False  # whether the model must state its error
    alone: bool = False  # whether errors of other models are ignored
    plugins: tuple[str, ...] = ()  # plugins to load


@dataclass(frozen=True)
class TruthStatement(JsonRecord):
    """Error that a model used as the reference states of its own result, as a value of the study's metric."""

    READ: ClassVar = {"stated": StatedError.from_json}

    status: str
    message: str | None
    stated: StatedError | None


@dataclass(frozen=True)
class ProbeTrace(JsonRecord):
    """Points of a probe, shape (n, 3), m, and their displacements, shape (n, 3), m."""

    points: Triples = ()
    displacement: Triples = ()

    def has_same_points(self, other: ProbeTrace) -> bool:
        """Return whether two probes have the same points, up to rounding, and a displacement at each point."""
        p, q = self.points, other.points
        if len({len(p), len(q), len(self.displacement), len(other.displacement)}) != 1 or not p:
            return False
        extent = max(abs(c) for point in p for c in point) or 1.0
        return all(math.dist(a, b) <= SAME * extent for a, b in zip(p, q, strict=True))


@dataclass(frozen=True)
class SolvedReference(JsonRecord):
    """Reference with its origin, status, estimated error, m, and displacements at probes."""

    READ: ClassVar = {"probes": mapping_reader(ProbeTrace.from_json)}

    kind: str | None = None
    source: str | None = None
    status: str = "converged"  # an outcome without a status has a solution
    message: str | None = None
    estimated_error: float | None = None
    probes: Mapping[str, ProbeTrace] = field(default_factory=dict)


class TaskAttempt(JsonRecord):
    """Base class of outcomes of a task, with or without displacement fields."""

    unfinished: bool
    limit_s: float | None

    @property
    def status(self) -> str:
        """Status of the solution, such as `converged` or `timed_out`."""
        raise NotImplementedError

    def is_worth_retrying(self, timeout: float | None) -> bool:
        """Return whether the task should be tried again.

        This is the case if its process was killed, or if it ran out of time and `timeout`, s, is now longer.
        """
        late = self.status == "timed_out"
        return bool(self.unfinished) and (not late or timeout is None or timeout > (self.limit_s or 0.0))


@dataclass(frozen=True)
class PointOutcome(TaskAttempt):
    """Outcome of the task that solves one configuration; `point` is its JSON entry in `softmark-compare/1`.

    `unfinished` is true if the task was lost or reached the time limit `limit_s`, so that another try may have a
    result.
    """

    READ: ClassVar = {
        "references": mapping_reader(SolvedReference.from_json),
        "truths": mapping_reader(TruthStatement.from_json),
    }
    SELDOM: ClassVar = ("truths", "unfinished", "limit_s")

    key: str
    point: Mapping[str, Any]
    references: Mapping[str, SolvedReference] = field(default_factory=dict)
    truths: Mapping[str, TruthStatement] | None = None
    wall_s: float | None = None
    cpu_s: float | None = None
    unfinished: bool = False
    limit_s: float | None = None

    @property
    def status(self) -> str:
        """Status of the solution, such as `converged` or `timed_out`."""
        return str(self.point["status"])


# ------------------------------------------------------------------ results of a point


@dataclass(frozen=True)
class PointError(JsonRecord):
    """Result of a metric in `unit`, or the reason why there is no value.

    If `against` names a reference, the result is an error.
    """

    SELDOM: ClassVar = ("reason", "uncertainty", "by_itself")

    value: float | None = None
    unit: str | None = None
    against: str | None = None
    reason: str | None = None
    uncertainty: float | None = None  # uncertainty of the reference
    by_itself: bool | None = None  # True if no probe's displacements determine it: forces, energies, frequencies


@dataclass(frozen=True)
class PointWarning(JsonRecord):
    """Warning about the solution of one configuration."""

    code: str
    message: str


@dataclass(frozen=True)
class PointStatedErrors(StatedError):
    """Error that a model states of the first relative error metric, and of all metrics.

    `metric` is the name of that metric; `of` has the stated errors of all metrics.
    """

    SELDOM: ClassVar = ("unit", "metric", "of")
    READ: ClassVar = {**StatedError.READ, "of": mapping_reader(StatedError.from_json)}

    metric: str | None = None
    of: Mapping[str, StatedError] | None = None


@dataclass(frozen=True)
class PointSummary(JsonRecord):
    """Results of one configuration without displacement fields."""

    READ: ClassVar = {
        "errors": mapping_reader(PointError.from_json), "warnings": list_reader(PointWarning.from_json),
        "stated": PointStatedErrors.from_json,
    }  # fmt: skip
    SELDOM: ClassVar = ("stated",)

    status: str
    message: str | None = None
    outline: str = ""
    size: Mapping[str, int] = field(default_factory=dict)
    errors: Mapping[str, PointError] = field(default_factory=dict)
    warnings: tuple[PointWarning, ...] = ()
    stated: PointStatedErrors | None = None
