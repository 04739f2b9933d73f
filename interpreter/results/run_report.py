"""What a run gives: one report, whose parts are plain values and numpy arrays.

`Report.to_json` is the form of the contract `softmark-report/1`: SI numbers, and null with a reason beside it where
there is no value. Not-a-number never gets in: whoever makes a part refuses it, and the last door makes null of it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from softmark.interpreter.results import prompt_representation
from softmark.interpreter.results.declarations import Names
from softmark.interpreter.results.json_records import clean as clean
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT, Curve, curve_of
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.results.error_statements import StatedError
    from softmark.interpreter.results.load_results import Resultant
    from softmark.interpreter.results.reaction_results import HeldSupport, Touched

SCHEMA = "softmark-report/1"


@dataclass(frozen=True)
class Timing:
    """Seconds of several runs of the same work, compilation excluded.

    Of work that another program did, `basis` says by which clock, and `most` whether that is no more than a bound.
    """

    seconds: tuple[float, ...]
    basis: str = ""
    most: bool = False

    @property
    def median(self) -> float:
        """Of all runs."""
        ordered, middle = sorted(self.seconds), len(self.seconds) // 2
        return ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle])

    @property
    def runs(self) -> int:
        """How many there were."""
        return len(self.seconds)

    def to_json(self) -> dict[str, float | int | str]:
        """Median, least and largest, and how many; by whose clock, where it is not ours."""
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
    """Displacements (n, 3) in m of the material points (n, 3), given by their undeformed position in m.

    In a dynamic analysis `displacement` is that of the end, and `course` (t, n, 3) that of all `times` (t,) in s.
    A probe of a surface has `triangles` (k, 3) over its points.
    """

    points: NDArray[np.float64]
    displacement: NDArray[np.float64]
    times: NDArray[np.float64] | None = None
    course: NDArray[np.float64] | None = None
    triangles: NDArray[np.int64] | None = None

    def __repr__(self) -> str:
        return prompt_representation.probed(self)

    @property
    def position(self) -> NDArray[np.float64]:
        """Deformed positions (n, 3), m."""
        result: NDArray[np.float64] = self.points + self.displacement
        return result

    def to_json(self) -> dict[str, Any]:
        """As nested lists; the displacements of all times where there are several."""
        own: dict[str, Any] = {"points": self.points.tolist()}
        if self.course is not None and self.times is not None:
            return {**own, "displacement": self.course.tolist(), "times": self.times.tolist()}
        own["displacement"] = self.displacement.tolist()
        return own if self.triangles is None else {**own, "triangles": self.triangles.tolist()}


@dataclass(frozen=True)
class CarriedNumber:
    """A number of the stress, strain or contact of a model that metrics of a scene ask for, at points of its surface.

    `values` (n,) in `unit`, of the last moment; None with the `reason` where the model has none. `size` is what tensors
    of the body come to, `apart` the share of the points around which cells do not agree (W387), `limitless` what of the
    surface has no limit (W388). It is known `partly` where it is nothing on all of the surface but a part.
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
class SeenInstrument:
    """The surface of a rigid body beside one that deforms, where it is declared: X (n, 3) m, `triangles` (k, 3).

    At each moment or state it is at turns[i] X + shifts[i]: `turns` (t, 3, 3) and `shifts` (t, 3), m; one of each where
    nothing moves.
    """

    name: str
    X: NDArray[np.float64]
    triangles: NDArray[np.int64]
    turns: NDArray[np.float64]
    shifts: NDArray[np.float64]

    def at(self, i: int) -> NDArray[np.float64]:
        """Where its points are (n, 3) at a moment, m; -1 is the last."""
        found: NDArray[np.float64] = self.X @ self.turns[i].T + self.shifts[i]
        return found

    def sampled(self, chosen: NDArray[np.int64]) -> SeenInstrument:
        """At some of its moments."""
        return replace(self, turns=self.turns[chosen], shifts=self.shifts[chosen])


@dataclass(frozen=True)
class SeenSurface:
    """The surface of a body as a model or a reference sees it: what the report draws.

    `position` (n, 3) in m, after deformation; `triangles` (k, 3), outward. `frames` (t, n, 3) and `times` (t,) where
    there is a history, or several states. `error` (n,) is the distance to what is `measured_from`, in m; `carried` what
    else is known there, of models of a scene that asks for stress. `instruments` are the rigid bodies beside it, each
    at the same moments or states, or at rest.
    """

    position: NDArray[np.float64]
    triangles: NDArray[np.int64]
    times: NDArray[np.float64] | None = None
    frames: NDArray[np.float64] | None = None
    error: NDArray[np.float64] | None = None
    measured_from: str | None = None
    carried: tuple[CarriedNumber, ...] = ()
    labels: tuple[str, ...] = ()  # of frames that are states and no moments; `times` then counts them
    instruments: tuple[SeenInstrument, ...] = ()


