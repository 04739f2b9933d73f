"""Whether models keep up with the clock: a verdict in words, and where the times of frames lie."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from softmark.interpreter.report.axes import Axis, logarithmic
from softmark.interpreter.report.findings import Findings, Metric
from softmark.interpreter.report.markup import count, plain, prose, section, tag, text
from softmark.interpreter.report.naming import LETTER
from softmark.interpreter.report.plate import Column, data_table, details
from softmark.interpreter.report.probes import looks
from softmark.interpreter.report.quantities import quantity, scale_of, signed
from softmark.interpreter.report.sheet import Cell, csv_link, short
from softmark.interpreter.results import MetricResult

HEADS = ("Model", "Verdict", "Margin", "Median", "95 %", "99 %", "Worst", "Late", "Limit")
TIMES = ("median_s", "p95_s", "p99_s", "worst_s")
VERDICTS = {True: ("✓", "good", "real time"), False: ("✗", "bad", "not real time")}
ROW, TOP, WIDTH, BOTTOM = 34.0, 26.0, 640.0, 50.0
DOTS = 300  # frames of one model that are drawn; always the slowest


def section_of(findings: Findings) -> str:
    """A table and a picture for each metric about time; empty where there is none."""
    parts = []
    for number, metric in enumerate(m for m in findings.metrics if _judged(findings, m)):
        parts.append(_Clock(findings, number, metric).html())
    return section("realtime", "Real time", *parts) if parts else ""


def _judged(findings: Findings, metric: Metric) -> dict[str, MetricResult]:
    found = {n: m.metrics.get(metric.name) for n, m in findings.report.models.items()}
    return {
        n: m for n, m in found.items() if m is not None and "verdict" in m.details and "limit_s" in m.details
    }


@dataclass(frozen=True)
class _Clock:
    """One metric about time."""

    findings: Findings
    number: int
    metric: Metric

    @cached_property
    def judged(self) -> dict[str, MetricResult]:
        """Models with a verdict."""
        return _judged(self.findings, self.metric)

    def html(self) -> str:
        """The table, and the picture where there are times of frames."""
        sampled = {n: m for n, m in self.judged.items() if len(m.samples) > 1}
        strips = _Strips(self.findings, self.number, self.metric, sampled).figure() if sampled else ""
        head = tag(
            "tr", *(tag("th", w, scope="col", class_="n" if i > 1 else None) for i, w in enumerate(HEADS))
        )
        rows = [_row(name, m.details) for name, m in self.judged.items()]
        caption = tag("caption", tag("span", prose(self._words())))
        table = tag("table", caption, tag("thead", head), tag("tbody", *rows), class_="verdicts")
        box = tag(
            "div",
            table,
            class_="scroll",
            tabindex=0,
            role="region",
            aria_label=f"Real time, {self.metric.name}",
        )
        return box + self._save() + strips

    def _words(self) -> str:
        good = sum(m.details["verdict"] is True for m in self.judged.values())
        lost = len(self.findings.report.models) - len(self.judged)
        rest = f" {count(lost, 'model')} without a verdict." if lost else ""
        return (
            f"`{self.metric.name}`: {good} of {count(len(self.judged), 'model')} in real time.{rest} The "
            "margin is the share of a frame that is left when 99 % of the frames are computed; "
            "times are wall time on this computer."
        )

    def _save(self) -> str:
        keys = list(dict.fromkeys(k for m in self.judged.values() for k in m.details))
        rows: list[list[Cell]] = [
            [n, *(_cell(m.details.get(k)) for k in keys)] for n, m in self.judged.items()
        ]
        return tag("p", csv_link(self.metric.name, ["name", *keys], rows), class_="save-line")


def _cell(value: Any) -> Cell:
    return value if value is None or isinstance(value, (int, float, str)) else str(value)


def _row(name: str, known: Mapping[str, Any]) -> str:
    symbol, mood, words = VERDICTS[bool(known["verdict"])]
    reason = tag("small", text(known["verdict_reason"])) if known.get("verdict_reason") else ""
    verdict = tag("span", tag("span", symbol, aria_hidden="true"), f" {words}", class_=f"status {mood}")
    late = f"{known.get('missed', '–')} of {known.get('frames', '–')}"
    worst = tag("small", f"frame {known['worst_frame']}") if known.get("worst_frame") else ""
    times = [text(_seconds(known.get(k))) for k in TIMES]
    times[-1] += worst
    cells = [text(_percent(known.get("margin"))), *times, text(late), text(_seconds(known["limit_s"]))]
    head = tag("th", tag("code", text(name)), scope="row")
    return tag("tr", head, tag("td", verdict, reason), *(tag("td", c, class_="n") for c in cells))


def _seconds(value: float | None) -> str:
    return "–" if value is None else quantity(value, "s", 3)


def _percent(value: float | None) -> str:
    return "–" if value is None else signed(f"{100 * value:.3g} %")


@dataclass(frozen=True)
class _Strips:
    """Times of frames as a share of the limit: a dot each, and a box from quartile to quartile."""

    findings: Findings
    number: int
    metric: Metric
    sampled: Mapping[str, MetricResult]

    @cached_property
    def times(self) -> dict[str, list[float]]:
        """Seconds of frames, in ascending order, by model."""
        return {
            n: sorted(t * float(m.details["limit_s"]) for t in m.samples) for n, m in self.sampled.items()
        }

    @cached_property
    def axis(self) -> Axis:
        every = [t for times in self.times.values() for t in times if t > 0]
        limits = [float(m.details["limit_s"]) for m in self.sampled.values()]
        return logarithmic(min(*every, *limits), max(*every, *limits), "time of a frame", "s")

    @property
    def left(self) -> float:
        return 16.0 + min(190.0, LETTER * max(len(n) for n in self.sampled))

    def x(self, seconds: float) -> float:
        """Pixels from the left."""
        return self.left + WIDTH * self.axis.at(max(seconds, self.axis.low))

    def figure(self) -> str:
        """The picture, its caption and its numbers."""
        numbers = details(
            "Data of this figure", data_table("Data: times of frames", self._columns()), self._save()
        )
        caption = (
            "Each dot is a frame; boxes reach from the first to the third quartile, with the median in them. The heavy "
            "upright stroke is the limit: frames to the right of it are late."
        )
        drawing = tag("div", self._svg(), class_="drawing")
        return tag("figure", drawing, tag("figcaption", tag("p", caption), numbers), class_="strips")

    def _svg(self) -> str:
        bottom = TOP + ROW * len(self.sampled)
        identity = f"frames-{self.number}"
        title = tag("title", text(f"Times of frames, {plain(self.metric.name)}"), id=f"{identity}-t")
        desc = tag("desc", text(self._desc()), id=f"{identity}-d")
        rows = [self._strip(n, TOP + ROW * (i + 0.5)) for i, n in enumerate(self.sampled)]
        return tag(
            "svg", title, desc, self._axes(bottom), *rows, role="img", aria_labelledby=f"{identity}-t {identity}-d",
            viewBox=f"0 0 {self.left + WIDTH + 24:.0f} {bottom + BOTTOM:.0f}",
        )  # fmt: skip

    def _desc(self) -> str:
        said = (
            f"{n}: median {_seconds(_quantile(t, 0.5))}, worst {_seconds(t[-1])}"
            for n, t in self.times.items()
        )
        return "; ".join(said) + "."

    def _axes(self, bottom: float) -> str:
        ticks = [(self.x(value), label) for value, label in self.axis.ticks]
        grid = tag("path", class_="grid", d="".join(f"M{x:.1f} {TOP:.1f}V{bottom:.1f}" for x, _ in ticks))
        labels = [
            tag("text", text(label), x=f"{x:.1f}", y=f"{bottom + 19:.1f}", text_anchor="middle")
            for x, label in ticks
        ]
        middle, name = self.left + WIDTH / 2, text(self.axis.label)
        words = tag(
            "text", name, x=f"{middle:.1f}", y=f"{bottom + 42:.1f}", text_anchor="middle", class_="axis"
        )
        return grid + tag("g", *labels, class_="ticks") + words

    def _strip(self, name: str, y: float) -> str:
        times, limit = self.times[name], float(self.sampled[name].details["limit_s"])
        low, middle, high = (self.x(_quantile(times, q)) for q in (0.25, 0.5, 0.75))
        dots = "".join(f"M{self.x(t):.1f} {y + _jitter(i):.1f}h0" for i, t in enumerate(_some(times)))
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
            class_=f"strip {looks(self.findings.report)[name].classes}",
        )

    def _columns(self) -> list[Column]:
        scale = scale_of([t[-1] for t in self.times.values()], "s")
        heads = tuple(scale.heading(w) for w in ("least", "25 %", "median", "75 %", "95 %", "99 %", "worst"))
        shares = (0.0, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0)
        cells = [
            tuple(signed(f"{_quantile(t, q) / scale.factor:.4g}") for q in shares)
            for t in self.times.values()
        ]
        names = [(n,) for n in self.times]
        return [Column("model", ("model",), names), Column("time of a frame", heads, cells)]

    def _save(self) -> str:
        rows: list[list[Cell]] = [
            [n, i + 1, short(t * float(m.details["limit_s"]))]
            for n, m in self.sampled.items()
            for i, t in enumerate(m.samples)
        ]
        return csv_link(f"{self.metric.name}-frames", ["name", "frame", "time [s]"], rows)


def _quantile(ordered: Sequence[float], share: float) -> float:
    """The least value that a share of all does not exceed: no interpolation."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def _some(ordered: Sequence[float]) -> list[float]:
    """At most DOTS of the values, evenly chosen, with the largest twenty."""
    if len(ordered) <= DOTS:
        return list(ordered)
    step = len(ordered) / (DOTS - 20)
    return [*(ordered[int(i * step)] for i in range(DOTS - 20)), *ordered[-20:]]


def _jitter(index: int) -> float:
    """Dots beside one another, by the golden ratio: -6 to 6 pixels."""
    return 12.0 * ((index * 0.618034) % 1.0) - 6.0
