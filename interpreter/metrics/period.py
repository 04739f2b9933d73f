"""How a body swings, and how fast that dies away."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.seen import Measurement
from softmark.interpreter.metrics.undefined import Undefined

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.seen import Floats, Seen
else:
    from softmark.solvers.deferred import np

PASSES = 5  # of finding crossings around a level and the level between their half-waves


@dataclass(frozen=True)
class Period:
    """Period of the oscillation of a point, with its damping ratio.

    The course q(t) of the last point of the probe along a direction crosses its position of rest at times t_0 ... t_k,
    found between samples by straight lines: T = 2 (t_k - t_0) / k. The extremes of the half-waves between crossings
    follow a_{j+1} - c = -s (a_j - c) for a damped oscillation about c, so a straight line through the pairs
    (a_j, a_{j+1}) gives both the position of rest c and s = exp(-delta / 2) with the logarithmic decrement delta; the
    damping ratio is zeta = delta / sqrt(4 pi^2 + delta^2). That includes the damping of the time integration, which a
    smaller step tells from that of the material. It needs four crossings and three extremes of one dominant mode.

    Beside its value a report has frequency_Hz, damping_ratio, log_decrement, rest_m (the position of rest, along the
    direction), amplitude_m (of the first half-wave) and crossings.

    Source: Thomson and Dahleh (1998), chapter 2.
    """

    probe: Annotated[str, "probe", "its last point is looked at"]
    along: Annotated[tuple[float, float, float], "direction", "the direction of the oscillation"]
    unit: ClassVar[str] = "s"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: Seen) -> Measurement:
        """T. Raises Undefined for a static analysis and for a course without enough crossings."""
        if seen.history is None:
            raise Undefined("without a dynamic analysis nothing oscillates")
        q = seen.history.displacement(seen.X[-1:])[:, 0] @ np.array(self.along)  # (t,)
        rest, decay, times, peaks = _oscillation(seen.history.times, q)
        period = 2.0 * float(times[-1] - times[0]) / (len(times) - 1)
        delta = -2.0 * math.log(decay)
        details = {
            "frequency_Hz": 1.0 / period,
            "damping_ratio": delta / math.hypot(2.0 * math.pi, delta),
            "log_decrement": delta,
            "rest_m": rest,
            "amplitude_m": abs(float(peaks[0]) - rest),
            "crossings": len(times),
        }
        return Measurement(period, details)


def _oscillation(t: Floats, q: Floats) -> tuple[float, float, Floats, Floats]:
    """Position of rest, s, crossing times (k + 1,) and extremes (k,) of the half-waves between them."""
    rest, decay = float(q[len(q) // 2 :].mean()), 1.0
    for _ in range(PASSES):
        times, peaks = _half_waves(t, q - rest)
        if len(peaks) < 3:
            raise Undefined("the point does not cross its position of rest four times")
        peaks = peaks + rest
        slope, offset = np.polyfit(peaks[:-1], peaks[1:], 1)
        if not slope < 0.0:
            raise Undefined("the half-waves do not follow one another like those of one oscillation")
        rest, decay = float(offset / (1.0 - slope)), -float(slope)
    return rest, decay, times, peaks


def _half_waves(t: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Times (k + 1,) at which q changes sign and the extreme (k,) between one and the next."""
    after = np.flatnonzero((q[1:] > 0.0) != (q[:-1] > 0.0)) + 1
    share = q[after - 1] / (q[after - 1] - q[after])
    times = t[after - 1] + share * (t[after] - t[after - 1])
    peaks = [_extreme(q, int(a + np.abs(q[a:b]).argmax())) for a, b in pairwise(after)]
    return times, np.array(peaks)


def _extreme(q: Floats, i: int) -> float:
    """The extreme of the parabola through three samples around the largest one (equal steps)."""
    if not 0 < i < len(q) - 1:
        return float(q[i])
    left, middle, right = q[i - 1 : i + 2]
    bend = left - 2.0 * middle + right
    return float(middle - (left - right) ** 2 / (8.0 * bend)) if bend else float(middle)
