"""Refinement lines of a comparison: configurations of one model that differ in only one number."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from softmark.interpreter.results.json_records import JsonRecord
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint, format_values
from softmark.records import dataclass


@dataclass(frozen=True)
class RefinementLine(JsonRecord):
    """Refinement line: configurations of one model that differ in only one number, ordered by it."""

    scene: str
    model: str
    study: str | None
    varied: str | None  # None: one configuration
    fixed: tuple[tuple[str, str], ...]  # other varied values, which are the same for all members
    members: tuple[ComparedPoint, ...]
    name: str = ""  # unique label, with the study's name or a number if necessary

    @cached_property
    def keys(self) -> list[str]:
        """Keys that identify the configurations of the line, in its order."""
        return [p.key for p in self.members]

    @property
    def label(self) -> str:
        """Label of the line, such as `corot_tet, nu = 0.49`; a single configuration keeps its own label."""
        if self.varied is None:
            return self.members[0].label
        return ", ".join([self.model, *format_values(self.model, dict(self.fixed))])

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries, with the keys of the configurations."""
        return {
            "label": self.name, "model": self.model, "study": self.study, "varied": self.varied,
            "fixed": dict(self.fixed), "keys": self.keys,
        }  # fmt: skip


def lines_of(points: Sequence[ComparedPoint]) -> list[RefinementLine]:
    """Return the refinement lines of one scene, ordered by model.

    The configurations of a line belong to one study of a model, and all their other varied values are equal.
    """
    groups: dict[tuple[str, str, str | None], list[ComparedPoint]] = {}
    for point in points:
        groups.setdefault((point.scene, point.model, point.study), []).append(point)
    lines = [line for who, members in groups.items() for line in _lines_of_model(who, members)]
    models = list(dict.fromkeys(line.model for line in lines))
    return _with_unique_names(sorted(lines, key=lambda line: models.index(line.model)))


def _lines_of_model(who: tuple[str, str, str | None], members: Sequence[ComparedPoint]) -> list[RefinementLine]:
    varied = refinement_name(members)
    if varied is None:
        return [RefinementLine(*who, None, p.other_values(None), (p,)) for p in members]
    groups: dict[tuple[tuple[str, str], ...], list[ComparedPoint]] = {}
    for point in members:
        groups.setdefault(point.other_values(varied), []).append(point)
    common = set.intersection(*(set(rest) for rest in groups))
    found = []
    for rest, own in groups.items():
        ordered = sorted(own, key=lambda p: -float(p.numbers.get(varied, 0.0)))
        fixed = tuple(item for item in rest if item not in common)
        found.append(
            RefinementLine(*who, varied if len(own) > 1 else None, fixed, tuple(_sort_coarse_to_fine(ordered)))
        )
    return found


def refinement_name(members: Sequence[ComparedPoint]) -> str | None:
    """Return the varied name by which configurations are ordered in refinement lines; None if no number varies.

    It is the first name that controls a size, segments or a step, otherwise the first that changes the number of
    unknowns, otherwise the first varied number.
    """
    numbers: dict[str, set[float]] = {}
    for point in members:
        for name, value in point.numbers.items():
            numbers.setdefault(name, set()).add(float(value))
    names = [name for name, values in numbers.items() if len(values) > 1]
    for what in (_resolution, _dof_count):
        found = next((name for name in names if _is_changed_by(members, name, what)), None)
        if found is not None:
            return found
    return names[0] if names else None


def resolution_names(points: Sequence[ComparedPoint]) -> set[str]:
    """Return the varied names that control the resolution of a model and do not change the problem it solves."""
    names = dict.fromkeys(n for p in points for n in p.variation)
    what = _resolution if any(_resolution(p) for p in points) else _dof_count
    families = [[p for p in points if p.model == m] for m in dict.fromkeys(p.model for p in points)]
    return {n for n in names if any(_is_changed_by(own, n, what) for own in families)}


def _resolution(point: ComparedPoint) -> Hashable:
    """Return the resolution of a configuration, or None if it is not known."""
    return tuple(sorted(point.fineness.of.items())) if point.fineness else None


def _dof_count(point: ComparedPoint) -> Hashable:
    return point.dofs


def _is_changed_by(members: Sequence[ComparedPoint], name: str, what: Callable[[ComparedPoint], Hashable]) -> bool:
    """Return whether the swept quantity `name` alone changes the result of the function `what`.

    It does if `what` has different results for two configurations that agree in all other swept quantities.
    """
    seen: dict[tuple[tuple[str, str], ...], set[Hashable]] = {}
    for point in members:
        if value := what(point):
            seen.setdefault(point.other_values(name), set()).add(value)
    return any(len(values) > 1 for values in seen.values())


def _sort_coarse_to_fine(ordered: list[ComparedPoint]) -> list[ComparedPoint]:
    """Return the configurations from coarse to fine: in reverse order if the number of unknowns decreases."""
    sizes = [p.dofs for p in ordered if p.dofs]
    return ordered[::-1] if len(sizes) > 1 and sizes[0] > sizes[-1] else ordered


def _with_unique_names(lines: Sequence[RefinementLine]) -> list[RefinementLine]:
    """Return the lines with unique names, to which the name of the study or a number is added where needed."""
    plain = [line.label for line in lines]
    several = [f"{p} ({line.study})" if line.study and plain.count(p) > 1 else p
               for p, line in zip(plain, lines, strict=True)]  # fmt: skip
    names = [f"{s}, {several[: i + 1].count(s)}" if several.count(s) > 1 else s for i, s in enumerate(several)]
    return [replace(line, name=name) for line, name in zip(lines, names, strict=True)]
