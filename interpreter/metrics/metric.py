"""What every metric says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from softmark.interpreter.metrics.undefined import Undefined

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.metrics.measurement import Measurement, Seen

    Floats = NDArray[np.float64]


class Metric:
    """A number of an answer; what it looks at are its fields `probe` and `against`, where it has them."""

    last: ClassVar[bool] = False  # whether it looks at the last point of its probe alone

    @property
    def unit(self) -> str:
        """Of its value."""
        raise NotImplementedError(f"{type(self).__name__} has no unit")

    @property
    def uncertain(self) -> bool:
        """Whether an uncertainty of the reference, in m, bounds it."""
        return False

    @property
    def looked_at(self) -> str | None:
        """Its probe; None of one about the computation itself."""
        return vars(self).get("probe")

    @property
    def about(self) -> str | None:
        """The body whose models it asks, where no probe says it; None: all."""
        return vars(self).get("body")

    @property
    def measured_from(self) -> str | None:
        """The reference or model that it is an error from."""
        return vars(self).get("against")

    @property
    def summed_by(self) -> str:
        """What of the values at its points it is."""
        return "max"

    @property
    def direction(self) -> tuple[float, float, float] | None:
        """The one direction that it looks along."""
        return None

    def measure(self, seen: Seen) -> Measurement:
        """Its value, and what else it knows. Raises Undefined, with a reason, where it has none."""
        raise NotImplementedError(f"{type(self).__name__} measures nothing")


class OfDisplacements(Metric):
    """One that is made of displacements at points, and of nothing else."""

    def value(self, X: Floats, u: Floats, reference: Any) -> float:
        """Of material points X (n, 3) and displacements u (n, 3), m, and those of the reference, if it has one."""
        raise NotImplementedError(f"{type(self).__name__} has no value")

    def measure(self, seen: Seen) -> Measurement:
        """Its value. Raises Undefined where the reference has no displacements."""
        from softmark.interpreter.metrics.measurement import Measurement

        if self.measured_from and (seen.known is None or seen.known.u is None):
            raise Undefined(f"the reference `{self.measured_from}` has no displacements there")
        return Measurement(float(self.value(seen.X, seen.u, seen.known.u if seen.known else None)))
