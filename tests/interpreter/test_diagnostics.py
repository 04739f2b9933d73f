"""Golden messages: each tests/errors/NAME.scene gives exactly the text of NAME.expected.

SOFTMARK_BLESS=1 pytest tests/interpreter/test_diagnostics.py writes the expected texts anew: then read the
difference, as the person would to whom it is shown. To add one: a scene there, and bless. Its first line may
be a command, `# $ dsl run FILE -p L=3`; without it the scene is checked. Files that scenes use are in
tests/errors/parts.

Texts agree to the letter. Numbers that a solver computed are rounded where they are shown, and processors, BLAS and
threads round differently before: they may differ by one in the last digit that is shown, and no more. What the scene
says itself, places, counts, and all that `check` says are exact.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from softmark.interpreter.cli.main import main
from softmark.interpreter.help.codes import pages

FOLDER = Path(__file__).parents[1] / "errors"
SCENES = sorted(FOLDER.glob("*.scene"))
HEAD = re.compile(r"(?:error|warning)\[([EW]\d{3})\]: ")
COMMAND = re.compile(r"# \$ dsl (.+)")
COMBINED = re.compile(rb"\b(?:union|difference|intersection)\(")
RUN = re.compile(r"(?m)^# \$ dsl (run|compare|stress|convergence) ")
QUOTED = re.compile(r"^ *(?:-->|\d+ \|)")  # a place, a line of the scene
# a measured number has a point, an exponent or a unit behind it; without, as in `40 of 40 cells`, it is a count
UNIT = r" (?:%|deg|Hz|[GMk]?Pa|m?N|[mkµn]?m|[mµn]?s|[mk]?J)(?!\w)"
MEASURED = re.compile(rf"(?<![\w.`#-])\d+(?:\.\d+(?:e[+-]\d+)?|e[+-]\d+|(?={UNIT}))(?![\w.])")
# no scene is known that comes to it, or only with a mesher or without, or with a library that combines shapes
INSIDE_OUT = ("W324", "W351")  # cells of a solution: the exit status is 1 without an error of the scene
STAGED = {"E336", "E337", "E338", "E405", "E575", "E576", "E630", "W349", "W354", "W630"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the scenes, where commands may leave reports."""
    return Path(shutil.copytree(FOLDER, tmp_path_factory.mktemp("golden") / "errors"))


