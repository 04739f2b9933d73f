"""Conditions on coordinates that hold inside a shape.

The levels of borders are lengths, close to distances. Shapes known only by facets have no such condition.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import reduce

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE, Condition, Term
from softmark.solvers.mesh import polygons
from softmark.solvers.mesh.boolean_shapes import BooleanShape
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.polygons import Corners, Place
from softmark.solvers.mesh.revolved_bodies import ON_AXIS, Revolution
from softmark.solvers.mesh.shape import Shape, Vector3, transverse
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.spheres import RoundBody
from softmark.solvers.mesh.tubes import Tube

Point = tuple[Term, Term, Term]  # m
HERE: Point = (Term.coordinate(0), Term.coordinate(1), Term.coordinate(2))
FAR = 1e3  # relative to a polygon's extent: end of infinite sides


def inside_condition(shape: Shape, at: Point, closed: bool) -> Condition | None:
    """Return the condition that a shape contains the point `at`; None for mesh files and curved axes.

    With `closed` the border of the shape is included.
    """
    below = "<=" if closed else "<"
    if isinstance(shape, BooleanShape):
        return _inside_combined_shape(shape, at, closed)
    if isinstance(shape, Box):
        return _all_conditions(
            _value_in_interval_condition(at[i], *span, below) for i, span in enumerate(shape.coordinate_ranges.values())
        )
    if isinstance(shape, RoundBody):
        return _inside_round_body(shape, at, below)
    if isinstance(shape, Cylinder | Tube):
        s, square = _axial_coordinates(at, shape.origin, shape.axis)
        hollow = shape.section.hole_radius
        along = [
            _value_in_interval_condition(s, 0.0, shape.length, below),
            _below_zero_condition(_distance_from_circle(square, shape.radius), below),
        ]
        return _all_conditions(
            [*along, _below_zero_condition(_distance_from_circle(square, hollow).negated(), below)] if hollow else along
        )
    if isinstance(shape, Revolution):
        s, square = _axial_coordinates(at, shape.origin, shape.axis)
        return _inside_polygon(shape.outline, _left_of_revolved_side(s, square, ON_AXIS * shape.largest_radius, below))
    if isinstance(shape, Extruded):
        return _inside_extrusion(shape, at, below)
    return None


def _inside_combined_shape(shape: BooleanShape, at: Point, closed: bool) -> Condition | None:
    taken = shape.operation == "difference"
    one, other = inside_condition(shape.one, at, closed), inside_condition(shape.other, at, closed != taken)
    if one is None or other is None:
        return None
    if taken:
        return Condition.junction("and", one, Condition.negation(other))
    return Condition.junction("or" if shape.operation == "union" else "and", one, other)


def _inside_round_body(shape: RoundBody, at: Point, below: str) -> Condition:
    off = [_term_minus_value(c, o) for c, o in zip(at, shape.origin, strict=True)]
    square = _sum(
        _product_of_terms(_scaled_term(c, 1.0 / a), _scaled_term(c, 1.0 / a))
        for c, a in zip(off, shape.outer_semiaxes, strict=True)
    )
    half = 0.5 * min(shape.outer_semiaxes)
    found = [_below_zero_condition(_scaled_term(_term_minus_value(square, 1.0), half), below)]
    if shape.hollow_ratio:
        found.append(
            _below_zero_condition(
                _scaled_term(_term_minus_value(square, shape.hollow_ratio**2), half / shape.hollow_ratio).negated(),
                below,
            )
        )
    return _all_conditions(
        [*found, *(_below_zero_condition(c.negated(), below) for c in off[: shape.halved_axis_count])]
    )


def _inside_extrusion(shape: Extruded, at: Point, below: str) -> Condition:
    last = "xyz".index(shape.along)
    first, second, up = (at[(last + i) % 3] for i in (1, 2, 3))

    def beside(a: Place, b: Place) -> Condition:
        length = math.dist(a, b)
        u, v = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        return _below_zero_condition(
            _sum([_scaled_term(_term_minus_value(first, a[0]), v), _scaled_term(_term_minus_value(second, a[1]), -u)]),
            below,
        )

    return _all_conditions(
        [
            _inside_polygon(shape.section, beside),
            _value_in_interval_condition(up, shape.base, shape.base + shape.height, below),
        ]
    )


def _left_of_revolved_side(s: Term, square: Term, least: float, below: str) -> Callable[[Place, Place], Condition]:
    """Return the condition that a point lies to the left of a side of a revolved polygon.

    The point is given by its axial coordinate and the square of its distance from the axis.
    """

    def beside(a: Place, b: Place) -> Condition:
        if max(a[0], b[0]) <= least:
            return EVERYWHERE  # there is nothing beyond the axis
        length = math.dist(a, b)
        u, v = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        if not v:
            return _below_zero_condition(_scaled_term(_term_minus_value(s, a[1]), -u), below)
        if not u:
            return _below_zero_condition(_scaled_term(_distance_from_circle(square, a[0]), v), below)
        due = _sum(
            [_scaled_term(_term_minus_value(s, a[1]), u / v), Term.constant(a[0])]
        )  # of the distance; below zero past a tip
        beyond = square.combine("-", _product_of_terms(due, due.apply_function("abs")))
        return _below_zero_condition(_scaled_term(beyond, 0.5 * v / max(a[0], b[0])), below)

    return beside


def _inside_polygon(corners: Corners, beside: Callable[[Place, Place], Condition]) -> Condition:
    """Return the condition inside a counter-clockwise polygon, from the half-plane `beside` each side, each used once.

    A chain of sides between two corners is cut at its farthest corner. The result is the intersection of both parts if
    the chain turns left there, else their union.
    Source: Dobkin, Guibas, Hershberger and Snoeyink (1993), An efficient algorithm for finding the CSG representation
    of a simple polygon, Algorithmica 10:1.
    """
    left = min(range(len(corners)), key=lambda i: corners[i])
    ring = [*corners[left:], *corners[:left]]
    right = max(range(len(ring)), key=lambda i: ring[i])
    return _all_conditions(
        _left_of_chain(own, beside, FAR * polygons.extent(corners))
        for own in (ring[: right + 1], [*ring[right:], ring[0]])
    )


def _left_of_chain(sides: Sequence[Place], beside: Callable[[Place, Place], Condition], far: float) -> Condition:
    """Return the condition to the left of a chain of sides, the first and the last of which are infinite."""
    if len(sides) == 2:
        return beside(sides[0], sides[1])
    ends = [_far_point(sides[1], sides[0], far), _far_point(sides[-2], sides[-1], far)]
    normal = (ends[0][1] - ends[1][1], ends[1][0] - ends[0][0])
    levels = [(p[0] - ends[0][0]) * normal[0] + (p[1] - ends[0][1]) * normal[1] for p in sides[1:-1]]
    at = 1 + max(range(len(levels)), key=lambda i: abs(levels[i]))
    (a, b), (x, y), (c, d) = sides[at - 1 : at + 2]
    turns_left = (x - a) * (d - y) - (y - b) * (c - x) >= 0.0
    one, other = (_left_of_chain(own, beside, far) for own in (sides[: at + 1], sides[at:]))
    return Condition.junction("and" if turns_left else "or", one, other)


def _far_point(a: Place, b: Place, far: float) -> Place:
    """Return a point at a large distance on the ray from a through b."""
    length = math.dist(a, b)
    return b[0] + far * (b[0] - a[0]) / length, b[1] + far * (b[1] - a[1]) / length


def _axial_coordinates(at: Point, origin: Vector3, axis: Vector3) -> tuple[Term, Term]:
    """Return the coordinate of a point along an axis, m, and the square of its distance from the axis, m^2."""
    off = [_term_minus_value(c, o) for c, o in zip(at, origin, strict=True)]
    s, u, v = (
        _sum(_scaled_term(c, e) for c, e in zip(off, way, strict=True) if e) for way in (axis, *transverse(axis))
    )
    return s, _sum([_product_of_terms(u, u), _product_of_terms(v, v)])


def _distance_from_circle(square: Term, radius: float) -> Term:
    """Return the distance from a circle, m, positive outside, of a point at a squared distance from the axis."""
    return _scaled_term(_term_minus_value(square, radius**2), 0.5 / radius)


def _value_in_interval_condition(value: Term, low: float, high: float, below: str) -> Condition:
    return _all_conditions(
        [
            _below_zero_condition(_term_minus_value(value, low).negated(), below),
            _below_zero_condition(_term_minus_value(value, high), below),
        ]
    )


def _below_zero_condition(level: Term, below: str) -> Condition:
    """Return the condition that a level, m, is at most zero, or less than zero, by the relation `below`."""
    return Condition.comparison(below, level, Term.constant(0.0), 1)


def _all_conditions(conditions: Iterable[Condition]) -> Condition:
    return reduce(lambda a, b: Condition.junction("and", a, b), conditions)


def _sum(terms: Iterable[Term]) -> Term:
    return reduce(lambda a, b: a.combine("+", b), terms)


def _product_of_terms(a: Term, b: Term) -> Term:
    return a.combine("*", b)


def _scaled_term(term: Term, factor: float) -> Term:
    return term.combine("*", Term.constant(factor))


def _term_minus_value(term: Term, value: float) -> Term:
    return term.combine("-", Term.constant(value))
