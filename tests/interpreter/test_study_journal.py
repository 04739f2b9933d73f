"""The journal: nothing that was written is lost or counted twice, whatever happened to its last line."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from softmark.interpreter.study.workers.task_journal import LOCK, NAME, Journal, JournalRefused


def entry(key: str, **more: object) -> dict[str, object]:
    return {"kind": "accuracy", "key": key, **more}


def filled(folder: Path, keys: str) -> Path:
    with Journal.open(folder) as journal:
        for key in keys:
            journal.add(entry(key, value=f"é {key}"))
    return folder / NAME


def test_what_was_added_is_there_again(tmp_path: Path) -> None:
    filled(tmp_path, "abc")
    with Journal.open(tmp_path) as journal:
        assert list(journal.of_kind("accuracy")) == ["a", "b", "c"]
        assert journal.of_kind("accuracy")["b"]["value"] == "é b"
        assert journal.of_kind("timing") == {}


def test_an_entry_is_there_once(tmp_path: Path) -> None:
    file = filled(tmp_path, "ab")
    before = file.read_bytes()
    with Journal.open(tmp_path) as journal:
        assert not journal.add(entry("a", value="other"))
        assert journal.add({**entry("a"), "repeat": 1})
        assert journal.add({**entry("a"), "kind": "timing"})
    assert file.read_bytes().startswith(before)
    assert len(file.read_bytes().splitlines()) == 1 + 4


def test_lines_that_are_there_twice_count_once_and_the_first_stands(tmp_path: Path) -> None:
    file = filled(tmp_path, "a")
    with file.open("a", encoding="utf-8") as out:
        out.write(json.dumps(entry("a", value="second")) + "\n")
    with Journal.open(tmp_path) as journal:
        assert journal.of_kind("accuracy")["a"]["value"] == "é a"


@pytest.mark.slow
@pytest.mark.long
def test_a_torn_last_line_is_cut_off_wherever_it_was_torn(tmp_path: Path) -> None:
    """Cut at every byte of the last line: all before it is there, and what is added is readable."""
    file = filled(tmp_path, "abc")
    whole = file.read_bytes()
    start = whole.rstrip(b"\n").rfind(b"\n") + 1
    for end in range(start, len(whole)):
        file.write_bytes(whole[:end])
        with Journal.open(tmp_path) as journal:
            assert list(journal.of_kind("accuracy")) == ["a", "b"]
            journal.add(entry("d"))
        lines = [json.loads(line) for line in file.read_bytes().splitlines()]
        assert [line.get("key") for line in lines] == [None, "a", "b", "d"]


def test_a_torn_header_is_a_new_journal(tmp_path: Path) -> None:
    file = filled(tmp_path, "")
    file.write_bytes(file.read_bytes()[:7])
    with Journal.open(tmp_path) as journal:
        assert journal.entries == {}
    assert file.read_bytes().endswith(b"}\n")


def test_a_line_that_is_spoilt_counts_as_not_written(tmp_path: Path) -> None:
    file = filled(tmp_path, "abc")
    lines = file.read_bytes().splitlines(keepends=True)
    lines[2] = b"\0" * 20 + b"\n"
    file.write_bytes(b"".join(lines))
    with Journal.open(tmp_path) as journal:
        assert list(journal.of_kind("accuracy")) == ["a", "c"]


@pytest.mark.slow
@pytest.mark.long
def test_any_cut_and_any_bytes_behind_it_leave_a_journal_that_goes_on(tmp_path: Path) -> None:
    generator = random.Random(8)
    file = filled(tmp_path, "abcdef")
    whole = file.read_bytes()
    for _ in range(200):
        cut = generator.randrange(len(whole))
        file.write_bytes(whole[:cut] + generator.randbytes(generator.randrange(4)).replace(b"\n", b""))
        with Journal.open(tmp_path) as journal:
            kept = list(journal.of_kind("accuracy"))
            assert kept == list("abcdef")[: whole[:cut].count(b"\n") - 1 if cut > whole.find(b"\n") else 0]
            journal.add(entry("new"))
        with Journal.open(tmp_path) as journal:
            assert list(journal.of_kind("accuracy")) == [*kept, "new"]


@pytest.mark.parametrize("content", ["some notes\n", '{"schema": "softmark-journal/9"}\n', '{"a": 1}\n'])
def test_what_is_no_journal_of_ours_is_not_touched(content: str, tmp_path: Path) -> None:
    (tmp_path / NAME).write_text(content, encoding="utf-8")
    with pytest.raises(JournalRefused, match="--fresh"):
        Journal.open(tmp_path)
    assert (tmp_path / NAME).read_text(encoding="utf-8") == content
    with Journal.open(tmp_path, fresh=True) as journal:
        assert journal.entries == {}


def test_one_process_at_a_time(tmp_path: Path) -> None:
    with Journal.open(tmp_path), pytest.raises(JournalRefused, match="another comparison is running"):
        Journal.open(tmp_path)
    code = "import sys; from softmark.interpreter.study.workers.task_journal import *; from pathlib import Path\n"
    code += "try: Journal.open(Path(sys.argv[1]))\nexcept JournalRefused: sys.exit(5)"
    command = [sys.executable, "-c", code, str(tmp_path)]
    with Journal.open(tmp_path):
        assert subprocess.run(command, check=False).returncode == 5
    assert (tmp_path / LOCK).exists(), "the file stays, the lock does not"
    assert subprocess.run(command, check=False).returncode == 0


def test_the_lock_of_a_killed_process_is_free(tmp_path: Path) -> None:
    code = (
        "import sys, time; from softmark.interpreter.study.workers.task_journal import *; from pathlib import Path\n"
        "j = Journal.open(Path(sys.argv[1])); print('open', flush=True); time.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"open\n"
    with pytest.raises(JournalRefused):
        Journal.open(tmp_path)
    process.kill()
    process.wait()
    process.stdout.close()
    Journal.open(tmp_path).close()


def test_numbers_that_json_does_not_have_are_refused_before_a_byte_is_written(tmp_path: Path) -> None:
    file = filled(tmp_path, "a")
    size = file.stat().st_size
    with Journal.open(tmp_path) as journal, pytest.raises(ValueError, match="JSON"):
        journal.add(entry("b", value=float("nan")))
    assert file.stat().st_size == size


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(NotADirectoryError):
        Journal.open(tmp_path / "file" / "folder")
    assert os.listdir(tmp_path) == ["file"]
