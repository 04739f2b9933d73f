"""Every construct of the language, and the places that the tree remembers."""

from __future__ import annotations

from typing import Any

import pytest

from softmark.grammar.diagnostic import Source
from softmark.grammar.parser import parse, parse_expression
from softmark.grammar.tree import (
    Argument,
    Binary,
    Call,
    Compare,
    Declare,
    Expect,
    Expression,
    List,
    Name,
    Number,
    Param,
    Span,
    String,
    Title,
    Tree,
    Unary,
    Unit,
    Use,
    Vector,
    Version,
    children,
    expressions,
    walk,
)

NOWHERE = Span(0, 0, 1, 1, 1, 1)

EXPERIMENT = """\
scene "Silicone beam sagging under its own weight"

param L = 178 mm
param R = 19 mm
param h = 5 mm            # target edge length of the meshes

material silicone = linear_elastic(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body     beam     = solid(cylinder(length = L, radius = R, axis = +x), silicone)
support  wall     = fixed(beam, where = x <= 0 mm)
load     weight   = gravity(9.81 m/s^2, direction = -z)
analysis sag      = static()

model linear_tet  = fem(tet4, strain = small,        size = h)
model corot_tet   = fem(tet4, strain = corotational, size = h)
model corot_hex   = fem(hex8, strain = corotational, size = h)
model rod         = beam6dof(segments = 20)
model springs     = mass_spring(size = h, stiffness = calibrated)

reference theory  = elastica(beam)               # large-deflection Bernoulli-Euler, from the scene itself
reference scan    = surface("silicone-beam.ply") # what the CT scanner saw

probe  axis       = line(beam, from = (0, 0, 0) mm, to = (L, 0 mm, 0 mm), points = 41)
metric eta        = relative_l2_error(axis, against = theory)
metric gap        = surface_distance(beam, against = scan)
metric frame      = realtime_factor(rate = 25 Hz)

expect rod.eta < 5 %
expect linear_tet.eta > 40 %     # small strain cannot follow a large rotation
"""

SHARING = """\
use "std/tissues.scene" as tissue                 # names arrive as tissue.liver, tissue.brain …
param nu = 0.49 in 0 .. 0.49999                   # a range makes a wrong override an error

study refine  = sweep(h, over = [10, 5, 2.5, 1.25] mm)
study order   = convergence(eta, over = refine)   # observed order, Richardson value, GCI
study trade   = pareto(error = eta, cost = frame, over = refine)
study extreme = robustness(over = [nu, weight.magnitude], until = failure)
"""

TIME = """\
analysis drop = dynamic(duration = 1 s, step = 1 ms, integrator = newmark)
load push     = traction(beam, where = x >= L, vector = (0, 0, -200) Pa * ramp(over = 0.5 s))
probe  tip    = point(beam, at = (L, 0 mm, 0 mm))   # a history in a dynamic analysis
"""


def parsed(text: str) -> Tree:
    tree, diagnostics = parse(Source("test.scene", text))
    assert diagnostics == []
    return tree


def value(text: str) -> Expression:
    expression, diagnostics = parse_expression(Source("<test>", text))
    assert diagnostics == []
    assert expression is not None
    return expression


def number(text: str, unit: str | None = None) -> Number:
    return Number(float(text), Unit(unit, NOWHERE) if unit else None, text, NOWHERE)


def name(text: str) -> Name:
    return Name(tuple(text.split(".")), NOWHERE)


def binary(left: Expression, operator: Any, right: Expression) -> Binary:
    return Binary(operator, left, right, NOWHERE)


@pytest.mark.parametrize(
    ("text", "count", "comments"),
    [(EXPERIMENT, 22, 4), (SHARING, 6, 3), (TIME, 3, 1)],
    ids=["paper", "sharing", "time"],
)
def test_the_scenes_of_the_language_parse(text: str, count: int, comments: int) -> None:
    tree = parsed(text)
    assert (len(tree.declarations), len(tree.comments)) == (count, comments)


@pytest.mark.parametrize("text", ["", "\n\n", "# only\n# comments", "   ", "\ufeff", "\ufeff# x\r\n"])
def test_an_empty_scene_is_an_empty_tree(text: str) -> None:
    assert parsed(text).declarations == ()


