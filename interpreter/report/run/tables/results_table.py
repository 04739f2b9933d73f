"""Results table of a run: status, metrics, size and effort of models and references."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby

from softmark.interpreter.language.number_formatting import (
    Scale,
    choose_decimals,
    choose_scale,
    format_quantity,
    group_digits,
    is_negligible,
    typeset_number,
)
from softmark.interpreter.report.page.html_markup import count, join_names, prose, tag, text
from softmark.interpreter.report.run.report_bodies import BodyResults
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary, Result, value_of
from softmark.interpreter.results.run_report import ModelResult, ReferenceResult

WIDE = 6  # a table with more metrics has narrower columns
SYMBOLS = {
    "converged": ("✓", "good", "converged"),
    "capped": ("~", "quiet", "capped, steps unsolved"),
    "read": ("✓", "good", "read from a file"),
    "skipped": ("–", "quiet", "skipped"),
    "unsupported": ("–", "quiet", "unsupported"),
    "not_converged": ("✗", "bad", "not converged"),
    "diverged": ("✗", "bad", "diverged"),
    "failed": ("✗", "bad", "failed"),
}
TIMES = {"solve_s": "Solve", "step_s": "Step"}  # setup stands below the time of the solution
NO_MESH = "a reference has no mesh, iterations or time"
CAPTION = (
    "Times are wall time: the median and [smallest–largest] of the runs, without compilation; CPU time is added if "
    "it differs by more than a quarter."
)
BEST = " The smallest error of a column is in bold and marked best."
TIED = " Errors that differ by less than the uncertainty of the reference are not ranked and marked tied."
LAST = " Values are those{}; times and iterations are totals over all states."
CLOCK = " Fractions of the available time: ✓ real time, ✗ not real time."


def caption(findings: ReportSummary) -> str:
    """Return the caption of the results tables."""
    best, tied = (any(ask(m) for m in findings.metrics) for ask in (findings.best, findings.tied))
    clock = any(m.clock for m in findings.metrics)
    of_last = LAST.format(findings.last_state_phrase) if findings.last_state_phrase else ""
    return text(CAPTION + of_last + (BEST if best else "") + (TIED if tied else "") + (CLOCK if clock else ""))


def sort_metrics(metrics: Sequence[MetricColumn]) -> list[MetricColumn]:
    """Return the metrics in the order of columns: errors by reference, differences of models, measurements, times."""
    from_ = [(m.against, m.model) for m in metrics]
    key = lambda m: (m.clock, m.against is None, m.model is None, from_.index((m.against, m.model)))  # noqa: E731
    return sorted(metrics, key=key)


@dataclass
class Notes:
    """Footnotes of results tables, with one letter for each reason of a missing value.

    With `linked` the marks are links to the footnotes.
    """

    reasons: list[str] = field(default_factory=list)
    within: dict[str, str] = field(default_factory=dict)  # metric -> uncertainty of its reference as text
    doubts: dict[str, None] = field(default_factory=dict)  # reasons why a reference may not be valid
    linked: bool = True

    def _footnote_mark(self, sign: str, note: str, said: str) -> str:
        """Return the mark `sign` as HTML that links to the footnote `note`; screen readers and tooltips tell `said`."""
        if not self.linked:
            return tag("abbr", text(sign), title=said)
        return tag("a", text(sign), href=f"#{note}", aria_label=said)

    def _anchor(self, note: str) -> str | None:
        return note if self.linked else None

    def missing_value_mark(self, reason: str) -> str:
        """Return an en dash with the letter of the footnote that gives the reason."""
        if reason not in self.reasons:
            self.reasons.append(reason)
        mark = letter(self.reasons.index(reason))
        return "–" + tag("sup", self._footnote_mark(mark, f"note-{mark}", f"note {mark}"))

    def uncertainty_mark(self, metric: str, uncertainty: str) -> str:
        """Return the mark of a value that does not exceed the uncertainty of its reference."""
        self.within.setdefault(metric, uncertainty)
        said = "within the uncertainty of the reference"
        return tag("sup", self._footnote_mark("†", "note-within", said), class_="within")

    def validity_doubt_mark(self, why: str) -> str:
        """Return the mark of a value whose reference may not be valid for the scene."""
        self.doubts.setdefault(why)
        said = "the theory is not exact here"
        return tag("sup", self._footnote_mark("‡", "note-doubt", said), class_="within")

    def _uncertainty_footnote(self) -> str:
        if not self.within:
            return ""
        each = join_names([f"± {amount} for `{metric}`" for metric, amount in self.within.items()])
        said = f"within the uncertainty of the reference ({each}): the difference is not significant"
        return tag("li", tag("b", "†"), " ", prose(said), id=self._anchor("note-within"))

    def list(self) -> str:
        """Return the footnotes as HTML."""
        letters = [letter(i) for i in range(len(self.reasons))]
        pairs = zip(letters, self.reasons, strict=True)
        items = [tag("li", tag("b", a), " ", prose(reason), id=self._anchor(f"note-{a}")) for a, reason in pairs]
        items += [own] if (own := self._uncertainty_footnote()) else []
        items += [
            tag("li", tag("b", "‡"), " ", prose(f"the theory is not exact here: {why}"),
                id=None if i else self._anchor("note-doubt"))
            for i, why in enumerate(self.doubts)
        ]  # fmt: skip
        return tag("ul", *items, class_="notes") if items else ""


def letter(n: int) -> str:
    """Return the n-th footnote letter: a, b, …, z, aa, ab, …"""
    return (letter(n // 26 - 1) if n >= 26 else "") + chr(97 + n % 26)


@dataclass
class ResultsTable:
    """Results table of one body; its footnotes are collected while the table is made."""

    findings: ReportSummary
    body: BodyResults
    notes: Notes = field(default_factory=Notes)

    @cached_property
    def groups(self) -> list[tuple[str, list[MetricColumn]]]:
        """Metrics under their headings: errors by reference, measurements, times."""
        named = groupby(self.columns, key=_heading)
        return [(heading, list(metrics)) for heading, metrics in named]

    @cached_property
    def columns(self) -> list[MetricColumn]:
        """Metrics in the order of the table."""
        return sort_metrics(self.body.metrics)

    @cached_property
    def values(self) -> Mapping[str, list[float]]:
        """Values of every column, by metric."""
        results = [self.findings.all_results[n] for n in self.body.results]
        return {m.name: [v for r in results if (v := value_of(r, m.name)) is not None] for m in self.columns}

    @cached_property
    def scales(self) -> Mapping[str, tuple[Scale, int]]:
        """Unit and number of decimals of every column, by metric."""
        found = {}
        for metric in self.columns:
            values = self.values[metric.name]
            scale = choose_scale(values, metric.unit, metric.percent)
            found[metric.name] = scale, choose_decimals(values, scale, 4 if metric.is_error else 5)
        return found

    @cached_property
    def times(self) -> list[str]:
        """Kinds of computing time that were measured."""
        return [k for k in TIMES if any(m.time.get(k) for m in self.findings.report.models.values())]

    def html(self) -> str:
        """Return the table in a scrolling box as HTML."""
        report, own = self.findings.report, self.body.results
        models = {n: m for n, m in report.models.items() if n in own}
        references = {n: r for n, r in report.references.items() if n in own}
        bodies = [self._rows("Models", models), self._rows("References", references)]
        label = "Comparison of models and references" + (f" of {self.body.name}" if self.body.name else "")
        hidden = tag("caption", tag("span", text(label)), class_="hidden")
        kind = "results wide" if len(self.columns) > WIDE else "results"
        table = tag("table", hidden, self._head(), *bodies, class_=kind)
        return tag("div", table, class_="scroll", tabindex=0, role="region", aria_label=label)

    def _head(self) -> str:
        done = tag("span", "Status", class_="spoken")
        top = [tag("th", word, rowspan=2, scope="col") for word in ("Name", done)]
        top += [tag("th", prose(name), colspan=len(own), scope="colgroup") for name, own in self.groups]
        top += [tag("th", "Size", rowspan=2, scope="col", class_="n")]
        top += [tag("th", "Effort", colspan=1 + len(self.times), scope="colgroup")]
        low = [self._metric_head(m) for m in self.columns]
        low += [tag("th", word, scope="col") for word in ("Iterations", *(TIMES[k] for k in self.times))]
        return tag("thead", tag("tr", *top), tag("tr", *low))

    def _metric_head(self, metric: MetricColumn) -> str:
        scale, _ = self.scales[metric.name]
        name = tag("a", text(metric.name), href=f"#L{metric.line}") if metric.line else text(metric.name)
        unit = tag("span", text(f" / {scale.unit}"), class_="unit") if scale.unit else ""
        return tag("th", name, unit, scope="col")

    def _rows(self, heading: str, results: Mapping[str, Result]) -> str:
        if not results:
            return ""
        width = 4 + len(self.columns) + len(self.times)
        title = tag("tr", tag("th", heading, colspan=width, scope="rowgroup"), class_="group")
        return tag("tbody", title, *(self._row(n, r) for n, r in results.items()))

    def _row(self, name: str, result: Result) -> str:
        cells = [self._name(name, result), tag("td", status_of(result))]
        cells += [tag("td", self._metric_cell(name, result, m), class_="n") for m in self.columns]
        effort = self._effort(result) if isinstance(result, ModelResult) else self._missing_effort_cells()
        return tag("tr", *cells, *(tag("td", cell, class_="n") for cell in effort))

    def _name(self, name: str, result: Result) -> str:
        line, own = self.findings.line(name), tag("code", text(name))
        below = result.outline if isinstance(result, ModelResult) else result.kind
        return tag("th", tag("a", own, href=f"#L{line}") if line else own, _small(text(below)), scope="row")

    def _metric_cell(self, name: str, result: Result, metric: MetricColumn) -> str:
        value = value_of(result, metric.name)
        if value is None:
            return self.notes.missing_value_mark(self._missing_value_reason(name, result, metric))
        found = result.metrics[metric.name]
        shown = tag("data", text(self._format_number(value, metric)), value=repr(value)) + self._stated_error_text(
            result, metric
        )
        if metric.clock and "verdict" in found.details:
            return _verdict_symbol(bool(found.details["verdict"])) + shown
        if not found.meaningful:
            shown += self.notes.uncertainty_mark(
                metric.name, format_quantity(found.uncertainty or 0.0, metric.unit, 3, percent=True)
            )
        if found.doubt:
            shown += self.notes.validity_doubt_mark(found.doubt)
        if isinstance(result, ModelResult) and name in self.findings.best(metric):
            word = "tied" if self.findings.tied(metric) else "best"
            return tag("strong", shown) + " " + tag("small", word, class_="best")
        return shown

    def _stated_error_text(self, result: Result, metric: MetricColumn) -> str:
        """Return the stated error of a number, `± 0.05`, in the unit of the column."""
        error = stated_error_or_uncertainty(result, metric)
        if error is None:
            return ""
        own = f"\u00a0±\u00a0{typeset_number(f'{error / self.scales[metric.name][0].factor:.2g}')}"
        return tag("small", tag("data", text(own), value=repr(error)), class_="stated")

    def _format_number(self, value: float, metric: MetricColumn) -> str:
        """Return a number in the format of its column."""
        scale, decimals = self.scales[metric.name]
        if metric.clock:
            own = value / scale.factor
            return typeset_number(f"{own:.0f}" if abs(own) >= 100 else f"{own:.3g}")
        largest = max((abs(v) for v in self.values[metric.name]), default=0.0)
        return "0" if is_negligible(value, largest, metric.unit, self.findings.moved) else scale.text(value, decimals)

    def _missing_value_reason(self, name: str, result: Result, metric: MetricColumn) -> str:
        found = result.metrics.get(metric.name)
        if found is not None:
            return found.reason or "no reason was given"
        if name == metric.against:
            return "this is the reference of the error"
        if name == metric.model:
            return "this is the model that others are compared with"
        if metric.probe is None and isinstance(result, ReferenceResult):
            return "only models have a computing time" if metric.clock else "it does not provide this quantity"
        if isinstance(result, ReferenceResult) and not result.probes and result.status == "converged":
            return "no measured values at the points of this metric"
        if self.findings.report.partial:
            return "not computed yet: the report is unfinished"
        return result.message or "this metric refers to another body"

    def _effort(self, model: ModelResult) -> list[str]:
        rounds = model.solve.get("iterations")
        none = model.message or "the method does not iterate"
        iterations = number(rounds) if isinstance(rounds, int) else self.notes.missing_value_mark(none)
        return [self._size(model), iterations, *(self._time(model, kind) for kind in self.times)]

    def _missing_effort_cells(self) -> list[str]:
        return [self.notes.missing_value_mark(NO_MESH)] * (2 + len(self.times))

    def _size(self, model: ModelResult) -> str:
        if "dofs" not in model.size:
            return self.notes.missing_value_mark(model.message or "the number of unknowns is not known")
        rest = [number(model.size[k]) + f" {k}" for k in ("nodes", "elements") if k in model.size]
        return number(model.size["dofs"]) + " dofs" + _small("<br>".join(rest))

    def _time(self, model: ModelResult, kind: str) -> str:
        timing = model.time.get(kind)
        if timing is None:
            return self.notes.missing_value_mark(
                "a static analysis has no time steps" if kind == "step_s" else "not timed"
            )
        cpu, below = model.time.get(kind.replace("_s", "_cpu_s")), []
        setup = model.time.get("setup_s") if kind == "solve_s" else None
        if timing.runs > 1:
            below.append(_time_range(min(timing.seconds), max(timing.seconds)))
            below.append(count(timing.runs, "run" if kind == "solve_s" else "step"))
        if setup:
            below.append(f"setup {seconds(setup.median)}")
        if cpu and _is_wall_time_different(cpu.median, timing.median):
            below.append(f"CPU {seconds(cpu.median)}")
        below += [text(timing.basis)] if timing.basis else []
        return ("≤ " if timing.most else "") + seconds(timing.median) + _small("<br>".join(below))


def _is_wall_time_different(cpu: float, wall: float) -> bool:
    """Return whether CPU time and wall time differ, because of other programs or several threads."""
    return abs(cpu - wall) > 0.25 * wall


def _time_range(low: float, high: float) -> str:
    """Return a range of times as text, `[14.2–15.9 ms]`, with the unit once if it is the same."""
    first, last = format_quantity(low, "s", 3), format_quantity(high, "s", 3)
    if first.split("\u00a0")[1:] == last.split("\u00a0")[1:]:
        first = first.split("\u00a0")[0]
    return "[" + tag("data", text(first), value=repr(low)) + "–" + tag("data", text(last), value=repr(high)) + "]"


def status_of(result: Result) -> str:
    """Return the status of a result as a symbol and words."""
    symbol, mood, words = SYMBOLS.get(result.status, ("?", "quiet", result.status))
    if getattr(result, "inverted", 0):
        return tag("span", tag("span", "✗", aria_hidden="true"), " inverted cells", class_="status bad")
    said = f" {text(words)}"
    if result.status == "converged":  # the usual status: the symbol suffices, words are only for screen readers
        said = tag("span", said, class_="spoken")
    return tag("span", tag("span", symbol, aria_hidden="true"), said, class_=f"status {mood}")


def _verdict_symbol(good: bool) -> str:
    """Return ✓ or ✗ as HTML, shown before a fraction of the available time."""
    symbol, mood, words = ("✓", "good", "real time") if good else ("✗", "bad", "not real time")
    sign, said = tag("span", symbol, aria_hidden="true"), tag("span", f"{words} ", class_="spoken")
    return tag("span", sign, " ", said, class_=f"status {mood}")


def _heading(metric: MetricColumn) -> str:
    if metric.clock:
        return "Real time"
    if metric.model:
        return f"Difference from `{metric.model}`"
    return f"Error against `{metric.against}`" if metric.against else "Measured"


def number(n: int) -> str:
    """Return a whole number as HTML with its machine-readable value."""
    return tag("data", group_digits(n), value=str(n))


def seconds(value: float) -> str:
    """Return a time as HTML with three digits and its machine-readable value."""
    return tag("data", text(format_quantity(value, "s", 3)), value=repr(float(value)))


def _small(markup: str) -> str:  # with a space, because an untrusted notebook is shown without styles
    return " " + tag("small", markup) if markup else ""


def stated_error_or_uncertainty(result: Result, metric: MetricColumn) -> float | None:
    """Return the error that a model states of a number, or the uncertainty of a theory, SI; None if unknown."""
    if isinstance(result, ReferenceResult):
        found = result.metrics.get(metric.name)
        return None if found is None or metric.is_error or metric.model is not None else found.uncertainty
    said = result.stated.get(metric.name) if not metric.clock else None
    return None if said is None else said.value
