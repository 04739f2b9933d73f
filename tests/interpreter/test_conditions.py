"""Conditions on coordinates: at points by hand, on arrays against points, and on boxes against sampling."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.parser import parse_expression
from softmark.interpreter.language.condition_syntax import read_condition
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.expression_evaluation import EvaluationError, Evaluator, Quantity, SourceErrors
from softmark.interpreter.language.units import LENGTH
from softmark.interpreter.problem.cross_section_coverage import coverage, coverages
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.solvers.mesh.shapes import Box, Cylinder


def read(text: str) -> tuple[Condition | None, list[Diagnostic]]:
    """A condition, in which L = 0.2 m."""
    found: list[Diagnostic] = []
    node, problems = parse_expression(Source("text", text))
    assert node is not None, problems
    evaluator = Evaluator(SourceErrors(Source("text", text), found), lambda name: Quantity(0.2, LENGTH), CATALOGUE)
    try:
        return read_condition(node, evaluator), found
    except EvaluationError:
        return None, found


def condition(text: str) -> Condition:
    made, found = read(text)
    assert made is not None, found
    return made


# condition, a point (m) where it holds, one where it does not
POINTS = [
    ("x <= 0 mm", (0.0, 1.0, 1.0), (0.001, 0.0, 0.0)),
    ("x < 0 mm", (-0.001, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("0 mm >= x", (0.0, 0.0, 0.0), (0.1, 0.0, 0.0)),
    ("x == L", (0.2, 0.0, 0.0), (0.1, 0.0, 0.0)),
    ("x != L", (0.1, 0.0, 0.0), (0.2, 0.0, 0.0)),
    ("10 mm < x <= 20 mm", (0.02, 0.0, 0.0), (0.01, 0.0, 0.0)),
    ("x <= 0 mm and z > 0 mm", (0.0, 0.0, 0.1), (0.0, 0.0, -0.1)),
    ("x <= 0 mm or z > 0 mm", (0.5, 0.0, 0.1), (0.5, 0.0, -0.1)),
    ("not x <= 0 mm", (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("y^2 + z^2 < (10 mm)^2", (5.0, 0.006, 0.006), (0.0, 0.01, 0.01)),
    ("sqrt(y^2 + z^2) < 10 mm", (5.0, 0.006, 0.006), (0.0, 0.01, 0.01)),
    ("abs(x - L) <= 1 mm", (0.2005, 0.0, 0.0), (0.19, 0.0, 0.0)),
    ("x / L > 0.5", (0.15, 0.0, 0.0), (0.05, 0.0, 0.0)),
    ("2 * x - 3 * y <= L / 2", (0.0, 0.0, 0.0), (0.2, 0.0, 0.0)),
    ("5 mm + x <= 6 mm", (0.001, 0.0, 0.0), (0.002, 0.0, 0.0)),
    ("5 mm - x <= 4 mm", (0.001, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("-x >= 0 mm", (0.0, 0.0, 0.0), (0.1, 0.0, 0.0)),
]


@pytest.mark.parametrize(("text", "inside", "outside"), POINTS, ids=[p[0] for p in POINTS])
def test_points(text: str, inside: tuple[float, float, float], outside: tuple[float, float, float]) -> None:
    made = condition(text)
    assert made.holds(*inside, 1.0)
    assert not made.holds(*outside, 1.0)
    both = np.array([inside, outside]).T
    assert made.holds(*both, 1.0).tolist() == [True, False]


def test_round_off_does_not_lose_a_face() -> None:
    """1e-9 of the extent counts as nothing: 0.1 + 0.2 > 0.3 in floating point, and `x <= 0.3 m` holds."""
    x = 0.1 + 0.2
    assert x > 0.3
    assert condition("x <= 0.3 m").holds(x, 0.0, 0.0, 1.0)
    assert condition("x == 0.3 m").holds(x, 0.0, 0.0, 1.0)
    assert not condition("x > 0.3 m").holds(x, 0.0, 0.0, 1.0)


COORDINATE = st.sampled_from(["x", "y", "z"])
LENGTHS = st.builds(lambda n: f"{n} mm", st.integers(-250, 250)) | st.just("L") | COORDINATE


def _length(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return (
        st.builds(lambda a, o, b: f"({a} {o} {b})", inner, st.sampled_from("+-"), inner)
        | st.builds(lambda k, a: f"({k} * {a})", st.integers(-3, 3), inner)
        | st.builds(lambda a, b: f"({a} / ({b}) * 100 mm)", inner, inner)
        | st.builds(lambda a, n: f"(({a} / 100 mm)^{n} * 10 mm)", inner, st.integers(2, 4))
        | st.builds(lambda a, b: f"sqrt({a} * {b})", inner, inner)
        | st.builds(lambda a: f"abs({a})", inner)
        | st.builds(lambda a: f"(-{a})", inner)
    )


TERM = st.recursive(LENGTHS, _length, max_leaves=5)
COMPARISON = st.builds(lambda a, o, b: f"{a} {o} {b}", TERM, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), TERM)
CONDITION = st.recursive(
    COMPARISON,
    lambda inner: (
        st.builds(lambda a, o, b: f"({a}) {o} ({b})", inner, st.sampled_from(["and", "or"]), inner)
        | st.builds(lambda a: f"not ({a})", inner)
    ),
    max_leaves=3,
)
METRES = st.integers(-200, 200).map(lambda n: n / 1000)
BOUND = st.tuples(METRES, METRES).map(lambda pair: (min(pair), max(pair)))
SHARE = st.sampled_from([0.0, 1.0]) | st.floats(0.0, 1.0)


@pytest.mark.slow
@given(CONDITION, st.tuples(BOUND, BOUND, BOUND), st.lists(st.tuples(SHARE, SHARE, SHARE), min_size=1, max_size=20))
def test_bounds_agree_with_sampling(
    text: str, box: tuple[tuple[float, float], ...], shares: list[tuple[float, ...]]
) -> None:
    """What holds at some point of a box may hold in it, what fails may fail: bounds never claim too much."""
    made, _ = read(text)
    if made is None:
        return  # it depends on no coordinate, or divides by a zero that is written out
    low, high = (tuple(pair[i] for pair in box) for i in (0, 1))
    extent = math.dist(low, high)
    may_fail, may_hold = made.over(low, high)  # type: ignore[arg-type]
    assert may_fail or may_hold
    for share in shares:
        x, y, z = (a + s * (b - a) for a, b, s in zip(low, high, share, strict=True))
        held = bool(made.holds(x, y, z, extent))
        assert may_hold if held else may_fail


@pytest.mark.slow
@pytest.mark.long
@given(CONDITION, st.lists(st.tuples(METRES, METRES, METRES), min_size=1, max_size=20))
def test_arrays_agree_with_points(text: str, points: list[tuple[float, float, float]]) -> None:
    made, _ = read(text)
    if made is None:
        return
    with np.errstate(all="ignore"):  # where a quotient or a power is beyond numbers
        together = np.asarray(made.holds(*np.array(points).T, 0.4))
        single = [bool(made.holds(*map(np.float64, p), 0.4)) for p in points]
    assert np.broadcast_to(together, len(points)).tolist() == single


ERRORS = [
    ("x <= 0", "E204", "0"),
    ("x^2 <= 3 mm", "E204", "3 mm"),
    ("x + 3 <= 0 mm", "E218", "x + 3"),
    ("x^5 <= 0 mm^5", "E218", "5"),
    ("x^y <= 0 mm", "E218", "y"),
    ("sqrt(x) < 1 mm", "E218", "x"),
    ("min(x, y) < 0 mm", "E203", "min"),
    ("sin(x) < 0", "E203", "sin"),
    ("x / 0 < 1 mm", "E219", "x / 0"),
    ("L < 3 mm", "E207", "L < 3 mm"),
    ("x", "E207", "x"),
    ("3 mm", "E207", "3 mm"),
    ("x and y < 3 mm", "E207", "x"),
    ("(x, y) < 3 mm", "E207", "(x, y)"),
    ("(not x) < 3 mm", "E207", "(not x)"),
    ("(x and y) < 3 mm", "E207", "(x and y)"),
    ('"x < 3"', "E207", '"x < 3"'),
    ("x < 3 kpa", "E209", "kpa"),
]


@pytest.mark.parametrize(("text", "code", "place"), ERRORS, ids=[e[0] for e in ERRORS])
def test_error(text: str, code: str, place: str) -> None:
    made, (error,) = read(text)
    assert made is None
    assert error.code == code
    assert error.span is not None
    assert text[error.span.start : error.span.end] == place


SHAPES = [
    Cylinder(0.2, 0.02), Cylinder(0.2, 0.02, (0.0, 0.6, 0.8), (0.1, 0.0, -0.1)),
    Box((0.02, 0.2, 0.03), (0.0, -0.1, 0.0)),
]  # fmt: skip


@pytest.mark.long
@pytest.mark.slow  # sections that a circle nearly touches take seconds
@settings(max_examples=20)
@given(CONDITION, st.sampled_from(SHAPES), st.integers(1, 12))
def test_many_sections_together_as_one_by_one(text: str, shape: Cylinder | Box, count: int) -> None:
    """Slabs of a beam say what its sections say one by one, up to the first section that is cut."""
    made, _ = read(text)
    if made is None:
        return
    stations = [shape.length * i / count for i in range(count + 1)]
    single = {coverage(made, shape, s) for s in stations}
    together = coverages(made, shape, stations)
    assert together == single or ("some" in together and together <= single)


def test_a_hundred_thousand_sections_cost_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """A half-space cuts one slab in two at each step, so that about 2 * 17 slabs decide 2^17 sections."""
    calls = 0
    over = Condition.over

    def counted(self: Condition, *box: object) -> tuple[bool, bool]:
        nonlocal calls
        calls += 1
        return over(self, *box)  # type: ignore[arg-type]

    monkeypatch.setattr(Condition, "over", counted)
    stations = [0.2 * i / 131072 for i in range(131073)]
    assert coverages(condition("x <= 0 mm"), SHAPES[0], stations) == {"all", "none"}
    assert calls < 60


@pytest.mark.parametrize(
    ("text", "plane"),
    [
        ("x <= 2 mm", (1, 0, 0, -2e-3)),
        ("2 * (x - y) / 4 > z + 1 mm", (0.5, -0.5, -1, -1e-3)),
        ("-z < 3 mm", (0, 0, -1, -3e-3)),
        ("x^2 + y^2 <= 4 mm^2", None),
        ("abs(x) == 2 mm", None),
        ("x * y <= 4 mm^2", None),
    ],
)
def test_a_border_that_is_a_plane_is_known_as_one(text: str, plane: tuple[float, ...] | None) -> None:
    (border,) = condition(text).borders
    assert border.plane == (None if plane is None else pytest.approx(plane))


def test_every_comparison_is_a_border() -> None:
    first, second, third = condition("not (x < 1 mm or z >= 2 mm) and sqrt(x^2 + y^2) < 5 mm").borders
    assert (first.plane, second.plane) == (pytest.approx((1, 0, 0, -1e-3)), pytest.approx((0, 0, 1, -2e-3)))
    assert third.at(3e-3, 4e-3, 0.0) == pytest.approx(0.0, abs=1e-18)
    assert third.over((0.0, 0.0, 0.0), (1e-3, 1e-3, 1.0)).high < 0


@pytest.mark.parametrize("text", ["abs(y + 0.3 * z - L) <= 3 mm", "3 mm > abs(y + 0.3 * z - L)",
                                  "abs(y + 0.3 * z - L) >= 3 mm", "3 mm < abs(y + 0.3 * z - L)"])  # fmt: skip
def test_what_lies_beside_a_plane_ends_at_two(text: str) -> None:
    """|t| < c is -c < t < c, of planes, which meshes and cuts follow exactly; it selects what it did, on them as well.

    As one border it was curved, and cut by straight pieces: an oblique layer of 3.4 mm in cells of 5 mm had a sixth too
    much volume, without a word.
    """
    made, plain = condition(text), condition(text.replace("abs(y + 0.3 * z - L)", "sqrt((y + 0.3 * z - L)^2)"))
    assert [border.plane is None for border in made.borders] == [False, False]
    assert [border.plane is None for border in plain.borders] == [True]
    for off in (-0.01, -0.003001, -0.003, -0.002999, 0.0, 0.002999, 0.003, 0.003001, 0.01):
        point = (0.1, 0.2 + off - 0.3 * 0.5, 0.5)
        assert bool(made.holds(*point, 1.0)) is bool(plain.holds(*point, 1.0)), off
    for low in np.linspace(-0.02, 0.02, 9):
        box = (0.0, 0.2 + low - 0.03, 0.1), (0.1, 0.2 + low - 0.025, 0.101)
        assert made.over(*box) == plain.over(*box)


@pytest.mark.parametrize("text", ["abs(x - L) == 1 mm", "abs(x^2 - y^2) <= 1 mm^2", "abs(x) <= y", "abs(x) <= 0 mm"])
def test_other_absolute_values_are_one_border(text: str) -> None:
    assert len(condition(text).borders) == 1
