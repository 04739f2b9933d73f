"""Time histories of contact metrics, and their largest, least or mean values over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.metrics.curve_geometry import MetricCurve

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Floats
    from softmark.interpreter.results.reaction_results import ContactHistory


def _quantities_over_time(metric: Any, states: ContactHistory) -> tuple[Floats, Floats]:
    """Return times (t,), s, and the amount of a contact metric at each time (t, ...), in the metric's natural unit.

    Raises Undefined.
    """
    times, each = states.states(metric.of_surface)
    return times, np.array([metric.amount(rest) for rest in each])


def build_history(metric: Any, states: ContactHistory) -> MetricCurve:
    """Return the value of a contact metric at every time, as a curve. Raises Undefined."""
    times, values = _quantities_over_time(metric, states)
    key = metric.natural.replace("*", "").replace("^", "")
    return MetricCurve(times, np.array([metric._along(value) for value in values]), ("s", key))


def reduce_history(metric: Any, states: ContactHistory) -> Floats:
    """Return the largest, least or mean amount of a contact metric over time, as its field `over` selects.

    Raises Undefined.
    """
    times, values = _quantities_over_time(metric, states)
    if metric.when == "mean" and len(times) > 1:
        mean: Floats = np.trapezoid(values, times, axis=0) / (times[-1] - times[0])
        return mean
    numbers = np.array([metric._along(value) for value in values])
    farthest: Floats = values[int((numbers if metric.when == "least" else -abs(numbers)).argmin())]
    return farthest
