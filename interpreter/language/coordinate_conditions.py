"""Conditions on coordinates: evaluated at points, or bounded over a box without any point.

Comparisons allow for round-off: coordinates that differ by less than 1e-9 of the body's extent count as
equal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

from softmark.records import dataclass

RELATIVE_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Enclosure:
    """All values between two bounds: interval arithmetic (Moore 1966)."""

    low: float
    high: float

    def __add__(self, other: Enclosure | float) -> Enclosure:
        o = _range(other)
        return _bounded(self.low + o.low, self.high + o.high)

    def __neg__(self) -> Enclosure:
        return Enclosure(-self.high, -self.low)

    def __sub__(self, other: Enclosure | float) -> Enclosure:
        return self + -_range(other)

    def __mul__(self, other: Enclosure | float) -> Enclosure:
        o = _range(other)
        products = [a * b for a in (self.low, self.high) for b in (o.low, o.high)]
        return _bounded(*products)

    def __truediv__(self, other: Enclosure | float) -> Enclosure:
        o = _range(other)
        if o.low <= 0 <= o.high:
            return EVERYTHING
        return self * _bounded(1 / o.high, 1 / o.low)

    def __pow__(self, n: float) -> Enclosure:
        through_zero = (0.0,) if n % 2 == 0 and self.low < 0 < self.high else ()
        return _bounded(_raised(self.low, n), _raised(self.high, n), *through_zero)

    def root(self) -> Enclosure:
        """The square root; of what is below zero, zero."""
        return Enclosure(math.sqrt(max(self.low, 0.0)), math.sqrt(max(self.high, 0.0)))

    def magnitude(self) -> Enclosure:
        """The absolute value."""
        ends = (abs(self.low), abs(self.high))
        return Enclosure(0.0 if self.low < 0 < self.high else min(ends), max(ends))


EVERYTHING = Enclosure(-math.inf, math.inf)


def _bounded(*values: float) -> Enclosure:
    """The range of some values; everything where one of them is not a number, as infinity minus infinity."""
    return EVERYTHING if any(map(math.isnan, values)) else Enclosure(min(values), max(values))


def _range(value: Enclosure | float) -> Enclosure:
    return value if isinstance(value, Enclosure) else Enclosure(value, value)


@dataclass(frozen=True)
class Term:
    """Arithmetic over coordinates; `at` takes (x, y, z) as floats, numpy arrays or ranges.

    `plane` (a, b, c, d) is there where the term is a x + b y + c z + d; `axes` are the coordinates that occur in it.
    `inside` is what it is the absolute value of.
    """

    at: Callable[[tuple[Any, Any, Any]], Any]
    varies: bool
    value: float = math.nan  # of a constant
    plane: Plane | None = None
    axes: frozenset[int] = frozenset()
    inside: Term | None = None

    @staticmethod
    def constant(value: float) -> Term:
        """A number."""
        return Term(lambda p: value, False, value, (0.0, 0.0, 0.0, value))

    @staticmethod
    def coordinate(axis: int) -> Term:
        """x, y or z."""
        plane = tuple(float(i == axis) for i in range(4))
        return Term(lambda p: p[axis], True, plane=plane, axes=frozenset({axis}))  # type: ignore[arg-type]

    def negated(self) -> Term:
        """Minus this."""
        return Term(lambda p: -self.at(p), self.varies, -self.value, _scaled(self.plane, -1.0), self.axes)

    def combine(self, operator: str, other: Term) -> Term:
        """This and another term under + - * / ^."""
        f = _OPERATORS[operator]
        plane, axes = self._plane(operator, other), self.axes | other.axes
        return Term(lambda p: f(self.at(p), other.at(p)), True, plane=plane, axes=axes)

    def _plane(self, operator: str, other: Term) -> Plane | None:
        """What stays linear in the coordinates: sums, and products and quotients with a constant."""
        match operator:
            case "+":
                return _summed(self.plane, other.plane)
            case "-":
                return _summed(self.plane, _scaled(other.plane, -1.0))
            case "*" if not other.varies:
                return _scaled(self.plane, other.value)
            case "*" if not self.varies:
                return _scaled(other.plane, self.value)
            case "/" if not other.varies:
                return _scaled(self.plane, 1.0 / other.value)
        return None

    def function(self, name: str) -> Term:
        """sqrt or abs of this."""
        f = _FUNCTIONS[name]
        return Term(lambda p: f(self.at(p)), True, axes=self.axes, inside=self if name == "abs" else None)


Plane = tuple[float, float, float, float]  # of a x + b y + c z + d


def _scaled(plane: Plane | None, factor: float) -> Plane | None:
    return None if plane is None else (plane[0] * factor, plane[1] * factor, plane[2] * factor, plane[3] * factor)


def _summed(one: Plane | None, other: Plane | None) -> Plane | None:
    if one is None or other is None:
        return None
    return (one[0] + other[0], one[1] + other[1], one[2] + other[2], one[3] + other[3])


_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: b + a if isinstance(b, Enclosure) else a + b,
    "-": lambda a, b: a - b if not isinstance(b, Enclosure) else _range(a) - b,
    "*": lambda a, b: b * a if isinstance(b, Enclosure) else a * b,
    "/": lambda a, b: _range(a) / b if isinstance(b, Enclosure) else a / _apart(b),
    "^": lambda a, b: a**b if isinstance(a, Enclosure) else _raised(a, b),
}


def _raised(a: Any, n: float) -> Any:
    """A whole power as a product, which overflows to infinity where `**` would raise."""
    return math.prod([a] * int(n))


def _apart(divisor: Any) -> Any:
    """A divisor that is not zero: where a coordinate is, its quotient is as large as numbers get."""
    return divisor + (divisor == 0) * 1e-300


def _root(a: Any) -> Any:
    """The square root; zero where there is none, as where round-off makes the edge of a disc negative."""
    if isinstance(a, Enclosure):
        return a.root()
    return (0.5 * (a + abs(a))) ** 0.5


def _absolute(a: Any) -> Any:
    return a.magnitude() if isinstance(a, Enclosure) else abs(a)


_FUNCTIONS = {"sqrt": _root, "abs": _absolute}

Point = tuple[float, float, float]  # m
Truth = tuple[bool, bool]  # may it be false somewhere, may it be true somewhere


@dataclass(frozen=True)
class Border:
    """A surface across which a comparison changes: where `level` (a difference of two terms) is zero."""

    level: Term  # in m^power
    power: int

    def at(self, x: Any, y: Any, z: Any) -> Any:
        """The level at points: zero on the border, of one sign on each side of it, m^power."""
        return self.level.at((x, y, z))

    def over(self, low: Point, high: Point) -> Enclosure:
        """Bounds of the level over a box, m^power."""
        x, y, z = (Enclosure(a, b) for a, b in zip(low, high, strict=True))
        return _range(self.level.at((x, y, z)))

    @property
    def plane(self) -> Plane | None:
        """(a, b, c, d) of a x + b y + c z + d = 0 where the border is a plane, and None where it is curved."""
        return self.level.plane


@dataclass(frozen=True)
class Condition:
    """A selection of points: `holds` works on floats and on arrays, `over` on a box; `said` is its text with values.

    `borders` are the surfaces that can bound it: between them it is true or false throughout. `regions` names those
    that it is made of. `groups` are named parts of a mesh file in it: no coordinates tell what these hold, and
    `given_of` makes the condition that is left for things of which it is known.
    """

    _test: Callable[[tuple[Any, Any, Any], float], Any] = field(repr=False)
    _bound: Callable[[tuple[Enclosure, Enclosure, Enclosure], float], Truth] = field(repr=False)
    _told: Callable[[Sequence[Any], float], Any] = field(repr=False)
    said: str = field(default="", compare=False)
    borders: tuple[Border, ...] = field(default=(), compare=False, repr=False)
    regions: tuple[str, ...] = field(default=(), compare=False)
    groups: tuple[str, ...] = field(default=(), compare=False)
    _known: Callable[[Mapping[str, bool]], Condition] | None = field(default=None, repr=False, compare=False)

    def given_of(self, members: Mapping[str, bool]) -> Condition:
        """The same for things of which it is known whether they are members of its groups: on coordinates alone."""
        return self if self._known is None else self._known(members)

    @property
    def axes(self) -> frozenset[int]:
        """The coordinates that it is about: 0, 1 and 2 are x, y and z."""
        return frozenset(axis for border in self.borders for axis in border.level.axes)

    def holds(self, x: Any, y: Any, z: Any, extent: float) -> Any:
        """True where (x, y, z), in m, satisfies the condition in a body of this extent (m)."""
        return self._test((x, y, z), extent)

    def given(self, levels: Sequence[Any], extent: float) -> Any:
        """The same as `holds`, where the levels of its borders are known, in their order."""
        return self._told(levels, extent)

    def over(self, low: Point, high: Point, extent: float | None = None) -> Truth:
        """(may be false, may be true) somewhere in the box; (False, True) means that it holds everywhere.

        `extent` is that of the body (m), where the box is a part of it.
        """
        x, y, z = (Enclosure(a, b) for a, b in zip(low, high, strict=True))
        return self._bound((x, y, z), math.dist(low, high) if extent is None else extent)

    @staticmethod
    def comparison(operator: str, a: Term, b: Term, length_power: int) -> Condition:
        """a < b and its kin; the tolerance is scaled by the power of length that is compared."""
        if (both := _between_planes(operator, a, b, length_power)) is not None:
            return both

        def tolerance(extent: float) -> float:
            return float(RELATIVE_TOLERANCE * extent**length_power)

        def test(p: tuple[Any, Any, Any], extent: float) -> Any:
            return _SIGN[operator](a.at(p) - b.at(p), tolerance(extent))

        def bound(box: tuple[Enclosure, Enclosure, Enclosure], extent: float) -> Truth:
            d = _range(a.at(box)) - b.at(box)
            return _BOUND[operator](d.low, d.high, tolerance(extent))

        def told(levels: Sequence[Any], extent: float) -> Any:
            return _SIGN[operator](levels[0], tolerance(extent))

        return Condition(test, bound, told, borders=(Border(a.combine("-", b), length_power),))

    @staticmethod
    def group(name: str) -> Condition:
        """Membership of a named part of a mesh file. Asked at a point alone it raises MembersUnknown."""

        def unknown(_: Any, extent: float) -> Any:
            raise MembersUnknown(name)

        def known(members: Mapping[str, bool]) -> Condition:
            return EVERYWHERE if members[name] else NOWHERE

        said = f'group "{name}"'
        return Condition(unknown, lambda box, extent: (True, True), unknown, said, groups=(name,), _known=known)

    @staticmethod
    def negation(a: Condition) -> Condition:
        """not a."""

        def bound(box: tuple[Enclosure, Enclosure, Enclosure], extent: float) -> Truth:
            false, true = a._bound(box, extent)
            return true, false

        def test(p: tuple[Any, Any, Any], extent: float) -> Any:
            return _not(a._test(p, extent))

        def told(levels: Sequence[Any], extent: float) -> Any:
            return _not(a._told(levels, extent))

        def known(members: Mapping[str, bool]) -> Condition:
            return Condition.negation(a.given_of(members))

        known_of = known if a.groups else None
        return Condition(
            test, bound, told, borders=a.borders, regions=a.regions, groups=a.groups, _known=known_of
        )  # fmt: skip

    @staticmethod
    def junction(operator: str, a: Condition, b: Condition) -> Condition:
        """a and b, a or b."""
        both = operator == "and"

        def test(p: tuple[Any, Any, Any], extent: float) -> Any:
            left, right = a._test(p, extent), b._test(p, extent)
            return left & right if both else left | right

        def bound(box: tuple[Enclosure, Enclosure, Enclosure], extent: float) -> Truth:
            (fa, ta), (fb, tb) = a._bound(box, extent), b._bound(box, extent)
            return (fa or fb, ta and tb) if both else (fa and fb, ta or tb)

        def told(levels: Sequence[Any], extent: float) -> Any:
            first = len(a.borders)
            left, right = a._told(levels[:first], extent), b._told(levels[first:], extent)
            return left & right if both else left | right

        def known(members: Mapping[str, bool]) -> Condition:
            return Condition.junction(operator, a.given_of(members), b.given_of(members))

        groups = (*a.groups, *(g for g in b.groups if g not in a.groups))
        return Condition(
            test, bound, told, borders=(*a.borders, *b.borders), regions=(*a.regions, *b.regions),
            groups=groups, _known=known if groups else None,
        )  # fmt: skip


TURNED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}


def _between_planes(operator: str, a: Term, b: Term, length_power: int) -> Condition | None:
    """|t| < c and its kin as what they say of t, whose borders are two planes where t is linear in the coordinates.

    As one border they would be curved, and what is cut along such is cut by straight pieces.
    """
    if b.inside is not None and not a.varies and operator in TURNED:
        operator, a, b = TURNED[operator], b, a
    t = a.inside
    if t is None or t.plane is None or b.varies or not b.value > 0.0 or operator not in TURNED:
        return None
    low, high = Term.constant(-b.value), Term.constant(b.value)
    sides = (Condition.comparison(TURNED[operator], t, low, length_power),
             Condition.comparison(operator, t, high, length_power))  # fmt: skip
    return Condition.junction("and" if operator in ("<", "<=") else "or", *sides)


class MembersUnknown(Exception):
    """A group of a mesh file was asked for at a place; its argument is the group's name."""


