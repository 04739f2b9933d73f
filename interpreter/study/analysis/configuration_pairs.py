"""Pairs of configurations: distance of their displacements, and effect of a single change on time and error."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import ClassVar

from softmark.interpreter.results.json_records import JsonRecord
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, ratio_of, uncertainty_of
from softmark.interpreter.study.analysis.refinement_lines import resolution_names
from softmark.interpreter.study.configurations.task_outcome import ProbeTrace, SolvedReference
from softmark.records import dataclass

Probes = Mapping[str, ProbeTrace]

# ------------------------------------------------------------------ distances


@dataclass(frozen=True)
class NoDistance(JsonRecord):
    """Reason why a distance in the table of distances is undefined, with its row and column."""

    row: str
    column: str
    reason: str


@dataclass(frozen=True)
class Distances(JsonRecord):
    """Relative distances |u_row - u_column| / |u_column| between displacements at common probes.

    Rows and columns are the references and the finest configuration of each model. An entry of `matrix` is None if
    there is no common point, or if the column has zero displacement; `reasons` then has the reason.
    """

    names: list[str]
    kinds: list[str]  # reference or model
    labels: list[str]
    matrix: list[list[float | None]]
    reasons: list[NoDistance]


def finest_configurations(points: Sequence[ComparedPoint]) -> list[ComparedPoint]:
    """Return for every model its solved configuration with the most unknowns.

    Converged configurations are preferred to those that were stopped at `max_iterations`.
    """
    best: dict[str, ComparedPoint] = {}
    for point in points:
        if point.solved and (
            point.model not in best or _fineness_sort_key(point) > _fineness_sort_key(best[point.model])
        ):
            best[point.model] = point
    return list(best.values())


def _fineness_sort_key(point: ComparedPoint) -> tuple[bool, int]:
    return point.status == "converged", point.dofs or 0


def compute_distances(points: Sequence[ComparedPoint], references: Mapping[str, SolvedReference]) -> Distances:
    """Return the distances between the displacements of all models and references."""
    chosen = finest_configurations(points)
    known = {n: r for n, r in references.items() if r.probes}
    names = [*known, *(p.model for p in chosen)]
    owners: list[tuple[ComparedPoint | None, Probes]] = [(None, r.probes) for r in known.values()]
    owners += [(p, p.probes) for p in chosen]
    fine = resolution_names(points)
    found = [[_reason_incomparable(p, q, fine) or _distance_or_reason(a, b) for q, b in owners] for p, a in owners]
    reasons = [
        NoDistance(names[i], names[j], d)
        for i, row in enumerate(found) for j, d in enumerate(row) if isinstance(d, str)
    ]  # fmt: skip
    return Distances(
        names, ["reference"] * len(known) + ["model"] * len(chosen), [*known, *(p.label for p in chosen)],
        [[None if isinstance(d, str) else d for d in row] for row in found], reasons,
    )  # fmt: skip


def _reason_incomparable(a: ComparedPoint | None, b: ComparedPoint | None, fine: Collection[str]) -> str | None:
    """Return the reason why two configurations cannot be compared, or None if they can.

    They cannot be compared if they differ in a varied value other than the resolution.
    """
    x, y = (p.variation if p else {} for p in (a, b))
    names = [n for n in x if n in y and x[n] != y[n] and n not in fine]
    return f"they were computed at different {' and '.join(names)}" if names else None


def _distance_or_reason(a: Probes, b: Probes) -> float | str:
    """Return the relative distance of displacements a from displacements b, or the reason why it is undefined."""
    shared = [(a[name], b[name]) for name in a if name in b and a[name].has_same_points(b[name])]
    if not shared:
        return "they share no points"
    apart = sum(_squared_distance(p, q) for x, y in shared for p, q in _displacement_pairs(x, y))
    moved = sum(_squared_distance(q, (0.0, 0.0, 0.0)) for x, y in shared for _, q in _displacement_pairs(x, y))
    ratio = ratio_of(apart, moved)
    return "the configuration to compare with has zero displacement" if ratio is None else math.sqrt(ratio)


def _displacement_pairs(x: ProbeTrace, y: ProbeTrace) -> Iterator[tuple[Sequence[float], Sequence[float]]]:
    return zip(x.displacement, y.displacement, strict=True)


def _squared_distance(p: Sequence[float], q: Sequence[float]) -> float:
    return sum((x - y) ** 2 for x, y in zip(p, q, strict=True))


# ------------------------------------------------------------------ effects of single changes


@dataclass(frozen=True)
class ErrorChange(JsonRecord):
    """Effect of a change on an error metric: the ratio of the new to the old error.

    `within_uncertainty` is true if the difference is below the uncertainty of the reference.
    """

    ratio: float | None
    within_uncertainty: bool


@dataclass(frozen=True)
class ChangeEffect(JsonRecord):
    """Effect of changing one varied name on effort and errors; each ratio is the new value divided by the old one."""

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


def find_change_effects(points: Sequence[ComparedPoint], metrics: Sequence[str], clock: str) -> list[ChangeEffect]:
    """Return the effects of changing one varied name while all others stay the same.

    A numeric value is compared with the next larger value, another value with the first one.
    """
    floors = {metric: uncertainty_of(points, metric) for metric in metrics}
    return [_change_effect(name, a, b, clock, floors) for name, a, b in _single_changes(points)]


def _single_changes(points: Sequence[ComparedPoint]) -> Iterator[tuple[str, ComparedPoint, ComparedPoint]]:
    solved = [p for p in points if p.solved]
    for name in dict.fromkeys(name for p in solved for name in p.variation):
        groups: dict[tuple[str, tuple[tuple[str, str], ...]], dict[str, ComparedPoint]] = {}
        for p in (p for p in solved if name in p.variation):
            groups.setdefault((p.model, tuple(sorted(p.other_values(name)))), {}).setdefault(p.variation[name], p)
        for own in groups.values():
            yield from ((name, a, b) for a, b in _pairs_to_compare(name, list(own.values())))


def _pairs_to_compare(name: str, own: list[ComparedPoint]) -> Iterator[tuple[ComparedPoint, ComparedPoint]]:
    """Yield the pairs of configurations to compare, ordered by the value of `name`.

    For numbers these are neighbours from large to small, otherwise the first configuration with each of the others.
    """
    if all(name in p.numbers for p in own):
        return pairwise(sorted(own, key=lambda p: -float(p.numbers[name])))
    return ((own[0], p) for p in own[1:])


def _change_effect(
    name: str, a: ComparedPoint, b: ComparedPoint, clock: str, floors: Mapping[str, float]
) -> ChangeEffect:
    before, after = a.effort(clock), b.effort(clock)
    return ChangeEffect(
        name, a.model, a.variation[name], b.variation[name], dict(a.other_values(name)), [a.key, b.key],
        ratio_of(after.median, before.median) if before and after else None,
        before is not None and after is not None and clock != UNKNOWNS and not before.is_distinct_from(after),
        {metric: _error_change(a.error(metric), b.error(metric), floor) for metric, floor in floors.items()},
    )  # fmt: skip


def _error_change(old: float | None, new: float | None, floor: float) -> ErrorChange:
    within = old is not None and new is not None and abs(new - old) <= floor and floor > 0
    return ErrorChange(ratio_of(new, old), within)
