"""Golden messages: each tests/errors/NAME.scene gives exactly the text of NAME.expected.

SOFTMARK_BLESS=1 pytest tests/interpreter/test_diagnostics.py writes the expected texts anew: then read the
difference, as the person would to whom it is shown. To add one: a scene there, and bless. Its first line may
be a command, `# $ dsl run FILE -p L=3`; without it the scene is checked. Files that scenes use are in
tests/errors/parts.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
from pathlib import Path

import pytest

from softmark.interpreter.cli import main
from softmark.interpreter.codes import pages

FOLDER = Path(__file__).parents[1] / "errors"
SCENES = sorted(FOLDER.glob("*.scene"))
HEAD = re.compile(r"(?:error|warning)\[([EW]\d{3})\]: ")
COMMAND = re.compile(r"# \$ dsl (.+)")
STAGED = {"E405"}  # no scene is known that comes to it


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
    monkeypatch.setattr("softmark.references.data._place", lambda entry: tmp_path / "cache" / Path(entry.name).name)
    monkeypatch.setattr("softmark.references.data._copy", lambda *arguments: "no network")


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


@pytest.mark.parametrize("scene", SCENES, ids=lambda p: p.stem)
def test_golden(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = scene.read_bytes().decode("utf-8", errors="replace")
    status, found = shown(text, scene.name, capsys)
    expected = scene.with_suffix(".expected")
    if os.environ.get("SOFTMARK_BLESS"):
        expected.write_text(found, encoding="utf-8")
    assert expected.is_file(), "no expected text: bless it, and read it"
    assert found == expected.read_text(encoding="utf-8")
    assert (status == 0) == ("error[" not in found)


def test_every_scene_has_its_text_and_every_text_its_scene() -> None:
    assert {p.stem for p in FOLDER.glob("*.expected")} == {p.stem for p in SCENES}


def test_every_code_is_covered() -> None:
    found = {code for p in FOLDER.glob("*.expected") for code in HEAD.findall(p.read_text(encoding="utf-8"))}
    assert found == set(pages()) - STAGED


def test_every_scene_shows_something() -> None:
    assert [p.name for p in FOLDER.glob("*.expected") if not HEAD.search(p.read_text(encoding="utf-8"))] == []
