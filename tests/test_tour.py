"""The contributor's pages are true: all that they name exists, each table has a row, and the material runs."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.optimize import brentq

import softmark
from softmark.interpreter.cli.conformance.plugin_contracts import check_plugin
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.validation.plugin_loader import TABLES
from softmark.solvers.materials import MATERIALS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / ".github" / name for name in ("CONTRIBUTING.md", "contact.md", "convergence.md")]
TEXT = PAGES[0].read_text(encoding="utf-8")
PROSE = re.sub(
    r"^```.*?^```$", "", "\n".join(page.read_text(encoding="utf-8") for page in PAGES), flags=re.MULTILINE | re.DOTALL
)
FOLDERS = ("grammar/", "interpreter/", "references/", "solvers/", "stdlib-scenes/", "tests/", ".ci/", "pyproject.toml")
NAMED = sorted({n for n in re.findall(r"`([^`\s]+)`", PROSE) if n.startswith(FOLDERS)})
COMING = {"solvers/materials/ciarlet.py"}  # the example
TESTS = sorted(set(re.findall(r"pytest (?:-n 0 |-m slow |-k \w+ )*(tests/\S+)", TEXT)))


def block(kind: str) -> str:
    found = re.search(rf"^```{kind}\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def defined(file: Path) -> set[str]:
    """Names that a module defines or gives a value at its top."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    names = {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    names |= {t.id for n in tree.body if isinstance(n, ast.Assign) for t in n.targets if isinstance(t, ast.Name)}
    return names | {n.target.id for n in tree.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}


@pytest.mark.parametrize("named", NAMED)
def test_what_the_tour_names_is_there(named: str) -> None:
    path, _, name = named.partition(":")
    assert (ROOT / path).exists() or path in COMING, f"{path} is gone"
    if name:
        assert name in defined(ROOT / path), f"{name} in {path} is gone"


@pytest.mark.parametrize("named", TESTS)
def test_tests_that_it_runs_are_there(named: str) -> None:
    path, _, name = named.partition("::")
    assert (ROOT / path).is_file()
    assert not name or name in defined(ROOT / path)


def test_the_way_from_a_text_to_its_report_is_one_short_function() -> None:
    """The goal is 40 lines at most, docstring included; the steps are called there and nowhere else."""
    file = ROOT / "interpreter" / "pipeline" / "run_pipeline.py"
    tree = ast.parse(file.read_text(encoding="utf-8"))
    way = next(n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == "run_to_report")
    assert (way.end_lineno or 0) - way.lineno + 1 <= 40
    called = [ast.unparse(n.func) for n in ast.walk(way) if isinstance(n, ast.Call)]
    steps = ("check_text", "plan_of", "reference_runs.read_measurements", "probe_sampling.place_probes",
             "model_runs.prepare_models", "reference_runs.solve_references", "model_runs.solve_model",
             "reference_runs.compute_model_references", "model_runs.estimate_model_errors",
             "report_assembly.finished_report")  # fmt: skip
    assert [n for n in called if n in steps] == sorted(steps, key=called.index)
    assert set(steps) <= set(called)


def test_methods_that_it_names_are_there() -> None:
    newton = (ROOT / "solvers" / "statics" / "static_newton.py").read_text(encoding="utf-8")
    assert all(f"def {name}(" in newton for name in ("_line_step", "_armijo_fraction"))


def test_every_table_of_the_catalogue_has_a_row() -> None:
    """But for kinds of declaration of which there is one, or which belong to another."""
    alone = {"body", "analysis", "published", "amplitude", "stiffness", "study"}
    rows = set(re.findall(r"^\| ([a-z ]+) \| ", TEXT, re.MULTILINE))
    assert set(CATALOGUE) - alone <= rows


@pytest.mark.parametrize("file", sorted(ROOT.glob("[gis]*/**/__init__.py")), ids=str)
def test_files_that_a_folder_names_are_in_it(file: Path) -> None:
    told = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    for name in re.findall(r"(?<![\w/])([\w/]+\.(?:py|css|js|json))\b", told):
        places = [file.parent, *file.parents[1:4]]
        assert any((place / name).is_file() for place in places), f"{file} names {name}, which is gone"


def of_others(folder: Path) -> softmark.LoadedScene:
    (folder / "others.py").write_text(block("python plugin"), encoding="utf-8")
    return softmark.loads(block("scene plugin"), plugins=folder / "others.py")


def test_the_plugin_adds_one_of_each(tmp_path: Path) -> None:
    """A bar under its own weight a along it moves by rho a L^2 / (2 E) at its end, as the words of its cell say."""
    scene = of_others(tmp_path)
    words = scene.scene.vocabulary.plugins[0].words
    assert {*words, "adapter", "shape"} == {kind for kind, *_ in TABLES.values()}
    far = scene.run(models="one").models["one"].metrics["far"].value
    assert far == pytest.approx(1000.0 * 2.0 * 0.04**2 / (2.0 * 60e3), rel=1e-12)


@pytest.mark.slow
def test_the_plugin_runs_and_its_contracts_are_tried(tmp_path: Path) -> None:
    """Hexahedra of finite strain are off by half that strain, 0.04 %; a program that answers zeros is found out."""
    report = of_others(tmp_path).run()
    status = {name: model.status for name, model in report.models.items()}
    assert status == {"cells": "converged", "one": "converged", "zeros": "not_converged"}
    assert report.exit_status == 3  # for that one
    assert [e.passed for e in report.expectations] == [True, True]
    tried = check_plugin(str(tmp_path / "others.py"))
    assert [d.message.partition(" breaks")[0] for d in tried.diagnostics] == ["`adapter copycat`"]
    assert len(tried.words) == 7


def test_the_material_can_be_added_and_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """One file and one line in a table: pulled by half its length, it narrows by what its stress across tells.

    With s along and t across, J = s t^2: mu (t - 1/t) + lam/2 (J^2 - 1) / t = 0, from psi by hand.
    """
    module = ModuleType("ciarlet")
    monkeypatch.setitem(sys.modules, "ciarlet", module)
    exec(compile(block("python"), "ciarlet.py", "exec"), vars(module))
    monkeypatch.setitem(MATERIALS, "ciarlet", module.Ciarlet)
    report = softmark.loads(block("scene")).run()
    cubes = report.models["cubes"]
    assert cubes.status == "converged", cubes.message
    assert [w.code for w in report.warnings] == []
    mu, lam, s = 60e3 / 2.6, 60e3 * 0.3 / (1.3 * 0.4), 1.5
    t = brentq(lambda t: mu * (t - 1 / t) + 0.5 * lam * (s**2 * t**4 - 1) / t, 0.5, 1.0, xtol=1e-14)
    assert cubes.metrics["narrow"].value == pytest.approx((1.0 - t) * 0.01, rel=1e-7)
    law = module.Ciarlet(1.0, 0.3, 1.0)
    F, h = np.eye(3)[None] + 0.1 * np.random.default_rng(1).standard_normal((1, 3, 3)), 1e-6
    for i, J in np.ndindex(3, 3):  # central differences: h^2 and eps / h
        d = np.zeros((1, 3, 3))
        d[0, i, J] = h
        assert law.P(F)[0, i, J] == pytest.approx((law.psi(F + d) - law.psi(F - d))[0] / (2 * h), abs=1e-9)
        np.testing.assert_allclose(law.dPdF(F)[0, :, :, i, J], (law.P(F + d) - law.P(F - d))[0] / (2 * h), atol=1e-8)
