"""Natural frequencies of a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import MetricInput


@dataclass(frozen=True)
class Frequency(Metric):
    """Natural frequency of a small undamped vibration about the static equilibrium.

    K phi = w^2 M phi with the tangent K under the full load: tension raises the frequencies and compression lowers
    them, down to zero where the body buckles. Modes are numbered from the lowest; those of a round or square body come
    in pairs. The mass is that of the model (`mass` of `fem`); a beam has its mass and the rotational inertia of its
    sections at its nodes. With `strain = small`, loads do not change the tangent, and the metric is undefined under any
    load. Pressures that follow the surface have no modes. A body with symmetry planes has only its symmetric modes; an
    antisymmetric mode may be lower. The residual of each mode is checked, but no independent formulas verify it. The
    stated error comes from a finer space over the cells; for beams and springs from coarser ones.

    The report also gives frequencies_Hz, all frequencies up to this mode.

    Source: Bathe (2014), Finite Element Procedures, chapters 10 and 11.
    """

    body: Annotated[str, "body", "the body that vibrates"]
    mode: Annotated[int, "1 in [1, 1000]", "mode number, from the lowest frequency"] = 1
    unit: ClassVar[str] = "Hz"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the natural frequency, Hz.

        Raises Undefined for references, dynamic analyses, reduced models and unstable states.
        """
        if seen.vibrations is None:
            raise Undefined("frequencies need a static equilibrium of a solid, a beam or a spring network")
        found = seen.vibrations(self.mode)
        if len(found) < self.mode:
            raise Undefined(f"the model has only {len(found)} vibration modes")
        return Measurement(float(found[self.mode - 1]), {"frequencies_Hz": found.tolist()})
