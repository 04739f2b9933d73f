"""Stability studies carried out: by a worker that makes its answers up, and by the real one on a small scene."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.study.configurations.configuration_expansion import subject_of
from softmark.interpreter.study.configurations.task_outcome import PointTask
from softmark.interpreter.study.robustness import robustness_study, task_queue
from softmark.interpreter.study.robustness.robustness_record import Robustness
from softmark.interpreter.study.robustness.robustness_study import RobustnessRequest, run_robustness_studies
from softmark.interpreter.study.workers import worker_pool
from softmark.interpreter.study.workers.task_journal import JournalRefused

BEAM = """
scene "Two rods"
param    n      = 16
param    soft   = 1 in 0.1 .. 1
material gel    = neo_hookean(young = 60 MPa * soft, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = n)
model    stiff  = beam6dof(segments = 6, shear = no)
reference theory = simo_reissner(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
"""

# it speaks the lines of a worker, and answers by the overrides of its task
WORKER = """
import json, os, signal, sys, time
print(json.dumps({"ready": os.getpid()}), flush=True)
for line in sys.stdin:
    task = json.loads(line)
    values = dict(o.split("=") for o in task["overrides"])
    n, load = int(values.get("n", 16)), float(values.get("weight.magnitude", "9.81").split()[0])
    if n == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    while n == 1024 and "HANG" in os.environ:
        pass
    error = 0.01 if n >= 5 and load < 50 else 0.2
    status = "converged" if load < 900 else "not_converged"
    if task["model"] == "stiff":
        error = error + 0.1 if "soft" in values else error
    point = {"status": status, "message": "no equilibrium" if status != "converged" else None, "outline": "made up",
             "errors": {"eta": {"value": error, "unit": "1", "against": "theory"}},
             "warnings": [], "probes": {}, "stated": {"value": 0.3 if load > 50 else 0.0, "parts": {}, "doubts": []}}
    axis = {"points": [[0, 0, 0]], "displacement": [[0, 0, 1e-3]]}
    theory = {"status": "converged", "message": None, "estimated_error": 1e-9, "probes": {"axis": axis}}
    print(json.dumps({"key": task["key"], "point": point, "references": {"theory": theory}, "cpu_s": 0.5}), flush=True)
"""


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_pool, "WORKER", (sys.executable, "-c", WORKER))


def found_in(folder: Path, study: str, **more: Any) -> Robustness:
    subject = subject_of(softmark.loads(BEAM + study).scene)
    return run_robustness_studies(subject, RobustnessRequest(folder, **more))


def edges(found: Robustness) -> dict[tuple[str, str, str], dict[str, Any]]:
    return {(e.model, e.quantity, e.direction): e.to_json() for s in found.studies for e in s.edges}


# ------------------------------------------------------------------ made up


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.usefixtures("made_up")
def test_walks_edges_and_classes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The worker is right from 5 segments and below 50 m/s^2, says so of the load alone, and gives up at 900 m/s^2."""
    monkeypatch.setenv("HANG", "1")
    found = found_in(tmp_path, "study s = robustness(over = [n, weight.magnitude], maps = none)", jobs=2, timeout=0.5)
    own = edges(found)
    down = own["rod", "n", "down"]
    assert (down["last_right"], down["first_wrong"], down["class"]) == (5.0, 4.0, "silent")
    up = own["rod", "weight.magnitude", "up"]
    assert up["last_right"] < 50 <= up["first_wrong"] <= 1.2 * up["last_right"]
    assert up["last_answer"] < 900 <= up["first_silence"] <= 1.2 * up["last_answer"]
    assert (up["class"], up["silence"]) == ("inaccurate", "not_converged")
    assert own["rod", "weight.magnitude", "down"]["class"] is None
    assert ("stiff", "n", "down") not in own, "its segments are its own"
    dead = next(p for p in found.points if p.texts == {"n": "1"})
    assert (dead.found.word, str(dead.found.message).split(" (")[0]) == ("failed", "the process was killed")
    slow = next(p for p in found.points if p.texts == {"n": "1024"})
    assert slow.found.word == "timed_out"
    assert own["rod", "n", "up"]["last_right"] == 512.0
    assert {p.found.word for p in found.silent} == {"silent"}
    assert found.exit_status == 1
    summary = found.to_json()["summary"]
    assert summary["points"] == len(found.points) == sum(summary["classes"].values())
    keys = [(p.key, p.model) for p in found.points]
    assert len(keys) == len(set(keys)), "no point twice"
    json.loads(found.dumps())


@pytest.mark.usefixtures("made_up")
def test_maps_of_pairs(tmp_path: Path) -> None:
    found = found_in(tmp_path, "study s = robustness(over = [soft, weight.magnitude], models = [rod])")
    (only,) = found.studies[0].maps
    assert (only.model, only.x, only.y) == ("rod", "soft", "weight.magnitude")
    assert (only.xs[0], only.xs[-1], len(only.xs)) == (0.1, 1.0, 3)
    assert len(only.classes) == len(only.ys) == 6
    assert all(len(row) == len(only.xs) and None not in row for row in only.classes)
    assert only.classes[only.ys.index(9.81)][-1] == "right"
    none = found_in(tmp_path / "b", "study s = robustness(over = [soft], models = [rod], maps = none)")
    assert none.studies[0].maps == ()


@pytest.mark.usefixtures("made_up")
def test_resumed_nothing_is_computed_again(tmp_path: Path) -> None:
    study = "study s = robustness(over = [weight.magnitude], until = inaccuracy)"
    first = found_in(tmp_path, study)
    lines = (tmp_path / "journal.jsonl").read_text(encoding="utf-8")
    with pytest.raises(JournalRefused, match="--resume"):
        found_in(tmp_path, study)
    again = found_in(tmp_path, study, resume=True)
    assert (tmp_path / "journal.jsonl").read_text(encoding="utf-8") == lines
    assert again.studies == first.studies
    assert found_in(tmp_path, study, fresh=True).studies == first.studies


@pytest.mark.usefixtures("made_up")
def test_an_interrupt_keeps_what_is_finished(tmp_path: Path) -> None:
    said: list[str] = []

    def interrupt(what: str, detail: str) -> None:
        said.append(detail)
        if len(said) == 4:
            raise KeyboardInterrupt

    study = "study s = robustness(over = [weight.magnitude])"
    with pytest.raises(robustness_study.Interrupted, match=r"[345] points are saved in .*--resume"):
        found_in(tmp_path, study, say=interrupt)
    whole = found_in(tmp_path, study, resume=True)
    assert whole.studies == found_in(tmp_path / "other", study).studies


@pytest.mark.usefixtures("made_up")
def test_choices_and_remedies_from_other_models(tmp_path: Path) -> None:
    study = "study s = robustness(over = [stiff.shear, soft], until = inaccuracy, maps = none)"
    own = edges(found_in(tmp_path, study))
    assert own["stiff", "stiff.shear", "up"]["right"] == ["yes", "no"]
    wrong = own["stiff", "soft", "down"]
    assert (wrong["class"], wrong["last_right"]) == ("silent", 1.0)
    assert wrong["remedy"].endswith("right at that point: rod (made up)")


def test_without_a_study_every_number_is_walked(tmp_path: Path, made_up: None) -> None:
    found = found_in(tmp_path, "", models=("rod",))
    assert [s.name for s in found.studies] == ["everything"]
    names = [q.name for q in found.studies[0].quantities]
    assert names == ["soft", "gel.young", "gel.poisson", "gel.density", "weight.magnitude", "rod.segments",
                     "stiff.segments"]  # fmt: skip
    assert {e.model for e in found.studies[0].edges} == {"rod"}


def test_outcomes_that_had_too_little_time_are_tried_again(tmp_path: Path) -> None:
    from softmark.interpreter.study.workers.task_journal import Journal

    task, other = PointTask("a"), PointTask("b")
    with Journal.open(tmp_path) as journal:
        journal.append(task_queue.KIND, "a", outcome=worker_pool.timed_out_outcome(task, 5.0).to_json())
        journal.append(task_queue.KIND, "b", outcome=worker_pool.unfinished_outcome(other, "it was killed").to_json())

        def known(timeout: float) -> set[str]:
            return set(task_queue.TaskQueue(journal, 1, timeout, 4.0, lambda n, key: None).outcomes)

        assert known(5.0) == {"a"}
        assert known(6.0) == set()


@pytest.mark.parametrize("damaged", [{}, {"point": []}, {"point": {"status": 1}}, {"point": {"status": "converged"},
    "references": {"theory": {"sizes": [1]}}}, {"point": {"status": "converged", "warnings": [None]}}])  # fmt: skip
def test_a_damaged_outcome_is_computed_anew(tmp_path: Path, damaged: dict[str, Any]) -> None:
    from softmark.interpreter.study.workers.task_journal import Journal

    with Journal.open(tmp_path) as journal:
        journal.append(task_queue.KIND, "a", outcome=damaged)
        assert task_queue.TaskQueue(journal, 1, 5.0, 4.0, lambda n, key: None).outcomes == {}


# ------------------------------------------------------------------ workers


def test_memory_of_a_worker_is_capped() -> None:
    """2 GiB are not to be had where 1 is allowed; the worker says so and lives."""
    code = (
        "import sys; sys.argv = ['worker', '1'];"
        "from softmark.interpreter.study.workers.worker_process import _limit_memory; _limit_memory()\n"
        "try:\n    bytearray(2 << 30)\nexcept MemoryError:\n    print('capped')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "capped\n"


@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="only Linux tells")
def test_cpu_time_is_that_of_the_process() -> None:
    """To the clock of the kernel, 10 ms, and what this process spends in between."""
    import time

    assert worker_pool.cpu_seconds_of(os.getpid()) == pytest.approx(time.process_time(), abs=0.1)
    assert worker_pool.cpu_seconds_of(2**22 + 1) is None, "no process has a number above the limit of the kernel"


# ------------------------------------------------------------------ the command


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    scene = tmp_path / "beam.scene"
    study = "study s = robustness(over = [n, soft], until = inaccuracy, maps = none)\n"
    scene.write_text(BEAM + study, encoding="utf-8")
    return scene


@pytest.mark.slow
@pytest.mark.long
def test_the_command_from_end_to_end(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A rod of 6 segments is right to 5 % of its own theory; one of a single segment is not."""
    text = file.read_text(encoding="utf-8").replace("over = [n,", "over = [m,").replace("segments = n", "segments = m")
    file.write_text(text.replace("param    n      = 16", "param    m      = 8 in 1 .. 16"), encoding="utf-8")
    status = main(["stress", "beam.scene", "--model", "rod", "-p", "m=6", "--json", "found.json"])
    shown = capsys.readouterr()
    found = json.loads(Path("found.json").read_text(encoding="utf-8"))
    written = Path("beam-stress/stress.json").read_text(encoding="utf-8")
    assert found == json.loads(written)
    assert Robustness.from_json(found).dumps() == written, "read and written again it is the same to the letter"
    assert set(found) == {"schema", "created", "environment", "command", "scene", "studies", "summary"}
    assert (found["schema"], found["scene"]["title"]) == ("softmark-stress/1", "Two rods")
    assert status == (1 if found["summary"]["silent"] else 0)
    (study,) = found["studies"]
    assert {"name", "metric", "against", "within", "until", "models", "outlines", "quantities", "points", "edges",
            "maps"} <= set(study)  # fmt: skip
    assert {"key", "model", "values", "texts", "class", "error", "stated", "uncertainty", "message", "code", "warnings",
            "cpu_s"} <= set(study["points"][0])  # fmt: skip
    own = {(e["quantity"], e["direction"]): e for e in study["edges"]}
    assert own["m", "down"]["last_right"] in (2.0, 3.0, 4.0)
    assert own["soft", "down"]["last_right"] == 0.1
    assert "right: error of at most 5 %" in shown.out
    assert f"{found['summary']['points']} points" in shown.out


def test_json_on_standard_output_is_alone_there(file: Path, made_up: None, capsys: pytest.CaptureFixture[str]) -> None:
    main(["stress", "beam.scene", "--json", "-"])
    assert json.loads(capsys.readouterr().out)["schema"] == "softmark-stress/1"


def test_silent_points_come_with_the_command_that_repeats_them(
    file: Path, made_up: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["stress", "beam.scene", "-p", "gel.density=2000 kg/m^3"]) == 1
    assert "dsl run beam.scene -p 'gel.density=2000 kg/m^3' -p n=4 --model rod" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--study", "refine"), "`refine` is not a robustness study of the scene"),
        (("--model", "rodd"), "did you mean `rod`?"),
        (("-p", "n=0"), "must be"),
        (("--timeout", "0"), "not a positive number"),
    ],
)
def test_what_cannot_be_meant(
    file: Path, arguments: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status = main(["stress", "beam.scene", *arguments])
    except SystemExit as stop:  # argparse's own
        status = int(stop.code or 0)
    assert status == 2
    assert words in capsys.readouterr().err


def test_a_scene_that_nothing_judges(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line for line in BEAM.splitlines() if not line.startswith("metric")]
    Path("bare.scene").write_text("\n".join(lines), encoding="utf-8")
    assert main(["stress", "bare.scene"]) == 2
    assert "E513" in capsys.readouterr().err


def test_compare_leaves_stability_alone(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "beam.scene", "--study", "s"]) == 2
    assert "dsl robustness --study s" in capsys.readouterr().err
    assert main(["plan", "beam.scene"]) == 0
    assert "studies, computed by `dsl robustness`: s" in capsys.readouterr().out


def test_from_python(tmp_path: Path, made_up: None) -> None:
    file = tmp_path / "beam.scene"
    file.write_text(BEAM + "study s = robustness(over = [soft], maps = none)\n", encoding="utf-8")
    found = softmark.robustness(file, models=["rod"])
    assert repr(found).startswith(f"<Robustness of 'Two rods': {found.summary.points} points: ")
    assert [p.name for p in found.write(file.parent / "written")] == ["stress.json", "stress.html"]
    assert isinstance(found, softmark.Robustness)
    assert [p.found.word for p in found.points] == ["right"] * 4
    assert found.silent == []
