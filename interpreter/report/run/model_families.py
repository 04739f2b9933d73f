"""Families of models that differ only by mesh size, or only by Poisson's ratio."""

from __future__ import annotations

from collections.abc import Mapping

from softmark.interpreter.report.run.report_summary import ReportSummary


def families_by_size(findings: ReportSummary) -> dict[str, dict[str, float]]:
    """Return family -> models with their numbers of unknowns, ascending; at least two different sizes."""
    found: dict[str, dict[str, float]] = {}
    for name, model in findings.report.models.items():
        kind = model.kind
        if kind is None or not model.size.get("dofs"):
            continue
        nu = "" if kind.nu is None else f", nu = {kind.nu:g}"
        found.setdefault(kind.words + nu, {})[name] = float(model.size["dofs"])
    return _lines(found)


def families_by_poisson(findings: ReportSummary) -> dict[str, dict[str, float]]:
    """Return family -> models with their Poisson's ratios, ascending; at least two different ones."""
    usual, found = scene_poisson(findings), dict[str, dict[str, float]]()
    for name, model in findings.report.models.items():
        kind = model.kind
        nu = None if kind is None else usual if kind.nu is None else kind.nu
        if kind is not None and nu is not None and -1.0 < nu < 0.5:
            found.setdefault(f"{kind.words}, {kind.size}", {})[name] = nu
    return _lines(found)


def _lines(found: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Return families with at least two values; the first of models with equal values."""
    kept: dict[str, dict[str, float]] = {}
    for family, members in found.items():
        first = {value: name for name, value in reversed(list(members.items()))}
        if len(first) > 1:
            kept[family] = {name: value for value, name in sorted(first.items())}
    return kept


def scene_poisson(findings: ReportSummary) -> float | None:
    """Return Poisson's ratio of the bodies' material, None if it is not unique."""
    values = {d.poisson for d in findings.declared.values() if d.kind == "body" and d.poisson is not None}
    return values.pop() if len(values) == 1 else None
