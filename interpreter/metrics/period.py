"""Period and damping ratio of an oscillation."""

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

    from softmark.interpreter.metrics.measurement import Floats, MetricInput
else:
    from softmark.solvers.runtime.lazy_modules import np

UNEVEN = 0.1  # largest relative standard deviation of cycle lengths of one vibration
LOPSIDED = 0.25  # the same for half-waves, which alternate if the rest position is slightly off
RIVAL = 0.5  # relative strength of the second vibration above which none is dominant
AGREES = 0.2  # largest relative difference of the periods from crossings and spectrum
LOBE = 3.0  # half the width of a spectral peak under the window, in units of 1 / record length
PASSES = 5  # iterations between crossings of a level and the level between half-waves


@dataclass(frozen=True)
class Period(Metric):
    """Period of the oscillation of a point, with its damping ratio.

    The displacement q(t) of the last point of the probe along a direction crosses its rest position at times t_0 ...
    t_k, found by linear interpolation between samples: T = 2 (t_k - t_0) / k. The extremes of the half-waves between
    crossings follow a_{j+1} - c = -s (a_j - c) for a damped oscillation about c, so a straight line through the pairs
    (a_j, a_{j+1}) gives both the rest position c and s = exp(-delta / 2) with the logarithmic decrement delta; the
    damping ratio is zeta = delta / sqrt(4 pi^2 + delta^2). It includes the numerical damping of the time integration; a
    smaller step separates that from material damping. The metric needs four crossings and three extremes of one
    dominant mode. It is undefined, with a reason, if cycles or half-waves differ too much, or if the spectrum between
    the first and the last crossing has two peaks of similar strength or its peak at another frequency.

    The report also gives frequency_Hz, damping_ratio, log_decrement, rest_m (the rest position along the direction),
    amplitude_m (of the first half-wave), crossings, cycles (their number), spread_s (the standard deviation of their
    lengths, an uncertainty of the period), and for the second strongest vibration rival_s, its period, and rival_share,
    its relative strength; the last two need at least three cycles.

    Source: Thomson and Dahleh (1998), chapter 2.
    """

    probe: Annotated[str, "probe", "probe whose last point is evaluated"]
    along: Annotated[tuple[float, float, float], "direction", "the direction of the oscillation"]
    unit: ClassVar[str] = "s"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the period T, s. Raises Undefined for a static analysis or too few crossings."""
        if seen.history is None:
            raise Undefined("a period needs a dynamic analysis")
        q = seen.history.displacement(seen.X[-1:])[:, 0] @ np.array(self.along)  # (t,)
        rest, decay, times, peaks = _fit_damped_oscillation(seen.history.times, q)
        period = 2.0 * float(times[-1] - times[0]) / (len(times) - 1)
        spread = _cycle_deviation(times, period)
        rival, share = _find_second_vibration(seen.history.times, q - rest, times, period)
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


def _fit_damped_oscillation(t: Floats, q: Floats) -> tuple[float, float, Floats, Floats]:
    """Return the rest position c and the ratio s of an oscillation q (n,) at times t (n,), s, and its half-waves.

    Half-waves are given by the crossing times (k + 1,), s, and the extremes between them (k,). c and s are defined at
    `Period`.
    """
    rest, decay = float(q[len(q) // 2 :].mean()), 1.0
    for _ in range(PASSES):
        times, peaks = _find_half_waves(t, q - rest)
        if len(peaks) < 3:
            raise Undefined("the point crosses its rest position fewer than four times: use a longer `duration`")
        peaks = peaks + rest
        slope, offset = np.polyfit(peaks[:-1], peaks[1:], 1)
        if not slope < 0.0:
            raise Undefined(
                "its motion does not look like one oscillation: successive half-waves do not alternate "
                "about a rest position"
            )
        rest, decay = float(offset / (1.0 - slope)), -float(slope)
    return rest, decay, times, peaks


def _cycle_deviation(times: Floats, period: float) -> float:
    """Return the standard deviation of the cycle lengths, s. Raises Undefined if they are too uneven."""
    cycles, halves = times[2:] - times[:-2], np.diff(times)
    spread = float(cycles.std(ddof=1)) if len(cycles) > 1 else 0.0
    if spread > UNEVEN * period or float(halves.std()) > LOPSIDED * 0.5 * period:
        raise Undefined(
            f"it has no dominant period: cycles last {cycles.min():.3g} to {cycles.max():.3g} s and "
            f"half-waves {halves.min():.3g} to {halves.max():.3g} s"
        )
    return spread


def _find_second_vibration(t: Floats, q: Floats, times: Floats, period: float) -> tuple[float | None, float | None]:
    """Return the period, s, and the relative strength of the second strongest vibration.

    They come from a spectrum with Blackman's window. Raises Undefined if the second vibration is of similar strength,
    or if the strongest one disagrees with the crossings.
    """
    length = float(times[-1] - times[0])
    if length < 3.0 * period:
        return None, None
    count = max(int(np.count_nonzero((t >= times[0]) & (t <= times[-1]))), 8)
    even = np.linspace(times[0], times[-1], count)
    windowed = np.interp(even, t, q) * np.blackman(count)
    power = np.abs(np.fft.rfft(windowed, 8 * count))  # zero-padded to interpolate between bins
    pitch = np.arange(len(power)) * (count - 1) / (8.0 * count * length)  # Hz
    peaks = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    first = peaks[power[peaks].argmax()]
    apart = np.abs(pitch[peaks] - pitch[first]) > LOBE / length
    others = peaks[apart & (pitch[peaks] > LOBE / length)]
    if abs(pitch[first] * period - 1.0) > AGREES:
        raise Undefined(
            f"it has no dominant period: it crosses its rest position with a period of {period:.3g} s, "
            f"but its strongest vibration has {1 / pitch[first]:.3g} s"
        )
    if not len(others):
        return None, 0.0
    second = others[power[others].argmax()]
    share = float(power[second] / power[first])
    if share > RIVAL:
        raise Undefined(
            f"it has no dominant period: the strongest vibration has {1 / pitch[first]:.3g} s, and "
            f"another with {100 * share:.0f} % of its strength has {1 / pitch[second]:.3g} s"
        )
    return 1.0 / float(pitch[second]), share


def _find_half_waves(t: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Return the times (k + 1,), s, at which q changes sign, and the extreme (k,) of each half-wave between them."""
    after = np.flatnonzero((q[1:] > 0.0) != (q[:-1] > 0.0)) + 1
    share = q[after - 1] / (q[after - 1] - q[after])
    times = t[after - 1] + share * (t[after] - t[after - 1])
    peaks = [_parabola_extreme(q, int(a + np.abs(q[a:b]).argmax())) for a, b in pairwise(after)]
    return times, np.array(peaks)


def _parabola_extreme(q: Floats, i: int) -> float:
    """Return the extreme of the parabola through three samples around sample i, with equal time steps."""
    if not 0 < i < len(q) - 1:
        return float(q[i])
    left, middle, right = q[i - 1 : i + 2]
    bend = left - 2.0 * middle + right
    return float(middle - (left - right) ** 2 / (8.0 * bend)) if bend else float(middle)
