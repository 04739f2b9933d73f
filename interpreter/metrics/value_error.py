"""How far a number of a model is from one that was published or measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import OfMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.metrics.measurement import Seen
    from softmark.references.published_values import KnownValue


@dataclass(frozen=True)
class ErrorOfValue(OfMetric):
    """How far the number of a metric is from a value that is given: |found - given|, relative to the size of |given|.

    The value is one that somebody published or measured, a reference `values`, with its uncertainty, or one on which
    codes agreed, a `consensus`, with the band in which they lie. `relative_to =
    uncertainty` tells how many times its uncertainty the two are apart instead: 1 or less is agreement, and it has a
    number where the value is zero. In a sequence of states the number of each is held against the value of that state.

    Of a band it is that on the side on which the number lies, so that 1 or less is inside.

    Its uncertainty is that of the value, in the same terms: an error below it says no more than that the two agree.
    What a model states of the error is what it states of the metric, in the same terms. Beside its value a report has
    what was found, what is given and its uncertainty, found less given with its sign, all in the unit of the metric,
    and whether the difference is within the uncertainty.
    """

    of: Annotated[str, "metric", "the metric whose number is looked at"]
    against: Annotated[str, "reference", "the value, a reference `values` or `consensus`"]
    relative_to: Annotated[Literal["value", "uncertainty"], "what the difference is divided by"] = "value"

    def probe_in(self, scene: Scene) -> str | None:
        """That of the metric whose number it is."""
        probe: str | None = scene.declared[self.of].thing.looked_at
        return probe

    def size(self, given: KnownValue, found: float | None = None) -> float:
        """What the difference is divided by, in the unit of the metric; without a number the least that it may be.

        Raises Undefined.
        """
        if self.relative_to == "value":
            size = abs(given.value)
        else:
            size = min(given.sides) if found is None else given.beside(found)
        if size == 0.0:
            raise Undefined(f"the {self.relative_to} of `{self.against}` is zero, so nothing is relative to it")
        return size

    def measure(self, seen: Seen) -> Measurement:
        """The relative difference. Raises Undefined."""
        given = None if seen.known is None else seen.known.value
        if given is None or seen.number is None:
            raise Undefined(f"`{self.against}` is no value, or there is none to hold against it")
        found, own, size = seen.number.value, seen.number.unit, self.size(given, seen.number.value)
        apart, off = found - given.value, given.beside(found)
        details = {
            f"found_{own}": found, f"given_{own}": given.value, f"uncertainty_{own}": given.uncertainty,
            f"difference_{own}": apart, "within": given.holds(found),
        }  # fmt: skip
        if given.band is not None:
            details |= {f"low_{own}": given.band[0], f"high_{own}": given.band[1], "codes": given.codes}
        return Measurement(abs(apart) / size, details, uncertainty=off / size)
