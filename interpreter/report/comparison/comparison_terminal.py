"""Terminal table of a comparison; `*` marks the Pareto front, and the recommendation comes last."""

from __future__ import annotations

import os
import shutil
import textwrap
from collections.abc import Sequence

from softmark.grammar.diagnostic import make_all_visible
from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.comparison.comparison_view import (
    CLOCKS,
    SceneView,
    separate_problems_note,
    status_of,
    views,
)
from softmark.interpreter.report.comparison.study_answers import study_lines
from softmark.interpreter.report.page.html_markup import strip_backticks
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
from softmark.interpreter.study.analysis.study_results import ParetoAnswer

WIDE = 110  # characters per line if the width of the window is unknown
TOLD = 4  # largest number of problems of a scene, and of lines of an answer, in the terminal
CODES = {"bold": "1", "good": "32", "bad": "31", "quiet": "2"}


def table(comparison: ComparisonRecord, colour: bool, path: str | None = None, width: int | None = None) -> str:
    """Return the terminal text: configurations of every scene, failures, recommendation, and the path of the page."""
    paint, room = _terminal_settings(colour, width)
    blocks = [block for own in _views_by_scene(comparison) for block in _scene(own, paint, room)]
    blocks = blocks or ["No configurations."]
    return "\n\n".join([*blocks, *([f"comparison: {path}"] if path else [])])


def error_tables(comparison: ComparisonRecord, colour: bool) -> str:
    """Return the tables of errors for the terminal before anything is timed, without a recommendation."""
    paint, room = _terminal_settings(colour, None)
    each = (
        _errors(own, ": errors; times are still being measured", paint, room) for own in _views_by_scene(comparison)
    )
    return "\n\n".join(block for blocks in each for block in blocks)


def _terminal_settings(colour: bool, width: int | None) -> tuple[bool, int]:
    """Return whether to use colours, and the number of characters per line."""
    room = width or max(80, shutil.get_terminal_size((WIDE, 24)).columns if colour else WIDE)
    return colour and not os.environ.get("NO_COLOR"), room


def _views_by_scene(comparison: ComparisonRecord) -> list[list[SceneView]]:
    """Return the views of the problems of each scene."""
    scenes: dict[str, list[SceneView]] = {}
    for view in views(comparison):
        scenes.setdefault(view.analysis.scene, []).append(view)
    return list(scenes.values())


def _apply_ansi_style(words: str, name: str, paint: bool) -> str:
    return f"\x1b[{CODES[name]}m{words}\x1b[0m" if paint else words


def _scene(own: Sequence[SceneView], paint: bool, room: int) -> list[str]:
    """Return the lines of text of a scene; it has several problems `own` if a sweep changes the reference."""
    blocks = _errors(own, "", paint, room)
    told = own[:TOLD]
    answers = [
        _with_varied_value(view, _plain_text(s)) if isinstance(a, ParetoAnswer) else _plain_text(s)
        for view in told for a in view.analysis.answers for s in _truncate(study_lines(a))
    ]  # fmt: skip
    blocks += ["\n".join(answers)] if answers else []
    said = [
        _with_varied_value(view, words) for view in told
        for words in (*(a.text for a in view.analysis.advice), *(d.text for d in view.analysis.disagreements))
    ]  # fmt: skip
    advice = [textwrap.fill(_plain_text(words), room, initial_indent="-> ", subsequent_indent="   ") for words in said]
    advice += [] if advice else [_plain_text(own[0].no_advice_reason)]
    advice += [f"-> {len(own) - TOLD} more on the HTML page"] if len(own) > TOLD else []
    return [*blocks, *(["\n".join(advice)] if advice else [])]


def _errors(own: Sequence[SceneView], beside: str, paint: bool, room: int) -> list[str]:
    """Return the title followed by the text `beside`, the table of errors, and its notes, as lines of text."""
    blocks = [
        _apply_ansi_style(make_all_visible(own[0].title) + beside, "bold", paint),
        _configuration_table(own, paint),
    ]
    notes = [_plain_text(note) for note in (separate_problems_note(own), *_footnotes(own)) if note]
    return [*blocks, *(["\n".join(textwrap.fill(n, room, subsequent_indent="  ") for n in notes)] if notes else [])]


def _with_varied_value(view: SceneView, words: str) -> str:
    return f"{make_all_visible(view.at)}: {words}" if view.at else words


def _truncate(lines: Sequence[str]) -> list[str]:
    """Return the first lines of a study's answer, and a line with the number of omitted ones."""
    more = len(lines) - TOLD
    return [*lines] if more <= 1 else [*lines[:TOLD], f"and {more} more on the HTML page"]


def _plain_text(words: str) -> str:
    """Return text without the markup of the page and without control characters."""
    return strip_backticks(make_all_visible(words)).replace("\u00a0", " ").replace("\u202f", " ")


