"""Breakdown of computing time as stacked bars, and remarks on the quality of the timings."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.interpreter.language.number_formatting import format_quantity, typeset_number
from softmark.interpreter.report.comparison.comparison_tables import format_bytes, heading, row, row_head, table
from softmark.interpreter.report.comparison.comparison_view import SceneView
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.figure_frame import details
from softmark.interpreter.report.page.html_markup import count, prose, tag, text
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint
from softmark.interpreter.study.analysis.timing_quality import DISTURBANCES, REMARKS

PHASES = ("mesh", "set-up", "assembly", "factorisation", "solution", "other", "output")
SHOWN = 24  # bars that are drawn; the CSV has all


def costs(view: SceneView) -> str:
    """Return a bar of CPU time by phase for each of the most important configurations; empty if no phases are known."""
    split = [p for p in view.distinct_points if p.cost.phases]
    if not split:
        return ""
    chosen = _shown_configurations(view, split)
    named = [name for name in _phase_names(split) if any(p.cost.phases.get(name) for p in split)]
    rows = [_bar(p, named) for p in chosen]
    words = ("Configuration", "Total", "Share of each phase", "Memory")
    head = [heading(w, w in ("Total", "Memory")) for w in words]
    fewer = f" Shown are {len(chosen)} of {len(split)}: those on fronts and the finest of each line."
    some = "" if len(chosen) == len(split) else fewer
    caption = f"CPU time of each phase: building the model, one solution, and writing results.{some}"
    key = tag("ul", *(tag("li", _swatch(i), tag("span", text(n))) for i, n in enumerate(named)), class_="key")
    return key + table(caption, head, rows, "costs") + _phase_time_table(split, named) + _csv_link(view, split, named)


def _phase_names(points: Sequence[ComparedPoint]) -> list[str]:
    """Return the phases of all points in their usual order, other phases last."""
    return list(dict.fromkeys([*PHASES, *(n for p in points for n in p.cost.phases)]))


def _shown_configurations(view: SceneView, split: Sequence[ComparedPoint]) -> list[ComparedPoint]:
    """Return the configurations to show, at most SHOWN.

    If there are more, these are the configurations on a Pareto front and the last one, the finest, of each refinement
    line.
    """
    if len(split) <= SHOWN:
        return list(split)
    front = {k for own in view.metrics.values() for k in own.front}
    ends = {line.keys[-1] for line in view.lines}
    ranked = sorted(split, key=lambda p: (p.key not in front, p.key not in ends))[:SHOWN]
    return [p for p in split if p in ranked and (p.key in front or p.key in ends)] or list(split[:SHOWN])


def _bar(point: ComparedPoint, named: Sequence[str]) -> str:
    phases = point.cost.phases
    total = sum(phases.values())
    parts = [(i, n, phases[n] / total) for i, n in enumerate(named) if n in phases]
    words = ", ".join(f"{n} {_percent(share)}" for _, n, share in parts)
    pieces = [
        tag("span", text(_percent(share)) if share >= 0.12 else "", class_=f"part p{i % 7}",
            style=f"flex-grow:{share:.4f}", title=f"{n} {_percent(share)}")
        for i, n, share in parts
    ]  # fmt: skip
    bar = tag("td", tag("div", *pieces, class_="bar", role="img", aria_label=words), class_="wide-cell")
    seconds = tag("td", text(format_quantity(total, "s", 3)), class_="n")
    memory = tag("td", text(format_bytes(point.cost.memory_bytes)), class_="n")
    return row(row_head(point.label), seconds, bar, memory)


def _percent(share: float) -> str:
    return typeset_number(f"{100 * share:.0f} %") if share >= 0.01 else "< 1\u00a0%"


def _swatch(index: int) -> str:
    return tag("span", class_=f"part swatch p{index % 7}", aria_hidden="true")


def _phase_time_table(split: Sequence[ComparedPoint], named: Sequence[str]) -> str:
    """Return the table of the CPU times of each phase, s."""
    head = [heading("Configuration"), *(heading(n, True) for n in named)]
    rows = []
    for p in split:
        cells = [tag("td", text(_seconds(p.cost.phases.get(n))), class_="n") for n in named]
        rows.append(row(row_head(p.label), *cells))
    return details("Data of this chart", table("CPU time of each phase", head, rows))


def _seconds(value: float | None) -> str:
    return "–" if value is None else format_quantity(value, "s", 3)


def _csv_link(view: SceneView, split: Sequence[ComparedPoint], named: Sequence[str]) -> str:
    rows: list[list[Cell]] = [[p.label, *(p.cost.phases.get(n) for n in named), p.cost.memory_bytes] for p in split]
    header = ["configuration", *(f"{n} [s]" for n in named), "memory [B]"]
    return csv_link(f"{view.scene}-costs", header, rows)


def timing_quality_html(view: SceneView, allowed: bool = False) -> str:
    """Return sentences on the reliability of the timings as HTML; `allowed` is true if disturbed timings count."""
    known = view.analysis.timing
    if not known.timed:
        return _callout("quiet", "No times were measured: configurations are compared by their number of unknowns.")
    least, most, disturbed = known.least_runs, known.most_runs, known.contaminated
    runs = f"{least} to {most}" if least != most else f"{least}"
    said = f"{known.timed} of {count(known.of, 'configuration')} timed, {runs} runs each."
    left_out = f" {count(known.excluded_runs, 'run')} excluded as disturbed."
    said += left_out if known.excluded_runs else " No run was excluded."
    if disturbed:
        counted = ", but counted" if allowed else ", not counted"
        said += f" Disturbed{counted}: {_list_labels(disturbed, known.timed)}."
    flags = "".join(tag("li", prose(_remark_with_count(flag, n))) for flag, n in known.flags.items())
    mood = "warn" if disturbed or known.flags else "good"
    return _callout(mood, said, tag("ul", flags, class_="flags") if flags else "")


def _list_labels(labels: Sequence[str], of: int) -> str:
    """Return `all` if there are `of` labels, else the first eight labels and the number of the others."""
    if len(labels) == of > 1:
        return "all"
    more = f" and {len(labels) - 8} more" if len(labels) > 8 else ""
    return ", ".join(f"`{label}`" for label in labels[:8]) + more


def _remark_with_count(flag: str, n: int) -> str:
    """Return a remark with the number `n` of configurations, such as `few repeats: ... (2 configurations)`."""
    meaning = REMARKS.get(flag) or DISTURBANCES.get(flag)
    return (f"{flag}: {meaning}" if meaning else flag) + f" ({count(n, 'configuration')})"


def _callout(mood: str, words: str, more: str = "") -> str:
    return tag("div", tag("p", prose(words)), more, class_=f"callout {mood}")
