"""Expectations against results."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from softmark.grammar import tree
from softmark.interpreter.language import units
from softmark.interpreter.language.expectations import truth
from softmark.interpreter.language.expressions import Bad, Evaluator, Place, Quantity, Value
from softmark.interpreter.language.scene import Expectation, Scene
from softmark.interpreter.plan.plan import named_in
from softmark.interpreter.results.report import ExpectationResult, ModelResult, ReferenceResult


def judge(
    scene: Scene, results: Mapping[str, ModelResult | ReferenceResult], expectation: Expectation
) -> ExpectationResult:
    """Whether an expectation is met by the results."""
    text, line = expectation.text, expectation.location.span.line
    missing = sorted(named_in(expectation.node) - set(results) - set(scene.parameters))
    if missing:
        return ExpectationResult(text, line, None, None, reason=f"{', '.join(missing)} was not run", left_out=True)
    place = Place(expectation.location.source, [])
    evaluator = Evaluator(place, lambda name: _known(scene, results, name), scene.vocabulary)
    try:
        passed = truth(expectation.node, evaluator)
        first = _first_value(expectation.node, evaluator)
    except _NoValue as nothing:
        return ExpectationResult(text, line, None, None, reason=str(nothing))
    except Bad as bad:
        return ExpectationResult(text, line, None, None, reason=str(bad))
    if first is not None and not math.isfinite(first.value):
        return ExpectationResult(text, line, None, None, reason="its value is not a finite number")
    return ExpectationResult(
        text, line, passed, first.value if first else None, units.si(first.dimension) if first else ""
    )


class _NoValue(Exception):
    """A metric that an expectation names has no value."""


def _known(scene: Scene, results: Mapping[str, ModelResult | ReferenceResult], name: tree.Name) -> Value:
    """The value of a metric or of a parameter, after the run."""
    if name.text in scene.parameters:
        return scene.parameters[name.text].value
    owner, metric = name.parts
    known = results[owner].metrics.get(metric)
    if known is None or known.value is None:
        raise _NoValue(f"{name.text} has no value" + (f": {known.reason}" if known and known.reason else ""))
    return Quantity(known.value, units.parse(known.unit).dimension)


def _first_value(node: Any, evaluator: Evaluator) -> Quantity | None:
    """What an expectation is about: the first operand of its comparison."""
    comparison = next((n for n, _ in tree.walk(node) if isinstance(n, tree.Compare)), None)
    return evaluator.quantity(comparison.operands[0]) if comparison else None