def test_declarations() -> None:
    tree = parsed(
        'softmark 1\nscene "A \\"title\\""\nuse "std/a.scene" as a\nparam h = 5 mm\n'
        "param nu = 0.49 in 0 .. L - 1\nexpect a\nbody b = c\n"
    )
    low, high = number("0"), binary(name("L"), "-", number("1"))
    assert tree.declarations == (
        Version(1, NOWHERE),
        Title('A "title"', NOWHERE),
        Use("std/a.scene", "a", NOWHERE, NOWHERE, NOWHERE),
        Param("h", number("5", "mm"), None, None, NOWHERE, NOWHERE),
        Param("nu", number("0.49"), low, high, NOWHERE, NOWHERE),
        Expect(name("a"), NOWHERE),
        Declare("body", "b", name("c"), NOWHERE, NOWHERE, NOWHERE),
    )


FIELDS = "where from to over on at size axis length time until against with for if let import material body load"


@pytest.mark.parametrize("field", FIELDS.split())
def test_any_other_word_is_a_name(field: str) -> None:
    tree = parsed(f"param {field} = 3 mm\nbody b = f({field}, {field} = {field}.{field})\nbody {field} = {field}\n")
    assert isinstance(tree.declarations[0], Param)
    assert tree.declarations[0].name == field


def test_after_a_dot_any_word_is_a_name() -> None:
    assert value("rod.in.and.scene") == name("rod.in.and.scene")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("60 kPa", number("60", "kPa")),
        ("120mm", number("120", "mm")),
        ("5 %", number("5", "%")),
        ("5%", number("5", "%")),
        ("1070 kg/m^3", number("1070", "kg/m^3")),
        ("3 µm", number("3", "µm")),
        ("3 μm", number("3", "μm")),
        ("1 N*m", number("1", "N*m")),
        ("4 s^-1", number("4", "s^-1")),
        ("4 J/(kg*K)", number("4", "J/(kg*K)")),
        ("37 °C", number("37", "°C")),
        ("2 m^0.5", number("2", "m^0.5")),
        ("5 cmH2O", number("5", "cmH2O")),
        ("1e3eV", number("1e3", "eV")),
        ("5\u00a0mm", number("5", "mm")),
        (".5", number(".5")),
        ("5.", number("5.")),
        ("1e-3", number("1e-3")),
        ("2.5E6", number("2.5E6")),
        ("0", number("0")),
        ("0e999", number("0e999")),
    ],
)
def test_quantities(text: str, expected: Number) -> None:
    found = value(text)
    assert found == expected
    assert isinstance(found, Number)
    assert found.text == expected.text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("(0, 0, -9.81) m/s^2", "m/s^2"),
        ("(0, 0,-9.81,)m/s^2", "m/s^2"),
        ("[10, 5] mm", "mm"),
        ("[10, 5,]mm", "mm"),
        ("[1] mm", "mm"),
        ("[]", None),
        ("[1\n,2\n]", None),
    ],
)
def test_vectors_and_lists_take_a_unit(text: str, expected: str | None) -> None:
    found = value(text)
    assert isinstance(found, Vector if text.startswith("(") else List)
    assert (found.unit.text if found.unit else None) == expected


@pytest.mark.parametrize("text", ["3\nmm", "[1, 2]\nmm", "(1, 2)\nmm"], ids=["number", "list", "vector"])
def test_a_unit_stands_on_the_line_of_its_number(text: str) -> None:
    assert parse_expression(Source("<test>", text))[1] != []


def test_a_range_does_not_need_blanks() -> None:
    for text in ("param a = 1 in 0 .. 5", "param a = 1 in 0..5", "param a = 1 in 0. ..5."):
        declaration = parsed(text).declarations[0]
        assert isinstance(declaration, Param)
        assert (declaration.low, declaration.high) == (number("0"), number("5"))
    assert isinstance(parsed("param a = 1 mm in 0mm..h").declarations[0], Param)


