"""What a set of distances is summed up by: the statistics that a scene may ask for, each with its unit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Floats

Statistic = Literal["mean", "sd", "max", "rms", "relative_mean", "relative_sd"]
SurfaceStatistic = Literal[
    "mean", "sd", "max", "rms", "relative_mean", "relative_sd", "by_displacement_mean", "by_displacement_sd"
]


class Summed(Metric):
    """A metric that sums distances up by a statistic of the scene's choice, on which its unit depends."""

    statistic: str

    @property
    def unit(self) -> str:
        """m, or 1 for what is relative."""
        return "1" if self.statistic.startswith(("relative", "by_displacement")) else "m"

    @property
    def summed_by(self) -> str:
        """The statistic."""
        return self.statistic

    @property
    def uncertain(self) -> bool:
        """Whether an uncertainty of the reference in m bounds what the statistic can tell.

        A spread is left unharmed by an offset, and a ratio is not in m.
        """
        return self.statistic in ("mean", "max", "rms")

    def summed(self, details: dict[str, Any], d: Floats, at_points: Floats | None) -> Measurement:
        """The measurement whose value is the statistic asked for; d (n,) m are its samples. Raises Undefined."""
        value = details.get(f"{self.statistic}_{self.unit}".removesuffix("_1"))
        if value is None:
            raise Undefined("no point moves, so nothing is relative to it")
        return Measurement(value, details, d, at_points)


STILL = 1e-6  # m: a point that moves less is left out of what is relative to its motion, as the authors of 2008 do


def spread(d: Floats) -> dict[str, float]:
    """Mean, population standard deviation, extremes, root mean square and 95th percentile of distances (n,), m.

    sd = sqrt(mean(d^2) - mean(d)^2), over n and not over n - 1.
    """
    return {
        "mean_m": float(d.mean()),
        "sd_m": float(d.std()),
        "max_m": float(d.max()),
        "min_m": float(d.min()),
        "rms_m": float((d**2).mean() ** 0.5),
        "p95_m": _percentile(d, 95.0),
    }


def _percentile(d: Floats, percent: float) -> float:
    import numpy as np

    return float(np.percentile(d, percent))


def ratios(d: Floats, moved: Floats, name: str) -> dict[str, Any]:
    """Mean, population standard deviation and number of d_i / moved_i over the points that moved, by name."""
    some = moved > STILL
    found: dict[str, Any] = {f"{name}_points": int(some.sum())}
    if some.any():
        r = d[some] / moved[some]
        found |= {f"{name}_mean": float(r.mean()), f"{name}_sd": float(r.std())}
    return found
