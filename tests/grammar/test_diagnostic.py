"""How a diagnostic is drawn and what tools read of it."""

from __future__ import annotations

import json

from softmark.grammar.diagnostic import WIDTH, Diagnostic, Source, render, summary, to_json
from softmark.grammar.tree import Span

SCENE = Source(
    "beam.scene",
    "\n" * 6 + "material silicone = linear_elastic(young = 60 mm, poisson = 0.49, density = 1070 kg/m^3)\n",
)


def at(
    source: Source, part: str, code: str = "E999", label: str = "", help: str = "", occurrence: int = 0
) -> Diagnostic:
    """A diagnostic under an occurrence of `part` in the text."""
    start = -1
    for _ in range(occurrence + 1):
        start = source.text.index(part, start + 1)
    return Diagnostic(code, "a message", source, span(source.text, start, start + len(part)), label, help)


def span(text: str, start: int, end: int) -> Span:
    places = [(text.count("\n", 0, i) + 1, i - text.rfind("\n", 0, i)) for i in (start, end)]
    return Span(start, end, *places[0], *places[1])


def test_a_message_looks_like_this() -> None:
    found = Diagnostic(
        "E204",
        "expected a pressure, found a length",
        SCENE,
        at(SCENE, "60 mm").span,
        "a length, 60 mm",
        "`young` is Young's modulus; give it in Pa, kPa, MPa or GPa",
        ("a first note", "a second\nof two lines"),
    )
    assert render([found]) == (
        "error[E204]: expected a pressure, found a length\n"
        "  --> beam.scene:7:44\n"
        "   |\n"
        " 7 | material silicone = linear_elastic(young = 60 mm, poisson = 0.49, density = 1070 kg/m^3)\n"
        "   |                                            ^^^^^ a length, 60 mm\n"
        "   = help: `young` is Young's modulus; give it in Pa, kPa, MPa or GPa\n"
        "   = note: a first note\n"
        "   = note: a second\n"
        "           of two lines"
    )


def drawn(source: Source, part: str, occurrence: int = 0) -> tuple[str, str]:
    """The line as drawn, and the carets below it."""
    lines = render([at(source, part, occurrence=occurrence)]).split("\n")
    margin = lines[2].index("|") + 2
    return lines[3][margin:], lines[4][margin:]


def test_the_gutter_grows_with_the_number_of_the_line() -> None:
    source = Source("x", "\n" * 99 + "abc")
    lines = render([at(source, "b", help="h")]).split("\n")
    assert lines[1:] == ["    --> x:100:2", "     |", " 100 | abc", "     |  ^", "     = help: h"]


def test_carets_stand_below_tabs_and_wide_and_combining_characters() -> None:
    assert drawn(Source("x", "\ta\tbcd = 1"), "bcd") == ("    a   bcd = 1", "        ^^^")
    assert drawn(Source("x", 's "梁の材料" bad'), "bad") == ('s "梁の材料" bad', "             ^^^")
    assert drawn(Source("x", 's "梁の材料" bad'), "の材") == ('s "梁の材料" bad', "     ^^^^")
    assert drawn(Source("x", "e\u0301e\u0301 bad"), "bad") == ("e\u0301e\u0301 bad", "   ^^^")
    assert drawn(Source("x", "5 µm bad"), "bad") == ("5 µm bad", "     ^^^")


def test_what_cannot_be_seen_or_would_steer_the_terminal_is_replaced() -> None:
    source = Source("x\x1b[31m", "a\x1b[2J \u202e\u200b\x7f\ud800 bad")
    text = render([at(source, "bad", label="l\x07", help="h\x1b")])
    assert not any(ord(character) < 32 and character != "\n" for character in text)
    assert "a␛[2J \ufffd\ufffd\ufffd\ufffd bad" in text
    assert text.encode("utf-8")
    assert drawn(source, "bad")[1].index("^") == drawn(source, "bad")[0].index("bad")


def test_a_long_line_is_clipped_around_the_span() -> None:
    source = Source("x", "a" * 500 + " bad " + "c" * 500)
    line, carets = drawn(source, "bad")
    assert line.startswith("…")
    assert line.endswith("…")
    assert len(line) == WIDTH + 2
    assert line[carets.index("^") :].startswith("bad c")
    line, carets = drawn(Source("x", "bad" + "c" * 500), "bad")
    assert (line[:4], line[-1], len(line), carets) == ("badc", "…", WIDTH + 1, "^^^")
    line, carets = drawn(Source("x", "c" * 500 + "bad"), "bad")
    assert (line[0], line[-4:], len(line)) == ("…", "cbad", WIDTH + 1)
    line, carets = drawn(Source("x", "梁" * 500 + "bad" + "梁" * 500), "bad")
    assert 2 * line.count("梁") + 3 <= WIDTH
    assert carets.index("^") == 1 + 2 * line[: line.index("bad")].count("梁")
    line, carets = drawn(Source("x", "x" + "b" * 500), "b" * 500)
    assert len(carets) == len(line) - 1 == WIDTH


