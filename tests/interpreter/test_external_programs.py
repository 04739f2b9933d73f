"""Models that other programs solve: they agree with ours where both solve the same, and end as what they are."""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.external import external_builder
from softmark.interpreter.models.external.adapters import PROGRAMS, adapter, calculix
from softmark.interpreter.models.external.adapters.package_process import Package, read_problem
from softmark.interpreter.models.external.external_declaration import ExternalSolver
from softmark.interpreter.models.external.external_problem import Answer, ExternalNotConverged, Problem
from softmark.interpreter.pipeline import run_pipeline
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_terminal import table

# the silicone beam of 2008, bent by 12 to 14 degrees: so far that finite strain is another answer
BEAM = """softmark 1
scene "others"
material silicone = {law}(young = 60 kPa, poisson = {nu}, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm, axis = +x), silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(1 m/s^2, direction = -z)
probe tip = point(beam, at = (178, 0, 0) mm)
metric drop = displacement(tip, along = -z)
"""
BLOCK = """softmark 1
scene "others"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body block = solid(box(size = (20, 10, 10) mm), gel)
support wall = fixed(block, where = x <= 0 mm)
support grip = displaced(block, where = x >= 20 mm, by = (1, 0, 0) mm)
load weight = gravity(9.81 m/s^2, direction = -z)
probe middle = point(block, at = (10, 5, 5) mm)
metric drop = displacement(middle, along = -z)
model ours = fem(hex8, strain = small, size = 5 mm)
model theirs = external_solver(scikit_fem, hex8, strain = small, size = 5 mm, time = 1 s, memory = 0.5)
expect ours.drop > 0 mm
expect theirs.drop > 0 mm
"""
RESTING = {name: own for name, own in PROGRAMS.items() if not own.moves}  # of which none steps through time
NEEDS = {"felupe": "felupe", "ngsolve": "ngsolve", "scikit_fem": "skfem"}


def run(text: str, **options: Any) -> Any:
    loaded = softmark.loads(text)
    return run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False, **options))


def installed(program: str) -> bool:
    """Packages of Python are not asked for their version, which takes reading what is installed."""
    return adapter(program).version() is not None if program not in NEEDS else find_spec(NEEDS[program]) is not None


def agree(law: str, nu: float, element: str, strain: str, size: str, programs: Sequence[str]) -> None:
    """Nodes of all programs on one mesh, to 1e-6 of the greatest displacement: all solve to 1e-8 of the loads."""
    there = [p for p in programs if installed(p)]
    if not there:
        pytest.skip("none of them is installed")
    models = f"model ours = fem({element}, strain = {strain}, size = {size})\n"
    models += "".join(f"model {p} = external_solver({p}, {element}, strain = {strain}, size = {size})\n" for p in there)
    report = run(BEAM.format(law=law, nu=nu) + models)
    ours = report.models["ours"].mesh
    for program in there:
        model = report.models[program]
        assert model.status == "converged", (program, model.message)
        assert np.array_equal(model.mesh.points, ours.points)
        apart = np.abs(model.mesh.displacement - ours.displacement).max()
        assert apart <= 1e-6 * np.abs(ours.displacement).max(), program
        assert model.solve["residual"] <= 1e-6  # in our equations
        assert model.solve["checks"]["residual"] <= 1e-6  # and by formulas that share nothing with them
        assert model.solve["program"].startswith(PROGRAMS[program].title)
        held, known = (np.array(report.models[n].reactions["wall"].reaction.force) for n in (program, "ours"))
        assert np.abs(held - known).max() <= 1e-6 * np.abs(known).max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("element", "size"),
    [("tet4", "9 mm"), ("tet10", "20 mm"), ("hex8", "9 mm"), ("hex20", "20 mm"), ("hex27", "20 mm")],
)
def test_small_strain_is_the_same_by_all(element: str, size: str) -> None:
    agree("neo_hookean", 0.45, element, "small", size, [p for p, own in RESTING.items() if element in own.elements])


@pytest.mark.slow
@pytest.mark.parametrize("law", ["neo_hookean", "neo_hookean_isochoric", "st_venant_kirchhoff"])
def test_laws_at_finite_strain_are_the_same_by_all(law: str) -> None:
    agree(law, 0.45, "hex8", "finite", "12 mm", [p for p, own in RESTING.items() if law in own.laws.get("finite", ())])


@pytest.mark.slow
def test_several_materials_and_supports_that_move_by_scikit_fem() -> None:
    pytest.importorskip("skfem")
    stiff = "material stiff = neo_hookean(young = 200 kPa, poisson = 0.2, density = 1 kg/m^3)\n"
    stiff += "region tip = part(block, where = x > 10 mm, material = stiff)\n"
    text = BLOCK.replace("support grip", f"{stiff}support grip")
    report = run(text.replace("time = 1 s", "time = 60 s").replace("memory = 0.5", "memory = 4"))
    ours, theirs = (report.models[n] for n in ("ours", "theirs"))
    assert theirs.status == "converged", theirs.message
    assert theirs.mesh.displacement == pytest.approx(ours.mesh.displacement, abs=1e-6 * 1e-3)
    assert report.exit_status == 0


