"""What a first command costs, in counts that no other program on the machine changes."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from softmark.interpreter.cli.commands import report_folder as shelves
from softmark.interpreter.report.run import report_page
from softmark.solvers.energies import rod_kinematics

COMPILED = 27  # functions for one run of corotational tetrahedra; 137 when sorts and LAPACK went through numba
COUNTING = """
import sys
from numba.core import event

class Count(event.Listener):
    number = 0

    def on_start(self, event):
        Count.number += 1

    def on_end(self, event):
        pass

event.register("numba:compile", Count())
from softmark.interpreter.cli.main import main

status = main()
print(status, Count.number, file=sys.stderr)
"""
RODS = """
material silicone = neo_hookean(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm, axis = +x), silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
probe axis = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm)
reference theory = simo_reissner(beam)
metric eta = relative_l2_error(axis, against = theory)
"""


@pytest.mark.long
@pytest.mark.slow
def test_a_first_run_compiles_no_more_functions_than_it_needs(tmp_path: Path) -> None:
    """In an empty cache, overloads that numba compiles inside included."""
    arguments = ["run", "silicone-beam", "--model", "corot_tet", "--json", str(tmp_path / "r.json")]
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    run = subprocess.run(
        [sys.executable, "-c", COUNTING, *arguments], env=environment, capture_output=True, text=True, check=False
    )
    status, number = run.stderr.split()[-2:]
    assert status == "0", run.stderr
    assert 0 < int(number) <= COMPILED


def scene(folder: Path, rods: int) -> str:
    """So many rods in one scene."""
    file = folder / "rods.scene"
    models = "".join(f"model rod{i} = beam6dof(segments = {4 + i})\n" for i in range(rods))
    file.write_text(RODS + models, encoding="utf-8")
    return str(file)


LOADING = """
import gc, json, os, sys

searches = []
gc.callbacks.append(lambda phase, info: searches.append("numba" in sys.modules))
from softmark.interpreter.pipeline import model_runs as runner
from softmark import pausing
from softmark.interpreter.cli.main import main

solve, before = runner.solve_model, []
runner.solve_model = lambda *a: before.append((len(searches), gc.isenabled())) or solve(*a)
searches.clear()
status = main()
print(json.dumps([status, before, len(searches), gc.get_freeze_count(), os.environ["OPENBLAS_NUM_THREADS"]]))
"""


CLOCKED = """
import json, sys

from softmark.interpreter.cli.main import main
from softmark.interpreter.models.beam import beam_builder as beam

solve, seen = beam.PreparedBeam.solve, []

def watched(self, watch):
    before = set(sys.modules)
    found = solve(self, watch)
    seen.append(sorted(set(sys.modules) - before))
    return found

beam.PreparedBeam.solve = watched
status = main(sys.argv[1:])
print(json.dumps([status, seen, "numba" in sys.modules]))
"""


@pytest.mark.slow
def test_a_rod_imports_nothing_while_its_clock_runs(tmp_path: Path) -> None:
    """Of 89 ms that a rod of 40 segments was said to take, 77 were imports; its way passes an indefinite tangent."""
    import json

    command = [sys.executable, "-c", CLOCKED, "run", scene(tmp_path, 2), "--out", str(tmp_path / "out")]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    status, imported, compiler = json.loads(run.stdout.splitlines()[-1])
    assert (status, compiler) == (0, False)
    assert len(imported) >= 2  # and those from which errors are stated
    assert not any(imported)


@pytest.mark.slow
@pytest.mark.parametrize("threads", [None, "2"])
def test_nothing_is_searched_for_among_modules_and_one_thread_computes(tmp_path: Path, threads: str | None) -> None:
    """A tenth of a short run went into the former, as much into the latter; the user's own word on threads stays."""
    import json

    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    environment |= {} if threads is None else {"OPENBLAS_NUM_THREADS": threads}
    command = [sys.executable, "-c", LOADING, "run", scene(tmp_path, 1), "--out", str(tmp_path / "out")]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    status, [[before, searching]], after, kept, given = json.loads(run.stdout.splitlines()[-1])
    assert status == 0
    assert before <= 40  # of 700 objects each, where the scene is built; some 300 when modules were searched
    assert searching  # and while it computes, as ever
    assert after < 400
    assert kept > 30_000
    assert given == (threads or "1")


def test_a_call_from_python_leaves_the_search_as_it_is(tmp_path: Path) -> None:
    import gc

    from softmark.interpreter.cli.main import main

    frozen = gc.get_freeze_count()
    assert main(["run", scene(tmp_path, 1), "--out", str(tmp_path / "out")]) == 0
    assert gc.isenabled()
    assert gc.get_freeze_count() <= frozen  # what tests have frozen may go in between


