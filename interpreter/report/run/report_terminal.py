"""Terminal table of a report."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from softmark.grammar.diagnostic import make_all_visible
from softmark.interpreter.language import units
from softmark.interpreter.language.number_formatting import format_moment_unit, is_negligible, round_significant
from softmark.interpreter.report.run import reused_results
from softmark.interpreter.report.run.figures import state_charts
from softmark.interpreter.report.run.report_bodies import BodyResults, bodies
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary, Result, value_of
from softmark.interpreter.report.run.tables import (
    contact_table,
    error_statement_table,
    reaction_table,
    reference_agreement,
)
from softmark.interpreter.report.run.tables.results_table import sort_metrics, stated_error_or_uncertainty
from softmark.interpreter.results.run_report import (
    ExpectationResult,
    MetricResult,
    ModelResult,
    ReferenceResult,
    Report,
)
from softmark.records import dataclass

MENTIONED = 0.02  # fraction of a limit from which the uncertainty of a reference is mentioned
LEAST_ERROR = 1e-9  # m, for a reference that states its own error
SEVERAL = 5  # largest number of names listed in a line

STATUS = {
    "converged": "ok",
    "capped": "capped",
    "read": "read",
    "not_converged": "did not converge",
    "diverged": "diverged",
    "failed": "failed",
    "skipped": "skipped",
    "unsupported": "unsupported",
}
INVERTED = "inverted cells"


WIDE = 110  # characters per line if the width of the window is unknown


def table(report: Report, terminal: bool, width: int | None = None) -> str:
    """Return the report as terminal text: title, a row per model and reference, expectations, failures and notes.

    Each body has its own table. Columns beyond `width` characters continue below.
    """
    report = _terminal_safe(report)
    paint = _Paint(terminal and not os.environ.get("NO_COLOR"))
    room = width or (max(80, shutil.get_terminal_size((WIDE, 24)).columns) if terminal else WIDE)
    findings = ReportSummary(report)
    parts = [paint.bold(str(report.scene["title"])), ""]
    for number, body in enumerate(bodies(findings)):
        parts += [""] if number else []
        parts += [paint.bold(body.name)] if body.name else []
        parts.append(_Rows(findings, body, paint).text(room))
    if told := list(state_charts.lines(findings)):
        parts += ["", *told]
    notes = [*_symmetry_notes(findings), *_uncertainty_footnote(report), *_validity_footnote(report)]
    notes += [*_reasons(report), *_reference_notes(report), *_reading_notes(report)]
    notes += [
        *reference_agreement.lines(findings),
        *error_statement_table.lines(report),
        *reaction_table.lines(report),
        *contact_table.lines(report),
    ]
    notes += [said] if (said := reused_results.sentence(report)) else []
    if notes:
        parts += ["", *notes]
    if report.expectations:
        parts += ["", *(_expectation(e, paint) + _reference_uncertainty(report, e) for e in report.expectations)]
    return "\n".join(parts)


def _terminal_safe(report: Report) -> Report:
    """Return the report with all external texts made safe for a terminal; the text of the scene is unchanged."""
    scene = {n: v if n == "text" else make_all_visible(v) for n, v in report.scene.items()}
    models, references = (
        {n: _terminal_safe_result(r) for n, r in known.items()} for known in (report.models, report.references)
    )
    judged = tuple(
        replace(e, text=make_all_visible(e.text), reason=make_all_visible(e.reason)) for e in report.expectations
    )
    return replace(report, scene=scene, models=models, references=references, expectations=judged)


def _terminal_safe_result(result: Any) -> Any:
    metrics = {n: replace(m, reason=make_all_visible(m.reason)) for n, m in result.metrics.items()}
    shown = replace(result, message=make_all_visible(result.message), metrics=metrics)
    if not isinstance(shown, ModelResult):
        return shown
    return replace(shown, stated={n: replace(s, reason=make_all_visible(s.reason)) for n, s in shown.stated.items()})


class _Paint:
    def __init__(self, on: bool) -> None:
        self.on = on

    def _apply_style(self, text: str, code: str) -> str:
        return f"\x1b[{code}m{text}\x1b[0m" if self.on else text

    def bold(self, text: str) -> str:
        return self._apply_style(text, "1")

    def good(self, text: str) -> str:
        return self._apply_style(text, "32")

    def bad(self, text: str) -> str:
        return self._apply_style(text, "31")


REFERENCE = "reference: "  # followed by the kind of the reference
EFFORT = ("unknowns", "newton", "time", "")


@dataclass(frozen=True)
class _Rows:
    """Terminal table with the results of one body."""

    findings: ReportSummary
    body: BodyResults
    paint: _Paint

    @property
    def metrics(self) -> list[MetricColumn]:
        """Metrics of the columns, in the same order as on the page: errors by reference, measurements, times."""
        return sort_metrics(self.body.metrics)

    @cached_property
    def _largest(self) -> dict[str, float]:
        """Largest absolute value of each metric."""
        everyone = [self.findings.all_results[n] for n in self.body.results]
        values = {m.name: [value_of(r, m.name) for r in everyone] for m in self.metrics}
        return {n: max((abs(v) for v in known if v is not None), default=0.0) for n, known in values.items()}

    def text(self, room: int) -> str:
        """Return the lines of the table, at most `room` characters wide.

        Columns that do not fit follow below, with the names repeated.
        """
        head = ["", *map(_heading, self.metrics), *EFFORT]
        rows = [self._row(n, self.findings.all_results[n]) for n in self.body.results]
        widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
        blocks = _split_columns(widths, room, len(EFFORT))
        return "\n\n".join(self._block(head, rows, widths, block) for block in blocks)

    def _block(
        self, head: Sequence[str], rows: Sequence[Sequence[str]], widths: Sequence[int], chosen: Sequence[int]
    ) -> str:
        own = [widths[i] for i in chosen]
        last = chosen[-1] == len(widths) - 1  # the status has no heading and is left-aligned
        lines = [_aligned_line([head[i] for i in chosen], own, last), "  ".join("-" * w for w in own).rstrip()]
        for row in rows:
            line = _aligned_line([row[i] for i in chosen], own, last)
            lines.append(line if row[-1] == "ok" or row[-1].startswith(REFERENCE) else self.paint.bad(line))
        return "\n".join(lines)

    def _row(self, name: str, result: Result) -> list[str]:
        values = [self._format_metric(result, m) for m in self.metrics]
        if isinstance(result, ModelResult):
            return [name, *values, *_effort(result)]
        end = REFERENCE + result.kind + _uncertainty_suffix(result) if result.status == "converged" else result.status
        return [f"({name})", *values, "", "", "", end]

    def _format_metric(self, result: Result, metric: MetricColumn) -> str:
        found = result.metrics.get(metric.name)
        if found is None:
            return ""
        if found.value is None:
            return "-"
        if metric.clock and "verdict" in found.details:
            return _real_time_verdict(found)
        if is_negligible(found.value, self._largest[metric.name], metric.unit, self.findings.moved):
            return "0"
        off = stated_error_or_uncertainty(result, metric)
        error = "" if off is None else f" {error_statement_table.stated_error(off, found)}"
        marks = ("" if found.meaningful else " †") + (" ‡" if found.doubt else "")
        return _amount(found.value, found.unit) + error + marks


def _uncertainty_suffix(reference: ReferenceResult) -> str:
    """Return the uncertainty of a reference as a suffix, `, ± 23 µm`; empty if it is negligible."""
    error, facts = reference.estimated_error, reference.facts
    if error is not None:
        displaced = reference.probes or reference.shape is not None  # irrelevant for a reference with forces only
        return f", ± {_format_uncertainty(error, 'm')}" if displaced and error >= LEAST_ERROR else ""
    known = facts.get("uncertainty") if "unit" in facts else None  # for a curve, the largest uncertainty of its values
    return f", ± {_format_uncertainty(known, facts['unit'])} at most" if known else ""


def _format_uncertainty(value: float, unit: str) -> str:
    """Return an uncertainty with two digits: `23 µm`."""
    return error_statement_table.amount(value, unit).replace("\N{NO-BREAK SPACE}", " ")


def _split_columns(widths: Sequence[int], room: int, effort: int) -> list[list[int]]:
    """Return the indices of the columns in each block of the table.

    Each block begins with the column of names. The columns of the effort, from index `effort` on, stay together.
    """
    last = list(range(len(widths) - effort, len(widths)))
    blocks: list[list[int]] = [[0]]
    for group in [*([i] for i in range(1, last[0])), last]:
        wide = sum(widths[i] + 2 for i in (*blocks[-1], *group)) - 2
        if wide > room and len(blocks[-1]) > 1:
            blocks.append([0])
        blocks[-1] += group
    return blocks


def _aligned_line(cells: Sequence[str], widths: Sequence[int], ends: bool) -> str:
    shown = [f"{c:>{w}}" for c, w in zip(cells, widths, strict=True)]
    shown[0] = f"{cells[0]:<{widths[0]}}"
    if ends:
        shown[-1] = cells[-1]
    return "  ".join(shown).rstrip()


def _effort(m: ModelResult) -> list[str]:
    timing = m.time.get("solve_s")
    clock = units.format_value(timing.median, units.TIME) if timing and m.status == "converged" else "-"
    most = "<= " if timing and timing.most and clock != "-" else ""
    iterations, unknowns = str(m.solve.get("iterations", "-")), str(m.size.get("dofs", "-"))
    return [unknowns, iterations, most + _shorten_time(clock), INVERTED if m.inverted else STATUS[m.status]]


def _shorten_time(clock: str) -> str:
    number, _, unit = clock.partition(" ")
    return f"{float(number):.3g} {unit}" if unit else clock


def _real_time_verdict(found: MetricResult) -> str:
    """Return a real-time verdict such as `yes, uses 54 % of 40 ms` or `NO, takes 3.77 x 40 ms`.

    If a time step is longer than a frame, the model can never be fast enough: `NO, step over 40 ms`.
    """
    used = 1.0 - float(found.details.get("margin", 0.0))
    limit = units.format_value(round_significant(found.details["limit_s"], 3), units.TIME)
    if found.details["verdict"]:
        return f"yes, uses {100 * used:.3g} % of {limit}"
    frame = units.format_value(round_significant(1.0 / found.details["rate_Hz"], 3), units.TIME)
    return f"NO, takes {used:.3g} x {limit}" if used > 1.0 else f"NO, step over {frame}"


def _heading(metric: MetricColumn) -> str:
    """Return the heading of a metric's column: its name, with `(real time)` if the column shows verdicts."""
    return f"{metric.name} (real time)" if metric.clock else metric.name