@pytest.fixture(autouse=True)
def _here(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths in messages are those that a person in the folder gives; no colours; no public data, and no network."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delenv("SOFTMARK_DATA", raising=False)
    monkeypatch.setattr(
        "softmark.references.data_download._cache_path", lambda entry: tmp_path / "cache" / Path(entry.name).name
    )
    monkeypatch.setattr("softmark.references.data_download._copy_from_url", lambda *arguments: "no network")


def shown(text: str, name: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """The exit status of the scene's command, and its diagnostics, those in its report included."""
    found = COMMAND.match(text)
    arguments = shlex.split(found[1]) if found else ["check", "FILE"]
    capsys.readouterr()
    status = main([name if a == "FILE" else a for a in arguments])
    out, err = capsys.readouterr()
    err = re.sub(r"^  compiling kernels.*\n", "", err, flags=re.MULTILINE)  # only where no cache has them
    first = HEAD.search(err)
    said = err[first.start() :] if first else ""  # not what is said of the progress
    warnings = json.loads(out)["warnings"] if "--json" in arguments else []
    return status, said + "".join(f"in the report: warning[{w['code']}]: {w['message']}\n" for w in warnings)


def last_digit(number: str) -> float:
    """What one more in the last digit adds to a number as it is written."""
    digits, _, exponent = number.partition("e")
    return float(10.0 ** (int(exponent or 0) - len(digits.partition(".")[2])))


def compared(found: str, expected: str, scene: str) -> tuple[str, str]:
    """Both texts, with what is expected in the place of every measured number that is as good as that."""
    if not RUN.match(scene):
        return found, expected
    given, lines = set(MEASURED.findall(scene)), found.splitlines(keepends=True)
    for i, (mine, theirs) in enumerate(zip(lines, expected.splitlines(keepends=True), strict=False)):
        if not QUOTED.match(mine) and MEASURED.sub("", mine) == MEASURED.sub("", theirs):
            due = iter(MEASURED.findall(theirs))
            lines[i] = MEASURED.sub(lambda m, due=due: _near(m[0], next(due), given), mine)  # type: ignore[misc]
    return "".join(lines), expected


def _near(found: str, expected: str, given: set[str]) -> str:
    """What is expected, if the number is within one in its last digit and no number of the scene."""
    far = abs(float(found) - float(expected)) > 1.000001 * last_digit(expected)
    return found if far or expected in given else expected


@pytest.mark.parametrize("scene", SCENES, ids=lambda p: p.stem)
def test_golden(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = scene.read_bytes().decode("utf-8", errors="replace")
    status, found = shown(text, scene.name, capsys)
    expected = scene.with_suffix(".expected")
    known = expected.read_text(encoding="utf-8") if expected.is_file() else ""
    same, wanted = compared(found, known, text)
    if os.environ.get("SOFTMARK_BLESS") and same != wanted:
        expected.write_text(found, encoding="utf-8")
        return
    assert expected.is_file(), "no expected text: bless it, and read it"
    assert same == wanted
    inside_out = any(f"warning[{code}]" in found for code in INSIDE_OUT)
    assert (status == 0) == ("error[" not in found and not inside_out)


@pytest.mark.parametrize("scene", [p for p in SCENES if COMBINED.search(p.read_bytes())], ids=lambda p: p.stem)
def test_no_message_hangs_on_a_library_that_may_be_missing(
    scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What says more of shapes that are combined where manifold3d is installed is not in a golden message."""
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    _, found = shown(scene.read_text(encoding="utf-8"), scene.name, capsys)
    assert found == scene.with_suffix(".expected").read_text(encoding="utf-8")


def test_a_computed_number_may_round_either_way_and_nothing_else_may() -> None:
    scene = "# $ dsl run FILE\nanalysis rest = static(tolerance = 1e-2)\nsize = 5 mm\n"
    known = (
        "warning[W1]: a tolerance of 1e-02 by 0.12 %\n --> s.scene:2:3\n 5 | size = 5.1 mm\n"
        "   |   ^^ about 34 % of 5 mm, 1.2e-04 after 2 steps\n"
    )

    def agrees(old: str, new: str, head: str = scene) -> bool:
        same, wanted = compared(known.replace(old, new), known, head)
        return same == wanted

    for old, new in (("0.12 %", "0.11 %"), ("0.12 %", "0.13 %"), ("34 %", "35 %"), ("1.2e-04", "1.1e-04")):
        assert agrees(old, new)
        assert not agrees(old, new, scene.replace("dsl run", "dsl check"))
    for old, new in (("0.12", "0.10"), ("0.12", "0.1"), ("0.12 %", "0.12 m"), ("34", "36"), ("34 % of", "34 % in")):
        assert not agrees(old, new)
    for old, new in (("5 mm,", "6 mm,"), ("2 steps", "3 steps"), (":2:3", ":2:4"), ("5.1", "5.2"), ("W1", "W2")):
        assert not agrees(old, new)


def test_every_scene_has_its_text_and_every_text_its_scene() -> None:
    assert {p.stem for p in FOLDER.glob("*.expected")} == {p.stem for p in SCENES}


def test_every_code_is_covered() -> None:
    found = {code for p in FOLDER.glob("*.expected") for code in HEAD.findall(p.read_text(encoding="utf-8"))}
    assert found == set(pages()) - STAGED


def test_every_scene_shows_something() -> None:
    assert [p.name for p in FOLDER.glob("*.expected") if not HEAD.search(p.read_text(encoding="utf-8"))] == []
