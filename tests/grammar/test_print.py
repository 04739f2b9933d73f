"""The canonical form: what it looks like, that it means the same and stays, and that no comment is lost."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from daily_selection import WHOLE
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softmark.grammar.diagnostic import Source
from softmark.grammar.input_limits import FOREIGN_KINDS
from softmark.grammar.lexer import Token, lex
from softmark.grammar.parse_table import reserved_words
from softmark.grammar.parser import parse, parse_expression
from softmark.grammar.printer import CannotFormat, format_source, print_expression, print_tree
from softmark.grammar.source_layout import WIDTH
from softmark.grammar.statement_splitting import UNFINISHED
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
)

NOWHERE = Span(0, 0, 1, 1, 1, 1)
patient = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # machines may be busy


def formatted(text: str) -> str:
    """The canonical form, which is its own canonical form."""
    found = format_source(Source("test.scene", text))
    assert format_source(Source("again.scene", found)) == found
    return found


FORMS = {
    "blanks": (
        "param  a=1 in 0..2\nbody\tbb =f( x ,y=  2mm )",
        "param a  = 1 in 0 .. 2\nbody  bb = f(x, y = 2 mm)\n",
    ),
    "operators": ("expect a+b*-c^ -2<(d)and not(e or f)", "expect a + b * -c^-2 < d and not (e or f)\n"),
    "brackets": ("param a = ((1)+(2*3))-(4-5)", "param a = 1 + 2 * 3 - (4 - 5)\n"),
    "quantities": ("param a = 5% + (3 m)^2*1.50e3kPa", "param a = 5 % + (3 m)^2 * 1.50e3 kPa\n"),
    "items": ("param a = [ 1,2, ]mm + f(( 1,2,),)", "param a = [1, 2] mm + f((1, 2))\n"),
    "texts": ('scene   "a \\"b\\" \\\\"\nuse "x"  as y', 'scene "a \\"b\\" \\\\"\nuse "x" as y\n'),
    "version": ("softmark   1\n\n\n\nexpect a", "softmark 1\n\nexpect a\n"),
    "blank lines": ("\n\nexpect a\n\n\n\nexpect b\n\n\n", "expect a\n\nexpect b\n"),
    "line ends": ("expect a \r\n\r\n# c \t\r\nexpect b\r\n", "expect a\n\n# c\nexpect b\n"),
    "no line end": ("expect a # c", "expect a  # c\n"),
    "only comments": ("\n  # a\n\n\n\n # b", "# a\n\n# b\n"),
    "empty": ("\n \n", ""),
    "comments before": (
        "  # one\n# two\n  expect a\n\n# three\n\nexpect b",
        "# one\n# two\nexpect a\n\n# three\n\nexpect b\n",
    ),
    "columns": (
        "param a = 1\nmaterial bb = 2\n\nparam c = 3\n# comment\nparam dd = 4\nexpect e\nparam fff = 5",
        "param    a  = 1\nmaterial bb = 2\n\nparam c = 3\n# comment\nparam dd = 4\nexpect e\nparam fff = 5\n",
    ),
    "trailing comments": (
        "param a = 1 # one\nparam bbb = 22\nexpect cccc > 1\nexpect d #four\n\nexpect e # five",
        "param a   = 1  # one\nparam bbb = 22\nexpect cccc > 1\nexpect d       #four\n\nexpect e  # five\n",
    ),
    "one line again": ("body b = f(\n  x,\n  y,\n)", "body b = f(x, y)\n"),
    "comments inside": (
        "body b = f( # first\nx, # of x\n# before y\ny = g(1, # one\n2) # of y\n, z = [3,4]\n# last\n) # of b",
        "body b = f(\n    # first\n    x,  # of x\n    # before y\n    y = g(\n        1,  # one\n"
        "        2,\n    ),  # of y\n    z = [3, 4],\n    # last\n)  # of b\n",
    ),
    "comments elsewhere": ("param  a = 1 +  # why  \n   2  # end", "param  a = 1 +  # why\n   2  # end\n"),
    "comment in a name": ("body b = # why\n  f( x )", "body b = # why\n  f( x )\n"),
    "comment in an argument": ("body b = f(x =  # why\n  1)", "body b = f(x =  # why\n  1)\n"),
}


@pytest.mark.parametrize(("text", "expected"), FORMS.values(), ids=FORMS.keys())
def test_the_canonical_form(text: str, expected: str) -> None:
    assert formatted(text) == expected


LONG = "abcdefghijklmnopqrstuvwxyz" * 2


def test_long_calls_have_an_argument_per_line() -> None:
    text = f"load push = traction(beam, where = {LONG} >= L, vector = (0, 0, -200) Pa * ramp(over = 0.5 s))"
    assert formatted(text) == (
        f"load push = traction(\n    beam,\n    where = {LONG} >= L,\n"
        "    vector = (0, 0, -200) Pa * ramp(over = 0.5 s),\n)\n"
    )


def test_long_operations_break_behind_operators() -> None:
    text = f"expect not (a < {LONG} or ({LONG} + b - c) * d > 3) and e"
    assert formatted(text) == (f"expect not (a < {LONG} or\n    ({LONG} + b - c) * d > 3) and\n    e\n")


def test_brackets_break_from_the_outermost_inwards() -> None:
    items = ", ".join(["(1, 2, 3)"] * 10)
    text = f"study s = sweep(h, over = [{items}] mm, deeper = f({items}, [{items}] kPa))"
    found = formatted(text)
    assert "    over = [\n        (1, 2, 3),\n" in found
    assert "    ] mm,\n" in found
    assert "        ] kPa,\n    ),\n)\n" in found
    assert max(map(len, found.split("\n"))) <= WIDTH


def test_a_range_stays_on_the_last_line() -> None:
    assert (
        formatted(f"param a = f({LONG}, {LONG}) in 0 .. 1") == f"param a = f(\n    {LONG},\n    {LONG},\n) in 0 .. 1\n"
    )


def test_a_line_has_at_most_its_width() -> None:
    fits = "param a = f(" + "x" * (WIDTH - 13) + ")"
    assert formatted(fits) == fits + "\n"
    assert formatted(fits.replace("(", "(x")) == "param a = f(\n    " + "x" * (WIDTH - 12) + ",\n)\n"
    assert formatted(f'param a = "{LONG * 3}"') == f'param a = "{LONG * 3}"\n'  # a text cannot be broken


def test_who_is_too_long_for_the_columns_leaves_them() -> None:
    fits = "param a = f(" + "x" * (WIDTH - 13) + ")\n"
    assert formatted(f"{fits}param bbb = 1\nparam c = 2\n") == (
        "param a = f(\n    " + "x" * (WIDTH - 13) + ",\n)\nparam bbb = 1\nparam c   = 2\n"
    )


def test_a_text_in_error_is_not_formatted() -> None:
    with pytest.raises(CannotFormat, match=r"test\.scene does not parse") as caught:
        format_source(Source("test.scene", "expect a <"))
    assert [d.code for d in caught.value.diagnostics] == ["E129"]


def test_a_form_that_would_lose_a_comment_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    without = "param a = 1\n"
    monkeypatch.setattr("softmark.grammar.printer.print_tree", lambda tree, text: without)
    with pytest.raises(CannotFormat, match="comments"):
        format_source(Source("test.scene", "param a = 1  # why\n"))
    with pytest.raises(CannotFormat, match="change its meaning"):
        format_source(Source("test.scene", "param a = 2\n"))


def test_a_tree_without_a_text_is_refused() -> None:
    with pytest.raises(CannotFormat, match="line break"):
        print_expression(String("a\nb", NOWHERE))
    tree, _ = parse(Source("test.scene", "param a = 1 +  # why\n 2"))
    with pytest.raises(CannotFormat, match="no place for the comment of line 1"):
        print_tree(tree)


# ----------------------------------------------------------------------- any tree at all

names = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,9}", fullmatch=True).filter(
    lambda word: word not in reserved_words() and word not in FOREIGN_KINDS
)
units = st.sampled_from(["kPa", "kg/m^3", "%", "µm", "μm", "s^-1", "N*m", "J/(kg*K)", "°C", "lbf/in^2", "m^0.5"])
texts = st.text(st.characters(exclude_characters="\n\r\0", exclude_categories=["Cs"]), max_size=20)
digits = st.from_regex(r"([0-9]{1,4}(\.[0-9]{0,4})?|\.[0-9]{1,4})([eE][+-]?[0-9]{1,2})?", fullmatch=True)


def optional_unit() -> st.SearchStrategy[Unit | None]:
    return st.none() | units.map(lambda text: Unit(text, NOWHERE))


@st.composite
def numbers(draw: st.DrawFn) -> Number:
    text = draw(digits)
    return Number(float(text), draw(optional_unit()), text, NOWHERE)


def dotted() -> st.SearchStrategy[Name]:
    return st.lists(names, min_size=1, max_size=3).map(lambda parts: Name(tuple(parts), NOWHERE))


def larger(smaller: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    """The nodes that hold others."""
    items = st.lists(smaller, max_size=3).map(tuple)
    pair = st.tuples(smaller, smaller)
    positional = smaller.map(lambda value: Argument(None, value, NOWHERE))
    named = st.tuples(names, smaller).map(lambda pair: Argument(pair[0], pair[1], NOWHERE))
    arguments = st.tuples(st.lists(positional, max_size=2), st.lists(named, max_size=3))
    operators: Any = st.sampled_from(["+", "-", "*", "/", "^", "and", "or"])
    comparisons = st.lists(
        st.tuples(st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), smaller), min_size=1, max_size=3
    )
    signs: Any = st.sampled_from(["-", "+", "not"])
    return st.one_of(
        st.tuples(items, pair, optional_unit()).map(lambda t: Vector(t[1] + t[0], t[2], NOWHERE)),
        st.tuples(items, optional_unit()).map(lambda t: List(t[0], t[1], NOWHERE)),
        st.tuples(dotted(), arguments).map(lambda t: Call(t[0], (*t[1][0], *t[1][1]), NOWHERE)),
        st.tuples(signs, smaller).map(lambda t: Unary(t[0], t[1], NOWHERE)),
        st.tuples(operators, smaller, smaller).map(lambda t: Binary(t[0], t[1], t[2], NOWHERE)),
        st.tuples(smaller, comparisons).map(
            lambda t: Compare((t[0], *(e for _, e in t[1])), tuple(o for o, _ in t[1]), NOWHERE)  # type: ignore[misc]
        ),
    )


values = st.recursive(numbers() | dotted() | texts.map(lambda text: String(text, NOWHERE)), larger, max_leaves=12)
bounds = st.just((None, None)) | st.tuples(values, values)
declarations = st.one_of(
    texts.map(lambda text: Title(text, NOWHERE)),
    st.tuples(texts, names).map(lambda t: Use(t[0], t[1], NOWHERE, NOWHERE, NOWHERE)),
    st.tuples(names, values, bounds).map(lambda t: Param(t[0], t[1], t[2][0], t[2][1], NOWHERE, NOWHERE)),
    values.map(lambda value: Expect(value, NOWHERE)),
    st.tuples(names, names, values).map(lambda t: Declare(t[0], t[1], t[2], NOWHERE, NOWHERE, NOWHERE)),
)
scenes = st.tuples(st.booleans(), st.lists(declarations, max_size=5)).map(
    lambda t: Tree((Version(1, NOWHERE), *t[1]) if t[0] else tuple(t[1]))
)


@pytest.mark.slow
@patient
@given(values)
def test_an_expression_survives_printing(value: Expression) -> None:
    text = print_expression(value)
    again, found = parse_expression(Source("<test>", text))
    assert found == []
    assert again == value
    assert print_expression(again) == text


@pytest.mark.slow
@pytest.mark.long
@settings(patient, max_examples=100 if WHOLE else 40)
@given(scenes)
def test_a_tree_survives_printing(tree: Tree) -> None:
    text = print_tree(tree)
    again, found = parse(Source("test.scene", text))
    assert found == []
    assert again == tree
    assert print_tree(again) == text == formatted(text)


# -------------------------------------------------------------------------- any comments


def may_break(tokens: list[Token], i: int) -> bool:
    """Whether a line may end before `tokens[i]` without a change of meaning."""
    depth = sum((t.text in "([") - (t.text in ")]") for t in tokens[:i])
    if i == 0 or (tokens[i - 1].line != tokens[i].line and depth == 0):
        return True
    return tokens[i].kind != "UNIT" and (depth > 0 or tokens[i - 1].kind in UNFINISHED)


@pytest.mark.long
@pytest.mark.slow
@patient
@given(scenes, st.data())
def test_comments_anywhere_are_kept(tree: Tree, data: st.DataObject) -> None:
    text = print_tree(tree)
    tokens = lex(text).tokens
    places = [i for i in range(len(tokens)) if may_break(tokens, i)]
    chosen = data.draw(st.sets(st.sampled_from(places), max_size=6)) if places else set()
    sprinkled, last = "", 0
    for number, i in enumerate(sorted(chosen)):
        start = tokens[i].start
        lines = data.draw(st.sampled_from([" # {}\n", "\n# {}\n\n\n", " # {}\r\n  \r\n# more\n", "\n#{} \t\n  "]))
        sprinkled += text[last:start] + lines.format(number)
        last = start
    sprinkled += text[last:] + data.draw(st.sampled_from(["", "# end", "\n\n\n# end \n"]))
    before, found = parse(Source("test.scene", sprinkled))
    assert found == []
    assert before == tree
    result = formatted(sprinkled)
    assert [c.text for c in parse(Source("again", result))[0].comments] == [c.text for c in before.comments]


def test_spans_take_no_part_in_equality() -> None:
    assert Name(("a",), NOWHERE) == replace(Name(("a",), NOWHERE), span=Span(1, 2, 3, 4, 5, 6))
