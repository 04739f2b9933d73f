"""Remedy for quotients such as `10/3 mm`, which is ten over three millimetres and not 10/3 of a millimetre."""

from __future__ import annotations

from typing import Protocol

from softmark.grammar import tree
from softmark.grammar.diagnostic import Fix, Remedy, Source
from softmark.grammar.parser import parse_expression
from softmark.interpreter.language import units

RULE = "a unit applies only to the number in front of it"


class NamedExpression(Protocol):
    """Protocol of a parameter: its name, and the expression from which its value was computed."""

    @property
    def name(self) -> str: ...

    @property
    def text(self) -> str: ...


def suggest_quotient(
    node: tree.Expression, text: str, given: units.Dimension, due: units.Dimension, named: NamedExpression | None = None
) -> Remedy | None:
    """Return the remedy for a quotient whose dimension is the inverse of the expected one, `due`; else None.

    If the node is the name of a parameter, the remedy concerns the expression of its value.
    """
    if given != tuple(-power for power in due):
        return None
    if named is None:
        instead = _guess_intended_quotient(node, text, due)
        return None if instead is None else Remedy(f"{RULE}; write `{instead}`", Fix(instead))
    value, _ = parse_expression(Source(named.name, named.text))
    instead = None if value is None else _guess_intended_quotient(value, named.text, due)
    return None if instead is None else Remedy(f"{RULE}; write `{named.name} = {instead}`")


def _guess_intended_quotient(node: tree.Expression, text: str, due: units.Dimension) -> str | None:
    if isinstance(node, tree.Unary) and node.operator in "+-":
        inner = _guess_intended_quotient(node.operand, text, due)
        return None if inner is None else f"{node.operator}{inner}"
    if not (isinstance(node, tree.Binary) and node.operator == "/" and isinstance(node.right, tree.Number)):
        return None
    unit = node.right.unit
    if unit is None or units.parse_unit(unit.text).dimension != due:
        return None
    return f"({text[node.left.span.start : node.right.span.start]}{node.right.value:.15g}) {unit.text}"
