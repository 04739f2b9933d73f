"""Metrics of contacts in motion: courses over time, and which of their values counts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.metrics.curve_geometry import Course

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Floats
    from softmark.interpreter.results.reaction_results import States


def _amounts(metric: Any, states: States) -> tuple[Floats, Floats]:
    """Times (t,), s, and what the metric is made of at each (t, ...), in its natural unit. Raises Undefined."""
    times, each = states.states(metric.of_surface)
    return times, np.array([metric.amount(rest) for rest in each])


def course(metric: Any, states: States) -> Course:
    """Its value at every time. Raises Undefined."""
    times, values = _amounts(metric, states)
    key = metric.natural.replace("*", "").replace("^", "")
    return Course(times, np.array([metric._along(value) for value in values]), ("s", key))


def chosen(metric: Any, states: States) -> Floats:
    """What it is made of when its value is largest, or least, or in the mean over time. Raises Undefined."""
    times, values = _amounts(metric, states)
    if metric.when == "mean" and len(times) > 1:
        mean: Floats = np.trapezoid(values, times, axis=0) / (times[-1] - times[0])
        return mean
    numbers = np.array([metric._along(value) for value in values])
    farthest: Floats = values[int((numbers if metric.when == "least" else -abs(numbers)).argmin())]
    return farthest
