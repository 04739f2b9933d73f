"""Report of a run, whose parts are plain values and numpy arrays.

`Report.to_json` has the form of the contract `softmark-report/1`: SI numbers, and null with a reason where there is no
value. NaN is refused when a part is made; any NaN that is left is written as null.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from softmark.interpreter.results import prompt_representation
from softmark.interpreter.results.declarations import DeclaredNames
from softmark.interpreter.results.json_records import to_plain_json as to_plain_json
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT, Curve, curve_of
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.results.error_statements import StatedError
    from softmark.interpreter.results.load_results import Resultant
    from softmark.interpreter.results.reaction_results import ContactResult, SupportResult

SCHEMA = "softmark-report/1"


@dataclass(frozen=True)
class Timing:
    """Computing times of several runs of the same work, s, without compilation.

    For work of an external program, `basis` names the clock, and `most` is true if the time is only an upper bound.
    """

    seconds: tuple[float, ...]
    basis: str = ""
    most: bool = False

    @property
    def median(self) -> float:
        """Median time of all runs, s."""
        ordered, middle = sorted(self.seconds), len(self.seconds) // 2
        return ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle])

    @property
    def runs(self) -> int:
        """Number of timed runs."""
        return len(self.seconds)

    def to_json(self) -> dict[str, float | int | str]:
        """Return median, minimum, maximum and number of runs, and the clock of an external program."""
        own: dict[str, float | int | str] = {
            "median": self.median,
            "min": min(self.seconds),
            "max": max(self.seconds),
            "runs": self.runs,
        }
        if self.basis:
            own |= {"basis": self.basis, "upper_bound": self.most}
        return own


@dataclass(frozen=True)
class ProbeResult:
    """Displacements (n, 3), m, at material points (n, 3), which are given by their undeformed positions, m.

    In a dynamic analysis `displacement` is that at the end, and `course` (t, n, 3) that at all `times` (t,), s. A probe
    of a surface has `triangles` (k, 3) over its points.
    """

    points: NDArray[np.float64]
    displacement: NDArray[np.float64]
    times: NDArray[np.float64] | None = None
    course: NDArray[np.float64] | None = None
    triangles: NDArray[np.int64] | None = None

    def __repr__(self) -> str:
        return prompt_representation.represent_probe(self)

    @property
    def position(self) -> NDArray[np.float64]:
        """Deformed positions (n, 3), m."""
        result: NDArray[np.float64] = self.points + self.displacement
        return result

    def to_json(self) -> dict[str, Any]:
        """Return the arrays as nested lists, with the displacements of all times if there are several."""
        own: dict[str, Any] = {"points": self.points.tolist()}
        if self.course is not None and self.times is not None:
            return {**own, "displacement": self.course.tolist(), "times": self.times.tolist()}
        own["displacement"] = self.displacement.tolist()
        return own if self.triangles is None else {**own, "triangles": self.triangles.tolist()}


@dataclass(frozen=True)
class RequestedSurfaceValues:
    """Scalar field of stress, strain or contact on a model's drawn surface, requested by a metric.

    `values` (n,) in `unit` are the values at the surface points at the last time, or None with the `reason`. `size` is
    the typical magnitude of the tensor in the body. `apart` is the fraction of points around which cells disagree
    (W387). `limitless` describes the place of a singularity, where values do not converge (W388). `partly` is true if
    the field is nonzero only on a part of the surface.
    """

    words: str  # `stress xx, cauchy`
    unit: str
    metrics: tuple[str, ...]
    values: NDArray[np.float64] | None = None
    reason: str | None = None
    size: float = 0.0
    apart: float = 0.0
    limitless: str | None = None
    partly: bool = False


@dataclass(frozen=True)
class DrawnRigidBody:
    """Surface of a rigid body next to a deformable one: declared points X (n, 3), m, and `triangles` (k, 3).

    The points at time or state i are turns[i] X + shifts[i], with rotations `turns` (t, 3, 3) and translations `shifts`
    (t, 3), m; t is 1 if the body does not move.
    """

    name: str
    X: NDArray[np.float64]
    triangles: NDArray[np.int64]
    turns: NDArray[np.float64]
    shifts: NDArray[np.float64]

    def at(self, i: int) -> NDArray[np.float64]:
        """Return the positions of the points (n, 3), m, at time or state i; -1 is the last."""
        found: NDArray[np.float64] = self.X @ self.turns[i].T + self.shifts[i]
        return found

    def sampled(self, chosen: NDArray[np.int64]) -> DrawnRigidBody:
        """Return the rigid body with the chosen times or states only."""
        return replace(self, turns=self.turns[chosen], shifts=self.shifts[chosen])


@dataclass(frozen=True)
class DrawnSurface:
    """Deformed surface of a body in a model or a reference, as the report draws it.

    `position` (n, 3), m, are the deformed points; `triangles` (k, 3) have normals outward. `frames` (t, n, 3), m, and
    `times` (t,), s, are given if there is a history or several states. `error` (n,), m, is the distance to the
    reference `measured_from`. `carried` are the stress, strain and contact fields that the scene asks for.
    `instruments` are the rigid bodies next to the body, at the same times or states, or at rest.
    """

    position: NDArray[np.float64]
    triangles: NDArray[np.int64]
    times: NDArray[np.float64] | None = None
    frames: NDArray[np.float64] | None = None
    error: NDArray[np.float64] | None = None
    measured_from: str | None = None
    carried: tuple[RequestedSurfaceValues, ...] = ()
    labels: tuple[str, ...] = ()  # true if frames are states, not times; `times` then numbers them
    instruments: tuple[DrawnRigidBody, ...] = ()


@dataclass(frozen=True)
class PlottedCurve:
    """Curve that the report plots: y (n,) over x (n,), in SI; a reference also has its uncertainty (n,).

    `band` has lower and upper limits (n,) if the uncertainty is not symmetric. `known` (n,) are reference values at the
    same x, if the reference itself is not a curve.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    units: tuple[str, str]
    uncertainty: NDArray[np.float64] | None = None
    band: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    known: NDArray[np.float64] | None = None

    def __repr__(self) -> str:
        return prompt_representation.represent_curve(self)

    def to_json(self) -> dict[str, Any]:
        """Return the arrays as nested lists."""
        own = {"x": self.x.tolist(), "y": self.y.tolist(), "units": list(self.units)}
        own |= {} if self.uncertainty is None else {"uncertainty": self.uncertainty.tolist()}
        own |= {} if self.known is None else {"known": self.known.tolist()}
        return own if self.band is None else {**own, "low": self.band[0].tolist(), "high": self.band[1].tolist()}


