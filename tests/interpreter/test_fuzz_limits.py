"""Files that no one writes by hand are refused before they cost anything; tests/fuzz/extremes.py measures many more."""

from __future__ import annotations

import io
import os
from pathlib import Path

import pytest

from softmark.grammar.diagnostic import Diagnostic, Source, render
from softmark.interpreter.language.message_limit import MOST
from softmark.interpreter.language.scene_sources import LARGEST, UnreadableScene, read_limited, read_scene_file
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.solvers.mesh.files import bounded_reader


def found_in(folder: Path, text: str) -> list[Diagnostic]:
    """What is said of a text as `x.scene` of a folder."""
    (folder / "x.scene").write_text(text, encoding="utf-8")
    return load_scene(Source("x.scene", text), folder, folder / "x.scene")[1]


def codes(found: list[Diagnostic]) -> list[str]:
    return [d.code for d in found]


class Counting(io.BytesIO):
    """Zeros without end; counts how many are taken."""

    taken = 0

    def read(self, size: int | None = -1, /) -> bytes:
        assert size is not None
        assert size >= 0, "asks for all that there is"
        self.taken += size
        return bytes(size)


def test_no_more_is_read_than_a_scene_may_have() -> None:
    stream = Counting()
    with pytest.raises(UnreadableScene, match="standard input is larger than 1 MB"):
        read_limited(stream, "standard input")
    assert stream.taken == LARGEST + 1


def test_a_file_of_a_terabyte(tmp_path: Path) -> None:
    with (tmp_path / "large.scene").open("wb") as file:
        file.truncate(10**12)  # takes no space
    with pytest.raises(UnreadableScene, match="larger than 1 MB"):
        read_scene_file(tmp_path / "large.scene")


def test_a_text_that_is_too_large(tmp_path: Path) -> None:
    assert codes(load_scene(Source("<text>", "#" * (LARGEST + 1)), tmp_path, None)[1]) == ["E401"]


@pytest.mark.parametrize("target", ["x.scene", "k.scene", "/dev/zero", "."])
def test_links(tmp_path: Path, target: str) -> None:
    """To the scene itself, to the link itself, to an endless device, to a folder."""
    (tmp_path / "k.scene").symlink_to(target)
    (found,) = found_in(tmp_path, 'use "k.scene" as k\n')
    assert found.code == ("E402" if target == "x.scene" else "E401")


def test_a_pipe_that_nobody_writes_to_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "k.scene")
    (found,) = found_in(tmp_path, 'use "k.scene" as k\n')
    assert (found.code, found.message) == ("E401", f"{tmp_path / 'k.scene'} is not a regular file")


def test_a_diamond_is_not_expanded_without_end(tmp_path: Path) -> None:
    """Thirty scenes, each of which uses the next one twice: 2^30 texts."""
    for i in range(30):
        text = f'use "{i + 1}.scene" as a\nuse "{i + 1}.scene" as b\n'
        (tmp_path / f"{i}.scene").write_text(text, encoding="utf-8")
    (tmp_path / "30.scene").write_text("param k = 1\n", encoding="utf-8")
    assert set(codes(found_in(tmp_path, 'use "0.scene" as a\n'))) == {"E402"}


def test_scenes_that_are_together_too_large(tmp_path: Path) -> None:
    (tmp_path / "k.scene").write_text("#" * (LARGEST // 3), encoding="utf-8")
    text = "".join(f'use "k.scene" as k{i}\n' for i in range(5))
    found = found_in(tmp_path, text)
    assert {d.code for d in found} == {"E402"}
    assert "together larger than 1 MB" in found[0].message


@pytest.mark.parametrize("turned", [False, True])
def test_a_long_chain_of_parameters(tmp_path: Path, turned: bool) -> None:
    """Deeper than Python may recurse, in either order of the text."""
    rows = [f"param p{i} = p{i + 1}\n" for i in range(3000)] + ["param p3000 = 1\n"]
    assert found_in(tmp_path, "".join(rows[::-1] if turned else rows)) == []


@pytest.mark.parametrize(
    "line", ["foo a{i} = bar()\n", "param p{i} = q{i}\n", 'use "y{i}.scene" as y{i}\n', "param a = {i}\n"]
)
def test_a_thousand_errors_are_a_hundred_messages(tmp_path: Path, line: str) -> None:
    found = found_in(tmp_path, "".join(line.format(i=i) for i in range(1000)))
    assert len(found) <= MOST + 1
    assert found[-1].code == "E131"


@pytest.mark.slow
@pytest.mark.long
def test_a_thousand_warnings_are_a_hundred(tmp_path: Path) -> None:
    rows = "".join(f"expect {i} < 1\n" for i in range(1000))
    found = found_in(tmp_path, "param k = 1\n" + rows)
    assert (len(found), {d.severity for d in found}) == (MOST, {"warning"})
    assert found[-1].notes[-1] == "900 more warnings are not shown"


def test_a_place_in_a_long_line_is_shown_without_the_line() -> None:
    text = "param a = [" + "1, " * 20_000 + "b]\n"
    found = load_scene(Source("x.scene", text), Path(), None)[1]
    assert len(render(found)) < 1000


@pytest.mark.parametrize("mode", ["r", "rb"])
def test_a_reader_that_asks_on_after_the_end_is_stopped(tmp_path: Path, mode: str) -> None:
    (tmp_path / "file").write_bytes(b"one\ntwo")
    with bounded_reader.open_bounded(tmp_path / "file", mode) as file:
        assert [len(file.readline()) for _ in range(4)] == [4, 3, 0, 0]
        with pytest.raises(EOFError):
            [file.readline() for _ in range(1000)]
    with bounded_reader.open_bounded(tmp_path / "file", mode) as file:
        assert [len(line) for line in file] == [4, 3]
        file.seek(0)
        assert len(file.read()) == 7
