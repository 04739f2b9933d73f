"""`--diagnostics github|sarif`: what a pull request shows, read back by the rules of those who read it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.tree import Span
from softmark.interpreter.cli.main import main
from softmark.interpreter.help.codes import pages
from softmark.interpreter.help.diagnostic_formats import FORMATS, LocatedDiagnostic, format_diagnostics
from softmark.interpreter.validation.scene_loader import load_scene

BAD = "param L = 178 mn\nparam R = S\n"
NAME = "sub, dir/100%: a µ.scene"
GOLDEN = Path(__file__).parents[1] / "errors"
SCHEMA = Path(__file__).parent / "sarif" / "sarif-2.1.0.json"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    Path(NAME).parent.mkdir()
    Path(NAME).write_text(BAD, encoding="utf-8")


def said(capsys: pytest.CaptureFixture[str], *command: str) -> str:
    """Standard output of a command that leaves standard error empty."""
    assert main(list(command)) == 2
    out, err = capsys.readouterr()
    assert err == ""
    return out


def read_back(line: str) -> tuple[str, dict[str, str], str]:
    """Name, properties and message of a command, as the runner of workflows takes it apart (ActionCommand)."""
    assert line.startswith("::")
    head, _, data = line[2:].partition("::")
    name, _, told = head.partition(" ")
    properties = dict(item.split("=", 1) for item in told.split(","))
    escapes = {"%0D": "\r", "%0A": "\n", "%3A": ":", "%2C": ",", "%25": "%"}  # that of `%` comes last
    for code, sign in escapes.items():
        properties = {key: value.replace(code, sign) for key, value in properties.items()}
        data = data if sign in ":," else data.replace(code, sign)
    return name, properties, data


def test_annotations_of_a_workflow(capsys: pytest.CaptureFixture[str]) -> None:
    first, second = map(read_back, said(capsys, "check", NAME, "--diagnostics", "github").splitlines())
    assert first == (
        "error",
        {"file": NAME, "line": "1", "endLine": "1", "col": "15", "endColumn": "17", "title": "E209"},
        f"`mn` is not a known unit\nhelp: write `mN`: upper and lower case differ in units\n{NAME}:1:15",
    )
    assert second[1]["line"] == "2"


def test_files_are_named_from_the_root_of_the_workflow(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(Path(NAME).parent)
    for root, name in ((str(tmp_path), NAME), ("/nowhere", str(tmp_path / NAME)), ("", Path(NAME).name)):
        monkeypatch.setenv("GITHUB_WORKSPACE", root)
        out = said(capsys, "check", Path(NAME).name, "--diagnostics", "github")
        assert read_back(out.splitlines()[0])[1]["file"] == name


def test_what_several_scenes_use_is_said_once(capsys: pytest.CaptureFixture[str]) -> None:
    Path("base.scene").write_text(BAD, encoding="utf-8")
    for name in ("a.scene", "b.scene"):
        Path(name).write_text('use "base.scene" as base\n', encoding="utf-8")
    assert len(said(capsys, "check", "a.scene", "b.scene", "--diagnostics", "github").splitlines()) == 2
    (run,) = json.loads(said(capsys, "check", "a.scene", "b.scene", "--diagnostics", "sarif"))["runs"]
    assert {place(r)["artifactLocation"]["uri"] for r in run["results"]} == {"base.scene"}


def test_what_stands_in_no_file_belongs_to_the_scene(capsys: pytest.CaptureFixture[str]) -> None:
    Path("good.scene").write_text("param L = 178 mm\n", encoding="utf-8")
    ((_, properties, message),) = map(
        read_back, said(capsys, "check", "good.scene", "-p", "L=1", "--diagnostics", "github").splitlines()
    )
    assert properties == {"file": "good.scene", "title": "E204"}
    assert "in `-p L=1`" in message
    ((_, properties, _),) = map(
        read_back, said(capsys, "check", "a\n::stop-commands::b", "--diagnostics", "github").splitlines()
    )
    assert properties == {"title": "E401"}


def test_a_message_over_lines_has_no_columns() -> None:
    source = Source(NAME, BAD)
    told = LocatedDiagnostic(NAME, Diagnostic("W310", "50 %\r::error::no", source, Span(0, 20, 1, 1, 2, 3)))
    name, properties, message = read_back(format_diagnostics("github", [told]).rstrip("\n"))
    assert (name, properties) == ("warning", {"file": NAME, "line": "1", "endLine": "2", "title": "W310"})
    assert message.startswith("50 %")


def place(result: dict[str, Any]) -> dict[str, Any]:
    (location,) = result["locations"]
    found: dict[str, Any] = location["physicalLocation"]
    return found


def test_sarif(capsys: pytest.CaptureFixture[str]) -> None:
    """A rule for each code that occurs, with its page; files from the root; what help names as a change to the text."""
    log = json.loads(said(capsys, "check", NAME, "nowhere.scene", "--diagnostics", "sarif"))
    (run,) = log["runs"]
    assert (log["version"], run["columnKind"]) == ("2.1.0", "unicodeCodePoints")
    rules = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == ["E201", "E209", "E401"]
    assert all(rule["help"]["markdown"] == pages()[rule["id"]].text for rule in rules)
    unit, _, missing = run["results"]
    assert all(rules[r["ruleIndex"]]["id"] == r["ruleId"] and r["level"] == "error" for r in run["results"])
    artifact = place(unit)["artifactLocation"]
    assert artifact["uriBaseId"] in run["originalUriBaseIds"]
    assert unquote(artifact["uri"]) == NAME
    assert ":" not in artifact["uri"]
    assert place(unit)["region"] == {"startLine": 1, "startColumn": 15, "endLine": 1, "endColumn": 17}
    assert place(missing)["region"] == {"startLine": 1}
    assert "fixes" not in missing
    (fix,) = unit["fixes"]
    ((change,),) = (c["replacements"] for c in fix["artifactChanges"])
    assert (change["deletedRegion"], change["insertedContent"]) == (place(unit)["region"], {"text": "mN"})


def test_a_scene_without_faults_is_a_run_without_results(capsys: pytest.CaptureFixture[str]) -> None:
    Path("good.scene").write_text("param L = 178 mm\n", encoding="utf-8")
    assert main(["check", "good.scene", "--diagnostics", "sarif"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"][0]["results"] == []
    for name in ("json", "github"):
        assert format_diagnostics(name, []) == ""


MISSED = """
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 200 mm, radius = 20 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = 4)
reference theory = simo_reissner(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (200, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
expect   rod.eta < 0.0001 %
expect   rod.eta > 0 %
"""


def test_an_expectation_that_is_not_met_is_shown_at_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    Path("my.scene").write_text(MISSED, encoding="utf-8")
    assert main(["run", "my.scene", "--diagnostics", "github", "--json", "-", "--junit", "j.xml"]) == 1
    out, err = capsys.readouterr()
    json.loads(out)
    (command,) = (line for line in err.splitlines() if line.startswith("::"))
    name, properties, message = read_back(command)
    assert (name, properties) == ("error", {"file": "my.scene", "line": "10", "title": "expectation not met"})
    assert message.startswith("rod.eta < 0.0001 %; found 1.3")


@pytest.mark.slow
@pytest.mark.parametrize("part", range(2))
def test_every_golden_message_is_valid_sarif(part: int) -> None:
    """Against the schema of the standard; each message of a file has a place in it."""
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    validator = pytest.importorskip("jsonschema").Draft202012Validator(schema)
    told = []
    for file in sorted(GOLDEN.glob("*.scene"))[part::32]:
        found = load_scene(Source(str(file), file.read_text(encoding="utf-8", errors="replace")), file.parent, file)[1]
        told += [LocatedDiagnostic(str(file), diagnostic) for diagnostic in found]
    log = json.loads(format_diagnostics("sarif", told))
    assert not [error.message for error in validator.iter_errors(log)]
    assert all("uri" in place(r)["artifactLocation"] for r in log["runs"][0]["results"])
    assert set(FORMATS) == {"json", "github", "sarif"}