def _constant(value: bool) -> Condition:
    """The same everywhere."""
    return Condition(lambda p, extent: value, lambda box, extent: (not value, value), lambda levels, extent: value)


EVERYWHERE, NOWHERE = _constant(True), _constant(False)


def _not(held: Any) -> Any:
    return ~held if hasattr(held, "dtype") else not held


_SIGN: dict[str, Callable[[Any, float], Any]] = {
    "<": lambda d, tol: d < -tol,
    "<=": lambda d, tol: d <= tol,
    ">": lambda d, tol: d > tol,
    ">=": lambda d, tol: d >= -tol,
    "==": lambda d, tol: abs(d) <= tol,
    "!=": lambda d, tol: abs(d) > tol,
}
_BOUND: dict[str, Callable[[float, float, float], Truth]] = {
    "<": lambda low, high, tol: (high >= -tol, low < -tol),
    "<=": lambda low, high, tol: (high > tol, low <= tol),
    ">": lambda low, high, tol: (low <= tol, high > tol),
    ">=": lambda low, high, tol: (low < -tol, high >= -tol),
    "==": lambda low, high, tol: (low < -tol or high > tol, low <= tol and high >= -tol),
    "!=": lambda low, high, tol: (low <= tol and high >= -tol, low < -tol or high > tol),
}
