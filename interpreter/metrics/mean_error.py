"""Errors of material points, summed up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.interpreter.metrics.distance_statistics import Statistic, Summed, ratios, spread
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Measurement, Seen


@dataclass(frozen=True)
class MeanError(Summed):
    """Mean distance between model and reference over the points of a probe.

    d_i = |u^_i - u_i|, with u^ of the model and u of the reference at the same material point, and its mean, its
    population standard deviation sd = sqrt(mean(d^2) - mean(d)^2), its largest value or its root mean square.
    Relative: r_i = d_i / |u_i|, each point by its own displacement in the reference, over the points that move by
    more than a micrometre; the relative mean is the mean of these ratios, so that points near a support, which hardly
    move, weigh as much as those at the tip. The points count equally: the result depends on where they lie.

    Beside its value a report has all of them: mean_m, sd_m, max_m, min_m, rms_m, p95_m (95th percentile),
    relative_mean, relative_sd and relative_points (how many points the ratios are of).

    Source: Marchal, Allard, Duriez and Cotin (2008), section 2.2; the statistics are those that their code prints.
    """

    probe: Annotated[str, "probe", "the points that are compared"]
    against: Annotated[str, "reference or model", "the solution that is taken as right"]
    statistic: Annotated[Statistic, "which number is the value"] = "mean"

    def measure(self, seen: Seen) -> Measurement:
        """The statistic of |u - u_ref| over the points. Raises Undefined without displacements to compare with."""
        if seen.known is None or seen.known.u is None:
            raise Undefined("the reference has no displacements of these points")
        d = ((seen.u - seen.known.u) ** 2).sum(axis=1) ** 0.5  # (n,)
        moved = (seen.known.u**2).sum(axis=1) ** 0.5
        return self.summed(spread(d) | ratios(d, moved, "relative"), d, d)
