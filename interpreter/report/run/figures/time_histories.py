"""Time histories: displacements of probes, energies, and events such as halved time steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from softmark.interpreter.language.number_formatting import choose_decimals, choose_scale, format_quantity
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block
from softmark.interpreter.report.page.html_markup import prose, section, tag, text
from softmark.interpreter.report.run.figures.energy_charts import energy_charts_html
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.line_probes import AXES, Floats, curve_styles, initially_shown
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.run_report import ProbeResult
from softmark.records import dataclass

DRAWN = 301  # largest number of times of a curve
SAVED = 8000  # largest number of rows of a CSV file
WIDTH, HEIGHT = 640.0, 300.0


def section_of(findings: ReportSummary) -> str:
    """Return the HTML section of charts over time; empty if nothing has a history."""
    every = point_histories(findings)
    charts = [course.render_figure() for course in {course.about: course for course in reversed(every)}.values()][::-1]
    energies, events = energy_charts_html(findings), _events(findings)
    if not charts and not energies and not events:
        return ""
    return section("histories", "Over time", *charts, energies, events)


def point_histories(findings: ReportSummary) -> list[PointHistory]:
    """Return the displacement histories of all probes that have one."""
    courses = [(n, seen) for n in findings.probes if (seen := _probe_histories(findings, n))]
    return [PointHistory(findings, i, name, seen) for i, (name, seen) in enumerate(courses)]


def _probe_histories(findings: ReportSummary, probe: str) -> dict[str, ProbeResult]:
    """Return the results of a probe that have a history, by model or reference."""
    seen = findings.probes[probe].items()
    return {n: p for n, p in seen if p.course is not None and p.times is not None and p.course.size > 0}


@dataclass(frozen=True)
class PointHistory:
    """Displacement history of one point of a probe: the component along which the point moves most."""

    findings: ReportSummary
    number: int
    probe: str
    seen: Mapping[str, ProbeResult]

    @cached_property
    def followed(self) -> tuple[int, int]:
        """Index of the point that moves farthest, and index of the coordinate along which it moves most."""
        courses = [p.course for p in self.seen.values() if p.course is not None]
        n = min(c.shape[1] for c in courses)
        furthest = np.max([np.abs(c[:, :n]).max(axis=0) for c in courses], axis=0)  # (n, 3)
        point, axis = np.unravel_index(int(furthest.argmax()), furthest.shape)
        return int(point), int(axis)

    @property
    def about(self) -> tuple[object, ...]:
        """Material point, coordinate and names of results; equal for two probes of the same point."""
        point, axis = self.followed
        places = (p.points[point] for p in self.seen.values())
        return axis, tuple((n, *np.round(X, 9)) for n, X in zip(self.seen, places, strict=True))

    @cached_property
    def moments(self) -> Floats:
        """Times of the chart, shape (t,), s: those of the finest history, thinned."""
        finest: Floats = max((p.times for p in self.seen.values() if p.times is not None), key=len)
        moments: Floats = finest[pick_evenly(len(finest), DRAWN)]
        return moments

    @cached_property
    def values(self) -> dict[str, Floats]:
        """Displacements at these times, shape (t,), m, by name; NaN after the end of a history."""
        return {n: self._displacement_at_chart_times(p) for n, p in self.seen.items()}

    def _displacement_at_chart_times(self, p: ProbeResult) -> Floats:
        point, axis = self.followed
        times, course = p.times, p.course
        if times is None or course is None:
            return np.full(len(self.moments), np.nan)
        return np.interp(self.moments, times, course[:, point, axis], right=np.nan)

    @property
    def symbol(self) -> str:
        return f"u{AXES[self.followed[1]]}"

    def render_figure(self) -> str:
        """Return the HTML of the chart."""
        open_ = [*initially_shown(self.findings), *self.findings.report.references]
        chart = Chart(
            f"course-{self.number}", f"Displacement over time at {self.probe}", self._description(), *self._axes(),
            WIDTH, HEIGHT, tuple(self._curves(open_)), left=70.0, right=70.0,
        )  # fmt: skip
        return figure_block(chart, prose(self._caption()), self._columns(), self._csv_link(), open_=open_)

    def _axes(self) -> tuple[Axis, Axis]:
        every = np.concatenate(list(self.values.values()))
        low, high = float(np.nanmin(every)), float(np.nanmax(every))
        margin = 0.06 * (high - low) or 1e-9
        start, end = float(self.moments[0]), float(self.moments[-1])
        return linear(start, max(end, start + 1e-12), "time", "s", 8), linear(
            low - margin, high + margin, self.symbol, "m", 6
        )

    def _curves(self, open_: Sequence[str]) -> Iterator[Curve]:
        known = curve_styles(self.findings.report)
        for i, (name, values) in enumerate(self.values.items()):
            pairs = zip(self.moments, values, strict=True)
            points = tuple((float(t), float(v)) if np.isfinite(v) else None for t, v in pairs)
            yield Curve(name, known[name], points, 1 + i, 1, named=name in open_)

    def _description(self) -> str:
        ends = (
            f"{n} from {_format_length(np.nanmin(v))} to {_format_length(np.nanmax(v))}" for n, v in self.values.items()
        )
        return "; ".join(ends) + "."

    def _caption(self) -> str:
        point, axis = self.followed
        at = next(iter(self.seen.values())).points[point]
        place = ", ".join(f"{a} {_format_length(x)}" for a, x in zip(AXES, at, strict=True))
        thin = (
            " Not every time is drawn."
            if any(len(p.times) > DRAWN for p in self.seen.values() if p.times is not None)
            else ""
        )
        whole = (
            "the point"
            if len(next(iter(self.seen.values())).points) == 1
            else "the point of the probe with the largest displacement"
        )
        return f"Probe `{self.probe}`: displacement along {AXES[axis]} of {whole}, initially at {place}.{thin}"

    def _columns(self) -> list[ColumnGroup]:
        time, own = (
            choose_scale((float(self.moments[-1]),), "s"),
            choose_scale([_largest_magnitude(v) for v in self.values.values()], "m"),
        )
        decimals, places = (
            choose_decimals((float(self.moments[-1]),), time, 6),
            choose_decimals((own.factor * 100,), own, 6),
        )
        heading = time.heading("t")
        found = [ColumnGroup(heading, (heading,), [(time.fixed(float(t), decimals),) for t in self.moments])]
        for name, values in self.values.items():
            cells = [(own.fixed(float(v), places) if np.isfinite(v) else "–",) for v in values]
            found.append(ColumnGroup(name, (own.heading(self.symbol),), cells))
        return found

    def _csv_link(self) -> str:
        """Return the link to a CSV file with all displacement components of the point, at the times of each history."""
        point, _ = self.followed
        every = max(
            1,
            -(-sum(len(p.points) and len(p.course) for p in self.seen.values() if p.course is not None) // SAVED),
        )
        rows: list[list[Cell]] = []
        for name, p in self.seen.items():
            if p.times is not None and p.course is not None:
                chosen = zip(p.times[::every], p.course[::every, point], strict=True)
                rows += [
                    [name, round_for_drawing(float(t)), *(round_for_drawing(float(v)) for v in u)] for t, u in chosen
                ]
        return csv_link(f"{self.probe}-course", ["name", "t [s]", "ux [m]", "uy [m]", "uz [m]"], rows)


def _format_length(value: float) -> str:
    return format_quantity(float(value), "m", 3)


def _largest_magnitude(values: Floats) -> float:
    return float(np.nanmax(np.abs(values)))


def _events(findings: ReportSummary) -> str:
    """Return the events that models reported, as HTML."""
    rows: list[list[Cell]] = []
    for name, model in findings.report.models.items():
        for event in model.solve.get("events") or ():
            rows.append([name, event.get("time"), str(event.get("what", ""))])
    if not rows:
        return ""
    items = [
        tag("tr", tag("th", tag("code", text(n)), scope="row"), _time_cell(t), tag("td", prose(str(w))))
        for n, t, w in rows
    ]
    head = tag("tr", *(tag("th", w, scope="col") for w in ("Model", "Time", "Event")))
    table = tag("table", tag("caption", "Events"), tag("thead", head), tag("tbody", *items))
    box = tag("div", table, class_="scroll events", tabindex=0, role="region", aria_label="Events")
    return box + csv_link("events", ["name", "time [s]", "event"], rows)


def _time_cell(time: object) -> str:
    return tag("td", text(format_quantity(float(time), "s", 4)) if isinstance(time, (int, float)) else "–", class_="n")
