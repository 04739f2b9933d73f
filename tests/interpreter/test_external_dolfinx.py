"""DOLFINx: which Python is asked for it, and what it answers where one has it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.external.adapters import PROGRAMS, dolfinx, dolfinx_driver
from softmark.interpreter.pipeline import run_pipeline
from softmark.solvers.elements import element_of

# what a law with constants of its own is written as
LAWS = {
    "stable_neo_hookean": "young = 60 kPa, poisson = 0.4",
    "mooney_rivlin": "c1 = 8 kPa, c2 = 2 kPa, poisson = 0.4, volumetric = logarithmic",
    "yeoh": "c1 = 10 kPa, c2 = -1 kPa, c3 = 1 kPa, bulk = 60 kPa, volumetric = reciprocal",
    "gent": "mu = 20 kPa, limit = 10, poisson = 0.4",
    "fung": "mu = 20 kPa, b = 2, poisson = 0.4",
}
SLABS = "".join(  # of a bar, one behind the other
    f"""material m{i} = {law}({constants}, density = 1000 kg/m^3)
region r{i} = part(bar, where = x > {10 * i} mm and x < {10 * (i + 1)} mm, material = m{i})
"""
    for i, (law, constants) in enumerate(LAWS.items(), start=1)
)
BAR = f"""softmark 1
scene "others"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (60, 10, 10) mm), gel)
{SLABS}support wall = fixed(bar, where = x <= 0 mm)
support grip = displaced(bar, where = x >= 60 mm, by = (12, 0, 6) mm)
load weight = gravity(9.81 m/s^2, direction = -z)
probe middle = point(bar, at = (30, 5, 5) mm)
metric drop = displacement(middle, along = -z)
model ours = fem(hex8, strain = finite, size = 10 mm)
model theirs = external_solver(dolfinx, hex8, strain = finite, size = 10 mm)
"""


def python(folder: Path, says: str) -> str:
    """A program that is called as Python is, and says that, whatever it is asked."""
    own = folder / "python3"
    own.write_text(f"#!/bin/sh\n{says}\n", encoding="utf-8")
    own.chmod(0o755)
    return str(own)


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """Nothing is known of Pythons before and after."""
    dolfinx._first_with_dolfinx.cache_clear()
    yield
    dolfinx._first_with_dolfinx.cache_clear()


def test_the_python_that_a_variable_names_is_asked_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = python(tmp_path, """echo '["0.9.0", ["/opt/dolfinx"]]'""")
    monkeypatch.setenv(dolfinx.VARIABLE, there)
    assert list(dolfinx.candidates()) == [there]
    assert dolfinx.version() == "0.9.0"
    assert dolfinx.places() == (Path(there), Path("/opt/dolfinx"))
    assert dolfinx.command(tmp_path)[0] == there


def test_otherwise_our_own_is_asked_first_and_then_those_of_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = python(tmp_path, "echo null")
    monkeypatch.delenv(dolfinx.VARIABLE, raising=False)
    monkeypatch.setenv("PATH", f"{tmp_path}:.")
    assert list(dolfinx.candidates()) == [sys.executable, there, dolfinx.SYSTEM]


@pytest.mark.parametrize("says", ["echo null", "exit 1", "echo hello", "echo '[1]'"])
def test_what_has_none_or_is_no_python_is_passed_over(
    says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(dolfinx.VARIABLE, python(tmp_path, says))
    assert dolfinx.version() is None
    assert dolfinx.places() == ()


def test_a_variable_that_names_nothing_finds_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(dolfinx.VARIABLE, str(tmp_path / "none"))
    assert dolfinx.version() is None
    assert dolfinx.VARIABLE in dolfinx.install


def test_what_it_can_do_is_said_as_the_script_has_it() -> None:
    said = PROGRAMS["dolfinx"]
    assert set(said.elements) == set(dolfinx_driver.ELEMENTS)
    assert {name: set(laws) for name, laws in said.laws.items()} == {
        "small": set(dolfinx_driver.SMALL), "finite": set(dolfinx_driver.FINITE),
    }  # fmt: skip


def test_nodes_of_a_cell_are_matched_by_where_they_are() -> None:
    ours = element_of("hex8").places()
    turned = ours[[0, 1, 3, 2, 4, 5, 7, 6]]
    assert dolfinx_driver.match_node_order(ours, turned) == [0, 1, 3, 2, 4, 5, 7, 6]
    with pytest.raises(dolfinx_driver.SolveFailure):
        dolfinx_driver.match_node_order(ours, 0.5 * ours)


@pytest.mark.slow
def test_its_other_laws_several_materials_and_a_support_that_moves_are_ours() -> None:
    """A slab of each law in a bar that is drawn by a fifth: all carry one force, and one process compiles them all.

    1e-6, to which both are solved; 1e-4 of the first constant of any of the laws moves the nodes by 8e-6 or more.
    """
    if dolfinx.version() is None:
        pytest.skip("no Python has DOLFINx")
    loaded = softmark.loads(BAR)
    report = run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False))
    ours, theirs = (report.models[n] for n in ("ours", "theirs"))
    assert theirs.status == "converged", theirs.message
    apart = np.abs(theirs.mesh.displacement - ours.mesh.displacement).max()
    assert apart <= 1e-6 * np.abs(ours.mesh.displacement).max()
    assert theirs.solve["residual"] <= 1e-6
