"""What is written never takes the place of what is read or written elsewhere: refused before anything runs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from softmark.interpreter.cli.main import main

SCENE = """
use "tissues.scene" as tissue
body     beam   = solid(cylinder(length = 200 mm, radius = 20 mm), tissue.gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = 4)
reference theory = simo_reissner(beam)
reference beads = markers("beads.csv", unit = 1 mm, uncertainty = 1 mm)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (200, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
"""
TISSUES = "material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)\n"
OTHER = 'markers("beads.csv"', 'surface("my-report/vtu/rod.vtu"'
BEADS = "x0,y0,z0,x1,y1,z1\n0,0,0,0,0,0\n100,0,0,100,0,-10\n200,0,0,200,0,-30\n"


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("my.scene", SCENE), ("tissues.scene", TISSUES), ("beads.csv", BEADS)):
        Path(name).write_text(text, encoding="utf-8")
    Path("linked.scene").symlink_to("my.scene")
    os.link("my.scene", "hard.scene")


def contents() -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in sorted(Path().rglob("*")) if p.is_file()}


@pytest.mark.parametrize("options", [
    "--json my.scene", "--json ./my.scene", "--json linked.scene", "--json hard.scene", "--junit my.scene",
    "--json tissues.scene", "--junit beads.csv", "--json same --junit same", "--json same --junit ./same",
    "--out here --json here/report.json", "--out here --junit here/report.html",
])  # fmt: skip
def test_a_run_that_would_lose_a_file_is_refused(options: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = contents()
    assert main(["run", "my.scene", *options.split()]) == 2
    said = capsys.readouterr().err
    assert "error[E394]: " in said
    assert "choose another path with --j" in said
    assert contents() == before, "nothing is written, not even a folder"
    assert not Path("here").exists()


@pytest.mark.parametrize("command", ["compare", "stress"])
@pytest.mark.parametrize("place", ["my.scene", "tissues.scene", "here/{}.json", "here/{}.html", "here/journal.jsonl"])
def test_a_study_that_would_lose_a_file_is_refused(
    command: str, place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents()
    assert main([command, "my.scene", "--out", "here", "--json", place.format(command)]) == 2
    assert "error[E394]: " in capsys.readouterr().err
    assert contents() == before


def test_what_changed_between_two_results_is_not_written_over_one(capsys: pytest.CaptureFixture[str]) -> None:
    Path("old.json").write_text("{}", encoding="utf-8")
    Path("new.json").write_text("{}", encoding="utf-8")
    assert main(["compare", "old.json", "new.json", "--json", "old.json"]) == 2
    assert "error[E394]: " in capsys.readouterr().err
    assert Path("old.json").read_text(encoding="utf-8") == "{}"


def test_a_mesh_below_the_report_is_not_written_over(capsys: pytest.CaptureFixture[str]) -> None:
    Path("my-report/vtu").mkdir(parents=True)
    Path("my-report/vtu/rod.vtu").write_text("read", encoding="utf-8")
    Path("my.scene").write_text(SCENE.replace(*OTHER), encoding="utf-8")
    assert main(["run", "my.scene", "--vtu"]) == 2
    assert "error[E394]: " in capsys.readouterr().err


@pytest.mark.parametrize("name", ["report.json", "report.html"])
def test_a_folder_where_a_file_should_go_is_found_before_the_run(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("here", name).mkdir(parents=True)
    assert main(["run", "my.scene", "--model", "rod", "--out", "here"]) == 2
    said = capsys.readouterr()
    assert f"error[E404]: cannot write here/{name}: it is a folder" in said.err
    assert "eta" not in said.out


def test_devices_keep_nothing_and_may_be_named_twice() -> None:
    assert main(["run", "my.scene", "--model", "rod", "--json", "/dev/null", "--junit", "/dev/null"]) in (0, 3)


@pytest.mark.parametrize("command", ["run", "compare", "stress"])
def test_an_empty_name_is_not_the_working_folder(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = contents()
    with pytest.raises(SystemExit) as stop:
        main([command, "my.scene", "--out", ""])
    assert stop.value.code == 2
    assert "the name of the folder is empty" in capsys.readouterr().err
    assert contents() == before
