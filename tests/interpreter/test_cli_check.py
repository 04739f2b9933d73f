"""`dsl check`: exit statuses, diagnostics as JSON, and one clear error for every file that is no scene."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from softmark.grammar.diagnostic import Source
from softmark.interpreter.cli.main import main
from softmark.interpreter.validation.scene_loader import load_scene

GOOD = "param L = 178 mm\n"
BAD = "param L = 178 mn\nparam R = S\n"
WARNED = "material gel = neo_hookean(young = 60 mPa, poisson = 0.4, density = 1000 kg/m^3)\n"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_COLOR", "1")


def written(name: str, content: str | bytes) -> str:
    Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
    return name


def test_exit_statuses(capsys: pytest.CaptureFixture[str]) -> None:
    good, bad = written("good.scene", GOOD), written("bad.scene", BAD)
    warned = written("warned.scene", WARNED)
    assert main(["check", good]) == 0
    out, err = capsys.readouterr()
    assert out == "good.scene: no errors; 0 models, 0 references, 0 metrics, 0 expectations\n"
    assert err == ""
    assert main(["check", warned]) == 0
    assert "warning[W310]" in capsys.readouterr().err
    assert main(["check", bad]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("error[") == 2
    assert err.endswith("\n2 errors; more: dsl explain E209\n")
    assert main(["check", good, bad, good]) == 2
    assert capsys.readouterr().out.count("no errors") == 2


def test_standard_scenes_and_standard_input(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["check", "silicone-beam"]) == 0
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(BAD.encode())))
    assert main(["check", "-"]) == 2
    assert "--> <stdin>:1:15" in capsys.readouterr().err


def test_overrides_get_the_same_checks(capsys: pytest.CaptureFixture[str]) -> None:
    good = written("good.scene", GOOD)
    assert main(["check", good, "-p", "L=120mm"]) == 0
    assert main(["check", good, "-p", "L=120"]) == 2
    assert "--> -p L=120:1:3" in capsys.readouterr().err


def test_diagnostics_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    """One object a line on standard output with the fields of the contract; nothing on standard error."""
    assert main(["check", written("bad.scene", BAD), "--diagnostics", "json"]) == 2
    out, err = capsys.readouterr()
    assert err == ""
    objects = [json.loads(line) for line in out.splitlines()]
    required = {"code", "severity", "message", "file", "line", "column", "end_line", "end_column", "help"}
    assert all(required <= set(o) for o in objects)
    first = objects[0]
    assert {k: first[k] for k in required} == {
        "code": "E209", "severity": "error", "message": "`mn` is not a known unit", "file": "bad.scene",
        "line": 1, "column": 15,
        "end_line": 1, "end_column": 17, "help": "write `mN`: upper and lower case differ in units",
    }  # fmt: skip
    assert main(["check", written("warned.scene", WARNED), "--diagnostics", "json"]) == 0
    (warning,) = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert (warning["code"], warning["severity"]) == ("W310", "warning")
    assert main(["check", "nowhere.scene", "--diagnostics", "json"]) == 2
    (missing,) = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert (missing["code"], missing["line"], missing["column"]) == ("E401", None, None)


FILES = [
    ("empty", b"", "E223", "declares nothing"),
    ("only a comment", b"# nothing\n", "E223", "declares nothing"),
    ("a NUL", b"param a = 3\0\n", "E125", "not a text file"),
    ("a program", b"\x7fELF\x02\x01\x01" + bytes(range(256)) * 100, "E125", "not a text file"),
    ("an image", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + os.urandom(2000), "E125", "not a text file"),
    ("no UTF-8", b'scene "B\xe4lkchen"\n', "E401", "byte 0xe4 in line 1"),
    ("UTF-16", "param a = 3\n".encode("utf-16"), "E401", "UTF-16"),
    ("30 MB", b"# comment\n" * 3_000_000, "E401", "larger than 1 MB"),
]


@pytest.mark.parametrize(("content", "code", "words"), [f[1:] for f in FILES], ids=[f[0] for f in FILES])
def test_files_that_are_no_scenes(content: bytes, code: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", written("file.scene", content)]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"error[{code}]: ")
    assert err.count("error[") == 1
    assert words in err


@pytest.mark.parametrize(
    ("name", "words"),
    [("nowhere.scene", "there is no file nowhere.scene"), (".", ". is a folder"), (".", "none there ends in .scene"),
     ("silicon-beam", "did you mean `silicone-beam`?"),
     ("", "the name of the scene is empty"), (" ", "the name of the scene is empty"),
     ("a" * 5000, "there is no file"), ("with\nline.scene", "there is no file"),
     ("pipe", "not a regular file")],
)  # fmt: skip
def test_names_that_are_no_files(name: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo("pipe")
    assert main(["check", name]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error[E401]: ")
    assert err.count("error[") == 1
    assert words in err


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read everything")
def test_a_file_that_may_not_be_read(capsys: pytest.CaptureFixture[str]) -> None:
    Path(written("secret.scene", GOOD)).chmod(0)
    assert main(["check", "secret.scene"]) == 2
    assert "permission denied" in capsys.readouterr().err


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + GOOD,  # a byte order mark
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.rstrip("\n"),
        "param L = 178\u00a0mm\n",  # a no-break space before the unit
        "# 日本語 и ελληνικά\n" + GOOD,
    ],
)
def test_texts_from_every_editor(text: str) -> None:
    assert main(["check", written("file.scene", text)]) == 0


def test_the_message_survives_a_terminal_without_unicode() -> None:
    """What cannot be encoded is replaced; the message is still there."""
    name = written("file.scene", "param µ = 3\n")
    environment = os.environ | {"PYTHONIOENCODING": "ascii:replace", "NO_COLOR": "1"}
    command = [sys.executable, "-m", "softmark.interpreter", "check", name]
    done = subprocess.run(command, capture_output=True, env=environment, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith(b"error[E130]: ")


def test_a_path_in_the_scene_is_taken_from_its_folder(tmp_path: Path) -> None:
    (tmp_path / "scenes").mkdir()
    written("scenes/base.scene", "param k = 3\n")
    written("scenes/main.scene", 'use "base.scene" as base\nparam twice = 2 * base.k\n')
    assert main(["check", "scenes/main.scene"]) == 0


def test_checked_says_the_same_as_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    scene, found = load_scene(Source("bad.scene", BAD), Path(), None)
    assert scene is None
    assert [d.code for d in found] == ["E209", "E201"]
    main(["check", written("bad.scene", BAD), "--diagnostics", "json"])
    said = [json.loads(line)["message"] for line in capsys.readouterr().out.splitlines()]
    assert said == [d.message for d in found]
