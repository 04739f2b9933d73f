"""Real-time factor: computing time relative to the time available for a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import MetricInput
    from softmark.interpreter.results.motion_history import History
else:
    from softmark.solvers.runtime.lazy_modules import np

SLACK = 1.0 + 1e-9  # rounding tolerance: a step of 40 ms equals a rate of 25 Hz


@dataclass(frozen=True)
class RealTimeFactor(Metric):
    """Computing time of a frame relative to the time available for it: 100 % or less is real time.

    In a dynamic analysis a frame is a time step dt. Real time means t_comp <= dt for the computing time of a step, and
    dt <= 1 / F_c for the rate F_c at which a person sees (25 Hz) or feels (hundreds of Hz to 1 kHz) the result. A
    static analysis has no time of its own; there a frame is one solution from rest, and the criterion is t_comp <= 1 /
    F_c.

    The value is t_99 / limit, where the limit is dt or 1 / F_c and t_99 is the time within which 99 % of the frames are
    computed (the shortest frame time that is not below 99 % of them: no interpolation). The verdict is yes if the value
    is at most 1 and dt is at most 1 / F_c. One frame in a hundred may be late; the report gives the number of late
    frames and the worst one. Times are wall-clock seconds without compilation and meshing; the report also gives CPU
    seconds. They apply to the computer that the report names. If a step was not solved to its tolerance, there is no
    value.

    The report also gives verdict (whether it is real time) and verdict_reason, margin (1 - value), limit_s, median_s,
    p95_s, p99_s, worst_s, worst_frame (from 1), missed (frames over the limit), frames, cpu_median_s, rate_Hz, step_s
    (dt; dynamic only) and basis (what was timed).

    Source: Marchal, Allard, Duriez and Cotin (2008), section 2.2.
    """

    rate: Annotated[float, "Hz in (0, inf)", "required frames per second, F_c"] = 25.0
    unit: ClassVar[str] = "1"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the real-time factor t_99 / limit.

        Raises Undefined for references, without computing times, and for time steps that did not converge.
        """
        if not seen.clock and seen.history is None:
            raise Undefined("a reference has no computing time per frame")
        if seen.history is not None:
            return self._measure_dynamic(seen.history)
        return self._measure_static(seen)

    def _measure_dynamic(self, history: History) -> Measurement:
        """Return the measurement of a dynamic analysis, whose frames are time steps."""
        unsolved, steps = history.solved.count(False), len(history.step_s)
        if unsolved:
            raise Undefined(
                f"{unsolved} of {steps} time steps were not solved to the tolerance, so their times do not count"
            )
        slow = history.step > SLACK / self.rate
        late = f"the time step of {history.step:g} s is longer than a frame at {self.rate:g} Hz" if slow else ""
        more = {"step_s": history.step, "basis": f"wall clock of each of {steps} time steps"}
        return self._compare_with_limit(history.step_s, history.step_cpu_s, history.step, late, more)

    def _measure_static(self, seen: MetricInput) -> Measurement:
        """Return the measurement of a static analysis, whose frames are solutions from rest."""
        wall, cpu = seen.clock.get("solve_s"), seen.clock.get("solve_cpu_s")
        if wall is None:
            raise Undefined("no solution was computed, so there is no computing time")
        if wall.basis:
            raise Undefined(
                f"an external program solved it, and its time is {wall.basis}: the time per frame is not known"
            )
        runs = len(wall.seconds)
        basis = f"wall clock of {runs} solutions from rest"
        if runs == 1:
            basis = "wall time of one solution from rest; `--repeat N` shows the spread"
        return self._compare_with_limit(wall.seconds, cpu.seconds if cpu else (), 1.0 / self.rate, "", {"basis": basis})

    def _compare_with_limit(
        self, wall: tuple[float, ...], cpu: tuple[float, ...], limit: float, late: str, more: dict[str, Any]
    ) -> Measurement:
        """Return the measurement of frame times `wall`, s, compared with `limit`, s.

        `late` is a reason why the result is not real time whatever the frame times are; `more` are further details.
        """
        if not wall:
            raise Undefined("no time step was computed, so there is no computing time")
        t = np.array(wall)  # (frames,)
        median, p95, p99 = float(np.median(t)), _percentile_time(t, 95.0), _percentile_time(t, 99.0)
        fits = p99 <= limit * SLACK
        reason = late or f"99 % of the frames take at most {p99:.3g} s, and {limit:.3g} s are available"
        details = {
            "verdict": fits and not late,
            "verdict_reason": reason,
            "margin": 1.0 - p99 / limit,
            "limit_s": limit,
            "median_s": median,
            "p95_s": p95,
            "p99_s": p99,
            "worst_s": float(t.max()),
            "worst_frame": int(t.argmax()) + 1,
            "missed": int((t > limit * SLACK).sum()),
            "frames": len(t),
            "cpu_median_s": float(np.median(cpu)) if cpu else None,
            "rate_Hz": self.rate,
            **more,
        }
        return Measurement(p99 / limit, details, t / limit)


def _percentile_time(t: np.ndarray[Any, np.dtype[np.float64]], percent: float) -> float:
    """Return the smallest of the times t (n,) within which `percent` % of them lie."""
    return float(np.percentile(t, percent, method="inverted_cdf"))
