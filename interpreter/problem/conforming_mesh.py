"""Positions at which meshes of a shape need nodes, so that supports and regions follow their selections exactly.

A mesh can follow the border of a condition if a coordinate of the shape is constant on it: planes normal to
the edges of a box; planes normal to the axis of a cylinder, and circles around it; spheres around the centre
of a sphere. It can also follow a plane along the axis of a cylinder. Only parts of a border at which the
selection changes within the body count. The module uses numbers only, no arrays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.coordinate_conditions import Border, Condition
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import SAME, Cut

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape

Cuts = tuple[Cut, ...]
Place = Mapping[str, float]  # point, by the coordinates of the shape

RAYS = (0.137, 0.382, 0.618, 0.871)  # fractions of the other coordinates' spans at which rays search for a border
STEPS = 9  # values of each other coordinate at which a selection is evaluated, in addition to cuts
ASIDE = 1e-6  # relative to a span: distance of samples on both sides of a border
ANGLES = ("turn", "tilt")  # coordinates on which no mesh is cut
NARROW = 1e-4  # relative to a span: intervals are halved to this length before a crossing is bisected
REACH = 0.5  # relative to a span: distance from a cut at which cells have their full size
MOST = 32  # largest number of intervals with a crossing (a border with more is no coordinate surface), and of cuts


def cuts_of(case: Case, shape: Shape | None = None) -> Cuts:
    """Return the positions (cuts) at which meshes need nodes to follow the supports and regions of a case.

    `shape` is by default the shape of the body. There are none for a mesh file.
    """
    shape = shape or case.shape
    asking = (*case.supports, *case.parts)
    return tuple(dict.fromkeys(cut for own in asking for cut in cuts_for(own.thing.where, shape)))


def cuts_for(where: Condition, shape: Shape) -> Cuts:
    """Return the positions (cuts) at which meshes of a shape need nodes to follow a condition; none for a mesh file."""
    return tuple(_ConditionInShape(shape, where).cuts()) if shape.coordinate_ranges and not where.groups else ()


def graded_cuts(where: Condition, shape: Shape, finer: float) -> Cuts:
    """Return positions at the borders of a condition around which cells of a mesh are smaller by the factor `finer`.

    A border is used if a coordinate of the shape is constant on it, inside the body or at its ends. Cells grow to their
    full size over a part of the body's extent. Meshes of a filled surface are refined where the condition holds.
    """
    if where.groups or not (shape.gradable_coordinates or shape.enclosed):
        return ()
    if shape.enclosed:
        return (Cut("", 0.0, finer=finer, where=where),)
    asking, found = _ConditionInShape(shape, where), dict[tuple[str, float], Cut]()
    for border in where.borders:
        for axis, at in (*asking.ends(border), *asking.places(border)):
            low, high = shape.coordinate_ranges[axis]
            if axis in shape.gradable_coordinates:
                found.setdefault((axis, at), Cut(axis, at, finer=finer, reach=REACH * (high - low)))
    return tuple(found.values())[:MOST]


@dataclass(frozen=True)
class _ConditionInShape:
    """Condition on the points of a shape, as a function of the shape's own coordinates such as radius and height."""

    shape: Shape
    condition: Condition

    @property
    def extent(self) -> float:
        """Extent of the body, m."""
        return self.shape.diagonal

    def cuts(self) -> list[Cut]:
        """Return the surfaces (cuts), by coordinate and value, on which the mesh needs nodes."""
        where = [(axis, at) for border in self.condition.borders for axis, at in self.places(border)][:MOST]
        found = [
            Cut(axis, at, self._is_selected_to_end(axis, at))
            for axis, at in where
            if self._changes_across_surface(axis, at, where)
        ]
        chords = (self.shape.cut_at_plane(b.plane) for b in self.condition.borders if b.plane)
        return found + [chord for chord in chords if chord is not None and self._changes_across_chord(chord, where)]

    # -------------------------------------------------------------- positions of borders

    def places(self, border: Border) -> Iterator[tuple[str, float]]:
        """Yield the surfaces in the body that coincide with a border, each by its constant coordinate and value, m."""
        for axis, (low, high) in self.shape.coordinate_ranges.items():
            if axis in ANGLES:
                continue
            met = [self._border_crossings_of_ray(border, axis, share) for share in RAYS]
            if met[0] and all(_is_close(met[0], other, SAME * (high - low)) for other in met[1:]):
                yield from ((axis, at) for at in met[0])

    def ends(self, border: Border) -> Iterator[tuple[str, float]]:
        """Yield the end surfaces that coincide with a border, each by its constant coordinate and value, m."""
        slack, spans = SAME * self.extent**border.power, self.shape.coordinate_ranges
        rays = [self._scattered_coordinates(share) for share in RAYS]
        for axis in (name for name in spans if name not in ANGLES):
            for t in spans[axis]:
                if all(abs(border.at(*self.shape.place(**{**ray, axis: t}))) <= slack for ray in rays):
                    yield axis, t

    def _scattered_coordinates(self, share: float) -> Place:
        """Return the coordinates of an irregularly placed sample point; `share` from 0 to 1 selects the point."""
        return {
            n: a + (b - a) * _scattered_fractions(share, i)
            for i, (n, (a, b)) in enumerate(self.shape.coordinate_ranges.items())
        }

    def _border_crossings_of_ray(self, border: Border, axis: str, share: float) -> list[float]:
        """Return the values of a coordinate, m, at which a ray along it crosses a border in isolated points."""
        others = self._scattered_coordinates(share)

        def at(t: float) -> tuple[float, float, float]:
            return self.shape.place(**{**others, axis: t})

        low, high = self.shape.coordinate_ranges[axis]
        slack = SAME * (high - low)
        if border.plane is not None:
            a, b = border.at(*at(low)), border.at(*at(high))
            t = low - a * (high - low) / (b - a) if a != b else math.inf
            return [t] if low + slack < t < high - slack else []
        found: list[float] = []
        pending = [(low, high)]
        while pending and len(pending) + len(found) <= MOST:
            a, b = pending.pop()
            ends = tuple(zip(at(a), at(b), strict=True))
            level = border.over(*(tuple(f(pair) for pair in ends) for f in (min, max)))  # type: ignore[arg-type]
            if level.low > 0.0 or level.high < 0.0:
                continue
            if b - a > NARROW * (high - low):
                pending += [(a, 0.5 * (a + b)), (0.5 * (a + b), b)]
            elif (border.at(*at(a)) > 0.0) != (border.at(*at(b)) > 0.0):
                found.append(_bisect(lambda t: border.at(*at(t)) > 0.0, a, b))
        return [] if pending else sorted(t for t in found if low + slack < t < high - slack)

    # -------------------------------------------------------------- changes of the selection

    def _holds(self, place: Place) -> bool:
        x, y, z = self.shape.place(**place)
        return bool(self.condition.holds(x, y, z, self.extent))

    def _sample_coordinates(self, axis: str, where: Sequence[tuple[str, float]]) -> Iterator[dict[str, float]]:
        """Yield sample values of all coordinates but `axis`: at the ends, at borders, and between these."""
        columns = []
        for name, (low, high) in self.shape.coordinate_ranges.items():
            if name == axis:
                continue
            even = [low + (high - low) * (i + 0.5) / STEPS for i in range(STEPS)]
            known = sorted({low, high, *(at for other, at in where if other == name)})
            between = [0.5 * (a + b) for a, b in pairwise(known)]
            columns.append([(name, value) for value in (*known, *between, *even)])
        return (dict(row) for row in product(*columns))

    def _changes_across_surface(self, axis: str, at: float, where: Sequence[tuple[str, float]]) -> bool:
        """Return whether the selection changes across the surface `axis` = `at`, on the body or in it."""
        low, high = self.shape.coordinate_ranges[axis]
        aside = ASIDE * (high - low)
        near = [t for t in (at - aside, at, at + aside) if low <= t <= high]
        return any(
            len({self._holds({**others, axis: t}) for t in near}) == 2
            for others in self._sample_coordinates(axis, where)
        )

    def _is_selected_to_end(self, axis: str, at: float) -> bool:
        """Return whether everything between the surface `axis` = `at` and the nearer end of the body is selected."""
        low, high = self.shape.coordinate_ranges[axis]
        end = low if at - low < high - at else high
        if axis == "radius" and end == low:
            return False
        between = (0.5 * (at + end), at + 0.1 * (end - at), end)
        return all(self._holds({**others, axis: t}) for t in between for others in self._sample_coordinates(axis, ()))

    def _changes_across_chord(self, chord: Cut, where: Sequence[tuple[str, float]]) -> bool:
        """Return whether the selection changes across a chord of a cylinder's cross-section."""
        radius = self.shape.coordinate_ranges["radius"][1]
        half, aside = math.sqrt(radius**2 - chord.at**2), ASIDE * radius
        stations = sorted({row["along"] for row in self._sample_coordinates("radius", where)})
        for q, s in product([half * (2 * i + 1 - STEPS) / STEPS for i in range(STEPS)], stations):
            sides = ((chord.at + step, q) for step in (-aside, aside))
            held = [
                self._holds({"radius": math.hypot(p, q), "turn": chord.turn + math.atan2(q, p), "along": s})
                for p, q in sides
            ]
            if held[0] != held[1]:
                return True
        return False


def _scattered_fractions(share: float, number: int) -> float:
    """Return an irregular fraction, 0 to 1, for the coordinate with this `number`; `share` selects the sample point."""
    return (share + 0.31 * number) % 0.97 + 0.015


def _is_close(one: Sequence[float], other: Sequence[float], slack: float) -> bool:
    return len(one) == len(other) and all(abs(a - b) <= slack for a, b in zip(one, other, strict=True))


def _bisect(above: Any, a: float, b: float) -> float:
    """Return the position between a and b at which the predicate `above` changes, to the last digit."""
    first = above(a)
    for _ in range(60):
        middle = 0.5 * (a + b)
        a, b = (middle, b) if above(middle) == first else (a, middle)
    return 0.5 * (a + b)
