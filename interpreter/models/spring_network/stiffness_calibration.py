"""Calibration of the stiffness factor of a spring network at a fraction of the load, and its checks.

`check_calibration` returns errors of a scene, before anything is built. `target_of` returns the metric, the
reference and the points at the fraction of the load. `minimize_error` returns the factor that minimizes an
error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.problem.body_case import Case, Fault, body_of, fault
from softmark.interpreter.vocabulary.analysis_words import Static
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.references.measured_data import Measured

    Floats = NDArray[np.float64]
    Field = Callable[[Floats], Floats]

STRIDE = 0.5  # step of the logarithm of the factor while its best value is bracketed
REACH = 4.5  # largest absolute logarithm: factors from 1/90 to 90
CLOSE = 1e-3  # tolerance of the logarithm of the factor
UNUSABLE = 1e30  # error that stands for a factor without an equilibrium


@dataclass(frozen=True)
class Fit:
    """Result of a calibration: the best factor, its metric, and every trial as (factor, metric).

    The metric of a trial is None if no equilibrium was found.
    """

    factor: float
    value: float
    trials: tuple[tuple[float, float | None], ...]


@dataclass(frozen=True)
class NoFit:
    """Failed calibration: the reason why no factor could be fitted, and the trials."""

    reason: str
    trials: tuple[tuple[float, float | None], ...]


@dataclass(frozen=True)
class FitTarget:
    """Objective of a calibration: a function that returns the metric of a displacement field.

    `case` is the case at the fraction of the load.
    """

    case: Case
    metric: Declared
    measure: Callable[[Field], float]

    @property
    def name(self) -> str:
        """Name of the metric that the calibration makes as small as possible."""
        return self.metric.name

    @property
    def unit(self) -> str:
        """Unit of the metric."""
        unit: str = self.metric.thing.unit
        return unit


# ------------------------------------------------------------------ what a scene can be fitted to


def check_calibration(scene: Scene, model: Declared, case: Case) -> list[Diagnostic]:
    """Return errors of a calibrated model: a metric with no reference, of another body, or known only at full load."""
    try:
        _metric_probe_and_reference(scene, model, case)
    except Fault as found:
        return [found.diagnostic]
    return []


def _metric_probe_and_reference(scene: Scene, model: Declared, case: Case) -> tuple[Declared, Declared, Declared]:
    """Return the metric, the probe and the reference of a calibrated model. Raises Fault."""
    calibrated, at = model.thing.stiffness, model.at("stiffness")
    metric = scene.declared[calibrated.metric]
    names = [metric.thing.probe_name, metric.thing.measured_from]
    if None in names:
        raise fault("E521", at, f"`{model.name}` cannot be calibrated with `{metric.name}`",
                    "compares with no reference" if names[1] is None else "uses no probe",
                    "use a metric that is an error against a reference, such as `relative_l2_error(...)`")  # fmt: skip
    probe, reference = (scene.declared[str(name)] for name in names)
    if {probe.thing.body, body_of(scene, reference)} != {case.body.name}:
        raise fault("E505", at, f"`{model.name}` is a model of `{case.body.name}`, and `{metric.name}` is "
                                "not about that body",
                    "different bodies",
                    f"use a metric whose probe and reference belong to `{case.body.name}`")  # fmt: skip
    _check_known_at_fraction(model, reference, case)
    return metric, probe, reference


def _check_known_at_fraction(model: Declared, reference: Declared, case: Case) -> None:
    """Raise Fault if the reference, or an imposed motion, is unknown at the fraction of the load."""
    load, at = model.thing.stiffness.load, model.at("stiffness")
    how = "computed" if reference.kind == "model" else reference.thing.how
    if how not in ("solved", "measured"):
        what = {"computed": "a model", "refined": "uses refined models", "scanned": "scans a model"}[how]
        raise fault(
            "E521",
            at,
            f"`{model.name}` cannot be calibrated against `{reference.name}`",
            what,
            "use a metric against another reference: models are computed after the calibration",
        )
    if reference.thing.registered == "icp":
        raise fault("E521", at, f"`{model.name}` cannot be calibrated against `{reference.name}`",
                    "registered to each computed surface", "register it by `clamp`, or not at all")  # fmt: skip
    if load == 1.0:
        return
    part = units.format_value(load, units.NONE)
    if how != "solved":
        raise fault("E521", at, f"`{reference.name}` was measured at full load, not at {part} of it",
                    "not known at this load",
                    "calibrate against a reference that can be solved, such as `simo_reissner(...)`, or at "
                    "`load = 100 %`")  # fmt: skip
    for support in case.supports:
        if support.thing.tracked is not None:
            raise fault("E521", at, f"the motion of `{support.name}` was measured at full load, not at {part} of it",
                        "not known at this load", "calibrate at `load = 100 %`")  # fmt: skip


# ------------------------------------------------------------------ the same case at a part of the load


def scale_case(case: Case, part: float) -> Case:
    """Return the static case with every load and every imposed displacement scaled by `part`."""
    loads = tuple(_scale_declaration(d, part) for d in case.loads)
    supports = tuple(_scale_declaration(d, part) for d in case.supports)
    analysis = case.analysis if isinstance(case.analysis, Static) else Static()  # a fit is made at rest
    return replace(case, loads=loads, supports=supports, analysis=analysis)


def _scale_declaration(declared: Declared, part: float) -> Declared:
    """Return a load or support with its size scaled by `part`."""
    return replace(declared, thing=declared.thing.part(part))


def target_of(scene: Scene, model: Declared, case: Case, measured: Mapping[str, Any]) -> FitTarget:
    """Return the objective of the calibration of a model. Raises Fault.

    `measured` has the measured data of references, by name.
    """
    from softmark.interpreter.metrics.metric_evaluation import measure_metric
    from softmark.interpreter.problem.probe_points import find_probe_points

    metric, probe, reference = _metric_probe_and_reference(scene, model, case)
    part = scale_case(case, model.thing.stiffness.load)
    data = _measured_reference_data(reference, measured, model)
    place = find_probe_points(
        probe, case, lambda name: _measured_reference_data(scene.declared[name], measured, model).X
    )
    known = _reference_at_points(reference, data, part, place.X)

    def measure(displacement: Field) -> float:
        """Return the metric of a displacement field against the reference."""
        from softmark.interpreter.metrics.measurement import MetricInput

        u = displacement(place.X)
        seen = MetricInput(model.name, part, place.X, u, place.triangles, place.weights, known, displacement)
        return measure_metric(metric.thing, seen).value

    return FitTarget(part, metric, measure)


def _measured_reference_data(reference: Declared, measured: Mapping[str, Any], model: Declared) -> Any:
    """Return the data of a measured reference, read by the run; None for a computed reference. Raises Fault."""
    if reference.thing.how != "measured":
        return None
    if reference.name not in measured:
        problem = f"`{model.name}` is calibrated against `{reference.name}`, which could not be read"
        raise fault("E406", model.at("stiffness"), problem, help="see the reason in the report of the reference")
    return measured[reference.name]


def _reference_at_points(reference: Declared, data: Measured | None, part: Case, X: Floats) -> Any:
    """Return the reference at points X (n, 3), m, of the probe, in the form that a metric needs."""
    from softmark.interpreter.metrics.measurement import ReferenceData
    from softmark.interpreter.problem.theories.reference_solution import solve_theory
    from softmark.references.measured_data import MeasuredSurface

    if data is None:
        line = solve_theory(reference, part)
        return ReferenceData(reference.name, line.displacement(X), line.displacement)
    if isinstance(data, MeasuredSurface):
        return ReferenceData(reference.name, surface=data, uncertainty=data.resolution)
    return ReferenceData(reference.name, data.displacement(X), uncertainty=data.uncertainty)


# ------------------------------------------------------------------ the factor


@dataclass
class _Trials:
    """Error as a function of the logarithm of the factor, with every value computed once."""

    error: Callable[[float], float | None]
    found: dict[float, float] = field(default_factory=dict)

    def __call__(self, s: float) -> float:
        """Return the error at the logarithm s of the factor; UNUSABLE if it is unknown."""
        s = float(s)
        if s not in self.found:
            value = self.error(math.exp(s))
            self.found[s] = UNUSABLE if value is None or not math.isfinite(value) else value
        return self.found[s]

    @property
    def sorted_trials(self) -> tuple[tuple[float, float | None], ...]:
        """Return the trials as (factor, error or None), in the order of the factors."""
        return tuple((math.exp(s), None if e >= UNUSABLE else e) for s, e in sorted(self.found.items()))


def minimize_error(error: Callable[[float], float | None]) -> Fit | NoFit:
    """Return the factor with the smallest error, by bracketing followed by Brent's method (1973).

    `error` returns None for a factor whose error is unknown.
    """
    from scipy.optimize import minimize_scalar

    at = _Trials(error)
    start = 0.0
    while at(start) >= UNUSABLE and start < REACH:  # too soft a network collapses
        start += STRIDE
    if at(start) >= UNUSABLE:
        return NoFit("no equilibrium was found with any tested stiffness factor", at.sorted_trials)
    middle = _bracket_minimum(at, start)
    minimize_scalar(at, bounds=(middle - STRIDE, middle + STRIDE), method="bounded", options={"xatol": CLOSE})
    best = min(at.found, key=at.found.__getitem__)
    order = sorted(at.found)
    beside = (order[i] for i in (order.index(best) - 1, order.index(best) + 1) if 0 <= i < len(order))
    if any(at.found[s] >= UNUSABLE for s in beside):
        reason = f"the metric decreases towards factors near {math.exp(best):.2g}, where no equilibrium was found"
        return NoFit(reason, at.sorted_trials)
    if abs(best) > REACH:
        end = f"the metric keeps decreasing up to a factor of {math.exp(best):.2g}, the end of the range"
        return NoFit(f"{end}; check what is compared", at.sorted_trials)
    return Fit(math.exp(best), at.found[best], at.sorted_trials)


def _bracket_minimum(at: _Trials, start: float) -> float:
    """Return a logarithm of the factor whose two neighbours have larger errors, or the end of the range."""
    for step in (STRIDE, -STRIDE):
        s = start
        while abs(s) <= REACH and at(s + step) < at(s):
            s += step
        if s != start:
            return s
    return start
