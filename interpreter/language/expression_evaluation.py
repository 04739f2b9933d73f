"""Evaluation of expressions: numbers with dimensions, and vectors. For conditions see condition_syntax.py.

An expression that cannot be evaluated adds one diagnostic to the list and raises EvaluationError; the caller then
continues with the next field.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Fix, Remedy, SecondaryPlace, Source, as_remedy, did_you_mean
from softmark.grammar.name_suggestions import nearest
from softmark.grammar.tree import Span
from softmark.interpreter.language import field_schema, foreign_aliases, quotient_warnings, units
from softmark.interpreter.language.field_schema import Vocabulary
from softmark.interpreter.language.units import ANGLE, NONE, Dimension
from softmark.records import dataclass


class EvaluationError(Exception):
    """Exception for an expression that cannot be evaluated; its diagnostic is already recorded."""


@dataclass(frozen=True)
class Quantity:
    """Number in SI units with its dimension; NaN for a value that is known only after a run, as in expectations."""

    value: float
    dimension: Dimension


@dataclass(frozen=True)
class VectorValue:
    """Vector components in SI units with one common dimension."""

    values: tuple[float, ...]
    dimension: Dimension


Value = Quantity | VectorValue
V = TypeVar("V", Quantity, VectorValue, Value)


@dataclass
class SourceErrors:
    """Text whose expressions are evaluated, and the list to which their diagnostics are added."""

    source: Source
    diagnostics: list[Diagnostic]

    def error(
        self, code: str, span: Span, message: str, label: str = "", help: str | Remedy = "",
        also: tuple[SecondaryPlace, ...] = (),
    ) -> EvaluationError:  # fmt: skip
        """Record an error and return it for the caller to raise."""
        remedy = as_remedy(help)
        found = Diagnostic(code, message, self.source, span, label, remedy.help, also=also, fix=remedy.fix)
        self.diagnostics.append(found)
        return EvaluationError(message)


# name: (function, dimension of argument or None for any, of value or None for the argument's)
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
HIGHEST = 99  # largest power of a unit
PREDEFINED = frozenset((*FUNCTIONS, *SPECIAL, *CONSTANTS, *COORDINATES, "yes", "no"))

Lookup = Callable[[tree.Name], Value]
At = Callable[[tree.Name, tree.Expression, Quantity], Value]  # (name before `.at`, expression in brackets)


@dataclass(frozen=True)
class Evaluator:
    """Evaluator of expressions in one text; `lookup` resolves names, and raises EvaluationError for unknown ones."""

    place: SourceErrors
    lookup: Lookup
    vocabulary: Vocabulary
    at: At | None = None  # evaluates `model.metric.at(12.5 %)` in expectations

    def quantity(self, node: tree.Expression) -> Quantity:
        """Return the number, with its dimension, that an expression must have as value. Raises EvaluationError."""
        value = self.value(node)
        if isinstance(value, Quantity):
            return value
        raise self.place.error("E207", node.span, "expected a single number, found a vector", "a vector",
                              "give one number; a vector has no order and no single value")  # fmt: skip

    def value(self, node: tree.Expression) -> Value:
        """Return the number or vector that an expression has as value. Raises EvaluationError."""
        match node:
            case tree.Number():
                return self._evaluate_number(node)
            case tree.Name():
                return self._evaluate_name(node)
            case tree.Vector():
                return self._evaluate_vector(node)
            case tree.Unary(operator="-", operand=operand):
                value = self.value(operand)
                return _map_components(lambda c: -c, value, value.dimension)
            case tree.Unary(operator="+", operand=operand):
                return self.value(operand)
            case tree.Binary(operator=op) if op not in ("and", "or"):
                return self._evaluate_binary(node)
            case tree.Call():
                return self._evaluate_call(node)
        help = "a number may have a unit: `178 mm`, `2 * L + 5 mm`"
        raise self.place.error(
            "E207", node.span, f"expected a number, found {describe_expression(node)}", "not a number", help
        )

    def _evaluate_name(self, node: tree.Name) -> Value:
        if node.text in CONSTANTS:
            return Quantity(CONSTANTS[node.text], NONE)
        if node.text in COORDINATES:
            help = "use coordinates in conditions, such as `where = x <= 0 mm`, and in directions"
            problem = f"the coordinate `{node.text}` has no value here"
            raise self.place.error("E213", node.span, problem, "a coordinate", help)
        if node.text in ("yes", "no"):
            help = "use `yes` and `no` for switches, such as `shear = no`"
            problem = f"expected a number, found `{node.text}`"
            raise self.place.error("E207", node.span, problem, "not a number", help)
        return self.lookup(node)

    def measure(self, unit: tree.Unit) -> units.Measure:
        """Return the factor and dimension of a unit. Raises EvaluationError for a unit that cannot be read."""
        try:
            return units.parse_unit(unit.text)
        except units.UnitError as error:
            meant = error.mended(unit.text)
            remedy = Remedy(error.remedy, Fix(meant) if meant else None)
            raise self.place.error("E209", unit.span, error.problem, help=remedy) from None

    def _evaluate_number(self, node: tree.Number) -> Quantity:
        if node.unit is None:
            return Quantity(node.value, NONE)
        return self._multiply_by_unit(Quantity(node.value, NONE), self.measure(node.unit), node.span)

    def _multiply_by_unit(self, plain: Quantity, measure: units.Measure, span: Span) -> Quantity:
        """Return a dimensionless number multiplied by the unit that follows it."""
        value = self._require_finite(Quantity(plain.value * measure.factor, measure.dimension), span)
        return self._require_no_underflow(value, plain.value != 0.0, span)

    def _require_finite(self, value: V, span: Span) -> V:
        """Return a value that double precision can hold or that is known only after a run. Raises EvaluationError."""
        if any(map(math.isinf, value_components(value))):
            raise self.place.error("E219", span, "the number is too large", "numbers go up to 1.8e308")
        if any(abs(n) > HIGHEST for n in value.dimension):
            raise self.place.error("E219", span, "the power of the unit is too large", f"powers go up to {HIGHEST}")
        return value

    def _require_no_underflow(self, value: V, meant: bool, span: Span) -> V:
        """Return a value unless it underflowed to zero. Raises EvaluationError.

        `meant` is true if a value other than zero is expected.
        """
        if meant and not any(value_components(value)):
            raise self.place.error("E219", span, "the number is too small", "numbers go down to 4.9e-324",
                                  "write `0` for zero")  # fmt: skip
        return value

    def values(self, node: tree.List) -> VectorValue:
        """Return the numbers of a list, which must have one dimension and may be only one. Raises EvaluationError."""
        return self._evaluate_vector(node)

    def _evaluate_vector(self, node: tree.Vector | tree.List) -> VectorValue:
        items = [self.quantity(item) for item in node.items]
        if node.unit is not None:
            measure = self.measure(node.unit)
            # the unit applies to items that are plain numbers
            items = [
                self._multiply_by_unit(q, measure, item.span) if q.dimension == NONE else q
                for q, item in zip(items, node.items, strict=True)
            ]
        for q, item in zip(items, node.items, strict=True):
            if q.dimension != items[0].dimension:
                first, other = units.dimension_name(items[0].dimension), units.dimension_name(q.dimension)
                problem = f"the components of a vector differ in dimension: {first} and {other}"
                help = quotient_warnings.suggest_quotient(
                    item, self.place.source.text, q.dimension, items[0].dimension
                ) or ("give each component a unit, `(L, 0 mm, 0 mm)`, or give the vector one unit, `(0, 0, 1) mm`")
                raise self.place.error("E218", item.span, problem, other, help)
        return VectorValue(tuple(q.value for q in items), items[0].dimension if items else NONE)

    def _evaluate_binary(self, node: tree.Binary) -> Value:
        left, right = self.value(node.left), self.value(node.right)
        try:
            value = self._require_finite(self._combine_operands(node, left, right), node.span)
            factors = {"*": (left, right), "/": (left,), "^": (left, right)}.get(node.operator, ())
            return self._require_no_underflow(
                value, bool(factors) and all(any(value_components(f)) for f in factors), node.span
            )
        except ZeroDivisionError:
            raise self.place.error("E219", node.span, "this divides by zero") from None
        except (OverflowError, ValueError):
            raise self.place.error("E219", node.span, "this has no finite value") from None

    def _combine_operands(self, node: tree.Binary, left: Value, right: Value) -> Value:
        a, b = left.dimension, right.dimension
        match node.operator:
            case "+" | "-" if a == b and len(value_components(left)) == len(value_components(right)):
                sign = 1 if node.operator == "+" else -1
                return _add_components(left, right, sign)
            case "*" if isinstance(right, Quantity):
                return _map_components(lambda c: c * right.value, left, units.multiply_dimensions(a, b))
            case "*" if isinstance(left, Quantity):
                return _map_components(lambda c: c * left.value, right, units.multiply_dimensions(a, b))
            case "/" if isinstance(right, Quantity):
                return _map_components(lambda c: c / right.value, left, units.multiply_dimensions(a, b, -1))
            case "^" if isinstance(left, Quantity) and isinstance(right, Quantity) and b == NONE:
                return self._raise_to_power(node, left, right)
        raise self.report_unlike_operands(node, left, right)

    def report_unlike_operands(self, node: tree.Binary, left: Value, right: Value) -> EvaluationError:
        """Record an error about two operands whose dimensions do not fit each other, and return the error."""
        a, b = describe_value(left), describe_value(right)
        sides = "both sides must have the same dimension; a number without a unit is a plain number"
        problem, help = {
            "+": (f"cannot add {a} and {b}", sides),
            "-": (f"cannot subtract {b} from {a}", sides),
            "*": (f"cannot multiply {a} by {b}", "one of the two must be a single number"),
            "/": (f"cannot divide {a} by {b}", "divide by a single number"),
            "^": (f"cannot raise {a} to the power of {b}", "an exponent is a plain number"),
        }[node.operator]
        return self.place.error("E218", node.span, problem, help=help)

    def _raise_to_power(self, node: tree.Binary, base: Quantity, exponent: Quantity) -> Quantity:
        n = exponent.value
        if base.dimension != NONE and n != int(n):
            raise self.place.error(
                "E218", node.span, "a quantity with a unit can be raised to whole powers only",
                "the unit would have a fractional power",
                "take a square root with `sqrt(...)`, or divide by a unit first: `(L / 1 mm)^0.5`",
            )  # fmt: skip
        if abs(n) > 99 and base.dimension != NONE:
            raise self.place.error("E219", node.span, "the power is too large", "more than 99")
        dimension = units.raise_dimension(base.dimension, int(n)) if base.dimension != NONE else NONE
        value = base.value**n
        if isinstance(value, complex):
            raise ValueError
        return Quantity(value, dimension)

    def _evaluate_call(self, node: tree.Call) -> Value:
        name = node.function.text
        owner = metric_before_at(node) if self.at is not None else None
        self.check_callable(node, known=owner is not None)
        arguments = [self.quantity(a.value) for a in node.arguments]
        if owner is not None and self.at is not None and len(arguments) == 1:
            return self.at(owner, node.arguments[0].value, arguments[0])
        if name in ("min", "max"):
            self.check_equal_dimensions(node, [q.dimension for q in arguments])
            return (min if name == "min" else max)(arguments, key=lambda q: q.value)
        self.check_single_argument(node)
        return self._require_finite(self._apply_function(node, name, arguments[0]), node.span)

    def check_callable(self, node: tree.Call, known: bool = False) -> None:
        """Refuse an unknown function, and a function call without arguments or with named ones. Raises EvaluationError.

        `known` is true if the caller knows the function, although it is not one of FUNCTIONS.
        """
        name = node.function.text
        if name not in FUNCTIONS and name not in SPECIAL and not known:
            raise self._unknown_function_error(node)
        if any(a.name for a in node.arguments) or not node.arguments:
            raise self.place.error("E211", node.span, f"`{name}` takes values without names",
                                  "no value to take",
                                  f"write `{name}(a)`")  # fmt: skip

    def check_single_argument(self, node: tree.Call) -> None:
        """Refuse a call with more than one argument. Raises EvaluationError."""
        if len(node.arguments) != 1:
            name = node.function.text
            raise self.place.error("E211", node.span, f"`{name}` takes one value, found {len(node.arguments)}",
                                  "too many values",
                                  f"write `{name}(a)`")  # fmt: skip

    def _unknown_function_error(self, node: tree.Call) -> EvaluationError:
        name, span, all_functions = node.function.text, node.function.span, [*FUNCTIONS, *SPECIAL]
        listed = "functions: " + ", ".join(all_functions)
        if kinds := [kind for kind, table in self.vocabulary.items() if name in table]:
            found = f"{field_schema.article(kinds[0])} {kinds[0]}"
            if kinds[0] == "amplitude":
                listed = f"give it to a load or a support as a field: `amplitude = {name}(...)`"
            return self.place.error("E203", span, f"`{name}(...)` makes {found}, not a number", found, listed)
        close = None if name in foreign_aliases.FUNCTIONS else nearest(name, all_functions)
        hint = did_you_mean(close) if close else foreign_aliases.FUNCTIONS.get(name) or listed
        return self.place.error("E203", span, f"there is no function `{name}`", "unknown function", hint)

    def check_equal_dimensions(self, node: tree.Call, dimensions: Sequence[Dimension]) -> None:
        """Refuse a function call whose arguments have different dimensions. Raises EvaluationError."""
        due = dimensions[0]
        for dimension, argument in zip(dimensions, node.arguments, strict=True):
            if dimension != due:
                one, other = units.dimension_name(due), units.dimension_name(dimension)
                raise self.place.error("E218", argument.span,
                                      f"`{node.function.text}` cannot compare {one} with {other}",
                                      other,
                                      "give all values the same dimension")  # fmt: skip

    def _apply_function(self, node: tree.Call, name: str, q: Quantity) -> Quantity:
        try:
            if name == "sqrt":
                return self._square_root(q, node.arguments[0].span)
            gives = self.function_dimension(node, q.dimension)
            return Quantity(FUNCTIONS[name][0](q.value), gives)
        except (ValueError, OverflowError):
            shown = units.format_value(q.value, q.dimension)
            raise self.place.error("E219", node.span, f"`{name}` has no finite value for {shown}") from None

    def function_dimension(self, node: tree.Call, dimension: Dimension) -> Dimension:
        """Return the dimension of a function's result from that of its argument. Raises EvaluationError."""
        name = node.function.text
        _, takes, gives = FUNCTIONS[name]
        if takes is not None and dimension != takes:
            found, due = units.dimension_name(dimension), units.dimension_name(takes)
            remedy = f"give it in {units.usual_units(takes)}" if takes != NONE else "divide by a unit"
            help = f"`{name}` takes {due}: {remedy}"
            raise self.place.error("E204", node.arguments[0].span, f"expected {due}, found {found}", found, help)
        return dimension if gives is None else gives

    def _square_root(self, q: Quantity, span: Span) -> Quantity:
        return Quantity(math.sqrt(q.value), self.square_root_dimension(q.dimension, span))

    def square_root_dimension(self, dimension: Dimension, span: Span) -> Dimension:
        """Return the dimension of the square root of a quantity. Raises EvaluationError."""
        if any(n % 2 for n in dimension):
            what = units.dimension_name(dimension)
            raise self.place.error(
                "E218",
                span,
                f"the square root of {what} would have a unit with a fractional power",
                what,
                "take the root of a product of even powers, such as an area",
            )
        return tuple(n // 2 for n in dimension)  # type: ignore[return-value]


def metric_before_at(node: tree.Call) -> tree.Name | None:
    """Return the name `rod.eta` from a call such as `rod.eta.at(12.5 %)`, or None for any other call."""
    parts, span = node.function.parts, node.function.span
    if len(parts) < 2 or parts[-1] != "at":
        return None
    return tree.Name(parts[:-1], replace(span, end=span.end - 3, end_column=span.end_column - 3))


def describe_expression(node: tree.Expression) -> str:
    """Return the form of an expression in words: `a number`, `a text`, `a list`."""
    match node:
        case tree.Call():
            return f"`{node.function.text}(...)`"
        case tree.Name():
            return f"the name `{node.text}`"
        case tree.Unary(operator="not") | tree.Binary(operator="and" | "or") | tree.Compare():
            return "a condition"
        case tree.Unary(operand=tree.Number()):
            return "a number"
        case _:
            return _DESCRIBED.get(type(node), "an expression")


_DESCRIBED: dict[type[object], str] = {
    tree.Number: "a number", tree.String: "a text", tree.Vector: "a vector", tree.List: "a list",
}  # fmt: skip


def describe_value(value: Value) -> str:
    """Return the dimension of a value in words, for messages: `a length`, `a vector of lengths`."""
    one = units.dimension_name(value.dimension)
    if isinstance(value, Quantity):
        return one
    plural = {"a plain number": "plain numbers"}.get(one) or f"{one.split(' ', 1)[1]}s"
    simple = re.fullmatch(r"[a-z ]+", plural) and " or " not in plural and " per " not in plural
    return f"a vector of {plural}" if simple else f"a vector in {units.si_unit(value.dimension)}"


def value_components(value: Value) -> tuple[float, ...]:
    """Return the numbers that a value consists of, in SI units."""
    return (value.value,) if isinstance(value, Quantity) else value.values


def _map_components(f: Callable[[float], float], value: Value, dimension: Dimension) -> Value:
    if isinstance(value, Quantity):
        return Quantity(f(value.value), dimension)
    return VectorValue(tuple(f(v) for v in value.values), dimension)


def _add_components(a: Value, b: Value, sign: int) -> Value:
    if isinstance(a, Quantity) and isinstance(b, Quantity):
        return Quantity(a.value + sign * b.value, a.dimension)
    return VectorValue(
        tuple(x + sign * y for x, y in zip(value_components(a), value_components(b), strict=True)), a.dimension
    )
