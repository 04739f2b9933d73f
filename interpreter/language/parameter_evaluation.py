"""Evaluation of parameters in the order of their dependencies, whatever their order in the text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import field

from softmark.grammar import tree
from softmark.grammar.diagnostic import Fix, Remedy
from softmark.interpreter.language import field_schema, units
from softmark.interpreter.language.compiled_scene import Location, Parameter
from softmark.interpreter.language.expression_evaluation import (
    EvaluationError,
    SourceErrors,
    Value,
    describe_value,
    value_components,
)
from softmark.interpreter.language.name_scope import Scope
from softmark.interpreter.language.parameter_overrides import Override
from softmark.interpreter.language.scene_sources import Symbol
from softmark.records import dataclass


def evaluate_parameters(scope: Scope, replaced: Mapping[str, Override]) -> None:
    """Fill in `scope.parameters` with the values of all parameters; those in error are reported and None."""
    if scope.known is not None:
        scope.parameters |= {full: value for full, value in scope.known.parameters.items() if scope.is_unchanged(full)}
    order = _Order(scope, replaced)
    for full in order.run():
        symbol = scope.table.symbols[full]
        scope.parameters[full] = None
        if full in order.circular or not isinstance(symbol.node, tree.Param):
            continue
        with suppress(EvaluationError), scope.record_dependencies(full):
            scope.parameters[full] = _Evaluation(scope, full, symbol, symbol.node, replaced.get(full)).run()


# ------------------------------------------------------------------ the order


@dataclass
class _Order:
    """Depth-first search for the evaluation order, without recursion, so that dependency chains may have any length."""

    scope: Scope
    replaced: Mapping[str, Override]
    circular: set[str] = field(default_factory=set)

    def run(self) -> list[str]:
        """Return the names of all parameters with their prefixes, each after its dependencies.

        Circular dependencies are reported.
        """
        done: dict[str, None] = {}
        for name, symbol in self.scope.table.symbols.items():
            if isinstance(symbol.node, tree.Param) and name not in done and name not in self.scope.parameters:
                self._search_depth_first(name, done)
        return list(done)

    def _search_depth_first(self, start: str, done: dict[str, None]) -> None:
        path, entered = (
            [(start, self._find_dependencies(start))],
            {start},
        )  # a list, because a dictionary would be slow to find its last key
        while path:
            last, needs = path[-1]
            need = next(needs, None)
            if need is None:
                path.pop()
                entered.discard(last)
                done[last] = None
            elif need.full in entered:
                self._report_circular_parameters([name for name, _ in path], need)
            elif need.full not in done and need.full not in self.scope.parameters:
                path.append((need.full, self._find_dependencies(need.full)))
                entered.add(need.full)

    def _find_dependencies(self, full: str) -> Iterator[_ParameterDependency]:
        symbol = self.scope.table.symbols[full]
        texts = [(e, symbol.module.place) for e in tree.expressions(symbol.node)]
        if full in self.replaced:
            texts.append((self.replaced[full].node, self.replaced[full].place))
        for expression, place in texts:
            for name in _names_in_expression(expression):
                known = self.scope.table.symbols.get(symbol.module.prefix + name.text)
                if known is not None and isinstance(known.node, tree.Param):
                    yield _ParameterDependency(symbol.module.prefix + name.text, name.span, place)

    def _report_circular_parameters(self, path: list[str], need: _ParameterDependency) -> None:
        members = path[path.index(need.full) :]
        if self.circular.isdisjoint(members):
            shown = [*members, need.full]
            if len(shown) > 8:
                shown[3:-2] = ["..."]
            problem = f"parameters depend on each other in a circle: {' -> '.join(shown)}"
            if len(members) == 1:
                problem = f"the parameter `{need.full}` depends on itself"
            need.place.error(
                "E210",
                need.span,
                problem,
                "closes the circle",
                "give one of these parameters an independent value",
            )
        self.circular.update(members)


@dataclass(frozen=True)
class _ParameterDependency:
    """Dependency of a parameter on another parameter, with its place in the text."""

    full: str
    span: tree.Span
    place: SourceErrors


def _names_in_expression(expression: tree.Expression) -> list[tree.Name]:
    """Return the names in an expression, without function names."""
    parts = [part for part, _ in tree.walk(expression)]
    functions = {id(part.function) for part in parts if isinstance(part, tree.Call)}
    return [part for part in parts if isinstance(part, tree.Name) and id(part) not in functions]


# ------------------------------------------------------------------ one parameter


@dataclass(frozen=True)
class _Evaluation:
    scope: Scope
    full: str
    symbol: Symbol
    node: tree.Param
    override: Override | None

    def run(self) -> Parameter:
        """Return the parameter with its value, checked against its range. Raises EvaluationError."""
        module = self.symbol.module
        value = self.scope.evaluator(module).value(self.node.value)
        interval = self._evaluate_interval(value)
        if self.override is None:
            self._check_range(value, interval, self.node.value, module.place)
            location = Location(module.source, self.node.value.span)
            return Parameter(self.full, value, location.text, location, interval=interval)
        place, node = self.override.place, self.override.node
        new = self.scope.evaluator(module, place).value(node)
        self._check_dimension(value, new, node, place)
        self._check_range(new, interval, node, place)
        location = Location(place.source, node.span)
        return Parameter(self.full, new, location.text, location, overridden=True, interval=interval)

    def _check_dimension(self, value: Value, new: Value, node: tree.Expression, place: SourceErrors) -> None:
        if new.dimension == value.dimension and len(value_components(new)) == len(value_components(value)):
            return
        found, due = describe_value(new), describe_value(value)
        if found == due:
            found, due = (f"{w} with {len(value_components(v))} components" for w, v in ((found, new), (due, value)))
        own = Location(self.symbol.module.source, self.node.value.span).text
        help = f"the scene declares `{self.full} = {own}`; give it in {units.usual_units(value.dimension)}"
        raise place.error("E204", node.span, f"expected {due}, found {found}", found, help)

    def _evaluate_interval(self, value: Value) -> field_schema.Interval | None:
        low, high, place = self.node.low, self.node.high, self.symbol.module.place
        if low is None or high is None:
            return None
        ends = []
        for end in (low, high):
            q = self.scope.evaluator(self.symbol.module).quantity(end)
            if q.dimension != value.dimension:
                found, due = units.dimension_name(q.dimension), units.dimension_name(value.dimension)
                help = (
                    f"a range must have the dimension of its value: give {due} in {units.usual_units(value.dimension)}"
                )
                raise place.error("E204", end.span, f"expected {due}, found {found}", found, help)
            ends.append(q.value)
        if ends[0] > ends[1]:
            own = place.source.text
            turned = f"{own[high.span.start : high.span.end]} .. {own[low.span.start : low.span.end]}"
            raise place.error("E214", tree.span_between(low.span, high.span),
                             "the range is empty: its lower end is above its upper end",
                             "the larger one first", Remedy("write `in LOW .. HIGH`", Fix(turned)))  # fmt: skip
        return field_schema.Interval(ends[0], ends[1], False, False)

    def _check_range(
        self, value: Value, interval: field_schema.Interval | None, node: tree.Expression, place: SourceErrors
    ) -> None:
        outside = [v for v in value_components(value) if interval is not None and v not in interval]
        if interval is None or not outside:
            return
        where = f" that line {self.node.name_span.line} of the scene declares" if self.override else ""
        raise place.error("E214", node.span, f"`{self.full}` must be {interval.words(value.dimension)}",
                         f"this is {units.format_value(outside[0], value.dimension)}",
                         f"give a value in the range{where}, or widen the range")  # fmt: skip
