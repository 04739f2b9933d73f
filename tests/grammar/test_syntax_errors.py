"""What is said about texts that do not parse: the code, the place and the words, one mistake at a time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softmark.grammar.diagnostic import Diagnostic, Source, render
from softmark.grammar.diagnostic_codes import CODES
from softmark.grammar.lexer import lex
from softmark.grammar.parser import MAX_DIAGNOSTICS, parse, parse_expression

patient = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # machines may be busy

# A text with the place of the error between « and », its code, and words of the message or the help.
MISTAKES = [
    ("material m «:» f(a = 1)", "E106", "expected `=` after `m`, found `:`"),
    ("material m «f»(a = 1)", "E106", "write `material m = ...`"),
    ("material m «==» f()", "E106", "found `==`"),
    ("param h «3» mm", "E106", "expected `=` after `h`, found the number `3`"),
    ("material m«»", "E106", "found the end of the line"),
    ("body b = f(a«:» 1 kPa)", "E106", "expected `=` after `a`, found `:`"),
    ("body b = f(a «60» kPa)", "E106", "write `a = 60`"),
    ("body b = f(a = 1 «c» = 2)", "E110", "expected `,` between the number `1` and `c`"),
    ("body b = f(a = 1 kPa «c» = 2)", "E110", "between the unit `kPa` and `c`"),
    ("body b = f(a = g() «c» = 2)", "E110", "between `)` and `c`"),
    ("body b = f(a «c» = 2)", "E110", "between `a` and `c`"),
    ("body b = [1 «2» 3]", "E110", "between the number `1` and `2`"),
    ("body b = f(a = 1,«,» c = 2)", "E129", "expected a value after `,`, found `,`"),
    ("body b = f(a = 1, «c»)", "E119", "write `name = value`"),
    ("body b = f(nu = 0,«49», c = 2)", "E113", "the decimal sign is a point"),
    ("param nu = 0«,»49", "E113", "write `0.49`"),
    ("body b = f(a = 1)«,»", "E111", "remove the `,`"),
    ("expect a < b«,» c < d", "E111", "one declaration for each"),
    ("body b = f«(»a = 1", "E104", "`(` is not closed"),
    ("body b = f(a = «[»1, 2", "E104", "`[` is not closed"),
    ("body b = f«(»g(a = 1, 2)", "E104", "`(` is not closed"),
    ("body b = f(a = [1, 2«)»", "E104", "`[` of line 1 is closed by `)`"),
    ("body b = f(a = 1)«)»", "E105", "`)` has no opening bracket"),
    ("«]»", "E105", "`]` has no opening bracket"),
    ("body b = f()«;»", "E107", "remove the `;`"),
    ("body b = f() «// why»", "E108", "write `# ...`"),
    ("«/* why */»", "E108", "a comment starts with `#`"),
    ("scene «'a title'»", "E109", 'write `"a title"`'),
    ('scene «"a title»', "E103", "the text is not closed"),
    ("material m «{» a = 1 }", "E112", "blocks in braces do not exist"),
    ("material m = «{» a = 1 }", "E112", "write fields in a call"),
    ("param h = 5 mm «body» b = f()", "E115", "start a new line before `body`"),
    ("param h = 5 «body» b = f()", "E115", "start a new line"),
    ("body a = f() «body» b = f()", "E115", "start a new line"),
    ("param h = L «param» k = 3", "E115", "start a new line before `param`"),
    ('«import» "a.scene" as b', "E116", "it is called `use`"),
    ('«include» "a.scene"', "E116", "it is called `use`"),
    ("«let» h = 3", "E116", "it is called `param`"),
    ("«const» h = 3", "E116", "as in `param h = 5 mm`"),
    ("«var» h = 3", "E116", "param"),
    ("«assert» a < b", "E116", "it is called `expect`"),
    ("expect a «=» 3", "E117", "write `==`"),
    ("expect a «=»< 3", "E101", "write `<=`"),
    ("expect a «=»> 3", "E101", "write `>=`"),
    ("expect a «<»> 3", "E101", "write `!=`"),
    ("param x = 3 «*»* 2", "E101", "write `^`"),
    ("body b = (a «=» 3)", "E101", "write named values in a call"),
    ("param x = «1e999»", "E120", "too large"),
    ("param x = «1e-999» m", "E120", "too small"),
    ("param x = " + "1" * 399 + "12", "E121", "401 characters long"),
    ('scene "' + "x" * 500 + '"', "E121", "the longest allowed is 400"),
    ("softmark «2»", "E123", "version 2 of the language is not known"),
    ("softmark «1.0»", "E123", "known: 1"),
    ('scene "C:«\\t»emp"', "E124", "`\\t` is not an escape sequence"),
    ("param x = (1,«)»", "E126", "a vector needs at least two items"),
    ("param x = («)»", "E126", "the brackets are empty"),
    ("param x = 5 «m ^ 2»", "E127", "write `5 m^2` for the unit, `(5 m)^2` for the quantity"),
    ("param x = (1, 2) «m ^ h»", "E127", "write `((1, 2) m)^h`"),
    ("param «=» 3", "E128", "write a parameter as `param name = value`"),
    ("material «=» f()", "E128", "expected a name after `material`, found `=`"),
    ("material«»", "E128", "expected a name after `material`, found the end of the line"),
    ("young «=» 3 kPa", "E128", "for a quantity, `param young = ...`"),
    ("cylinder«(»length = 3)", "E128", "give it a kind and a name: `kind name = cylinder(...)`"),
    ("param «a.b» = 3", "E128", "must not contain dots"),
    ("«+» 3 mm", "E128", "a declaration cannot start with `+`"),
    ("«3» mm", "E128", "a declaration cannot start with the number `3`"),
    ("metric eta =«»", "E129", "expected a value after `=`, found the end of the line"),
    ("expect«»", "E129", "expected a value after `expect`"),
    ("expect a <«»", "E129", "expected a value after `<`, found the end of the line"),
    ("param a = 1 in 0 ..«»", "E129", "expected a value after `..`"),
    ("param a = 1 in 0 «1»", "E101", "expected `..` after the number `0`, found the number `1`"),
    ("param a = 1 in 0 «...» 1", "E102", "write `..`"),
    ("param «in» = 3", "E114", "`in` is a reserved word"),
    ("param «scene» = 3", "E114", "choose another name"),
    ("body b = f(«as» = 4)", "E114", "`as` is a reserved word"),
    ('use "a" as «not»', "E114", "reserved are `and`, `as`"),
    ("param x = «param»", "E114", "reserved"),
    ("param x = «or» 2", "E129", "expected a value after `=`, found `or`"),
    ("param x = ramp(over = 0.5 s) «kPa»", "E118", "multiply: `* 1 kPa`"),
    ("param x = (1 + 2) «mm»", "E118", "a unit must follow a number, a vector or a list"),
    ("param x = h «mm»", "E101", "expected an operator or the end of the line after `h`, found `mm`"),
    ("param «größe» = 3", "E130", "`größe` is not a name"),
    ("param x = 3 «−» 4", "E102", "write `-`"),
    ("param x = a «&&» b", "E102", "write `and`"),
    ("param x = a «@» b", "E102", "unexpected `@`"),
    ("param x = a «\u200b»b", "E102", "character U+200B"),
    ("param x = rod«.»", "E102", "unexpected `.`"),
    ("scene «Silicone»", "E101", 'write `"Silicone"`'),
    ("scene«»", "E101", "expected a text in double quotes after `scene`"),
    ('use "a.scene"«»', "E101", 'write `use "a.scene" as name`'),
    ('use "a.scene" as«»', "E101", "expected a name after `as`"),
    ("softmark«»", "E129", "expected a version number after `softmark`"),
]


def errors(text: str) -> list[Diagnostic]:
    _, diagnostics = parse(Source("test.scene", text))
    for diagnostic in diagnostics:
        assert diagnostic.code in CODES
        assert_inside(diagnostic, text)
    return diagnostics


def assert_inside(diagnostic: Diagnostic, text: str) -> None:
    span = diagnostic.span
    assert span is not None
    assert 0 <= span.start <= span.end <= len(text)
    assert (1, 1) <= (span.line, span.column) <= (span.end_line, span.end_column)
    assert span.end_line <= text.count("\n") + text.count("\r") + 1


@pytest.mark.parametrize(("marked", "code", "words"), MISTAKES, ids=[mistake[0][:40] for mistake in MISTAKES])
def test_a_mistake_is_explained_at_its_place(marked: str, code: str, words: str) -> None:
    before, _, rest = marked.partition("«")
    inside, _, after = rest.partition("»")
    found = errors(before + inside + after)
    assert [diagnostic.code for diagnostic in found] == [code]
    said = f"{found[0].message} / {found[0].label} / {found[0].help}"
    assert words in said
    assert not any(word in said for word in ("RPAR", "LSQB", "CIRCUMFLEX", "__ANON", "NAME", "$END"))
    if "«" in marked:
        span = found[0].span
        assert span is not None
        assert (span.start, span.end) == (len(before), len(before + inside))


def test_every_code_has_a_mistake_that_shows_it() -> None:
    elsewhere = {"E122", "E125", "E199"}  # tests below and in test_extremes.py
    assert {mistake[1] for mistake in MISTAKES} | elsewhere == set(CODES)


def test_a_good_scene_gets_no_diagnostics_for_a_mistake_before_or_after_it() -> None:
    good = "body good = f(a = 1)\n"
    for marked, _, _ in MISTAKES:
        text = marked.replace("«", "").replace("»", "")
        if text.startswith(("softmark", "/*")):
            continue
        tree, found = parse(Source("test.scene", good + text + "\n" + good.replace("good", "fine")))
        names = [getattr(declaration, "name", None) for declaration in tree.declarations]
        assert (len(found), names[0], names[-1]) == (1, "good", "fine")


# -------------------------------------------------------------------------- recovery

THREE = """\
material m = neo_hookean(young = 60 kPa, poisson = 0.49
body beam = solid(cylinder(length = L), m)
support wall : fixed(beam)
expect rod.eta < 5 %
metric eta = relative_l2_error(axis, against = )
"""


def test_three_errors_in_three_declarations() -> None:
    tree, found = parse(Source("test.scene", THREE))
    assert [(d.code, d.span.line, d.span.column) for d in found if d.span] == [
        ("E104", 1, 25),
        ("E106", 3, 14),
        ("E129", 5, 48),
    ]
    assert len(tree.declarations) == 2
    assert tree.broken == ("m", "wall", "eta")


def test_an_unclosed_bracket_ends_at_the_next_declaration() -> None:
    for opener in ("body b = f()", "param b = 1", "expect b", 'use "x" as b', 'scene "b"'):
        tree, found = parse(Source("test.scene", f"body a = f(g(1,\n   2),\n{opener}\nbody c = f()\n"))
        assert [d.code for d in found] == ["E104"]
        assert found[0].span is not None
        assert (found[0].span.line, found[0].span.column) == (1, 11)
        assert len(tree.declarations) == 2


def test_a_missing_comma_at_the_end_of_a_line_is_found_on_the_next() -> None:
    found = errors("body b = f(\n  x = 3\n  y = 4\n)\n")
    assert [(d.code, d.span.line) for d in found if d.span] == [("E110", 3)]


def test_a_block_in_braces_is_one_error() -> None:
    assert [d.code for d in errors("material m {\n  young = 60 kPa\n  poisson = 0.4\n}\nbody b = f()\n")] == ["E112"]


def test_a_foreign_comment_over_several_lines_is_one_error() -> None:
    tree, found = parse(Source("test.scene", "/* one\n two\n*/\nbody b = f()\n"))
    assert [d.code for d in found] == ["E108"]
    assert tree.declarations[0].span.line == 4


def test_the_second_declaration_of_a_line_is_parsed() -> None:
    tree, found = parse(Source("test.scene", "param a = 5 mm param b = 3 body c = f(\nparam d = 1"))
    assert [d.code for d in found] == ["E115", "E115", "E104"]
    assert tree.broken == ("a", "b", "c")


def test_the_version_comes_first() -> None:
    assert [d.code for d in errors("# a comment\n\nsoftmark 1\n")] == []
    assert [d.code for d in errors("param a = 1\nsoftmark 1\n")] == ["E123"]
    assert [d.code for d in errors("softmark 1\nsoftmark 1\n")] == ["E123"]


def test_after_twenty_diagnostics_the_rest_is_counted() -> None:
    found = errors("material m : f()\n" * 57)
    assert len(found) == MAX_DIAGNOSTICS + 1
    assert found[-1].code == "E199"
    assert found[-1].message == "37 more syntax errors are not shown"
    assert len(errors("material m : f()\n" * 20)) == 20
    assert errors("material m : f()\n" * 21)[-1].message == "1 more syntax error is not shown"


def test_a_binary_file_is_one_error() -> None:
    found = errors("\x7fELF\x02\x01\n\x00\x00" + "\x00\x01\xff" * 1000)
    assert [(d.code, d.span.line, d.span.column) for d in found if d.span] == [("E125", 2, 1)]


def test_an_override_is_explained_in_its_own_text() -> None:
    source = Source("-p a=ramp(1) kPa", "ramp(1) kPa")
    tree, found = parse_expression(source)
    assert tree is None
    assert render(found) == (
        "error[E118]: a unit must follow a number, a vector or a list; here it follows a call or a group\n"
        "  --> -p a=ramp(1) kPa:1:9\n   |\n 1 | ramp(1) kPa\n   |         ^^^\n   = help: multiply: `* 1 kPa`"
    )


# ------------------------------------------------------------------- whatever is typed

SCENE = """\
softmark 1
scene "Silicone beam"
use "std/tissues.scene" as tissue  # a comment

param L  = 178 mm
param nu = 0.49 in 0 .. 0.49999
param h  = 2 * L / 60

material silicone = linear_elastic(young = 60 kPa, poisson = nu, density = 1070 kg/m^3)
body     beam     = solid(cylinder(length = L, radius = 19 mm, axis = +x), silicone)
support  wall     = fixed(beam, where = x <= 0 mm and not y > 2 mm)
load     push     = traction(
    beam,
    where = x >= L,
    vector = (0, 0, -200) Pa * ramp(over = 0.5 s),
)
model rod     = beam6dof(segments = 20)
model springs = mass_spring(size = h^2, stiffness = calibrated)

reference theory = elastica(beam)
study     refine = sweep(h, over = [10, 5, 2.5] mm)
metric    eta    = relative_l2_error(axis, against = theory)

expect rod.eta < 5 %
expect 1 mm < sag.tip < -(2 + 3) * 4 mm or tissue.liver == 3
"""


def mutants() -> Iterator[str]:
    """The scene with each token in turn left out, doubled, misspelt or replaced by others."""
    for token in lex(SCENE).tokens:
        before, after = SCENE[: token.start], SCENE[token.end :]
        yield before + after
        yield before + token.text * 2 + after
        yield before + token.text + " " + token.text + after
        yield before + token.text[:-1] + "q" + after
        yield before + '"' + after
        yield before + "(" + after
        yield before


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("part", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
def test_every_mutant_of_a_scene_is_parsed_or_explained(part: int) -> None:
    """A third of them: each token and each change is in every third."""
    count = 0
    for text in islice(mutants(), part, None, 3):
        found = errors(text)
        assert len(found) <= 6  # no cascades: one slip breaks its own declaration, at most some around it
        render(found, colour=True)
        count += bool(found)
    assert count > 300


@patient
@given(st.text())
def test_any_text_is_parsed_or_explained(text: str) -> None:
    render(errors(text))
    for diagnostic in parse_expression(Source("<test>", text))[1]:
        assert_inside(diagnostic, text)


WORDS = st.sampled_from(
    [
        "param",
        "in",
        "not",
        "a",
        "b.c",
        "5",
        ".5",
        "1e3",
        "mm",
        "==",
        "..",
        '"x"',
        "\n",
        "\r\n",
        *"=()[],+-*^<\"#{}:;'é%",
    ]
)


@patient
@given(st.lists(WORDS, max_size=40).map(" ".join))
def test_any_order_of_words_is_parsed_or_explained(text: str) -> None:
    render(errors(text))


@patient
@given(st.lists(WORDS, max_size=40).map("".join))
def test_every_character_is_in_a_token_a_comment_or_blank(text: str) -> None:
    tokens, comments = lex(text)
    covered = sorted([(t.start, t.end) for t in tokens] + [(c.span.start, c.span.end) for c in comments])
    gaps = [text[a:b] for (_, a), (b, _) in zip([(0, 0), *covered], [*covered, (len(text), 0)], strict=True)]
    assert "".join(gaps).strip(" \t\r\n") == ""
