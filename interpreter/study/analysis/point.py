"""What a point of a comparison says: its effort with its spread, its errors, and the line of a study that it is on.

A point is the plain dictionary of `softmark-compare/1`. Nothing here computes an error or a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

from softmark.records import dataclass

Point = Mapping[str, Any]
SOLVED = ("converged", "capped")
CLOCKS = ("cpu_s", "wall_s")
UNKNOWNS = "unknowns"  # the effort where nothing was timed


@dataclass(frozen=True)
class Spread:
    """A median with its quartiles; all three the same where a thing was measured once or is exact."""

    median: float
    q1: float
    q3: float

    def apart(self, other: Spread) -> bool:
        """Whether the quartile intervals do not meet: the difference is more than noise."""
        return self.q3 < other.q1 or other.q3 < self.q1

    def to_json(self) -> dict[str, float]:
        """By name."""
        return {"median": self.median, "q1": self.q1, "q3": self.q3}


def spread_of(known: Mapping[str, Any] | None) -> Spread | None:
    """A spread from median, q1 and q3; from least and largest where there are no quartiles, as in a report.

    Time steps come with what 95 % of them stay below instead.
    """
    if not known or known.get("median") is None:
        return None
    median = float(known["median"])
    low, high = known.get("q1", known.get("min")), known.get("q3", known.get("p95", known.get("max")))
    return Spread(median, median if low is None else float(low), median if high is None else float(high))


def clock_of(points: Iterable[Point], asked: str | None = None) -> str:
    """The effort that points are compared by: what was asked for, else CPU time; unknowns where nothing was timed."""
    timed = [p["cost"] for p in points if p.get("cost")]
    if asked is not None:
        return asked
    return next((clock for clock in CLOCKS if any(spread_of(cost.get(clock)) for cost in timed)), UNKNOWNS)


def reduced_of(point: Point) -> Mapping[str, Any]:
    """What a reduced model says of itself; empty for others."""
    return (point.get("solve") or {}).get("reduced") or {}


def effort_of(point: Point, clock: str) -> Spread | None:
    """Seconds, or the number of unknowns; None where it is not known."""
    if clock == UNKNOWNS:
        if reduced_of(point):  # a handful of unknowns whose equations may cost as much as those of the full mesh
            return None
        unknowns = (point.get("size") or {}).get("dofs")
        return Spread(float(unknowns), float(unknowns), float(unknowns)) if unknowns else None
    found = spread_of((point.get("cost") or {}).get(clock))
    return found if found is not None and found.median > 0 else None


def frame_of(point: Point) -> Spread | None:
    """Seconds of what must fit a frame: `frame_s`, with the spread of the clock that it was taken from."""
    cost = point.get("cost") or {}
    frame = cost.get("frame_s")
    if not frame:
        return None
    known = [s for name in ("step_s", "step_cpu_s", "wall_s", "cpu_s") if (s := spread_of(cost.get(name))) is not None]
    own = next((s for s in known if abs(s.median - frame) <= 1e-6 * frame), None)
    if own is None and known and known[0].median > 0:  # the spread of its likest clock, in proportion
        k = frame / known[0].median
        own = Spread(float(frame), k * known[0].q1, k * known[0].q3)
    return own or Spread(float(frame), float(frame), float(frame))


def contaminated(point: Point) -> bool:
    """Whether something else ran while this was timed."""
    return bool((point.get("cost") or {}).get("contaminated"))


def label_of(point: Point) -> str:
    """What a point is called."""
    return str(point.get("label") or point.get("model") or point.get("key"))


def part_of(point: Point) -> str:
    """What a point competes in: its scene, at one value of everything that changes what errors are measured from."""
    values = (point.get("problem") or {}).items()
    return ", ".join((str(point["scene"]), *(f"{name} = {text}" for name, text in values)))


def said_values(point: Point, values: Mapping[str, str]) -> list[str]:
    """`h = 5 mm` for each value; a field of the point's own model without the name of the model."""
    own = f"{point['model']}."
    return [f"{name.removeprefix(own)} = {text}" for name, text in values.items()]


def ratio_of(a: float | None, b: float | None) -> float | None:
    """a / b; None where there is none, as for a b of zero or next to it."""
    if a is None or not b:
        return None
    found = a / b
    return found if math.isfinite(found) else None


# ------------------------------------------------------------------ errors


def error_metrics(points: Iterable[Point]) -> list[str]:
    """Metrics that measure from something, in the order in which they come."""
    names: dict[str, None] = {}
    for point in points:
        for name, found in (point.get("errors") or {}).items():
            if found.get("against") is not None:
                names[name] = None
    return list(names)


def measured(point: Point, metric: str) -> float | None:
    """The size of an error; None where there is none."""
    value = ((point.get("errors") or {}).get(metric) or {}).get("value")
    return None if value is None else abs(float(value))


def uncertainty_of(points: Iterable[Point], metric: str) -> float:
    """What the reference leaves open, in the metric's unit: the largest that a point states; 0 if none does."""
    found = ((p.get("errors") or {}).get(metric) or {} for p in points)
    return max((abs(float(u)) for e in found if (u := e.get("uncertainty")) is not None), default=0.0)


