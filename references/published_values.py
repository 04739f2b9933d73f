"""Published or measured values written in the scene, each with its uncertainty and its source."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, Self

from softmark.records import dataclass
from softmark.references.reference_base import How, Kind, Reference


class GivenValues(Reference):
    """Base class of values given in a scene with their uncertainties: one, or one for each state of the analysis.

    Derived classes have the fields `values` and `source_`. They list in `lists` the other fields, which are given once
    for all values or once for each value.
    """

    how: ClassVar[How] = "measured"
    source: ClassVar[str] = "the publication named in the scene"
    lists: ClassVar[tuple[str, ...]]
    values: Any

    @property
    def each(self) -> tuple[KnownValue, ...]:
        """Values in SI, one for each state."""
        raise NotImplementedError

    def in_state(self, number: int, value: float) -> Self:
        """Return the reference for one state of the analysis; `number` counts states from 0."""
        count = len(self.values.values)
        if count == 1 or number >= count:  # too few are refused when a scene is checked
            return self
        own = ((name, vars(self)[name]) for name in ("values", *self.lists) if vars(self)[name] is not None)
        one = {n: replace(v, values=(v.values[min(number, len(v.values) - 1)],)) for n, v in own}
        return replace(self, **one)  # type: ignore[type-var]

    def load(self) -> KnownValue:
        """Return the given value, which is the last one if there are several."""
        return self.each[-1]

    def amounts(self, name: str) -> tuple[float, ...]:
        """Return one amount for each value, in the unit of the values, from the field `name`, such as `uncertainty`.

        Entries that the scene gives as fractions are multiplied by the magnitudes of the values.
        """
        share = vars(self)[name].dimension != self.values.dimension
        each = zip(self.values.values, self.entries_per_value(name), strict=True)
        return tuple(u * abs(v) if share else u for v, u in each)

    def entries_per_value(self, name: str) -> tuple[float, ...]:
        """Return the entries of the field `name`, one for each value; the last entry is repeated if needed."""
        own = vars(self)[name].values
        return tuple(own[min(i, len(own) - 1)] for i in range(len(self.values.values)))


@dataclass(frozen=True)
class Values(GivenValues):
    """Published or measured values written in the scene: one, or one for each state of the analysis.

    The metric `value_error` compares a number of a model with them, a displacement, a force, a stress, a frequency: it
    gives their difference, and whether it is within the uncertainty. For an analysis with states a list has a value for
    each, in their order, and a single value holds in every state.

    `uncertainty` is the largest distance of a value from the truth, below which differences are not significant: one
    for all or one for each, an amount in the unit of the values or a fraction of them (an amount if they are plain
    numbers). For a number known only by its printed digits it is half the last digit: 53.4 mm is 53.4 mm +- 0.05 mm.

    `kind` states the kind of truth: a theory, a measurement, computed by one code, digitised from a figure. Results of
    several codes are a `consensus`.
    Source: the publication or the authors of the measurement, given by `source` in the scene.
    """

    values: Annotated[Any, "amounts", "one value with unit, or a list with one value for each state"]
    uncertainty: Annotated[
        Any,
        "amounts in [0, inf)",
        "uncertainty of the values, an amount or a fraction; one for all values, or a list with one for each",
    ]
    source_: Annotated[str, "publication, or authors of the measurement"]
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None
    kind_: Annotated[Literal["published", "theory", "measurement", "one_code", "digitised"], "kind of truth"] = (
        "published"
    )

    lists: ClassVar[tuple[str, ...]] = ("uncertainty",)
    usual: ClassVar[Kind] = "published"
    error_meaning: ClassVar[str] = "uncertainty of a value, in its unit, as stated in the scene"

    @property
    def each(self) -> tuple[KnownValue, ...]:
        """Values with their uncertainties in SI, one for each state."""
        known = zip(self.values.values, self.amounts("uncertainty"), strict=True)
        return tuple(KnownValue(value, own, self.source_) for value, own in known)


@dataclass(frozen=True)
class KnownValue:
    """Given value with its uncertainty, SI.

    For a value on which several `codes` agree, `band` is the smallest and the largest of their values.
    """

    value: float
    uncertainty: float
    source: str
    band: tuple[float, float] | None = None
    codes: int = 0

    @property
    def resolution(self) -> float:
        """Uncertainty of the value, in its unit."""
        return self.uncertainty

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest number that agree with the value."""
        return self.band or (self.value - self.uncertainty, self.value + self.uncertainty)

    @property
    def sides(self) -> tuple[float, float]:
        """Uncertainty below and above the value."""
        if self.band is None:
            return self.uncertainty, self.uncertainty
        return self.value - self.band[0], self.band[1] - self.value

    def uncertainty_towards(self, found: float) -> float:
        """Return the uncertainty below the value if the number `found` is smaller, else the uncertainty above it."""
        return self.sides[found > self.value]

    def holds(self, found: float) -> bool:
        """Return whether the number `found` agrees with the value."""
        if self.band is None:
            return abs(found - self.value) <= self.uncertainty
        return self.band[0] <= found <= self.band[1]
