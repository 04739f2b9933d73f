"""Input of a metric (results of one model or reference, and reference data) and its result, a measurement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.metrics.curve_geometry import Curve, MetricCurve
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.problem.probe_domains import ProbeDomain
    from softmark.interpreter.results.motion_history import History
    from softmark.interpreter.results.reaction_results import EquilibriumForces
    from softmark.interpreter.results.run_report import Timing
    from softmark.references.measured_data import MeasuredSurface
    from softmark.references.published_values import KnownValue
    from softmark.solvers.stress_recovery.stress_field import Stresses

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]
    Field = Callable[[Floats], Floats]


@dataclass(frozen=True)
class ReferenceData:
    """Reference data with which a metric compares a result.

    They are displacements, a measured surface or curve, forces, stresses or values.
    """

    name: str
    u: Floats | None = None  # (n, 3) m at the points of the metric's probe
    displacement: Field | None = None  # (n, 3) -> (n, 3), m, for any material points
    surface: MeasuredSurface | None = None
    uncertainty: float = 0.0  # m
    times: Floats | None = None  # (t,) s
    course: Floats | None = None  # (t, n, 3) m, displacement history at the points of the probe
    at_rest: EquilibriumForces | None = None  # reactions, contact results and energies
    curve: Curve | None = None  # measured curve
    stress: Callable[[], Stresses] | None = None  # stress field of a model on a mesh; raises NoStress
    value: KnownValue | None = None  # given value


@dataclass(frozen=True)
class MetricInput:
    """Input of a metric: the results of one model or reference, and the reference data.

    X and u are the material points (n, 3) of the metric's probe and their displacements (n, 3), m; they are empty
    without a probe. A probe of a surface has `triangles` (k, 3) over X; a probe of a volume has `weights` (n,), m^3.
    """

    owner: str
    case: Case
    X: Floats
    u: Floats
    triangles: Ints | None = None
    weights: Floats | None = None
    known: ReferenceData | None = None
    displacement: Field | None = None
    clock: Mapping[str, Timing | None] = field(default_factory=dict)
    history: History | None = None
    solve: Mapping[str, Any] = field(default_factory=dict)  # iterations, tolerance, whether it was capped
    times: Floats | None = None  # (t,) s
    course: Floats | None = None  # (t, n, 3) m, displacement history at the points of the probe
    stress: Callable[[], Stresses] | None = None  # stress field of a model on a mesh; raises NoStress
    at_rest: EquilibriumForces | None = None  # reactions, contact results and energies of a model
    vibrations: Callable[[int], Floats] | None = None  # the lowest frequencies, Hz; raises Undefined
    curve: MetricCurve | None = None  # of another metric, for metrics that need it
    number: MetricNumber | None = None  # of another metric, for metrics that need it
    domain: ProbeDomain | None = None  # of the probe, for metrics of stress and strain


@dataclass(frozen=True)
class MetricNumber:
    """Value of another metric in SI, with its `unit` as written in the keys of details."""

    value: float
    unit: str


@dataclass(frozen=True)
class Measurement:
    """Value in the metric's unit, with further numbers (`details`, SI) and the `samples` that it was computed from.

    `at_points` (n,) is the error at each point of the probe, m, for pictures. `curve` is the compared curve.
    `uncertainty` is that of the reference in the metric's own unit, if it depends on the metric.
    """

    value: float
    details: Mapping[str, Any] = field(default_factory=dict)
    samples: Floats | None = None
    at_points: Floats | None = None
    uncertainty: float | None = None
    curve: MetricCurve | None = None