def test_what_a_program_can_do_is_said_once() -> None:
    """Words cannot ask the adapter of CalculiX, which knows arrays."""
    said = PROGRAMS["calculix"]
    assert (said.title, said.elements, dict(said.laws)) == (calculix.title, (*calculix.elements,), dict(calculix.laws))
    assert {adapter(name).install for name in PROGRAMS}
    assert all(name in (ExternalSolver.__doc__ or "") for name in PROGRAMS)


# ------------------------------------------------------------------ what goes wrong


class Fake:
    """A program that is a text of Python, in place of all; its answer is read as that of a package of Python."""

    install, package = "do", Package("none", "numpy", "numpy", "none")

    def __init__(self, program: str, folder: Path) -> None:
        self.program, self.folders = folder / "program.py", list[Path]()
        self.program.write_text(textwrap.dedent(program))

    def version(self) -> str | None:
        return "1.0"

    def refuses(self, problem: Problem) -> list[tuple[str, str]]:
        return []

    def write(self, problem: Problem, folder: Path) -> None:
        self.folders.append(folder)
        self.package.write(problem, folder)

    def command(self, folder: Path) -> list[str]:
        return [sys.executable, "-I", str(self.program)]

    def read(self, folder: Path) -> Answer:
        return self.package.read(folder)