def _amount(value: float, unit_text: str) -> str:
    dimension = units.parse_unit(unit_text).dimension
    if dimension == units.NONE:
        return f"{100 * value:.3g} %"
    number, _, unit = units.format_value(value, dimension).partition(" ")
    return format_moment_unit(f"{float(number):.6g} {unit}", unit_text)


def _symmetry_notes(findings: ReportSummary) -> list[str]:
    """Return notes on models of a symmetric part, such as `push, held are of the quarter of layer that is modelled`."""
    same: dict[str, list[str]] = {}
    for metric in findings.metrics:
        if metric.part:
            same.setdefault(metric.part, []).append(metric.name)
    return [
        f"{', '.join(names)}: of {part.replace('`', '')}{_references_of_part(findings, names)}"
        for part, names in same.items()
    ]


def _references_of_part(findings: ReportSummary, metrics: Sequence[str]) -> str:
    """Return a phrase on references whose metric values also refer to the symmetric part of the body.

    A model may solve only a part of a body that has symmetry planes, for example one quarter. The phrase is empty if no
    reference has a value of the metrics.
    """
    known = [n for n, r in findings.report.references.items() if any(value_of(r, m) is not None for m in metrics)]
    return f"; also of {', '.join(known)}" if known else ""


def _uncertainty_footnote(report: Report) -> list[str]:
    """Return the footnote on values that do not exceed the uncertainty of their reference."""
    found = {
        name: _amount(metric.uncertainty, metric.unit)
        for part in report.outcomes
        for name, metric in part.metrics.items()
        if metric.uncertainty is not None and not metric.meaningful
    }
    each = ", ".join(f"± {amount} for {name}" for name, amount in found.items())
    return [f"† within the uncertainty of the reference ({each})"] if found else []


