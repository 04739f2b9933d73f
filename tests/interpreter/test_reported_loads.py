"""What loads come to, in the report of every kind of model, and the scenes in which they came to something else."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hollow_sphere_octant import octant

import softmark
from softmark.interpreter.models.model_builders import build
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.problem.body_case import case_for
from softmark.interpreter.problem.surface_selection.load_resultants import load_mismatch_warnings, resultants
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.verification.error_estimate import is_doubt

BAR = """
material gel = neo_hookean(young = 600 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (100, 20, 20) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
probe tip = point(bar, at = (100, 10, 10) mm)
"""


def said(text: str) -> dict[str, Any]:
    """The resultants of the first model of a scene, without solving it."""
    scene = softmark.loads(text).scene
    declared = next(iter(scene.of_kind("model").values()))
    case = case_for(scene, declared)
    prepared = build(declared, case, BuildContext(scene=scene))
    return {n: r.to_json() | {"doubts": [d.code for d in load_mismatch_warnings(case, declared, {n: r})]}
            for n, r in resultants(case, prepared).items()}  # fmt: skip


NET = "mass_spring(network = hex8, size = {} mm, stiffness = from_material())"
MODELS = ["fem(tet4, strain = finite, size = 10 mm)", "fem(tet10, strain = finite, size = 10 mm)",
          "fem(hex8, strain = small, size = 7 mm)", NET.format(7)]  # fmt: skip


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("load", "area", "force", "middle"),
    [
        # on 8 x 8 samples a band of 0.96 mm was one of 1.25 mm: 1.000 N
        ("traction(bar, where = x >= 99.04 mm and x < 99.999999 mm, vector = (0, 0, 10) kPa)",
         0.08 * (0.96e-3 - 1e-9), (0, 0, 0.768 - 8e-7), (0.09952, 0.01, 0.01)),
        ("pressure(bar, where = x >= 100 mm and z >= 18.6 mm, magnitude = 1 kPa)",
         0.02 * 1.4e-3, (-0.028, 0, 0), (0.1, 0.01, 0.0193)),
        # 0.6 of 10 mm: was refused; 0.7: was 1 mm
        ("traction(bar, where = z >= 20 mm and x >= 99.4 mm, vector = (0, 1, 0) kPa)",
         0.02 * 0.6e-3, (0, 0.012, 0), (0.0997, 0.01, 0.02)),
        ("traction(bar, where = z >= 20 mm and x >= 99.3 mm, vector = (0, 1, 0) kPa)",
         0.02 * 0.7e-3, (0, 0.014, 0), (0.09965, 0.01, 0.02)),
        ("pressure(bar, where = z >= 20 mm and (x - 41 mm)^2 + (y - 9 mm)^2 <= (6 mm)^2, magnitude = 1 kPa)",
         math.pi * 36e-6, (0, 0, -math.pi * 0.036), (0.041, 0.009, 0.02)),
    ],
)  # fmt: skip
def test_force_and_moment_of_loads_on_parts_of_facets(
    model: str, load: str, area: float, force: tuple[float, ...], middle: tuple[float, ...]
) -> None:
    """Forces and moments about the origin by hand, to 1e-8."""
    found = said(f"{BAR}load push = {load}\nmodel m = {model}")["push"]
    size = np.linalg.norm(force)
    np.testing.assert_allclose(found["force"], force, atol=1e-8 * size)
    np.testing.assert_allclose(found["moment"], np.cross(middle, force), atol=1e-8 * size)
    np.testing.assert_allclose(found["exact_force"], force, atol=1e-8 * size)
    assert (found["area"], found["share"]) == (pytest.approx(area, rel=1e-8), pytest.approx(1.0, abs=1e-8))
    assert found["remainder"] < 1e-9 * area
    assert found["doubts"] == []


def test_a_tenth_of_a_face_is_a_tenth() -> None:
    """z >= 27 mm of a face of 30 mm on tet10 of 10 mm: 8 x 8 samples took 0.9375 of it."""
    text = BAR.replace("(100, 20, 20)", "(100, 30, 30)")
    text += "load push = traction(bar, where = x >= 100 mm and z >= 27 mm, vector = (0, 0, 1) kPa)\n"
    found = said(text + "model m = fem(tet10, strain = small, size = 10 mm)")["push"]
    assert found["force"][2] == pytest.approx(0.09, rel=1e-12)


ROD = """
material gel = neo_hookean(young = 600 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(cylinder(length = 200 mm, radius = 10 mm, origin = (1, 2, 3) mm), gel)
support wall = fixed(bar, where = x <= 1 mm)
load end = traction(bar, where = x >= 201 mm, vector = (1, 0, -3) kPa)
load weight = gravity(9.81 m/s^2)
load pull = point_force(bar, at = (101, 2, 3) mm, vector = (0, 2, 0) N)
probe tip = point(bar, at = (201, 2, 3) mm)
"""
AREA = math.pi * 1e-4
WEIGHT = 1000 * AREA * 0.2 * 9.81


def test_loads_of_a_beam_are_exact() -> None:
    """Forces on sections: pi R^2 t at the end, rho g pi R^2 L in the middle, and a force where it acts."""
    found = said(ROD + "model rod = beam6dof(segments = 7)")
    for name, force, middle in (
        ("end", (AREA * 1e3, 0, -AREA * 3e3), (0.201, 0.002, 0.003)),
        ("weight", (0, 0, -WEIGHT), (0.101, 0.002, 0.003)),
        ("pull", (0, 2, 0), (0.101, 0.002, 0.003)),
    ):
        np.testing.assert_allclose(found[name]["force"], force, atol=1e-12)
        np.testing.assert_allclose(found[name]["moment"], np.cross(middle, force), atol=1e-12)
        np.testing.assert_allclose(found[name]["exact_force"], force, atol=1e-9)
        assert found[name]["share"] == pytest.approx(1.0, abs=1e-9)
        assert found[name]["area"] == (None if name != "end" else pytest.approx(AREA, rel=1e-12))


def test_what_a_coarse_mesh_does_not_take_is_said() -> None:
    """An end of n corners has n/2 sin(2 pi/n) R^2 of pi R^2; the doubt counts, and is a part of the stated error."""
    found = said(ROD + "model coarse = fem(tet4, strain = small, size = 6 mm)")["end"]
    n = next(n for n in range(8, 65, 4) if abs(found["area"] - n / 2 * math.sin(2 * math.pi / n) * 1e-4) < 1e-12)
    share = n / (2 * math.pi) * math.sin(2 * math.pi / n)
    assert found["share"] == pytest.approx(share, rel=1e-9)
    np.testing.assert_allclose(found["force"], share * np.array(found["exact_force"]), rtol=1e-9)
    assert found["doubts"] == ["W371"]
    assert is_doubt("W371")
    assert is_doubt("W372")


def test_models_of_other_kinds_say_it_too() -> None:
    """In motion at full size; of reduced models what the model acts with that they reduce."""
    text = BAR + "load push = pressure(bar, where = z >= 20 mm and x >= 93 mm, magnitude = 1 kPa)\n"
    moving = "analysis a = dynamic(duration = 2 ms, step = 1 ms)\n"
    full = "model full = fem(hex8, strain = small, size = 10 mm)\n"
    models = ["", "model few = modal(full, modes = 3)\n", f"model net = {NET.format(10)}\n"]
    for more in models:
        scene = softmark.loads(text + moving + full + more).scene
        declared = list(scene.of_kind("model").values())[-1]
        case = case_for(scene, declared)
        found = resultants(case, build(declared, case, BuildContext(scene=scene)))["push"]
        np.testing.assert_allclose(found.force, (0, 0, -0.02 * 0.007 * 1e3), atol=1e-12)


def test_the_report_says_it(tmp_path: Path) -> None:
    """In JSON as the contract has it, in the page as a table, and in what is stated as a part."""
    text = BAR + "load push = traction(bar, where = z >= 20 mm and x >= 93 mm, vector = (0, 0, -1) kPa)\n"
    text += "load weight = gravity(9.81 m/s^2)\nmodel m = fem(hex8, strain = small, size = 10 mm)\n"
    (tmp_path / "my.scene").write_text(text)
    loaded = softmark.load(tmp_path / "my.scene")
    report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(stated=()))
    loads = json.loads(report.dumps())["models"]["m"]["loads"]
    keys = {"force", "moment", "area", "exact_force", "share", "remainder", "leaning"}
    assert {n: set(entry) for n, entry in loads.items()} == {"push": keys, "weight": keys}
    assert loads["weight"]["area"] is None
    assert report.models["m"].stated["tip"].parts["loads"] < 1e-9
    page = render(report)
    assert '<h2 id="loads-heading">Loads</h2>' in page
    assert '<th scope="col">Moment</th><th scope="col">Taken</th>' in page
    assert "N\N{MIDDLE DOT}m</td>" in page
    assert "(0, 0, −140) mN" in page


SPHERE = """
material gel = linear_elastic(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body ball = solid(mesh("{file}", unit = 1 mm), gel)
support sx = fixed(ball, where = x <= 0 mm, components = x)
support sy = fixed(ball, where = y <= 0 mm, components = y)
support sz = fixed(ball, where = z <= 0 mm, components = z)
load push = pressure(ball, where = sqrt(x^2 + y^2 + z^2) <= 10.001 mm, magnitude = 1 kPa)
model m = fem({kind}, strain = small)
probe inner = point(ball, at = (10, 0, 0) mm)
"""


@pytest.mark.parametrize(
    ("kind", "cells", "within"),
    [pytest.param("tet10", "tetra10", 0.01, marks=pytest.mark.slow), ("hex8", "hexahedron", 0.04)],
)
def test_a_hollow_sphere_of_a_file_under_pressure(tmp_path: Path, kind: str, cells: str, within: float) -> None:
    """Lame: u(a) = p a^3 / (E (b^3 - a^3)) ((1 - 2 nu) a + (1 + nu) b^3 / (2 a^2)).

    Quadratic facets bulge out of the selection between their nodes: it was 24 to 34 % too small. `within` is what these
    meshes are off when every facet of the inner side is loaded, which is what is meant.
    """
    import meshio

    mesh = octant(10.0, 20.0, 4, 4, kind)
    meshio.write(tmp_path / "ball.vtu", meshio.Mesh(mesh.points, [(cells, mesh.cells)]))
    (tmp_path / "my.scene").write_text(SPHERE.format(file="ball.vtu", kind=kind))
    report = softmark.load(tmp_path / "my.scene").run()
    assert report.models["m"].status == "converged", report.models["m"].message
    E, nu, a, b, p = 1e5, 0.3, 0.01, 0.02, 1e3
    lame = p * a**3 / (E * (b**3 - a**3)) * ((1 - 2 * nu) * a + (1 + nu) * b**3 / (2 * a**2))
    u = report.models["m"].probes["inner"].displacement[0, 0]
    assert u == pytest.approx(lame, rel=within)
    found = report.models["m"].loads["push"]
    assert (found.exact_force, found.share) == (None, 1.0)
    assert found.leaning == pytest.approx(4 * math.pi * a**2 / 8, rel=0.02)


def test_the_moment_of_a_load_is_that_of_the_model_which_takes_most_of_it() -> None:
    """rho g pi R^2 L^2 / 2 = 9.687 mN m beside the exact force; the mesh of flat facets has less, and was shown."""
    text = """
material gel  = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     rod  = solid(cylinder(length = 100 mm, radius = 7.93 mm), gel)
support  wall = fixed(rod, where = x <= 0 mm)
load     down = gravity(9.81 m/s^2)
model    tets = fem(tet4, strain = small, size = 8 mm)
{more}
probe    tip  = point(rod, at = (100, 0, 0) mm)
"""
    exact = 1000 * 9.81 * math.pi * 0.00793**2 * 0.1**2 / 2
    both = render(softmark.loads(text.format(more="model beam = beam6dof(segments = 4)")).run())
    assert f"(0, {1e3 * exact:.5g}, 0) mN\N{MIDDLE DOT}m</td>" in both
    alone = render(softmark.loads(text.format(more="")).run())
    assert f"(0, {1e3 * exact:.5g}, 0)" not in alone
    assert "m in <code>tets</code></td>" in alone


@pytest.mark.long
@pytest.mark.slow
def test_curved_facets_are_not_offered_to_who_has_them() -> None:
    """Few large tet10 on a sphere carry 0.2 % too much: smaller cells help, and tet10 is what there is."""
    text = "material gel = neo_hookean(young = 600 kPa, poisson = 0.3, density = 1000 kg/m^3)\n"
    text += "body ball = solid(sphere(radius = 100 mm, part = octant), gel)\n"
    text += "".join(f"support s{a} = symmetric(ball, where = {a} <= 0 mm)\n" for a in "xyz")
    text += "load all = pressure(ball, where = x^2 + y^2 + z^2 >= 9990 mm^2, magnitude = 1 kPa)\n"
    for element, remedy in (("tet10", "use a smaller size: its curved"), ("tet4", "use a smaller size, or tet10")):
        scene = softmark.loads(text + f"model m = fem({element}, strain = small, size = 100 mm)").scene
        declared = next(iter(scene.of_kind("model").values()))
        case = case_for(scene, declared)
        notes = load_mismatch_warnings(
            case, declared, resultants(case, build(declared, case, BuildContext(scene=scene)))
        )
        assert [n.code for n in notes] == ["W371"]
        assert notes[0].help.startswith(remedy)