@pytest.mark.slow
@pytest.mark.long
def test_a_page_is_made_once_however_many_models_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from softmark.interpreter.cli.main import main

    pages, render = [], report_page.render
    monkeypatch.setattr(report_page, "render", lambda report: pages.append(report) or render(report))  # type: ignore[func-returns-value]
    assert main(["run", scene(tmp_path, 5), "--out", str(tmp_path / "out")]) == 0
    assert len(pages) == 1
    assert len(pages[0].models) == 5


@pytest.mark.slow
@pytest.mark.long
def test_versions_of_libraries_are_read_once_however_many_models_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A report is made after every model: reading them took as long as a small rod."""
    from importlib import metadata

    from softmark.interpreter.cli.main import main
    from softmark.interpreter.pipeline import run_environment

    run_environment._library_versions.cache_clear()
    asked, version = [], metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: asked.append(name) or version(name))  # type: ignore[func-returns-value]
    assert main(["run", scene(tmp_path, 5), "--out", str(tmp_path / "out")]) == 0
    assert sorted(asked) == ["numba", "numpy", "scipy"]


class _Report:
    """As much of a report as the shelf looks at; writing it takes time on a clock of our own."""

    def __init__(self, models: int) -> None:
        self.models = dict.fromkeys(range(models))


def test_keeping_models_takes_a_tenth_of_what_they_take_and_grows_with_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each takes 1 s to solve, and 10 ms to write: written after each, 300 would take 450 s."""
    import argparse

    from softmark.interpreter.report.files import report_files

    now, spent = [0.0], [0.0]

    def write(report: _Report, folder: Path, page: bool = True) -> None:
        assert not page  # while models are computed
        now[0] += 0.01 * len(report.models)
        spent[0] += 0.01 * len(report.models)

    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(report_files, "write", write)
    parsed = argparse.Namespace(json=None, junit=None, out=str(tmp_path), vtu=False)
    shelf = shelves.ReportWriter(parsed)
    for models in range(1, 301):
        now[0] += 1.0
        shelf.save_unfinished(_Report(models))  # type: ignore[arg-type]
    assert 0.0 < spent[0] <= 300.0 / shelves.SPARE
    assert shelf.count > 270  # on disk already


def test_only_trouble_with_files_is_told_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A defect of what writes files for ParaView was told as a place that cannot be written to (E404)."""
    import argparse

    from softmark.interpreter.report.files import report_files

    def broken(report: object, folder: Path) -> None:
        raise ValueError("cells of no kind")

    def full(report: object, folder: Path) -> None:
        raise OSError(28, "No space left on device")

    shelf = shelves.ReportWriter(argparse.Namespace(json=None, junit=None, out=str(tmp_path), vtu=True))
    monkeypatch.setattr(report_files, "write", lambda report, folder, page=True: None)
    monkeypatch.setattr(report_files, "write_vtu", broken)
    with pytest.raises(ValueError, match="cells of no kind"):
        shelf.finish(_Report(1))  # type: ignore[arg-type]
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(report_files, "write_vtu", full)
    shelf.finish(_Report(1))  # type: ignore[arg-type]
    assert "error[E404]" in capsys.readouterr().err


def test_a_run_that_breaks_off_leaves_all_that_was_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Interrupted in its third model: two are in the numbers and on the page."""
    import json

    from softmark.interpreter.cli.main import main
    from softmark.interpreter.pipeline import model_runs as runner

    solve, seen = runner.solve_model, []

    def third(work: object, name: str) -> None:
        seen.append(name)
        if len(seen) == 3:
            raise KeyboardInterrupt
        solve(work, name)  # type: ignore[arg-type]

    monkeypatch.setattr(runner, "solve_model", third)
    monkeypatch.setattr(shelves, "SPARE", 1e9)  # none but the first would be on disk
    assert main(["run", scene(tmp_path, 4), "--out", str(tmp_path / "out")]) == 130
    assert "2 finished models" in capsys.readouterr().err
    kept = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert list(kept["models"]) == ["rod0", "rod1"]
    assert "rod1" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_rod_looks_at_each_state_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Energy, forces, tangent and motion of a state have the same strains: 94 times in ten steps became 26.

    Counted is the solution alone: those from which an error is stated have states of their own.
    """
    from softmark.interpreter.api.python_api import load
    from softmark.interpreter.verification.by_model.beam_verifier import BeamVerifier
    from softmark.interpreter.verification.probe_errors import NoErrorEstimate

    def none(*_: object) -> None:
        raise NoErrorEstimate("not here")

    monkeypatch.setattr(BeamVerifier, "discretisation", none)
    states, of = [0], rod_kinematics.RodElements.of

    def counted(*arguments: object) -> object:
        states[0] += 1
        return of(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(rod_kinematics.RodElements, "of", staticmethod(counted))
    report = load(scene(tmp_path, 1)).run()
    steps = report.models["rod0"].solve["iterations"]
    assert steps > 3
    assert states[0] <= 3 * steps + 6  # a state, the turned frames of a step and its end; at rest and when done
