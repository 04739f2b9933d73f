"""Named groups of mesh files: the same as conditions on coordinates that select the same, from every format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from loaded_modules import loaded_by

import softmark
from softmark.interpreter.language.coordinate_conditions import Condition, MembersUnknown, Term
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_scene
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.problem.mesh_group_conditions import split_by_groups
from softmark.interpreter.problem.probe_points import ProbePoints, find_probe_points
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh import mesh_groups
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.mesh_refinement import build_finer_space
from softmark.solvers.mesh.shapes import Box, MeshFile

L, H = 0.04, 0.01  # m, of the bar
TWO = {"soft": "x < 20 mm", "hard": "x > 20 mm", "wall": "x <= 0 mm", "tip": "x >= 40 mm", "top": "z >= 10 mm"}
NODES = """*NODE
1, 0, 0, 0
2, 10, 0, 0
3, 20, 0, 0
4, 0, 10, 0
5, 10, 10, 0
6, 20, 10, 0
7, 0, 0, 10
8, 10, 0, 10
9, 20, 0, 10
10, 0, 10, 10
11, 10, 10, 10
12, 20, 10, 10
"""
INP = (
    NODES
    + """** a block without a set, and one with: meshio gives the set to the wrong one
*ELEMENT, TYPE=C3D8
1, 1, 2, 5, 4,
7, 8, 11, 10
*ELEMENT, TYPE=C3D8, ELSET=hard
2, 2, 3, 6, 5, 8, 9, 12, 11
*ELSET, ELSET=both, GENERATE
1, 2
*ELSET, ELSET=all
both
*NSET, NSET=wall
1, 4, 7, 10
*NSET, NSET=loose
1, 2, 3, 4, 7, 10
*SURFACE, NAME=tip
hard, S4
*SURFACE, NAME=top, TYPE=ELEMENT
both, S2
"""
)


def bar(inverted: bool = False) -> tuple[Mesh, dict[str, Any]]:
    """Hexahedra of a bar, and its cells and facets by name; some of its cells inside out in the file."""
    mesh = Box(size=(L, H, H)).mesh("hex8", H / 2)
    X, middle = mesh.points[mesh.facets], mesh.points[mesh.cells].mean(axis=1)[:, 0]
    facets = {
        name: mesh.facets[(np.abs(X[:, :, axis] - at) < 1e-9).all(axis=1)]
        for name, axis, at in (("wall", 0, 0.0), ("tip", 0, L), ("top", 2, H))
    }
    cells = mesh.cells.copy()
    if inverted:
        cells[::3] = cells[::3][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return Mesh(mesh.points, cells, "hex8"), {"hard": middle > L / 2, **facets}


def gmsh(path: Path, inverted: bool = False) -> str:
    """The bar in Gmsh's format 2."""
    mesh, known = bar(inverted)
    names = ["wall", "tip", "top"]
    tags = [np.where(known["hard"], 2, 1), *(np.full(len(known[n]), 7 + i) for i, n in enumerate(names))]
    ids = {"soft": [1, 3], "hard": [2, 3], "wall": [7, 2], "tip": [8, 2], "top": [9, 2]}
    cells = [("hexahedron", mesh.cells), *(("quad", known[n]) for n in names)]
    meshio.write(path, meshio.Mesh(
        mesh.points, cells, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array(own) for name, own in ids.items()},
    ), "gmsh22", binary=False)  # fmt: skip
    return str(path)


def scene(file: str, regions: str, more: str = "") -> str:
    """A bar of two materials under its weight, a pull at one named face and a pressure on another."""
    return f"""material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
material stiff = linear_elastic(young = 120 kPa, poisson = 0.2, density = 2000 kg/m^3)
body bar = solid(mesh("{file}", unit = 1 m), gel)
{regions}
support clamp = fixed(bar, where = wall)
load weight = gravity(9.81 m/s^2, direction = -z)
load pull = traction(bar, where = tip, vector = (1, 0, 0) kPa)
load push = pressure(bar, where = top and x >= 12 mm, magnitude = 100 Pa)
model hexes = fem(hex8, strain = corotational, integration = selective)
model quads = fem(tet10, strain = small)
model springs = mass_spring(network = hex8, stiffness = from_material())
probe end = point(bar, at = (40, 0, 0) mm)
probe face = surface(bar, where = tip and z >= 2 mm)
probe half = volume(bar, where = hard and y >= 3 mm)
metric down = displacement(end, along = -z)
metric all = displacement(face, along = -z)
metric mean = strain(half, component = xx, over = mean)
metric apart = energy_norm_error(half, against = quads)
{more}"""


