"""Results that are kept: what is computed again after which change, and that nothing else differs for it."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softmark.grammar.diagnostic import Source
from softmark.interpreter.cli.main import main
from softmark.interpreter.models.external.adapters import PROGRAMS, RODS, adapter
from softmark.interpreter.pipeline import model_runs
from softmark.interpreter.pipeline.run_options import RunOptions, SceneText
from softmark.interpreter.pipeline.run_pipeline import check_text, run_to_report
from softmark.interpreter.planning.run_plan import plan_of
from softmark.interpreter.results.run_report import PlottedCurve
from softmark.interpreter.results.state_results import TimeState
from softmark.interpreter.study.configurations import source_digests
from softmark.interpreter.study.run_cache import cache_folder, result_keeper, run_cache_keys
from softmark.interpreter.study.run_cache.result_serialization import NotSaved, Reader, Writer
from softmark.interpreter.validation.constructor_registry import compile_source
from softmark.interpreter.verification import accuracy_warnings

SCENE = """scene "Kept"
use "gels.scene" as gels
param n = 12
param E = 60 kPa
material gel = neo_hookean(young = E, poisson = 0.3, density = 1000 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 10 mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
analysis still = static(tolerance = 1e-8)
model rod = beam6dof(segments = 10)
model fine = beam6dof(segments = n)
model stiff = beam6dof(segments = 8, shear = no)
reference theory = simo_reissner(beam)
probe axis = line(beam, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 5)
metric eta = relative_l2_error(axis, against = theory)
metric speed = realtime_factor(25 Hz)
expect rod.eta < 10 %
"""
GELS = "material soft = neo_hookean(young = 30 kPa, poisson = 0.3, density = 1000 kg/m^3)\n"
ALL = {"rod", "fine", "stiff", "theory"}


NOBODY = compile_source(Source("nobody", "param a = 1"), Path(), None)[0]


def run(folder: Path, *options: str, text: str | None = None) -> tuple[set[str], str]:
    """The models and references that a run computed, and what it said; the scene is written where it is given."""
    if text is not None:
        (folder / "my.scene").write_text(text, encoding="utf-8")
    if not (folder / "gels.scene").exists():
        (folder / "gels.scene").write_text(GELS, encoding="utf-8")
    out, err = io.StringIO(), io.StringIO()
    with chdir(folder), redirect_stdout(out), redirect_stderr(err):
        status = main(["run", "my.scene", "--out", "report", *options])
    assert status in (0, 1), err.getvalue()
    return computed(folder), out.getvalue() + err.getvalue()


def found(folder: Path, text: str, overrides: tuple[str, ...] = (), **asked: Any) -> set[str]:
    """The models and references that a run computes, without what it would print and write."""
    if not (folder / "gels.scene").exists():
        (folder / "gels.scene").write_text(GELS, encoding="utf-8")
    plugins = asked.pop("plugins", ())
    given = SceneText(Source("my.scene", text), folder, folder / "my.scene", overrides, plugins)
    own = result_keeper.FolderRunCache(lambda: folder / "report")
    results = run_to_report(given, RunOptions(free=True, draw=False, **asked), own).outcomes
    return {result.name for result in results if not result.kept}


def report(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "report" / "report.json").read_text(encoding="utf-8"))
    return found


def computed(folder: Path) -> set[str]:
    found = report(folder)
    return {n for n, r in (found["models"] | found["references"]).items() if "kept" not in r}


def kept(folder: Path) -> list[Path]:
    return sorted((folder / "report" / cache_folder.FOLDER).iterdir())


def plain(folder: Path) -> list[str]:
    """Both files without the moment of the run and what says that something was kept."""
    said = (
        r',\s*"kept": "[^"]*"',
        r'<p class="kept[^>]*>.*?</p>',
        r"<time[^>]*>[^<]*</time>",
        r"\d{4}-\d\d-\d\dT[0-9:+]*",
    )
    found = []
    for name in ("report.json", "report.html"):
        text = (folder / "report" / name).read_text(encoding="utf-8")
        for pattern in said:
            text = re.sub(pattern, "", text)
        found.append(text)
    return found


def changed(old: str, new: str) -> str:
    assert old in SCENE
    return SCENE.replace(old, new)


@pytest.mark.slow
@pytest.mark.long
def test_a_second_run_takes_everything_over_and_says_so(tmp_path: Path) -> None:
    assert run(tmp_path, text=SCENE)[0] == ALL
    before = plain(tmp_path)
    code = (
        "import sys; from softmark.interpreter.cli.main import main; main(['run', 'my.scene', '--out', 'report']);"
        "print([m for m in ('numba', 'scipy', 'ipctk', 'meshio') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("[]"), "no solver is so much as loaded"
    assert computed(tmp_path) == set()
    assert "reused from the run of " in done.stdout
    assert "rod, fine, stiff, theory" in done.stdout
    assert plain(tmp_path) == before
    assert 'class="kept' in (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert report(tmp_path)["models"]["rod"]["kept"] <= report(tmp_path)["environment"]["started"]
    only, _ = run(tmp_path, text=changed("segments = 8", "segments = 9"))
    assert only == {"stiff", "theory"}, "one model, and the reference that it is held against"


EDITS: dict[str, tuple[str, set[str]]] = {
    "a comment": ("# nothing\n\n" + SCENE, set()),
    "the title": (changed('"Kept"', '"Other"'), set()),
    "an expectation": (SCENE + "expect fine.eta < 20 %\n", set()),
    "an expectation that fails": (changed("< 10 %", "> 10 %"), set()),
    "the form": (changed("beam6dof(segments = 10)", "beam6dof( segments = 10 )"), {"rod", "theory"}),
    "one model": (changed("segments = 10)", "segments = 11)"), {"rod", "theory"}),
    "a field of one model": (changed("shear = no", "shear = yes"), {"stiff", "theory"}),
    "a new model": (SCENE + "model more = beam6dof(segments = 6)\n", {"more", "theory"}),
    "a parameter of one model": (changed("n = 12", "n = 13"), {"fine", "theory"}),
    "a parameter of the material": (changed("E = 60 kPa", "E = 60.00001 kPa"), ALL),
    "a parameter nobody uses": (SCENE + "param free = 3 mm\n", set()),
    "the material": (changed("poisson = 0.3,", "poisson = 0.31,"), ALL),
    "the body": (changed("radius = 10 mm", "radius = 9 mm"), ALL),
    "the support": (changed("x <= 0 mm", "x <= 0.001 um"), ALL),
    "the load": (changed("9.81", "9.80665"), ALL),
    "the analysis": (changed("1e-8", "1e-9"), ALL),
    "the reference": (changed("simo_reissner", "elastica"), ALL),
    "a new reference": (SCENE + "reference other = elastica(beam)\n", ALL | {"other"}),
    "the probe": (changed("points = 5", "points = 6"), ALL),
    "the metric": (changed("25 Hz", "30 Hz"), ALL),
    "a new metric": (SCENE + "metric drop = displacement(axis, along = -z)\n", ALL),
    "what was published": (SCENE + 'published p = column(eta, of = [rod], values = [1] %, source = "s")\n', ALL),
}  # fmt: skip


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the scene was run once."""
    folder = tmp_path_factory.mktemp("kept")
    assert found(folder, SCENE) == ALL
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("edit", EDITS)
def test_what_an_edit_has_computed(edit: str, first: Path) -> None:
    text, expected = EDITS[edit]
    assert found(first, text) == expected


OPTIONS: dict[str, tuple[dict[str, Any], set[str]]] = {
    "an override of one model": ({"overrides": ("n=14",)}, {"fine", "theory"}),
    "an override of a field": ({"overrides": ("rod.segments=14",)}, {"rod", "theory"}),
    "an override of the material": ({"overrides": ("gel.poisson=0.29",)}, ALL),
    "an override to the same value": ({"overrides": ("n=12",)}, set()),
    "repetitions": ({"repeat": 2}, ALL),
    "stated errors": ({"stated": ()}, ALL),
    "one model alone": ({"only": ("rod",)}, {"theory"}),
}


@pytest.mark.slow
@pytest.mark.parametrize("option", OPTIONS)
def test_what_an_option_has_computed(option: str, first: Path) -> None:
    asked, expected = OPTIONS[option]
    assert found(first, SCENE, **asked) == expected


@pytest.mark.slow
def test_who_asks_for_everything_gets_it(tmp_path: Path) -> None:
    run(tmp_path, text=SCENE)
    for option in ("--fresh", "--vtu"):
        assert run(tmp_path, option)[0] == ALL


@pytest.mark.slow
def test_what_is_no_text_of_the_scene_counts_as_well(first: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setenv("OMP_NUM_THREADS", "7")
        assert found(first, SCENE) == ALL
    with monkeypatch.context() as patch:
        patch.setattr(source_digests, "digest_sources", lambda: "another softmark")
        assert found(first, SCENE) == ALL
    (first / "gels.scene").write_text(GELS.replace("30", "31"), encoding="utf-8")
    assert found(first, SCENE) == ALL
    (first / "gels.scene").write_text(GELS, encoding="utf-8")
    assert found(first, SCENE) == set()


def test_another_program_of_the_same_number_is_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "ccx"
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    text = changed("beam6dof(segments = 10)", "external_solver(calculix, hex8, strain = small, size = 10 mm)")
    (tmp_path / "gels.scene").write_text(GELS, encoding="utf-8")

    def keyed() -> dict[str, str]:
        source_digests.digest_installed.cache_clear()
        options = RunOptions(free=True)
        sound = check_text(SceneText(Source("my.scene", text), tmp_path, tmp_path / "my.scene", (), ()), options)
        return run_cache_keys.keys_of(sound.scene, plan_of(sound.scene, ()), options)

    seen = []
    for body in ("true", "false"):
        own.write_text(f"#!/bin/sh\necho This is Version 2.20\n{body}\n", encoding="utf-8")
        own.chmod(0o755)
        seen.append(keyed())
    assert {name for name in seen[0] if seen[0][name] != seen[1][name]} == {"", "rod"}
    source_digests.digest_installed.cache_clear()
    known = {name: adapter(name) for name in (*PROGRAMS, *RODS)}
    assert all(bool(own.places()) == (own.version() is not None) for own in known.values())


SEEN = """reference seen = markers("seen.csv", unit = 1 mm, uncertainty = 0.1 mm)
probe dots = markers(beam, of = seen)
metric off = relative_l2_error(dots, against = seen)
"""


def measured(folder: Path, share: float) -> None:
    rows = [f"{x},0,0,{x},0,{-x * share}" for x in (20, 50, 90)]
    (folder / "seen.csv").write_text("x0,y0,z0,x1,y1,z1\n" + "\n".join(rows) + "\n", encoding="utf-8")


@pytest.mark.slow
def test_contents_of_files_count_and_their_names_do_not_hide_them(tmp_path: Path) -> None:
    text, everything = SCENE + SEEN, ALL | {"seen"}
    measured(tmp_path, 0.01)
    assert found(tmp_path, text) == everything
    os.utime(tmp_path / "seen.csv")
    assert found(tmp_path, text) == set(), "saved, and the same"
    measured(tmp_path, 0.02)
    assert found(tmp_path, text) == everything


@pytest.mark.slow
def test_a_file_that_is_saved_while_it_is_read_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    measured(tmp_path, 0.01)
    known = result_keeper.FolderRunCache.known

    def saved(self: result_keeper.FolderRunCache, *given: Any) -> Any:
        taken = known(self, *given)
        measured(tmp_path, 0.03)  # after it was looked at, before it is read
        return taken

    with monkeypatch.context() as patch:
        patch.setattr(result_keeper.FolderRunCache, "known", saved)
        found(tmp_path, SCENE + SEEN)
    measured(tmp_path, 0.01)
    assert found(tmp_path, SCENE + SEEN) == ALL | {"seen"}


@pytest.mark.slow
def test_who_is_held_against_a_model_needs_it_computed(tmp_path: Path) -> None:
    text = SCENE + "metric apart = relative_l2_error(axis, against = fine)\n"
    found(tmp_path, text)
    assert found(tmp_path, text) == set()
    assert found(tmp_path, text.replace("segments = 8", "segments = 9")) == {"stiff", "fine", "theory"}
    assert found(tmp_path, text.replace("n = 12", "n = 13")) == ALL, "all are held against it"


@pytest.mark.slow
def test_nothing_of_a_plugin_is_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("SOFTMARK = {'models': {}}\n", encoding="utf-8")
    found(tmp_path, SCENE)
    for _ in range(2):
        assert found(tmp_path, SCENE, plugins=(str(tmp_path / "mine.py"),)) == ALL


WARNS = SCENE.replace("model stiff", "model cubes = fem(hex8, strain = small, size = 10 mm)\nmodel stiff").replace(
    "E = 60 kPa", "E = 2 kPa"
)


@pytest.mark.long
@pytest.mark.slow
def test_warnings_stay_with_what_they_are_about(tmp_path: Path) -> None:
    """Of the run itself: they point to the same line, wherever that stands by now, and stated errors repeat them."""
    run(tmp_path, text=WARNS)
    before = report(tmp_path)
    assert any(w["code"] == "W306" for w in before["warnings"])
    assert run(tmp_path, text="\n\n" + WARNS)[0] == set()
    lines = [None if w["line"] is None else w["line"] - 2 for w in report(tmp_path)["warnings"]]
    assert lines == [w["line"] for w in before["warnings"]]
    assert run(tmp_path, text=WARNS.replace("segments = 8", "segments = 9"))[0] == {"stiff", "theory"}
    codes = {w["code"] for w in report(tmp_path)["warnings"]}
    assert run(tmp_path, "--fresh")[0] == ALL | {"cubes"}
    assert {w["code"] for w in report(tmp_path)["warnings"]} == codes


@pytest.mark.slow
def test_what_is_damaged_is_computed_again_with_a_remark(tmp_path: Path) -> None:
    run(tmp_path, text=SCENE)
    cut, turned, empty, folder = kept(tmp_path)
    cut.write_bytes(cut.read_bytes()[:-7])
    data = bytearray(turned.read_bytes())
    data[len(data) // 2] ^= 1
    turned.write_bytes(bytes(data))
    empty.write_bytes(b"")
    folder.unlink()
    folder.mkdir()
    again, said = run(tmp_path)
    assert again == ALL
    assert said.count("computed again") >= 3
    assert "Traceback" not in said
    folder.rmdir()
    run(tmp_path)
    assert run(tmp_path)[0] == set()


def outside(folder: Path, *options: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "softmark.interpreter", "run", "my.scene", "--out", "report", *options]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def waited(until: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not until():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.slow
def test_who_is_killed_leaves_nothing_half_written(tmp_path: Path) -> None:
    run(tmp_path, text=SCENE)
    (tmp_path / "my.scene").write_text(SCENE.replace("E = 60", "E = 61"), encoding="utf-8")
    before = len(kept(tmp_path))
    process = outside(tmp_path)
    waited(lambda: len(kept(tmp_path)) > before or process.poll() is not None)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert run(tmp_path)[0] <= ALL
    assert run(tmp_path)[0] == set()
    assert run(tmp_path, text=SCENE)[0] == set()


@pytest.mark.slow
@pytest.mark.long
def test_who_is_interrupted_has_what_was_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Models that took their time are kept as they end, measured and drawn as in a run that was not interrupted."""
    text = SCENE.replace("metric speed = realtime_factor(25 Hz)\n", "")  # who measures time never finds the same
    run(tmp_path, text=text)
    whole = plain(tmp_path)
    for file in kept(tmp_path):
        file.unlink()
    monkeypatch.setattr(result_keeper, "WORTH", 0.0)
    solve = model_runs.solve_model

    def interrupted(work: Any, name: str) -> None:
        if name == "stiff":
            raise KeyboardInterrupt
        solve(work, name)

    with (
        monkeypatch.context() as broken,
        chdir(tmp_path),
        redirect_stdout(io.StringIO()),
        redirect_stderr(io.StringIO()),
    ):
        broken.setattr(model_runs, "solve_model", interrupted)
        assert main(["run", "my.scene", "--out", "report"]) == 130
    assert run(tmp_path)[0] == {"stiff", "theory"}
    numbers = re.compile(r'"(setup|solve|step)(_cpu)?_s": \{.*?\}', re.DOTALL)
    assert numbers.sub("", plain(tmp_path)[0]) == numbers.sub("", whole[0])


@pytest.mark.parametrize(("against", "early"), [("rod", ["rod", "fine", "stiff"]), ("stiff", ["stiff"])])
def test_models_are_kept_once_those_are_solved_that_they_are_held_against(
    against: str, early: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[str] = []
    monkeypatch.setattr(result_keeper, "WORTH", 0.0)
    monkeypatch.setattr(result_keeper.FolderRunCache, "keep_early", lambda self, works, name: found.append(name))
    run(tmp_path, text=SCENE + f"metric apart = max_error(axis, against = {against})\n")
    assert found == early


@pytest.mark.slow
def test_two_runs_at_once_in_one_folder(tmp_path: Path) -> None:
    (tmp_path / "my.scene").write_text(SCENE, encoding="utf-8")
    (tmp_path / "gels.scene").write_text(GELS, encoding="utf-8")
    both = [outside(tmp_path), outside(tmp_path, "-p", "n=20")]
    for process in both:
        _, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
    for options in ((), ("-p", "n=20")):
        assert run(tmp_path, *options)[0] == set()


@pytest.mark.slow
def test_what_was_kept_with_other_doubts_is_not_taken_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A model says with its error which warnings speak against it; some come from what it shares with others."""
    run(tmp_path, text=SCENE)
    monkeypatch.setattr(accuracy_warnings, "accuracy_warning_codes", lambda *given: ["W375"])
    assert run(tmp_path)[0] == ALL


def test_values_come_back_as_they_were() -> None:
    curve = PlottedCurve(np.array([0.1, 1 / 3]), np.array([1.0, np.nan]), ("m", "1"))
    value = (
        1,
        1.5,
        True,
        None,
        "é\0",
        float("inf"),
        [1, (2,)],
        {"~class": 1, 2: ()},
        np.float64(0.1),
        TimeState(2.5),
        curve,
    )
    writer = Writer(NOBODY)
    text = json.dumps(writer.write(value), allow_nan=False)
    found = Reader(NOBODY, dict(enumerate(writer.arrays))).read(json.loads(text))
    assert repr(found) == repr(value)
    assert [type(v) for v in found] == [type(v) for v in value]
    with pytest.raises(NotSaved):
        writer.write(lambda: None)
    with pytest.raises(NotSaved):
        writer.write(np.array([object()]))


def test_no_file_has_anything_run(tmp_path: Path) -> None:
    """With a right checksum, too: objects are not read, and classes that are not of results are not made."""
    body = io.BytesIO()
    np.savez(body, json=np.array([Path("made")], dtype=object))
    cache_folder.write_saved(tmp_path, "key", 0, [])
    path = cache_folder._path(tmp_path, "key")
    path.write_bytes(cache_folder._authentication_header("key", body.getvalue()) + b"\n" + body.getvalue())
    with pytest.raises(cache_folder.DamagedFile):
        cache_folder.read_saved(tmp_path, "key")
    with pytest.raises(LookupError):
        Reader(NOBODY, {}).read({"~class": "Popen", "fields": {}})


def test_a_result_is_not_read_under_the_name_of_another(tmp_path: Path) -> None:
    """The authentication code covers the key: two files that have been swapped are taken for neither result."""
    cache_folder.write_saved(tmp_path, "one", 1, [])
    cache_folder.write_saved(tmp_path, "two", 2, [])
    one, two = (cache_folder._path(tmp_path, key) for key in ("one", "two"))
    first, second = one.read_bytes(), two.read_bytes()
    one.write_bytes(second)
    two.write_bytes(first)
    for key in ("one", "two"):
        with pytest.raises(cache_folder.DamagedFile, match="renamed"):
            cache_folder.read_saved(tmp_path, key)
    body = first.partition(b"\n")[2]
    assert cache_folder._authentication_header("one", body) != cache_folder._authentication_header("two", body)
    one.write_bytes(first)
    assert cache_folder.read_saved(tmp_path, "one") == (1, {})


def test_a_folder_of_results_stays_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_folder, "MOST", 3)
    for number in range(6):
        cache_folder.write_saved(tmp_path, f"{number}", number, [])
        os.utime(cache_folder._path(tmp_path, f"{number}"), (number, number))
    cache_folder.prune_folder(tmp_path, ["0"])
    left = {number for number in range(6) if cache_folder.read_saved(tmp_path, f"{number}") is not None}
    assert left == {0, 4, 5}
