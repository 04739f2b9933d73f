"""Real-time performance of models: a verdict in words, and the distribution of frame times."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from softmark.interpreter.language.number_formatting import choose_scale, format_quantity, typeset_number
from softmark.interpreter.report.charts.chart_axes import Axis, logarithmic
from softmark.interpreter.report.charts.curve_labels import LETTER
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup, data_table, details
from softmark.interpreter.report.page.html_markup import count, prose, section, strip_backticks, tag, text
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary
from softmark.interpreter.report.run.tables.line_probes import curve_styles
from softmark.interpreter.results.run_report import MetricResult
from softmark.records import dataclass

TIMES = {"median_s": "Median", "p95_s": "95 %", "p99_s": "99 %", "worst_s": "Worst"}
VERDICTS = {True: ("✓", "good", "real time"), False: ("✗", "bad", "not real time")}
ROW, TOP, WIDTH, BOTTOM = 34.0, 34.0, 640.0, 50.0
DOTS = 300  # largest number of drawn frames of a model; the slowest are always drawn
Judged = Mapping[str, MetricResult]  # model -> its result of a metric


def section_of(findings: ReportSummary) -> str:
    """Return a table and a figure for each set of frame times, with all frame rates; empty if there is none."""
    groups: dict[tuple[Any, ...], dict[MetricColumn, Judged]] = {}
    for metric in findings.metrics:
        if judged := _judged_models(findings, metric):
            groups.setdefault(_frame_times_key(judged), {})[metric] = judged
    parts = [_FrameTimeMetrics(findings, number, judged).html() for number, judged in enumerate(groups.values())]
    return section("realtime", "Real time", *parts) if parts else ""


def _judged_models(findings: ReportSummary, metric: MetricColumn) -> Judged:
    found = {n: m.metrics.get(metric.name) for n, m in findings.report.models.items()}
    return {n: m for n, m in found.items() if m is not None and "verdict" in m.details and "limit_s" in m.details}


def _frame_times_key(judged: Judged) -> tuple[Any, ...]:
    """Return a key that is equal for metrics with the same frame times."""
    return tuple((n, *(m.details.get(k) for k in TIMES), m.details.get("frames")) for n, m in judged.items())


@dataclass(frozen=True)
class _FrameTimeMetrics:
    """Metrics that use the same frame times, each with its own required frame rate."""

    findings: ReportSummary
    number: int
    judged: Mapping[MetricColumn, Judged]

    @cached_property
    def first(self) -> tuple[MetricColumn, Judged]:
        """First of the metrics, whose name is used for files, and the models that it judges."""
        return next(iter(self.judged.items()))

    def html(self) -> str:
        """Return the HTML of the table, and of the figure if there are frame times."""
        sampled = {n: m for n, m in self.first[1].items() if len(m.samples) > 1}
        strips = _FrameTimeFigure(self.findings, self.number, self.first[0], sampled, self._required_frame_rates)
        several = any((m.details.get("frames") or 0) > 1 for m in self.first[1].values())
        caption = tag("caption", tag("span", prose(self._verdict_counts_sentence())))
        body = [self._row(name, several) for name in self.first[1]]
        table = tag("table", caption, tag("thead", self._head(several)), tag("tbody", *body), class_="verdicts")
        label = f"Real time, {', '.join(m.name for m in self.judged)}"
        box = tag("div", table, class_="scroll", tabindex=0, role="region", aria_label=label)
        return box + self._csv_links() + (strips.figure() if sampled else "")

    @property
    def _required_frame_rates(self) -> list[float]:
        """Required frame rates, Hz."""
        every = (m.details.get("rate_Hz") for judged in self.judged.values() for m in judged.values())
        return sorted({float(rate) for rate in every if rate})

    def _verdict_counts_sentence(self) -> str:
        counts = [
            f"`{metric.name}`: {sum(m.details['verdict'] is True for m in judged.values())} of "
            f"{count(len(judged), 'model')} in real time"
            for metric, judged in self.judged.items()
        ]
        lost = len(self.findings.report.models) - len(self.first[1])
        rest = f" {count(lost, 'model')} without a verdict." if lost else ""
        return (
            f"{'; '.join(counts)}.{rest} Real time: 99 % of the frames are computed within the available time, and "
            f"no step is longer than a frame. Times are wall time on this computer."
        )

    def _head(self, several: bool) -> str:
        verdicts = [tag("th", _metric_title(metric, judged), scope="col") for metric, judged in self.judged.items()]
        words = [*TIMES.values(), "Frames"] if several else ["Time"]
        times = [tag("th", w, scope="col", class_="n") for w in words]
        return tag("tr", tag("th", "Model", scope="col"), *verdicts, *times)

    def _row(self, name: str, several: bool) -> str:
        known = self.first[1][name].details
        verdicts = [tag("td", _verdict(judged[name].details)) for judged in self.judged.values()]
        worst = tag("small", f"frame {known['worst_frame']}") if known.get("worst_frame") else ""
        times = [text(_seconds(known.get(k))) for k in (TIMES if several else ("median_s",))]
        if several:
            times[-1] += worst
            times.append(text(known.get("frames", "–")))
        head = tag("th", tag("code", text(name)), scope="row")
        return tag("tr", head, *verdicts, *(tag("td", c, class_="n") for c in times))

    def _csv_links(self) -> str:
        links = []
        for metric, judged in self.judged.items():
            keys = list(dict.fromkeys(k for m in judged.values() for k in m.details))
            rows: list[list[Cell]] = [[n, *(_cell(m.details.get(k)) for k in keys)] for n, m in judged.items()]
            label = f"CSV of {metric.name}" if len(self.judged) > 1 else "CSV"
            links.append(csv_link(metric.name, ["name", *keys], rows, label))
        return tag("p", " ".join(links), class_="save-line")


def _metric_title(metric: MetricColumn, judged: Judged) -> str:
    """Return the name of a metric with its frame rate, such as `eye / 25 Hz`."""
    rates = {m.details.get("rate_Hz") for m in judged.values()}
    rate = rates.pop() if len(rates) == 1 else None
    return tag("code", text(metric.name)) + (
        tag("span", f" / {rate:g} Hz", class_="unit") if isinstance(rate, (int, float)) else ""
    )


def _cell(value: Any) -> Cell:
    return value if value is None or isinstance(value, (int, float, str)) else str(value)


def _verdict(known: Mapping[str, Any]) -> str:
    """Return `yes` or `no` with the margin and the number of late frames, as HTML."""
    symbol, mood, words = VERDICTS[bool(known["verdict"])]
    sign = tag("span", tag("span", symbol, aria_hidden="true"), f" {words}", class_=f"status {mood}")
    late = f"{known.get('missed', '–')} of {known.get('frames', '–')} frames late" if known.get("missed") else ""
    return sign + tag("small", text(", ".join(part for part in (_margin(known), late) if part)))


def _margin(known: Mapping[str, Any]) -> str:
    """Return the margin as text, such as `13 % of 40 ms left` or `takes 2.6 times the available 10 ms`.

    If the model can never be fast enough, the text gives the reason.
    """
    limit, margin = format_quantity(known["limit_s"], "s", 3), known.get("margin")
    if margin is None or (not known["verdict"] and margin >= 0):
        return str(known.get("verdict_reason") or "")
    return (
        f"{100 * margin:.3g} % of {limit} left"
        if margin >= 0
        else f"takes {1 - margin:.3g} times the available {limit}"
    )


def _seconds(value: float | None) -> str:
    return "–" if value is None else format_quantity(value, "s", 3)


@dataclass(frozen=True)
class _FrameTimeFigure:
    """Figure of frame times as fractions of the limit: a dot for each frame, and a box between the quartiles."""

    findings: ReportSummary
    number: int
    metric: MetricColumn
    sampled: Mapping[str, MetricResult]
    rates: Sequence[float]  # Hz

    @cached_property
    def times(self) -> dict[str, list[float]]:
        """Frame times, s, in ascending order, by model."""
        return {n: sorted(t * float(m.details["limit_s"]) for t in m.samples) for n, m in self.sampled.items()}

    @cached_property
    def axis(self) -> Axis:
        every = [t for times in self.times.values() for t in times if t > 0]
        limits = [float(m.details["limit_s"]) for m in self.sampled.values()] + [1 / r for r in self.rates]
        return logarithmic(min([*every, *limits]), max([*every, *limits]), "time of a frame", "s")

    @property
    def left(self) -> float:
        return 16.0 + min(190.0, LETTER * max(len(n) for n in self.sampled))

    def x(self, seconds: float) -> float:
        """Return the horizontal position of a time, in pixels from the left."""
        return self.left + WIDTH * self.axis.at(max(seconds, self.axis.low))

    def figure(self) -> str:
        """Return the HTML of the figure with caption and numbers."""
        numbers = details("Data of this figure", data_table("Data: times of frames", self._columns()), self._csv_link())
        caption = (
            "Each dot is a frame; boxes extend from the first to the third quartile, with a line at the median. The "
            "heavy vertical line is the available time: frames to its right are late. Dashed lines are the frame "
            "times of the required rates."
        )
        drawing = tag("div", self._svg(), class_="drawing")
        return tag("figure", drawing, tag("figcaption", tag("p", caption), numbers), class_="strips")

    def _svg(self) -> str:
        bottom = TOP + ROW * len(self.sampled)
        identity = f"frames-{self.number}"
        title = tag("title", text(f"Times of frames, {strip_backticks(self.metric.name)}"), id=f"{identity}-t")
        desc = tag("desc", text(self._description()), id=f"{identity}-d")
        rows = [self._model_strip(n, TOP + ROW * (i + 0.5)) for i, n in enumerate(self.sampled)]
        return tag(
            "svg", title, desc, self._axes(bottom), *rows, role="img", aria_labelledby=f"{identity}-t {identity}-d",
            viewBox=f"0 0 {self.left + WIDTH + 24:.0f} {bottom + BOTTOM:.0f}",
        )  # fmt: skip

    def _description(self) -> str:
        said = (f"{n}: median {_seconds(_quantile(t, 0.5))}, worst {_seconds(t[-1])}" for n, t in self.times.items())
        return "; ".join(said) + "."

    def _axes(self, bottom: float) -> str:
        ticks = [(self.x(value), label) for value, label in self.axis.ticks]
        grid = tag("path", class_="grid", d="".join(f"M{x:.1f} {TOP:.1f}V{bottom:.1f}" for x, _ in ticks))
        labels = [
            tag("text", text(label), x=f"{x:.1f}", y=f"{bottom + 19:.1f}", text_anchor="middle") for x, label in ticks
        ]
        middle, name = self.left + WIDTH / 2, text(self.axis.label)
        words = tag("text", name, x=f"{middle:.1f}", y=f"{bottom + 42:.1f}", text_anchor="middle", class_="axis")
        asked = [(self.x(1 / rate), f"{rate:g} Hz") for rate in self.rates]
        lines = "".join(f"M{x:.1f} {TOP - 6:.1f}V{bottom:.1f}" for x, _ in asked)
        rates = [tag("text", w, x=f"{x:.1f}", y=f"{TOP - 12:.1f}", text_anchor="middle") for x, w in asked]
        marks = tag("path", class_="rate", d=lines) + tag("g", *rates, class_="ticks")
        return grid + tag("g", *labels, class_="ticks") + words + marks

    def _model_strip(self, name: str, y: float) -> str:
        times, limit = self.times[name], float(self.sampled[name].details["limit_s"])
        low, middle, high = (self.x(_quantile(times, q)) for q in (0.25, 0.5, 0.75))
        dots = "".join(f"M{self.x(t):.1f} {y + _jitter(i):.1f}h0" for i, t in enumerate(_thin_values(times)))
        box = tag(
            "rect",
            x=f"{low:.1f}",
            y=f"{y - 8:.1f}",
            width=f"{max(high - low, 1.0):.1f}",
            height=16,
            class_="box",
        )
        median = tag("path", d=f"M{middle:.1f} {y - 8:.1f}v16", class_="median")
        stroke = tag("path", d=f"M{self.x(limit):.1f} {y - 14:.1f}v28", class_="limit")
        label = tag("text", text(name), x=f"{self.left - 10:.1f}", y=f"{y + 4:.1f}", text_anchor="end")
        drawn = tag("path", d=dots, class_="dots")
        return tag(
            "g",
            label,
            drawn,
            box,
            median,
            stroke,
            class_=f"strip {curve_styles(self.findings.report)[name].classes}",
        )

    def _columns(self) -> list[ColumnGroup]:
        scale = choose_scale([t[-1] for t in self.times.values()], "s")
        heads = tuple(scale.heading(w) for w in ("least", "25 %", "median", "75 %", "95 %", "99 %", "worst"))
        shares = (0.0, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0)
        cells = [
            tuple(typeset_number(f"{_quantile(t, q) / scale.factor:.4g}") for q in shares) for t in self.times.values()
        ]
        names = [(n,) for n in self.times]
        return [ColumnGroup("model", ("model",), names), ColumnGroup("time of a frame", heads, cells)]

    def _csv_link(self) -> str:
        rows: list[list[Cell]] = [
            [n, i + 1, round_for_drawing(t * float(m.details["limit_s"]))]
            for n, m in self.sampled.items()
            for i, t in enumerate(m.samples)
        ]
        return csv_link(f"{self.metric.name}-frames", ["name", "frame", "time [s]"], rows)


def _quantile(ordered: Sequence[float], share: float) -> float:
    """Return the smallest of ascending values that a fraction `share` of them does not exceed."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def _thin_values(ordered: Sequence[float]) -> list[float]:
    """Return at most DOTS of the ascending values, evenly thinned, with the twenty largest kept."""
    if len(ordered) <= DOTS:
        return list(ordered)
    step = len(ordered) / (DOTS - 20)
    return [*(ordered[int(i * step)] for i in range(DOTS - 20)), *ordered[-20:]]


def _jitter(index: int) -> float:
    """Return a vertical offset, -6 to 6 pixels, that separates neighbouring dots (golden ratio sequence)."""
    return 12.0 * ((index * 0.618034) % 1.0) - 6.0
