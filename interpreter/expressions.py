"""Evaluating expressions: numbers with dimensions, vectors, and conditions on coordinates.

Whatever cannot be evaluated puts one diagnostic into the list and raises Bad; the caller goes on with the next field.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.suggest import nearest
from softmark.grammar.tree import Span
from softmark.interpreter import units
from softmark.interpreter.conditions import Condition, Term
from softmark.interpreter.units import ANGLE, LENGTH, NONE, Dimension


class Bad(Exception):
    """Something could not be evaluated; the diagnostic is already in the list."""


@dataclass(frozen=True)
class Quantity:
    """A number in SI. Not a number where the value is known only after a run (expectations)."""

    value: float
    dimension: Dimension


@dataclass(frozen=True)
class VectorValue:
    """Components in SI, of one dimension."""

    values: tuple[float, ...]
    dimension: Dimension


Value = Quantity | VectorValue


@dataclass
class Place:
    """Where the text being evaluated comes from, and the list that collects what is wrong with it."""

    source: Source
    diagnostics: list[Diagnostic]

    def fail(self, code: str, span: Span, message: str, label: str = "", help: str = "") -> Bad:
        """Record an error; the caller raises what this returns."""
        self.diagnostics.append(Diagnostic(code, message, self.source, span, label, help))
        return Bad(message)


def _angle(f: Callable[[float], float]) -> Callable[[float], float]:
    return f


# name: (function, dimension of its argument or None for any, dimension of its value or None for the argument's)
FUNCTIONS: dict[str, tuple[Callable[[float], float], Dimension | None, Dimension | None]] = {
    "abs": (abs, None, None),
    "sin": (math.sin, ANGLE, NONE),
    "cos": (math.cos, ANGLE, NONE),
    "tan": (math.tan, ANGLE, NONE),
    "exp": (math.exp, NONE, NONE),
    "log": (math.log, NONE, NONE),
}
SPECIAL = ("sqrt", "min", "max")
CONSTANTS = {"pi": math.pi}
COORDINATES = ("x", "y", "z")
PREDEFINED = frozenset((*FUNCTIONS, *SPECIAL, *CONSTANTS, *COORDINATES, "yes", "no"))

Lookup = Callable[[tree.Name], Value]


@dataclass(frozen=True)
class Evaluator:
    """Evaluates expressions of one text; `lookup` resolves names and raises Bad where there is none."""

    place: Place
    lookup: Lookup

    def quantity(self, node: tree.Expression) -> Quantity:
        """A number with its dimension."""
        value = self.value(node)
        if isinstance(value, Quantity):
            return value
        raise self.place.fail("E207", node.span, "expected a single number, found a vector", "a vector")

    def value(self, node: tree.Expression) -> Value:
        """A number or a vector."""
        match node:
            case tree.Number():
                return self._number(node)
            case tree.Name():
                constant = CONSTANTS.get(node.text)
                return self.lookup(node) if constant is None else Quantity(constant, NONE)
            case tree.Vector():
                return self._vector(node)
            case tree.Unary(operator="-", operand=operand):
                return _map(lambda a: -a, self.value(operand))
            case tree.Unary(operator="+", operand=operand):
                return self.value(operand)
            case tree.Binary(operator=op) if op not in ("and", "or"):
                return self._binary(node)
            case tree.Call():
                return self._call(node)
        raise self.place.fail("E207", node.span, f"expected a number, found {describe(node)}", describe(node))

    def measure(self, unit: tree.Unit) -> units.Measure:
        """The unit's factor and dimension."""
        try:
            return units.parse(unit.text)
        except units.UnitError as error:
            raise self.place.fail("E209", unit.span, error.problem, "not a unit", error.remedy) from None

    def _number(self, node: tree.Number) -> Quantity:
        if node.unit is None:
            return Quantity(node.value, NONE)
        measure = self.measure(node.unit)
        return self._finite(Quantity(node.value * measure.factor, measure.dimension), node.span)

    def _finite(self, q: Quantity, span: Span) -> Quantity:
        if math.isinf(q.value):
            raise self.place.fail("E219", span, "the number is too large", help="numbers go up to about 1e308")
        return q

    def _vector(self, node: tree.Vector) -> VectorValue:
        items = [self.quantity(item) for item in node.items]
        if node.unit is not None:
            measure = self.measure(node.unit)
            # the unit belongs to the items that are plain numbers
            items = [
                Quantity(q.value * measure.factor, measure.dimension) if q.dimension == NONE else q for q in items
            ]
        for q, item in zip(items, node.items, strict=True):
            if q.dimension != items[0].dimension:
                first, other = units.named(items[0].dimension), units.named(q.dimension)
                raise self.place.fail(
                    "E218", item.span, f"the components of a vector differ in dimension: {first} and {other}", other,
                    "give every component a unit, `(L, 0 mm, 0 mm)`, or one unit after the vector, `(0, 0, 1) mm`",
                )  # fmt: skip
        return VectorValue(tuple(q.value for q in items), items[0].dimension)

    def _binary(self, node: tree.Binary) -> Value:
        left, right = self.value(node.left), self.value(node.right)
        try:
            return self._combine(node, left, right)
        except (OverflowError, ZeroDivisionError, ValueError):
            what = "this divides by zero" if node.operator == "/" else "this has no finite value"
            raise self.place.fail("E219", node.span, what) from None

    def _combine(self, node: tree.Binary, left: Value, right: Value) -> Value:
        a, b = left.dimension, right.dimension
        match node.operator:
            case "+" | "-" if a == b and type(left) is type(right):
                sign = 1 if node.operator == "+" else -1
                return _zip(left, right, sign)
            case "*" if isinstance(right, Quantity) or isinstance(left, Quantity):
                vector, scalar = (right, left) if isinstance(right, VectorValue) else (left, right)
                product = _map(lambda c: c * scalar.value, vector)  # type: ignore[union-attr]
                return self._checked(type(product)(_content(product), units.times(a, b)), node.span)  # type: ignore[arg-type]
            case "/" if isinstance(right, Quantity):
                quotient = _map(lambda c: c / right.value, left)
                return self._checked(type(quotient)(_content(quotient), units.times(a, b, -1)), node.span)  # type: ignore[arg-type]
            case "^" if isinstance(left, Quantity) and isinstance(right, Quantity) and b == NONE:
                return self._power(node, left, right)
        raise self._unlike(node, left, right)

    def _checked(self, value: Value, span: Span) -> Value:
        return self._finite(value, span) if isinstance(value, Quantity) else value

    def _unlike(self, node: tree.Binary, left: Value, right: Value) -> Bad:
        words = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide", "^": "raise to a power"}
        return self.place.fail(
            "E218", node.span, f"cannot {words[node.operator]} {_words(left)} and {_words(right)}",
            f"{_words(left)} {node.operator} {_words(right)}",
            "sums need equal dimensions; a number without a unit is a plain number",
        )  # fmt: skip

    def _power(self, node: tree.Binary, base: Quantity, exponent: Quantity) -> Quantity:
        n = exponent.value
        if base.dimension != NONE and n != int(n):
            raise self.place.fail(
                "E218", node.span, "a quantity with a unit can be raised to whole powers only", help="use `sqrt(...)`"
            )
        if abs(n) > 99 and base.dimension != NONE:
            raise self.place.fail("E219", node.span, "the power is too large")
        dimension = units.power(base.dimension, int(n)) if base.dimension != NONE else NONE
        value = base.value**n
        if isinstance(value, complex):
            raise ValueError
        return self._finite(Quantity(value, dimension), node.span)

    def _call(self, node: tree.Call) -> Quantity:
        name = node.function.text
        if name not in FUNCTIONS and name not in SPECIAL:
            raise self._unknown_function(node)
        if any(a.name for a in node.arguments) or not node.arguments:
            raise self.place.fail("E211", node.span, f"`{name}` takes plain values", help=f"write `{name}(a)`")
        arguments = [self.quantity(a.value) for a in node.arguments]
        if name in ("min", "max"):
            return self._extreme(node, arguments)
        if len(arguments) != 1:
            raise self.place.fail("E211", node.span, f"`{name}` takes one value, found {len(arguments)}")
        return self._apply(node, name, arguments[0])

    def _unknown_function(self, node: tree.Call) -> Bad:
        name = node.function.text
        close = nearest(name, [*FUNCTIONS, *SPECIAL])
        hint = f"a function with a similar name exists: `{close}`" if close else "functions: " + ", ".join((*FUNCTIONS, *SPECIAL))
        return self.place.fail("E203", node.function.span, f"`{name}` does not make a number", "unknown here", hint)

    def _extreme(self, node: tree.Call, arguments: list[Quantity]) -> Quantity:
        if len({q.dimension for q in arguments}) > 1:
            raise self.place.fail("E218", node.span, "the values compared differ in dimension")
        choose = min if node.function.text == "min" else max
        return choose(arguments, key=lambda q: q.value)

    def _apply(self, node: tree.Call, name: str, q: Quantity) -> Quantity:
        try:
            if name == "sqrt":
                if any(n % 2 for n in q.dimension):
                    raise self.place.fail("E218", node.span, f"the root of {units.named(q.dimension)} has no whole unit")
                return Quantity(math.sqrt(q.value), tuple(n // 2 for n in q.dimension))  # type: ignore[arg-type]
            function, takes, gives = FUNCTIONS[name]
            if takes is not None and q.dimension != takes:
                found, due = units.named(q.dimension), units.named(takes)
                raise self.place.fail("E204", node.arguments[0].span, f"expected {due}, found {found}", found)
            return Quantity(function(q.value), q.dimension if gives is None else gives)
        except (ValueError, OverflowError):
            raise self.place.fail("E219", node.span, f"`{name}` has no value there") from None

    # ------------------------------------------------------------------ conditions on coordinates

    def condition(self, node: tree.Expression) -> Condition:
        """A condition on x, y and z, such as `x <= 0 mm and z > 1 mm`."""
        match node:
            case tree.Unary(operator="not", operand=operand):
                return Condition.negation(self.condition(operand))
            case tree.Binary(operator="and" | "or" as op, left=left, right=right):
                return Condition.junction(op, self.condition(left), self.condition(right))
            case tree.Compare():
                return self._comparison(node)
            case tree.Name(parts=("all" | "everywhere",)):
                pass
        raise self.place.fail(
            "E207", node.span, f"expected a condition on the coordinates, found {describe(node)}", describe(node),
            "compare a coordinate with a length: `x <= 0 mm`, `x >= L and z > 0 mm`",
        )  # fmt: skip

    def _comparison(self, node: tree.Compare) -> Condition:
        terms = [self._term(operand) for operand in node.operands]
        whole: Condition | None = None
        for (a, da), (b, db), operator, right in zip(
            terms[:-1], terms[1:], node.operators, node.operands[1:], strict=False
        ):
            if da != db:
                found, due = units.named(db), units.named(da)
                raise self.place.fail(
                    "E204", right.span, f"expected {due}, found {found}", found,
                    f"both sides of `{operator}` must have the same dimension; give {due} in {units.usual(da)}",
                )  # fmt: skip
            one = Condition.comparison(operator, a, b, da[0])
            whole = one if whole is None else Condition.junction("and", whole, one)
        if whole is None or not any(t.varies for t, _ in terms):
            raise self.place.fail(
                "E207", node.span, "the condition does not depend on x, y or z", help="compare a coordinate: `x <= 0 mm`"
            )
        return whole

    def _term(self, node: tree.Expression) -> tuple[Term, Dimension]:
        """An arithmetic term that may hold coordinates."""
        match node:
            case tree.Name(parts=(("x" | "y" | "z") as axis,)):
                return Term.coordinate("xyz".index(axis)), LENGTH
            case tree.Unary(operator="-" | "+" as op, operand=operand):
                term, dimension = self._term(operand)
                return (term.negated() if op == "-" else term), dimension
            case tree.Binary(operator="+" | "-" | "*" | "/" | "^" as op) if _has_coordinate(node):
                return self._term_binary(node, op)
            case tree.Call(function=tree.Name(parts=("sqrt" | "abs" as name,)), arguments=(argument,)) if _has_coordinate(
                argument.value
            ):
                term, d = self._term(argument.value)
                return term.function(name), (tuple(n // 2 for n in d) if name == "sqrt" else d)  # type: ignore[return-value]
        q = self.quantity(node)
        return Term.constant(q.value), q.dimension

    def _term_binary(self, node: tree.Binary, op: str) -> tuple[Term, Dimension]:
        (a, da), (b, db) = self._term(node.left), self._term(node.right)
        if op in "+-" and da != db or op == "^" and (db != NONE or b.varies or b.value not in (2.0, 3.0, 4.0)):
            found = f"{units.named(da)} {op} {units.named(db)}"
            raise self.place.fail("E218", node.span, "these dimensions do not go together", found)
        dimension = {"*": units.times(da, db), "/": units.times(da, db, -1)}.get(op, da)
        return a.combine(op, b), units.power(da, int(b.value)) if op == "^" else dimension


def _has_coordinate(node: tree.Expression) -> bool:
    match node:
        case tree.Name(parts=(part,)):
            return part in COORDINATES
        case tree.Unary(operand=operand):
            return _has_coordinate(operand)
        case tree.Binary(left=left, right=right):
            return _has_coordinate(left) or _has_coordinate(right)
        case tree.Call(arguments=arguments):
            return any(_has_coordinate(a.value) for a in arguments)
    return False


def describe(node: tree.Expression) -> str:
    """What stands there, in words: `a number`, `a text`, `a list`."""
    names: Iterable[tuple[type[object], str]] = (
        (tree.Number, "a number"), (tree.String, "a text"), (tree.Vector, "a vector"), (tree.List, "a list"),
        (tree.Compare, "a comparison"),
    )  # fmt: skip
    for cls, words in names:
        if isinstance(node, cls):
            return words
    if isinstance(node, tree.Call):
        return f"`{node.function.text}(...)`"
    if isinstance(node, tree.Name):
        return f"the name `{node.text}`"
    return "an expression"


def _words(value: Value) -> str:
    one = units.named(value.dimension)
    return f"a vector of {one.split(' ', 1)[-1]}s" if isinstance(value, VectorValue) else one


def _content(value: Value) -> float | tuple[float, ...]:
    return value.value if isinstance(value, Quantity) else value.values


def _map(f: Callable[[float], float], value: Value) -> Value:
    if isinstance(value, Quantity):
        return Quantity(f(value.value), value.dimension)
    return VectorValue(tuple(f(v) for v in value.values), value.dimension)


def _zip(a: Value, b: Value, sign: int) -> Value:
    if isinstance(a, Quantity) and isinstance(b, Quantity):
        return Quantity(a.value + sign * b.value, a.dimension)
    left, right = _content(a), _content(b)
    return VectorValue(tuple(x + sign * y for x, y in zip(left, right, strict=True)), a.dimension)  # type: ignore[arg-type]
