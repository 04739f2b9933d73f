"""CalculiX's decks as text, its answers as it leaves them, and, where it is installed, its answers beside ours."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.models.external.adapters import calculix
from softmark.interpreter.models.external.external_problem import (
    ExternalMaterial,
    ExternalNotConverged,
    NoAnswer,
    Problem,
)
from softmark.interpreter.models.external.problem_transfer import problem_of
from softmark.interpreter.models.model_preparation import Measurements, prepared_model
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import case_for

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TET = Problem(
    points=1e-3 * POINTS,
    cells=np.array([[0, 1, 2, 3]]),
    element="tet4",
    strain="small",
    stuff=(ExternalMaterial("linear_elastic", {"young": 1e4, "poisson": 0.25}, 1000.0, np.array([0])),),
    held=np.array([[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]]),
    values=np.array([0.0, 0, 0, 0, 0, 1e-5]),
    forces=np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1e-6]]),
)
DECK = """\
** units: mm, Pa, uN (g, mm, s); nodes and elements count from 1
*NODE, NSET=ALL
1,0.0000000000000e+00,0.0000000000000e+00,0.0000000000000e+00
2,1.0000000000000e+00,0.0000000000000e+00,0.0000000000000e+00
3,0.0000000000000e+00,1.0000000000000e+00,0.0000000000000e+00
4,0.0000000000000e+00,0.0000000000000e+00,1.0000000000000e+00
*ELEMENT, TYPE=C3D4, ELSET=PART1
1,1,2,3,4
*MATERIAL, NAME=M1
*ELASTIC
1.0000000000000e+04,2.5000000000000e-01
*DENSITY
1.0000000000000e-03
*SOLID SECTION, ELSET=PART1, MATERIAL=M1
*NSET, NSET=HELD1
1
*BOUNDARY
HELD1,1,1
*NSET, NSET=HELD2
1
2
*BOUNDARY
HELD2,2,2
*NSET, NSET=HELD3
1
2
*BOUNDARY
HELD3,3,3
*RESTART, WRITE, FREQUENCY=1
*STEP
*STATIC
1,1
*BOUNDARY
3,3,3,1.0000000000000e-02
*CLOAD
4,3,1.0000000000000e+00
*NODE PRINT, NSET=ALL, FREQUENCY=99999
U
*NODE FILE, FREQUENCY=99999
U
*END STEP"""

STA = "SUMMARY OF JOB INFORMATION\n  STEP      INC     ATT  ITRS     TOT TIME     STEP TIME      INC TIME\n"
DONE = STA + "     1          1     1     1  0.100000E+01  0.100000E+01  0.100000E+01\n"
DAT = """
 displacements (vx,vy,vz) for set ALL and time  0.1000000E+01

         1  0.000000E+00  0.000000E+00  0.000000E+00
         2  1.000000E-01 -2.000000E-02  0.000000E+00
         3  0.000000E+00  0.000000E+00  1.000000E-02
         4  3.000000E-01  0.000000E+00  0.000000E+00
