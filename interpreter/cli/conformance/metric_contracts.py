"""Contracts of metrics: a finite number with a unit or a reason, and zero error only for equal results."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from softmark.interpreter.cli.conformance import Breach
from softmark.interpreter.language import units
from softmark.interpreter.metrics.curve_geometry import Curve, MetricCurve
from softmark.interpreter.metrics.measurement import Measurement, MetricInput, MetricNumber, ReferenceData
from softmark.interpreter.metrics.metric_evaluation import measure_metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.results.reaction_results import EquilibriumForces, Reaction
from softmark.references.published_values import KnownValue

NOTHING, SOMETHING = 1e-12, 1e-6  # largest error of equal results; smallest error of different results


def make_static_state(share: float) -> EquilibriumForces:
    """Return a static equilibrium with one load and one support.

    All forces are multiplied by `share`. The support is entered under the two names `hold` and `wall`.
    """
    f, m = (1.0 * share, 2.0 * share, 3.0 * share), (0.1 * share, 0.2 * share, 0.3 * share)
    return EquilibriumForces(
        dict.fromkeys(("hold", "wall"), Reaction(f, m, (0.0, 0.0, 0.0), m)), {"push": share}, share
    )


def metric_breaches(cls: type[Any], metric: Any, case: Case) -> Iterator[Breach]:
    """Yield breaches of a metric, tested on a bending line.

    The value must be a finite number with a unit, or there must be a reason. The error must be zero only for equal
    results.
    Details must have JSON types. `metric` is an instance of the class `cls`, `case` any case of a body.
    """
    try:
        units.parse_unit(metric.unit)
    except units.UnitError as error:
        yield Breach(f"its unit is {metric.unit!r}: {error}", 'write units as in scenes: "m", "1", "N*m"')
    names = {f.name for f in dataclasses.fields(cls)}
    told: list[float] = []
    for seen in _make_test_solutions(case, getattr(metric, "against", None) is not None):
        found = _value_or_exception(metric, seen)
        yield from _measurement_breaches(found)
        again = _value_or_exception(metric, seen)
        if isinstance(found, Measurement) and isinstance(again, Measurement) and not _is_equal(found, again):
            yield Breach(
                f"it is {found.value} and then {again.value} for the same solution", "keep nothing between calls"
            )
        if isinstance(found, Measurement):
            told.append(float(found.value))
    if len(told) == 2 and "statistic" not in names and not (told[0] <= NOTHING and told[1] > SOMETHING):
        yield Breach(f"it is {told[0]:.3g} for an exact solution and {told[1]:.3g} for a wrong one",
                     "return zero if both agree, and more otherwise")  # fmt: skip


def _make_test_solutions(case: Case, against: bool) -> Iterator[MetricInput]:
    """Yield bending lines to be measured.

    If `against`, the line is compared with itself, and then with a line that bends 1.5 times as much; otherwise there
    is one line without a reference.
    """
    X = np.array([[x, 0.0, 0.0] for x in np.linspace(0.0, 0.04, 6)])
    u = np.outer(np.linspace(0.0, 1e-3, 6), [0.0, 0.0, -1.0])
    truths = [_reference(X, u, share) for share in (1.0, 1.5)] if against else [None]
    course, own = MetricCurve(X[:, 0], u[:, 2], ("m", "m")), MetricNumber(float(u[-1, 2]), "m")
    for truth in truths:
        yield MetricInput(
            "m", case, X.copy(), u.copy(), known=truth, at_rest=make_static_state(1.0), curve=course, number=own
        )


def _reference(X: Any, u: Any, share: float) -> ReferenceData:
    """Return a reference with the displacements `u` (n, 3), m, of points `X` (n, 3), m, multiplied by `share`."""
    v = share * u

    def displacement(Y: Any) -> Any:
        return np.interp(Y[:, 0], X[:, 0], v[:, 2])[:, None] * [0.0, 0.0, 1.0]

    curve, value = Curve(X[:, 0], v[:, 2], 0.1 * u[:, 2]), KnownValue(float(v[-1, 2]), 1e-5, "a table")
    return ReferenceData("truth", v, displacement, at_rest=make_static_state(share), curve=curve, value=value)


def _value_or_exception(metric: Any, seen: MetricInput) -> Any:
    """Return the value of a metric, or the exception that it raised."""
    try:
        return measure_metric(metric, seen)
    except Undefined as why:
        return why if why.__cause__ is None else why.__cause__
    except Exception as error:
        return error


def _is_equal(one: Measurement, other: Measurement) -> bool:
    return bool(one.value == other.value or (np.isnan(one.value) and np.isnan(other.value)))


def _measurement_breaches(found: Any) -> Iterator[Breach]:
    if isinstance(found, Undefined):
        if len(str(found)) <= 10:
            yield Breach("it has no value and gives no reason", 'give a reason: `raise Undefined("why")`')
    elif isinstance(found, Exception):
        yield Breach(f"it raises {type(found).__name__}: {found}", '`raise Undefined("why")` if it has no value')
    elif not isinstance(found, Measurement):
        yield Breach(f"`measure` returns a {type(found).__name__}", "return a `Measurement`")
    else:
        if not np.isfinite(found.value):
            yield Breach(f"it is {found.value}", '`raise Undefined("why")` if it has no value')
        if found.samples is not None and found.samples.ndim != 1:
            yield Breach("its samples are not a one-dimensional array of numbers", "make `samples` an array (n,)")
        try:
            json.dumps(dict(found.details), default=lambda v: v.tolist())
        except (TypeError, ValueError, AttributeError) as error:
            yield Breach(f"its details are not of JSON's types ({error})", "use numbers, texts, lists and arrays")
