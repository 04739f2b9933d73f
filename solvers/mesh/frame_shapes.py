"""Frames: straight members between points, each with a section, rigidly connected at common points."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.solvers.mesh.cross_sections import Disc, Rectangle
from softmark.solvers.mesh.shape import Prism, Shape, Vector3, add_multiples, cross, dot, transverse
from softmark.solvers.mesh.tubes import Annulus

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats
    from softmark.solvers.mesh.shape import Bounds, Section, Surface
else:
    from softmark.solvers.runtime.lazy_modules import np

MEASURES = ("radius", "inner", "side", "height")
CROSSED = 1e-6  # relative to the diagonal: axes closer than this intersect
NEAR = 1e-9  # relative to the diagonal: points closer than this coincide
ALONG = 1e-6  # length of the unit vector's normal part below which it defines no second section axis


@dataclass(frozen=True)
class Member(Prism):
    """A straight member of a frame between two points, with a section that may vary linearly.

    `ends` are the sections at both points; their dimensions vary linearly in between. The second axis of the section is
    the direction `up`, made normal to the member. `section` encloses all sections of the member.
    """

    begin: Vector3
    end: Vector3
    ends: tuple[Section, Section]
    up: Vector3 = (0.0, 0.0, 1.0)

    @property
    def root(self) -> Vector3:
        """Start of the axis, m."""
        return self.begin

    @property
    def length(self) -> float:
        """Length along the axis, m."""
        return math.dist(self.begin, self.end)

    @property
    def axis(self) -> Vector3:
        """Unit vector from the first point of the member to the second."""
        x, y, z = ((b - a) / self.length for a, b in zip(self.begin, self.end, strict=True))
        return x, y, z

    @property
    def tapered(self) -> bool:
        """True if the sections at the two ends differ."""
        return self.ends[0] != self.ends[1]

    @cached_property
    def section(self) -> Section:
        """Section that encloses all sections of the member; for a uniform member its only section."""
        return self.ends[0] if not self.tapered else enclosing_section(*self.ends)

    def section_at(self, station: float) -> Section:
        """Return the cross-section at a station: a distance from the member's first point along its axis, m."""
        t = min(max(station / self.length, 0.0), 1.0)
        return self.ends[0] if not self.tapered else interpolate_sections(*self.ends, t)

    @property
    def taper_slope(self) -> float:
        """Change of half of a section extent per length of the axis, the larger of both; dimensionless."""
        apart = (abs(a - b) for a, b in zip(*(section.extents for section in self.ends), strict=True))
        return float(0.5 * max(apart) / self.length)

    @cached_property
    def volume(self) -> float:
        """Exact volume, m^3, by Simpson's rule, since areas are quadratic along the axis."""
        a, b, c = (self.section_at(t * self.length).area for t in (0.0, 0.5, 1.0))
        return self.length * (a + 4.0 * b + c) / 6.0

    @cached_property
    def _member_frame(self) -> tuple[Vector3, Vector3, Vector3]:
        axis, up = self.axis, self.up
        if math.hypot(*cross(up, axis)) < ALONG:
            up = (1.0, 0.0, 0.0) if abs(axis[0]) < 0.5 else (0.0, 1.0, 0.0)
        side = cross(up, axis)
        norm = math.hypot(*side)
        first = (side[0] / norm, side[1] / norm, side[2] / norm)
        return axis, first, cross(axis, first)

    def frame(self, station: float) -> tuple[Vector3, Vector3, Vector3]:
        """Return the unit vectors of all sections: along the axis, normal to `up`, and along `up`."""
        return self._member_frame

    def bounds_between(self, first: float, last: float) -> Bounds:
        """Return the lowest and highest coordinates of the part between two stations, m.

        They are attained in one of the two end sections of the part.
        """
        low, high = [0.0] * 3, [0.0] * 3
        ends = [(self.centre(s), self.section_at(s)) for s in (first, last)]
        for i, (a, b) in enumerate(zip(*self._member_frame[1:], strict=True)):
            low[i] = min(x[i] - section.support(-a, -b) for x, section in ends)
            high[i] = max(x[i] + section.support(a, b) for x, section in ends)
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])


@lru_cache(maxsize=64)
def tapered_member(root: Vector3, axis: Vector3, length: float, first: Section, last: Section) -> Member:
    """Return a straight member of a `length` (m) with sections that vary linearly from `first` to `last`.

    The member starts at `root`, m, and runs along the unit vector `axis`. The axes of its sections are those that
    `transverse(axis)` returns.
    """
    return Member(root, add_multiples(root, (length, axis)), (first, last), transverse(axis)[1])


