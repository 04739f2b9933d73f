"""`10/3 mm`, which is ten over three millimetres, where a third of ten millimetres is due."""

from __future__ import annotations

from softmark.grammar import tree
from softmark.grammar.diagnostic import Fix, Remedy
from softmark.interpreter.language import units


def remedy(node: tree.Expression, text: str, given: units.Dimension, due: units.Dimension) -> Remedy | None:
    """What to write for a number over a quantity in a `text` where one of that quantity's dimension is due, or None."""
    if not (isinstance(node, tree.Binary) and node.operator == "/" and isinstance(node.right, tree.Number)):
        return None
    unit = node.right.unit
    if unit is None or units.parse(unit.text).dimension != due or given != tuple(-power for power in due):
        return None
    instead = f"({text[node.span.start : node.right.span.start]}{node.right.value:.15g}) {unit.text}"
    return Remedy(f"a unit belongs to the number in front of it alone; write `{instead}`", Fix(instead))
