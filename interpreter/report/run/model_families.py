"""Families of models: those that differ by the size of their mesh alone, or by Poisson's ratio alone."""

from __future__ import annotations

from collections.abc import Mapping

from softmark.interpreter.report.run.report_summary import Findings


def by_size(findings: Findings) -> dict[str, dict[str, float]]:
    """Family -> its models with their numbers of unknowns, in ascending order; at least two of different size."""
    found: dict[str, dict[str, float]] = {}
    for name, model in findings.report.models.items():
        kind = model.kind
        if kind is None or not model.size.get("dofs"):
            continue
        nu = "" if kind.nu is None else f", nu = {kind.nu:g}"
        found.setdefault(kind.words + nu, {})[name] = float(model.size["dofs"])
    return _lines(found)


def by_poisson(findings: Findings) -> dict[str, dict[str, float]]:
    """Family -> its models with their Poisson's ratios, in ascending order; at least two that differ."""
    usual, found = scene_poisson(findings), dict[str, dict[str, float]]()
    for name, model in findings.report.models.items():
        kind = model.kind
        nu = None if kind is None else usual if kind.nu is None else kind.nu
        if kind is not None and nu is not None and -1.0 < nu < 0.5:
            found.setdefault(f"{kind.words}, {kind.size}", {})[name] = nu
    return _lines(found)


def _lines(found: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Families with at least two values; of models with the same value, the first."""
    kept: dict[str, dict[str, float]] = {}
    for family, members in found.items():
        first = {value: name for name, value in reversed(list(members.items()))}
        if len(first) > 1:
            kept[family] = {name: value for value, name in sorted(first.items())}
    return kept


def scene_poisson(findings: Findings) -> float | None:
    """Poisson's ratio of the material that bodies have, where they have one."""
    values = {d.poisson for d in findings.declared.values() if d.kind == "body" and d.poisson is not None}
    return values.pop() if len(values) == 1 else None