@dataclass(frozen=True)
class MetricResult:
    """Value of a metric in SI, or None with the reason why there is none.

    `details` are further numbers and words (SI). `samples` are the values whose mean is the metric, for a histogram.
    `uncertainty` is that of the reference, in the metric's unit: an error below it only shows agreement. `published`
    are values of other authors that the scene quotes.
    """

    value: float | None
    unit: str
    reason: str | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    samples: tuple[float, ...] = ()
    uncertainty: float | None = None
    published: float | None = None
    curve: PlottedCurve | None = None
    doubt: str | None = None  # why its reference may be invalid here
    states: tuple[float | None, ...] = ()  # its results in all states; `value` is that of the last

    def __repr__(self) -> str:
        return prompt_representation.represent_metric(self)

    @property
    def meaningful(self) -> bool:
        """True if the value exceeds the uncertainty of its reference."""
        return self.value is None or self.uncertainty is None or abs(self.value) > self.uncertainty

    def to_json(self) -> dict[str, Any]:
        """Return value and unit, and the reason if there is no value."""
        own: dict[str, Any] = {"value": self.value, "unit": self.unit}
        if self.reason is not None:
            own["reason"] = self.reason
        if self.uncertainty is not None:
            own |= {"uncertainty": self.uncertainty, "meaningful": self.meaningful}
        if self.published is not None:
            own["published"] = self.published
        own |= {} if self.curve is None else {"curve": self.curve.to_json()}
        own |= {} if self.doubt is None else {"doubt": self.doubt}
        return {**own, **self.details}


@dataclass(frozen=True)
class ModelKind:
    """Family of models: all properties of a model except its mesh size and Poisson's ratio."""

    words: str  # `tet4, corotational strain`
    size: str  # `7 mm`, or how many parts it has
    nu: float | None  # Poisson's ratio; None for the scene's own


