"""Metrics: how far a model is from a reference, as one number each.

To add one: a file with a class, a line in METRICS. A metric has fields (among them the probe or body that it looks
at), the unit of its value, and `value(X, u, reference)` over plain arrays; it raises Undefined where it does not apply.
"""

from __future__ import annotations

from typing import Any

from softmark.interpreter.metrics.displacement import Displacement
from softmark.interpreter.metrics.energy_norm import EnergyNorm
from softmark.interpreter.metrics.max_error import MaxError
from softmark.interpreter.metrics.tip_error import TipError

METRICS: dict[str, type[Any]] = {
    "energy_norm": EnergyNorm,
    "tip_error": TipError,
    "max_error": MaxError,
    "displacement": Displacement,
}
