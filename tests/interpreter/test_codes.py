"""The pages of the codes: a wrong example, which gives the code and no other error, and a right one."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import manifold3d_stand_in
import pytest

import softmark
from softmark.grammar.diagnostic import Source
from softmark.grammar.diagnostic_codes import CODES
from softmark.grammar.printer import CannotFormat
from softmark.interpreter.cli.main import main
from softmark.interpreter.help.codes import Page, pages
from softmark.solvers.mesh.shapes import Box, Cylinder

PACKAGE = Path(softmark.__file__).parents[2]
PARTS = Path(__file__).parents[1] / "errors" / "parts"
SHOWN = re.compile(r"(?:error|warning)\[([EW]\d{3})\]: |\"code\": \"([EW]\d{3})\"")
COMMAND = re.compile(r"# \$ dsl (.+)")
# Examples of seconds each: contact, curved bodies, plugins.
LONG = {"W354", "W372", "W402", "W405", "W420", "W660", "W661", "E732", "W732"}

INSIDE_OUT = {"W324", "W341", "W351"}  # cells of a solution: no error of the scene, and the exit status is 1


def codes_of(text: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, list[str]]:
    """The exit status of an example's command, a check if its first line has none, and the codes it gives."""
    Path("my.scene").write_text(text, encoding="utf-8")
    command = COMMAND.match(text)
    arguments = shlex.split(command[1]) if command else ["check", "FILE"]
    status = main(["my.scene" if a == "FILE" else a for a in arguments])
    said = capsys.readouterr().err
    if "--json" in arguments:
        said += Path("report.json").read_text(encoding="utf-8")
    return status, [a or b for a, b in SHOWN.findall(said)]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every example is `my.scene` in a folder with the files that examples name."""
    shutil.copytree(PARTS, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    without_data(tmp_path, monkeypatch)


def without_data(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No public data set is here, and none can be had."""
    monkeypatch.delenv("SOFTMARK_DATA", raising=False)
    monkeypatch.setattr(
        "softmark.references.data_download._cache_path", lambda entry: folder / "cache" / Path(entry.name).name
    )
    monkeypatch.setattr("softmark.references.data_download._copy_from_url", lambda *arguments: "no network")


SOME = [pytest.param(p, marks=[pytest.mark.slow] * (p.code in LONG), id=p.code) for p in pages().values()]


@pytest.mark.parametrize("page", SOME)
def test_examples(page: Page, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    if page.code == "E405":
        monkeypatch.setattr("softmark.grammar.printer.format_source", _refuse)
    _mesher(page.code, monkeypatch)
    status, found = codes_of(page.example("wrong"), capsys)
    assert page.code in found
    errors = {code for code in found if code.startswith("E")}
    many = {"E199": {"E106"}, "E131": {"E205"}}  # codes that come after a number of others
    assert errors <= {page.code} | many.get(page.code, set())
    assert (status != 0) == (bool(errors) or page.code in INSIDE_OUT)
    status, found = codes_of(page.example("right"), capsys)
    assert (status, found) == (0, [])


def _mesher(code: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mesher that is not there, that is ended by the system, and that fills nine tenths of the cube of ten.

    And a library that combines shapes, as far as examples need one; none for contact, or faces that cross.
    """
    where = "softmark.solvers.mesh.tetrahedralization"
    monkeypatch.setattr(f"{where}._cache_folder", lambda: None)
    monkeypatch.setattr(f"{where}.MESHER", "no-such-mesher" if code == "E575" else "numpy")
    if code == "E576":
        ended = subprocess.CompletedProcess([], -11, "", "")
        monkeypatch.setattr("subprocess.run", lambda *arguments, **options: ended)
    elif code in ("E336", "E337", "E338", "W354"):
        monkeypatch.setitem(sys.modules, "manifold3d", None if code == "E337" else manifold3d_stand_in)
        monkeypatch.setattr(manifold3d_stand_in.Manifold, "sound", code != "E338")
        rod = Cylinder(0.01, 0.006, (0.0, 0.0, 1.0)).mesh("tet4", 0.0045)
        monkeypatch.setattr(f"{where}._run_mesher", lambda *arguments: (rod.points, rod.cells, 1.0))
    elif code == "E630":
        monkeypatch.setitem(sys.modules, "ipctk", None)
    elif code == "W630":
        monkeypatch.setattr(
            "softmark.solvers.independent_forces.self_intersection.find_intersections", lambda X, faces: faces[:1]
        )
    elif code == "W349":
        cube = Box((0.009, 0.009, 0.009)).mesh("tet4", 0.003)
        monkeypatch.setattr(f"{where}._run_mesher", lambda *arguments: (cube.points, cube.cells, 1.0))


def _refuse(source: Source) -> str:
    raise CannotFormat("its canonical form would lose a comment")


def test_every_code_has_a_page_and_every_page_a_code() -> None:
    texts = [
        file.read_text(encoding="utf-8")
        for folder in ("grammar", "interpreter", "solvers") for file in (PACKAGE / folder).rglob("*.py")
    ]  # fmt: skip
    emitted = {
        code for text in texts for code in re.findall(r"\"([EW]\d{3})\"|\[([EW]\d{3})\]", text) for code in code if code
    }
    assert emitted == set(pages())


@pytest.mark.parametrize("page", pages().values(), ids=lambda p: p.code)
def test_form(page: Page) -> None:
    lines = page.text.split("\n")
    assert lines[0] == f"# {page.code}: {page.title}"
    assert page.title == CODES.get(page.code, page.title)
    assert page.text.count("```wrong\n") == page.text.count("```right\n") == 1
    explanation = page.text.split("```")[0].strip().split("\n")[2:]
    assert 1 <= len(explanation) <= 5
    assert page.text.rsplit("```", 1)[1].strip(), "what to do"
    assert all(len(line) <= 130 for line in lines if "param a" not in line and 'scene "beam' not in line)