def found(text: str) -> dict[str, float]:
    """All metrics and stated errors of all models."""
    loaded = softmark.loads(text)
    report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=()))
    values: dict[str, float] = {}
    for name, model in report.models.items():
        assert model.status == "converged", (name, model.message)
        values |= {f"{name}.{m}": own.value for m, own in model.metrics.items() if own.value is not None}
        values |= {f"{name}.{m} +-": own.value for m, own in model.stated.items() if own.value is not None}
    return values


@pytest.mark.long
@pytest.mark.slow
def test_groups_are_what_coordinates_select_in_every_model_and_stated_error(tmp_path: Path) -> None:
    """Materials, loads, supports, probes, watchdog and finer spaces: the same problem, so the same to rounding."""

    def own(name: str) -> str:
        return ", material = stiff" if name == "hard" else ""

    file = gmsh(tmp_path / "bar.msh")
    named = "\n".join(f'region {n} = group(bar, "{n}"{own(n)})' for n in TWO)
    placed = "\n".join(
        f"region {n} = part(bar, where = {w}{', material = stiff' * (n == 'hard')})" for n, w in TWO.items()
    )
    no_springs = [line for line in scene(file, named).splitlines() if "springs" not in line]
    one = found("\n".join(no_springs))
    other = found("\n".join(no_springs).replace(named, placed))
    assert len(one) >= 8
    assert one.keys() == other.keys()
    for name, value in one.items():
        assert value == pytest.approx(other[name], rel=1e-9), name


def test_springs_take_groups_too(tmp_path: Path) -> None:
    file = gmsh(tmp_path / "bar.msh")
    text = f"""material gel = linear_elastic(young = 60 kPa, poisson = 0.25, density = 1000 kg/m^3)
body bar = solid(mesh("{file}", unit = 1 m), gel)
region wall = group(bar, "wall")
support clamp = fixed(bar, where = wall)
load weight = gravity(9.81 m/s^2, direction = -z)
model springs = mass_spring(network = hex8, stiffness = from_material())
probe end = point(bar, at = (40, 0, 0) mm)
metric down = displacement(end, along = -z)
"""
    assert found(text) == pytest.approx(found(text.replace('group(bar, "wall")', "part(bar, where = x <= 0 mm)")))


@pytest.mark.parametrize("kind", [None, *ELEMENTS])
@pytest.mark.parametrize("inverted", [False, True])
def test_groups_go_with_the_mesh_where_it_is_turned_split_raised_and_refined(
    tmp_path: Path, kind: str | None, inverted: bool
) -> None:
    mesh = MeshFile(path=gmsh(tmp_path / "bar.msh", inverted), unit=1.0).mesh_with_groups(kind)
    for own in (mesh, build_finer_space(mesh).mesh):
        X = own.points
        for name, axis, at in (("wall", 0, 0.0), ("tip", 0, L), ("top", 2, H)):
            on = np.abs(X[:, axis] - at) < 1e-9
            np.testing.assert_array_equal(mesh_groups.facets_in(own, name), on[own.facets].all(axis=1))
            np.testing.assert_array_equal(mesh_groups.nodes_in(own, name), on)
            assert not mesh_groups.cells_in(own, name).any()
        rear = X[own.cells].mean(axis=1)[:, 0] > L / 2
        np.testing.assert_array_equal(mesh_groups.cells_in(own, "hard"), rear)
        np.testing.assert_array_equal(mesh_groups.facets_in(own, "hard"), rear[own.facet_cells])
        assert own.groups is not None
        assert {g.inside + g.foreign for g in own.groups.values()} == {0}


def test_sets_of_abaqus(tmp_path: Path) -> None:
    """Generated sets, sets of sets, sides S2 and S4, nodes: what meshio stops at or puts elsewhere."""
    file = tmp_path / "two.inp"
    file.write_text(INP)
    mesh = MeshFile(path=str(file), unit=1e-3).mesh_with_groups("hex8")
    assert mesh.groups is not None
    said = {name: (own.described, own.foreign) for name, own in mesh.groups.items()}
    assert said == {
        "tip": ("1 face", 0), "top": ("2 faces", 0), "both": ("2 cells", 0), "hard": ("1 cell", 0),
        "all": ("2 cells", 0), "wall": ("1 face", 0), "loose": ("6 nodes", 0),
    }  # fmt: skip
    assert mesh_groups.cells_in(mesh, "hard").tolist() == [False, True]
    for name, axis, at in (("wall", 0, 0.0), ("tip", 0, 0.02), ("top", 2, 0.01)):
        on = (np.abs(mesh.points[mesh.facets][:, :, axis] - at) < 1e-9).all(axis=1)
        np.testing.assert_array_equal(mesh_groups.facets_in(mesh, name), on)


