"""Expectations: conditions on metrics, checked for their dimensions before a run and for their truth after it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from softmark.grammar import tree
from softmark.grammar.suggest import nearest
from softmark.interpreter import units
from softmark.interpreter.expressions import Bad, Evaluator, Quantity, Value, describe
from softmark.interpreter.modules import Module

if TYPE_CHECKING:
    from softmark.interpreter.compile import _Compiler


@dataclass(frozen=True)
class Expectations:
    """Checks the conditions of one scene against the names that it declares."""

    compiler: _Compiler
    module: Module

    def check(self, node: tree.Expression) -> None:
        """Report what is wrong with a condition; raises Bad."""
        truth(node, Evaluator(self.module.place, self._lookup))

    def _lookup(self, name: tree.Name) -> Value:
        """The dimension of `model.metric` (its value is not known yet), or a parameter."""
        table = self.compiler.table.symbols
        kinds = {n: s.node.kind for n, s in table.items() if isinstance(s.node, tree.Declare)}
        if len(name.parts) == 2 and kinds.get(name.parts[0]) in ("model", "reference"):
            return self._metric(name, kinds)
        if kinds.get(name.text) == "metric":
            owners = [n for n, k in kinds.items() if k in ("model", "reference")]
            example = owners[0] if owners else "model"
            raise self.module.place.fail(
                "E216", name.span, f"say of which model `{name.text}` is meant", "a metric of every model",
                f"for example `{example}.{name.text}`",
            )  # fmt: skip
        if len(name.parts) == 2 and name.text not in table and name.parts[0] not in self.module.tree.broken:
            owners = [n for n, k in kinds.items() if k in ("model", "reference")]
            close = nearest(name.parts[0], owners)
            hint = f"did you mean `{close}.{name.parts[1]}`?" if close else "models and references: " + ", ".join(owners)
            raise self.module.place.fail("E201", name.span, f"`{name.parts[0]}` is not declared", "not found", hint)
        return self.compiler.lookup(name, self.module, self.module.place)

    def _metric(self, name: tree.Name, kinds: dict[str, str]) -> Value:
        owner, metric = name.parts
        if kinds.get(metric) != "metric":
            known = [n for n, k in kinds.items() if k == "metric" and "." not in n]
            if metric in self.module.tree.broken:
                raise Bad
            close = nearest(metric, known)
            hint = f"did you mean `{owner}.{close}`?" if close else "metrics: " + (", ".join(known) or "none is declared")
            raise self.module.place.fail("E216", name.span, f"there is no metric `{metric}`", "not a metric", hint)
        declared = self.compiler.declaration(metric)
        if getattr(declared.thing, "against", None) == owner:
            raise self.module.place.fail(
                "E216", name.span, f"`{metric}` is measured against `{owner}` itself", "compares it with itself",
                "expect something of a model or of another reference",
            )  # fmt: skip
        return Quantity(math.nan, units.parse(declared.thing.unit).dimension)


_TESTS: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
}


def truth(node: tree.Expression, evaluator: Evaluator) -> bool:
    """Whether the condition holds; the first operand's value is what a report shows. Raises Bad."""
    match node:
        case tree.Unary(operator="not", operand=operand):
            return not truth(operand, evaluator)
        case tree.Binary(operator="and", left=left, right=right):
            first, second = truth(left, evaluator), truth(right, evaluator)
            return first and second
        case tree.Binary(operator="or", left=left, right=right):
            first, second = truth(left, evaluator), truth(right, evaluator)
            return first or second
        case tree.Compare():
            return _compare(node, evaluator)
    raise evaluator.place.fail(
        "E215", node.span, f"expected a condition, found {describe(node)}", "not a comparison",
        "compare a metric with a value: `expect rod.eta < 5 %`",
    )  # fmt: skip


def _compare(node: tree.Compare, evaluator: Evaluator) -> bool:
    values = [evaluator.quantity(operand) for operand in node.operands]
    for value, operand in zip(values[1:], node.operands[1:], strict=True):
        if value.dimension != values[0].dimension:
            due, found = units.named(values[0].dimension), units.named(value.dimension)
            raise evaluator.place.fail(
                "E204", operand.span, f"expected {due}, found {found}", found,
                f"`{_text(evaluator, node.operands[0])}` is {due}; compare it with {units.usual(values[0].dimension)}",
            )  # fmt: skip
    return all(
        _TESTS[operator](a.value, b.value)
        for a, b, operator in zip(values[:-1], values[1:], node.operators, strict=True)
    )


def _text(evaluator: Evaluator, node: tree.Expression) -> str:
    return evaluator.place.source.text[node.span.start : node.span.end]
