"""Whether a model keeps up with the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Seen
    from softmark.interpreter.results.motion_history import History
else:
    from softmark.solvers.runtime.lazy_modules import np

SLACK = 1.0 + 1e-9  # a step of 40 ms and a rate of 25 Hz are equal whatever their last bits


@dataclass(frozen=True)
class RealTime(Metric):
    """The share of a frame that computing it takes: 100 % and less is real time.

    In a dynamic analysis a frame is a time step dt. Real time is t_comp <= dt for what a step takes to compute, and
    dt <= 1 / F_c for the rate F_c at which someone sees (25 Hz) or feels (hundreds of Hz to 1 kHz) the result. A static
    analysis has no time of its own; there a frame is one solution from rest, and the criterion is t_comp <= 1 / F_c.

    The value is t_99 / limit, where the limit is dt or 1 / F_c and t_99 is the time within which 99 % of the frames
    are computed (the least time of a frame that is not shorter than 99 % of them: no interpolation). The verdict is
    yes if it is at most 1 and dt is at most 1 / F_c. One frame in a hundred may be late; the report says how many are,
    and which was the worst. Times are wall-clock seconds without compilation and without the making of the mesh; CPU
    seconds stand beside them. They are of this computer: a report names it. A step that was not solved to its
    tolerance is no frame: then there is no value.

    Beside its value a report has verdict (whether it is real time) and verdict_reason, margin (1 - value), limit_s,
    median_s, p95_s, p99_s, worst_s, worst_frame (from 1), missed (frames over the limit), frames, cpu_median_s,
    rate_Hz, step_s (dt; dynamic only) and basis (what was timed).

    Source: Marchal, Allard, Duriez and Cotin (2008), section 2.2.
    """

    rate: Annotated[float, "Hz in (0, inf)", "frames per second that are needed, F_c"] = 25.0
    unit: ClassVar[str] = "1"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: Seen) -> Measurement:
        """t_99 / limit. Raises Undefined for references, for what has no times, and for steps that were not solved."""
        if not seen.clock and seen.history is None:
            raise Undefined("a reference has no frames")
        if seen.history is not None:
            return self._dynamic(seen.history)
        return self._static(seen)

    def _dynamic(self, history: History) -> Measurement:
        """Frames are time steps."""
        unsolved, steps = history.solved.count(False), len(history.step_s)
        if unsolved:
            raise Undefined(f"{unsolved} of {steps} steps were not solved to the tolerance: their times count nothing")
        slow = history.step > SLACK / self.rate
        late = f"the time step of {history.step:g} s is longer than a frame at {self.rate:g} Hz" if slow else ""
        more = {"step_s": history.step, "basis": f"wall clock of each of {steps} time steps"}
        return self._judged(history.step_s, history.step_cpu_s, history.step, late, more)

    def _static(self, seen: Seen) -> Measurement:
        """Frames are solutions from rest."""
        wall, cpu = seen.clock.get("solve_s"), seen.clock.get("solve_cpu_s")
        if wall is None:
            raise Undefined("it was not solved, so there is no time")
        if wall.basis:
            raise Undefined(f"another program solved it, and its time is {wall.basis}: no frame is known of it")
        runs = len(wall.seconds)
        basis = f"wall clock of {runs} solutions from rest"
        if runs == 1:
            basis = "wall clock of one solution from rest; repeat the run for a spread"
        return self._judged(wall.seconds, cpu.seconds if cpu else (), 1.0 / self.rate, "", {"basis": basis})

    def _judged(
        self, wall: tuple[float, ...], cpu: tuple[float, ...], limit: float, late: str, more: dict[str, Any]
    ) -> Measurement:
        """The share of `limit` (s); `late` says why it is no real time whatever the share."""
        if not wall:
            raise Undefined("no step was computed, so there is no time")
        t = np.array(wall)  # (frames,)
        median, p95, p99 = float(np.median(t)), _within(t, 95.0), _within(t, 99.0)
        fits = p99 <= limit * SLACK
        reason = late or f"99 % of the frames take at most {p99:.3g} s of {limit:.3g} s"
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


def _within(t: np.ndarray[Any, np.dtype[np.float64]], percent: float) -> float:
    """The least of the times t (n,) within which `percent` of them lie."""
    return float(np.percentile(t, percent, method="inverted_cdf"))
