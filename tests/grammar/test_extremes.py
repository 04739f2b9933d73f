"""Texts that no one writes by hand: long, deep, wide. An error or a tree, never an exception."""

from __future__ import annotations

import pytest

from softmark.grammar.diagnostic import Source, render
from softmark.grammar.input_limits import MAX_DEPTH
from softmark.grammar.parser import MAX_DIAGNOSTICS, parse, parse_expression
from softmark.grammar.printer import format_source, print_tree
from softmark.grammar.statement_splitting import MAX_NESTING
from softmark.grammar.tree import expressions, walk

MANY = 20_000
TOO_DEEP = {
    "round brackets": "param a = " + "(" * 100_000,
    "square brackets": "param a = " + "[" * MANY + "]" * MANY,
    "calls": "param a = " + "f(x = " * MANY + ")" * MANY,
    "lines of brackets": "(\n" * MANY,
    "braces": "{" * MANY,
    "a sum": "param a = a" + " + a" * 100_000,
    "a product": "param a = a" + "*a" * MANY,
    "powers": "param a = a" + "^a" * MANY,
    "minus": "param a = " + "-" * MANY + "1",
    "not": "expect " + "not " * MANY + "a",
    "or": "expect a" + " or a" * MANY,
    "a bound": "param a = 1 in 0 .. 1" + "+1" * MANY,
}
WRONG = {
    "closing brackets": ")" * MANY,
    "one name": "a" * MANY,
    "a dotted name": "a." * MANY,
    "digits": "param a = " + "1" * MANY,
    "a unit": "param a = 1 " + "m*" * MANY + "m",
    "brackets in a unit": "param a = 1 m" + "/(m" * MANY,
    "names": "a " * MANY,
    "numbers": "param a = " + "5 mm " * MANY,
    "letters beyond ASCII": "é" * MANY,
    "unused characters": "$" * MANY,
    "blanks, then nothing known": " " * MANY + "$",
    "a text": '"' + "\\" * MANY,
    "foreign comments": "/*" * MANY,
    "equal signs": "a b = " * MANY,
    "one line of declarations": "param a = 1 " * MANY,
    "broken lines": "a\n" * MANY,
    "quotes": '"\n' * MANY,
    "unclosed brackets": "body a = (\n" * MANY,
}


@pytest.mark.parametrize("text", TOO_DEEP.values(), ids=TOO_DEEP.keys())
def test_what_is_too_deep_is_refused(text: str) -> None:
    tree, found = parse(Source("test.scene", text))
    assert (tree.declarations, [d.code for d in found]) == ((), ["E122"])
    render(found)


@pytest.mark.parametrize("text", WRONG.values(), ids=WRONG.keys())
def test_what_is_long_and_wrong_is_refused_briefly(text: str) -> None:
    _, found = parse(Source("test.scene", text))
    assert 1 <= len(found) <= MAX_DIAGNOSTICS + 1
    assert len(render(found)) < 10_000


@pytest.mark.slow
def test_what_is_long_and_right_is_parsed() -> None:
    numbers = "param a = [" + "1, " * MANY + "]"
    chain = "expect a" + " < a" * MANY
    lines = "param a = 1\n" * MANY
    for text, count in ((numbers, 1), (chain, 1), (lines, MANY), ("\n" * MANY, 0), ("# c\n" * MANY, 0)):
        tree, found = parse(Source("test.scene", text))
        assert found == []
        assert len(tree.declarations) == count


DEEPEST = {
    "groups": "(" * MAX_NESTING + "a" + ")" * MAX_NESTING,
    "lists": "[" * MAX_NESTING + "a" + "]" * MAX_NESTING,
    "vectors": "(" * MAX_NESTING + "a" + ", b)" * MAX_NESTING,
    "calls": "f(x = " * MAX_NESTING + "a" + ")" * MAX_NESTING,
    "a sum": "a" + " + a" * MAX_DEPTH,
    "powers": "a" + "^a" * MAX_DEPTH,
    "minus": "-" * MAX_DEPTH + "a",
    "both": "-f(x = -" * 50 + "a" + ")" * 50,
}


@pytest.mark.parametrize("text", DEEPEST.values(), ids=DEEPEST.keys())
def test_the_deepest_tree_can_be_walked_by_recursion(text: str) -> None:
    """Comparing, showing, hashing and printing recurse: what the parser takes must not exhaust the stack."""
    source = Source("test.scene", f"expect {text}\n")
    (tree, found), (again, _) = parse(source), parse(source)
    assert found == []
    assert tree == again
    assert hash(tree) == hash(again)
    assert repr(tree) == repr(again)
    assert parse(Source("again", print_tree(tree)))[0] == tree
    assert parse(Source("again", format_source(source)))[0] == tree


@pytest.mark.parametrize("text", [f"({DEEPEST['groups']})", f"[{DEEPEST['lists']}]", f"-{DEEPEST['minus']}"])
def test_one_more_is_too_deep(text: str) -> None:
    tree, found = parse_expression(Source("<test>", text))
    assert tree is None
    assert [d.code for d in found] == ["E122"]


def test_walking_needs_no_stack() -> None:
    tree, _ = parse(Source("test.scene", f"param a = {DEEPEST['both']}"))
    assert max(depth for _, depth in walk(expressions(tree.declarations[0])[0])) == MAX_DEPTH