"""


def left(folder: Path, **files: str) -> Path:
    """A folder as the program leaves it, with these files by their suffixes."""
    calculix.write(TET, folder)
    for suffix, content in ({"sta": DONE, "dat": DAT} | files).items():
        (folder / f"job.{suffix}").write_text(content)
    return folder


def test_a_deck_is_this_text() -> None:
    assert "\n".join(calculix.deck(TET)) == DECK


def test_states_are_steps() -> None:
    lines = list(calculix.deck(replace(TET, shares=(0.5, 1.0))))
    assert lines.count("*STEP") == 2
    assert lines.count("1,1") == 2
    named = list(calculix.deck(replace(TET, shares=(0.5, 1.0), values_of_states=(0.1, 0.2))))
    assert named.count("0.1,0.1") == 2  # each is at the time that the scene calls it
    assert [line for line in lines if line.startswith("4,3,")] == ["4,3,5.0000000000000e-01", "4,3,1.0000000000000e+00"]


@pytest.mark.parametrize(
    ("law", "constants", "cards"),
    [
        ("st_venant_kirchhoff", {"young": 3e4, "poisson": 0.25}, ["*ELASTIC", "3.0e4,0.25"]),
        # C10 = mu/2 = E / (4 (1 + nu)), D1 = 2/K = 6 (1 - 2 nu) / E
        ("neo_hookean_isochoric", {"young": 3e4, "poisson": 0.25}, ["*HYPERELASTIC, NEO HOOKE", "6e3,1e-4"]),
        ("mooney_rivlin", {"c1": 5e3, "c2": 1e3, "young": 3e4, "poisson": 0.25},
         ["*HYPERELASTIC, MOONEY-RIVLIN", "5e3,1e3,1e-4"]),
        ("yeoh", {"c1": 6e3, "c2": 10.0, "c3": 1.0, "young": 3e4, "poisson": 0.25},
         ["*HYPERELASTIC, YEOH", "6e3,10,1,1e-4,1e30,1e30"]),
    ],
)  # fmt: skip
def test_laws_have_their_constants(law: str, constants: dict[str, float], cards: list[str]) -> None:
    word, row = calculix.law(ExternalMaterial(law, constants, None, np.array([0])))
    assert word == cards[0]
    assert [float(v) for v in row.split(",")] == pytest.approx([float(v) for v in cards[1].split(",")], rel=1e-12)


def test_what_it_does_not_have_is_refused() -> None:
    def refused(law: str = "yeoh", poisson: float = 0.3, element: str = "tet4", volumetric: str = "squared") -> str:
        stuff = ExternalMaterial(
            law, {"young": 1e4, "poisson": poisson}, None, np.array([0]), {"volumetric": volumetric}
        )
        found = calculix.refuses(replace(TET, strain="finite", element=element, stuff=(stuff,)))
        return "; ".join(f"{what}: {why}" for what, why in found)

    assert refused() == ""
    assert "is another law, mu/2" in refused("neo_hookean")
    assert "does not have this element" in refused(element="hex27")
    assert "K/2 (J - 1)^2" in refused(volumetric="logarithmic")
    assert "incompressible" in refused(poisson=0.49999)
    with pytest.raises(ValueError, match="hex27"):
        list(calculix.deck(replace(TET, element="hex27")))


def test_what_it_prints_is_read(tmp_path: Path) -> None:
    answer = calculix.read(left(tmp_path))
    assert answer.u.shape == (1, 4, 3)
    assert answer.u[0, 1].tolist() == [1e-4, -2e-5, 0.0]
    assert answer.iterations == 1
    assert answer.settled is None


def test_doubles_are_taken_where_they_agree_with_what_is_printed(tmp_path: Path) -> None:
    """A record of a restart file that is another field of the same size is passed over."""
    fine = np.array([[9.0, 0, 0, 0], [9, 0.100000012345, -0.02, 0], [9, 0, 0, 0.01], [9, 0.3, 0, 0]])
    other = np.zeros((4, 4))
    records = [len(own.tobytes()).to_bytes(4, "little") for own in (other, fine)]
    data = b"".join(n + own.tobytes() + n for n, own in zip(records, (other, fine), strict=True))
    folder = left(tmp_path)
    (folder / "job.rout").write_bytes(data)
    assert calculix.read(folder).u[0, 1, 0] == pytest.approx(1.00000012345e-4, rel=1e-14)
    (folder / "job.rout").write_bytes(data[:-20])  # cut short
    assert calculix.read(folder).u[0, 1, 0] == 1e-4


@pytest.mark.parametrize(
    ("files", "error", "why"),
    [
        ({"sta": STA + "     1          1     1U   16  0.200000E+00  0.200000E+00  0.200000E+00\n",
          "dat": ""}, ExternalNotConverged, "stopped after a fraction of 0"),
        ({"dat": DAT.replace("3.000000E-01", "NaN")}, NoAnswer, "not finite numbers"),
        ({"dat": DAT[:-52]}, NoAnswer, "of 3 of 4 nodes"),
        ({"dat": ""}, NoAnswer, "0 of 1 states"),
        ({"sta": "what is this"}, NoAnswer, "did not start to solve"),
        ({"sta": STA + "a b c d e f\n"}, NoAnswer, "not a table of increments"),
    ],
)  # fmt: skip
def test_an_answer_that_is_none_is_said(
    files: dict[str, str], error: type[Exception], why: str, tmp_path: Path
) -> None:
    with pytest.raises(error, match=why):
        calculix.read(left(tmp_path, **files))


def test_its_own_errors_are_told(tmp_path: Path) -> None:
    folder = left(tmp_path, sta=STA)
    many = "".join(f" *WARNING reading *NSET: value {i}\n" for i in range(9))
    (folder / "log.txt").write_text(many + " *ERROR in elements: no such node\n       in element 3\n")
    with pytest.raises(NoAnswer, match=r"no such node in element 3; .* value 2; and 6 more$"):
        calculix.read(folder)


# ------------------------------------------------------------------ with the program

BAR = """
softmark 1
scene "A bar, pulled and bent"
material stiff = st_venant_kirchhoff(young = 60 kPa, poisson = NU, density = 1000 kg/m^3)
material rubber = neo_hookean_isochoric(young = 60 kPa, poisson = NU, density = 1000 kg/m^3)
material gum = mooney_rivlin(c1 = 8 kPa, c2 = 2 kPa, poisson = NU, density = 1000 kg/m^3)
material gel = yeoh(c1 = 10 kPa, c2 = 1 kPa, c3 = 200 Pa, poisson = NU, density = 1000 kg/m^3)
body bar = solid(cylinder(length = 60 mm, radius = 10 mm, axis = +x), LAW)
support wall = fixed(bar, where = x <= 0 mm)
support pull = displaced(bar, where = x >= 60 mm, by = (5 mm, 0 mm, 0 mm), components = x)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis rest = static()
model bar_of = fem(ELEMENT, strain = STRAIN, size = 8 mm)
"""

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="ccx is not on the path")


def apart(scene: Any, name: str, folder: Path) -> tuple[float, float]:
    """How far its answer is from ours, as a part of the greatest displacement: of its doubles, and as printed."""
    declared = scene.declared[name]
    case = case_for(scene, declared)
    prepared: Any = prepared_model(declared, case, BuildContext(scene=scene, measured=Measurements(scene)))[0]
    problem = problem_of(prepared, case)
    calculix.write(problem, folder)
    with (folder / calculix.LOG).open("w") as log:
        subprocess.run(calculix.command(folder), cwd=folder, stdout=log, timeout=300, check=True)
    answer = calculix.read(folder)
    assert answer.settled
    assert "whole_s" in answer.clocks
    ours = prepared.solve(lambda *_: None).mesh.displacement
    most = np.abs(ours).max()
    printed = list(calculix._printed_displacements(folder / "job.dat"))[-1] / calculix.MM
    return float(np.abs(answer.u[-1] - ours).max() / most), float(np.abs(printed - ours).max() / most)


@needs_ccx
@pytest.mark.slow
@pytest.mark.parametrize("nu", ["0.3", "0.49"])
@pytest.mark.parametrize(
    ("element", "strain", "law"),
    [(element, "small", "stiff") for element in calculix.elements]
    + [(element, "finite", "rubber") for element in calculix.elements]
    + [("hex8", "finite", law) for law in ("stiff", "gum", "gel")],
)
def test_each_element_and_law_is_ours(element: str, strain: str, law: str, nu: str, tmp_path: Path) -> None:
    """1e-8: both are solved to 1e-8 of their forces, and are read as doubles; 6e-7 of what has 7 digits."""
    text = BAR.replace("NU", nu).replace("LAW", law).replace("ELEMENT", element).replace("STRAIN", strain)
    doubles, printed = apart(softmark.loads(text).scene, "bar_of", tmp_path)
    assert doubles < 1e-8
    assert printed < 6e-7


@needs_ccx
@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "name"),
    [
        ("silicone-beam", "linear_tet"),
        ("layered-bar", "series_small"),
        ("layered-bar", "parallel"),
        ("cooks-membrane", "locks"),
        ("thick-ring", "strained"),
        ("coated-sphere", "hexes"),
        ("tapered-cantilevers", "solid"),
    ],
)
def test_scenes_that_are_shipped_have_its_answer(scene: str, name: str, tmp_path: Path) -> None:
    """The same bounds, for the same reasons; 14 digits of a deck leave 4e-10 in the worst of them."""
    doubles, printed = apart(softmark.load(scene).scene, name, tmp_path)
    assert doubles < 1e-8
    assert printed < 6e-7


@needs_ccx
@pytest.mark.slow
def test_a_state_on_the_way_is_that_of_its_part_of_the_load(tmp_path: Path) -> None:
    """Elastic bodies have no memory: 1e-8, to which both are solved."""
    text = BAR.replace("NU", "0.3").replace("LAW", "rubber").replace("ELEMENT", "hex8").replace("STRAIN", "finite")
    scene = softmark.loads(text).scene
    case = case_for(scene, scene.declared["bar_of"])
    prepared: Any = prepared_model(scene.declared["bar_of"], case, BuildContext(scene=scene))[0]
    problem = problem_of(prepared, case)
    half = replace(problem, forces=0.4 * problem.forces, values=0.4 * problem.values)
    found = []
    for number, own in enumerate((replace(problem, shares=(0.4, 1.0)), half)):
        folder = tmp_path / str(number)
        folder.mkdir()
        calculix.write(own, folder)
        subprocess.run(calculix.command(folder), cwd=folder, stdout=subprocess.DEVNULL, timeout=300, check=True)
        found.append(calculix.read(folder).u)
    assert found[0].shape[0] == 2
    assert np.abs(found[0][0] - found[1][0]).max() < 1e-8 * np.abs(found[1][0]).max()


@needs_ccx
@pytest.mark.slow
def test_it_says_its_version() -> None:
    version = calculix.version()
    assert version is not None
    assert version[0].isdigit()


@needs_ccx
@pytest.mark.slow
def test_an_exported_deck_is_run_by_hand_and_judged(tmp_path: Path) -> None:
    """Its .frd has six digits of each displacement in mm, of which the largest is 208 mm: 1e-5 of the tip's error."""
    assert main(["export", "silicone-beam", "--to", "calculix", "--model", "linear_tet", "--out", str(tmp_path)]) == 0
    folder, report = tmp_path / "linear_tet", tmp_path / "report.json"
    subprocess.run(["ccx", "-i", "job"], cwd=folder, stdout=subprocess.DEVNULL, timeout=120, check=True)
    asked = ["judge", "silicone-beam", str(folder / "job.frd"), "--unit", "1mm", "--as", "ccx", "--json", str(report)]
    main(asked)
    theirs = json.loads(report.read_text())["models"]["ccx"]["metrics"]
    ours = softmark.load("silicone-beam").run(models="linear_tet").models["linear_tet"].metrics
    for metric in ("eta", "drop", "tip"):
        assert theirs[metric]["value"] == pytest.approx(ours[metric].value, rel=1e-5)