def test_reserved_words_are_no_units() -> None:
    assert isinstance(parsed("param a = 0.49 in 0 .. 1").declarations[0], Param)
    less = Compare((name("x"), number("3", "mm")), ("<",), NOWHERE)
    more = Compare((name("y"), number("2")), (">",), NOWHERE)
    assert value("x < 3 mm and y > 2") == binary(less, "and", more)
    assert value("y > 2 or x < 3 mm") == binary(more, "or", less)
    assert value("(y > 2) and x < 3 mm") == binary(more, "and", less)
    assert value("5 lbf/in^2") == number("5", "lbf/in^2")  # inside a unit they may stand


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a + b - c", binary(binary(name("a"), "+", name("b")), "-", name("c"))),
        ("a - (b - c)", binary(name("a"), "-", binary(name("b"), "-", name("c")))),
        ("a / b * c", binary(binary(name("a"), "/", name("b")), "*", name("c"))),
        ("a + b * c", binary(name("a"), "+", binary(name("b"), "*", name("c")))),
        ("(a + b) * c", binary(binary(name("a"), "+", name("b")), "*", name("c"))),
        ("-a^2", Unary("-", binary(name("a"), "^", number("2")), NOWHERE)),
        ("(-a)^2", binary(Unary("-", name("a"), NOWHERE), "^", number("2"))),
        ("a^b^c", binary(name("a"), "^", binary(name("b"), "^", name("c")))),
        ("a^-2", binary(name("a"), "^", Unary("-", number("2"), NOWHERE))),
        ("(5 m)^2", binary(number("5", "m"), "^", number("2"))),
        ("+x", Unary("+", name("x"), NOWHERE)),
        ("--x", Unary("-", Unary("-", name("x"), NOWHERE), NOWHERE)),
        (
            "5 mm*f(x)",
            binary(number("5", "mm"), "*", Call(name("f"), (Argument(None, name("x"), NOWHERE),), NOWHERE)),
        ),
        ("5 mm*a.b", binary(number("5", "mm"), "*", name("a.b"))),
        ("5 mm*h^x", binary(number("5", "mm"), "*", binary(name("h"), "^", name("x")))),
        ("5 mm*2", binary(number("5", "mm"), "*", number("2"))),
        ("5 mm * h", binary(number("5", "mm"), "*", name("h"))),
        ("((a))", name("a")),
    ],
)
def test_arithmetic(text: str, expected: Expression) -> None:
    assert value(text) == expected


def test_comparisons_chain() -> None:
    sag = (number("1", "mm"), name("sag"), number("2", "mm"))
    assert value("1 mm < sag <= 2 mm") == Compare(sag, ("<", "<="), NOWHERE)
    inner = Compare((name("a"), name("b")), ("<",), NOWHERE)
    assert value("(a < b) != c") == Compare((inner, name("c")), ("!=",), NOWHERE)


def test_logic_binds_or_and_not_compare() -> None:
    less = Compare((name("c"), name("d")), ("==",), NOWHERE)
    expected = binary(name("a"), "or", binary(name("b"), "and", Unary("not", less, NOWHERE)))
    assert value("a or b and not c == d") == expected


def test_calls() -> None:
    arguments = (Argument(None, name("x"), NOWHERE), Argument("y", String("z", NOWHERE), NOWHERE))
    for text in ('f(x, y = "z")', 'f(x,y="z",)', 'f (\nx,\ny = "z",\n)'):
        assert value(text) == Call(name("f"), arguments, NOWHERE)
    assert value("tissue.liver()") == Call(name("tissue.liver"), (), NOWHERE)


def test_texts() -> None:
    assert value(r'"a \"b\" \\ c"') == String('a "b" \\ c', NOWHERE)
    assert value('"# no comment; {} µ"') == String("# no comment; {} µ", NOWHERE)
    assert value('""') == String("", NOWHERE)


def test_a_declaration_goes_on_while_its_expression_is_open() -> None:
    texts = [
        "param a =\n1 +\n2",
        "param a = (1 +\n\n# why\n2\n)",
        "param a = 1 + # why\n 2",
        "param a = 1 + 2",
    ]
    assert len({parsed(text) for text in texts}) == 1
    assert len(parsed('expect a <\n3 and\nnot\nb\nparam c = 1 in\n0 ..\n1\nuse "x" as\ny').declarations) == 3


