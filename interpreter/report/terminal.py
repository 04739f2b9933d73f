"""The report as a table in the terminal."""

from __future__ import annotations

import os
from collections.abc import Sequence

from softmark.interpreter import units
from softmark.interpreter.results import ExpectationResult, MetricResult, ModelResult, Report

STATUS = {
    "converged": "ok",
    "capped": "capped",
    "not_converged": "did not converge",
    "diverged": "diverged",
    "failed": "failed",
    "skipped": "skipped",
}


def table(report: Report, terminal: bool) -> str:
    """Title, a row per model and reference, expectations, and what went wrong."""
    paint = _Paint(terminal and not os.environ.get("NO_COLOR"))
    parts = [paint.bold(str(report.scene["title"])), "", _rows(report, paint)]
    if notes := [*_uncertain(report), *_reasons(report)]:
        parts += ["", *notes]
    if report.expectations:
        parts += ["", *(_expectation(e, paint) for e in report.expectations)]
    return "\n".join(parts)


class _Paint:
    def __init__(self, on: bool) -> None:
        self.on = on

    def _wrap(self, text: str, code: str) -> str:
        return f"\x1b[{code}m{text}\x1b[0m" if self.on else text

    def bold(self, text: str) -> str:
        return self._wrap(text, "1")

    def good(self, text: str) -> str:
        return self._wrap(text, "32")

    def bad(self, text: str) -> str:
        return self._wrap(text, "31")


def _rows(report: Report, paint: _Paint) -> str:
    names = _metric_names(report)
    head = ["", *names, "unknowns", "newton", "time", ""]
    rows = [_model_row(m, names) for m in report.models.values()]
    rows += [
        [
            f"({r.name})",
            *(_value(r.metrics.get(n)) for n in names),
            "",
            "",
            "",
            "reference" if r.status == "converged" else r.status,
        ]
        for r in report.references.values()
    ]
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    lines = [_line(head, widths), "  ".join("-" * w for w in widths).rstrip()]
    for row in rows:
        line = _line(row, widths)
        lines.append(line if row[-1] in ("ok", "reference") else paint.bad(line))
    return "\n".join(lines)


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *middle, last = cells
    numbers = (f"{c:>{w}}" for c, w in zip(middle, widths[1:-1], strict=True))
    return "  ".join([f"{first:<{widths[0]}}", *numbers, last]).rstrip()


def _metric_names(report: Report) -> list[str]:
    every = (n for part in report.outcomes for n in part.metrics)
    return list(dict.fromkeys(every))


def _model_row(m: ModelResult, names: Sequence[str]) -> list[str]:
    timing = m.time.get("solve_s")
    clock = units.show(timing.to_json()["median"], units.TIME) if timing and m.status in ("converged", "capped") else "-"
    iterations = str(m.solve.get("iterations", "-"))
    unknowns = str(m.size.get("dofs", "-"))
    return [
        m.name,
        *(_value(m.metrics.get(n)) for n in names),
        unknowns,
        iterations,
        _short(clock),
        STATUS[m.status],
    ]


def _short(clock: str) -> str:
    number, _, unit = clock.partition(" ")
    return f"{float(number):.3g} {unit}" if unit else clock


def _value(metric: MetricResult | None) -> str:
    if metric is None:
        return ""
    if metric.value is None:
        return "-"
    return _amount(metric.value, metric.unit) + ("" if metric.meaningful else " †")


def _amount(value: float, unit_text: str) -> str:
    dimension = units.parse(unit_text).dimension
    if dimension == units.NONE:
        return f"{100 * value:.3g} %"
    number, _, unit = units.show(value, dimension).partition(" ")
    return f"{float(number):.6g} {unit}"


def _uncertain(report: Report) -> list[str]:
    """The footnote of values that are no larger than the uncertainty of what they are measured from."""
    found = {
        name: _amount(metric.uncertainty, metric.unit)
        for part in report.outcomes
        for name, metric in part.metrics.items()
        if metric.uncertainty is not None and not metric.meaningful
    }
    each = ", ".join(f"± {amount} for {name}" for name, amount in found.items())
    return [f"† within the uncertainty of the reference ({each})"] if found else []


def _reasons(report: Report) -> list[str]:
    lines = [f"{m.name}: {m.message}" for m in report.outcomes if m.message]
    for part in report.outcomes:
        lines += [
            f"{part.name}.{n}: {v.reason}"
            for n, v in part.metrics.items()
            if v.value is None and not part.message
        ]
    return lines


def _expectation(e: ExpectationResult, paint: _Paint) -> str:
    if e.passed is None:
        return f"  not judged  line {e.line}: {e.text} ({e.reason})"
    if e.passed:
        return paint.good(f"  met         line {e.line}: {e.text}")
    found = "" if e.value is None else f"  (found {_amount(e.value, e.unit)})"
    return paint.bad(f"  NOT MET     line {e.line}: {e.text}{found}")
