"""Families of models that differ only in mesh size, or only in Poisson's ratio."""

from __future__ import annotations

from collections.abc import Mapping

from softmark.interpreter.report.run.report_summary import ReportSummary


def families_by_size(findings: ReportSummary) -> dict[str, dict[str, float]]:
    """Return the number of unknowns of each model in each family, ascending, for families with at least two sizes."""
    found: dict[str, dict[str, float]] = {}
    for name, model in findings.report.models.items():
        kind = model.kind
        if kind is None or not model.size.get("dofs"):
            continue
        nu = "" if kind.nu is None else f", nu = {kind.nu:g}"
        found.setdefault(kind.words + nu, {})[name] = float(model.size["dofs"])
    return _families_with_varied_values(found)


def families_by_poisson(findings: ReportSummary) -> dict[str, dict[str, float]]:
    """Return Poisson's ratio of each model in each family, ascending, for families with at least two ratios."""
    usual, found = scene_poisson(findings), dict[str, dict[str, float]]()
    for name, model in findings.report.models.items():
        kind = model.kind
        nu = None if kind is None else usual if kind.nu is None else kind.nu
        if kind is not None and nu is not None and -1.0 < nu < 0.5:
            found.setdefault(f"{kind.words}, {kind.size}", {})[name] = nu
    return _families_with_varied_values(found)


def _families_with_varied_values(found: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Return the families with at least two different values, sorted; of models with equal values only the first."""
    kept: dict[str, dict[str, float]] = {}
    for family, members in found.items():
        first = {value: name for name, value in reversed(list(members.items()))}
        if len(first) > 1:
            kept[family] = {name: value for value, name in sorted(first.items())}
    return kept


def scene_poisson(findings: ReportSummary) -> float | None:
    """Return Poisson's ratio of the material of all bodies; None if bodies differ."""
    values = {d.poisson for d in findings.declared.values() if d.kind == "body" and d.poisson is not None}
    return values.pop() if len(values) == 1 else None