ANSWER = """
import json, numpy as np
found = np.load("problem.npz")
n = len(found["points"])
u = np.zeros((1, n, 3))
u[0, found["held"][:, 0], found["held"][:, 1]] = found["values"]
{change}
np.savez("answer.npz", u=u)
json.dump({{"settled": {settled}, "iterations": 3, "clocks": {{}}, "said": "so it goes"}}, open("answer.json", "w"))
"""
ENDS = {
    "hangs": ("import time; time.sleep(60)", "failed", "it did not finish within 1 s and was stopped"),
    "floods": ("while True: print('x' * 100000)", "failed", "it printed more than 1 MiB and was stopped"),
    "dies": ("import os; print('oh', flush=True); os.abort()",
        "failed", "terminated by a signal (SIGABRT); last output: oh"),
    "fails": ("raise SystemExit('no licence')", "failed", "exit status 1; last output: no licence"),
    "eats memory": ("x = [bytearray(2**28) for _ in range(2**20)]", "failed", "it ran out of memory (limit 0.5 GB)"),
    "says nothing": ("", "failed", "scikit-fem: it wrote no result"),
    "no file of arrays": ("open('answer.json', 'w').write('{')", "failed", "its result cannot be read"),
    "NaN": (ANSWER.format(change="u[0, 5] = np.nan", settled=True),
        "failed", "3 of its 135 displacements are not finite numbers"),
    "infinite": (ANSWER.format(change="u[0, 5, 1] = np.inf", settled=True), "failed", "1 of its 135 displacements"),
    "another shape": (ANSWER.format(change="u = u[:, :7]", settled=True),
        "failed", "of shape (1, 7, 3), and (1, 45, 3)"),
    "slips": (ANSWER.format(change="u = u + 1e-4", settled=True),
        "failed", "a supported node is 0.0001 m from its imposed position"),
    "another state": (ANSWER.format(change="", settled=True), "not_converged", "the displacements of scikit-fem leave"),
    "says no": (ANSWER.format(change="", settled=False), "not_converged",
        "scikit-fem reports no convergence: so it goes"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("what", ENDS)
def test_a_program_that_goes_wrong_ends_as_what_it_is(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program, status, message = ENDS[what]
    fake = Fake(program, tmp_path)
    monkeypatch.setattr(external_builder, "adapter", lambda name: fake)
    report = run(BLOCK)
    ours, theirs = (report.models[n] for n in ("ours", "theirs"))
    assert (theirs.status, ours.status) == (status, "converged")
    assert message in theirs.message
    assert theirs.metrics["drop"].value is None
    assert ours.metrics["drop"].value > 0.0  # the rest of the run goes on
    assert [e.passed for e in report.expectations] == [True, None]
    assert report.exit_status == 3
    assert not any(folder.exists() for folder in fake.folders)
    json.loads(report.dumps())


@pytest.mark.parametrize(
    "why", ["not installed", "unsupported", pytest.param("nearly incompressible", marks=pytest.mark.slow)]
)
def test_what_is_not_tried_is_no_failure(why: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text, status = BLOCK, "unsupported"
    if why == "not installed":
        fake = SimpleNamespace(install="pip install it", version=lambda: None)
        monkeypatch.setattr(external_builder, "adapter", lambda name: fake)
        status, message = "skipped", "scikit-fem is not installed: pip install it"
    elif why == "unsupported":
        text = BLOCK.replace(
            "theirs = external_solver(scikit_fem, hex8, strain = small",
            "theirs = external_solver(scikit_fem, hex8, strain = finite",
        )
        message = "scikit-fem cannot represent strain = finite (its adapter supports strain = small)"
    else:
        fake = SimpleNamespace(
            version=lambda: "1", refuses=lambda problem: [("poisson = 0.3", "it is too much for it")]
        )
        monkeypatch.setattr(external_builder, "adapter", lambda name: fake)
        message = "scikit-fem cannot represent poisson = 0.3 (it is too much for it)"
    report = run(text)
    theirs = report.models["theirs"]
    assert (theirs.status, theirs.message) == (status, message)
    assert theirs.time["solve_s"] is None
    own, other = report.expectations
    assert own.passed
    assert other.left_out
    assert other.reason == f"theirs was not computed ({status})"
    assert report.exit_status == 0
    assert {w.code for w in report.warnings} & {"W710"} == ({"W710"} if why == "unsupported" else set())


@pytest.mark.slow
def test_what_says_itself_that_it_has_no_state_has_not_converged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Stuck(Fake):
        def read(self, folder: Path) -> Answer:
            raise ExternalNotConverged("it came to 0.4 of the load")

    fake = Stuck("", tmp_path)
    fake.command = lambda folder: ["/bin/true"]  # type: ignore[method-assign]
    monkeypatch.setattr(external_builder, "adapter", lambda name: fake)
    theirs = run(BLOCK).models["theirs"]
    assert theirs.status == "not_converged"
    assert theirs.message == "scikit-fem reports no solution: it came to 0.4 of the load"


@pytest.mark.slow
@pytest.mark.parametrize(("said", "status"), [(5e-7, "converged"), (0.0, "converged"), (5e-4, "converged")])
def test_digits_that_an_answer_has_not_are_told_from_a_wrong_one(
    said: float, status: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of three digits a few percent of the loads are left, which an answer of all digits may not leave."""
    pytest.importorskip("skfem")
    real = adapter("scikit_fem")

    def read(folder: Path) -> Answer:
        found, problem = real.read(folder), read_problem(folder)
        u = found.u * (1.0 + said * np.random.default_rng(1).uniform(-1.0, 1.0, found.u.shape))
        u[:, problem.held[:, 0], problem.held[:, 1]] = problem.values
        return Answer(u, None, 1, found.clocks, "", said)

    fake = SimpleNamespace(
        **{n: getattr(real, n) for n in ("install", "version", "refuses", "write", "command")}, read=read
    )
    monkeypatch.setattr(external_builder, "adapter", lambda name: fake)
    text = BLOCK.replace("time = 1 s", "time = 60 s").replace("memory = 0.5", "memory = 4")
    assert run(text).models["theirs"].status == status
    monkeypatch.setattr(fake, "read", lambda folder: Answer(read(folder).u, None, 1))
    assert run(text).models["theirs"].status == ("not_converged" if said > 1e-5 else "converged")


@pytest.mark.slow
def test_a_page_says_what_is_a_bound_what_is_left_out_and_which_versions(tmp_path: Path) -> None:
    if not installed("calculix"):
        pytest.skip("CalculiX is not installed")
    text = (
        BLOCK.replace("scikit_fem", "calculix")
        .replace("time = 1 s", "time = 60 s")
        .replace("memory = 0.5", "memory = 4")
    )
    report = run(f"{text}model other = external_solver(scikit_fem, hex20, strain = small, size = 5 mm)\n")
    page, shown = render(report), table(report, terminal=False)
    assert report.models["theirs"].time["solve_s"].most
    assert "≤ " in page
    assert "of the whole process, an upper bound" in page
    assert f"CalculiX {calculix.version()}" in page
    assert "unsupported" in page
    assert "element = hex20 (its adapter supports tet4, tet10, hex8, hex27)" in page
    assert "<= " in shown
    assert "unsupported" in shown
    assert "was not met" not in page


@pytest.mark.long
@pytest.mark.slow
def test_its_time_says_by_whose_clock() -> None:
    pytest.importorskip("skfem")
    text = BLOCK.replace("time = 1 s", "time = 60 s").replace("memory = 0.5", "memory = 4")
    theirs = run(text, repeat=2).models["theirs"]
    told = theirs.to_json()["time"]["solve_s"]
    assert (told["basis"], told["upper_bound"], told["runs"]) == ("measured by the program itself", False, 2)
    assert told["max"] < theirs.solve["process"]["wall_s"]
    found = softmark.compare(softmark.loads(text), repeats=1)
    point = next(p for p in found.found.points if p.model == "theirs")
    assert "own clock" in point.cost.flags
    assert (point.cost.memory_bytes, point.cost.frame) == (None, None)  # those would be ours
    assert 0.0 < point.cost.wall_s.median < theirs.solve["process"]["wall_s"]
