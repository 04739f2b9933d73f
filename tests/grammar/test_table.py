"""The table that lark makes, and the file that keeps it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from softmark.grammar import parse_table
from softmark.grammar.lalr_driver import run as run_table

PROGRAM = """
import sys
from softmark.grammar.diagnostic import Source
from softmark.grammar.parser import parse
tree, found = parse(Source("x", "param a = (1, 2) mm"))
assert not found and len(tree.declarations) == 1
print("lark" in sys.modules, "numpy" in sys.modules)
"""


def run(environment: dict[str, str]) -> str:
    """What a fresh process prints that parses a scene."""
    found = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True)
    return found.stdout.strip()


def test_a_second_process_does_not_import_lark(tmp_path: Path) -> None:
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    assert run(environment) == "True False"
    assert [path.suffix for path in (tmp_path / "softmark").iterdir()] == [".json"]
    assert run(environment) == "False False"


@pytest.mark.parametrize("content", ["", "{", "[]", '{"states": []}', '{"rules": [{}], "terminals": []}', "null"])
def test_a_broken_file_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    path = parse_table._cache_path()
    assert path is not None
    path.parent.mkdir()
    path.write_text(content)
    found = parse_table.load.__wrapped__()
    assert parse_table._read(path) == found


def test_a_table_that_a_disk_has_damaged_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One digit is another, and the file is JSON still: its checksum says so."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    path = parse_table._cache_path()
    assert path is not None
    parse_table._write(path, parse_table.make())
    data = path.read_bytes()
    at = next(i for i in range(len(data) // 2, len(data)) if data[i : i + 1] in b"123")
    path.write_bytes(data[:at] + b"4" + data[at + 1 :])
    assert parse_table._read(path) is None
    assert parse_table.load.__wrapped__() == parse_table._read(path)


def test_without_a_place_to_write_the_table_is_made_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))  # no folder, and none can be made inside
    assert parse_table.load.__wrapped__().rules == parse_table.make().rules


def test_without_a_home_there_is_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setenv("XDG_CACHE_HOME", "relative/folders/do/not/count")
    monkeypatch.setattr(Path, "home", homeless)
    assert parse_table._cache_path() is None
    assert parse_table.load.__wrapped__().rules == parse_table.make().rules


def test_what_is_read_is_what_was_written(tmp_path: Path) -> None:
    path = tmp_path / "new" / "table.json"
    made = parse_table.make()
    parse_table._write(path, made)
    assert parse_table._read(path) == made
    assert [found.name for found in path.parent.iterdir()] == ["table.json"]  # no draft is left


def test_a_draft_that_cannot_be_put_in_place_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    (path / "in the way").mkdir(parents=True)
    parse_table._write(path, parse_table.make())
    assert [found.name for found in tmp_path.iterdir()] == ["table.json"]


def test_another_grammar_has_another_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = parse_table._cache_path()
    changed = tmp_path / "scene.lark"
    changed.write_text(parse_table.GRAMMAR.read_text("utf-8") + "\n// changed\n", "utf-8")
    monkeypatch.setattr(parse_table, "GRAMMAR", changed)
    assert parse_table._cache_path() != before


def test_the_grammar_is_small() -> None:
    """What a screen holds, and at most ten reserved words."""
    lines = parse_table.GRAMMAR.read_text("utf-8").split("\n")
    assert len(lines) <= 60
    assert len(parse_table.reserved_words()) == 10
    words = {"scene", "use", "as", "param", "in", "expect", "and", "or", "not", "softmark"}
    assert set(parse_table.reserved_words()) == words


def test_tokens_without_an_end_are_refused() -> None:
    with pytest.raises(ValueError, match="END"):
        run_table(parse_table.load(), {}, [], "declaration")
