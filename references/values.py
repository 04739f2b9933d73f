"""Values that somebody published or measured, written in the scene: each with its uncertainty and its source."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Self

from softmark.records import dataclass
from softmark.references.reference import How, Reference


@dataclass(frozen=True)
class Values(Reference):
    """Values that were published or measured, written in the scene: one, or one for each state of the analysis.

    The metric `value_error` holds a number of a model against them, a displacement, a force, a stress, a frequency: it
    tells how far the two are apart, and whether that is within the uncertainty. Of an analysis with states a list has a
    value for each, in their order, and one value alone holds in every state.

    `uncertainty` is how far a value may be from the true one, below which differences say nothing: one for all or one
    for each, an amount in the unit of the values or a share of them (an amount where they are plain numbers). Of a
    number that is known by its printed digits alone it is half the last one: 53.4 mm is 53.4 mm +- 0.05 mm.
    Source: whoever published or measured them, as the scene says by `source`.
    """

    values: Annotated[Any, "amounts", "what is known, with its unit: one, or a list with one for each state"]
    uncertainty: Annotated[
        Any, "amounts in [0, inf)", "how far a value may be from the true one, an amount or a share: one, or a list"
    ]
    source_: Annotated[str, "where it was published, or who measured it"]
    body: Annotated[str | None, "body", "the body, where a scene has several"] = None

    how: ClassVar[How] = "measured"
    kind: ClassVar[str] = "published"
    source: ClassVar[str] = "what the scene says"
    error_meaning: ClassVar[str] = "uncertainty of a value, in its unit, as the scene states it"

    @property
    def each(self) -> tuple[KnownValue, ...]:
        """The values with their uncertainties, SI; without one each, the last holds for those after it."""
        given, own = self.values.values, self.uncertainty.values
        share = self.uncertainty.dimension != self.values.dimension
        shares = ((v, own[min(i, len(own) - 1)]) for i, v in enumerate(given))
        return tuple(KnownValue(v, u * abs(v) if share else u, self.source_) for v, u in shares)

    def in_state(self, number: int, value: float) -> Self:
        """What is known in one state of the analysis, counted from 0."""
        values, own = self.values.values, self.uncertainty.values
        if len(values) == 1 or number >= len(values):  # too few are refused when a scene is checked
            return self
        u = own[min(number, len(own) - 1)]
        return replace(
            self, values=replace(self.values, values=(values[number],)),
            uncertainty=replace(self.uncertainty, values=(u,)),
        )  # fmt: skip

    def load(self) -> KnownValue:
        """The value of this state; the last of several."""
        return self.each[-1]


@dataclass(frozen=True)
class KnownValue:
    """A value and how far it may be from the true one, SI."""

    value: float
    uncertainty: float
    source: str

    @property
    def resolution(self) -> float:
        """Its uncertainty, in its unit."""
        return self.uncertainty
