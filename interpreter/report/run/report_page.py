"""HTML page of a run's report: one self-contained file."""

from __future__ import annotations

from collections.abc import Callable

from softmark.interpreter.report.page.html_document import document
from softmark.interpreter.report.page.html_markup import strip_backticks
from softmark.interpreter.report.run.figures import (
    centre_lines,
    comparison_section,
    contact_line_chart,
    contact_time_charts,
    error_histograms,
    line_deviation,
    measured_curves,
    newton_convergence,
    realtime_figure,
    refinement_chart,
    state_charts,
    time_histories,
)
from softmark.interpreter.report.run.report_header import header, title
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables import (
    contact_table,
    expectation_table,
    filled_surface_table,
    frequency_table,
    load_table,
    provenance_table,
    published_table,
    reaction_table,
    region_table,
    scene_listing,
    value_table,
)
from softmark.interpreter.report.view3d import shapes_section
from softmark.interpreter.results.run_report import Report

# id of the section, and the function that makes it (which returns "" if there is nothing to show)
SECTIONS: tuple[tuple[str, Callable[[ReportSummary], str]], ...] = (
    ("shapes", shapes_section.section_of),
    ("figure", centre_lines.section_of),
    ("table", comparison_section.section_of),
    ("refinement", refinement_chart.section_of),
    ("states", state_charts.section_of),
    ("curves", measured_curves.section_of),
    ("along", contact_line_chart.section_of),
    ("values", value_table.section_of),
    ("published", published_table.section_of),
    ("distribution", error_histograms.section_of),
    ("error", line_deviation.section_of),
    ("realtime", realtime_figure.section_of),
    ("histories", time_histories.section_of),
    ("contacts-in-time", contact_time_charts.section_of),
    ("convergence", newton_convergence.section_of),
    ("filled", filled_surface_table.section_of),
    ("bodies", region_table.bodies_section),
    ("regions", region_table.section_of),
    ("varying", region_table.varying_constants),
    ("loads", load_table.section_of),
    ("supports", reaction_table.section_of),
    ("contacts", contact_table.section_of),
    ("modes", frequency_table.section_of),
    ("expectations", expectation_table.expectations),
    ("warnings", expectation_table.warnings),
    ("scene", scene_listing.section_of),
    ("provenance", provenance_table.section_of),
)


def render(report: Report) -> str:
    """Return the page as a complete HTML5 document that needs no network.

    A browser without JavaScript shows the surfaces as still pictures.
    """
    findings = ReportSummary(report)
    sections = [(key, make(findings)) for key, make in SECTIONS]
    return document(
        f"{title(findings)} – softmark report",
        strip_backticks(findings.conclusion),
        header(findings),
        sections,
        "report.json",
        1 + len(findings.all_results),
        *files_of("".join(markup for _, markup in sections)),
    )


def files_of(markup: str) -> tuple[list[str], list[str]]:
    """Return the style sheets and scripts that the sections in `markup` need."""
    shown = 'class="shapes"' in markup
    carried, rigid = 'value="carried"' in markup, '"instruments": [{' in markup
    return (
        ["report.css", *(["shapes.css"] if shown else []), *(["carried.css"] if carried else [])],
        [
            "report.js",
            *(["raster.js"] if shown else []),
            *(["carried.js"] if carried else []),
            *(["instruments.js"] if rigid else []),
            *(["shapes_controls.js", "shapes.js"] if shown else []),
        ],
    )
