"""Configurations two by two: how far apart their shapes are, and what one changed thing does to time and error."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from softmark.interpreter.study.analysis.point import (
    SOLVED,
    Point,
    effort_of,
    finenesses,
    label_of,
    measured,
    ratio_of,
    uncertainty_of,
)

Probes = Mapping[str, Mapping[str, Any]]
SAME = 1e-9  # of the extent of a probe: points nearer than this are the same

# ------------------------------------------------------------------ distances


def finest(points: Sequence[Point]) -> list[Point]:
    """The solved configuration of every model with the most unknowns; a converged one before a capped one."""
    best: dict[str, Point] = {}
    for point in points:
        model = str(point["model"])
        if point.get("status") in SOLVED and (model not in best or _rank(point) > _rank(best[model])):
            best[model] = point
    return list(best.values())


def _rank(point: Point) -> tuple[bool, int]:
    return point.get("status") == "converged", int((point.get("size") or {}).get("dofs") or 0)


def distances(points: Sequence[Point], references: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """|u_row - u_column| / |u_column| over the probes that both have, for references and the finest of each model.

    `matrix` has None where the two share no point or the one of the column does not move; `reasons` say which.
    """
    chosen = finest(points)
    known = {n: r for n, r in references.items() if r.get("probes")}
    names = [*known, *(str(p["model"]) for p in chosen)]
    probes = [*(r["probes"] for r in known.values()), *(p.get("probes") or {} for p in chosen)]
    owners = [*([None] * len(known)), *chosen]
    fine = finenesses(points)
    found = [
        [_apart(x, y, fine) or _distance(a, b) for y, b in zip(owners, probes, strict=True)]
        for x, a in zip(owners, probes, strict=True)
    ]
    reasons = [
        {"row": names[i], "column": names[j], "reason": d}
        for i, row in enumerate(found) for j, d in enumerate(row) if isinstance(d, str)
    ]  # fmt: skip
    return {
        "names": names,
        "kinds": ["reference"] * len(known) + ["model"] * len(chosen),
        "labels": [*known, *(label_of(p) for p in chosen)],
        "matrix": [[None if isinstance(d, str) else d for d in row] for row in found],
        "reasons": reasons,
    }


def _apart(a: Point | None, b: Point | None, fine: Collection[str]) -> str | None:
    """That two configurations have different values of something that is no fineness: then they differ by that."""
    x, y = ((p or {}).get("variation") or {} for p in (a, b))
    names = [n for n in x if n in y and x[n] != y[n] and n not in fine]
    return f"they were computed at different {' and '.join(names)}" if names else None


def _distance(a: Probes, b: Probes) -> float | str:
    """The distance of a from b, or why there is none."""
    shared = [(a[name], b[name]) for name in a if name in b and _same(a[name], b[name])]
    if not shared:
        return "they share no points"
    apart = sum(_square(p, q) for x, y in shared for p, q in _moved(x, y))
    moved = sum(_square(q, (0.0, 0.0, 0.0)) for x, y in shared for _, q in _moved(x, y))
    ratio = ratio_of(apart, moved)
    return "the one that is compared with does not move" if ratio is None else math.sqrt(ratio)


def _moved(x: Mapping[str, Any], y: Mapping[str, Any]) -> Iterator[tuple[Sequence[float], Sequence[float]]]:
    return zip(x["displacement"], y["displacement"], strict=True)


def _same(x: Mapping[str, Any], y: Mapping[str, Any]) -> bool:
    """Whether two probes have the same points, and a displacement for each."""
    p, q = x.get("points") or [], y.get("points") or []
    counts = {len(p), len(q), len(x.get("displacement") or []), len(y.get("displacement") or [])}
    if len(counts) != 1 or not p:
        return False
    extent = max(abs(c) for point in p for c in point) or 1.0
    return all(math.dist(a, b) <= SAME * extent for a, b in zip(p, q, strict=True))


def _square(p: Sequence[float], q: Sequence[float]) -> float:
    return sum((x - y) ** 2 for x, y in zip(p, q, strict=True))


# ------------------------------------------------------------------ levers


def levers(points: Sequence[Point], metrics: Sequence[str], clock: str) -> list[dict[str, Any]]:
    """Pairs of solved points that differ in exactly one varied thing: neighbours where it is a number, else all others
    against the first; with the ratios of effort and of each error."""
    return [_effect(name, a, b, metrics, clock, points) for name, a, b in _single_changes(points)]


def _single_changes(points: Sequence[Point]) -> Iterator[tuple[str, Point, Point]]:
    solved = [p for p in points if p.get("status") in SOLVED]
    names = dict.fromkeys(name for p in solved for name in (p.get("variation") or {}))
    for name in names:
        groups: dict[tuple[Any, ...], dict[str, Point]] = {}
        for p in solved:
            variation = dict(p.get("variation") or {})
            if name in variation:
                value = str(variation.pop(name))
                rest = tuple(sorted((k, str(v)) for k, v in variation.items()))
                groups.setdefault((str(p["model"]), rest), {}).setdefault(value, p)
        for own in groups.values():
            yield from ((name, a, b) for a, b in _steps(name, list(own.values())))


def _steps(name: str, own: list[Point]) -> Iterator[tuple[Point, Point]]:
    """Neighbours by number; against the first where some are no numbers."""
    if all(name in (p.get("numbers") or {}) for p in own):
        return pairwise(sorted(own, key=lambda p: -float(p["numbers"][name])))
    return ((own[0], p) for p in own[1:])


def _effect(
    name: str, a: Point, b: Point, metrics: Sequence[str], clock: str, points: Sequence[Point]
) -> dict[str, Any]:
    before, after = effort_of(a, clock), effort_of(b, clock)
    errors = {}
    for metric in metrics:
        x, y = measured(a, metric), measured(b, metric)
        floor = uncertainty_of(points, metric)
        errors[metric] = {
            "ratio": ratio_of(y, x),
            "within_uncertainty": x is not None and y is not None and abs(y - x) <= floor and floor > 0,
        }
    return {
        "what": name, "model": str(a["model"]),
        "from": str(a["variation"][name]), "to": str(b["variation"][name]),
        "others": {k: str(v) for k, v in a["variation"].items() if k != name},
        "keys": [str(a["key"]), str(b["key"])],
        "effort_ratio": ratio_of(after.median, before.median) if before and after else None,
        "noise": before is not None and after is not None and clock != "unknowns" and not before.apart(after),
        "errors": errors,
    }  # fmt: skip
