"""Error of a metric compared with a published or measured value."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import DerivedMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.metrics.measurement import MetricInput
    from softmark.references.published_values import KnownValue


@dataclass(frozen=True)
class ErrorOfValue(DerivedMetric):
    """Error of a metric compared with a given value: |found - given|, relative to |given|.

    The given value is a reference `values`, published or measured, with its uncertainty, or a `consensus` of codes with
    the band in which they lie. With `relative_to = uncertainty` the difference is divided by the uncertainty: 1 or less
    means agreement, and this also works for a given value of zero. In a sequence of states each number is compared with
    the value of that state.

    For a band, the uncertainty is that of the side on which the number lies, so that 1 or less is inside.

    The uncertainty of the error is that of the given value, in the same terms: a smaller error only shows that the two
    agree. The stated error of a model is that of the metric, in the same terms. The report also gives the found value,
    the given value and its uncertainty, and found minus given with its sign, all in the unit of the metric, and whether
    the difference is within the uncertainty.
    """

    of: Annotated[str, "metric", "metric whose value is compared"]
    against: Annotated[str, "reference", "given value: a reference `values` or `consensus`"]
    relative_to: Annotated[Literal["value", "uncertainty"], "divisor of the difference"] = "value"

    def probe_in(self, scene: Scene) -> str | None:
        """Return the name of the probe of the metric `of`, whose value is compared."""
        probe: str | None = scene.declared[self.of].thing.probe_name
        return probe

    def size(self, given: KnownValue, found: float | None = None) -> float:
        """Return the divisor of the difference, in the unit of the compared metric.

        Without `found`, it is the least divisor that is possible. Raises Undefined.
        """
        if self.relative_to == "value":
            size = abs(given.value)
        else:
            size = min(given.sides) if found is None else given.uncertainty_towards(found)
        if size == 0.0:
            raise Undefined(f"the {self.relative_to} of `{self.against}` is zero, so there is no relative error")
        return size

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the difference from the given value, relative to it or to its uncertainty. Raises Undefined."""
        given = None if seen.known is None else seen.known.value
        if given is None or seen.number is None:
            raise Undefined(f"`{self.against}` is not a value, or there is no value to compare with it")
        found, own, size = seen.number.value, seen.number.unit, self.size(given, seen.number.value)
        apart, off = found - given.value, given.uncertainty_towards(found)
        details = {
            f"found_{own}": found, f"given_{own}": given.value, f"uncertainty_{own}": given.uncertainty,
            f"difference_{own}": apart, "within": given.holds(found),
        }  # fmt: skip
        if given.band is not None:
            details |= {f"low_{own}": given.band[0], f"high_{own}": given.band[1], "codes": given.codes}
        return Measurement(abs(apart) / size, details, uncertainty=off / size)
