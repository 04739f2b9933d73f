"""Mesh files that are broken, one way each: right, or one diagnostic with its place and what to do.

The meshes are a bar of 3 x 1 x 1 cubes of 10 mm, hexahedra or tetrahedra, and what a careless program makes of it.
"""

from __future__ import annotations

import re
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from softmark.solvers.elements.tet10 import Tet10
from softmark.solvers.mesh.cell_splitting import add_midside_nodes, split_into_five
from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh
from softmark.solvers.mesh.files.mesh_validation import find_overlap
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box, Cylinder, MeshFile

Parts = tuple[np.ndarray, np.ndarray]  # points in mm, cells
NAMES = {"tet4": "tetra", "hex8": "hexahedron", "tet10": "tetra10"}


def grid(nx: int, ny: int = 1) -> Mesh:
    """Cubes of 10 mm in a plane layer, in m."""
    x, y, z = np.meshgrid(*(0.01 * np.arange(n + 1) for n in (nx, ny, 1)), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.stack([number[i : nx + i, j : ny + j, k : 1 + k].ravel() for i, j, k in corners], axis=1)
    return Mesh(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), cells, "hex8")


def bar(kind: str = "tet4", count: int = 3) -> Parts:
    mesh = grid(count)
    mesh = (
        mesh
        if kind == "hex8"
        else split_into_five(mesh)
        if kind == "tet4"
        else add_midside_nodes(split_into_five(mesh), Tet10)
    )
    return 1e3 * mesh.points, mesh.cells.copy()


def saved(path: Path, points: np.ndarray, cells: np.ndarray, kind: str = "tet4") -> Path:
    with warnings.catch_warnings():  # meshio's own deprecations are not under test
        warnings.simplefilter("ignore")
        form = "gmsh" if path.suffix == ".msh" else None
        meshio.Mesh(points, [(NAMES.get(kind, kind), cells)]).write(path, file_format=form)
    return path


def refused(path: Path, kind: str = "tet4", **options: Any) -> UnreadableMesh:
    with pytest.raises(UnreadableMesh) as caught:
        MeshFile(str(path), 1e-3, **options).mesh(kind)
    return caught.value


# ------------------------------------------------------------------ flaws


def cut_apart(points: np.ndarray, cells: np.ndarray, gap: float = 0.0) -> Parts:
    """Cells on the two sides of x = 10 mm get nodes of their own there."""
    here = np.flatnonzero(np.abs(points[:, 0] - 10) < 1e-9)
    number = np.arange(len(points))
    number[here] = len(points) + np.arange(len(here))
    right = points[cells].mean(axis=1)[:, 0] > 10
    cells = cells.copy()
    cells[right] = number[cells[right]]
    return np.concatenate([points, points[here] + [gap, 0, 0]]), cells


def moved(points: np.ndarray, cells: np.ndarray, by: tuple[float, float, float]) -> Parts:
    """The bar, and a copy of it elsewhere."""
    return np.concatenate([points, points + by]), np.concatenate([cells, cells + len(points)])


def joined(points: np.ndarray, cells: np.ndarray) -> Parts:
    """Points at the same place made one."""
    single, number = np.unique(np.round(points, 6), axis=0, return_inverse=True)
    return single, number.ravel()[cells]


def with_cells(points: np.ndarray, cells: np.ndarray, *more: np.ndarray) -> Parts:
    return points, np.concatenate([cells, *(m[None] for m in more)])


