"""What a run gives: one report, whose parts are plain values and numpy arrays.

`Report.to_json` is the form of the contract `softmark-report/1`: SI numbers, and null with a reason beside it where
there is no value. Not-a-number never gets in: whoever makes a part refuses it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SCHEMA = "softmark-report/1"


@dataclass(frozen=True)
class Timing:
    """Seconds of several runs of the same work, compilation excluded."""

    seconds: tuple[float, ...]

    def to_json(self) -> dict[str, float | int]:
        """Median, least and largest, and how many."""
        ordered = sorted(self.seconds)
        middle = len(ordered) // 2
        median = ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle])
        return {"median": median, "min": ordered[0], "max": ordered[-1], "runs": len(ordered)}


@dataclass(frozen=True)
class ProbeResult:
    """Displacements (n, 3) in m of the material points (n, 3), given by their undeformed position in m."""

    points: NDArray[np.float64]
    displacement: NDArray[np.float64]

    @property
    def position(self) -> NDArray[np.float64]:
        """Deformed positions (n, 3), m."""
        result: NDArray[np.float64] = self.points + self.displacement
        return result

    def to_json(self) -> dict[str, Any]:
        """As nested lists."""
        return {"points": self.points.tolist(), "displacement": self.displacement.tolist()}


@dataclass(frozen=True)
class MetricResult:
    """A number in SI, or None with the reason why there is none."""

    value: float | None
    unit: str
    reason: str | None = None

    def to_json(self) -> dict[str, Any]:
        """value and unit, and the reason where there is no value."""
        own = {"value": self.value, "unit": self.unit}
        return own if self.reason is None else {**own, "reason": self.reason}


@dataclass(frozen=True)
class ModelResult:
    """A model's outcome; probes and metrics are empty of numbers unless it converged."""

    name: str
    status: str  # converged | not_converged | diverged | failed | skipped
    message: str | None
    outline: str
    size: Mapping[str, int] = field(default_factory=dict)
    solve: Mapping[str, Any] = field(default_factory=dict)
    time: Mapping[str, Timing | None] = field(default_factory=dict)
    probes: Mapping[str, ProbeResult] = field(default_factory=dict)
    metrics: Mapping[str, MetricResult] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of a model."""
        return {
            "status": self.status,
            "message": self.message,
            "outline": self.outline,
            "size": dict(self.size),
            "solve": dict(self.solve),
            "time": {n: _timing(n, t) for n, t in self.time.items()},
            "probes": {n: p.to_json() for n, p in self.probes.items()},
            "metrics": {n: m.to_json() for n, m in self.metrics.items()},
        }


def _timing(name: str, timing: Timing | None) -> dict[str, Any]:
    if timing is None:
        reason = "a static analysis has no time steps" if name == "step_s" else "it did not finish"
        return {
            "median": None,
            "min": None,
            "max": None,
            "runs": 0,
            "reason": reason,
        }
    return dict(timing.to_json())


@dataclass(frozen=True)
class ReferenceResult:
    """A reference's solution, with an estimate of its own error in m."""

    name: str
    status: str  # converged | failed
    message: str | None
    kind: str
    source: str
    estimated_error: float | None = None
    probes: Mapping[str, ProbeResult] = field(default_factory=dict)
    metrics: Mapping[str, MetricResult] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of a reference."""
        return {
            "status": self.status,
            "message": self.message,
            "kind": self.kind,
            "source": self.source,
            "estimated_error": self.estimated_error,
            "probes": {n: p.to_json() for n, p in self.probes.items()},
            "metrics": {n: m.to_json() for n, m in self.metrics.items()},
        }


@dataclass(frozen=True)
class ExpectationResult:
    """Whether an expectation was met; None, with a reason, where it could not be judged."""

    text: str
    line: int
    passed: bool | None
    value: float | None
    unit: str = ""
    reason: str | None = None
    left_out: bool = False  # what it is about was not chosen to run

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of an expectation."""
        own = {"text": self.text, "line": self.line, "passed": self.passed, "value": self.value}
        return own if self.reason is None else {**own, "reason": self.reason}


@dataclass(frozen=True)
class Warned:
    """A warning about the scene or about what a model made of it."""

    code: str
    message: str
    line: int | None
    help: str = ""


@dataclass(frozen=True)
class Report:
    """Everything about one run of one scene. `partial` while models are still to come, or after an interruption."""

    scene: Mapping[str, Any]  # title, file, sha256, parameters, text
    environment: Mapping[str, Any]
    models: Mapping[str, ModelResult]
    references: Mapping[str, ReferenceResult]
    expectations: tuple[ExpectationResult, ...]
    warnings: tuple[Warned, ...]
    partial: bool = False

    @property
    def outcomes(self) -> tuple[ModelResult | ReferenceResult, ...]:
        """Models, then references."""
        return (*self.models.values(), *self.references.values())

    @property
    def exit_status(self) -> int:
        """3 where a model or reference failed, else 1 where an expectation was not met or not judged, else 0.

        Expectations about models that were not chosen to run do not count.
        """
        if any(o.status not in ("converged", "skipped") for o in self.outcomes):
            return 3
        return 1 if any(not e.passed and not e.left_out for e in self.expectations) else 0

    def to_json(self) -> dict[str, Any]:
        """The report as the contract has it: only JSON's own types, no NaN, no infinity."""
        return {
            "schema": SCHEMA,
            "partial": self.partial,
            "scene": dict(self.scene),
            "environment": dict(self.environment),
            "models": {n: m.to_json() for n, m in self.models.items()},
            "references": {n: r.to_json() for n, r in self.references.items()},
            "expectations": [e.to_json() for e in self.expectations],
            "warnings": [{"code": w.code, "message": w.message, "line": w.line} for w in self.warnings],
        }

    def dumps(self) -> str:
        """The JSON text. Raises ValueError if a number is not finite: that would be a defect."""
        return json.dumps(self.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
