"""Comparison section: failures, results table, footnotes, CSV, and the meaning of metrics and references."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.interpreter.language.number_formatting import format_reference_error
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.html_markup import prose, section, tag, text
from softmark.interpreter.report.run.report_bodies import BodyResults, bodies
from softmark.interpreter.report.run.report_summary import (
    MetricColumn,
    ReportSummary,
    Result,
    kind_of_reference,
    value_of,
)
from softmark.interpreter.report.run.tables.error_statement_table import (
    error_statement,
    missing_estimates_sentence,
    verified_forces_sentence,
)
from softmark.interpreter.report.run.tables.metric_details import details_of
from softmark.interpreter.report.run.tables.results_table import (
    SYMBOLS,
    Notes,
    ResultsTable,
    caption,
    sort_metrics,
    stated_error_or_uncertainty,
)
from softmark.interpreter.results.run_report import ReferenceResult, Timing

SIZES = ("nodes", "elements", "dofs")
PARTS = ("median [s]", "min [s]", "max [s]", "runs")


def section_of(findings: ReportSummary) -> str:
    """Return the HTML of the comparison section: failures, results table, footnotes, CSV link and explanations."""
    if not findings.all_results:
        return section("table", "Comparison", tag("p", "No model or reference was run.", class_="quiet"))
    notes, columns = Notes(), sort_metrics(findings.metrics)
    own = bodies(findings)
    tables = "".join(_table(findings, body, notes) for body in own)  # before the notes, which gather in it
    save = _csv_link(findings, columns)
    about = _metric_and_reference_descriptions(findings, columns)
    return section(
        "table",
        "Comparison",
        messages(findings),
        tag("p", caption(findings), class_="quiet about"),
        tables,
        notes.list(),
        error_statements(findings),
        save,
        about,
        details_of(findings),
    )


def error_statements(findings: ReportSummary) -> str:
    """Return the HTML of the errors that models state, and a line on the forces that were verified independently."""
    models = findings.report.models.items()
    said = [tag("li", tag("code", text(name)), " ", prose(w)) for name, m in models if (w := error_statement(m))]
    said += [tag("li", prose(quiet))] if (quiet := missing_estimates_sentence(findings.report)) else []
    again = verified_forces_sentence(findings.report)
    stated = tag("ul", *said, class_="notes") if said else ""
    return stated + (tag("p", text(again), class_="quiet about") if again else "")


def _table(findings: ReportSummary, body: BodyResults, notes: Notes) -> str:
    """Return the HTML results table of one body, with the name of the body as its title if there are several."""
    heading = tag("h3", prose(f"`{body.name}`")) if body.name else ""
    return heading + ResultsTable(findings, body, notes).html()


def messages(findings: ReportSummary) -> str:
    """Return the full messages of all models and references that have no solution."""
    everyone = findings.all_results.items()
    return "".join(_message(n, r) for n, r in everyone if r.status != "converged" or r.message)


def _message(name: str, result: Result) -> str:
    symbol, mood, ended = SYMBOLS.get(result.status, ("?", "quiet", result.status))
    who = tag("p", tag("b", f"{symbol} ", tag("code", text(name)), f" {text(ended)}"))
    said = prose(result.message or "No reason given.")
    return tag("div", who, tag("p", said), class_=f"callout {mood}")


def _metric_and_reference_descriptions(findings: ReportSummary, columns: Sequence[MetricColumn]) -> str:
    """Return descriptions of the metrics and the references."""
    items = [_metric_description(m) for m in columns if m.summary]
    items += [_reference_description(n, r) for n, r in findings.report.references.items()]
    return tag("dl", *items, class_="meanings") if items else ""


def _metric_description(metric: MetricColumn) -> str:
    where = f"At probe `{metric.probe}`" + (f", against `{metric.against}`." if metric.against else ".")
    part = f" Of {metric.part}." if metric.part else ""
    return _definition_entry(metric.name, f"{metric.summary} {where if metric.probe else ''}{part}")


def _reference_description(name: str, reference: ReferenceResult) -> str:
    error, said_kind = reference.estimated_error, kind_of_reference(reference)
    own = "" if error is None else f" Error of the reference: {format_reference_error(error)}."
    said = str(reference.facts.get("said") or "")
    own += f" {said[:1].upper()}{said[1:]}." if said else ""
    return _definition_entry(name, f"{said_kind[:1].upper()}{said_kind[1:]}: {reference.source}.{own}")


def _definition_entry(name: str, words: str) -> str:
    return tag("div", tag("dt", tag("code", text(name))), tag("dd", prose(words)))


def _csv_link(findings: ReportSummary, columns: Sequence[MetricColumn]) -> str:
    """Return an HTML link to a CSV file with all numbers of the results table, in SI."""
    clocks = sorted({k for m in findings.report.models.values() for k, timing in m.time.items() if timing})
    header = ["name", "kind", "status", "message", "about", *(f"{m.name} [{m.unit}]" for m in columns)]
    uncertain = [m for m in columns if findings.uncertainty(m)]
    header += [f"{m.name} within the uncertainty" for m in uncertain]
    said = [
        m for m in columns if any(stated_error_or_uncertainty(r, m) is not None for r in findings.all_results.values())
    ]
    header += [f"{m.name} stated error [{m.unit}]" for m in said]
    header += [*SIZES, "iterations", "residual"]
    header += [f"{clock.removesuffix('_s')} {part}" for clock in clocks for part in PARTS]
    rows = [_csv_row(n, r, columns, uncertain, said, clocks) for n, r in findings.all_results.items()]
    return csv_link("comparison", header, rows, "Save this table as CSV")


def _csv_row(
    name: str,
    result: Result,
    columns: Sequence[MetricColumn],
    uncertain: Sequence[MetricColumn],
    said: Sequence[MetricColumn],
    clocks: Sequence[str],
) -> list[Cell]:
    metrics: list[Cell] = [value_of(result, m.name) for m in columns]
    metrics += [_within_uncertainty_cell(result, m) for m in uncertain]
    metrics += [stated_error_or_uncertainty(result, m) for m in said]
    if isinstance(result, ReferenceResult):
        none: list[Cell] = [None] * (len(SIZES) + 2 + len(PARTS) * len(clocks))
        return [name, "reference", result.status, result.message, result.about, *metrics, *none]
    row: list[Cell] = [name, "model", result.status, result.message, result.outline, *metrics]
    row += [result.size.get(k) for k in SIZES]
    row += [result.solve.get("iterations"), result.solve.get("residual")]
    return row + [cell for clock in clocks for cell in _timing_cells(result.time.get(clock))]


def _within_uncertainty_cell(result: Result, metric: MetricColumn) -> str | None:
    found = result.metrics.get(metric.name)
    return None if found is None or found.value is None else "no" if found.meaningful else "yes"


def _timing_cells(timing: Timing | None) -> list[Cell]:
    return [None] * len(PARTS) if timing is None else [*timing.to_json().values()]