def interpolate_sections(one: Section, other: Section, t: float) -> Section:
    """Return the section between two sections of one kind: `one` for t = 0, `other` for t = 1, linear in between.

    Raises TypeError for sections of different kinds.
    """
    match one, other:
        case Disc(), Disc():
            return Disc(_interpolate(one.radius, other.radius, t))
        case Annulus(), Annulus():
            return Annulus(_interpolate(one.radius, other.radius, t), _interpolate(one.inner, other.inner, t))
        case Rectangle(), Rectangle():
            return Rectangle(_interpolate(one.width, other.width, t), _interpolate(one.height, other.height, t))
    raise TypeError(f"there is nothing between a {type(one).__name__} and a {type(other).__name__}")


def _interpolate(a: float, b: float, t: float) -> float:
    return a + t * (b - a)


def enclosing_section(one: Section, other: Section) -> Section:
    """Return a section that encloses two sections of one kind: the larger extents and the smaller hole.

    Raises TypeError for sections of different kinds.
    """
    match one, other:
        case Disc(), Disc():
            return Disc(max(one.radius, other.radius))
        case Annulus(), Annulus():
            return Annulus(max(one.radius, other.radius), min(one.inner, other.inner))
        case Rectangle(), Rectangle():
            return Rectangle(max(one.width, other.width), max(one.height, other.height))
    raise TypeError(f"nothing holds a {type(one).__name__} and a {type(other).__name__}")


