"""Examples that `dsl explain` prints, of every word: at most the rest of the scene does not go with one."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import meshio
import numpy as np
import pytest

from softmark.interpreter.cli.main import main
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.solvers.mesh.shapes import Box

PARTS = Path(__file__).parents[1] / "errors" / "parts"
MATERIAL = "material NAME_OF_MATERIAL = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)\n"
STATIC = "analysis rest = static()\n"
BASE = f"""{MATERIAL}param NAME_OF_PARAMETER = 10 mm
body NAME_OF_BODY = solid(box(size = (2, 2, 3) m), NAME_OF_MATERIAL)
body NAME_OF_RIGID_BODY = rigid(sphere(radius = 5 mm, origin = (1, 1, -0.006) m))
support NAME_OF_SUPPORT = fixed(NAME_OF_BODY, where = x <= 0 mm)
load NAME_OF_LOAD = gravity(9.81 m/s^2)
contact NAME_OF_CONTACT = rigid_contact(NAME_OF_RIGID_BODY, NAME_OF_BODY)
{STATIC}model NAME_OF_MODEL = fem(tet4, strain = finite, size = 500 mm)
reference NAME_OF_REFERENCE = small_deflection(NAME_OF_BODY)
probe NAME_OF_PROBE = point(NAME_OF_BODY, at = (2, 1, 1) m)
metric NAME_OF_METRIC = displacement(NAME_OF_PROBE, along = -z)
metric NAME_OF_ANOTHER_METRIC = displacement(NAME_OF_PROBE, along = +x)
study NAME_OF_STUDY = sweep(NAME_OF_PARAMETER, over = [5, 10] mm)
"""
# of the rest of the scene: law without fibres, body without groups or fluid or table, theory of another problem, ...
OF_THE_SCENE = {"E228", "E304", "E616", "E324", "E344", "E367", "E371", "E395", "E407", "E501", "E503", "E509", "E662"}
WORDS = [(kind, word) for kind in CATALOGUE for word in CATALOGUE[kind]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of the names that examples have."""
    made = tmp_path_factory.mktemp("examples")
    for ours, name in (("cube.stl", "file.stl"), ("bar.nrrd", "file.nrrd"), ("pull.csv", "file.csv")):
        shutil.copy(PARTS / ours, made / name)
    mesh = Box((2.0, 2.0, 3.0)).mesh("tet4", 1.0)
    own = meshio.Mesh(
        1e3 * mesh.points, [("tetra", mesh.cells)], point_data={"displacement": np.zeros((len(mesh.points), 3))}
    )
    own.write(made / "file.vtu")
    meshio.Mesh(1e3 * mesh.points, [("tetra", mesh.cells)]).write(made / "file.vtk")
    (made / "file.msh").write_bytes((PARTS / "named.msh").read_bytes())
    return made


@pytest.mark.parametrize(("kind", "word"), WORDS, ids=[f"{kind} {word}" for kind, word in WORDS])
def test_an_example_is_one(kind: str, word: str, folder: Path, monkeypatch: pytest.MonkeyPatch,
                           capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    monkeypatch.chdir(folder)
    assert main(["explain", word]) == 0
    lines = [e for e in capsys.readouterr().out.split("Example: ") if e.startswith(f"{kind} NAME = {word}")]
    line = lines[0].splitlines()[0]
    base = (
        MATERIAL if kind in ("body", "material", "shape") else BASE.replace(STATIC, "") if kind == "analysis" else BASE
    )
    Path("my.scene").write_text(base + line + "\n")
    main(["check", "my.scene"])
    err = capsys.readouterr().err
    at = len((base + line).splitlines())
    errors = set(re.findall(rf"error\[(E\d{{3}})\].*\n +--> my\.scene:{at}:", err))
    assert not errors - OF_THE_SCENE, err
