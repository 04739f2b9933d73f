"""Conversion of conditions such as `x <= 0 mm and z > 1 mm` from a syntax tree to a Condition."""

from __future__ import annotations

from collections.abc import Callable

from softmark.grammar import source_layout, tree
from softmark.grammar.diagnostic import Fix, Remedy
from softmark.interpreter.language import quotient_warnings, units
from softmark.interpreter.language.coordinate_conditions import Condition, Term
from softmark.interpreter.language.expression_evaluation import (
    COORDINATES,
    PREDEFINED,
    Evaluator,
    Quantity,
    describe_expression,
)
from softmark.interpreter.language.units import LENGTH, NONE, Dimension

EXPONENTS = (2.0, 3.0, 4.0)
HIGHEST = 8  # largest power of length in a comparison, so that the largest extent does not overflow

Named = Callable[[tree.Name], Condition | str | None]  # condition of a region, the name probably meant, or None


def read_condition(node: tree.Expression, evaluator: Evaluator, named: Named = lambda name: None) -> Condition:
    """Return the condition of an expression; `named` looks up regions by name. Raises EvaluationError."""
    match node:
        case tree.Unary(operator="not", operand=operand):
            return Condition.negation(read_condition(operand, evaluator, named))
        case tree.Binary(operator="and" | "or" as op, left=left, right=right):
            return Condition.junction(
                op, read_condition(left, evaluator, named), read_condition(right, evaluator, named)
            )
        case tree.Compare():
            return _read_comparison(node, evaluator)
        case tree.Name() if isinstance(region := named(node), Condition):
            return region
    help: str | Remedy = "compare a coordinate with a length: `x <= 0 mm`, `x >= L and z > 0 mm`"
    if isinstance(node, tree.Name) and node.text in COORDINATES:
        help = f"compare it with a length: `{node.text} <= 0 mm`"
    elif isinstance(node, tree.Name) and isinstance(meant := named(node), str):
        help = Remedy(f"did you mean the region `{meant}`?", Fix(meant))
    found = describe_expression(node)
    raise evaluator.place.error(
        "E207", node.span, f"expected a condition on the coordinates, found {found}", found, help
    )


def format_condition(node: tree.Expression, evaluator: Evaluator, named: Named = lambda name: None) -> str:
    """Return the text of a condition followed by the values of its names; equal texts mean equal conditions."""
    names = [n for n, _ in tree.walk(node) if isinstance(n, tree.Name) and n.text not in PREDEFINED]
    regions = {name.text: found.said for name in names if isinstance(found := named(name), Condition)}
    values = {name.text: repr(evaluator.lookup(name)) for name in names if name.text not in regions}
    return "; ".join(
        (source_layout.format_on_one_line(node), *(f"{name} = {value}" for name, value in (values | regions).items()))
    )


def _read_comparison(node: tree.Compare, evaluator: Evaluator) -> Condition:
    terms = [_read_term(operand, evaluator) for operand in node.operands]
    if not any(term.varies for term, _ in terms):
        raise evaluator.place.error(
            "E207", node.span, "the condition does not depend on x, y or z", "the same everywhere",
            "compare a coordinate: `x <= 0 mm`",
        )  # fmt: skip
    steps = []
    for i, operator in enumerate(node.operators):
        (a, da), (b, db) = terms[i], terms[i + 1]
        if da != db:
            found, due, right = units.dimension_name(db), units.dimension_name(da), node.operands[i + 1]
            raise evaluator.place.error(
                "E204", right.span, f"expected {due}, found {found}", found,
                quotient_warnings.suggest_quotient(right, evaluator.place.source.text, db, da)
                or f"both sides of `{operator}` must have the same dimension: give {due} in {units.usual_units(da)}",
            )  # fmt: skip
        if abs(da[0]) > HIGHEST:
            raise evaluator.place.error(
                "E218",
                node.span,
                "the powers of lengths in this comparison are too high",
                units.dimension_name(da),
                f"compare powers up to {HIGHEST}",
            )
        steps.append(Condition.comparison(operator, a, b, da[0]))
    return _join_conditions(steps)


def _join_conditions(steps: list[Condition]) -> Condition:
    """Return the conjunction of conditions as a balanced tree, since a comparison may have any number of parts."""
    half = len(steps) // 2
    return (
        Condition.junction("and", _join_conditions(steps[:half]), _join_conditions(steps[half:])) if half else steps[0]
    )


def _read_term(node: tree.Expression, evaluator: Evaluator) -> tuple[Term, Dimension]:
    """Return an arithmetic term that may contain coordinates, and its dimension. Raises EvaluationError."""
    if not _has_coordinate(node):
        q = evaluator.quantity(node)
        return Term.constant(q.value), q.dimension
    match node:
        case tree.Name(parts=(axis,)):
            return Term.coordinate(COORDINATES.index(axis)), LENGTH
        case tree.Unary(operator="+" | "-" as op, operand=operand):
            term, dimension = _read_term(operand, evaluator)
            return (term.negated() if op == "-" else term), dimension
        case tree.Binary(operator="+" | "-" | "*" | "/" | "^"):
            return _combine_terms(node, evaluator)
        case tree.Call(function=tree.Name(parts=("sqrt" | "abs" as name,)), arguments=(argument,)):
            term, dimension = _read_term(argument.value, evaluator)
            halved = evaluator.square_root_dimension(dimension, argument.span) if name == "sqrt" else dimension
            return term.apply_function(name), halved
        case tree.Call():
            raise evaluator.place.error(
                "E203", node.function.span, f"`{node.function.text}` does not apply to coordinates",
                "not in a condition",
                "use only + - * / ^, `sqrt` and `abs` with coordinates",
            )  # fmt: skip
    raise evaluator.place.error(
        "E207", node.span, f"expected a length, found {describe_expression(node)}", describe_expression(node),
        "compare single coordinates, and join comparisons with `and` and `or`",
    )  # fmt: skip


def _combine_terms(node: tree.Binary, evaluator: Evaluator) -> tuple[Term, Dimension]:
    (a, da), (b, db) = _read_term(node.left, evaluator), _read_term(node.right, evaluator)
    match node.operator:
        case "^" if db != NONE or b.varies or b.value not in EXPONENTS:
            raise evaluator.place.error(
                "E218", node.right.span, "a coordinate can only be raised to the power of 2, 3 or 4",
                "another exponent",
                "take a root with `sqrt(...)`",
            )  # fmt: skip
        case "^":
            return a.combine("^", b), units.raise_dimension(da, int(b.value))
        case "*":
            return a.combine("*", b), units.multiply_dimensions(da, db)
        case "/" if b.value == 0.0:
            raise evaluator.place.error("E219", node.span, "this divides by zero")
        case "/":
            return a.combine("/", b), units.multiply_dimensions(da, db, -1)
        case "+" | "-" as op if da == db:
            return a.combine(op, b), da
    raise evaluator.report_unlike_operands(node, Quantity(0.0, da), Quantity(0.0, db))


def _has_coordinate(node: tree.Expression | tree.Argument) -> bool:
    names = (n for n, _ in tree.walk(node) if isinstance(n, tree.Name))
    return any(n.text in COORDINATES for n in names)
