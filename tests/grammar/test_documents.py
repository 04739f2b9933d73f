"""The reference says what the parser does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from softmark.grammar import parse_table
from softmark.grammar.diagnostic import Source, render
from softmark.grammar.diagnostic_codes import CODES
from softmark.grammar.parser import parse
from softmark.grammar.printer import format_source

HERE = parse_table.GRAMMAR.parent
README = (HERE / "README.md").read_text("utf-8")
SCENES = re.findall(r"```scene\n(.*?)```", README, re.S)


@pytest.mark.parametrize("scene", SCENES, ids=range(len(SCENES)))
def test_the_examples_of_the_reference_parse(scene: str) -> None:
    assert render(parse(Source("README.md", scene))[1]) == ""


def test_the_first_and_last_example_are_in_canonical_form() -> None:
    for scene in (SCENES[0], SCENES[-1]):
        assert format_source(Source("README.md", scene)) == scene


def test_the_reference_lists_every_code_and_every_reserved_word() -> None:
    assert dict(re.findall(r"^\| (E\d+) \| (.*) \|$", README, re.M)) == CODES
    row = next(line for line in README.split("\n") if line.startswith("| reserved"))
    assert set(re.findall(r"`(\w+)`", row.split(", and no others")[0])) == set(parse_table.reserved_words())


def test_the_reference_names_every_file() -> None:
    files = {path.name for path in HERE.iterdir() if path.suffix in (".py", ".lark") and path.name != "__init__.py"}
    assert files == set(re.findall(r"`(\w+\.(?:py|lark))`", README.split("## The code")[1].split("A new rule")[0]))


def test_the_wheel_holds_the_grammar() -> None:
    assert Path(parse_table.__file__).with_name("scene.lark").is_file()
