"""What figures share about probes: which are lines, along what they are drawn, how their curves look."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.report.findings import Findings, value_of
from softmark.interpreter.report.looks import Look, model_look, reference_look
from softmark.interpreter.report.plate import SHOWN
from softmark.interpreter.results import ProbeResult, Report

Floats = NDArray[np.float64]
AXES = ("x", "y", "z")


def lines_of(findings: Findings) -> dict[str, dict[str, ProbeResult]]:
    """Line probes, those with at least two points: who has them, and what was seen."""
    return {n: seen for n, seen in findings.probes.items() if any(len(p.points) > 1 for p in seen.values())}


def points_of(findings: Findings) -> dict[str, dict[str, ProbeResult]]:
    """Point probes."""
    lines = lines_of(findings)
    single = {n: seen for n, seen in findings.probes.items() if n not in lines}
    return {
        n: found for n, seen in single.items() if (found := {k: p for k, p in seen.items() if len(p.points)})
    }


def looks(report: Report) -> dict[str, Look]:
    """One look for each model and reference, the same in every figure of the page."""
    found = {name: model_look(i) for i, name in enumerate(report.models)}
    return found | {name: reference_look(i) for i, name in enumerate(report.references)}


def drawn_first(findings: Findings) -> list[str]:
    """The models that are drawn at first: where there are many, those with the least first error."""
    models = {n: m for n, m in findings.report.models.items() if m.probes}
    names = list(models)
    if findings.errors:
        errors = {n: value_of(m, findings.errors[0].name) for n, m in models.items()}
        names.sort(key=lambda n: (errors[n] is None, errors[n] or 0.0))
    return names[:SHOWN]


def arc(X: Floats) -> Floats:
    """Arc position (n,) along undeformed points (n, 3), m."""
    steps = np.sqrt((np.diff(X, axis=0) ** 2).sum(axis=1))
    return np.concatenate(([0.0], np.cumsum(steps)))