@dataclass(frozen=True)
class SeenCurve:
    """A curve that the report draws: y (n,) at x (n,), SI, in these units; of a reference with its uncertainty (n,).

    `band` (n,) each, of one that is not as uncertain on both sides: from where to where it goes. `known` (n,) is what
    it is held against at the same x, where that is no curve by itself.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    units: tuple[str, str]
    uncertainty: NDArray[np.float64] | None = None
    band: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    known: NDArray[np.float64] | None = None

    def __repr__(self) -> str:
        return prompt_representation.drawn(self)

    def to_json(self) -> dict[str, Any]:
        """As lists."""
        own = {"x": self.x.tolist(), "y": self.y.tolist(), "units": list(self.units)}
        own |= {} if self.uncertainty is None else {"uncertainty": self.uncertainty.tolist()}
        own |= {} if self.known is None else {"known": self.known.tolist()}
        return own if self.band is None else {**own, "low": self.band[0].tolist(), "high": self.band[1].tolist()}


@dataclass(frozen=True)
class MetricResult:
    """A number in SI, or None with the reason why there is none.

    `details` are further numbers and words that belong to it (SI); `samples` the values whose mean it is, for a
    histogram; `uncertainty` that of the reference, in the metric's own unit: a value below it says no more than that
    the two agree. `published` is what the scene says that others found.
    """

    value: float | None
    unit: str
    reason: str | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    samples: tuple[float, ...] = ()
    uncertainty: float | None = None
    published: float | None = None
    curve: SeenCurve | None = None
    doubt: str | None = None  # why what it is of, or measured from, may be no truth here
    states: tuple[float | None, ...] = ()  # its values in all states of the analysis; `value` is that of the last

    def __repr__(self) -> str:
        return prompt_representation.measured(self)

    @property
    def meaningful(self) -> bool:
        """Whether the value is above the uncertainty of what it is measured from."""
        return self.value is None or self.uncertainty is None or abs(self.value) > self.uncertainty

    def to_json(self) -> dict[str, Any]:
        """value and unit, and the reason where there is no value."""
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
    """What a model is, but for how fine it is and its Poisson's ratio: those of one kind are of one family."""

    words: str  # `tet4, corotational strain`
    size: str  # `7 mm`, or how many parts it has
    nu: float | None  # Poisson's ratio; None for the scene's own