def _validity_footnote(report: Report) -> list[str]:
    """Return one footnote for each reason why a theory is not exact, with the names of the metrics concerned."""
    found: dict[str, dict[str, None]] = {}
    for part in report.outcomes:
        for name, metric in part.metrics.items():
            if metric.doubt is not None and metric.value is not None:
                found.setdefault(metric.doubt, {})[name] = None
    return [f"‡ {', '.join(names)}: the theory is not exact here: {why}"
            for why, names in found.items()]  # fmt: skip


def _reasons(report: Report) -> list[str]:
    """Return the reasons of missing solutions and missing metric values, each once."""
    lines = [f"{m.name}: {m.message}" for m in report.outcomes if m.message]
    same: dict[str, tuple[dict[str, None], dict[str, None]]] = {}
    for part in report.outcomes:
        for name, metric in part.metrics.items():
            if metric.value is None and not part.message:
                metrics, owners = same.setdefault(metric.reason or "no value", ({}, {}))
                metrics[name] = owners[part.name] = None
    for reason, (metrics, owners) in same.items():
        who = ", ".join(owners) if len(owners) <= SEVERAL else f"{len(owners)} models and references"
        lines.append(f"no {', '.join(metrics)} for {who}: {reason}")
    return lines


def _reading_notes(report: Report) -> list[str]:
    """Return notes on how measurements were read, such as units below a header or omitted rows."""
    known = report.references.items()
    measured = [(n, r.facts.get("notes") or ()) for n, r in known if "uncertainty" in r.facts]
    return [make_all_visible(f"{name}: {note}") for name, notes in measured for note in notes]


