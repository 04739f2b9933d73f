"""Residual over iteration, one small chart for each model; phases differ by marker, colour and dash."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from softmark.interpreter.report.axes import Axis, logarithmic, whole
from softmark.interpreter.report.chart import Chart, Curve, Point, sample
from softmark.interpreter.report.findings import Findings
from softmark.interpreter.report.looks import Look, model_look
from softmark.interpreter.report.markup import count, listed, prose, section, tag, text
from softmark.interpreter.report.plate import Column, plate
from softmark.interpreter.report.quantities import signed
from softmark.interpreter.report.sheet import Cell, csv_link
from softmark.interpreter.results import ModelResult

SYMBOLS = ("phase", "load", "residual", "step")


@dataclass(frozen=True)
class _Step:
    """One row of a history: the residual before the step, None where it was not finite or not known."""

    phase: str
    load: float | None
    residual: float | None
    length: float | None


def section_of(findings: Findings) -> str:
    """The charts; empty where no model has a history."""
    models = {n: m for n, m in findings.report.models.items() if _history(m)}
    if not models:
        return ""
    phases = {
        p: model_look(i)
        for i, p in enumerate(dict.fromkeys(s.phase for m in models.values() for s in _history(m)))
    }
    y = _residuals([s.residual for m in models.values() for s in (*_history(m), _end(m))])
    charts = [_plate(i, n, m, phases, y) for i, (n, m) in enumerate(models.items())]
    silent = [f"`{n}`" for n in findings.report.models if n not in models]
    missing = (
        tag("p", prose(f"No iterations were recorded for {listed(silent)}."), class_="quiet")
        if silent
        else ""
    )
    lead = prose(
        "Residual of equilibrium relative to the forces, before each iteration; the last point is what was reached. "
        "A residual that rises and then falls fast is Newton's method finding its way."
    )
    return section(
        "convergence",
        "Convergence",
        tag("p", lead, class_="lead"),
        _key(phases),
        tag("div", *charts, class_="small-plates"),
        missing,
    )


def _history(model: ModelResult) -> list[_Step]:
    return [_step(entry) for entry in model.solve.get("history") or ()]


def _step(entry: Mapping[str, Any]) -> _Step:
    return _Step(str(entry.get("phase", "")), entry.get("load"), entry.get("residual"), entry.get("length"))


def _end(model: ModelResult) -> _Step:
    """The residual that was reached after the last iteration."""
    return _Step("reached", None, model.solve.get("residual"), None)


def _residuals(values: Sequence[float | None]) -> Axis:
    """One axis for all charts, so that they compare."""
    positive = [v for v in values if v is not None and v > 0] or [1.0]
    return logarithmic(max(min(positive), 1e-17 * max(positive)), max(positive), "residual", "1", about=5)


def _key(phases: Mapping[str, Look]) -> str:
    items = [tag("li", sample(look), tag("span", text(phase))) for phase, look in phases.items()]
    return tag("ul", *items, class_="key", aria_label="Phases")


def _plate(index: int, name: str, model: ModelResult, phases: Mapping[str, Look], y: Axis) -> str:
    steps, end = _history(model), _end(model)
    outcome = "converged" if model.status == "converged" else model.status.replace("_", " ")
    said = f"{outcome}, {count(int(model.solve.get('iterations', len(steps))), 'iteration')}"
    reached = f", residual {signed(f'{end.residual:.2g}')}" if end.residual is not None else ""
    shown = f"; the last {len(steps)} are drawn" if model.solve.get("iterations", 0) > len(steps) else ""
    chart = Chart(
        f"newton-{index}", f"Convergence of {name}", f"{name} {said}{reached}{shown}. {_phases_in_words(steps)}",
        whole(len(steps), "iteration", 5), y, 300.0, 150.0, tuple(_curves(steps, end, phases, y)),
        under=_not_finite(steps, y), labels=False, left=58.0, top=12.0, right=14.0, bottom=42.0,
    )  # fmt: skip
    caption = prose(f"`{name}`: {said}{reached}{shown}.")
    return plate(chart, caption, _columns(steps, end), _save(name, steps, end), legend=False)


def _phases_in_words(steps: Sequence[_Step]) -> str:
    runs = [(phase, len(list(group))) for phase, group in groupby(s.phase for s in steps)]
    return "Phases: " + ", then ".join(f"{phase} ({count(n, 'iteration')})" for phase, n in runs) + "."


def _curves(steps: Sequence[_Step], end: _Step, phases: Mapping[str, Look], y: Axis) -> Iterator[Curve]:
    """One curve for each stretch of a phase, up to the first point of the next, so that the line does not break."""
    rows = [*steps, end]
    start = 0
    for phase, group in groupby(s.phase for s in steps):
        stop = start + len(list(group))
        points: list[Point | None] = [None] * len(rows)
        for i in range(start, min(stop + 1, len(rows))):
            points[i] = _point(i, rows[i].residual, y)
        yield Curve(phase, phases[phase], tuple(points), 1, len(SYMBOLS), every=1)
        start = stop


def _point(index: int, residual: float | None, y: Axis) -> Point | None:
    return None if residual is None or residual <= 0 else (float(index), max(residual, y.low))


def _not_finite(steps: Sequence[_Step], y: Axis) -> str:
    """A cross at the top for each residual that was not a finite number."""
    n = max(len(steps), 1)
    places = [58.0 + 300.0 * i / n for i, s in enumerate(steps) if s.residual is None]
    return "".join(
        tag("path", tag("title", "not finite"), class_="lost", d=f"M{x - 4:.1f} 8l8 8m-8 0l8-8")
        for x in places
    )


def _columns(steps: Sequence[_Step], end: _Step) -> list[Column]:
    rows = [*steps, end]
    numbers = [(str(i),) for i in range(len(rows))]
    cells = [(s.phase, _percent(s.load), _number(s.residual), _percent(s.length)) for s in rows]
    return [Column("iteration", ("iteration",), numbers), Column("Newton's method", SYMBOLS, cells)]


def _number(value: float | None) -> str:
    return "–" if value is None else signed(f"{value:.3g}")


def _percent(value: float | None) -> str:
    return "–" if value is None else signed(f"{value * 100:.4g} %")


def _save(name: str, steps: Sequence[_Step], end: _Step) -> str:
    rows: list[list[Cell]] = [[i, s.phase, s.load, s.residual, s.length] for i, s in enumerate([*steps, end])]
    return csv_link(f"{name}-convergence", ["iteration", "phase", "load", "residual", "length"], rows)
