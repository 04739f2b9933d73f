"""Notebook display of a report: verdicts, models and metrics with units and stated errors, then deformed shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from softmark.interpreter.report.notebook.box_frame import ROWS, drawing_or_note, isolated_frame, render_box, verdict
from softmark.interpreter.report.page.figure_frame import details
from softmark.interpreter.report.page.html_markup import count, prose, tag
from softmark.interpreter.report.run.figures.comparison_section import error_statements, messages
from softmark.interpreter.report.run.report_bodies import BodyResults, bodies
from softmark.interpreter.report.run.report_header import title
from softmark.interpreter.report.run.report_page import files_of
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables import expectation_table
from softmark.interpreter.report.run.tables.results_table import Notes, ResultsTable
from softmark.interpreter.report.view3d import shapes_section
from softmark.interpreter.report.view3d.compact_surfaces import POINTS
from softmark.interpreter.results.run_report import ExpectationResult, Report

SHAPES = 24  # largest number of shapes drawn
ROOM = 400_000  # bytes of all shapes
EACH = 30  # bytes of a point with its triangles and its error
WHERE = "`report.write(FOLDER)`"


def inline(report: Report) -> str:
    """Return the display of a report as HTML of bounded size."""
    # without the text of the scene line numbers are no links: the display has no listing
    findings = ReportSummary(replace(report, scene={**report.scene, "text": ""}))
    mood, ended = findings.status
    above = [verdict(mood, f"{ended}."), tag("p", prose(findings.conclusion))]
    above += [_expectations(findings), messages(findings), _warning_summary(findings), *_results(findings)]
    drawn = _shapes(findings)
    drawn = drawing_or_note(drawn, "".join(above), WHERE) if drawn else ""
    return render_box(title(findings), *above, drawn, _omitted_content_note(findings))


def _warning_summary(findings: ReportSummary) -> str:
    """Return the number of warnings as HTML, which opens to a list of the first ones."""
    warnings = findings.report.warnings
    if not warnings:
        return ""
    return details(count(len(warnings), "warning"), expectation_table.warning_list(warnings[:ROWS]))


def _expectations(findings: ReportSummary) -> str:
    """Return the table of expectations; those not met come first if there are too many to show."""
    judged = findings.report.expectations
    if not judged:
        return ""
    if len(judged) <= ROWS:
        return expectation_table.table_of(findings)
    first = sorted(judged, key=_expectation_sort_key)[:ROWS]
    some = ReportSummary(replace(findings.report, expectations=tuple(sorted(first, key=lambda e: e.line))))
    left = f"{len(judged) - ROWS} more expectations are in `report.expectations`."
    return expectation_table.table_of(some) + tag("p", prose(left), class_="quiet")


def _expectation_sort_key(e: ExpectationResult) -> int:
    return 0 if e.passed is False else 1 if e.passed is None else 2


def _results(findings: ReportSummary) -> Sequence[str]:
    """Return for each body a table of results, then footnotes and the errors that models state."""
    if not findings.all_results:
        return ()
    notes = Notes(linked=False)
    tables = [_table(findings, body, notes) for body in bodies(findings)]
    return *tables, notes.list(), error_statements(findings)


def _table(findings: ReportSummary, body: BodyResults, notes: Notes) -> str:
    """Return the table of a body under its name; if there are many results, only the first."""
    heading = tag("p", tag("b", prose(f"`{body.name}`"))) if body.name else ""
    few = replace(body, results=body.results[:ROWS])
    more = len(body.results) - len(few.results)
    left = tag("p", prose(f"{more} more rows are in `report.frame()`."), class_="quiet") if more else ""
    return heading + ResultsTable(findings, few, notes).html() + left


def _shapes(findings: ReportSummary) -> str:
    """Return the view of deformed shapes, fewer and coarser than on the page; empty if there are none."""
    report = findings.report
    shaped = [n for n in (*report.references, *report.models) if findings.all_results[n].shape is not None]
    few = shaped[:SHAPES]
    if not few:
        return ""
    models = {n: r for n, r in report.models.items() if n in few}
    references = {n: r for n, r in report.references.items() if n in few}
    some = ReportSummary(replace(report, models=models, references=references))
    markup = shapes_section.section_of(some, max(300, min(POINTS, ROOM // (EACH * len(few)))), ROOM, stills=False)
    left = f"{len(shaped) - len(few)} more shapes are on the page that {WHERE} writes."
    more = tag("p", prose(left), class_="quiet") if len(shaped) > len(few) else ""
    return (isolated_frame("Deformed shapes", markup, *files_of(markup)) if markup else "") + more


def _omitted_content_note(findings: ReportSummary) -> str:
    """Return a sentence about the content of the report that is not shown."""
    said = f"Numbers as a table: `report.frame()`; the full page, with curves and sources: {WHERE}."
    return tag("p", prose(said), class_="quiet")
