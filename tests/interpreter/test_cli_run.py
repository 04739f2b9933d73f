"""`dsl run` from outside: exit statuses, files, standard output, and nothing lost on the way."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from xml.etree import ElementTree

import pytest

import softmark
from softmark.interpreter.cli.commands.progress_line import Progress
from softmark.interpreter.cli.main import main
from softmark.interpreter.pipeline import reference_runs

DSL = [sys.executable, "-m", "softmark.interpreter"]
SMALL = """
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 10 mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 10)
reference theory = simo_reissner(beam)
probe axis = line(beam, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 5)
metric eta = relative_l2_error(axis, against = theory)
"""


def dsl(*arguments: str, cwd: Path, text: str = "") -> subprocess.CompletedProcess[str]:
    """What the command says and returns, called here: what begins and ends a process of its own is `outside`."""
    out, err, given = io.StringIO(), io.StringIO(), io.TextIOWrapper(io.BytesIO(text.encode()))
    with chdir(cwd), redirect_stdout(out), redirect_stderr(err), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdin", given)
        status = main(arguments)
    return subprocess.CompletedProcess(arguments, status, out.getvalue(), err.getvalue())


def outside(
    *arguments: str, cwd: Path, text: str | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*DSL, *arguments],
        cwd=cwd,
        input=text,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


def written(folder: Path, text: str) -> str:
    (folder / "my.scene").write_text(text, encoding="utf-8")
    return "my.scene"


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("extra", "status"),
    [
        ("expect rod.eta < 10 %\n", 0),
        ("expect rod.eta > 10 %\n", 1),
        ("expect rod.etta > 10 %\n", 2),
        ("support all = fixed(beam, where = x <= 100 mm)\n", 2),
        ("analysis hopeless = static(max_iterations = 1)\n", 3),
    ],
)
def test_exit_status(tmp_path: Path, extra: str, status: int) -> None:
    done = outside("run", written(tmp_path, SMALL + extra), cwd=tmp_path)
    assert done.returncode == status, done.stderr
    assert "Traceback" not in done.stdout + done.stderr


def test_report_files_lie_in_a_folder_named_after_the_scene(tmp_path: Path) -> None:
    done = dsl("run", written(tmp_path, SMALL), cwd=tmp_path)
    folder = tmp_path / "my-report"
    assert sorted(f.name for f in folder.iterdir()) == ["kept", "report.html", "report.json"]
    assert "my-report" in done.stdout
    assert json.loads((folder / "report.json").read_text())["models"]["rod"]["status"] == "converged"


def test_json_alone_on_standard_output(tmp_path: Path) -> None:
    done = dsl("run", "-", "--json", "-", cwd=tmp_path, text=SMALL)
    assert json.loads(done.stdout)["schema"] == "softmark-report/1"
    assert list(tmp_path.iterdir()) == []


def test_json_to_a_file(tmp_path: Path) -> None:
    dsl("run", written(tmp_path, SMALL), "--json", "out.json", cwd=tmp_path)
    assert json.loads((tmp_path / "out.json").read_text())["schema"] == "softmark-report/1"


def test_overrides_reach_fields_and_parameters(tmp_path: Path) -> None:
    name = written(tmp_path, "param n = 10\n" + SMALL.replace("segments = 10", "segments = n"))
    done = dsl("run", name, "-p", "n=7", "-p", "gel.young=90kPa", "--json", "-", cwd=tmp_path)
    data = json.loads(done.stdout)
    assert data["models"]["rod"]["size"]["elements"] == 7
    assert data["scene"]["parameters"]["n"]["value"] == 7


def test_a_wrong_override_is_shown_in_the_argument(tmp_path: Path) -> None:
    done = dsl("run", written(tmp_path, SMALL), "-p", "gel.young=90 mm", cwd=tmp_path)
    assert done.returncode == 2
    assert "gel.young=90 mm" in done.stderr
    assert "E204" in done.stderr


def test_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    done = dsl("run", written(tmp_path, SMALL), "--out", "taken/report", cwd=tmp_path)
    assert done.returncode == 2  # found before anything is computed
    assert "E404" in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("place", ["/nonexistent/x.json", ".", ""])
def test_json_that_cannot_be_written(tmp_path: Path, place: str) -> None:
    done = dsl("run", written(tmp_path, SMALL), "--json", place, cwd=tmp_path)
    assert done.returncode == 2
    assert "E404" in done.stderr
    assert "--json" in done.stderr


@pytest.mark.long
@pytest.mark.slow
def test_interruption_keeps_what_was_finished(tmp_path: Path) -> None:
    # the rod takes milliseconds, the fine mesh half a minute: the interrupt arrives between
    small = "model small = fem(tet4, strain = finite, size = 20 mm)\n"  # compiles, so that the interrupt meets a solve
    outside("run", "-", "--json", "-", cwd=tmp_path, text=SMALL + small)
    slow = SMALL + "model slow = fem(tet4, strain = finite, size = 1.5 mm)\n"
    name = written(tmp_path, slow)
    process = subprocess.Popen(
        [*DSL, "run", name], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    kept = tmp_path / "my-report" / "report.json"
    deadline = time.monotonic() + 120
    while not kept.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130, errors
    assert "interrupted" in errors
    data = json.loads(kept.read_text())
    assert data["partial"] is True
    assert data["models"]["rod"]["status"] == "converged"


@pytest.mark.long
@pytest.mark.slow
def test_first_run_says_that_it_compiles(tmp_path: Path) -> None:
    text = SMALL + "model solid = fem(tet4, strain = small, size = 10 mm)\n"
    first = outside("run", written(tmp_path, text), cwd=tmp_path, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert "compiling kernels, once for this version ..." in first.stderr
    assert re.search(r"^  compiling kernels: [1-9]\d*, \d+ s$", first.stderr, re.MULTILINE)
    second = outside("run", "my.scene", cwd=tmp_path, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert "compiling kernels" not in second.stderr


SOLID = "model solid = fem(tet4, strain = small, size = 10 mm)\n"


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("model", ["", pytest.param(SOLID, marks=pytest.mark.slow)], ids=["rod", "kernels"])
def test_no_home_and_no_cache(tmp_path: Path, model: str) -> None:
    (tmp_path / "cache").write_text("not a folder")
    done = outside(
        "run",
        written(tmp_path, SMALL + model),
        cwd=tmp_path,
        XDG_CACHE_HOME=str(tmp_path / "cache"),
        HOME="/nonexistent",
    )
    assert done.returncode == 0, done.stderr


def test_unknown_command_and_option(tmp_path: Path) -> None:
    done = outside("rnu", "silicone-beam", cwd=tmp_path)
    assert done.returncode == 2
    assert "did you mean `dsl run`" in done.stderr
    assert outside("run", "silicone-beam", "--modle", "rod", cwd=tmp_path).returncode == 2


def test_missing_scene_is_one_clear_error(tmp_path: Path) -> None:
    done = dsl("run", "silicone-baem", cwd=tmp_path)
    assert done.returncode == 2
    assert "did you mean `silicone-beam`" in done.stderr


def test_new_scene_checks_and_runs(tmp_path: Path) -> None:
    template = dsl("new", cwd=tmp_path).stdout
    (tmp_path / "new.scene").write_text(template)
    done = dsl("run", "new.scene", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_new_scenes_come_with_what_they_read(tmp_path: Path) -> None:
    """In a folder, none of whose files is replaced; on the terminal the scene alone, and a word about the rest."""
    done = dsl("new", "pull", "--out", "mine", cwd=tmp_path)
    assert done.returncode == 0
    assert sorted(f.name for f in (tmp_path / "mine").iterdir()) == ["pull.csv", "pull.scene"]
    assert dsl("check", "mine/pull.scene", cwd=tmp_path).returncode == 0
    again = dsl("new", "pull", "--out", "mine", cwd=tmp_path)
    assert again.returncode == 2
    assert "exists already" in again.stderr
    printed = dsl("new", "pull", cwd=tmp_path)
    assert "`dsl new pull --out DIR` writes both" in printed.stderr
    assert printed.stdout == (tmp_path / "mine" / "pull.scene").read_text()
    listed = dsl("new", "--list", cwd=tmp_path).stdout
    names = [line.partition(":")[0] for line in listed.splitlines() if line and not line.startswith(" ")]
    assert {"beam", "pull", "press", "inclusion", "actuator", "organ", "network"} <= set(names)
    title = "My tensile test: a law against a measured curve of force over displacement"
    assert f"pull: {title}\n  A strip is gripped" in listed
    assert "  writes pull.scene, pull.csv\n" in listed
    assert dsl("new", "pull", "--list", cwd=tmp_path).stdout in listed


def test_fmt_writes_only_what_it_can_keep(tmp_path: Path) -> None:
    name = written(tmp_path, "# a comment\nparam   L=3 mm # its length\n")
    assert dsl("fmt", "--check", name, cwd=tmp_path).returncode == 1
    assert dsl("fmt", name, cwd=tmp_path).returncode == 0
    assert (tmp_path / name).read_text() == "# a comment\nparam L = 3 mm  # its length\n"
    assert dsl("fmt", "--check", name, cwd=tmp_path).returncode == 0
    (tmp_path / name).write_text("param L = = 3 mm\n")
    assert dsl("fmt", name, cwd=tmp_path).returncode == 2
    assert (tmp_path / name).read_text() == "param L = = 3 mm\n"


def test_junit_file(tmp_path: Path) -> None:
    name = written(tmp_path, SMALL + "expect rod.eta < 10 %\nexpect rod.eta > 10 %\n")
    done = dsl("run", name, "--junit", "junit.xml", cwd=tmp_path)
    assert done.returncode == 1
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("4", "1", "0")
    (failure,) = suite.findall("*/failure")
    assert "rod.eta > 10 %" in str(failure.get("message"))
    known = {case.get("name"): properties(case) for case in suite.findall("testcase")}
    missed = known["rod.eta > 10 %"]
    assert {key: missed[key] for key in ("metric", "unit", "relation", "limit", "reference")} == {
        "metric": "rod.eta", "unit": "1", "relation": ">", "limit": "0.1", "reference": "theory",
    }  # fmt: skip
    assert known["rod converges"]["eta"] == missed["value"]
    assert float(missed["stated_error"]) > 0
    assert properties(suite)["softmark"] == softmark.__version__


def properties(element: ElementTree.Element) -> dict[str | None, str]:
    return {p.get("name"): str(p.get("value")) for p in element.findall("properties/property")}


def test_a_device_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    done = dsl("run", written(tmp_path, SMALL), "--json", os.devnull, cwd=tmp_path)
    assert done.returncode == 0
    assert not Path(os.devnull).is_file()


@pytest.mark.slow
def test_a_missing_data_set_leaves_the_models_and_is_named(tmp_path: Path) -> None:
    scan = 'reference ct = surface("data:silicone-beam/truthCylinder-Deformed.obj", unit = 1 m, uncertainty = 1 mm)\n'
    gap = "probe skin = surface(beam, size = 5 mm)\nmetric gap = surface_distance(skin, against = ct)\n"
    unreachable = dict.fromkeys(("http_proxy", "https_proxy", "HTTPS_PROXY", "HTTP_PROXY"), "http://127.0.0.1:9")
    done = outside(
        "run", written(tmp_path, SMALL + scan + gap), cwd=tmp_path,
        SOFTMARK_DATA=str(tmp_path / "nothing"), XDG_CACHE_HOME=str(tmp_path / "cache"), **unreachable,
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    assert "truthCylinder-Deformed.obj" in done.stdout + done.stderr
    assert "SOFTMARK_DATA" in done.stdout + done.stderr
    data = json.loads((tmp_path / "my-report" / "report.json").read_text())
    assert data["models"]["rod"]["metrics"]["eta"]["value"] > 0
    assert data["models"]["rod"]["metrics"]["gap"]["value"] is None
    assert data["references"]["ct"]["status"] == "failed"
    assert data["references"]["theory"]["status"] == "converged"


@pytest.mark.parametrize(
    ("probe", "code"),
    [
        ("surface(beam, size = 5 mm, where = x > 200 mm)", "E302"),
        ("mesh_nodes(beam, mesh = mesh(NAME, unit = 1 mm))", "E403"),
    ],
)
def test_a_probe_that_cannot_be_placed_is_an_error_of_the_scene(tmp_path: Path, probe: str, code: str) -> None:
    (tmp_path / "bad.vtk").write_text("no mesh")
    text = f"probe there = {probe}\n".replace("NAME", '"bad.vtk"')
    done = dsl("run", written(tmp_path, SMALL + text), cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert f"error[{code}]" in done.stderr
    assert "defect" not in done.stderr


class Screen(io.StringIO):
    """What a terminal is sent."""

    def isatty(self) -> bool:
        return True


def test_a_reference_is_named_at_once_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even right after something else was said: it may say nothing more before it ends."""
    monkeypatch.setenv("TERM", "xterm")
    progress = Progress(Screen())
    progress.say("start", "running my.scene")
    progress.say("prepare", "rod")  # within a tenth of a second
    progress.say("reference", "theory")
    assert progress.stream.getvalue().split("\r\x1b[K")[1:] == ["running my.scene", "  reference theory"]


def test_a_slow_reference_says_how_long_it_took(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference_runs, "SLOW", 0.0)
    done = dsl("run", written(tmp_path, SMALL), cwd=tmp_path)
    assert re.search(r"^  reference theory: \d+ s$", done.stderr, re.MULTILINE)