@dataclass(frozen=True)
class ModelResult:
    """Result of a model; its probes and metrics have numbers only if the model converged."""

    name: str
    status: str  # converged | capped | read | not_converged | diverged | failed | skipped | unsupported
    message: str | None
    outline: str
    size: Mapping[str, int] = field(default_factory=dict)
    solve: Mapping[str, Any] = field(default_factory=dict)
    time: Mapping[str, Timing | None] = field(default_factory=dict)
    probes: Mapping[str, ProbeResult] = field(default_factory=dict)
    metrics: Mapping[str, MetricResult] = field(default_factory=dict)
    shape: DrawnSurface | None = None
    mesh: Any = None  # the mesh and its nodal displacements, for files that other programs read
    stated: Mapping[str, StatedError] = field(default_factory=dict)  # stated errors, if requested
    loads: Mapping[str, Resultant] = field(default_factory=dict)  # resultants of the loads, and the requested ones
    reactions: Mapping[str, SupportResult] = field(default_factory=dict)  # results of each support
    contacts: Mapping[str, ContactResult] = field(default_factory=dict)  # results of each contact
    kind: ModelKind | None = None  # family of the model, if there are others of its kind
    stress: Any = None  # stress of the mesh for output files, if the scene asks for it
    constants: Any = None  # constants that vary in space, by name, at the cells, SI, for output files
    states: tuple[float, ...] = ()  # values of several states, and
    each: tuple[ModelResult, ...] = ()  # the result in each; other fields are those of the last (`state_results.py`)
    kept: str = ""  # time of computation (UTC), if reused from an earlier run

    def __repr__(self) -> str:
        return prompt_representation.represent_outcome(self)

    def curve(self, metric: str) -> Curve:
        """Return the values of a metric over the states. Raises KeyError if the model does not have the metric."""
        return curve_of(self.each, self.states, metric)

    @property
    def inverted(self) -> int:
        """Number of inverted cells in the worst state."""
        own = int((self.solve.get("checks") or {}).get("inverted") or 0) if self.status in ANSWERED else 0
        return max((own, *(state.inverted for state in self.each)))

    def to_json(self) -> dict[str, Any]:
        """Return the JSON entry of the model, as the contract `softmark-report/1` defines it."""
        own: dict[str, Any] = {
            "status": self.status,
            "message": self.message,
            "outline": self.outline,
            "size": dict(self.size),
            "solve": dict(self.solve),
            "time": {n: _timing_entry(n, t, self.status) for n, t in self.time.items()},
            "probes": {n: p.to_json() for n, p in self.probes.items()},
            "metrics": _metric_entries(self.metrics, self.states),
            "loads": {n: r.to_json() for n, r in self.loads.items()},
        }
        own |= {"reactions": to_plain_json(self.reactions)} if self.reactions else {}
        own |= {"contacts": to_plain_json(self.contacts)} if self.contacts else {}
        own |= {"stated": to_plain_json(self.stated)} if self.stated else {}
        own |= {"kept": self.kept} if self.kept else {}
        own |= {"inverted": self.inverted} if self.inverted else {}
        return own | _state_entries(self.states, self.each)


def _metric_entries(metrics: Mapping[str, MetricResult], states: Sequence[float]) -> dict[str, Any]:
    """Return the JSON entries of metrics, each with its value in every state."""
    found = {name: metric.to_json() for name, metric in metrics.items()}
    for name, metric in metrics.items():
        if metric.states:
            pairs = zip(states, metric.states, strict=True)
            found[name]["states"] = [{"state": state, "value": value} for state, value in pairs]
    return found


def _state_entries(states: tuple[float, ...], each: Sequence[Any]) -> dict[str, Any]:
    """Return the JSON entry of the results in every state; empty for a result without states."""
    found = [{"state": value, **own.to_json()} for value, own in zip(states, each, strict=True)]
    return {"states": found} if found else {}


