"""How a body swings, and how fast that dies away."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, Seen
else:
    from softmark.solvers.runtime.lazy_modules import np

UNEVEN = 0.1  # standard deviation of cycles, in proportion: with more they are not those of one vibration
LOPSIDED = 0.25  # of half-waves, which a position of rest that is a little off makes long and short by turns
RIVAL = 0.5  # of the strength of the strongest vibration: with more than that there is no dominant one
AGREES = 0.2  # in proportion, of the periods from crossings and from the spectrum
LOBE = 3.0  # over the length of the record: half the width of a peak under the window
PASSES = 5  # of finding crossings around a level and the level between their half-waves


@dataclass(frozen=True)
class Period(Metric):
    """Period of the oscillation of a point, with its damping ratio.

    The course q(t) of the last point of the probe along a direction crosses its position of rest at times t_0 ... t_k,
    found between samples by straight lines: T = 2 (t_k - t_0) / k. The extremes of the half-waves between crossings
    follow a_{j+1} - c = -s (a_j - c) for a damped oscillation about c, so a straight line through the pairs
    (a_j, a_{j+1}) gives both the position of rest c and s = exp(-delta / 2) with the logarithmic decrement delta; the
    damping ratio is zeta = delta / sqrt(4 pi^2 + delta^2). That includes the damping of the time integration, which a
    smaller step tells from that of the material. It needs four crossings and three extremes of one dominant mode:
    where cycles or half-waves differ by more than that allows, or the spectrum between the first and the last crossing
    has two peaks of like strength, or one elsewhere, there is no period, and the reason is said.

    Beside its value a report has frequency_Hz, damping_ratio, log_decrement, rest_m (the position of rest, along the
    direction), amplitude_m (of the first half-wave), crossings, cycles (how many were seen), spread_s (the standard
    deviation of their lengths: by so much the period is uncertain), and of the next strongest vibration rival_s, its
    period, and rival_share, its strength in proportion; none where fewer than three cycles were seen.

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
        spread = _spread(times, period)
        rival, share = _rival(seen.history.times, q - rest, times, period)
        delta = -2.0 * math.log(decay)
        details = {
            "frequency_Hz": 1.0 / period,
            "damping_ratio": delta / math.hypot(2.0 * math.pi, delta),
            "log_decrement": delta,
            "rest_m": rest,
            "amplitude_m": abs(float(peaks[0]) - rest),
            "crossings": len(times),
            "cycles": 0.5 * (len(times) - 1),
            "spread_s": spread,
            "rival_s": rival,
            "rival_share": share,
        }
        return Measurement(period, details)


def _oscillation(t: Floats, q: Floats) -> tuple[float, float, Floats, Floats]:
    """Position of rest, s, crossing times (k + 1,) and extremes (k,) of the half-waves between them."""
    rest, decay = float(q[len(q) // 2 :].mean()), 1.0
    for _ in range(PASSES):
        times, peaks = _half_waves(t, q - rest)
        if len(peaks) < 3:
            raise Undefined("the point does not cross its position of rest four times; a longer `duration` shows more")
        peaks = peaks + rest
        slope, offset = np.polyfit(peaks[:-1], peaks[1:], 1)
        if not slope < 0.0:
            raise Undefined("the half-waves do not follow one another like those of one oscillation")
        rest, decay = float(offset / (1.0 - slope)), -float(slope)
    return rest, decay, times, peaks


def _spread(times: Floats, period: float) -> float:
    """Standard deviation, s, of the lengths of cycles between crossings. Raises Undefined where they have no one."""
    cycles, halves = times[2:] - times[:-2], np.diff(times)
    spread = float(cycles.std(ddof=1)) if len(cycles) > 1 else 0.0
    if spread > UNEVEN * period or float(halves.std()) > LOPSIDED * 0.5 * period:
        raise Undefined(
            f"it has no dominant period: cycles last {cycles.min():.3g} to {cycles.max():.3g} s,"
            f" half-waves {halves.min():.3g} to {halves.max():.3g} s"
        )
    return spread


def _rival(t: Floats, q: Floats, times: Floats, period: float) -> tuple[float | None, float | None]:
    """Period, s, and relative strength of the vibration next to the strongest, by a spectrum under Blackman's window.

    Raises Undefined where it is of like strength, or the strongest is not the one that crossings tell.
    """
    length = float(times[-1] - times[0])
    if length < 3.0 * period:
        return None, None
    count = max(int(np.count_nonzero((t >= times[0]) & (t <= times[-1]))), 8)
    even = np.linspace(times[0], times[-1], count)
    windowed = np.interp(even, t, q) * np.blackman(count)
    power = np.abs(np.fft.rfft(windowed, 8 * count))  # padded: between the bins
    pitch = np.arange(len(power)) * (count - 1) / (8.0 * count * length)  # Hz
    peaks = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    first = peaks[power[peaks].argmax()]
    apart = np.abs(pitch[peaks] - pitch[first]) > LOBE / length
    others = peaks[apart & (pitch[peaks] > LOBE / length)]
    if abs(pitch[first] * period - 1.0) > AGREES:
        raise Undefined(
            f"it has no dominant period: it swings about its rest in {period:.3g} s,"
            f" and most in {1 / pitch[first]:.3g} s"
        )
    if not len(others):
        return None, 0.0
    second = others[power[others].argmax()]
    share = float(power[second] / power[first])
    if share > RIVAL:
        raise Undefined(
            f"it has no dominant period: {1 / pitch[first]:.3g} s, and {1 / pitch[second]:.3g} s with"
            f" {100 * share:.0f} % of its strength"
        )
    return 1.0 / float(pitch[second]), share


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
