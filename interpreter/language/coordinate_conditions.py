"""Conditions on coordinates, which can be evaluated at points or bounded over a box.

Comparisons allow for round-off: coordinates that differ by less than 1e-9 of the body's extent count as equal.
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
    """Closed interval of values, with interval arithmetic.

    Source: Moore 1966.
    """

    low: float
    high: float

    def __add__(self, other: Enclosure | float) -> Enclosure:
        o = _as_interval(other)
        return _smallest_interval(self.low + o.low, self.high + o.high)

    def __neg__(self) -> Enclosure:
        return Enclosure(-self.high, -self.low)

    def __sub__(self, other: Enclosure | float) -> Enclosure:
        return self + -_as_interval(other)

    def __mul__(self, other: Enclosure | float) -> Enclosure:
        o = _as_interval(other)
        products = [a * b for a in (self.low, self.high) for b in (o.low, o.high)]
        return _smallest_interval(*products)

    def __truediv__(self, other: Enclosure | float) -> Enclosure:
        o = _as_interval(other)
        if o.low <= 0 <= o.high:
            return EVERYTHING
        return self * _smallest_interval(1 / o.high, 1 / o.low)

    def __pow__(self, n: float) -> Enclosure:
        through_zero = (0.0,) if n % 2 == 0 and self.low < 0 < self.high else ()
        return _smallest_interval(_integer_power(self.low, n), _integer_power(self.high, n), *through_zero)

    def root(self) -> Enclosure:
        """Return the square root; negative values count as zero."""
        return Enclosure(math.sqrt(max(self.low, 0.0)), math.sqrt(max(self.high, 0.0)))

    def magnitude(self) -> Enclosure:
        """Return an enclosure of the absolute value."""
        ends = (abs(self.low), abs(self.high))
        return Enclosure(0.0 if self.low < 0 < self.high else min(ends), max(ends))


EVERYTHING = Enclosure(-math.inf, math.inf)


def _smallest_interval(*values: float) -> Enclosure:
    """Return the smallest interval that contains some values, or the whole real line if one is nan."""
    return EVERYTHING if any(map(math.isnan, values)) else Enclosure(min(values), max(values))


def _as_interval(value: Enclosure | float) -> Enclosure:
    return value if isinstance(value, Enclosure) else Enclosure(value, value)


@dataclass(frozen=True)
class Term:
    """Arithmetic term of coordinates; `at` evaluates it for (x, y, z) as floats, numpy arrays or intervals.

    `plane` is (a, b, c, d) if the term is the linear function a x + b y + c z + d. `axes` are the coordinates in the
    term. `inside` is the argument if the term is an absolute value.
    """

    at: Callable[[tuple[Any, Any, Any]], Any]
    varies: bool
    value: float = math.nan  # plane of a constant
    plane: Plane | None = None
    axes: frozenset[int] = frozenset()
    inside: Term | None = None

    @staticmethod
    def constant(value: float) -> Term:
        """Return a constant term."""
        return Term(lambda p: value, False, value, (0.0, 0.0, 0.0, value))

    @staticmethod
    def coordinate(axis: int) -> Term:
        """Return the term x, y or z."""
        plane = tuple(float(i == axis) for i in range(4))
        return Term(lambda p: p[axis], True, plane=plane, axes=frozenset({axis}))  # type: ignore[arg-type]

    def negated(self) -> Term:
        """Return minus this term."""
        return Term(lambda p: -self.at(p), self.varies, -self.value, _scale_plane(self.plane, -1.0), self.axes)

    def combine(self, operator: str, other: Term) -> Term:
        """Return the combination of this term with another by the operator + - * / or ^."""
        f = _OPERATORS[operator]
        plane, axes = self._combined_plane(operator, other), self.axes | other.axes
        return Term(lambda p: f(self.at(p), other.at(p)), True, plane=plane, axes=axes)

    def _combined_plane(self, operator: str, other: Term) -> Plane | None:
        """Return the coefficients (a, b, c, d) of the combined term if it is linear, else None."""
        match operator:
            case "+":
                return _add_planes(self.plane, other.plane)
            case "-":
                return _add_planes(self.plane, _scale_plane(other.plane, -1.0))
            case "*" if not other.varies:
                return _scale_plane(self.plane, other.value)
            case "*" if not self.varies:
                return _scale_plane(other.plane, self.value)
            case "/" if not other.varies:
                return _scale_plane(self.plane, 1.0 / other.value)
        return None

    def apply_function(self, name: str) -> Term:
        """Return the square root or absolute value of this term, by the `name` sqrt or abs."""
        f = _FUNCTIONS[name]
        return Term(lambda p: f(self.at(p)), True, axes=self.axes, inside=self if name == "abs" else None)


Plane = tuple[float, float, float, float]  # coefficients of a x + b y + c z + d


def _scale_plane(plane: Plane | None, factor: float) -> Plane | None:
    return None if plane is None else (plane[0] * factor, plane[1] * factor, plane[2] * factor, plane[3] * factor)


def _add_planes(one: Plane | None, other: Plane | None) -> Plane | None:
    if one is None or other is None:
        return None
    return (one[0] + other[0], one[1] + other[1], one[2] + other[2], one[3] + other[3])


_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: b + a if isinstance(b, Enclosure) else a + b,
    "-": lambda a, b: a - b if not isinstance(b, Enclosure) else _as_interval(a) - b,
    "*": lambda a, b: b * a if isinstance(b, Enclosure) else a * b,
    "/": lambda a, b: _as_interval(a) / b if isinstance(b, Enclosure) else a / _nonzero_divisor(b),
    "^": lambda a, b: a**b if isinstance(a, Enclosure) else _integer_power(a, b),
}


def _integer_power(a: Any, n: float) -> Any:
    """Return a whole power as a product, which overflows to infinity where `**` would raise."""
    return math.prod([a] * int(n))


def _nonzero_divisor(divisor: Any) -> Any:
    """Replace a zero divisor by 1e-300, so that the quotient becomes huge instead of undefined."""
    return divisor + (divisor == 0) * 1e-300


def _square_root(a: Any) -> Any:
    """Return the square root, or zero for negative numbers, which round-off causes at the edge of a disc."""
    if isinstance(a, Enclosure):
        return a.root()
    return (0.5 * (a + abs(a))) ** 0.5


def _absolute_value(a: Any) -> Any:
    return a.magnitude() if isinstance(a, Enclosure) else abs(a)


_FUNCTIONS = {"sqrt": _square_root, "abs": _absolute_value}

Point = tuple[float, float, float]  # m
Truth = tuple[bool, bool]  # (may be false somewhere, may be true somewhere)


@dataclass(frozen=True)
class Border:
    """Surface on which a comparison of coordinates changes its truth: the points where `level` is zero.

    `level` is the difference of both sides of the comparison, in m^`power`; `power` is 2 for x^2 + y^2 < r^2.
    """

    level: Term  # in m^power
    power: int

    def at(self, x: Any, y: Any, z: Any) -> Any:
        """Return the level, m^power, at points x, y, z, m; its sign differs on the two sides of the border."""
        return self.level.at((x, y, z))

    def over(self, low: Point, high: Point) -> Enclosure:
        """Return lower and upper bounds of the level, m^power, over the box with the corners `low` and `high`, m."""
        x, y, z = (Enclosure(a, b) for a, b in zip(low, high, strict=True))
        return _as_interval(self.level.at((x, y, z)))

    @property
    def plane(self) -> Plane | None:
        """Coefficients (a, b, c, d) of a x + b y + c z + d = 0, or None if the border is curved."""
        return self.level.plane


@dataclass(frozen=True)
class Condition:
    """Selection of points: `holds` evaluates it at points, `over` bounds it on a box, `said` is its text.

    `borders` are the surfaces that can bound the selection; between them it is true or false throughout. `regions` are
    the names of regions in it. `groups` are the names of groups of a mesh file in it; coordinates cannot decide
    membership, and `with_group_membership` replaces the groups by known membership.
    """

    _test: Callable[[tuple[Any, Any, Any], float], Any] = field(repr=False)
    _bound: Callable[[tuple[Enclosure, Enclosure, Enclosure], float], Truth] = field(repr=False)
    _told: Callable[[Sequence[Any], float], Any] = field(repr=False)
    said: str = field(default="", compare=False)
    borders: tuple[Border, ...] = field(default=(), compare=False, repr=False)
    regions: tuple[str, ...] = field(default=(), compare=False)
    groups: tuple[str, ...] = field(default=(), compare=False)
    _known: Callable[[Mapping[str, bool]], Condition] | None = field(default=None, repr=False, compare=False)

    def with_group_membership(self, members: Mapping[str, bool]) -> Condition:
        """Return the condition with each group replaced by whether an item belongs to it.

        The result depends only on coordinates.
        """
        return self if self._known is None else self._known(members)

    @property
    def axes(self) -> frozenset[int]:
        """Coordinates on which the condition depends: 0, 1 and 2 are x, y and z."""
        return frozenset(axis for border in self.borders for axis in border.level.axes)

    def holds(self, x: Any, y: Any, z: Any, extent: float) -> Any:
        """Return whether points (x, y, z), m, satisfy the condition in a body with this extent, m."""
        return self._test((x, y, z), extent)

    def holds_for_levels(self, levels: Sequence[Any], extent: float) -> Any:
        """Return whether points satisfy the condition, from the levels of its borders at the points, in their order."""
        return self._told(levels, extent)

    def over(self, low: Point, high: Point, extent: float | None = None) -> Truth:
        """Return two truth values for a box: whether the condition may be false in it, and whether it may be true.

        (False, True) means that the condition holds everywhere. `extent` is that of the body, m, if the box is only a
        part of it.
        """
        x, y, z = (Enclosure(a, b) for a, b in zip(low, high, strict=True))
        return self._bound((x, y, z), math.dist(low, high) if extent is None else extent)

    @staticmethod
    def comparison(operator: str, a: Term, b: Term, length_power: int) -> Condition:
        """Return the condition of a comparison such as a < b, whose operands have the dimension length^length_power."""
        if (both := _rewrite_absolute_comparison(operator, a, b, length_power)) is not None:
            return both

        def tolerance(extent: float) -> float:
            return float(RELATIVE_TOLERANCE * extent**length_power)

        def test(p: tuple[Any, Any, Any], extent: float) -> Any:
            return _SIGN[operator](a.at(p) - b.at(p), tolerance(extent))

        def bound(box: tuple[Enclosure, Enclosure, Enclosure], extent: float) -> Truth:
            d = _as_interval(a.at(box)) - b.at(box)
            return _BOUND[operator](d.low, d.high, tolerance(extent))

        def told(levels: Sequence[Any], extent: float) -> Any:
            return _SIGN[operator](levels[0], tolerance(extent))

        return Condition(test, bound, told, borders=(Border(a.combine("-", b), length_power),))

    @staticmethod
    def group(name: str) -> Condition:
        """Return the condition of membership in a named group of a mesh file.

        Evaluating it at a point raises MembersUnknown.
        """

        def unknown(_: Any, extent: float) -> Any:
            raise MembersUnknown(name)

        def known(members: Mapping[str, bool]) -> Condition:
            return EVERYWHERE if members[name] else NOWHERE

        said = f'group "{name}"'
        return Condition(unknown, lambda box, extent: (True, True), unknown, said, groups=(name,), _known=known)

    @staticmethod
    def negation(a: Condition) -> Condition:
        """Return the condition `not a`."""

        def bound(box: tuple[Enclosure, Enclosure, Enclosure], extent: float) -> Truth:
            false, true = a._bound(box, extent)
            return true, false

        def test(p: tuple[Any, Any, Any], extent: float) -> Any:
            return _negate_truth(a._test(p, extent))

        def told(levels: Sequence[Any], extent: float) -> Any:
            return _negate_truth(a._told(levels, extent))

        def known(members: Mapping[str, bool]) -> Condition:
            return Condition.negation(a.with_group_membership(members))

        known_of = known if a.groups else None
        return Condition(
            test, bound, told, borders=a.borders, regions=a.regions, groups=a.groups, _known=known_of
        )  # fmt: skip

    @staticmethod
    def junction(operator: str, a: Condition, b: Condition) -> Condition:
        """Return the condition `a and b` or `a or b`."""
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
            return Condition.junction(operator, a.with_group_membership(members), b.with_group_membership(members))

        groups = (*a.groups, *(g for g in b.groups if g not in a.groups))
        return Condition(
            test, bound, told, borders=(*a.borders, *b.borders), regions=(*a.regions, *b.regions),
            groups=groups, _known=known if groups else None,
        )  # fmt: skip


TURNED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}


def _rewrite_absolute_comparison(operator: str, a: Term, b: Term, length_power: int) -> Condition | None:
    """Rewrite |t| < c and similar comparisons as conditions on t, bounded by two planes if t is linear.

    One border for |t| would be curved, and cells cut along it would get straight pieces.
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
    """Raised if a condition on a named group of a mesh file is evaluated at a point.

    Membership in a group is not known at points. The argument is the name of the group.
    """


def _constant_condition(value: bool) -> Condition:
    """Return a condition that is either true everywhere or false everywhere."""
    return Condition(lambda p, extent: value, lambda box, extent: (not value, value), lambda levels, extent: value)


EVERYWHERE, NOWHERE = _constant_condition(True), _constant_condition(False)


def _negate_truth(held: Any) -> Any:
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
