"""The reference and the editor support say what the parser does."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from softmark.grammar import table
from softmark.grammar.codes import CODES
from softmark.grammar.diagnostic import Source, render
from softmark.grammar.parse import parse
from softmark.grammar.print import format_source

HERE = table.GRAMMAR.parent
README = (HERE / "README.md").read_text("utf-8")
SCENES = re.findall(r"```scene\n(.*?)```", README, re.S)
COLOURS: dict[str, Any] = json.loads((HERE / "editors" / "scene.tmLanguage.json").read_text("utf-8"))


@pytest.mark.parametrize("scene", SCENES, ids=range(len(SCENES)))
def test_the_examples_of_the_reference_parse(scene: str) -> None:
    assert render(parse(Source("README.md", scene))[1]) == ""


def test_the_first_and_last_example_are_in_canonical_form() -> None:
    for scene in (SCENES[0], SCENES[-1]):
        assert format_source(Source("README.md", scene)) == scene


def test_the_reference_lists_every_code_and_every_reserved_word() -> None:
    assert dict(re.findall(r"^\| (E\d+) \| (.*) \|$", README, re.M)) == CODES
    row = next(line for line in README.split("\n") if line.startswith("| reserved"))
    assert set(re.findall(r"`(\w+)`", row.split(", and no others")[0])) == set(table.reserved())


def test_the_reference_names_every_file() -> None:
    files = {path.name for path in HERE.iterdir() if path.suffix in (".py", ".lark") and path.name != "__init__.py"}
    assert files == set(re.findall(r"`(\w+\.(?:py|lark))`", README.split("## The code")[1].split("A new rule")[0]))


def patterns() -> dict[str, str]:
    """The regular expressions of the TextMate grammar; Python writes the letters of Oniguruma otherwise."""
    found = {name: part["match"] for name, part in COLOURS["repository"].items() if "match" in part}
    return {name: pattern.replace("[[:alpha:]µμ]", r"[^\W\d_]") for name, pattern in found.items()}


def test_the_editors_know_the_same_reserved_words() -> None:
    lists = re.findall(r"\(\?:(\w+(?:\|\w+)+)\)\\b", " ".join(patterns().values()))
    assert len(lists) == 3
    assert all(set(words.split("|")) == set(table.reserved()) for words in lists)


def test_the_editors_include_what_they_define() -> None:
    assert [part["include"] for part in COLOURS["patterns"]] == [
        f"#{name}"
        for name in [
            "comment",
            "declaration",
            "string",
            "quantity",
            "reserved",
            "call",
            "field",
            "name",
            "operator",
        ]
    ]
    assert {part["include"][1:] for part in COLOURS["patterns"]} == set(COLOURS["repository"])


@pytest.mark.parametrize(
    ("text", "number", "unit"),
    [
        ("60 kPa", "60", "kPa"),
        ("1070 kg/m^3)", "1070", "kg/m^3"),
        ("5 %", "5", "%"),
        ("3µm", "3", "µm"),
        ("4 J/(kg*K),", "4", "J/(kg*K)"),
        ("0.49 in 0", "0.49", None),
        ("3 mm and y", "3", "mm"),
        ("0..5", "0", None),
        ("1e-3", "1e-3", None),
    ],
)
def test_the_editors_see_quantities_as_the_parser_does(text: str, number: str, unit: str | None) -> None:
    found = re.match(patterns()["quantity"], text)
    assert found is not None
    assert (found[1], found[2]) == (number, unit)


def test_the_editors_see_declarations() -> None:
    pattern = re.compile(patterns()["declaration"], re.M)
    assert [match.groups() for match in pattern.finditer("body  b = f(\n  c = 1)\nparam h = 1\n")] == [("body", "b")]


def test_the_wheel_holds_the_grammar() -> None:
    assert Path(table.__file__).with_name("scene.lark").is_file()