def _configuration_table(own: Sequence[SceneView], paint: bool) -> str:
    metrics = list(dict.fromkeys(m for view in own for m in view.metrics))
    points = [(view, p) for view in own for p in view.distinct_points]
    clocks = dict.fromkeys(CLOCKS.get(view.clock, view.clock) for view in own if view.timed)
    own_metrics = list(dict.fromkeys(m for view in own for m in view.measurements))
    head = ["", *metrics, *own_metrics, "unknowns", "iterations", *([" or ".join(clocks)] if clocks else []), ""]
    rows = [_row(view, p, metrics, own_metrics, bool(clocks)) for view, p in points]
    widths = [max(len(r[i]) for r in (head, *rows)) for i in range(len(head))]
    lines = [_aligned_line(head, widths), "  ".join("-" * w for w in widths).rstrip()]
    for (view, point), cells in zip(points, rows, strict=True):
        style = "good" if view.pareto_metrics(point) else None if point.solved else "bad"
        line = _aligned_line(cells, widths)
        lines.append(_apply_ansi_style(line, style, paint) if style else line)
    return "\n".join(lines)


def _aligned_line(cells: Sequence[str], widths: Sequence[int]) -> str:
    shown = [f"{c:>{w}}" for c, w in zip(cells, widths, strict=True)]
    shown[0], shown[-1] = f"{cells[0]:<{widths[0]}}", cells[-1]
    return "  ".join(shown).rstrip()


def _row(
    view: SceneView, point: ComparedPoint, metrics: Sequence[str], measured: Sequence[str], timed: bool
) -> list[str]:
    cells = [point.label, *(_error(view, point, m) for m in metrics)]
    cells += [_plain_text(view.format_measurement(point, m)) if m in view.measurements else "-" for m in measured]
    cells += [str(point.dofs or "-"), "-" if point.iterations is None else str(point.iterations)]
    cells += [_time(view, point) if view.timed else "-"] if timed else []
    said = ["" if point.status == "converged" else status_of(point.status), "disturbed" * view.disturbed(point)]
    return [make_all_visible(cell) for cell in (*cells, ", ".join(word for word in said if word))]


def _error(view: SceneView, point: ComparedPoint, metric: str) -> str:
    """Return the error of a point as text, such as `1.2 % *`.

    `*` marks the Pareto front, `†` an error below the uncertainty of the reference.
    """
    error, own = point.error(metric), view.metrics.get(metric)
    if error is None or own is None:
        return "-  "
    within = "†" if point.within(metric, own.uncertainty) else " "
    return _plain_text(view.amount(error, metric)) + within + ("*" if point.key in own.front else " ")


def _time(view: SceneView, point: ComparedPoint) -> str:
    """Return the time of a point as text, `84 ms ±8 %`, with half the interquartile range."""
    spread = view.effort(point)
    if spread is None:
        return "-"
    half = 50 * (spread.q3 - spread.q1) / spread.median
    most = "<= " if point.cost.is_upper_bound and view.timed else ""
    return most + _plain_text(format_quantity(spread.median, "s", 3)) + (f" ±{half:.0f} %" if half >= 0.5 else "")


def _footnotes(own: Sequence[SceneView]) -> list[str]:
    """Return notes with the meaning of the marks, and each reason of failure once."""
    marks = []
    if any(known.front for view in own for known in view.metrics.values()):
        what = "less time" if any(view.timed for view in own) else "fewer unknowns"
        marks.append(f"* on the Pareto front: no configuration has {what} and a smaller error")
    if any(_is_within_uncertainty(view, p) for view in own for p in view.points):
        marks.append("† within the uncertainty of the reference")
    marks += [f"uncertainty of {name}: ±{known}" for name, known in _reference_uncertainties(own).items()]
    if any(view.timed and view.effort(p) is not None for view in own for p in view.points):
        marks.append("± after a time: half the interquartile range of the repeated measurements")
    lines = ["; ".join(marks)] if marks else []
    reasons: dict[str, dict[str, None]] = {}
    for failure in (f for view in own for f in view.analysis.failures):
        reasons.setdefault(failure.message or failure.status, {})[failure.label] = None
    for reason, labels in reasons.items():
        who = ", ".join(labels) if len(labels) <= 5 else f"{len(labels)} configurations"
        lines.append(f"{who}: {_plain_text(reason)}")
    return lines


def _reference_uncertainties(own: Sequence[SceneView]) -> dict[str, str]:
    """Return the largest uncertainty of the reference of each error metric as text."""
    found: dict[str, tuple[float, SceneView]] = {}
    for view in own:
        for name, known in view.metrics.items():
            if known.uncertainty > found.get(name, (0.0, view))[0]:
                found[name] = (known.uncertainty, view)
    return {name: _plain_text(view.amount(most, name)) for name, (most, view) in found.items()}


def _is_within_uncertainty(view: SceneView, point: ComparedPoint) -> bool:
    return any(point.within(m, own.uncertainty) for m, own in view.metrics.items())
