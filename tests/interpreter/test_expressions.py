"""Arithmetic with dimensions: values against arithmetic by hand, and one error for what has no value."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.parser import parse_expression
from softmark.interpreter.language import units
from softmark.interpreter.language.expression_evaluation import (
    FUNCTIONS,
    EvaluationError,
    Evaluator,
    Quantity,
    SourceErrors,
    Value,
    VectorValue,
)
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.validation.scene_loader import load_scene

NAMES = {"L": Quantity(0.178, units.LENGTH), "n": Quantity(3.0, units.NONE), "v": VectorValue((1.0, 2.0), units.LENGTH)}


def evaluate(text: str) -> tuple[Value | None, list[Diagnostic]]:
    """The value of an expression in which L = 178 mm, n = 3 and v = (1, 2) m, and what is wrong with it."""
    found: list[Diagnostic] = []
    node, problems = parse_expression(Source("text", text))
    assert node is not None, problems
    try:
        value: Value | None = Evaluator(
            SourceErrors(Source("text", text), found), lambda name: NAMES[name.text], CATALOGUE
        ).value(node)
    except EvaluationError:
        value = None
    assert (value is None) == bool(found)
    return value, found


# expression, its value in SI, its unit; the tolerance is that of a few roundings
VALUES = [
    ("178 mm", 0.178, "m"),
    ("5 %", 0.05, "1"),
    ("2 * L + 5 mm", 0.361, "m"),
    ("L - 8 cm", 0.098, "m"),
    ("L / 2 / n", 0.178 / 6, "m"),
    ("L / 1 mm", 178.0, "1"),
    ("60 kPa * 1 m^2", 6e4, "N"),
    ("9.81 m/s^2 * 1070 kg/m^3", 9.81 * 1070, "N/m^3"),
    ("-2^2", -4.0, "1"),
    ("(-2)^2", 4.0, "1"),
    ("2^3^2", 512.0, "1"),
    ("(2 mm)^3", 8e-9, "m^3"),
    ("2^-1", 0.5, "1"),
    ("2^0.5", math.sqrt(2), "1"),
    ("(2 s)^-2", 0.25, "s^-2"),
    ("sqrt(4 mm^2)", 2e-3, "m"),
    ("sqrt(2)", math.sqrt(2), "1"),
    ("abs(-3 mm)", 3e-3, "m"),
    ("sin(30 deg)", 0.5, "1"),
    ("cos(pi * 1 rad)", -1.0, "1"),
    ("tan(45 deg)", 1.0, "1"),
    ("exp(1)", math.e, "1"),
    ("log(exp(2))", 2.0, "1"),
    ("min(3 mm, 2 cm, L)", 3e-3, "m"),
    ("max(3, n, 2)", 3.0, "1"),
    ("pi", math.pi, "1"),
    ("pi / 180 * 1 rad", math.pi / 180, "rad"),
    ("+L", 0.178, "m"),
    ("1e-3 m", 1e-3, "m"),
]


@pytest.mark.parametrize(("text", "value", "unit"), VALUES, ids=[v[0] for v in VALUES])
def test_value(text: str, value: float, unit: str) -> None:
    found, _ = evaluate(text)
    assert isinstance(found, Quantity)
    assert found.dimension == units.parse_unit(unit).dimension
    assert found.value == pytest.approx(value, rel=1e-13)


VECTORS = [
    ("(1, 2, 3) mm", (1e-3, 2e-3, 3e-3), "m"),
    ("(L, 0, 0) mm", (0.178, 0.0, 0.0), "m"),  # the unit belongs to the plain numbers
    ("(1 m, 2 cm)", (1.0, 0.02), "m"),
    ("2 * (1, 2)", (2.0, 4.0), "1"),
    ("(1, 2) * 3 N", (3.0, 6.0), "N"),
    ("(2, 4) m / 2 s", (1.0, 2.0), "m/s"),
    ("v + (1, 1) mm", (1.001, 2.001), "m"),
    ("-v", (-1.0, -2.0), "m"),
    ("v - v", (0.0, 0.0), "m"),
]


@pytest.mark.parametrize(("text", "values", "unit"), VECTORS, ids=[v[0] for v in VECTORS])
def test_vector(text: str, values: tuple[float, ...], unit: str) -> None:
    found, _ = evaluate(text)
    assert isinstance(found, VectorValue)
    assert found.dimension == units.parse_unit(unit).dimension
    assert found.values == pytest.approx(values, rel=1e-13)


# expression, code, what is underlined
ERRORS = [
    ("3 mm + 2", "E218", "3 mm + 2"),
    ("3 mm - 2 kPa", "E218", "3 mm - 2 kPa"),
    ("(1, 2) + (1, 2, 3)", "E218", "(1, 2) + (1, 2, 3)"),
    ("(1, 2) * (1, 2)", "E218", "(1, 2) * (1, 2)"),
    ("1 / (1, 2)", "E218", "1 / (1, 2)"),
    ("2^(1 m)", "E218", "2^(1 m)"),
    ("(2 m)^0.5", "E218", "(2 m)^0.5"),
    ("(2 m)^100", "E219", "(2 m)^100"),
    ("sqrt(L)", "E218", "L"),
    ("min(L, 3)", "E218", "3"),
    ("(1 m, 2 s)", "E218", "2 s"),
    ("sin(30)", "E204", "30"),
    ("exp(L)", "E204", "L"),
    ("1 / 0", "E219", "1 / 0"),
    ("0^-1", "E219", "0^-1"),
    ("(-1)^0.5", "E219", "(-1)^0.5"),
    ("sqrt(-1)", "E219", "sqrt(-1)"),
    ("log(0)", "E219", "log(0)"),
    ("exp(1000)", "E219", "exp(1000)"),
    ("1e300 * 1e300", "E219", "1e300 * 1e300"),
    ("1e308 + 1e308", "E219", "1e308 + 1e308"),
    ("1e308 GPa", "E219", "1e308 GPa"),
    ("(1e300, 1) * 1e300", "E219", "(1e300, 1) * 1e300"),
    ("3 kpa", "E209", "kpa"),
    ('"3 mm"', "E207", '"3 mm"'),
    ("[1, 2]", "E207", "[1, 2]"),
    ("1 < 2", "E207", "1 < 2"),
    ("not 1 < 2", "E207", "not 1 < 2"),
    ("yes", "E207", "yes"),
    ("x", "E213", "x"),
    ("foo(3)", "E203", "foo"),
    ("cylinder(3)", "E203", "cylinder"),
    ("sqrt()", "E211", "sqrt()"),
    ("sqrt(1, 2)", "E211", "sqrt(1, 2)"),
    ("sqrt(a = 1)", "E211", "sqrt(a = 1)"),
    ("sin((1, 2))", "E207", "(1, 2)"),
]


@pytest.mark.parametrize(("text", "code", "place"), ERRORS, ids=[e[0] for e in ERRORS])
def test_error(text: str, code: str, place: str) -> None:
    _, (error,) = evaluate(text)
    assert error.code == code
    assert error.span is not None
    assert text[error.span.start : error.span.end] == place


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.sampled_from("+-*"))
def test_arithmetic_is_that_of_python(a: float, b: float, operator: str) -> None:
    """Units aside, the same operations on the same numbers give the same bits; a product that is lost is refused."""
    found, errors = evaluate(f"({a!r}) {operator} ({b!r})")
    if operator == "*" and a and b and not a * b:
        assert [error.code for error in errors] == ["E219"]
        return
    assert isinstance(found, Quantity)
    assert found.value == {"+": a + b, "-": a - b, "*": a * b}[operator]


UNIT = st.sampled_from(["", " m", " mm", " kPa", " s", " deg", " %", " kg/m^3"])
ATOM = st.builds(lambda n, u: f"{n}{u}", st.integers(0, 9), UNIT) | st.sampled_from(["L", "n", "v", "pi", "(1, 2) mm"])


def _grown(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    joined = st.builds(lambda a, o, b: f"({a}) {o} ({b})", inner, st.sampled_from("+-*/^"), inner)
    called = st.builds(lambda f, a: f"{f}({a})", st.sampled_from([*FUNCTIONS, "sqrt", "min", "max"]), inner)
    return joined | called


@given(st.recursive(ATOM, _grown, max_leaves=8))
def test_every_expression_has_a_finite_value_or_one_error(text: str) -> None:
    value, found = evaluate(text)
    if value is None:
        assert len(found) == 1
    else:
        numbers = (value.value,) if isinstance(value, Quantity) else value.values
        assert all(math.isfinite(v) for v in numbers)


def test_reading_never_runs_code(tmp_path: Path) -> None:
    """Names and calls of Python mean nothing here, and are errors."""
    marker = tmp_path / "written"
    for text in (
        f'open("{marker}", "w")',
        f'__import__("os").system("touch {marker}")',
        f'exec("open({str(marker)!r}, 1)")',
    ):
        scene, found = load_scene(Source("text", f"param a = {text}\n"), tmp_path, None)
        assert scene is None
        assert found
    assert list(tmp_path.iterdir()) == []
