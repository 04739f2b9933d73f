"""Consensus of several codes as a reference: values and curves, with the band that contains the codes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.csv_tables import Columns
from softmark.references.measured_curve import CurveFromFile, MeasuredCurve
from softmark.references.measured_data import Unreadable
from softmark.references.published_values import GivenValues, KnownValue
from softmark.references.reference_base import Kind

if TYPE_CHECKING:
    import numpy as np
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class Consensus(GivenValues):
    """Values on which several codes agree, with the band that contains them: one, or one for each state.

    The metric `value_error` with `relative_to = uncertainty` shows whether a model's number is inside the band. It
    divides the distance between number and value by the distance between value and the end of the band on that side.
    A number inside the band has a `value_error` of 1 or less.

    The band is `spread` on both sides of the value, an amount in its unit or a fraction of it, or reaches from `low` to
    `high` if it is not symmetric. It describes only how far programs that solve the same equations differ: codes may
    agree on a wrong value. For two codes the values themselves are the ends; one code only is no consensus, but
    `values` with `kind = one_code`.
    Source: the publication that collected the codes' results, given by `source` in the scene.
    """

    values: Annotated[Any, "amounts", "one agreed value with unit, or a list with one value for each state"]
    codes: Annotated[int, "1 in [2, 100000]", "number of codes that agreed"]
    source_: Annotated[str, "publication that collected the results of the codes"]
    spread: Annotated[
        Any | None,
        "amounts in [0, inf)",
        "largest distance of codes from the value, an amount or a fraction; one for all values, or a list",
    ] = None
    low: Annotated[Any | None, "amounts", "smallest value of any code; one, or a list with one for each state"] = None
    high: Annotated[Any | None, "amounts", "largest value of any code; one, or a list with one for each state"] = None
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    lists: ClassVar[tuple[str, ...]] = ("spread", "low", "high")
    usual: ClassVar[Kind] = "consensus"
    error_meaning: ClassVar[str] = "difference between codes, in the unit of the value, as stated in the scene"

    @property
    def each(self) -> tuple[KnownValue, ...]:
        """Values with their bands in SI, one for each state."""
        values = self.values.values
        if self.spread is not None:
            off = self.amounts("spread")
            bands = [(v - u, v + u) for v, u in zip(values, off, strict=True)]
        else:
            bands = list(zip(self.entries_per_value("low"), self.entries_per_value("high"), strict=True))
        return tuple(
            KnownValue(v, max(v - low, high - v), self.source_, (low, high), self.codes)
            for v, (low, high) in zip(values, bands, strict=True)
        )


@dataclass(frozen=True)
class ConsensusCurve(CurveFromFile):
    """A curve on which several codes agree, with the band that contains them: force over travel, or over time.

    The table, its columns and units are those of `curve`. The band reaches from the column `low` to the column `high`,
    or is `deviation` or `uncertainty` on both sides of `y`; if every code has a column or a table of its own, the curve
    is their mean and the band one standard deviation between them (over n - 1), and `codes` is their number.
    `curve_error` is the distance of a model from the curve, and reports the fraction of it inside the band.

    The band describes only how far programs that solve the same equations differ: codes may agree on a wrong curve.
    Source: the publication that collected the codes' results, given by `citation` or the data set.
    """

    codes: Annotated[
        int | None, "1 in [2, 100000]", "number of codes that agreed; default: the number of given curves"
    ] = None
    low: Annotated[str, "name of a column with the lower end of the band, in the unit of y"] = ""
    high: Annotated[str, "name of a column with the upper end of the band, in the unit of y"] = ""

    usual: ClassVar[Kind] = "consensus"
    error_meaning: ClassVar[str] = "difference between codes, in the unit of y, as stated in the scene"

    @property
    def code_count(self) -> int:
        """Number of codes in the consensus."""
        return self.codes or self.repeats

    @property
    def uncertainty_columns(self) -> tuple[str, ...]:
        """Names of the table columns that give the band around y."""
        return (*super().uncertainty_columns, *(name for name in (self.low, self.high) if name))

    def load(self, beside: Path | None = None) -> MeasuredCurve:
        """Return the curve in SI, with its band. Raises Unreadable."""
        found = super().load(beside)
        if not (self.low and self.high):
            return found
        ends = []
        for name in (self.low, self.high):
            (one,), _ = replace(self, y=(name,), low="", high="").read(beside)
            ends.append(np.interp(found.x, one.sorted[0], one.sorted[1]))
        return replace(found, band=(ends[0], ends[1]))

    def _value_uncertainties(self, table: Columns, name: str) -> list[float]:
        """Return for each value the distance to the farther end of its band, SI. Raises Unreadable."""
        if not (self.low and self.high):
            return super()._value_uncertainties(table, name)
        rows = list(zip(table.numbers[self.low], table.numbers[name], table.numbers[self.high], strict=True))
        at = next((i for i, (low, y, high) in enumerate(rows) if not low <= y <= high), None)
        if at is not None:
            raise Unreadable(table.name, f"line {table.lines[at]}: {rows[at][1]:.6g} in column `{name}` does not lie"
                             f" from {rows[at][0]:.6g} (`{self.low}`) to {rows[at][2]:.6g} (`{self.high}`)",
                             "the curve must lie within the band in every row")  # fmt: skip
        return [self.y_unit.value * max(y - low, high - y) for low, y, high in rows]
