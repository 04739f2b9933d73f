"""Table of computed numbers next to given values and consensus bands, with the difference and its verdict."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from softmark.interpreter.language.number_formatting import format_quantity, typeset_number
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.html_markup import join_names, prose, tag, text
from softmark.interpreter.report.run.figures.tolerance_bands import Band
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary, Result, kind_of_reference
from softmark.interpreter.report.run.tables.metric_details import unit_of
from softmark.interpreter.report.run.tables.table_section import row_head, table_section
from softmark.interpreter.results.state_results import format_state
from softmark.records import dataclass

LEAD = (
    "Computed numbers and the given values with their uncertainty, or with the band of codes; the difference is "
    "computed minus given, also in per cent of the given value. The drawing shows the band, the given value (line) and "
    "the computed number (diamond; an arrow if it is far outside)."
)
HEADS = ("Number", "By", "Found", "Given", "Uncertainty", "Difference", "Within", "")


@dataclass(frozen=True)
class _ComparedValue:
    """Computed number compared with a given value, in SI; `state` is the state in words, "" without states."""

    metric: str
    owner: str
    state: str
    unit: str
    found: float
    given: float
    uncertainty: float
    within: bool
    kind: str  # kind of the given value: `consensus of 3 codes`
    band: tuple[float, float] | None

    @property
    def ends(self) -> tuple[float, float]:
        """Interval of numbers that agree with the given value."""
        return self.band or (self.given - self.uncertainty, self.given + self.uncertainty)

    @property
    def difference(self) -> float:
        """Computed minus given value, SI."""
        return self.found - self.given

    def row(self, everyone: Sequence[float]) -> str:
        """Return the table row as HTML; `everyone` are all numbers compared with the same value."""
        found, given = (text(format_quantity(v, self.unit, 5)) for v in (self.found, self.given))
        amounts = [tag("td", found, class_="n"), tag("td", given, tag("small", text(self.kind)), class_="n")]
        share = tag("small", text(_percent(self.difference / abs(self.given)))) if self.given else ""
        apart = text(("+" if self.difference > 0.0 else "") + format_quantity(self.difference, self.unit, 3))
        who = tag("td", tag("code", text(self.owner)), text(f", {self.state}" if self.state else ""))
        own = tag("td", text(self.uncertainty_text), class_="n")
        verdict = tag("td", "yes" if self.within else "no")
        said = f"{'inside' if self.within else 'outside'} {self.uncertainty_text}"
        drawn = tag("td", Band(self.given, self.ends, tuple(everyone)).render_svg(self.found, said))
        return tag("tr", row_head(self.metric), who, *amounts, own, tag("td", apart, share, class_="n"), verdict, drawn)

    @property
    def uncertainty_text(self) -> str:
        """Return the uncertainty of the given value, or its band, as text."""
        if self.band is None:
            return f"± {format_quantity(self.uncertainty, self.unit, 3)}" if self.uncertainty else "exact"
        return f"{format_quantity(self.band[0], self.unit, 5)} to {format_quantity(self.band[1], self.unit, 5)}"

    def cells(self) -> list[Cell]:
        """Return the cells of this value's row in the CSV file."""
        told = "yes" if self.within else "no"
        return [self.metric, self.owner, self.state or None, self.unit, self.found, self.given, self.uncertainty,
                self.difference, told, self.kind, *self.ends]  # fmt: skip


def _percent(share: float) -> str:
    return ("+" if share > 0.0 else "") + typeset_number(f"{100.0 * share:.3g} %")


def section_of(findings: ReportSummary) -> str:
    """Return the HTML section with the table; empty if no value is given."""
    held = [one for metric in findings.metrics for one in _comparisons_of_metric(findings, metric)]
    if not held:
        return ""
    header = [
        "metric",
        "name",
        "state",
        "unit",
        "found",
        "given",
        "uncertainty",
        "difference",
        "within",
        "kind",
        "low",
        "high",
    ]
    save = csv_link("values", header, [one.cells() for one in held], "Save this table as CSV")
    same: dict[tuple[object, ...], list[float]] = {}
    for one in held:
        same.setdefault((one.metric, one.state), []).append(one.found)
    rows = [one.row(same[one.metric, one.state]) for one in held]
    return table_section("Values", LEAD, HEADS, rows, _sources(findings) + save)


def _comparisons_of_metric(findings: ReportSummary, metric: MetricColumn) -> Iterator[_ComparedValue]:
    """Yield the comparisons of a metric with its given value, for all models and states."""
    for name, result in findings.all_results.items():
        in_each: Sequence[Result] = result.each
        each = [(format_state(value), own.metrics) for value, own in zip(result.states, in_each, strict=True)]
        for state, metrics in each or [("", result.metrics)]:
            found = metrics.get(metric.name)
            if found is not None and (told := _comparison_details(found.details)) is not None:
                yield _ComparedValue(metric.name, name, state, *told[:5], kind_of(findings, metric.name), told[5])


def kind_of(findings: ReportSummary, metric: str) -> str:
    """Return the kind of the reference of a metric, such as `consensus of 3 codes`."""
    named = findings.declared.get(metric)
    reference = findings.report.references.get((named.against if named else None) or "")
    return "" if reference is None else kind_of_reference(reference)


_Told = tuple[str, float, float, float, bool, tuple[float, float] | None]


def _comparison_details(details: Mapping[str, Any]) -> _Told | None:
    """Return unit, computed and given value, uncertainty, verdict and band; None without a given value."""
    key = next((key for key in details if key.startswith("given_")), None)
    if key is None:
        return None
    end = key.removeprefix("given_")
    numbers = [float(details[f"{word}_{end}"]) for word in ("found", "given", "uncertainty")]
    low, high = (details.get(f"{word}_{end}") for word in ("low", "high"))
    band = None if low is None or high is None else (float(low), float(high))
    return unit_of(key) or "1", numbers[0], numbers[1], numbers[2], bool(details["within"]), band


def _sources(findings: ReportSummary) -> str:
    """Return the sources of the given values."""
    same: dict[str, list[str]] = {}
    for name, reference in findings.report.references.items():
        if "value" in reference.facts:
            same.setdefault(f"{kind_of_reference(reference)}; {reference.source}", []).append(f"`{name}`")
    items = [tag("li", prose(f"{join_names(names)}: {said}")) for said, names in same.items()]
    return tag("ul", *items, class_="notes sources") if items else ""
