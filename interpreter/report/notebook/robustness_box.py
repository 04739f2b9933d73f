"""Notebook display of a robustness study: silently wrong points, and the range in which each model is right."""

from __future__ import annotations

from softmark.interpreter.report.notebook.box_frame import ROWS, drawing_or_note, isolated_frame, render_box, verdict
from softmark.interpreter.report.page.html_markup import prose, tag
from softmark.interpreter.report.robustness.robustness_page import (
    conclusion,
    silent_points_section,
    strips,
    validity_range_tables,
)
from softmark.interpreter.study.robustness.robustness_record import Robustness

WHERE = "`stress.write(FOLDER)`"


def inline(stress: Robustness) -> str:
    """Return the display of a robustness study as HTML of bounded size."""
    said = [verdict("bad" if stress.silent else "good", conclusion(stress))]
    said += [silent_points_section(stress, ROWS)] if stress.silent else []
    left = len(stress.silent) - ROWS
    said += [tag("p", prose(f"{left} more are in `stress.silent`."), class_="quiet")] if left > 0 else []
    tables = drawing_or_note(validity_range_tables(stress), "", WHERE)
    drawn = strips(stress)
    if drawn:
        drawn = isolated_frame("Along each quantity", drawn, ["report.css", "stress.css"], ["report.js"])
        drawn = drawing_or_note(drawn, "".join((*said, tables)), WHERE)
    rest = f"All tested points are in `stress.points`. The full page also says how to extend the ranges: {WHERE}."
    return render_box(str(stress.scene["title"]), *said, tables, drawn, tag("p", prose(rest), class_="quiet"))
