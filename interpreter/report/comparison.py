"""The table: models and references as rows; status, metrics, size and effort as columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby

from softmark.interpreter.report.findings import Findings, Metric, Result, value_of
from softmark.interpreter.report.markup import count, prose, section, tag, text
from softmark.interpreter.report.quantities import Scale, decimals_of, grouped, quantity, scale_of
from softmark.interpreter.report.sheet import Cell, csv_link
from softmark.interpreter.results import ModelResult, ReferenceResult, Timing

SYMBOLS = {
    "converged": ("✓", "good", "converged"),
    "skipped": ("–", "quiet", "skipped"),
    "not_converged": ("✗", "bad", "not converged"),
    "diverged": ("✗", "bad", "diverged"),
    "failed": ("✗", "bad", "failed"),
}
TIMES = {"setup_s": "Setup", "solve_s": "Solve", "step_s": "Step"}
NO_MESH = "a reference is not discretised: it has no mesh, no iterations and no time"


@dataclass
class _Notes:
    """Footnotes: one letter for each reason."""

    reasons: list[str] = field(default_factory=list)

    def dash(self, reason: str) -> str:
        """An en dash with the letter of its reason."""
        if reason not in self.reasons:
            self.reasons.append(reason)
        n = self.reasons.index(reason)
        link = tag("a", text(letter(n)), href=f"#note-{letter(n)}", aria_label=f"note {letter(n)}")
        return "–" + tag("sup", link)

    def list(self) -> str:
        """The footnotes themselves."""
        items = [
            tag("li", tag("b", letter(i)), " ", prose(r), id=f"note-{letter(i)}")
            for i, r in enumerate(self.reasons)
        ]
        return tag("ul", *items, class_="notes", aria_label="Notes to the table") if items else ""


def letter(n: int) -> str:
    """a, b, …, z, aa, ab, …"""
    return (letter(n // 26 - 1) if n >= 26 else "") + chr(97 + n % 26)


def section_of(findings: Findings) -> str:
    """The table with its footnotes, messages, sources and CSV."""
    table = _Table(findings)
    if not findings.everyone:
        return section(
            "table", "Comparison", tag("p", "Neither a model nor a reference was run.", class_="quiet")
        )
    return section(
        "table",
        "Comparison",
        _messages(findings),
        table.html(),
        table.notes.list(),
        table.meanings(),
        table.csv(),
    )


def _messages(findings: Findings) -> str:
    """What happened, in full, where there is no solution."""
    rows = [
        (name, result)
        for name, result in findings.everyone.items()
        if result.status != "converged" or result.message
    ]
    return "".join(_message(name, result) for name, result in rows)


def _message(name: str, result: Result) -> str:
    symbol, mood, words = SYMBOLS.get(result.status, ("?", "quiet", result.status))
    said = result.message or "No reason was given."
    return tag(
        "div",
        tag("p", tag("b", f"{symbol} ", tag("code", text(name)), f" {text(words)}")),
        tag("p", prose(said)),
        class_=f"callout {mood}",
    )


@dataclass
class _Table:
    """One pass over the results; footnotes gather on the way."""

    findings: Findings
    notes: _Notes = field(default_factory=_Notes)

    @cached_property
    def groups(self) -> list[tuple[str, list[Metric]]]:
        """Metrics under headings: errors by reference, then measurements."""
        ordered = sorted(self.findings.metrics, key=lambda m: (m.against is None, self._place(m)))
        named = groupby(ordered, key=lambda m: f"Error against `{m.against}`" if m.against else "Measured")
        return [(heading, list(metrics)) for heading, metrics in named]

    def _place(self, metric: Metric) -> int:
        against = [m.against for m in self.findings.metrics]
        return against.index(metric.against)

    @cached_property
    def columns(self) -> list[Metric]:
        return [m for _, metrics in self.groups for m in metrics]

    @cached_property
    def scales(self) -> Mapping[str, tuple[Scale, int]]:
        """Unit and decimals of every column."""
        found = {}
        for metric in self.columns:
            values = [value_of(r, metric.name) for r in self.findings.everyone.values()]
            scale = scale_of(values, metric.unit, metric.percent)
            found[metric.name] = scale, decimals_of(values, scale, 4 if metric.is_error else 6)
        return found

    @cached_property
    def times(self) -> list[str]:
        """The kinds of time that somebody has."""
        return [k for k in TIMES if any(m.time.get(k) for m in self.findings.report.models.values())]

    def html(self) -> str:
        """The table in its scrolling box."""
        bodies = [
            self._body("Models", self.findings.report.models),
            self._body("References", self.findings.report.references),
        ]
        said = "Models and references. Times are wall time, median [least–largest] of the runs, compilation excluded."
        if self.findings.errors and self.findings.report.models:
            said += " The least error in each column is marked best."
        table = tag("table", tag("caption", said), self._head(), *bodies, class_="results")
        return tag(
            "div",
            table,
            class_="scroll",
            tabindex=0,
            role="region",
            aria_label="Comparison of models and references",
        )

    def _head(self) -> str:
        top = [tag("th", "Name", rowspan=2, scope="col"), tag("th", "Status", rowspan=2, scope="col")]
        top += [
            tag("th", prose(heading), colspan=len(metrics), scope="colgroup")
            for heading, metrics in self.groups
        ]
        top += [
            tag("th", "Size", rowspan=2, scope="col"),
            tag("th", "Effort", colspan=1 + len(self.times), scope="colgroup"),
        ]
        low = [self._metric_head(m) for m in self.columns]
        low += [tag("th", word, scope="col") for word in ("Iterations", *(TIMES[k] for k in self.times))]
        return tag("thead", tag("tr", *top), tag("tr", *low))

    def _metric_head(self, metric: Metric) -> str:
        scale, _ = self.scales[metric.name]
        name = tag("a", text(metric.name), href=f"#L{metric.line}") if metric.line else text(metric.name)
        unit = tag("span", text(f" / {scale.unit}"), class_="unit") if scale.unit else ""
        return tag("th", name, unit, scope="col")

    def _body(self, heading: str, results: Mapping[str, Result]) -> str:
        if not results:
            return ""
        width = 4 + len(self.columns) + len(self.times)
        title = tag("tr", tag("th", heading, colspan=width, scope="rowgroup"), class_="group")
        return tag("tbody", title, *(self._row(n, r) for n, r in results.items()))

    def _row(self, name: str, result: Result) -> str:
        cells = [self._name(name, result), tag("td", _status(result))]
        cells += [self._metric(name, result, m) for m in self.columns]
        cells += self._effort(result) if isinstance(result, ModelResult) else self._no_effort()
        return tag("tr", *cells)

    def _name(self, name: str, result: Result) -> str:
        line = self.findings.line(name)
        own = tag("code", text(name))
        below = result.outline if isinstance(result, ModelResult) else result.kind
        return tag("th", tag("a", own, href=f"#L{line}") if line else own, _small(below), scope="row")

    def _metric(self, name: str, result: Result, metric: Metric) -> str:
        value = value_of(result, metric.name)
        if value is None:
            return tag("td", self.notes.dash(self._reason(name, result, metric)), class_="n")
        scale, decimals = self.scales[metric.name]
        shown = tag("data", text(scale.text(value, decimals)), value=repr(value))
        if name in self.findings.best(metric) and isinstance(result, ModelResult):
            return tag("td", tag("span", "best", class_="best"), tag("strong", shown), class_="n")
        return tag("td", shown, class_="n")

    def _reason(self, name: str, result: Result, metric: Metric) -> str:
        found = result.metrics.get(metric.name)
        if found is not None:
            return found.reason or "no reason was given"
        if name == metric.against:
            return "the error is measured from this reference itself"
        if self.findings.report.partial:
            return "not computed yet: the report is unfinished"
        return result.message or "this metric looks at another body"

    def _effort(self, model: ModelResult) -> list[str]:
        rounds = model.solve.get("iterations")
        iterations = (
            _number(rounds)
            if isinstance(rounds, int)
            else self.notes.dash(model.message or "the method does not iterate")
        )
        cells = [tag("td", self._size(model), class_="n"), tag("td", iterations, class_="n")]
        return cells + [tag("td", self._time(model, kind), class_="n") for kind in self.times]

    def _no_effort(self) -> list[str]:
        return [tag("td", self.notes.dash(NO_MESH), class_="n") for _ in range(2 + len(self.times))]

    def _size(self, model: ModelResult) -> str:
        if "dofs" not in model.size:
            return self.notes.dash(model.message or "the size is not known")
        rest = [_number(model.size[k]) + f" {k}" for k in ("nodes", "elements") if k in model.size]
        return _number(model.size["dofs"]) + " dofs" + _small_markup(" · ".join(rest))

    def _time(self, model: ModelResult, kind: str) -> str:
        timing = model.time.get(kind)
        if timing is None:
            return self.notes.dash("a static analysis has no time steps" if kind == "step_s" else "not timed")
        seconds, cpu = timing.to_json(), model.time.get(kind.replace("_s", "_cpu_s"))
        below = []
        if seconds["runs"] > 1:
            below.append(f"[{_seconds(seconds['min'])}–{_seconds(seconds['max'])}]")
            below.append(text(count(int(seconds["runs"]), "run")))
        elif kind == "solve_s":
            below.append("1 run")
        if cpu is not None and kind == "solve_s":
            below.append(f"CPU {_seconds(cpu.to_json()['median'])}")
        return _seconds(seconds["median"]) + _small_markup("<br>".join(below))

    def meanings(self) -> str:
        """What the metrics and the references are."""
        items = [_meaning(m) for m in self.columns if m.summary]
        items += [_source(n, r) for n, r in self.findings.report.references.items()]
        return tag("dl", *items, class_="meanings") if items else ""

    def csv(self) -> str:
        """Every number of the table in SI, as a link."""
        header = ["name", "kind", "status", "message", "about"]
        header += [f"{m.name} [{m.unit}]" for m in self.columns] + [
            "nodes",
            "elements",
            "dofs",
            "iterations",
            "residual",
        ]
        clocks = sorted({k for m in self.findings.report.models.values() for k, t in m.time.items() if t})
        header += [
            f"{clock.removesuffix('_s')} {part}"
            for clock in clocks
            for part in ("median [s]", "min [s]", "max [s]", "runs")
        ]
        rows = [self._record(n, r, clocks) for n, r in self.findings.everyone.items()]
        return csv_link("comparison", header, rows, "Save this table as CSV")

    def _record(self, name: str, result: Result, clocks: list[str]) -> list[Cell]:
        row: list[Cell] = [
            name,
            "model" if isinstance(result, ModelResult) else "reference",
            result.status,
            result.message,
        ]
        row += [result.outline if isinstance(result, ModelResult) else result.kind]
        row += [value_of(result, m.name) for m in self.columns]
        if isinstance(result, ReferenceResult):
            return row + [None] * (5 + 4 * len(clocks))
        row += [result.size.get(k) for k in ("nodes", "elements", "dofs")]
        row += [result.solve.get("iterations"), result.solve.get("residual")]
        return row + [cell for clock in clocks for cell in _clock(result.time.get(clock))]


def _clock(timing: Timing | None) -> list[Cell]:
    return [None] * 4 if timing is None else [*timing.to_json().values()]


def _status(result: Result) -> str:
    symbol, mood, words = SYMBOLS.get(result.status, ("?", "quiet", result.status))
    return tag("span", tag("span", symbol, aria_hidden="true"), f" {text(words)}", class_=f"status {mood}")


def _number(n: int) -> str:
    return tag("data", grouped(n), value=str(n))


def _seconds(seconds: float) -> str:
    return tag("data", text(quantity(seconds, "s", 3)), value=repr(float(seconds)))


def _small(words: str) -> str:
    return _small_markup(text(words))


def _small_markup(markup: str) -> str:
    return tag("small", markup) if markup else ""


def _meaning(metric: Metric) -> str:
    against = f" Against `{metric.against}`" if metric.against else ""
    where = f", at probe `{metric.probe}`." if against else f" At probe `{metric.probe}`."
    return tag(
        "div",
        tag("dt", tag("code", text(metric.name))),
        tag("dd", prose(metric.summary + against + (where if metric.probe else "."))),
    )


def _source(name: str, reference: ReferenceResult) -> str:
    error = reference.estimated_error
    own = "" if error is None else f" Its own error is estimated at {quantity(error, 'm', 2)}."
    said = f"{reference.kind[:1].upper()}{reference.kind[1:]}: {reference.source}.{own}"
    return tag("div", tag("dt", tag("code", text(name))), tag("dd", prose(said)))