def test_a_span_of_several_lines_is_drawn_on_its_first() -> None:
    assert drawn(Source("x", "a = f(\n  b\n)"), "f(\n  b\n)") == ("a = f(", "    ^^")
    assert drawn(Source("x", "a = f(\r\n  b\n)"), "f(\r\n  b\n)") == ("a = f(", "    ^^")


def test_an_empty_span_has_one_caret() -> None:
    source = Source("x", "a =\nb")
    found = Diagnostic("E999", "m", source, Span(3, 3, 1, 4, 1, 4))
    assert render([found]).split("\n")[3:] == [" 1 | a =", "   |    ^"]
    end = Diagnostic("E999", "m", source, Span(5, 5, 2, 2, 2, 2))
    assert render([end]).split("\n")[3:] == [" 2 | b", "   |  ^"]
    nothing = Diagnostic("E999", "m", Source("x", ""), Span(0, 0, 1, 1, 1, 1))
    assert render([nothing]).split("\n")[3:] == [" 1 |", "   | ^"]


def test_a_byte_order_mark_takes_no_column() -> None:
    source = Source("x", "\ufeffab")
    found = Diagnostic("E999", "m", source, Span(2, 3, 1, 2, 1, 3))
    assert render([found]).split("\n")[3:] == [" 1 | ab", "   |  ^"]


def test_a_span_beyond_the_text_is_drawn_at_its_end() -> None:
    stale = Diagnostic("E999", "m", Source("x", "ab"), Span(10, 20, 1, 11, 1, 21))
    assert render([stale]).split("\n")[3:] == [" 1 | ab", "   |   ^"]


def test_without_a_place_there_is_only_the_header() -> None:
    assert render([Diagnostic("W101", "careful", None, None)]) == "warning[W101]: careful"
    assert render([Diagnostic("E401", "no", SCENE, None, "label", "try")]) == "error[E401]: no\n   = help: try"


def test_diagnostics_are_sorted_by_file_and_place() -> None:
    other = Source("a.scene", "one two")
    found = [at(SCENE, "60"), at(SCENE, "material"), at(other, "two"), Diagnostic("E1", "first", None, None)]
    blocks = render(found).split("\n\n")
    assert [block.split("\n")[1:2] for block in blocks] == [
        [],
        ["  --> a.scene:1:5"],
        ["  --> beam.scene:7:1"],
        ["  --> beam.scene:7:44"],
    ]
    assert render([]) == ""


def test_colours_only_when_asked() -> None:
    found = [at(SCENE, "60 mm", label="a length", help="help"), at(SCENE, "young", code="W205")]
    plain, coloured = render(found), render(found, colour=True)
    assert "\x1b" not in plain
    for code in (
        "\x1b[1;31merror[E999]\x1b[0m",
        "\x1b[1;33mwarning[W205]\x1b[0m",
        "\x1b[1;31m^^^^^ a length\x1b[0m",
    ):
        assert code in coloured
    for number in ("1", "1;31", "1;33", "1;34", "0"):
        coloured = coloured.replace(f"\x1b[{number}m", "")
    assert coloured == plain


def test_the_summary_counts() -> None:
    error, warning = Diagnostic("E1", "", None, None), Diagnostic("W1", "", None, None)
    assert summary([]) == "no errors"
    assert summary([error]) == "1 error"
    assert summary([error, warning, error]) == "2 errors, 1 warning"
    assert summary([warning, warning]) == "2 warnings"


def test_the_json_has_the_fields_of_the_contract() -> None:
    found = to_json(at(SCENE, "60 mm", "W204", "label", "help"))
    assert found == {
        "code": "W204",
        "severity": "warning",
        "message": "a message",
        "file": "beam.scene",
        "line": 7,
        "column": 44,
        "end_line": 7,
        "end_column": 49,
        "help": "help",
        "label": "label",
        "notes": [],
    }
    nowhere = to_json(Diagnostic("E401", "no", None, None))
    assert [nowhere[key] for key in ("file", "line", "column", "end_line", "end_column", "help")] == [None] * 6
    assert json.loads(json.dumps(found)) == found
