"""Details of metrics besides their value, such as spreads, extremes and counts, for every model and reference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language.number_formatting import format_quantity, group_digits
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.figure_frame import details
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary

UNITS = {
    "m": "m",
    "s": "s",
    "Hz": "Hz",
    "J": "J",
    "Pa": "Pa",
    "kg": "kg",
    "N": "N",
    "Nm": "N*m",
    "m2": "m^2",
    "m3": "m^3",
    "rad": "rad",
}
SHARES = ("relative", "ratio", "share", "margin", "fraction")


def details_of(findings: ReportSummary) -> str:
    """Return the HTML of a table of details for each metric that has any, and one CSV file with all details.

    Each table opens on demand.
    """
    tables = [_table(findings, m) for m in findings.metrics]
    found = [table for table in tables if table]
    return tag("div", *found, _csv_link(findings), class_="metric-details") if found else ""


def unit_of(key: str) -> str:
    """Return the unit of a detail from the end of its name, such as `p95_m`, `limit_s`.

    The unit is `1` for fractions and "" for details without a unit.
    """
    if any(word in key for word in SHARES) and not key.endswith("_points"):
        return "1"
    return UNITS.get(key.rpartition("_")[2], "") if "_" in key else ""


def _detail_name(key: str) -> str:
    """Return a readable name of a detail: `p95` for `p95_m`, `relative mean` for `relative_mean`."""
    head, _, last = key.rpartition("_")
    return (head if head and last in UNITS else key).replace("_", " ")


def _details_by_result(findings: ReportSummary, metric: MetricColumn) -> dict[str, Mapping[str, Any]]:
    """Return the details of a metric, by model or reference."""
    found = {n: r.metrics.get(metric.name) for n, r in findings.all_results.items()}
    return {n: m.details for n, m in found.items() if m is not None and m.details}


def _table(findings: ReportSummary, metric: MetricColumn) -> str:
    known = _details_by_result(findings, metric)
    if not known:
        return ""
    keys = list(dict.fromkeys(k for own in known.values() for k in own))
    head = tag("tr", tag("th", "Name", scope="col"), *(tag("th", text(_detail_name(k)), scope="col") for k in keys))
    rows = [_row(name, own, keys) for name, own in known.items()]
    caption = tag("caption", tag("span", prose(f"Details of `{metric.name}`. {metric.summary}")))
    table = tag("table", caption, tag("thead", head), tag("tbody", *rows))
    box = tag("div", table, class_="scroll", tabindex=0, role="region", aria_label=f"Details of {metric.name}")
    return details(f"Details of {metric.name}", box)


def _row(name: str, own: Mapping[str, Any], keys: list[str]) -> str:
    cells = [tag("td", text(_format_detail(key, own.get(key))), class_=_alignment_class(own.get(key))) for key in keys]
    return tag("tr", tag("th", tag("code", text(name)), scope="row"), *cells)


def _alignment_class(value: Any) -> str | None:
    return "n" if isinstance(value, (int, float)) and not isinstance(value, bool) else None


def _format_detail(key: str, value: Any) -> str:
    """Return the value of a detail as text."""
    if value is None or value == "":
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return group_digits(value)
    if isinstance(value, float):
        unit = unit_of(key)
        return format_quantity(value, unit or "1", 4, percent=unit == "1")
    return ", ".join(str(v) for v in value) if isinstance(value, (list, tuple)) else str(value)


def _csv_link(findings: ReportSummary) -> str:
    """Return an HTML link to a CSV file with all details of the metrics of all models and references."""
    rows: list[list[Cell]] = [
        [name, metric.name, key, _csv_cell(value), unit_of(key) or None]
        for metric in findings.metrics
        for name, own in _details_by_result(findings, metric).items()
        for key, value in own.items()
    ]
    return csv_link("details", ["name", "metric", "detail", "value", "unit"], rows, "Save all details as CSV")


def _csv_cell(value: Any) -> Cell:
    return value if value is None or isinstance(value, (int, float, str)) else str(value)