SPINNING = """
softmark 1
scene "A bar that rotates about an axis beside it"
material stiff = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
material rubber = neo_hookean_isochoric(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(cylinder(length = 60 mm, radius = 10 mm, axis = +x), LAW)
support wall = fixed(bar, where = x <= 0 mm)
load spin = LOAD
model bar_of = fem(ELEMENT, strain = STRAIN, size = 8 mm)
probe tip = point(bar, at = (60, 0, 0) mm)
metric u = displacement(tip, along = +x)
"""


def prepared_bar(scene: Any) -> tuple[Any, Any]:
    """The built model of a scene and its case."""
    declared = scene.declared["bar_of"]
    case = case_for(scene, declared)
    prepared = prepared_model(declared, case, BuildContext(scene=scene, measured=Measurements(scene)))[0]
    return prepared, case


@needs_ccx
@pytest.mark.slow
@pytest.mark.parametrize(("element", "near"), [("tet4", 3e-4), ("tet10", 3e-5), ("hex8", 5e-7), ("hex20", 5e-7)])
@pytest.mark.parametrize(("strain", "law"), [("small", "stiff"), ("finite", "rubber")])
def test_a_rotation_is_its_own_centrifugal_load(
    element: str, near: float, strain: str, law: str, tmp_path: Path
) -> None:
    """CalculiX gets the mesh, the law and its card CENTRIF, and no forces of ours: it integrates by itself.

    10 rad/s about an axis 20 mm beside the bar stretches and bends it. In hexahedra both integrate exactly, and 5e-7 is
    what CalculiX leaves in an iteration. It has one point in C3D4 and four in C3D10, which do not integrate products of
    shape functions: by that it is 2e-4 and 2e-5 off.
    """
    text = SPINNING.replace("LAW", law).replace("ELEMENT", element).replace("STRAIN", strain)
    weighed = softmark.loads(text.replace("LOAD", "gravity(1 m/s^2)")).scene
    calculix.write(problem_of(*prepared_bar(weighed)), tmp_path)
    deck, n = tmp_path / "job.inp", 0.5**0.5
    before, _, rest = deck.read_text().partition("*CLOAD\n")
    card = f"*DLOAD\nPART1,CENTRIF,100.,0.,20.,0.,0.,{n:.15f},{n:.15f}\n"
    deck.write_text(before + card + rest[rest.index("*NODE PRINT") :])
    with (tmp_path / calculix.LOG).open("w") as log:
        subprocess.run(calculix.command(tmp_path), cwd=tmp_path, stdout=log, timeout=300, check=True)
    answer = calculix.read(tmp_path)
    assert answer.settled
    spin = "centrifugal(bar, axis = (0, 1, 1), through = (0, 20, 0) mm, speed = 10 rad/s)"
    ours = prepared_bar(softmark.loads(text.replace("LOAD", spin)).scene)[0].solve(lambda *_: None).mesh.displacement
    assert np.abs(answer.u[-1] - ours).max() < near * np.abs(ours).max()