@dataclass(frozen=True)
class ModelResult:
    """A model's outcome; probes and metrics are empty of numbers unless it converged."""

    name: str
    status: str  # converged | capped | read | not_converged | diverged | failed | skipped | unsupported
    message: str | None
    outline: str
    size: Mapping[str, int] = field(default_factory=dict)
    solve: Mapping[str, Any] = field(default_factory=dict)
    time: Mapping[str, Timing | None] = field(default_factory=dict)
    probes: Mapping[str, ProbeResult] = field(default_factory=dict)
    metrics: Mapping[str, MetricResult] = field(default_factory=dict)
    shape: SeenSurface | None = None
    mesh: Any = None  # the mesh and its nodal displacements, for files that other programs read
    stated: Mapping[str, StatedError] = field(default_factory=dict)  # errors, where it was asked
    loads: Mapping[str, Resultant] = field(default_factory=dict)  # what acts, and what was asked
    reactions: Mapping[str, HeldSupport] = field(default_factory=dict)  # of each support
    contacts: Mapping[str, Touched] = field(default_factory=dict)  # what each comes to
    kind: ModelKind | None = None  # of one that has others of its kind
    stress: Any = None  # where a scene asks for it: what gives the stresses of the mesh, for files
    constants: Any = None  # where they vary in space: what gives those of the cells of the mesh by name, SI, for files
    states: tuple[float, ...] = ()  # of an analysis with several: their values, and
    each: tuple[ModelResult, ...] = ()  # what came of it in each; the rest is that of the last (`state_results.py`)
    kept: str = ""  # when it was computed (UTC), of one that was taken over from an earlier run

    def __repr__(self) -> str:
        return prompt_representation.outcome(self)

    def curve(self, metric: str) -> Curve:
        """A metric from state to state. Raises KeyError for one that it does not have."""
        return curve_of(self.each, self.states, metric)

    @property
    def inverted(self) -> int:
        """Number of cells that the solution inverts, in the worst of its states."""
        own = int((self.solve.get("checks") or {}).get("inverted") or 0) if self.status in ANSWERED else 0
        return max((own, *(state.inverted for state in self.each)))

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of a model."""
        own: dict[str, Any] = {
            "status": self.status,
            "message": self.message,
            "outline": self.outline,
            "size": dict(self.size),
            "solve": dict(self.solve),
            "time": {n: _timing(n, t, self.status) for n, t in self.time.items()},
            "probes": {n: p.to_json() for n, p in self.probes.items()},
            "metrics": _measured(self.metrics, self.states),
            "loads": {n: r.to_json() for n, r in self.loads.items()},
        }
        own |= {"reactions": clean(self.reactions)} if self.reactions else {}
        own |= {"contacts": clean(self.contacts)} if self.contacts else {}
        own |= {"stated": clean(self.stated)} if self.stated else {}
        own |= {"kept": self.kept} if self.kept else {}
        own |= {"inverted": self.inverted} if self.inverted else {}
        return own | _in_each(self.states, self.each)


def _measured(metrics: Mapping[str, MetricResult], states: Sequence[float]) -> dict[str, Any]:
    """The entries of metrics, each with its value in every state."""
    found = {name: metric.to_json() for name, metric in metrics.items()}
    for name, metric in metrics.items():
        if metric.states:
            pairs = zip(states, metric.states, strict=True)
            found[name]["states"] = [{"state": state, "value": value} for state, value in pairs]
    return found


def _in_each(states: tuple[float, ...], each: Sequence[Any]) -> dict[str, Any]:
    """The entries of every state, with its value; none of a result in one situation."""
    found = [{"state": value, **own.to_json()} for value, own in zip(states, each, strict=True)]
    return {"states": found} if found else {}


def _timing(name: str, timing: Timing | None, status: str) -> dict[str, Any]:
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
    """A reference's solution, with an estimate of its own error in m."""

    name: str
    status: str  # converged | failed
    message: str | None
    kind: str
    source: str
    estimated_error: float | None = None
    probes: Mapping[str, ProbeResult] = field(default_factory=dict)
    metrics: Mapping[str, MetricResult] = field(default_factory=dict)
    shape: SeenSurface | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)  # where measured data came from, how it was registered
    drawn: SeenCurve | None = None  # one that was measured
    states: tuple[float, ...] = ()  # of an analysis with several: their values, and
    each: tuple[ReferenceResult, ...] = ()  # what came of it in each; the rest is that of the last
    means: str = ""  # of a theory: by what it was solved
    kept: str = ""  # when it was found (UTC), of one that was taken over from an earlier run

    def __repr__(self) -> str:
        return prompt_representation.outcome(self)

    @property
    def about(self) -> str:
        """Its kind, and by what it was solved."""
        return f"{self.kind}, {self.means}" if self.means else self.kind

    def curve(self, metric: str) -> Curve:
        """A metric from state to state. Raises KeyError for one that it does not have."""
        return curve_of(self.each, self.states, metric)

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of a reference."""
        return {
            "status": self.status,
            "message": self.message,
            "kind": "code" if self.kind == "one code" else self.kind,
            **({"means": self.means} if self.means else {}),
            "source": self.source,
            "estimated_error": self.estimated_error,
            "facts": dict(self.facts),
            "probes": {n: p.to_json() for n, p in self.probes.items()},
            "metrics": _measured(self.metrics, self.states),
            **({} if self.drawn is None else {"curve": self.drawn.to_json()}),
            **({"kept": self.kept} if self.kept else {}),
            **_in_each(self.states, self.each),
        }


@dataclass(frozen=True)
class ExpectationResult:
    """Whether an expectation was met; None, with a reason, where it could not be judged.

    `value` is that of its first operand; it is compared with each of `limits`, in the same unit, by one of `relations`.
    """

    text: str
    line: int
    passed: bool | None
    value: float | None
    unit: str = ""
    reason: str | None = None
    left_out: bool = False  # what it is about was not chosen to run
    states: tuple[bool | None, ...] = ()  # whether it is met in each, of one that is asked of all states
    about: tuple[tuple[str, str], ...] = ()  # (model or reference, metric) that it names
    relations: tuple[str, ...] = ()
    limits: tuple[float, ...] = ()

    @property
    def metric(self) -> str:
        """`rod.eta`, the first that it names."""
        return ".".join(self.about[0]) if self.about else ""

    @property
    def verdict(self) -> str:
        """`met`, `not_met`, or `cannot_tell`."""
        return "cannot_tell" if self.passed is None else "met" if self.passed else "not_met"

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of an expectation."""
        own = {"text": self.text, "line": self.line, "passed": self.passed, "value": self.value}
        own |= {"verdict": self.verdict, "unit": self.unit or None}
        own |= {"states": list(self.states)} if self.states else {}
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
    names: Names = field(default_factory=Names)

    def __repr__(self) -> str:
        return prompt_representation.told(self)

    @property
    def outcomes(self) -> tuple[ModelResult | ReferenceResult, ...]:
        """Models, then references."""
        return (*self.models.values(), *self.references.values())

    @property
    def failures(self) -> tuple[ModelResult | ReferenceResult, ...]:
        """Those of them that were tried and gave no answer."""
        return tuple(o for o in self.outcomes if o.status not in (*ANSWERED, *LEFT_OUT))

    @property
    def exit_status(self) -> int:
        """3 where a model or reference failed, else 1 where an expectation was not met or not judged, else 0.

        It is 1 also where cells of a solution are inside out. Expectations about models that were not chosen to run do
        not count.
        """
        if self.failures:
            return 3
        if any(model.inverted for model in self.models.values()):
            return 1
        return 1 if any(not e.passed and not e.left_out for e in self.expectations) else 0

    def to_json(self) -> dict[str, Any]:
        """The report as the contract has it: only JSON's own types, no NaN, no infinity."""
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
        plain: dict[str, Any] = clean(own)
        return plain

    def dumps(self) -> str:
        """The JSON text."""
        return json.dumps(self.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
