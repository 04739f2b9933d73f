"""Expectations: conditions on metrics; dimensions are checked before a run and truth after it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from softmark.grammar import tree
from softmark.grammar.diagnostic import Fix, Remedy, did_you_mean
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language import field_schema, units
from softmark.interpreter.language.expression_evaluation import (
    EvaluationError,
    Evaluator,
    Quantity,
    SourceErrors,
    Value,
    describe_expression,
    metric_before_at,
)
from softmark.interpreter.language.scene_sources import Module
from softmark.interpreter.language.scene_states import find_state_indices
from softmark.interpreter.results.state_results import TimeState, format_state
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiler import Compiler

OWNERS = ("model", "reference")  # kinds that have metrics


@dataclass(frozen=True)
class Expectations:
    """Checker of the expectations of one scene against the names that it declares."""

    compiler: Compiler
    module: Module

    def check(self, node: tree.Expression) -> None:
        """Report all errors in a condition. Raises EvaluationError."""
        broken: EvaluationError | None = None
        for part in _split_comparisons(node):
            try:
                is_satisfied(
                    part, Evaluator(self.place, self._lookup, self.compiler.table.vocabulary, self._lookup_in_state)
                )
            except EvaluationError as bad:
                broken = bad
        if broken is not None:
            raise broken

    @property
    def place(self) -> SourceErrors:
        """Source text of the scene, to which errors point."""
        return self.module.place

    @cached_property
    def _kinds_by_name(self) -> Mapping[str, str]:
        """Kind of each declared name, by name."""
        symbols = self.compiler.table.symbols
        return {n: s.node.kind for n, s in symbols.items() if isinstance(s.node, tree.Declare)}

    def _names_of_kinds(self, *kinds: str) -> list[str]:
        return [n for n, k in self._kinds_by_name.items() if k in kinds and "." not in n]

    def _list_known_names(self, *kinds: str) -> str:
        return field_schema.join_names(self._names_of_kinds(*kinds)) or "none is declared"

    def _lookup(self, name: tree.Name) -> Value:
        """Return an unknown value with the dimension of `model.metric`, or the value of a parameter."""
        table = self.compiler.table
        if table.is_broken(name.parts[0]):
            raise EvaluationError  # reported where it is declared
        symbol = table.symbols.get(name.text)
        if symbol is not None and isinstance(symbol.node, tree.Param):
            return self.compiler.scope.lookup(name, self.module, self.place)
        owner = self._kinds_by_name.get(name.parts[0], "")
        if len(name.parts) == 1:
            raise self._report_undotted_name(name, owner)
        if owner in OWNERS:
            return self._lookup_metric(name)
        if owner:
            problem = f"`{name.parts[0]}` is {field_schema.article(owner)} {owner}, which has no metrics"
            raise self.place.error("E216", name.span, problem, "not a model",
                                  f"models and references have them: {self._list_known_names(*OWNERS)}")  # fmt: skip
        if name.parts[0] in table.aliases:
            raise self.place.error("E216", name.span,
                                  "a scene that is used provides its declarations, not its results",
                                  "not computed here",
                                  "declare the model in this scene")  # fmt: skip
        close = nearest(name.parts[0], self._names_of_kinds(*OWNERS))
        hint: str | Remedy = f"models and references: {self._list_known_names(*OWNERS)}"
        if close:
            hint = did_you_mean(".".join((close, *name.parts[1:])))
        raise self.place.error("E201", name.span, f"`{name.parts[0]}` is not declared", "not found", hint)

    def _lookup_in_state(self, name: tree.Name, node: tree.Expression, value: Quantity) -> Value:
        """Return an unknown value with the dimension of a metric in one state, as in `model.metric.at(12.5 %)`.

        The analysis must have that state exactly once. Raises EvaluationError.
        """
        found, states = self._lookup(name), self._analysis_states()
        if not states and (end := self._end_time()) is not None and name.text not in self.compiler.table.symbols:
            self._check_recorded_over_time(name, node, value, end)
            return found
        timed = any(isinstance(state, TimeState) for state in states)
        if value.dimension != (units.TIME if timed else units.NONE):
            what, due = units.dimension_name(value.dimension), "a time" if timed else "a plain number"
            known = "a time: `.at(5 s)`" if timed else "a fraction of the full load: `.at(12.5 %)`"
            raise self.place.error("E204", node.span, f"expected {due}, found {what}", what,
                                  f"give a state by its value, {known}")  # fmt: skip
        own = name.text in self.compiler.table.symbols
        if not own and self.compiler.declaration(name.parts[1]).thing.of_all_states:
            raise self.place.error(
                "E313",
                node.span,
                f"`{name.text}` is computed from all states",
                "not from one state",
                "remove `.at(...)`",
            )
        if own or not states:
            problem = f"`{name.text}` has no states" if states else "the analysis has no states"
            raise self.place.error("E313", node.span, problem, "no states",
                                  "remove `.at(...)`, or add states to the analysis: `static(states = [5, 12.5] %)`",
                                  )  # fmt: skip
        if len(chosen := find_state_indices(states, value.value)) != 1:
            shown = format_state(TimeState(value.value) if timed else value.value)
            listed = ", ".join(map(format_state, states))
            problem = f"the analysis has no state {shown}" if not chosen else f"the state {shown} occurs twice"
            raise self.place.error("E313", node.span, problem, "which state?", f"its states are {listed}")
        return found

    def _analysis_states(self) -> tuple[float, ...]:
        """Return the states of the analysis. Raises EvaluationError if the analysis has an error."""
        own = self._names_of_kinds("analysis")
        known = self.compiler.declaration(own[0]).thing.situations if own else None
        return () if known is None else tuple(known)

    def _end_time(self) -> float | None:
        """Return the end time of a dynamic analysis, s; None for other analyses.

        Raises EvaluationError if the analysis has an error.
        """
        own = self._names_of_kinds("analysis")
        thing = self.compiler.declaration(own[0]).thing if own else None
        return getattr(thing, "duration", None) if getattr(thing, "moving", False) else None

    def _check_recorded_over_time(self, name: tree.Name, node: tree.Expression, value: Quantity, end: float) -> None:
        """Check that a metric at a time of a dynamic analysis is recorded over time. Raises EvaluationError."""
        if value.dimension != units.TIME:
            found = units.dimension_name(value.dimension)
            raise self.place.error("E204", node.span, f"expected a time, found {found}", found,
                                  "give a time of the dynamic analysis: `.at(5 ms)`")  # fmt: skip
        if not self.compiler.declaration(name.parts[1]).thing.in_time:
            raise self.place.error("E313", node.span, f"`{name.text}` has one value in a dynamic analysis",
                                  "no time history", "remove `.at(...)`; only contact metrics without `over` "
                                                            "and `against` have a value at each time")  # fmt: skip
        if not 0.0 <= value.value <= end:
            raise self.place.error(
                "E313",
                node.span,
                f"the analysis has no time {format_state(TimeState(value.value))}",
                "after its end",
                f"it goes from 0 s to {format_state(TimeState(end))}",
            )

    def _report_undotted_name(self, name: tree.Name, kind: str) -> EvaluationError:
        """Report a name without a dot that is not a parameter, and return the error."""
        metrics, owners = self._names_of_kinds("metric"), self._names_of_kinds(*OWNERS)
        example = f"{owners[0] if owners else 'model'}.{metrics[0] if metrics else 'metric'}"
        if kind == "metric":
            example = f"{owners[0] if owners else 'model'}.{name.text}"
            return self.place.error(
                "E216",
                name.span,
                f"the metric `{name.text}` is given without a model",
                "of which model?",
                Remedy(f"write, for example, `{example}`", Fix(example) if len(owners) == 1 else None),
            )
        if kind:
            problem = f"expected a number, found the {kind} `{name.text}`"
            remedy = f"compare a metric of a model, such as `{example}`"
            return self.place.error("E213", name.span, problem, f"{field_schema.article(kind)} {kind}", remedy)
        try:
            self.compiler.scope.lookup(name, self.module, self.place)
        except EvaluationError as bad:
            return bad
        return EvaluationError("has a value after all")

    def _lookup_metric(self, name: tree.Name) -> Value:
        owner, metric = name.parts[0], ".".join(name.parts[1:])
        if self._kinds_by_name.get(metric) != "metric" or "." in metric:
            raise self._report_unknown_metric(name, owner, metric)
        thing = self.compiler.declaration(metric).thing
        if thing.measured_from == owner:
            raise self.place.error(
                "E216", name.span, f"`{metric}` is an error relative to `{owner}` itself", "always zero",
                "name a model, or another reference",
            )  # fmt: skip
        return Quantity(math.nan, units.parse_unit(thing.unit).dimension)

    def _report_unknown_metric(self, name: tree.Name, owner: str, metric: str) -> EvaluationError:
        if self.compiler.table.is_broken(metric):
            return EvaluationError()
        close = nearest(metric, self._names_of_kinds("metric"))
        hint = did_you_mean(f"{owner}.{close}") if close else f"metrics: {self._list_known_names('metric')}"
        found, problem = self._kinds_by_name.get(metric), f"there is no metric `{metric}`"
        if found:
            problem = f"`{metric}` is {field_schema.article(found)} {found}, not a metric"
        return self.place.error("E216", name.span, problem, "not a metric", hint)


def find_metrics(node: tree.Expression) -> Iterator[tree.Name]:
    """Yield each `model.metric` that an expectation names, with or without a state."""
    for part, _ in tree.walk(node):
        name = metric_before_at(part) if isinstance(part, tree.Call) else part
        if isinstance(name, tree.Name) and len(name.parts) == 2:
            yield name


def find_stateless_metrics(node: tree.Expression) -> Iterator[str]:
    """Yield the metrics that an expectation names without a state."""
    for part, _ in tree.walk(node):
        if isinstance(part, tree.Name) and len(part.parts) == 2:
            yield part.parts[1]


def _split_comparisons(node: tree.Expression) -> Iterator[tree.Expression]:
    """Yield the comparisons that `and`, `or` and `not` join in an expression."""
    match node:
        case tree.Unary(operator="not", operand=operand):
            yield from _split_comparisons(operand)
        case tree.Binary(operator="and" | "or", left=left, right=right):
            yield from _split_comparisons(left)
            yield from _split_comparisons(right)
        case _:
            yield node


_TESTS: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
}


def is_satisfied(node: tree.Expression, evaluator: Evaluator) -> bool:
    """Return whether the condition holds. Raises EvaluationError."""
    match node:
        case tree.Unary(operator="not", operand=operand):
            return not is_satisfied(operand, evaluator)
        case tree.Binary(operator="and", left=left, right=right):
            first, second = is_satisfied(left, evaluator), is_satisfied(right, evaluator)
            return first and second
        case tree.Binary(operator="or", left=left, right=right):
            first, second = is_satisfied(left, evaluator), is_satisfied(right, evaluator)
            return first or second
        case tree.Compare():
            return _is_comparison_satisfied(node, evaluator)
    raise evaluator.place.error(
        "E215", node.span, f"expected a comparison, found {describe_expression(node)}", "not a comparison",
        "compare a metric with a value: `expect rod.eta < 5 %`",
    )  # fmt: skip


def _is_comparison_satisfied(node: tree.Compare, evaluator: Evaluator) -> bool:
    values = [evaluator.quantity(operand) for operand in node.operands]
    for value, operand in zip(values[1:], node.operands[1:], strict=True):
        if value.dimension != values[0].dimension:
            due, found = units.dimension_name(values[0].dimension), units.dimension_name(value.dimension)
            named = values[0].dimension in units.NAMES  # for another dimension, its name is its unit
            given = f"{due} in {units.usual_units(values[0].dimension)}" if named else due
            if values[0].dimension == units.NONE:
                given = "a plain number or a percentage"
            raise evaluator.place.error(
                "E204", operand.span, f"expected {due}, found {found}", found,
                f"`{_operand_text(evaluator, node.operands[0])}` is {due}; compare it with {given}",
            )  # fmt: skip
    return all(
        _TESTS[operator](a.value, b.value)
        for a, b, operator in zip(values[:-1], values[1:], node.operators, strict=True)
    )


def _operand_text(evaluator: Evaluator, node: tree.Expression) -> str:
    return evaluator.place.source.text[node.span.start : node.span.end]
