"""A case: one body with all that acts on it, as every model and reference of that body sees it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.conditions import Condition, Point
from softmark.interpreter.language.scene import Declared, Location, Scene
from softmark.interpreter.vocabulary.analyses import Dynamic, Static
from softmark.interpreter.vocabulary.loads import PerMass
from softmark.records import dataclass


class Fault(Exception):
    """Something in the scene cannot be represented or built; carries its diagnostic."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def fault(code: str, at: Location, message: str, label: str = "", help: str = "") -> Fault:
    """A Fault at a place of the scene."""
    return Fault(Diagnostic(code, message, at.source, at.span, label, help))


@dataclass(frozen=True)
class Case:
    """A body, what it is made of, what holds it and what loads it."""

    body: Declared
    supports: tuple[Declared, ...]
    loads: tuple[Declared, ...]
    analysis: Static | Dynamic
    other_material: Any = None  # that a model takes instead of the body's
    wide: bool = False  # supports hold whatever cells and facets they select a part of, on meshes that do not end there

    @property
    def shape(self) -> Any:
        """The body's geometry."""
        return self.body.thing.shape

    @property
    def material(self) -> Any:
        """What the body is made of."""
        return self.other_material or self.body.thing.material

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Sum of all accelerations of gravity, m/s^2."""
        pulls = [d.thing.action for d in self.loads if isinstance(d.thing.action, PerMass)]
        x, y, z = (sum(p.acceleration[i] for p in pulls) for i in range(3))
        return x, y, z


def case_of(scene: Scene, body: str) -> Case:
    """The case of a body."""
    analyses = list(scene.of_kind("analysis").values())
    return Case(
        body=scene.declared[body],
        supports=scene.acting("support", body),
        loads=scene.acting("load", body),
        analysis=analyses[0].thing if analyses else Static(),
    )


def case_for(scene: Scene, worker: Declared) -> Case:
    """The case of a model or reference, with the material that it takes instead of the body's. Raises Fault."""
    other = getattr(worker.thing, "material", None)
    case = case_of(scene, body_of(scene, worker))
    return case if other is None else replace(case, other_material=other)


def body_of(scene: Scene, declared: Declared) -> str:
    """The body that a model, reference or probe is about: the one it names, or the only one. Raises Fault."""
    named: str | None = getattr(declared.thing, "body", None)
    if named is not None:
        return named
    bodies = list(scene.of_kind("body"))
    if len(bodies) == 1:
        return bodies[0]
    if not bodies:
        raise fault("E221", declared.at(), f"`{declared.name}` has no body to work on", "no body is declared",
                    "declare one: `body beam = solid(cylinder(...), material)`")  # fmt: skip
    raise fault("E221", declared.at(), f"`{declared.name}` could mean any of {len(bodies)} bodies",
                "which body?",
                f"say which: `body = {bodies[0]}`; bodies: {', '.join(bodies)}")  # fmt: skip


def elsewhere(scene: Scene, declared: Declared, case: Case) -> str | None:
    """The body that a declared thing is about, if it is not that of the case; unclear ones are said elsewhere."""
    try:
        body = body_of(scene, declared)
    except Fault:
        return None
    return None if body == case.body.name else body


def reach(low: Sequence[float], high: Sequence[float]) -> str:
    """What a body spans, in words: `x from 0 to 178 mm, y from -19 to 19 mm, ...`."""
    return ", ".join(f"{n} from {units.show_range(a, b, units.LENGTH)}"
                     for n, a, b in zip("xyz", low, high, strict=True))


# ------------------------------------------------------------------ selections on a straight beam


def coverage(condition: Condition, shape: Any, station: float) -> str:
    """How much of the cross-section at `station` (m from the root) a condition selects: all, some or none."""
    return next(iter(coverages(condition, shape, [station])))


def coverages(condition: Condition, shape: Any, stations: Sequence[float]) -> set[str]:
    """The coverage at each of some stations, in ascending order; stops at the first that is `some`.

    Bounds over whole slabs of the body settle most stations at once, so that the work grows like the
    logarithm of their number.
    """
    extent, found, pending = math.dist(*shape.bounds), set(), [(0, len(stations))]
    while pending and "some" not in found:
        first, end = pending.pop()
        false, true = condition.over(*_slab(shape, stations[first], stations[end - 1]), extent)
        if not (false and true):
            found.add("all" if true else "none")
        elif end - first > 1:
            middle = (first + end) // 2
            pending += [(first, middle), (middle, end)]
        else:
            found.add(_sampled(condition, shape, stations[first], extent))
    return found


def _sampled(condition: Condition, shape: Any, station: float, extent: float) -> str:
    """The coverage where bounds leave it open, from points of the cross-section."""
    x, y, z = _centre(shape, station)
    held = [bool(condition.holds(x + a, y + b, z + c, extent)) for a, b, c in _offsets(shape)]
    return "all" if all(held) else "some" if any(held) else "none"


def _slab(shape: Any, first: float, last: float) -> tuple[Point, Point]:
    """The lowest and highest coordinates of the body between two stations."""
    ends = [*zip(_centre(shape, first), _centre(shape, last), strict=True)]
    reach = _section_reach(shape)
    x, y, z = ((min(pair) - r, max(pair) + r) for pair, r in zip(ends, reach, strict=True))
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


def _centre(shape: Any, station: float) -> Point:
    x, y, z = (r + station * a for r, a in zip(shape.root, shape.axis, strict=True))
    return x, y, z


@lru_cache(maxsize=64)
def _offsets(shape: Any) -> tuple[Point, ...]:
    """Points of a cross-section, from its centre."""
    from softmark.solvers.mesh.shapes import transverse

    (ax, ay, az), (bx, by, bz) = transverse(shape.axis)
    return tuple((u * ax + v * bx, u * ay + v * by, u * az + v * bz) for u, v in shape.section.samples())


@lru_cache(maxsize=64)
def _section_reach(shape: Any) -> tuple[float, ...]:
    """How far a cross-section reaches from its centre along x, y and z."""
    return tuple(max(abs(c) for c in column) for column in zip(*_offsets(shape), strict=True))


def borders(condition: Condition, shape: Any) -> list[float]:
    """Stations (m) where a selection of whole cross-sections begins or ends inside the body.

    Slabs of the body that bounds settle are passed over; the others are halved, and bisected when they are thin. The
    end faces are left out: a border there lies off them by the tolerance of conditions.
    """
    found, pending = [], [(END * shape.length, (1 - END) * shape.length)]
    while pending:
        a, b = pending.pop()
        false, true = condition.over(*_slab(shape, a, b), math.dist(*shape.bounds))
        if not (false and true):
            continue
        if b - a > shape.length / 256:
            pending += [(a, 0.5 * (a + b)), (0.5 * (a + b), b)]
        elif (before := _whole(condition, shape, a)) != _whole(condition, shape, b):
            found.append(_border(condition, shape, *((a, b) if before else (b, a))))
    return sorted(found)


END = 1e-6  # of the length: borders closer to an end face are that face


def _whole(condition: Condition, shape: Any, station: float) -> bool:
    return coverage(condition, shape, station) == "all"


def _border(condition: Condition, shape: Any, inside: float, outside: float) -> float:
    """The last station of a selection, by bisection from one inside and one outside."""
    while abs(outside - inside) > 1e-12 * shape.length:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if _whole(condition, shape, middle) else (inside, middle)
    return inside
