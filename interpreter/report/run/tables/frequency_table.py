"""Table of natural frequencies of a body: a row for each mode, a column for each model."""

from __future__ import annotations

from softmark.interpreter.language import units
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.html_markup import tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.table_section import table_section

LEAD = (
    "Natural frequencies of small undamped vibrations about the equilibrium, lowest first. Mode shapes are not "
    "compared: if two frequencies are close, their order may differ between models."
)
WORD = "frequency"  # constructor of the metric that requests frequencies
MOST = 40  # modes that are shown
NOTHING = "\N{EN DASH}"
HERTZ: units.Dimension = units.raise_dimension(units.TIME, -1)


def section_of(findings: ReportSummary) -> str:
    """Return an HTML table for each body; empty if no metric requests frequencies."""
    known = _model_frequencies(findings)
    if not known:
        return ""
    count = max(map(len, known.values()))
    shown = min(count, MOST)
    rows = [_row(i, [own[i] if i < len(own) else None for own in known.values()]) for i in range(shown)]
    left = f" The first {shown} of {count} are shown." if shown < count else ""
    saved: list[list[Cell]] = [
        [i + 1, *(own[i] if i < len(own) else None for own in known.values())] for i in range(count)
    ]
    link = csv_link("modes", ["mode", *(f"{name} [Hz]" for name in known)], saved)
    return table_section("Modes", LEAD + left, ("Mode", *known), rows, link)


def _model_frequencies(findings: ReportSummary) -> dict[str, list[float]]:
    """Return the natural frequencies of each model, Hz, from the metric that requests most of them."""
    found: dict[str, list[float]] = {}
    asked = [m.name for m in findings.metrics if (own := findings.declared.get(m.name)) and own.word == WORD]
    for name, model in findings.report.models.items():
        for metric in asked:
            result = model.metrics.get(metric)
            tones = list(result.details.get("frequencies_Hz") or ()) if result is not None else []
            found[name] = max(found.get(name, []), tones, key=len)
    return {name: tones for name, tones in found.items() if tones}


def _row(i: int, tones: list[float | None]) -> str:
    cells = [NOTHING if t is None else units.format_value(float(f"{t:.5g}"), HERTZ) for t in tones]
    return tag("tr", tag("th", text(str(i + 1)), scope="row"), *(tag("td", text(c), class_="n") for c in cells))