@dataclass(frozen=True)
class Network(Shape):
    """A frame: members between pairs of points, counted from 1, with sections.

    Dimensions of sections, in m, are given once for all members, or for each member. Dimensions that begin with `end_`
    apply at the second point of members; without `end_height`, for example, the height is constant.
    """

    points: tuple[Vector3, ...]
    pairs: tuple[tuple[int, int], ...]
    radius: tuple[float, ...] | None = None
    inner: tuple[float, ...] | None = None
    side: tuple[float, ...] | None = None
    height: tuple[float, ...] | None = None
    up: Vector3 = (0.0, 0.0, 1.0)
    end_radius: tuple[float, ...] | None = None
    end_inner: tuple[float, ...] | None = None
    end_side: tuple[float, ...] | None = None
    end_height: tuple[float, ...] | None = None

    wired = True
    gap = "hollow members"

    @cached_property
    def fault(self) -> str:
        """Return why points, members and sections are inconsistent; "" if they are valid."""
        return self._section_fault() or self._member_fault() or self._point_fault()

    def _section_fault(self) -> str:
        if (self.radius is None) == (self.side is None):
            return "it needs either a `radius` (round sections) or a `side` (rectangular sections)"
        if self.inner is not None and self.radius is None:
            return "`inner` belongs to round sections; rectangular ones have a `side` and a `height`"
        if self.height is not None and self.side is None:
            return "`height` belongs to rectangular sections; round ones have only a `radius`"
        for name in MEASURES:
            if getattr(self, f"end_{name}") is not None and getattr(self, name) is None:
                return f"`end_{name}` is the value of `{name}` at the second point, but `{name}` is missing"
        for name in (*MEASURES, *(f"end_{name}" for name in MEASURES)):
            given = getattr(self, name)
            if given is not None and len(given) not in (1, len(self.pairs)):
                return (
                    f"`{name}` has {len(given)} values, but there are {len(self.pairs)} members: write "
                    "one value, or one for each"
                )
        pairs = [
            pair
            for i in range(len(self.pairs))
            for pair in zip(self._end_dimensions(i, "radius"), self._end_dimensions(i, "inner"), strict=True)
        ]
        if any(radius is not None and inner is not None and inner >= radius for radius, inner in pairs):
            return "`inner`, the radius of the cavity, must be less than `radius`"
        return ""

    def _member_fault(self) -> str:
        known: dict[frozenset[int], int] = {}
        for number, pair in enumerate(self.pairs, start=1):
            beyond = next((n for n in pair if not 1 <= n <= len(self.points)), None)
            if beyond is not None:
                return f"member {number} refers to point {beyond}, but there are only points 1 to {len(self.points)}"
            if pair[0] == pair[1]:
                return f"member {number} begins and ends at point {pair[0]}"
            if (other := known.setdefault(frozenset(pair), number)) != number:
                return f"members {other} and {number} join the same two points"
        return ""

    def _point_fault(self) -> str:
        order = sorted(range(len(self.points)), key=lambda i: self.points[i])
        size = math.dist(*_bounding_box(self.points))
        for place, i in enumerate(order):
            for j in order[place + 1 :]:
                if self.points[j][0] - self.points[i][0] > NEAR * size:
                    break
                if math.dist(self.points[i], self.points[j]) <= NEAR * size:
                    return (
                        f"points {min(i, j) + 1} and {max(i, j) + 1} are at the same position: use one "
                        "point where members are joined"
                    )
        joined = self._connected_points()
        loose = next((i for i in range(len(self.points)) if i not in joined), None)
        if loose is None:
            return ""
        used = any(loose + 1 in pair for pair in self.pairs)
        return f"point {loose + 1} {'is not connected to point 1 by members' if used else 'belongs to no member'}"

    def _connected_points(self) -> set[int]:
        """Return the points (counted from 0) that members connect with the first point."""
        beside: dict[int, list[int]] = {}
        for a, b in self.pairs:
            beside.setdefault(a - 1, []).append(b - 1)
            beside.setdefault(b - 1, []).append(a - 1)
        found, pending = {0}, [0]
        while pending:
            new = [j for j in beside.get(pending.pop(), []) if j not in found]
            found.update(new)
            pending += new
        return found

    @cached_property
    def members(self) -> tuple[Member, ...]:
        """All members, in the order of the scene."""
        ends = [(self.points[a - 1], self.points[b - 1]) for a, b in self.pairs]
        return tuple(Member(*pair, self._end_sections(i), self.up) for i, pair in enumerate(ends))

    def _end_sections(self, i: int) -> tuple[Section, Section]:
        """Return a member's sections at its first and second point."""
        first, last = zip(*(self._end_dimensions(i, name) for name in MEASURES), strict=True)
        return _build_section(*first), _build_section(*last)

    def _end_dimensions(self, i: int, name: str) -> tuple[float | None, float | None]:
        """Return the dimension `name` of member i at its first and second point, m; equal if only one is given."""
        first, last = getattr(self, name), getattr(self, f"end_{name}")
        return _value_of_member(first, i), _value_of_member(first if last is None else last, i)

    def run(self, number: int) -> tuple[list[int], list[int]]:
        """Return the straight sequence of members of equal section around member `number`, and its two end points.

        Members are counted from 0, points from 1.
        """
        found, ends = [number], []
        for start in self.pairs[number]:
            member, point = number, start
            while (after := self._straight_continuation(member, point)) is not None and after not in found:
                found.append(after)
                member, point = after, next(p for p in self.pairs[after] if p != point)
            ends.append(point)
        return found, ends

    def at(self, point: int) -> list[int]:
        """Return the members (counted from 0) that end at a point (counted from 1)."""
        return [i for i, pair in enumerate(self.pairs) if point in pair]

    def _section_at_point(self, number: int, point: int) -> Section:
        """Return the section of a member (counted from 0) at one of its points (counted from 1)."""
        return self.members[number].ends[self.pairs[number].index(point)]

    def _straight_continuation(self, number: int, point: int) -> int | None:
        """Return the member that continues member `number` straight beyond `point`; None if there is none.

        It must be the only other member at the point and have the same section there. Members are counted from 0,
        points from 1.
        """
        here = self.at(point)
        other = next((i for i in here if i != number), None)
        if (
            len(here) != 2
            or other is None
            or self._section_at_point(other, point) != self._section_at_point(number, point)
        ):
            return None
        one, two = self.members[number], self.members[other]
        return other if math.hypot(*cross(one.axis, two.axis)) <= ALONG else None

    def find_crossing_members(self) -> tuple[int, int] | None:
        """Return the first two members (counted from 1) whose axes cross or overlap; None if there are none.

        Members that meet only at a point of the frame that belongs to both do not count.
        """
        near = CROSSED * self.diagonal
        spans = [sorted((m.begin[0], m.end[0])) for m in self.members]
        order = sorted(range(len(spans)), key=lambda i: spans[i][0])
        for place, i in enumerate(order):
            for j in order[place + 1 :]:
                if spans[j][0] > spans[i][1] + near:
                    break
                shared = set(self.pairs[i]) & set(self.pairs[j])
                if (
                    self._do_axes_overlap(i, j, near)
                    if shared
                    else _axis_distance(self.members[i], self.members[j]) <= near
                ):
                    return min(i, j) + 1, max(i, j) + 1
        return None

    def _do_axes_overlap(self, i: int, j: int, near: float) -> bool:
        """Return whether an end of one of two members lies on the other's axis, within `near` (m).

        A common point of both members does not count.
        """
        for one, other in ((i, j), (j, i)):
            end = next(n for n in self.pairs[one] if n not in self.pairs[other])
            s, u, v = self.members[other].section_coordinates(self.points[end - 1])
            if math.hypot(u, v) <= near and 0.0 <= s <= self.members[other].length:
                return True
        return False

    @cached_property
    def bounds(self) -> Bounds:
        """Lowest and highest coordinates, m."""
        if self.fault:
            return _bounding_box(self.points)
        return _bounding_box([end for member in self.members for end in member.bounds])

    @property
    def volume(self) -> float:
        """Sum of the volumes of all members, m^3; joints count for each member, as in frame theory."""
        return sum(member.volume for member in self.members)

    def contains(self, point: Vector3) -> bool:
        """Return whether a member contains a point, within 1e-9 of its length."""
        return any(member.contains(point) for member in self.members)

    def hollow_at(self, point: Vector3) -> bool:
        """Return whether a point lies on the axis of a hollow member, and in no other member."""
        return any(member.hollow_at(point) for member in self.members)

    def nearest(self, X: Floats) -> Floats:
        """Return for each point X (n, 3), m, the member that contains it or is nearest to it, shape (n,).

        Members are counted from 0.
        """
        found = np.array([_distance_outside(member, X) for member in self.members])
        best: Floats = np.argmin(found, axis=0)
        return best

    def surface(self, size: float) -> Surface:
        """Return points (n, 3), m, and triangles (t, 3) of the surfaces of all members, outward; they intersect."""
        from softmark.solvers.mesh.shape_surfaces import triangulate_swept

        points, triangles, count = [], [], 0
        for member in self.members:
            X, t = triangulate_swept(member, 16, max(2, min(48, round(member.length / size))))
            points.append(X)
            triangles.append(t + count)
            count += len(X)
        return np.concatenate(points), np.concatenate(triangles)


