"""Statistics of the displacement error over material points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.interpreter.metrics.distance_statistics import (
    DistanceStatistic,
    Statistic,
    summarize_distances,
    summarize_ratios,
)
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Measurement, MetricInput


@dataclass(frozen=True)
class MeanError(DistanceStatistic):
    """Mean distance between model and reference over the points of a probe, or another statistic of it.

    d_i = |u^_i - u_i|, with u^ of the model and u of the reference at the same material point. The statistics are its
    mean, its population standard deviation sd = sqrt(mean(d^2) - mean(d)^2), its largest value and its root mean
    square. Relative statistics use r_i = d_i / |u_i|, each point by its own displacement in the reference, over the
    points that move by more than a micrometre. The relative mean is the mean of these ratios, so that points near a
    support, which hardly move, weigh as much as those at the tip. All points count equally: the result depends on where
    they lie.

    The report also gives all of them: mean_m, sd_m, max_m, min_m, rms_m, p95_m (95th percentile), relative_mean,
    relative_sd and relative_points (the number of ratios).

    Source: Marchal, Allard, Duriez and Cotin (2008), section 2.2; the statistics are those that their code prints.
    """

    probe: Annotated[str, "probe", "probe whose points are compared"]
    against: Annotated[str, "reference or model", "solution taken as correct"]
    statistic: Annotated[Statistic, "statistic of the errors"] = "mean"

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the requested statistic of |u - u_ref| over the points.

        Raises Undefined without reference displacements.
        """
        if seen.known is None or seen.known.u is None:
            raise Undefined("the reference has no displacements at these points")
        d = ((seen.u - seen.known.u) ** 2).sum(axis=1) ** 0.5  # (n,)
        moved = (seen.known.u**2).sum(axis=1) ** 0.5
        return self.make_measurement(summarize_distances(d) | summarize_ratios(d, moved, "relative"), d, d)