def third_on_a_face(points: np.ndarray, cells: np.ndarray) -> Parts:
    """A cell more on a face that has two already."""
    new = np.concatenate([points, [[10.0, 5.0, 25.0]]])
    sides = cells[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    face = sides[first[count == 2][0]]
    return with_cells(new, cells, np.append(face, len(points)))


def same_side(points: np.ndarray, cells: np.ndarray) -> Parts:
    """A tetrahedron on a face of the surface, on the side where its cell lies."""
    facet = Mesh(points, cells).facets[0]
    inner = points[facet].mean(axis=0) + 0.2 * (points.mean(axis=0) - points[facet].mean(axis=0))
    return with_cells(np.concatenate([points, [inner]]), cells, np.append(facet, len(points)))


def replaced(points: np.ndarray, cells: np.ndarray, node: int, value: Any) -> Parts:
    points = points.copy()
    points[node] = value
    return points, cells


def names(points: np.ndarray, cells: np.ndarray, node: int) -> Parts:
    cells = cells.copy()
    cells[4, 2] = node
    return points, cells


def spiral() -> Parts:
    """A bar of 40 hexahedra bent once and a half around, so that its end passes through its beginning."""
    points, cells = bar("hex8", 40)
    x, y, z = points.T
    angle = 1.5 * 2 * np.pi * x / 400
    return np.stack([(50 + y) * np.cos(angle), (50 + y) * np.sin(angle), z + 0.004 * x], axis=1), cells


FLAWS: dict[str, tuple[Callable[[], Parts], str, str, str]] = {
    # name: what makes it, kind, code, what is said
    "a node too many": (lambda: names(*bar(), 999), "tet4", "E561",
        "cell 4 refers to node 999, but the file has nodes 0 to 15"),
    "nan": (lambda: replaced(*bar(), 5, np.nan), "tet4", "E562",
        r"not a finite number: node 5 lies at \(nan, nan, nan\)"),
    "inf": (lambda: replaced(*bar(), 5, np.inf), "tet4", "E562",
        "not a finite number: node 5"),
    "1e300": (lambda: replaced(*bar(), 5, 1e300), "tet4", "E562",
        r"absurdly large: node 5 lies at \(1e\+297"),
    "-1e300": (lambda: replaced(*bar(), 5, -1e300), "tet4", "E562",
        "absurdly large: node 5"),
    "a cell twice": (lambda: with_cells(*bar(), bar()[1][3][[1, 2, 0, 3]]), "tet4", "E563",
                     r"2 of 16 tetrahedra, the first are cells 3 and 15 at \(.*\) mm"),
    "all flat": (lambda: (bar()[0] * [1, 1, 0], bar()[1]), "tet4", "E564",
        "15 of its 15 tetrahedra are flat, .* cell 0"),
    "some flat": (lambda: replaced(*bar(), 5, bar()[0][4]), "tet4", "E564",
        r"tetrahedra are flat, .* at \(.*\) mm"),
    "a point": (lambda: (0 * bar()[0], bar()[1]), "tet4", "E564",
        "15 of its 15 tetrahedra are flat"),
    "folded": (lambda: replaced(*bar("hex8"), 0, [40, 30, 30]), "hex8", "E564",
        "are folded, .* cell 0"),
    "cut apart": (lambda: cut_apart(*bar()), "tet4", "E565",
        r"4 pairs of its 20 nodes .* nodes 4 and 16 at \(10, 0, 0\) mm"),
    "cut apart, nearly": (lambda: cut_apart(*bar("hex8"), 1e-7), "hex8", "E565",
        "4 pairs of its 20 nodes"),
    "all apart": (lambda: (bar()[0][bar()[1].ravel()], np.arange(60).reshape(-1, 4)), "tet4", "E565",
        "pairs of its 60"),
    "an island": (lambda: moved(*bar(), (0, 0, 50)), "tet4", "E566",
        r"2 parts .* of 15, 15 cells; the smallest has cell 0"),
    "three cells on a face": (lambda: third_on_a_face(*bar()), "tet4", "E567",
        r"cells \d+, \d+ and 15 share a face, at"),
    "two on one side": (lambda: same_side(*bar()), "tet4", "E567",
        "cells .* and 15 lie on the same side of"),
    "joined by an edge": (lambda: joined(*moved(*bar("hex8"), (0, 10, 10))), "hex8", "E568",
                          r"2 parts that share no face .* parts of 3, 3 cells"),
    "joined by a node": (lambda: joined(*moved(*bar("hex8"), (30, 10, 10))), "hex8", "E568",
                         r"node \d+ at \(30, 10, 10\) mm"),
    "through itself": (spiral, "hex8", "E569",
        r"intersects itself: \(.*\) mm lies inside cell \d+"),
}  # fmt: skip


@pytest.mark.parametrize("suffix", ["vtu", "vtk", "msh"])
@pytest.mark.parametrize("flaw", FLAWS)
def test_a_flaw_is_refused_with_its_place_and_what_to_do(tmp_path: Path, flaw: str, suffix: str) -> None:
    made, kind, code, said = FLAWS[flaw]
    error = refused(saved(tmp_path / f"bad.{suffix}", *made(), kind), kind)
    if (code, suffix) == ("E561", "msh"):  # meshio's reader of Gmsh files finds it first
        code, said = "E403", "index 999 is out of bounds"
    assert error.code == code, str(error)
    assert re.search(said, str(error)), str(error)
    assert error.remedy


def test_negative_node_numbers_are_refused(tmp_path: Path) -> None:
    """meshio does not write them; numpy would take them from the end of the list."""
    points, cells = bar()
    file = saved(tmp_path / "whole.vtk", points, cells)
    old, new = struct.pack(">q", 4) + cells[3].astype(">i8").tobytes(), struct.pack(">q", 4)
    data = file.read_bytes()
    place = data.find(cells[3].astype(">i8").tobytes()) if old not in data else data.find(old) + len(new)
    assert place > 0
    file.write_bytes(data[:place] + struct.pack(">q", -1) + data[place + 8 :])
    error = refused(file)
    assert (error.code, "refers to node -1" in str(error)) == ("E561", True)


@pytest.mark.parametrize("kind", ["tet4", "hex8", "tet10"])
def test_what_is_harmless_is_right(tmp_path: Path, kind: str) -> None:
    """Some or all cells inside out, nodes that no cell has, another order: the volume stays that of the bar."""
    points, cells = bar(kind)
    order = np.random.default_rng(1).permutation(len(points))
    variants = {
        "plain": (points, cells),
        "mirrored": (points * [-1, 1, 1], cells),
        "orphans": (np.concatenate([points, [[np.nan] * 3, [1e300] * 3]]), cells),
        "another order": (points[order], np.argsort(order)[cells]),
        "kilometres away": (points + 1e6, cells),
        "a millionth": (points * 1e-6, cells),
        "a billion times": (points * 1e9, cells),
    }
    if kind == "hex8":
        variants["some turned"] = (points, np.concatenate([cells[:1], cells[1:][:, [4, 5, 6, 7, 0, 1, 2, 3]]]))
    for name, (p, c) in variants.items():
        mesh = MeshFile(str(saved(tmp_path / f"{kind}.vtu", p, c, kind)), 1e-3).mesh(kind)
        size = {"a millionth": 1e-6, "a billion times": 1e9}.get(name, 1.0)
        # 16 digits of coordinates 3e4 times the bar leave 12 in a length and 11 or so in a volume
        assert mesh.volumes.sum() == pytest.approx(3e-6 * size**3, rel=1e-9), name
        assert mesh.volumes.min() > 0


def test_nodes_at_one_place_are_merged_or_kept_where_the_scene_says_so(tmp_path: Path) -> None:
    file = str(saved(tmp_path / "cut.vtu", *cut_apart(*bar("hex8"), 1e-7), "hex8"))
    mesh = MeshFile(file, 1e-3, coincident="merge").mesh("hex8")
    assert (len(mesh.points), len(mesh.facets)) == (16, 14)
    assert refused(Path(file), "hex8", coincident="keep").code == "E566"  # a slit all the way through is an island
    points = bar("hex8", 4)[0]
    slit = cut_apart(*bar("hex8", 4))
    whole = np.abs(slit[0][len(points) :, 2]) < 1e-9  # on the floor the slit is joined again
    again = np.arange(len(slit[0]))
    again[len(points) :][whole] = [
        int(np.argmin(np.linalg.norm(points - p, axis=1))) for p in slit[0][len(points) :][whole]
    ]
    kept = saved(tmp_path / "slit.vtu", slit[0], again[slit[1]], "hex8")
    assert refused(kept, "hex8").code == "E565"
    assert refused(kept, "hex8", coincident="keep").code == "E568"  # hangs by an edge


def test_a_slit_that_ends_inside_may_be_meant(tmp_path: Path) -> None:
    """Four cubes around an edge, two of them parted along their common face but for that edge."""
    mesh = grid(2, 2)
    points, cells = 1e3 * mesh.points, mesh.cells.copy()
    lip = np.flatnonzero((np.abs(points[:, 1] - 10) < 1e-9) & (points[:, 0] > 15))
    upper = points[cells].mean(axis=1)[:, 1] > 10
    number = np.arange(len(points))
    number[lip] = len(points) + np.arange(len(lip))
    cells[upper] = number[cells[upper]]
    file = saved(tmp_path / "slit.vtu", np.concatenate([points, points[lip]]), cells, "hex8")
    assert refused(file, "hex8").code == "E565"
    kept = MeshFile(str(file), 1e-3, coincident="keep").mesh("hex8")
    assert len(kept.facets) == len(mesh.facets) + 2


TWINS = [[0, 1, 2, 3, 4, 5, 6, 7], [1, 2, 3, 0, 5, 6, 7, 4], [4, 0, 3, 7, 5, 1, 2, 6], [6, 5, 4, 7, 2, 1, 0, 3]]


@pytest.mark.parametrize("order", TWINS)
@pytest.mark.parametrize("skewed", [False, True])
def test_hexahedra_in_one_and_the_same_place_overlap(order: list[int], skewed: bool) -> None:
    """Every corner of the one is a corner of the other, and their middles are on a diagonal of both."""
    mesh = grid(1)
    points = mesh.points @ np.array([[1, 0.3, 0.1], [0, 1, 0.4], [0, 0, 1]]) if skewed else mesh.points
    cells = np.concatenate([mesh.cells, 8 + mesh.cells[:, order]])
    assert Mesh(np.concatenate([points, points]), cells, "hex8").volumes.min() > 0
    assert find_overlap(Mesh(np.concatenate([points, points]), cells, "hex8")) is not None
    assert find_overlap(Mesh(np.concatenate([points, points + np.array([0, 0, 0.02])]), cells, "hex8")) is None


def test_a_coil_whose_second_turn_lies_in_its_first_is_refused(tmp_path: Path) -> None:
    """Cell for cell and node for node, where nodes in the same place are meant: none may be a slit."""
    points, cells = bar("hex8", 60)
    angle = 3 * np.pi * points[:, 0] / 600
    radius = 50 + points[:, 1]
    coil = np.stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2]], axis=1)
    file = saved(tmp_path / "coil.vtu", coil, cells, "hex8")
    assert refused(file, "hex8").code == "E565"
    assert refused(file, "hex8", coincident="keep").code == "E569"


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8"])
def test_sound_meshes_do_not_overlap(kind: str) -> None:
    assert find_overlap(Cylinder(0.178, 0.019).mesh(kind, 0.012)) is None


def test_cells_of_other_kinds_are_named(tmp_path: Path) -> None:
    points, cells = bar("hex8")
    path = tmp_path / "mixed.vtu"
    meshio.Mesh(points, [("hexahedron", cells), ("wedge", cells[:1, :6])]).write(path)
    assert "other solid cells in addition to its hexahedron cells (wedge)" in str(refused(path, "hex8"))


@pytest.mark.parametrize("flat", [True, False])
def test_a_surface_is_not_a_body(tmp_path: Path, flat: bool) -> None:
    """A triangulated surface, and a mesh of a plane: the remedy is to fill it."""
    mesh = Box((0.03, 0.01, 0.01)).mesh("tet4", 0.01)
    points = mesh.points[:, :2] if flat else mesh.points
    file = tmp_path / "surface.vtk"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        meshio.Mesh(points, [("triangle", mesh.faces)]).write(file)
    error = refused(file)
    assert "no tetrahedra and no hexahedra (its cells: triangle)" in str(error)
    assert "write `tetrahedralized(...)` instead of `mesh(...)` to fill the closed surface" in str(error.remedy)
