"""Charts of the residual over Newton iterations, a small one for each model; phases differ by marker and dash."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import groupby

from softmark.interpreter.language.number_formatting import typeset_number
from softmark.interpreter.report.charts.chart_axes import Axis, integer_axis, logarithmic
from softmark.interpreter.report.charts.curve_labels import Point
from softmark.interpreter.report.charts.curve_styles import CurveStyle, phase_look
from softmark.interpreter.report.charts.line_chart import Chart, Curve, legend_sample_svg
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block
from softmark.interpreter.report.page.html_markup import count, join_names, prose, section, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.line_probes import curve_styles
from softmark.interpreter.results.run_report import ModelResult
from softmark.records import dataclass

SYMBOLS = ("phase", "load", "residual", "step")
LEFT, TOP, WIDTH, HEIGHT = 50.0, 30.0, 300.0, 150.0
LEAD = (
    "Residual of equilibrium relative to the forces, before each iteration; the last point is the final residual. "
    "With Newton's method the residual may rise at first before it falls rapidly."
)


@dataclass(frozen=True)
class _Step:
    """Row of an iteration history: the residual before the step, None if it was not finite or is not known."""

    phase: str
    load: float | None
    residual: float | None
    length: float | None


@dataclass(frozen=True)
class _IterationHistory:
    """Iteration history of one model.

    A report keeps only the last part of a long history, which begins with the iteration `first`.
    """

    name: str
    model: ModelResult
    look: CurveStyle

    @cached_property
    def steps(self) -> list[_Step]:
        """Rows of the history that the report has."""
        entries = self.model.solve.get("history") or ()
        return [_Step(str(e.get("phase", "")), e.get("load"), e.get("residual"), e.get("length")) for e in entries]

    @property
    def rows(self) -> list[_Step]:
        """Rows of the history, and a last row with the final residual."""
        return [*self.steps, _Step("reached", None, self.model.solve.get("residual"), None)]

    @property
    def iterations(self) -> int:
        """Number of iterations."""
        return int(self.model.solve.get("iterations") or len(self.steps))

    @property
    def first(self) -> int:
        """Number of the first iteration in the chart."""
        return max(0, self.iterations - len(self.steps))

    @property
    def words(self) -> str:
        """Text on how the iterations ended."""
        end = self.rows[-1].residual
        outcome = f"{self.model.status.replace('_', ' ')}, {count(self.iterations, 'iteration')}"
        reached = "" if end is None else f", residual {typeset_number(f'{end:.2g}')}"
        lost = sum(step.residual is None for step in self.steps)
        crosses = f"; {count(lost, 'residual')} not finite, marked at the top" if lost else ""
        return outcome + reached + crosses + (f"; only the last {len(self.steps)} are drawn" if self.first else "")


def section_of(findings: ReportSummary) -> str:
    """Return the HTML section with the charts; empty if no model has an iteration history."""
    known = curve_styles(findings.report)
    everyone = [_IterationHistory(n, m, known[n]) for n, m in findings.report.models.items()]
    courses = [course for course in everyone if course.steps]
    if not courses:
        return ""
    names = dict.fromkeys(step.phase for course in courses for step in course.steps)
    phases = {phase: phase_look(i) for i, phase in enumerate(names)}
    y = _residual_axis([row.residual for course in courses for row in course.rows])
    charts = tag("div", *(_convergence_figure(i, c, phases, y) for i, c in enumerate(courses)), class_="small-plates")
    lead = tag("p", prose(LEAD), class_="lead")
    silent = [f"`{course.name}`" for course in everyone if not course.steps]
    return section("convergence", "Convergence", lead, _phase_legend(phases), charts, _missing_histories_note(silent))


def _missing_histories_note(names: list[str]) -> str:
    return tag("p", prose(f"No iterations were recorded for {join_names(names)}."), class_="quiet") if names else ""


def _residual_axis(values: Sequence[float | None]) -> Axis:
    """Return the axis of residuals, which all charts share so that they can be compared."""
    positive = [v for v in values if v is not None and v > 0] or [1.0]
    return logarithmic(max(min(positive), 1e-17 * max(positive)), max(positive), "residual", "1", about=5)


def _phase_legend(phases: Mapping[str, CurveStyle]) -> str:
    items = [tag("li", legend_sample_svg(look), tag("span", text(phase))) for phase, look in phases.items()]
    return tag("ul", *items, class_="key")


def _convergence_figure(index: int, course: _IterationHistory, phases: Mapping[str, CurveStyle], y: Axis) -> str:
    last = course.first + len(course.steps)
    chart = Chart(
        f"newton-{index}", f"Convergence of {course.name}",
        f"{course.name} {course.words}. {_phases_in_words(course.steps)}",
        integer_axis(course.first, last, "iteration", 5), y, WIDTH, HEIGHT, tuple(_curves(course, phases, y)),
        under=_nonfinite_residual_marks(course.steps), labels=False, left=LEFT, top=TOP, right=14.0,
    )  # fmt: skip
    caption = prose(f"`{course.name}`: {course.words}.")
    return figure_block(chart, caption, _columns(course), _csv_link(course), legend=False)


def _phases_in_words(steps: Sequence[_Step]) -> str:
    runs = [(phase, len(list(group))) for phase, group in groupby(s.phase for s in steps)]
    shown = [f"{phase} ({count(n, 'iteration')})" for phase, n in runs[:12]]
    more = ["and so on"] if len(runs) > 12 else []
    return f"Phases: {', then '.join([*shown, *more])}."


def _curves(course: _IterationHistory, phases: Mapping[str, CurveStyle], y: Axis) -> Iterator[Curve]:
    """Yield a curve for each uninterrupted part of one phase.

    Each curve extends to the next part, so that the line is continuous.
    """
    rows, start = course.rows, 0
    for phase, group in groupby(step.phase for step in course.steps):
        stop = start + len(list(group))
        points: list[Point | None] = [None] * len(rows)
        for i in range(start, stop + 1):
            points[i] = _point(course.first + i, rows[i].residual, y)
        look = replace(phases[phase], role="model", colour=course.look.colour)
        yield Curve(phase, look, tuple(points), 1, len(SYMBOLS), every=1)
        start = stop


def _point(iteration: int, residual: float | None, y: Axis) -> Point | None:
    return None if residual is None or residual <= 0 else (float(iteration), max(residual, y.low))


def _nonfinite_residual_marks(steps: Sequence[_Step]) -> str:
    """Return the SVG of a cross at the top of the chart for each residual that was not finite."""
    places = [LEFT + WIDTH * i / len(steps) for i, step in enumerate(steps) if step.residual is None]
    crosses = "".join(f"M{x - 4:.1f} {TOP - 4:.0f}l8 8m-8 0l8-8" for x in places)
    return tag("path", class_="lost", d=crosses) if crosses else ""


def _columns(course: _IterationHistory) -> list[ColumnGroup]:
    numbers = [(str(course.first + i),) for i in range(len(course.rows))]
    cells = [(s.phase, _percent(s.load), _format_residual(s.residual), _percent(s.length)) for s in course.rows]
    return [ColumnGroup("iteration", ("iteration",), numbers), ColumnGroup(course.name, SYMBOLS, cells)]


def _format_residual(value: float | None) -> str:
    return "–" if value is None else typeset_number(f"{value:.3g}")


def _percent(value: float | None) -> str:
    return "–" if value is None else typeset_number(f"{value * 100:.4g} %")


def _csv_link(course: _IterationHistory) -> str:
    rows: list[list[Cell]] = [
        [course.first + i, s.phase, s.load, s.residual, s.length] for i, s in enumerate(course.rows)
    ]
    header = ["iteration", "phase", "load", "residual", "length"]
    return csv_link(f"{course.name}-convergence", header, rows)
