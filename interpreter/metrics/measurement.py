"""What a metric may look at, and what it gives: its number with whatever belongs to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.metrics.curve_geometry import Course, Curve
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.problem.probe_domains import ProbeDomain
    from softmark.interpreter.results.motion_history import History
    from softmark.interpreter.results.reaction_results import AtRest
    from softmark.interpreter.results.run_report import Timing
    from softmark.references.measured_data import MeasuredSurface
    from softmark.references.published_values import KnownValue
    from softmark.solvers.stress_recovery.stress_field import Stresses

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]
    Field = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Known:
    """What a metric is measured against: a field of displacements, or a measured surface."""

    name: str
    u: Floats | None = None  # (n, 3) m at the points of the metric's probe
    displacement: Field | None = None  # (n, 3) -> (n, 3), of any material point
    surface: MeasuredSurface | None = None
    uncertainty: float = 0.0  # m
    times: Floats | None = None  # (t,) s, and
    course: Floats | None = None  # (t, n, 3) m at the points of the probe, of a model with a history
    at_rest: AtRest | None = None  # of a model
    curve: Curve | None = None  # that was measured
    stress: Callable[[], Stresses] | None = None  # of a model on a mesh; it raises NoStress
    value: KnownValue | None = None  # that was given


@dataclass(frozen=True)
class Seen:
    """One model or reference, as a metric sees it.

    X, u: material points (n, 3) of the metric's probe and their displacements (n, 3), m, empty without a probe.
    `triangles` (k, 3) over X for a probe of a surface; `weights` (n,) for a probe of a volume, m^3.
    """

    owner: str
    case: Case
    X: Floats
    u: Floats
    triangles: Ints | None = None
    weights: Floats | None = None
    known: Known | None = None
    displacement: Field | None = None
    clock: Mapping[str, Timing | None] = field(default_factory=dict)
    history: History | None = None
    solve: Mapping[str, Any] = field(default_factory=dict)  # iterations, tolerance, whether it was capped
    times: Floats | None = None  # (t,) s, and
    course: Floats | None = None  # (t, n, 3) m at the points of the probe, where there is a history
    stress: Callable[[], Stresses] | None = None  # of a model on a mesh; it raises NoStress
    at_rest: AtRest | None = None  # of a model: what supports carry, and energies
    vibrations: Callable[[int], Floats] | None = None  # the lowest frequencies, Hz; raises Undefined
    curve: Course | None = None  # of another metric, where it is asked for
    number: Number | None = None  # of another metric, where it is asked for
    domain: ProbeDomain | None = None  # of the probe, for metrics of stress and strain


@dataclass(frozen=True)
class Number:
    """What another metric comes to, SI; `unit` as keys of details end in it."""

    value: float
    unit: str


@dataclass(frozen=True)
class Measurement:
    """A value in the metric's unit, with further numbers (`details`, SI), and the `samples` that it sums up.

    `at_points` (n,) is the error at each point of the probe in m, for pictures; `curve` what was compared with a curve.
    `uncertainty` is that of the reference in the metric's own unit, where it is not one number for all.
    """

    value: float
    details: Mapping[str, Any] = field(default_factory=dict)
    samples: Floats | None = None
    at_points: Floats | None = None
    uncertainty: float | None = None
    curve: Course | None = None
