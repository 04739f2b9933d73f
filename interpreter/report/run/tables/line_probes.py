"""Line and point probes for figures: their results, arc lengths, and the styles of curves."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.report.charts.curve_styles import COLOURS, CurveStyle, model_look, reference_look
from softmark.interpreter.report.page.figure_frame import SHOWN
from softmark.interpreter.report.run.report_summary import UNKNOWN, ReportSummary, value_of
from softmark.interpreter.results.run_report import ProbeResult, Report

Floats = NDArray[np.float64]
AXES = ("x", "y", "z")


def _probe_constructor(findings: ReportSummary, probe: str) -> str:
    """Return the constructor of a probe, such as `line` or `point`; "" if it is not in the scene's own text."""
    return findings.declared.get(probe, UNKNOWN).word


def lines_of(findings: ReportSummary) -> dict[str, dict[str, ProbeResult]]:
    """Return the results of line probes that have at least two points, by probe and by model or reference."""
    found = {}
    for name, seen in findings.probes.items():
        several = any(len(p.points) > 1 and p.triangles is None for p in seen.values())
        if several and _probe_constructor(findings, name) in ("line", ""):
            found[name] = seen
    return found


def points_of(findings: ReportSummary) -> dict[str, dict[str, ProbeResult]]:
    """Return the results of point probes, by probe and by model or reference."""
    found = {}
    for name, seen in findings.probes.items():
        alone = {n: p for n, p in seen.items() if len(p.points) == 1 and p.triangles is None}
        if alone and len(alone) == sum(len(p.points) > 0 for p in seen.values()):
            found[name] = alone
    return found


def curve_styles(report: Report) -> dict[str, CurveStyle]:
    """Return the style of each model and reference, the same in every figure of the page.

    If there are more models than colours, models of one kind share a colour and differ by dash and marker.
    """
    found = {name: model_look(i) for i, name in enumerate(report.models)}
    if len(found) > COLOURS:
        found = _colours_by_kind(report)
    return found | {name: reference_look(i) for i, name in enumerate(report.references)}


def _colours_by_kind(report: Report) -> dict[str, CurveStyle]:
    """Return a colour style for each model; models that differ only in size or Poisson's ratio share it."""
    kinds: dict[str, list[str]] = {}
    for name, model in report.models.items():
        kind = model.kind
        kinds.setdefault(f"kind {kind.words}" if kind else f"model {name}", []).append(name)
    colours = {n: i for i, names in enumerate(kinds.values()) for n in names}
    places = {n: i for names in kinds.values() for i, n in enumerate(names)} if len(kinds) <= COLOURS else {}
    return {n: replace(model_look(places.get(n, i)), colour=colours[n] % COLOURS) for i, n in enumerate(report.models)}


def initially_shown(findings: ReportSummary, among: Collection[str] | None = None) -> list[str]:
    """Return the models that a figure shows initially.

    They are chosen from `among`, by default the models with probe results. If there are many, these are the models
    with the smallest first error. If they belong to a few kinds, these are the best and the worst of each kind.
    """
    models = {n: m for n, m in findings.report.models.items() if (m.probes if among is None else n in among)}
    names = list(models)
    if findings.errors:
        errors = {n: value_of(m, findings.errors[0].name) for n, m in models.items()}
        names.sort(key=lambda n: (errors[n] is None, errors[n] or 0.0))
    if len(names) <= SHOWN:
        return names
    kinds: dict[str, list[str]] = {}
    for name in names:
        kind = models[name].kind
        kinds.setdefault(f"kind {kind.words}" if kind else f"model {name}", []).append(name)
    ends = [n for own in kinds.values() for n in dict.fromkeys((own[0], own[-1]))]
    return ends if len(ends) <= SHOWN else names[:SHOWN]


def arc(X: Floats) -> Floats:
    """Return the arc length (n,), m, along undeformed points X (n, 3), m."""
    steps = np.sqrt((np.diff(X, axis=0) ** 2).sum(axis=1))
    return np.concatenate(([0.0], np.cumsum(steps)))
