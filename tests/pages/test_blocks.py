"""Every block of every page does what the page says: scenes are sound, commands end as they should, Python runs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from page_blocks import Block, Reader, blocks

from softmark.interpreter import documentation

ROOM = Path(documentation.__file__).resolve().parent
PAGES = sorted(ROOM.glob("*.md"))


@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if p.name != "README.md"], ids=lambda p: p.stem)
def test_blocks_do_what_the_page_says(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(os.environ, "NO_COLOR", "1")
    reader = Reader(tmp_path)
    for block in blocks(page.read_text(encoding="utf-8")):
        try:
            reader.do(block)
        except AssertionError as error:
            raise AssertionError(f"{page.name}:{block.line}: {error}") from None


def read(tmp_path: Path, language: str, text: str, **given: str) -> Reader:
    reader = Reader(tmp_path)
    reader.do(Block(language, given, text, 1))
    return reader


def test_what_is_wrong_in_a_block_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AssertionError, match="E203"):
        read(tmp_path, "scene", "material gel = jelly(young = 60 kPa)\n")
    read(tmp_path, "scene", "material gel = jelly(young = 60 kPa)\n", fails="E203")
    with pytest.raises(AssertionError, match="no E204"):
        read(tmp_path, "scene", "material gel = jelly(young = 60 kPa)\n", fails="E204")
    with pytest.raises(AssertionError, match="exit status 2"):
        read(tmp_path, "sh", "dsl explain nothing_of_the_kind\n")
    with pytest.raises(AssertionError, match="only commands of `dsl`"):
        read(tmp_path, "sh", "rm -r everything\n")
    with pytest.raises(AssertionError, match="ZeroDivisionError"):
        read(tmp_path, "python", "1 / 0\n")
    with pytest.raises(ValueError, match="line 1: a block of scene has no runs"):
        list(blocks("```scene runs\n```\n"))


def test_what_was_printed_is_compared_without_blanks_and_dots(tmp_path: Path) -> None:
    reader = read(tmp_path, "python", "print('one   two\\n three')\n")
    reader.do(Block("text", {"output": ""}, "one two\nth...e\n", 1))
    with pytest.raises(AssertionError, match="four"):
        reader.do(Block("text", {"output": ""}, "four\n", 1))