def test_whole_numbers_on_cells_of_vtu(tmp_path: Path) -> None:
    mesh, known = bar()
    data = {"hard": [known["hard"].astype(np.uint8)], "part": [np.where(known["hard"], 5, 1)], "heat": [mesh.volumes]}
    meshio.write(tmp_path / "bar.vtu", meshio.Mesh(mesh.points, [("hexahedron", mesh.cells)], cell_data=data))
    found = MeshFile(path=str(tmp_path / "bar.vtu"), unit=1.0).mesh_with_groups("tet4").groups
    assert found is not None
    assert set(found) == {"hard", "hard=0", "hard=1", "part=1", "part=5"}
    assert len(found["part=5"].members) == 5 * known["hard"].sum()


def test_gmsh_4_1(tmp_path: Path) -> None:
    """Names, a face inside the body, and half a face that no cell has."""
    file = Path(__file__).parents[1] / "errors" / "parts" / "named.msh"
    found = MeshFile(path=str(file), unit=1e-2).mesh_with_groups().groups
    assert found is not None
    assert {n: (g.described, g.foreign) for n, g in found.items()} == {
        "tip": ("1 face", 0), "wall": ("1 face", 0), "between": ("1 face, 1 inside the body", 0), "half": ("1 face", 1),
        "soft": ("1 cell", 0), "hard": ("1 cell", 0),
    }  # fmt: skip


def test_a_condition_with_a_group_is_never_asked_at_a_place() -> None:
    behind = Condition.comparison(">", Term.coordinate(0), Term.constant(1.0), 1)
    where = Condition.junction("and", Condition.group("a"), Condition.negation(behind))
    with pytest.raises(MembersUnknown):
        where.holds(0.0, 0.0, 0.0, 1.0)
    assert where.over((0.0, 0.0, 0.0), (0.5, 1.0, 1.0)) == (True, True)
    members = np.array([True, False, True])
    X = np.array([0.0, 0.0, 2.0])
    held = np.zeros(3, dtype=bool)
    for own, which in split_by_groups(where, lambda name: members):
        held[which] = own.holds(X[which], 0.0, 0.0, 1.0)
    assert held.tolist() == [True, False, False]


def test_a_probe_of_a_part_of_a_volume_has_its_volume_and_moments() -> None:
    """A quarter of a sphere in a box, and half of the box: planes are exact, a sphere by straight pieces."""
    text = """material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 10, 10) mm), gel)
support clamp = fixed(bar, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
model hexes = fem(hex8, strain = small, size = 5 mm)
probe half = volume(bar, where = x + y > 7 mm, size = 4 mm)
probe ball = volume(bar, where = (x - 10 mm)^2 + y^2 + z^2 < (8 mm)^2, size = 1.25 mm)
metric mean = strain(half, component = xx, over = mean)
metric some = strain(ball, component = xx, over = mean)
"""
    own = softmark.loads(text).scene

    def seen(name: str) -> ProbePoints:
        return find_probe_points(own.declared[name], case_of(own, "bar"), lambda name: np.zeros((0, 3)))

    half, ball = seen("half"), seen("ball")
    assert half.weights is not None
    assert ball.weights is not None
    corner = 7e-3**2 / 2 * 1e-2  # m^3, a prism cut off
    assert half.weights.sum() == pytest.approx(2e-6 - corner, rel=1e-12)
    moment = 2e-6 * 1e-2 - corner * 7e-3 / 3
    assert half.weights @ half.X[:, 0] == pytest.approx(moment, rel=1e-12)
    assert ball.weights.sum() == pytest.approx(np.pi * 8e-3**3 / 3, rel=1e-2)  # a quarter, by chords


@pytest.mark.slow
def test_a_scene_without_groups_imports_nothing_for_them() -> None:
    scene = """material gel = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 10, 10) mm), gel)
support clamp = fixed(bar, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
model hexes = fem(hex8, strain = small, size = 10 mm)
probe end = point(bar, at = (20, 0, 0) mm)
metric down = displacement(end, along = -z)
"""
    new = {"solvers.mesh.mesh_groups", "solvers.mesh.files.named_groups", "solvers.mesh.files.abaqus.deck_groups"}
    assert not new & loaded_by(scene)


@pytest.mark.slow
def test_an_answer_that_a_finer_space_has_too_has_an_error_of_rounding() -> None:
    """Pulled evenly, bricks are exact: all steps from there to a finer space are rounding, and none is the shortest."""
    file = Path(__file__).parents[2] / "stdlib-scenes" / "blocks" / "named-parts.scene"
    lines = [
        line for line in file.read_text().splitlines() if not line.startswith(("model curved", "model tets", "expect"))
    ]
    text = "\n".join(lines).replace('"named-parts.msh"', f'"{file.with_suffix(".msh")}"')
    values = found(text)
    assert values["bricks.pulled"] == pytest.approx(8e-3, rel=1e-9)
    assert values["bricks.pulled +-"] < 1e-9 * 8e-3
