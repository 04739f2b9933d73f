"""Notebook display of a comparison: recommendation, all configurations, and error against effort."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.interpreter.report.comparison.comparison_page import advice, conclusion, diagrams, title
from softmark.interpreter.report.comparison.comparison_tables import configurations
from softmark.interpreter.report.comparison.comparison_view import SceneView, views
from softmark.interpreter.report.notebook.box_frame import ROWS, drawing_or_note, isolated_frame, render_box
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord

WHERE = "`comparison.write(FOLDER)`"


def inline(comparison: ComparisonRecord) -> str:
    """Return the display of a comparison as HTML of bounded size."""
    own = views(comparison)
    said = [tag("p", prose(conclusion(own))), advice(own, comparison)]
    tables = [_table(view, own) for view in own if view.points]
    drawn = diagrams(own)
    if drawn:
        curves = max((len(view.lines) for view in own), default=0)
        drawn = isolated_frame("Work and precision", drawn, ["report.css", "compare.css"], ["report.js"], curves)
        drawn = drawing_or_note(drawn, "".join((*said, *tables)), WHERE)
    rest = (
        f"All points and their analysis are in `comparison.points` and `comparison.analysis`; the full page: {WHERE}."
    )
    return render_box(title(own), *said, *tables, drawn, tag("p", prose(rest), class_="quiet"))


def _table(view: SceneView, own: Sequence[SceneView]) -> str:
    """Return the table of the configurations of a scene; if there are many, only the first."""
    heading = tag("p", tag("b", text(view.heading))) if len(own) > 1 else ""
    left = len(view.distinct_points) - ROWS
    more = tag("p", prose(f"{left} more are in `comparison.points`."), class_="quiet") if left > 0 else ""
    return heading + configurations(view, ROWS) + more
