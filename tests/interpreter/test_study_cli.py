"""`dsl compare` and `softmark.compare` from end to end: files, exit statuses, what is refused, what is gone on with."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.study.configurations import configuration_task
from softmark.interpreter.study.workers import worker_pool
from softmark.interpreter.study.workers.task_journal import JournalRefused

BEAM = """
scene "A rod and its segments"
param    L      = 178 mm
param    n      = 4
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = L, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = n)
model    stiff  = beam6dof(segments = 6, shear = no, axial = no)
reference theory = elastica(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
study    finer  = sweep(n, over = [4, 8, 16])
study    order  = convergence(eta, over = finer)
study    trade  = pareto(error = eta, over = finer)
expect rod.eta < 0.1 %
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    # the lock of this machine's timings: another comparison may hold it for long
    monkeypatch.setattr(
        "softmark.interpreter.study.timing.timing_rounds.lock_file", lambda: tmp_path.parent / "timing.lock"
    )
    scene = tmp_path / "beam.scene"
    scene.write_text(BEAM, encoding="utf-8")
    return scene


def journal(folder: str | Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in Path(folder, "journal.jsonl").read_text(encoding="utf-8").splitlines()][1:]


def compared(*arguments: str, status: int = 0) -> dict[str, Any]:
    """The comparison that a command writes."""
    assert main(["compare", *arguments, "--json", "found.json"]) == status
    found: dict[str, Any] = json.loads(Path("found.json").read_text(encoding="utf-8"))
    return found


# ------------------------------------------------------------------ the result


@pytest.mark.slow
@pytest.mark.long
def test_a_comparison_from_end_to_end(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The study's three, and the model that it does not touch.

    An expectation that is not met plays no part: `dsl run` judges it.
    """
    found = compared("beam.scene", "--repeats", "0")
    shown = capsys.readouterr()
    assert found == json.loads(Path("beam-comparison/compare.json").read_text(encoding="utf-8"))
    assert Path("beam-comparison/compare.html").read_text(encoding="utf-8").lower().startswith("<!doctype html>")
    assert "beam-comparison/compare.html" in shown.out
    assert found["schema"] == "softmark-compare/1"
    assert set(found) == {
        "schema", "created", "environment", "command", "scenes", "studies", "points", "references", "analysis",
    }  # fmt: skip
    assert [p["label"] for p in found["points"]] == ["stiff", "rod, n = 4", "rod, n = 8", "rod, n = 16"]
    assert [p["study"] for p in found["points"]] == [None, "finer", "finer", "finer"]
    for point in found["points"]:
        assert {"key", "scene", "model", "label", "study", "variation", "numbers", "status", "message", "outline",
                "size", "solve", "errors", "probes", "cost", "warnings"} <= set(point)  # fmt: skip
        assert point["status"] == "converged"
    assert found["points"][1]["variation"] == {"n": "4"}
    assert found["points"][1]["numbers"] == {"n": 4.0}
    assert found["references"]["beam"]["theory"]["status"] == "converged"
    assert found["studies"]["beam"]["trade"] == {"kind": "pareto", "error": "eta", "cost": None, "over": "finer"}
    assert found["scenes"][0]["title"] == "A rod and its segments"


@pytest.mark.long
@pytest.mark.slow
def test_a_model_is_timed_once_the_second_time_from_the_journal(file: Path) -> None:
    arguments = ("beam.scene", "--vary", "n=4", "--model", "rod", "--repeats", "1")
    found = compared(*arguments)
    assert found["points"][0]["cost"]["cpu_s"]["median"] > 0
    before = journal("beam-comparison")
    assert {e["kind"] for e in before} == {"accuracy", "timing"}
    again = compared(*arguments, "--resume")
    assert journal("beam-comparison") == before, "nothing was computed or timed again"
    assert again["points"] == found["points"]


@pytest.mark.slow
@pytest.mark.long
def test_json_on_standard_output_is_alone_there(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "beam.scene", "--repeats", "0", "--study", "finer", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [p["label"] for p in found["points"]] == ["stiff", "rod, n = 4", "rod, n = 8", "rod, n = 16"]
    assert all(p["cost"] is None for p in found["points"])


@pytest.mark.slow
def test_two_scenes_in_one_comparison(file: Path) -> None:
    Path("other.scene").write_text(BEAM.replace("L      = 178 mm", "L      = 200 mm"), encoding="utf-8")
    found = compared("beam.scene", "other.scene", "--repeats", "0", "--model", "stiff", "--out", "both")
    assert [(p["scene"], p["model"]) for p in found["points"]] == [("beam", "stiff"), ("other", "stiff")]
    assert set(found["references"]) == {"beam", "other"}
    assert found["points"][0]["key"] != found["points"][1]["key"]


@pytest.mark.slow
def test_what_has_changed_between_two_results(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for n, name in (("4", "a"), ("5", "b")):
        assert main(["compare", "beam.scene", "-p", f"gel.young={n}0kPa", "--vary", "n=4", "--repeats", "0",
                     "--json", f"{name}.json", "--out", name]) == 0  # fmt: skip
    capsys.readouterr()
    assert main(["compare", "a.json", "a.json"]) == 0
    assert "No changes" in capsys.readouterr().out
    assert main(["compare", "a.json", "b.json"]) == 0
    assert "eta" in capsys.readouterr().out
    assert main(["compare", "a.json", "b.json", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["schema"] == "softmark-changes/1"


# ------------------------------------------------------------------ what goes wrong


@pytest.mark.slow
def test_a_variation_in_error_is_a_failed_point_and_status_3(file: Path) -> None:
    found = compared("beam.scene", "--vary", "L=100mm,200mm", "--model", "rod", "--repeats", "0", status=3)
    assert [p["status"] for p in found["points"]] == ["failed", "converged"]
    assert found["points"][0]["message"].startswith("E504: `axis` is evaluated at")


@pytest.mark.slow
def test_a_reference_that_fails_is_status_3(file: Path) -> None:
    Path("scan.obj").write_text("nothing of a surface\n", encoding="utf-8")
    text = BEAM + 'reference scan = surface("scan.obj", unit = 1 mm, uncertainty = 0.1 mm)\n'
    file.write_text(text, encoding="utf-8")
    found = compared("beam.scene", "--model", "stiff", "--repeats", "0", status=3)
    assert [p["status"] for p in found["points"]] == ["converged"]
    assert found["references"]["beam"]["scan"]["status"] == "failed"


def test_a_configuration_that_takes_too_long_is_tried_again_only_with_more_time(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock is staged: 9 segments take 5 s."""

    def staged(given: list[dict[str, Any]], jobs: int, timeout: float, started: object) -> Iterator[dict[str, Any]]:
        for task in given:
            late = task.overrides == ("n=9",) and timeout < 5
            yield worker_pool.timed_out_outcome(task, timeout) if late else configuration_task.perform(task)

    monkeypatch.setattr(worker_pool, "run_tasks", staged)
    arguments = ("beam.scene", "--vary", "n=4,9", "--model", "rod", "--repeats", "0")
    found = compared(*arguments, "--timeout", "1", status=3)
    assert [p["status"] for p in found["points"]] == ["converged", "timed_out"]
    assert found["points"][1]["message"] == "it was stopped after 1 s; increase `--timeout`"
    assert len(journal("beam-comparison")) == 2
    compared(*arguments, "--timeout", "1", "--resume", status=3)
    assert len(journal("beam-comparison")) == 2, "no more time, no other try"
    found = compared(*arguments, "--timeout", "6", "--resume")
    assert [e["repeat"] for e in journal("beam-comparison")] == [0, 0, 1]
    assert [p["status"] for p in found["points"]] == ["converged", "converged"]


@pytest.mark.slow
def test_a_folder_with_finished_tasks_is_refused_unless_told(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["compare", "beam.scene", "--vary", "n=4,5", "--model", "rod", "--repeats", "0"]
    assert main(arguments) == 0
    first = journal("beam-comparison")
    capsys.readouterr()
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert "contains 2 finished tasks of this comparison" in said
    assert "`--resume`" in said
    assert "`--fresh`" in said
    assert journal("beam-comparison") == first
    assert main([*arguments, "--fresh"]) == 0
    renewed = journal("beam-comparison")
    assert [e["key"] for e in renewed] == [e["key"] for e in first]
    assert [e["outcome"]["wall_s"] for e in renewed] != [e["outcome"]["wall_s"] for e in first]


@pytest.mark.slow
def test_an_unfinished_journal_is_gone_on_with(file: Path) -> None:
    """The first three of four values are there; the fourth is added, and the order is that of the request."""
    compared("beam.scene", "--vary", "n=4,5,6", "--model", "rod", "--repeats", "0")
    first = journal("beam-comparison")
    found = compared("beam.scene", "--vary", "n=3,4,5,6", "--model", "rod", "--repeats", "0", "--resume")
    assert journal("beam-comparison")[:3] == first
    assert len(journal("beam-comparison")) == 4
    assert [p["label"] for p in found["points"]] == ["rod, n = 3", "rod, n = 4", "rod, n = 5", "rod, n = 6"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["beam.scene", "other.json"], "two JSON files"),
        (["one.json"], "two JSON files"),
        (["one.json", "two.json"], "cannot be read"),
        (["beam.scene", "--vary", "m=3"], "E201"),
        (["beam.scene", "--model", "bar"], "E201"),
        (["beam.scene", "--study", "finr"], "studies: finer, order, trade"),
        (["nothing.scene"], "E401"),
        (["beam.scene", "--out", "beam.scene"], "E404"),
        (["beam.scene", "--json", "no/such/folder.json"], "E404"),
    ],
)
def test_requests_that_are_refused(
    arguments: list[str], said: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", *arguments, "--repeats", "0"]) == 2
    assert said in capsys.readouterr().err
    assert sorted(p.name for p in file.parent.iterdir()) == ["beam.scene"], "nothing is left behind"


@pytest.mark.parametrize(
    "arguments",
    [["--jobs", "0"], ["--timeout", "-1"], ["--timeout", "nan"], ["--repeats", "x"], ["--resume", "--fresh"],
     ["--jobs", "2", "--cluster", "tcp://127.0.0.1:9"]],
)  # fmt: skip
def test_options_that_are_refused(arguments: list[str], file: Path) -> None:
    with pytest.raises(SystemExit) as left:
        main(["compare", "beam.scene", *arguments])
    assert left.value.code == 2


def test_a_cluster_that_does_not_answer(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def nobody(address: str, wait: float) -> None:
        raise worker_pool.NoWorkers(f"no dask scheduler responds at {address}")

    monkeypatch.setattr(worker_pool, "_connect_client", nobody)
    assert main(["compare", "beam.scene", "--cluster", "tcp://127.0.0.1:9"]) == 2
    assert "no dask scheduler responds" in capsys.readouterr().err


# ------------------------------------------------------------------ from Python


@pytest.mark.slow
def test_the_same_from_python(file: Path) -> None:
    scene = softmark.load(file)
    found = softmark.compare(scene, vary={"n": ["4", "8"]}, models=["rod"], repeats=0)
    assert [p["label"] for p in found.points] == ["rod, n = 4", "rod, n = 8"]
    assert found.exit_status == 0
    assert found.to_json()["analysis"] == found.analysis
    assert set(found.analysis["scenes"]) == {"beam"}
    assert sorted(p.name for p in file.parent.iterdir()) == ["beam.scene"]


@pytest.mark.slow
def test_python_keeps_a_folder_that_is_named(file: Path) -> None:
    softmark.compare(file, vary={"n": "4"}, models=["rod"], repeats=0, folder="kept")
    assert len(journal("kept")) == 1
    with pytest.raises(JournalRefused, match="--resume"):
        softmark.compare(file, vary={"n": "4"}, models=["rod"], repeats=0, folder="kept")
    found = softmark.compare(file, vary={"n": "4"}, models=["rod"], repeats=0, folder="kept", resume=True)
    assert len(found.points) == 1
