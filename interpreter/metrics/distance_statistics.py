"""Statistics of a set of distances that a scene can ask for, each with its unit."""

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


class DistanceStatistic(Metric):
    """Base class of metrics that reduce the distances of points to one statistic, which determines the unit."""

    statistic: str

    @property
    def unit(self) -> str:
        """Unit of the value: m, or 1 for relative statistics."""
        return "1" if self.statistic.startswith(("relative", "by_displacement")) else "m"

    @property
    def statistic_name(self) -> str:
        """Name of the statistic."""
        return self.statistic

    @property
    def uncertain(self) -> bool:
        """True if an uncertainty of the reference in m bounds the statistic.

        It does not bound a standard deviation, which an offset does not change, or a ratio, which is not in m.
        """
        return self.statistic in ("mean", "max", "rms")

    def make_measurement(self, details: dict[str, Any], d: Floats, at_points: Floats | None) -> Measurement:
        """Return a measurement whose value is the requested statistic and whose samples are the distances d (n,), m.

        Raises Undefined.
        """
        value = details.get(f"{self.statistic}_{self.unit}".removesuffix("_1"))
        if value is None:
            raise Undefined("no point moves, so there is no relative error")
        return Measurement(value, details, d, at_points)


STILL = 1e-6  # m: points that move less are left out of relative statistics, as in Marchal et al. (2008)


def summarize_distances(d: Floats) -> dict[str, float]:
    """Return mean, population standard deviation, extremes, root mean square and 95th percentile of distances (n,), m.

    sd = sqrt(mean(d^2) - mean(d)^2), divided by n and not by n - 1.
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


def summarize_ratios(d: Floats, moved: Floats, name: str) -> dict[str, Any]:
    """Return mean, population standard deviation and number of the ratios d_i / moved_i.

    Only points are used whose displacement `moved` (n,), m, is not negligible. `name` begins the keys.
    """
    some = moved > STILL
    found: dict[str, Any] = {f"{name}_points": int(some.sum())}
    if some.any():
        r = d[some] / moved[some]
        found |= {f"{name}_mean": float(r.mean()), f"{name}_sd": float(r.std())}
    return found