def _reference_notes(report: Report) -> list[str]:
    """Return the notes that references contain about themselves."""
    return [f"{name}: {said}" for name, r in report.references.items() if (said := r.facts.get("said"))]


def _reference_uncertainty(report: Report, e: ExpectationResult) -> str:
    """Return the reference uncertainty of an expectation's metric as text, if it is large or may change the verdict."""
    if e.passed is None or e.value is None:
        return ""
    compared = (e.value, *e.limits)
    known = [m for name, metric in e.about for m in _metric_in_states(report, name, metric) if m.value in compared]
    open_ = max((m.uncertainty or 0.0 for m in known), default=0.0)
    if not open_:
        return ""
    said = f"; uncertainty of the reference \u00b1 {_format_uncertainty(open_, e.unit)}"
    if any(abs(e.value - limit) <= open_ for limit in e.limits):
        return f"{said}, which may change this result"
    return said if any(open_ > MENTIONED * abs(limit) for limit in e.limits) else ""


def _metric_in_states(report: Report, name: str, metric: str) -> Iterator[MetricResult]:
    """Yield a metric of a model or reference in every state."""
    owner = report.models.get(name) or report.references.get(name)
    everywhere = [] if owner is None else [owner, *owner.each]
    yield from (own.metrics[metric] for own in everywhere if metric in own.metrics)


def _expectation(e: ExpectationResult, paint: _Paint) -> str:
    if e.passed is None:
        return f"  not judged  line {e.line}: {e.text} ({e.reason})"
    if e.passed:
        return paint.good(f"  met         line {e.line}: {e.text}")
    where = f"; {e.reason}" if e.states else ""
    found = "" if e.value is None else f"  (found {_amount(e.value, e.unit)}{where})"
    return paint.bad(f"  NOT MET     line {e.line}: {e.text}{found}")
