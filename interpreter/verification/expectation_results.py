"""Evaluation of the expectations of a scene; in scenes with states, in each state or in the state they name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from softmark.grammar import tree
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Expectation, Scene
from softmark.interpreter.language.expectation_conditions import find_metrics, find_stateless_metrics, is_satisfied
from softmark.interpreter.language.expression_evaluation import (
    EvaluationError,
    Evaluator,
    Quantity,
    SourceErrors,
    Value,
)
from softmark.interpreter.language.scene_states import find_state_indices
from softmark.interpreter.planning.run_plan import names_in_expectation
from softmark.interpreter.results.run_report import ExpectationResult, ModelResult, ReferenceResult
from softmark.interpreter.results.state_results import LEFT_OUT, format_state

Results = Mapping[str, ModelResult | ReferenceResult]


def judge(scene: Scene, results: Results, expectation: Expectation, states: Sequence[float] = ()) -> ExpectationResult:
    """Return whether the results meet an expectation, in every state unless the expectation names one."""
    return replace(_evaluate_in_states(scene, results, expectation, states), about=_named_metrics(expectation))


def _named_metrics(expectation: Expectation) -> tuple[tuple[str, str], ...]:
    """Return the metrics that an expectation names, each with the model or reference it is taken from."""
    return tuple(dict.fromkeys((name.parts[0], name.parts[1]) for name in find_metrics(expectation.node)))


def _evaluate_in_states(
    scene: Scene, results: Results, expectation: Expectation, states: Sequence[float]
) -> ExpectationResult:
    text, line = expectation.text, expectation.location.span.line
    named = names_in_expectation(expectation.node)
    missing = sorted(named - set(results) - set(scene.parameters))
    if missing:
        return ExpectationResult(text, line, None, None, reason=f"{', '.join(missing)} was not run", left_out=True)
    if left := [name for name in sorted(named & set(results)) if results[name].status in LEFT_OUT]:
        reason = "; ".join(f"{name} was not computed ({results[name].status})" for name in left)
        return ExpectationResult(text, line, None, None, reason=reason, left_out=True)
    if not states or all(_needs_all_states(scene, name) for name in find_stateless_metrics(expectation.node)):
        return _evaluate_condition(expectation, _KnownValues(scene, results, states))
    each = [
        _evaluate_condition(expectation, _KnownValues(scene, results, states, number)) for number in range(len(states))
    ]
    return _combine_states(each, states)


def _needs_all_states(scene: Scene, metric: str) -> bool:
    """Return whether a metric is computed from all states together, so that it has a value only in the last state."""
    declared = scene.declared.get(metric)
    return declared is not None and declared.kind == "metric" and declared.thing.of_all_states


def _evaluate_condition(expectation: Expectation, known: _KnownValues) -> ExpectationResult:
    text, line = expectation.text, expectation.location.span.line
    place = SourceErrors(expectation.location.source, [])
    evaluator = Evaluator(place, known.of, known.scene.vocabulary, known.at)
    try:
        passed = is_satisfied(expectation.node, evaluator)
        relations, values = _first_comparison(expectation.node, evaluator)
    except _NoValue as nothing:
        return ExpectationResult(text, line, None, None, reason=str(nothing))
    except EvaluationError as bad:
        return ExpectationResult(text, line, None, None, reason=str(bad))
    if not values:
        return ExpectationResult(text, line, passed, None)
    if not math.isfinite(values[0].value):
        return ExpectationResult(text, line, None, None, reason="its value is not a finite number")
    first, limits = values[0], tuple(v.value for v in values[1:])
    unit = units.si_unit(first.dimension)
    return ExpectationResult(text, line, passed, first.value, unit, relations=relations, limits=limits)


def _combine_states(each: Sequence[ExpectationResult], states: Sequence[float]) -> ExpectationResult:
    """Return the combined result of all states: failed if one fails, else undecided if one has no value, else met.

    The result reports the first state that decided it.
    """
    wrong = [i for i, own in enumerate(each) if own.passed is False]
    open_ = [i for i, own in enumerate(each) if own.passed is None]
    told = (wrong or open_ or [len(each) - 1])[0]
    own, verdicts = each[told], tuple(e.passed for e in each)
    where = ", ".join(format_state(states[i]) for i in wrong or open_)
    several = "states" if len(wrong or open_) > 1 else "state"
    reason = f"in the {several} {where}: {own.reason}" if open_ and not wrong else None
    first = "; the number is for the first" if len(wrong) > 1 else ""
    reason = f"not met in the {several} {where}{first}" if wrong else reason
    return replace(own, reason=reason, states=verdicts)


class _NoValue(Exception):
    """Exception for a metric of an expectation that has no value."""


class _KnownValues:
    """Values of parameters and metrics after the run, optionally in one state."""

    def __init__(self, scene: Scene, results: Results, states: Sequence[float], number: int | None = None) -> None:
        self.scene, self.results, self.states, self.number = scene, results, states, number

    def of(self, name: tree.Name) -> Value:
        """Return the value of a metric or a parameter. Raises _NoValue."""
        if name.text in self.scene.parameters:
            return self.scene.parameters[name.text].value
        return self._metric_value(name, self.number)

    def at(self, name: tree.Name, node: tree.Expression, value: Quantity) -> Value:
        """Return the value of a metric in the state given by `value`, or at that time. Raises _NoValue."""
        if not self.states:
            return self._interpolate_in_time(name, value.value)
        return self._metric_value(name, find_state_indices(self.states, value.value)[0])

    def _interpolate_in_time(self, name: tree.Name, time: float) -> Value:
        """Return the value of a metric at a time, s, by linear interpolation."""
        import numpy as np

        owner, metric = name.parts
        known = self.results[owner].metrics.get(metric)
        if known is None or known.curve is None:
            raise _NoValue(
                f"{name.text} has no values over time" + (f": {known.reason}" if known and known.reason else "")
            )
        value = float(np.interp(time, known.curve.x, known.curve.y))
        return Quantity(value, units.parse_unit(known.unit).dimension)

    def _metric_value(self, name: tree.Name, number: int | None) -> Value:
        owner, metric = name.parts
        number = None if _needs_all_states(self.scene, metric) else number
        result = self.results[owner] if number is None else self.results[owner].each[number]
        known = result.metrics.get(metric)
        if getattr(result, "inverted", 0):
            raise _NoValue(f"cells of {owner} are inverted (W351), so {name.text} has no physical meaning")
        if known is None or known.value is None:
            raise _NoValue(f"{name.text} has no value" + (f": {known.reason}" if known and known.reason else ""))
        return Quantity(known.value, units.parse_unit(known.unit).dimension)


def _first_comparison(node: Any, evaluator: Evaluator) -> tuple[tuple[str, ...], list[Quantity]]:
    """Return the relations of an expectation's first comparison, and the values of its operands."""
    comparison = next((n for n, _ in tree.walk(node) if isinstance(n, tree.Compare)), None)
    if comparison is None:
        return (), []
    return tuple(comparison.operators), [evaluator.quantity(operand) for operand in comparison.operands]
