"""What a message says to write instead, written: the message is gone. Over the golden scenes of tests/errors/."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from zlib import crc32

import pytest

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.help.suggested_fixes import apply_fix, replacement
from softmark.interpreter.validation.scene_loader import load_scene

FOLDER = Path(__file__).parents[1] / "errors"
CHECKED = re.compile(r"(?!# \$ dsl )|# \$ dsl check FILE\n")  # what is said of a text without options and runs
PARTS = 4  # of the golden scenes; one is walked each day


def said(file: Path, text: str) -> list[Diagnostic]:
    """What `dsl check` says of a text in the place of a golden scene."""
    return load_scene(Source(file.name, text), FOLDER, file)[1]


def golden(part: int) -> Iterator[tuple[Path, str]]:
    """A part of the golden scenes whose messages come from the text alone, and their texts.

    A scene stays in its part whatever others come and go, and scenes about one thing are in all parts.
    """
    for file in (f for f in sorted(FOLDER.glob("*.scene")) if crc32(f.stem.encode()) % PARTS == part):
        text = file.read_bytes().decode("utf-8", errors="replace")
        if CHECKED.match(text):
            yield file, text


def left(part: int) -> tuple[int, list[str]]:
    """How many messages of a part have a replacement, and those that are still there once it is made."""
    count, still = 0, []
    for file, text in golden(part):
        found = said(file, text)
        for one in found:
            if one.source is None or one.source.text != text or (new := apply_fix(text, one)) is None:
                continue
            count += 1
            before, after = ([(d.code, d.message) for d in some] for some in (found, said(file, new)))
            if after.count((one.code, one.message)) >= before.count((one.code, one.message)):
                still.append(f"{file.name}: {one.code} {one.message}, {one.help}")
    return count, still


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_what_a_message_says_to_write_instead_makes_it_go_away(part: int) -> None:
    count, still = left(part)
    assert not still
    assert count > 30


@pytest.mark.parametrize(
    ("text", "new"),
    [
        ("param L = 178 mm\nparam h = 2 * l_2", None),
        ("param long = 178 mm\nparam h = 2 * lomg", "param long = 178 mm\nparam h = 2 * long"),
        ("param E = 60 kpa", "param E = 60 kPa"),
        ("param rho = 1 g/CM^3", "param rho = 1 g/cm^3"),
        ("param a = 1 m²", "param a = 1 m^2"),
        ('scene „A beam“ # hung\nparam L = 3 m', 'scene "A beam" # hung\nparam L = 3 m'),
        ("param L: 3 m", "param L= 3 m"),
        ("param L = 3 m,", "param L = 3 m"),
        ("param L = (1 + (2 m", "param L = (1 + (2 m))"),
        ("param L = 3,5 m", "param L = 3.5 m"),
        ("param L = 1 m  param R = 2 m", "param L = 1 m  \nparam R = 2 m"),
        ("body b = solid(box(size = (1, 1, 1) mm), materiel = gel)", None),  # of no name that is declared
        ("param L = 3 m // long", "param L = 3 m # long"),
        ("param n = 3 in 4 .. 2", "param n = 3 in 2 .. 4"),
        ("rod r = beam6dof(segments = 20)", "model r = beam6dof(segments = 20)"),
    ],
)  # fmt: skip
def test_a_text_after_its_first_replacement(text: str, new: str | None) -> None:
    found = [d for d in load_scene(Source("t.scene", text), FOLDER, None)[1] if replacement(d)]
    assert [apply_fix(text, found[0])] == [new] if new else not any(d.code == "E201" for d in found)
