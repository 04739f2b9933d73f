"""Metrics: numbers that a scene asks for, such as errors, forces, stresses and computing times.

Each metric has its own file. To add a metric: write a file with a class derived from Metric, and add a line to METRICS.
The class has fields: most metrics have a `probe`, whose points they evaluate, and errors have `against`, the reference.
It also has the `unit` of its value, `uncertain` (true if an uncertainty of the reference in m bounds the value), and a
method `measure(seen) -> Measurement`, which raises Undefined, with a reason, if there is no value. A metric that needs
only plain arrays derives from DisplacementMetric and has `value(X, u, reference)`. Further numbers go into `details`,
in SI under keys that end in their unit; the docstring of the class names them.
"""

from __future__ import annotations

from typing import Any

from softmark.interpreter.metrics.contact import ContactArea, ContactGap, ContactPressure
from softmark.interpreter.metrics.curve_error import CurveError
from softmark.interpreter.metrics.displacement import Displacement
from softmark.interpreter.metrics.dissipation import Dissipation
from softmark.interpreter.metrics.energy_norm_error import EnergyNormError
from softmark.interpreter.metrics.force import Force
from softmark.interpreter.metrics.frequency import Frequency
from softmark.interpreter.metrics.hausdorff import Hausdorff
from softmark.interpreter.metrics.hysteresis import Hysteresis
from softmark.interpreter.metrics.max_error import MaxError
from softmark.interpreter.metrics.mean_error import MeanError
from softmark.interpreter.metrics.moment import Moment
from softmark.interpreter.metrics.period import Period
from softmark.interpreter.metrics.pore_pressure import Outflow, PorePressure
from softmark.interpreter.metrics.pressure_along import PressureAlong
from softmark.interpreter.metrics.realtime_factor import RealTimeFactor
from softmark.interpreter.metrics.relative_displacement_error import RelativeDisplacementError
from softmark.interpreter.metrics.slip import Slip, StickArea
from softmark.interpreter.metrics.strain import Strain
from softmark.interpreter.metrics.strain_energy import StrainEnergy
from softmark.interpreter.metrics.stress import Stress
from softmark.interpreter.metrics.stretch import Stretch
from softmark.interpreter.metrics.surface_distance import SurfaceDistance
from softmark.interpreter.metrics.tip_error import TipError
from softmark.interpreter.metrics.trajectory_error import TrajectoryError
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.metrics.volume_change import VolumeChange
from softmark.interpreter.metrics.work import LoadWork

METRICS: dict[str, type[Any]] = {
    "relative_l2_error": RelativeDisplacementError,
    "tip_error": TipError,
    "max_error": MaxError,
    "mean_error": MeanError,
    "trajectory_error": TrajectoryError,
    "curve_error": CurveError,
    "hysteresis": Hysteresis,
    "value_error": ErrorOfValue,
    "energy_norm_error": EnergyNormError,
    "surface_distance": SurfaceDistance,
    "hausdorff": Hausdorff,
    "volume_change": VolumeChange,
    "displacement": Displacement,
    "stress": Stress,
    "strain": Strain,
    "stretch": Stretch,
    "force": Force,
    "moment": Moment,
    "contact_area": ContactArea,
    "contact_pressure": ContactPressure,
    "pressure_along": PressureAlong,
    "gap": ContactGap,
    "slip": Slip,
    "stick_area": StickArea,
    "strain_energy": StrainEnergy,
    "dissipation": Dissipation,
    "work": LoadWork,
    "pore_pressure": PorePressure,
    "outflow": Outflow,
    "period": Period,
    "frequency": Frequency,
    "realtime_factor": RealTimeFactor,
}
