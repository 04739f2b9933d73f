"""How fast a body vibrates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Seen


@dataclass(frozen=True)
class Frequency(Metric):
    """The frequency of a small vibration about the equilibrium that a static analysis finds, undamped.

    K phi = w^2 M phi with the tangent K under the full load: a body that loads stretch sounds higher than at rest, and
    one that they press lower, down to none where it buckles. Modes are counted from the slowest; those of a round or
    square body come in pairs. The mass is that of the model (`mass` of `fem`); a beam has its mass and the turning of
    its sections at its nodes. Loads do not change the tangent of `strain = small`, which has no frequency under any;
    pressures that follow the surface have no modes. A body with planes of symmetry has those of its modes that are
    symmetric, and not the others, one of which may be slower. The residual of each mode is checked; it is not checked
    by other formulas. The stated error is from a finer space over the cells, of beams and springs from coarser ones.

    Beside its value a report has frequencies_Hz, all up to this mode.

    Source: Bathe (2014), Finite Element Procedures, chapters 10 and 11.
    """

    body: Annotated[str, "body", "the body that vibrates"]
    mode: Annotated[int, "1 in [1, 1000]", "which, from the slowest"] = 1
    unit: ClassVar[str] = "Hz"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: Seen) -> Measurement:
        """Hz. Raises Undefined of references, motions, reduced models and what is unstable."""
        if seen.vibrations is None:
            raise Undefined("it has no tangent of an equilibrium, which a solid, a beam or springs have in statics")
        found = seen.vibrations(self.mode)
        if len(found) < self.mode:
            raise Undefined(f"it has {len(found)} modes")
        return Measurement(float(found[self.mode - 1]), {"frequencies_Hz": found.tolist()})
