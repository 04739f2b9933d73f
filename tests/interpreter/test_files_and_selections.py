"""What a run would refuse is refused when a scene is checked; what models cannot do that nobody asks for is not."""

from __future__ import annotations

import math
import random
from pathlib import Path

import meshio
import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.validation import file_and_selection_checks
from softmark.solvers.mesh.files import mesh_formats

TWO = """
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 20 mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load push = pressure(beam, where = z >= 15 mm, magnitude = 10 Pa)
model fe = fem(tet4, strain = small, size = 20 mm)
model rod = beam6dof(segments = 4)
model few = modal(fe, modes = 3)
probe tip = point(beam, at = (100, 0, 0) mm)
metric sag = displacement(tip, along = -z)
"""


def test_every_format_that_is_read_is_known_by_its_ending() -> None:
    """An ending that meshio reads and this list does not know would be refused; one of both lists has no meaning."""
    read = {Path(f"a{ending}").suffix for ending in meshio.extension_to_filetypes}
    assert read == mesh_formats.MESHES | mesh_formats.SURFACES
    assert not mesh_formats.MESHES & mesh_formats.SURFACES


@pytest.mark.parametrize(("name", "steps"), [("skin.stl", False), ("skin.ply", True), ("skin.msh", False)])
def test_a_surface_is_filled_by_what_fills_it(name: str, steps: bool) -> None:
    """`gmsh -3 skin.stl` of Gmsh 4.15 leaves 12 triangles; with a volume it makes tetrahedra. It merges no .ply."""
    said = mesh_formats.advise_filling(Path(name))
    assert "Surface Loop(1) = Surface{:}; Volume(1) = {1};" in said
    assert ("meshio convert skin.ply skin.stl" in said) == steps
    assert f"gmsh -3 {name}" not in said


@pytest.mark.slow
@pytest.mark.long
def test_what_another_model_cannot_do_stops_no_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "two.scene"
    file.write_text(TWO, encoding="utf-8")
    out = ["--out", str(tmp_path / "out")]
    assert main(["run", str(file), *out]) == 2
    assert "E501" in capsys.readouterr().err
    assert main(["run", str(file), "--model", "rod", *out]) == 2, "what is asked for has to be possible"
    assert "E501" in capsys.readouterr().err
    assert main(["plan", str(file), "--model", "fe"]) == 0
    assert main(["run", str(file), "--model", "fe", *out]) == 0
    assert "E501" not in capsys.readouterr().err
    assert main(["check", str(file)]) == 2


@pytest.mark.slow
@pytest.mark.parametrize("command", ["compare", "stress"])
def test_studies_of_one_model_are_not_stopped_by_another(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "two.scene"
    file.write_text(TWO, encoding="utf-8")
    main([command, str(file), "--model", "fe", "--out", str(tmp_path / "out"), *STUDY[command]])
    said = capsys.readouterr()
    assert "E501" not in said.err + said.out
    assert main([command, str(file), "--out", str(tmp_path / "other")]) == 2


STUDY = {"compare": ["--repeats", "0"], "stress": []}


def test_a_model_needs_what_it_is_made_from() -> None:
    from softmark.interpreter.validation.requested_names import needed_models

    scene = softmark.loads(TWO.replace("model rod = beam6dof(segments = 4)\n", "")).scene
    assert needed_models(scene, ["few"]) == ("fe", "few")
    assert needed_models(scene, []) == needed_models(scene, ["nobody"]) == ()


BODY = """
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body beam = solid({shape}, gel)
support wall = fixed(beam, where = x <= 0 mm)
load push = pressure(beam, where = x >= 0 mm, magnitude = 10 Pa)
load ball = pressure(beam, where = sqrt((x - {x} mm)^2 + (y - {y} mm)^2 + (z - {z} mm)^2) <= {r} mm, magnitude = 10 Pa)
"""


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("shape", ["cylinder(length = 100 mm, radius = 20 mm)", "box(size = (100, 40, 30) mm)"])
def test_a_selection_is_refused_only_where_it_misses_the_surface(shape: str) -> None:
    """Balls at random places: their distance from the surface is known, and so is whether they reach it."""
    rng, judged = random.Random(4), {True: 0, False: 0}
    for _ in range(60):
        x, r = rng.uniform(5, 95), rng.uniform(0.5, 15)
        y, z = rng.uniform(-14, 14), rng.uniform(-14, 14)
        if "cylinder" in shape:
            depth = min(x, 100 - x, 20 - math.hypot(y, z))
        else:
            depth = min(x, 100 - x, 40 - (y + 20), y + 20, 30 - (z + 15), z + 15)
            y, z = y + 20, z + 15
        if abs(depth - r) < 0.3 or depth < 0:  # nearer than the search looks
            continue
        text = BODY.format(shape=shape, x=x, y=y, z=z, r=r)
        scene = softmark.loads(text).scene if depth < r else None
        try:
            scene = scene or softmark.loads(text).scene
            refused = False
        except softmark.SceneError as error:
            refused = [d.code for d in error.diagnostics] == ["E302"]
        assert refused == (depth > r), (x, y, z, r, depth)
        judged[refused] += 1
    assert min(judged.values()) > 5


def test_a_selection_of_the_surface_is_seen_with_little_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Conditions on whole faces, the usual ones: a hundred cells at most, not thousands."""
    monkeypatch.setattr(file_and_selection_checks, "MOST", 100)
    for where in ("x >= 100 mm", "z >= 15 mm", "x >= 50 mm and x <= 51 mm", "not x <= 0 mm"):
        text = TWO.replace("z >= 15 mm", where).replace("model rod = beam6dof(segments = 4)\n", "")
        softmark.loads(text)
