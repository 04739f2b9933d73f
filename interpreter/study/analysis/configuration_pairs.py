"""Configurations two by two: how far apart their shapes are, and what one changed thing does to time and error."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import ClassVar

from softmark.interpreter.results.json_records import Plain
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, ratio_of, uncertainty_of
from softmark.interpreter.study.analysis.refinement_lines import finenesses
from softmark.interpreter.study.configurations.task_outcome import ProbeTrace, SolvedReference
from softmark.records import dataclass

Probes = Mapping[str, ProbeTrace]

# ------------------------------------------------------------------ distances


@dataclass(frozen=True)
class NoDistance(Plain):
    """Why there is no distance of a row from a column."""

    row: str
    column: str
    reason: str


@dataclass(frozen=True)
class Distances(Plain):
    """|u_row - u_column| / |u_column| over the probes that both have, for references and the finest of each model.

    `matrix` has None where the two share no point or the one of the column does not move; `reasons` say which.
    """

    names: list[str]
    kinds: list[str]  # reference or model
    labels: list[str]
    matrix: list[list[float | None]]
    reasons: list[NoDistance]


def finest(points: Sequence[ComparedPoint]) -> list[ComparedPoint]:
    """The solved configuration of every model with the most unknowns; a converged one before a capped one."""
    best: dict[str, ComparedPoint] = {}
    for point in points:
        if point.solved and (point.model not in best or _rank(point) > _rank(best[point.model])):
            best[point.model] = point
    return list(best.values())


def _rank(point: ComparedPoint) -> tuple[bool, int]:
    return point.status == "converged", point.dofs or 0


def distances(points: Sequence[ComparedPoint], references: Mapping[str, SolvedReference]) -> Distances:
    """Of everyone from everyone."""
    chosen = finest(points)
    known = {n: r for n, r in references.items() if r.probes}
    names = [*known, *(p.model for p in chosen)]
    owners: list[tuple[ComparedPoint | None, Probes]] = [(None, r.probes) for r in known.values()]
    owners += [(p, p.probes) for p in chosen]
    fine = finenesses(points)
    found = [[_apart(p, q, fine) or _distance(a, b) for q, b in owners] for p, a in owners]
    reasons = [
        NoDistance(names[i], names[j], d)
        for i, row in enumerate(found) for j, d in enumerate(row) if isinstance(d, str)
    ]  # fmt: skip
    return Distances(
        names, ["reference"] * len(known) + ["model"] * len(chosen), [*known, *(p.label for p in chosen)],
        [[None if isinstance(d, str) else d for d in row] for row in found], reasons,
    )  # fmt: skip


def _apart(a: ComparedPoint | None, b: ComparedPoint | None, fine: Collection[str]) -> str | None:
    """That two configurations have different values of something that is no fineness: then they differ by that."""
    x, y = (p.variation if p else {} for p in (a, b))
    names = [n for n in x if n in y and x[n] != y[n] and n not in fine]
    return f"they were computed at different {' and '.join(names)}" if names else None


def _distance(a: Probes, b: Probes) -> float | str:
    """The distance of a from b, or why there is none."""
    shared = [(a[name], b[name]) for name in a if name in b and a[name].alike(b[name])]
    if not shared:
        return "they share no points"
    apart = sum(_square(p, q) for x, y in shared for p, q in _moved(x, y))
    moved = sum(_square(q, (0.0, 0.0, 0.0)) for x, y in shared for _, q in _moved(x, y))
    ratio = ratio_of(apart, moved)
    return "the one that is compared with does not move" if ratio is None else math.sqrt(ratio)


def _moved(x: ProbeTrace, y: ProbeTrace) -> Iterator[tuple[Sequence[float], Sequence[float]]]:
    return zip(x.displacement, y.displacement, strict=True)


def _square(p: Sequence[float], q: Sequence[float]) -> float:
    return sum((x - y) ** 2 for x, y in zip(p, q, strict=True))


# ------------------------------------------------------------------ levers


@dataclass(frozen=True)
class ErrorChange(Plain):
    """What a change does to an error: the new one over the old one, and whether the reference can tell them apart."""

    ratio: float | None
    within_uncertainty: bool


@dataclass(frozen=True)
class Lever(Plain):
    """What one changed thing does to effort and errors: each ratio is the new value over the old one."""

    NAMED: ClassVar = {"from_": "from"}

    what: str
    model: str
    from_: str
    to: str
    others: Mapping[str, str]  # what else is varied, the same for both
    keys: list[str]
    effort_ratio: float | None
    noise: bool  # the efforts differ by no more than the noise
    errors: Mapping[str, ErrorChange]


def levers(points: Sequence[ComparedPoint], metrics: Sequence[str], clock: str) -> list[Lever]:
    """Pairs of solved points that differ in exactly one varied thing: neighbours where it is a number, else all others
    against the first; with the ratios of effort and of each error."""
    floors = {metric: uncertainty_of(points, metric) for metric in metrics}
    return [_lever(name, a, b, clock, floors) for name, a, b in _single_changes(points)]


def _single_changes(points: Sequence[ComparedPoint]) -> Iterator[tuple[str, ComparedPoint, ComparedPoint]]:
    solved = [p for p in points if p.solved]
    for name in dict.fromkeys(name for p in solved for name in p.variation):
        groups: dict[tuple[str, tuple[tuple[str, str], ...]], dict[str, ComparedPoint]] = {}
        for p in (p for p in solved if name in p.variation):
            groups.setdefault((p.model, tuple(sorted(p.rest(name)))), {}).setdefault(p.variation[name], p)
        for own in groups.values():
            yield from ((name, a, b) for a, b in _steps(name, list(own.values())))


def _steps(name: str, own: list[ComparedPoint]) -> Iterator[tuple[ComparedPoint, ComparedPoint]]:
    """Neighbours by number; against the first where some are no numbers."""
    if all(name in p.numbers for p in own):
        return pairwise(sorted(own, key=lambda p: -float(p.numbers[name])))
    return ((own[0], p) for p in own[1:])


def _lever(name: str, a: ComparedPoint, b: ComparedPoint, clock: str, floors: Mapping[str, float]) -> Lever:
    before, after = a.effort(clock), b.effort(clock)
    return Lever(
        name, a.model, a.variation[name], b.variation[name], dict(a.rest(name)), [a.key, b.key],
        ratio_of(after.median, before.median) if before and after else None,
        before is not None and after is not None and clock != UNKNOWNS and not before.apart(after),
        {metric: _change(a.error(metric), b.error(metric), floor) for metric, floor in floors.items()},
    )  # fmt: skip


def _change(old: float | None, new: float | None, floor: float) -> ErrorChange:
    within = old is not None and new is not None and abs(new - old) <= floor and floor > 0
    return ErrorChange(ratio_of(new, old), within)
