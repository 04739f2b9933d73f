"""Notebook display of a robustness study: silently wrong points, and the range in which each model is right."""

from __future__ import annotations

from softmark.interpreter.report.notebook.box_frame import ROWS, if_it_fits, isolated_frame, shell, verdict
from softmark.interpreter.report.page.html_markup import prose, tag
from softmark.interpreter.report.robustness.robustness_page import conclusion, edges, silent_points_section, strips
from softmark.interpreter.study.robustness.robustness_record import Robustness

WHERE = "`stress.write(FOLDER)`"


def inline(stress: Robustness) -> str:
    """Return the display of a robustness study as HTML of bounded size."""
    said = [verdict("bad" if stress.silent else "good", conclusion(stress))]
    said += [silent_points_section(stress, ROWS)] if stress.silent else []
    left = len(stress.silent) - ROWS
    said += [tag("p", prose(f"{left} more are in `stress.silent`."), class_="quiet")] if left > 0 else []
    tables = if_it_fits(edges(stress), "", WHERE)
    drawn = strips(stress)
    if drawn:
        drawn = isolated_frame("Along each quantity", drawn, ["report.css", "stress.css"], ["report.js"])
        drawn = if_it_fits(drawn, "".join((*said, tables)), WHERE)
    rest = f"All tested points are in `stress.points`. The full page also says how to extend the ranges: {WHERE}."
    return shell(str(stress.scene["title"]), *said, tables, drawn, tag("p", prose(rest), class_="quiet"))
