"""Conversion of constants that vary in space, such as `10 kPa * (1 + z / 5 cm)`, from a syntax tree to a Profile."""

from __future__ import annotations

from typing import Any, Protocol

from softmark.grammar import source_layout, tree
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Location
from softmark.interpreter.language.expression_evaluation import (
    COORDINATES,
    PREDEFINED,
    Evaluator,
    Quantity,
    describe_expression,
    describe_value,
)
from softmark.interpreter.language.field_schema import Field
from softmark.interpreter.language.spatial_profiles import Node, Profile, constant_node
from softmark.interpreter.language.units import LENGTH, NONE, Dimension


class DataFieldAccess(Protocol):
    """Protocol for access to the data fields (values read from files) in an expression."""

    def varies_in_space(self, node: tree.Expression) -> bool:
        """Return whether coordinates or data fields occur in an expression."""

    def known(self, part: tree.Expression | tree.Argument) -> bool:
        """Return whether a part of an expression is a data field, given by a call or by a declared name."""

    def resolve_data_field(self, part: tree.Expression) -> Any:
        """Return the data field that a part of an expression refers to. Raises EvaluationError."""


def read_profile(node: tree.Expression, evaluator: Evaluator, fields: DataFieldAccess, of: Field) -> Profile:
    """Return the spatial profile of an expression for the field `of`. Raises EvaluationError.

    Its values are in SI units of the expression's dimension.
    """
    reader = Reader(evaluator, fields)
    root, dimension = reader.node(node)
    said = "; ".join((source_layout.format_on_one_line(node), *reader.values.values()))
    return Profile(root, said, of.name, dimension, of.interval, Location(evaluator.place.source, node.span))


class Reader:
    """Converter of one expression to profile nodes with their dimensions; `values` are those of its parameters."""

    def __init__(self, evaluator: Evaluator, fields: DataFieldAccess) -> None:
        self.evaluator, self.fields = evaluator, fields
        self.values: dict[str, str] = {}

    def node(self, node: tree.Expression) -> tuple[Node, Dimension]:
        """Return the node and dimension of an expression. Raises EvaluationError."""
        if self.fields.known(node):
            field = self.fields.resolve_data_field(node)
            return Node("field", value=field), field.unit.dimension
        if not self.fields.varies_in_space(node):
            return self._read_constant(node)
        match node:
            case tree.Name(parts=(axis,)):
                return Node("axis", value=COORDINATES.index(axis)), LENGTH
            case tree.Unary(operator="+" | "-" as op, operand=operand):
                part, dimension = self.node(operand)
                return (Node("negated", (part,)) if op == "-" else part), dimension
            case tree.Binary(operator="+" | "-" | "*" | "/" | "^"):
                return self._read_binary(node)
            case tree.Call():
                return self._read_function(node)
        found = describe_expression(node)
        raise self.evaluator.place.error(
            "E207", node.span, f"expected a number, found {found}", found,
            "write a constant that varies as arithmetic of x, y, z and fields: `10 kPa * (1 + z / 5 cm)`",
        )  # fmt: skip

    def _read_constant(self, node: tree.Expression) -> tuple[Node, Dimension]:
        """Return the node of a number, or of arithmetic over numbers and parameters."""
        q = self.evaluator.quantity(node)
        for name, _ in tree.walk(node):
            if isinstance(name, tree.Name) and name.text not in PREDEFINED:
                value = self.evaluator.quantity(name)
                self.values[name.text] = f"{name.text} = {units.format_value(value.value, value.dimension)}"
        return constant_node(q.value), q.dimension

    def _read_binary(self, node: tree.Binary) -> tuple[Node, Dimension]:
        (a, da), (b, db) = self.node(node.left), self.node(node.right)
        both = (a, b)
        match node.operator:
            case "+" | "-" as op if da == db:
                return Node(op, both), da
            case "*":
                return Node("*", both), units.multiply_dimensions(da, db)
            case "/" if b.do == "number" and b.value == 0.0:
                raise self.evaluator.place.error("E219", node.span, "this divides by zero")
            case "/":
                return Node("/", both), units.multiply_dimensions(da, db, -1)
            case "^" if db == NONE and da == NONE:
                return Node("^", both), NONE
            case "^" if db == NONE and b.do == "number" and b.value == int(b.value) and abs(b.value) <= 99:
                return Node("^", both), units.raise_dimension(da, int(b.value))
            case "^" if db == NONE:
                raise self.evaluator.place.error(
                    "E218", node.span, "a quantity with a unit can be raised to whole powers only",
                    describe_value(Quantity(0.0, da)), "divide by a unit first: `(z / 1 mm)^1.7`",
                )  # fmt: skip
        raise self.evaluator.report_unlike_operands(node, Quantity(0.0, da), Quantity(0.0, db))

    def _read_function(self, node: tree.Call) -> tuple[Node, Dimension]:
        name = node.function.text
        self.evaluator.check_callable(node)
        parts = [self.node(a.value) for a in node.arguments]
        made, due = Node(name, tuple(part for part, _ in parts)), parts[0][1]
        if name in ("min", "max"):
            self.evaluator.check_equal_dimensions(node, [dimension for _, dimension in parts])
            return made, due
        self.evaluator.check_single_argument(node)
        if name == "sqrt":
            return made, self.evaluator.square_root_dimension(due, node.arguments[0].span)
        return made, self.evaluator.function_dimension(node, due)