def test_line_ends_and_byte_order_marks_change_nothing() -> None:
    for text in (EXPERIMENT.replace("\n", "\r\n"), EXPERIMENT.replace("\n", "\r"), "\ufeff" + EXPERIMENT):
        assert parsed(text) == parsed(EXPERIMENT)
    scene = parsed("\ufeffparam a = 1\r\nparam b = 2\r\n").declarations
    assert [(d.span.line, d.span.column) for d in scene] == [(1, 1), (2, 1)]


# --------------------------------------------------------------------------- places


def spans(node: Any) -> list[Span]:
    return [part.span for part, _ in walk(node)]


def test_spans_are_the_text_of_their_nodes() -> None:
    text = 'load push = traction(beam, where = not (x >= L), vector = (0, -2 mm) * [a^2, "é"] kg/m^3 + 1 < 2 %'
    text += " )\n"
    tree = parsed(text)
    slices = [text[span.start : span.end] for span in spans(expressions(tree.declarations[0])[0])]
    assert slices == [
        text[12:-1],
        "traction",
        "beam",
        "beam",
        "where = not (x >= L)",
        "not (x >= L)",
        "(x >= L)",
        "x",
        "L",
        'vector = (0, -2 mm) * [a^2, "é"] kg/m^3 + 1 < 2 %',
        '(0, -2 mm) * [a^2, "é"] kg/m^3 + 1 < 2 %',
        '(0, -2 mm) * [a^2, "é"] kg/m^3 + 1',
        '(0, -2 mm) * [a^2, "é"] kg/m^3',
        "(0, -2 mm)",
        "0",
        "-2 mm",
        "2 mm",
        '[a^2, "é"] kg/m^3',
        "a^2",
        "a",
        "2",
        '"é"',
        "1",
        "2 %",
    ]


def test_spans_of_declarations_and_their_names() -> None:
    text = '  use "a" as b # c\nparam n = 1 in 0 ..\n 2\nbody  x =\n f()\n'
    use, param, declare = parsed(text).declarations
    assert isinstance(use, Use)
    assert isinstance(param, Param)
    assert isinstance(declare, Declare)
    found = [use.span, use.path_span, use.alias_span, param.span, param.name_span]
    found += [declare.span, declare.kind_span, declare.name_span]
    expected = ['use "a" as b', '"a"', "b", "param n = 1 in 0 ..\n 2", "n", "body  x =\n f()", "body", "x"]
    assert [text[span.start : span.end] for span in found] == expected
    assert (param.span.line, param.span.column, param.span.end_line, param.span.end_column) == (2, 1, 3, 3)


def test_units_arguments_and_comments_have_spans() -> None:
    text = "param a = f(b = 60  kPa) # end  \n"
    tree = parsed(text)
    call = expressions(tree.declarations[0])[0]
    assert isinstance(call, Call)
    argument = call.arguments[0]
    assert isinstance(argument.value, Number)
    assert argument.name_span is not None
    assert argument.value.unit is not None
    assert text[argument.name_span.start : argument.name_span.end] == "b"
    assert text[argument.value.unit.span.start : argument.value.unit.span.end] == "kPa"
    comment = tree.comments[0]
    assert comment.text == text[comment.span.start : comment.span.end] == "# end"


def test_lines_and_columns_agree_with_offsets() -> None:
    lines = EXPERIMENT.split("\n")
    for declaration in parsed(EXPERIMENT).declarations:
        for expression in expressions(declaration):
            for span in spans(expression):
                assert sum(len(line) + 1 for line in lines[: span.line - 1]) + span.column - 1 == span.start
                assert sum(len(line) + 1 for line in lines[: span.end_line - 1]) + span.end_column - 1 == span.end


def test_walking_visits_every_part_in_the_order_of_the_text() -> None:
    expression = value("f(a, b = (c, -d)) + e")
    names = [part.text for part, _ in walk(expression) if isinstance(part, Name)]
    assert names == ["f", "a", "c", "d", "e"]
    assert children(name("a")) == ()
    assert max(depth for _, depth in walk(expression)) == 4


# ------------------------------------------------------------------------ overrides


def test_an_override_is_an_expression() -> None:
    assert value("120mm") == number("120", "mm")
    assert value("(0, 0, 1) m") == value("(0,0,1)m")
    assert parse_expression(Source("-p h=", ""))[1][0].code == "E129"
    assert parse_expression(Source("-p h=3 mm extra =", "3 mm extra = "))[0] is None