def _build_section(radius: float | None, inner: float | None, side: float | None, height: float | None) -> Section:
    if radius is not None:
        return Disc(radius) if inner is None else Annulus(radius, inner)
    side = side or 1.0  # reported by `fault`; this value is not used
    return Rectangle(side, height or side)


def _value_of_member(values: tuple[float, ...] | None, i: int) -> float | None:
    return None if values is None else values[0] if len(values) == 1 else values[i]


def _bounding_box(points: tuple[Vector3, ...] | list[Vector3]) -> Bounds:
    x, y, z = zip(*points, strict=True)
    return (min(x), min(y), min(z)), (max(x), max(y), max(z))


def _distance_outside(member: Member, X: Floats) -> Floats:
    """Return how far points X (n, 3), m, lie outside a member, shape (n,), m; about 0 inside.

    A millionth of the distance from the axis is added. If several members contain a point, the one whose axis is
    nearest then has the smallest result.
    """
    s, u, v = member.coordinates(X)
    along = np.maximum(np.maximum(-s, s - member.length), 0.0)
    found: Floats = np.hypot(along, member.section.outside(u, v)) + 1e-6 * np.hypot(along, np.hypot(u, v))
    return found


def _axis_distance(one: Member, other: Member) -> float:
    """Return the distance between the axes of two members, m."""
    d1, d2 = ([q - p for p, q in zip(m.begin, m.end, strict=True)] for m in (one, other))
    r = [p - q for p, q in zip(one.begin, other.begin, strict=True)]
    a, e, f = dot(d1, d1), dot(d2, d2), dot(d2, r)
    c, b = dot(d1, r), dot(d1, d2)
    across = a * e - b * b
    s = min(max((b * f - c * e) / across, 0.0), 1.0) if across > 1e-12 * a * e else 0.0
    t = (b * s + f) / e
    if not 0.0 <= t <= 1.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((b * t - c) / a, 0.0), 1.0)
    return math.dist([p + s * d for p, d in zip(one.begin, d1, strict=True)],
                     [p + t * d for p, d in zip(other.begin, d2, strict=True)])  # fmt: skip