def stated(points: Iterable[Point], metric: str, what: str) -> Any:
    """What the first point that has this metric says of it: `unit`, `against`."""
    found = ((p.get("errors") or {}).get(metric) or {} for p in points)
    return next((e[what] for e in found if e.get(what) is not None), None)


# ------------------------------------------------------------------ lines


@dataclass(frozen=True)
class Line:
    """A model over its refinement: configurations that differ in one number alone, in the order of that number."""

    scene: str
    model: str
    study: str | None
    varied: str | None  # None: one configuration
    fixed: tuple[tuple[str, str], ...]  # what else was varied, the same for all members
    members: tuple[Point, ...]

    @cached_property
    def keys(self) -> list[str]:
        """Keys of its members."""
        return [str(p["key"]) for p in self.members]

    @property
    def label(self) -> str:
        """`corot_tet, nu = 0.49`; of one configuration, its own label."""
        if self.varied is None:
            return label_of(self.members[0])
        return ", ".join([self.model, *said_values(self.members[0], dict(self.fixed))])

    def number(self, point: Point) -> float:
        """The value of what is varied."""
        return float((point.get("numbers") or {}).get(self.varied, 0.0))


def lines_of(points: Sequence[Point]) -> list[Line]:
    """The lines of one scene: each study of a model by the number that it refines by, all else being the same."""
    groups: dict[tuple[str, str, str | None], list[Point]] = {}
    for point in points:
        study = point.get("study")
        groups.setdefault((str(point.get("scene")), str(point["model"]), study), []).append(point)
    return _named_apart([line for who, members in groups.items() for line in _lines(who, members)])


def _lines(who: tuple[str, str, str | None], members: Sequence[Point]) -> list[Line]:
    varied = refinement(members)
    if varied is None:
        return [Line(*who, None, _rest(p, None), (p,)) for p in members]
    groups: dict[tuple[tuple[str, str], ...], list[Point]] = {}
    for point in members:
        groups.setdefault(_rest(point, varied), []).append(point)
    common = set.intersection(*(set(rest) for rest in groups))
    found = []
    for rest, own in groups.items():
        ordered = sorted(own, key=lambda p: -float((p.get("numbers") or {}).get(varied, 0.0)))
        fixed = tuple(item for item in rest if item not in common)
        found.append(Line(*who, varied if len(own) > 1 else None, fixed, tuple(_from_coarse(ordered))))
    return found


def refinement(members: Sequence[Point]) -> str | None:
    """The number that makes lines: the first that decides a size, segments or a step.

    Else the first that changes the number of unknowns, else the first.
    """
    numbers: dict[str, set[float]] = {}
    for point in members:
        for name, value in (point.get("numbers") or {}).items():
            numbers.setdefault(name, set()).add(float(value))
    names = [name for name, values in numbers.items() if len(values) > 1]
    for what in (_resolution, _unknowns):
        found = next((name for name in names if _changes(members, name, what)), None)
        if found is not None:
            return found
    return names[0] if names else None


def finenesses(points: Sequence[Point]) -> set[str]:
    """Names that decide how finely some model is solved, and not what is solved."""
    names = dict.fromkeys(n for p in points for n in p.get("variation") or {})
    what = _resolution if any(_resolution(p) for p in points) else _unknowns
    models = dict.fromkeys(str(p["model"]) for p in points)
    families = [[p for p in points if p["model"] == m] for m in models]
    return {n for n in names if any(_changes(own, n, what) for own in families)}


def _resolution(point: Point) -> Any:
    """How finely it is solved, if that is known."""
    known = point.get("resolution")
    return tuple(sorted(known["of"].items())) if known else None


def _unknowns(point: Point) -> Any:
    return (point.get("size") or {}).get("dofs")


def _changes(members: Sequence[Point], name: str, what: Callable[[Point], Any]) -> bool:
    """Whether two configurations that differ in this number alone differ in this as well."""
    seen: dict[tuple[tuple[str, str], ...], set[Any]] = {}
    for point in members:
        if value := what(point):
            seen.setdefault(_rest(point, name), set()).add(value)
    return any(len(values) > 1 for values in seen.values())


def _rest(point: Point, varied: str | None) -> tuple[tuple[str, str], ...]:
    """What is varied besides."""
    variation = point.get("variation") or {}
    return tuple((str(k), str(v)) for k, v in variation.items() if k != varied)


def _from_coarse(ordered: list[Point]) -> list[Point]:
    """From coarse to fine: a number of segments grows where a cell size falls."""
    sizes = [n for p in ordered if (n := (p.get("size") or {}).get("dofs"))]
    return ordered[::-1] if len(sizes) > 1 and sizes[0] > sizes[-1] else ordered


def _named_apart(lines: list[Line]) -> list[Line]:
    """Lines in the order of their models; those of one model follow each other."""
    order = {model: i for i, model in enumerate(dict.fromkeys(line.model for line in lines))}
    return sorted(lines, key=lambda line: order[line.model])


def line_labels(lines: Sequence[Line]) -> list[str]:
    """A label for each line; where two would be the same, with the study's name or a number."""
    plain = [line.label for line in lines]
    several = [f"{p} ({line.study})" if line.study and plain.count(p) > 1 else p
               for p, line in zip(plain, lines, strict=True)]  # fmt: skip
    return [f"{s}, {several[: i + 1].count(s)}" if several.count(s) > 1 else s for i, s in enumerate(several)]
