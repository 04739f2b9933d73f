"""Numbers of models beside values that were published or measured: the difference, and whether it means something."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from softmark.interpreter.language.amounts import quantity, signed
from softmark.interpreter.report.page.markup import listed, prose, tag, text
from softmark.interpreter.report.page.sheet import Cell, csv_link
from softmark.interpreter.report.run.findings import Findings, MetricColumn
from softmark.interpreter.report.run.tables.metric_details import unit_of
from softmark.interpreter.report.run.tables.shared import row_head, table_section
from softmark.interpreter.results.report import MetricResult
from softmark.interpreter.results.states import percent
from softmark.records import dataclass

LEAD = (
    "Numbers beside the values that the scene gives with their uncertainty; the difference is what was found less what"
    " is given, and below it in per cent of that."
)
HEADS = ("Number", "By", "Found", "Given", "Uncertainty", "Difference", "Within the uncertainty")


@dataclass(frozen=True)
class _Held:
    """One number that is held against a value, SI; `state` as people read it, "" of a scene in one situation."""

    metric: str
    owner: str
    state: str
    unit: str
    found: float
    given: float
    uncertainty: float
    within: bool

    @property
    def difference(self) -> float:
        """Found less given."""
        return self.found - self.given

    def row(self) -> str:
        """Of the table."""
        amounts = [tag("td", text(quantity(v, self.unit, 5)), class_="n") for v in (self.found, self.given)]
        share = tag("small", text(_percent(self.difference / abs(self.given)))) if self.given else ""
        apart = text(("+" if self.difference > 0.0 else "") + quantity(self.difference, self.unit, 3))
        who = tag("td", tag("code", text(self.owner)), text(f", {self.state}" if self.state else ""))
        own = tag("td", text(f"± {quantity(self.uncertainty, self.unit, 3)}"), class_="n")
        verdict = tag("td", "yes" if self.within else "no")
        return tag("tr", row_head(self.metric), who, *amounts, own, tag("td", apart, share, class_="n"), verdict)

    def cells(self) -> list[Cell]:
        """Of the CSV file."""
        told = "yes" if self.within else "no"
        return [self.metric, self.owner, self.state or None, self.unit, self.found, self.given, self.uncertainty,
                self.difference, told]  # fmt: skip


def _percent(share: float) -> str:
    return ("+" if share > 0.0 else "") + signed(f"{100.0 * share:.3g} %")


def section_of(findings: Findings) -> str:
    """The table; empty where no value is given."""
    held = [one for metric in findings.metrics for one in _of(findings, metric)]
    if not held:
        return ""
    header = ["metric", "name", "state", "unit", "found", "given", "uncertainty", "difference", "within"]
    save = csv_link("values", header, [one.cells() for one in held], "Save this table as CSV")
    return table_section("Values", LEAD, HEADS, [one.row() for one in held], _sources(findings) + save)


def _of(findings: Findings, metric: MetricColumn) -> Iterator[_Held]:
    """Everyone's, in every state."""
    for name, result in findings.everyone.items():
        each: list[tuple[str, Mapping[str, MetricResult]]] = [("", result.metrics)]
        for i, value in enumerate(result.states):
            each = [*(each if i else ()), (percent(value), result.each[i].metrics)]
        for state, metrics in each:
            found = metrics.get(metric.name)
            if found is not None and (told := _told(found.details)) is not None:
                unit, number, given, uncertainty, within = told
                yield _Held(metric.name, name, state, unit, number, given, uncertainty, within)


def _told(details: Mapping[str, Any]) -> tuple[str, float, float, float, bool] | None:
    """Unit, what was found and what is given, its uncertainty, and whether it is within; None of other metrics."""
    key = next((key for key in details if key.startswith("given_")), None)
    if key is None:
        return None
    end = key.removeprefix("given_")
    numbers = [float(details[f"{word}_{end}"]) for word in ("found", "given", "uncertainty")]
    return unit_of(key) or "1", numbers[0], numbers[1], numbers[2], bool(details["within"])


def _sources(findings: Findings) -> str:
    """Who says so."""
    same: dict[str, list[str]] = {}
    for name, reference in findings.report.references.items():
        if "value" in reference.facts:
            same.setdefault(reference.source, []).append(f"`{name}`")
    items = [tag("li", prose(f"{listed(names)}: {said}")) for said, names in same.items()]
    return tag("ul", *items, class_="notes sources") if items else ""