def _timing_entry(name: str, timing: Timing | None, status: str) -> dict[str, Any]:
    if timing is None:
        reason = "a static analysis has no time steps" if name == "step_s" else "it did not finish"
        reason = "nothing was solved here" if status == "read" else reason
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
    """Result of a reference, with an estimate of its own error, m."""

    name: str
    status: str  # converged | failed
    message: str | None
    kind: str
    source: str
    estimated_error: float | None = None
    probes: Mapping[str, ProbeResult] = field(default_factory=dict)
    metrics: Mapping[str, MetricResult] = field(default_factory=dict)
    shape: DrawnSurface | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)  # where measured data came from, how it was registered
    drawn: PlottedCurve | None = None  # one that was measured
    states: tuple[float, ...] = ()  # values of several states, and
    each: tuple[ReferenceResult, ...] = ()  # the result in each; other fields are those of the last
    means: str = ""  # solution method of a theory
    kept: str = ""  # time of computation (UTC), if reused from an earlier run

    def __repr__(self) -> str:
        return prompt_representation.represent_outcome(self)

    @property
    def about(self) -> str:
        """Description of the reference: its kind and its solution method."""
        return f"{self.kind}, {self.means}" if self.means else self.kind

    def curve(self, metric: str) -> Curve:
        """Return the values of a metric over the states. Raises KeyError if the reference does not have the metric."""
        return curve_of(self.each, self.states, metric)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON entry of the reference, as the contract `softmark-report/1` defines it."""
        return {
            "status": self.status,
            "message": self.message,
            "kind": "code" if self.kind == "one code" else self.kind,
            **({"means": self.means} if self.means else {}),
            "source": self.source,
            "estimated_error": self.estimated_error,
            "facts": dict(self.facts),
            "probes": {n: p.to_json() for n, p in self.probes.items()},
            "metrics": _metric_entries(self.metrics, self.states),
            **({} if self.drawn is None else {"curve": self.drawn.to_json()}),
            **({"kept": self.kept} if self.kept else {}),
            **_state_entries(self.states, self.each),
        }


@dataclass(frozen=True)
class ExpectationResult:
    """Verdict on an expectation; None, with a reason, if it could not be judged.

    `value` is the value of its first operand. It is compared with each of `limits`, in the same unit, by the relation
    of the same index in `relations`.
    """

    text: str
    line: int
    passed: bool | None
    value: float | None
    unit: str = ""
    reason: str | None = None
    left_out: bool = False  # its model was not selected
    states: tuple[bool | None, ...] = ()  # verdict in each state, if it concerns all
    about: tuple[tuple[str, str], ...] = ()  # (model or reference, metric) that it names
    relations: tuple[str, ...] = ()
    limits: tuple[float, ...] = ()

    @property
    def metric(self) -> str:
        """First metric in the expectation, such as `rod.eta`."""
        return ".".join(self.about[0]) if self.about else ""

    @property
    def verdict(self) -> str:
        """Verdict as a word: `met`, `not_met`, or `cannot_tell`."""
        return "cannot_tell" if self.passed is None else "met" if self.passed else "not_met"

    def to_json(self) -> dict[str, Any]:
        """Return the JSON entry of the expectation, as the contract `softmark-report/1` defines it."""
        own = {"text": self.text, "line": self.line, "passed": self.passed, "value": self.value}
        own |= {"verdict": self.verdict, "unit": self.unit or None}
        own |= {"states": list(self.states)} if self.states else {}
        return own if self.reason is None else {**own, "reason": self.reason}


@dataclass(frozen=True)
class ReportWarning:
    """Warning about the scene or about the treatment of the scene by a model."""

    code: str
    message: str
    line: int | None
    help: str = ""


@dataclass(frozen=True)
class Report:
    """Results of one run of a scene; `partial` is true while models are still running, or after an interruption."""

    scene: Mapping[str, Any]  # title, file, sha256, parameters, text
    environment: Mapping[str, Any]
    models: Mapping[str, ModelResult]
    references: Mapping[str, ReferenceResult]
    expectations: tuple[ExpectationResult, ...]
    warnings: tuple[ReportWarning, ...]
    partial: bool = False
    names: DeclaredNames = field(default_factory=DeclaredNames)

    def __repr__(self) -> str:
        return prompt_representation.represent_report(self)

    @property
    def outcomes(self) -> tuple[ModelResult | ReferenceResult, ...]:
        """Results of all models, followed by those of all references."""
        return (*self.models.values(), *self.references.values())

    @property
    def failures(self) -> tuple[ModelResult | ReferenceResult, ...]:
        """Results of the models and references that were solved without success."""
        return tuple(o for o in self.outcomes if o.status not in (*ANSWERED, *LEFT_OUT))

    @property
    def exit_status(self) -> int:
        """Exit status: 3 if a model or reference failed, else 1 if an expectation was not met or not judged, else 0.

        It is also 1 if cells of a solution are inverted. Expectations about models that were not selected do not count.
        """
        if self.failures:
            return 3
        if any(model.inverted for model in self.models.values()):
            return 1
        return 1 if any(not e.passed and not e.left_out for e in self.expectations) else 0

    def to_json(self) -> dict[str, Any]:
        """Return the report in the form of the contract `softmark-report/1`: only JSON types, no NaN or infinity."""
        own = {
            "schema": SCHEMA,
            "partial": self.partial,
            "scene": dict(self.scene),
            "environment": dict(self.environment),
            "models": {n: m.to_json() for n, m in self.models.items()},
            "references": {n: r.to_json() for n, r in self.references.items()},
            "expectations": [e.to_json() for e in self.expectations],
            "warnings": [{"code": w.code, "message": w.message, "line": w.line} for w in self.warnings],
        }
        plain: dict[str, Any] = to_plain_json(own)
        return plain

    def dumps(self) -> str:
        """Return the report as JSON text."""
        return json.dumps(self.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
