"""Closed surfaces: what is wrong with them is found, mended or refused; and what fills them is what they enclose."""

from __future__ import annotations

import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import trimesh

from softmark.interpreter.language.coordinate_conditions import Condition, Term
from softmark.interpreter.models.shared.filled_mesh_notes import filled_mesh_report
from softmark.references.surface_geometry import SurfaceSearch
from softmark.solvers.mesh import tetrahedralization
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.files.triangle_proximity import closest_points, find_intersecting_triangles
from softmark.solvers.mesh.files.watertight_repair import ClosedSurface, close_surface, signed_volume
from softmark.solvers.mesh.mesh_distortion import cell_qualities
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.mesh.surface_bodies import SurfaceBody, Tetrahedralized

Surface = tuple[Any, Any]
needs_mesher = pytest.mark.skipif(find_spec("pytetwild") is None, reason="needs the extra `meshing`")


def ball(subdivisions: int = 2, radius: float = 0.01) -> Surface:
    mesh = trimesh.creation.icosphere(subdivisions, radius)
    return np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)


def both(a: Surface, b: Surface) -> Surface:
    return np.concatenate([a[0], b[0]]), np.concatenate([a[1], b[1] + len(a[0])])


def inward(surface: Surface) -> Surface:
    return surface[0], surface[1][:, ::-1]


def scaled(surface: Surface, factor: float, by: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Surface:
    return factor * surface[0] + np.array(by), surface[1]


BALL = ball()
VOLUME = signed_volume(*BALL)


def test_volume_is_that_of_another_program() -> None:
    X, t = BALL
    found = close_surface(X, t)
    assert found.repairs == ()
    assert found.volume == pytest.approx(trimesh.Trimesh(X, t, process=False).volume, rel=1e-12)
    assert found.area == pytest.approx(trimesh.Trimesh(X, t, process=False).area, rel=1e-12)


X, T = BALL
TURNED = T.copy()
TURNED[::5] = TURNED[::5][:, ::-1]
SOUP = (X[T].reshape(-1, 3), np.arange(3 * len(T)).reshape(-1, 3))
SPLIT = (np.concatenate([X, X[:1] * (1 + 1e-9)]), T.copy())
SPLIT[1][int(np.argmax((T == 0).any(axis=1)))] += len(X) * (T[int(np.argmax((T == 0).any(axis=1)))] == 0)
FLAT = np.concatenate([T, [[0, 0, 5], [7, 3, 7]]])
FLAP = np.concatenate([T, [[0, 100, 50], [0, 50, 100]]])
MENDED = {  # what is wrong, what is said of it, and how much of the volume may be missing
    "soup": (SOUP, (), 1e-12),
    "split": (SPLIT, ("1 point merged with neighbours",), 1e-8),
    "turned": ((X, TURNED), (f"{len(T[::5])} triangles reoriented to match neighbours",), 1e-12),
    "inside out": (inward(BALL), (f"all {len(T)} triangles reoriented: the surface was inside out",), 1e-12),
    "twice": ((X, np.concatenate([T, T[:3]])), ("3 triangles removed as duplicates",), 1e-12),
    "flat": ((X, FLAT), ("2 triangles without area removed",), 1e-12),
    "flap": ((X, FLAP), ("2 triangles of walls without thickness removed",), 1e-12),
    "holes": ((X, np.delete(T, [3, 200], axis=0)), ("2 holes closed, with 0.61 % of the area",), 1e-12),
    "speck": (both(BALL, scaled(BALL, 0.05, (0.02, 0, 0))), ("1 speck removed, with 0.013 % of the volume",), 1e-12),
}  # fmt: skip


@pytest.mark.parametrize("name", MENDED)
def test_defects_are_mended_and_said(name: str) -> None:
    """By the number and the share that were put there: 2 of 320 alike triangles are 0.62 % of all, and a
    little less of their area, 0.05^3 is 0.0125 %."""
    surface, said, off = MENDED[name]
    found = close_surface(*surface)
    assert len(found.repairs) == len(said)
    assert all(own.startswith(due) for own, due in zip(found.repairs, said, strict=True)), found.repairs
    assert found.volume == pytest.approx(VOLUME, rel=max(off, 1e-12))
    assert _watertight(found)


def _watertight(surface: ClosedSurface) -> bool:
    mesh = trimesh.Trimesh(surface.points, surface.triangles, process=False)
    return bool(mesh.is_watertight and mesh.is_winding_consistent)


def test_a_hole_over_many_triangles_is_closed_by_a_fan() -> None:
    """Half of a ball's cap within the share that may be missing: the volume is short of it by no more than is said."""
    fine = ball(4)
    cap = fine[0][fine[1]].mean(axis=1)[:, 2] > 0.0098
    found = close_surface(fine[0], fine[1][~cap])
    assert found.repairs[0].startswith("1 hole closed, ")
    assert _watertight(found)
    short = 1.0 - found.volume / signed_volume(*fine)
    assert 0.0 < short < found.relative_volume_uncertainty


def test_a_flap_between_edges_of_the_surface_is_no_hole() -> None:
    """A triangle across a box: one of its edges is free, which is no loop of edges."""
    x = np.array([[0, 0], [0.1, 0], [0.1, 0.02], [0, 0.02]])
    points = np.concatenate([np.insert(x, 2, z, axis=1) for z in (0.0, 0.02)])
    sides = [[a, b, b + 4, a + 4] for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))]
    squares = np.array([[0, 3, 2, 1], [4, 5, 6, 7], *sides])
    triangles = np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]], [[4, 6, 0]]])
    surface = close_surface(points, triangles)
    assert signed_volume(surface.points, surface.triangles) == pytest.approx(4e-5)


def _moebius() -> Surface:
    turn = np.linspace(0.0, 2.0 * np.pi, 61)[:-1]
    sides = [np.stack([(1 + s * np.cos(turn / 2)) * np.cos(turn), (1 + s * np.cos(turn / 2)) * np.sin(turn),
                       s * np.sin(turn / 2)], axis=1) for s in (-0.2, 0.2)]  # fmt: skip
    rows = [[a, a + 1, a + 61] for a in range(59)] + [[a, a + 61, a + 60] for a in range(59)]
    return np.concatenate(sides), np.array([*rows, [59, 60, 0], [59, 0, 119]])


REFUSED = {
    "nothing is left": ((X, T[:0]), "E573"),
    "open": ((X, T[X[T].mean(axis=1)[:, 2] < 0.003]), "E573"),
    "a sheet": ((X, T[:9]), "E573"),
    "a sheet of two sides": ((X, np.concatenate([T[:9], T[:9, ::-1]])), "E573"),
    "pressed flat": ((X * [1.0, 1.0, 0.0], T), "E573"),
    "one side only": (_moebius(), "E573"),
    "two side by side": (both(BALL, scaled(BALL, 0.9, (0.03, 0, 0))), "E574"),
    "one in another": (both(BALL, scaled(BALL, 0.5)), "E574"),
    "one in a hollow": (both(both(BALL, inward(scaled(BALL, 0.5))), inward(scaled(BALL, 0.2))), "E574"),
    "opposite ways": (both(BALL, inward(scaled(BALL, 0.9, (0.008, 0, 0)))), "E574"),
    "no number": ((np.where(X.max() == X, np.nan, X), T), "E562"),
    "a point too many": ((X, T + 1), "E561"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_encloses_no_body_is_refused(name: str) -> None:
    surface, code = REFUSED[name]
    if not len(surface[1]):
        surface = surface[0], np.array([[0, 0, 1]])
    with pytest.raises(UnreadableMesh) as refused:
        close_surface(*surface)
    assert refused.value.code == code
    assert refused.value.remedy


def test_a_hollow_is_a_hollow() -> None:
    found = close_surface(*both(BALL, inward(scaled(BALL, 0.5))))
    assert found.repairs == ()
    assert found.volume == pytest.approx((1.0 - 0.5**3) * VOLUME, rel=1e-12)


def test_what_passes_through_itself_is_found() -> None:
    """Against every edge and every triangle, by the signs of volumes (another formula); and a ball not at all."""
    coarse = ball(1)
    Y, t = both(coarse, scaled(coarse, 0.8, (0.006, 0.001, 0.0005)))
    found = find_intersecting_triangles(Y, t)
    assert found.any()
    assert not find_intersecting_triangles(*BALL).any()
    brute = np.zeros(len(t), dtype=bool)
    ours, theirs = np.arange(len(coarse[1])), np.arange(len(coarse[1]), len(t))
    for near, far in ((ours, theirs), (theirs, ours)):
        for i in near:
            a, b, c = Y[t[i]]
            for k in range(3):
                p, q = Y[t[far, k]], Y[t[far, (k + 1) % 3]]
                sides = [np.linalg.det(np.stack(np.broadcast_arrays(u - p, v - p, q - p), axis=1)) > 0
                         for u, v in ((a, b), (b, c), (c, a))]  # fmt: skip
                n = np.cross(b - a, c - a)
                met = (((p - a) @ n > 0) != ((q - a) @ n > 0)) & (sides[0] == sides[1]) & (sides[1] == sides[2])
                brute[i] |= met.any()
                brute[far[met]] = True
    np.testing.assert_array_equal(found, brute)


def test_closest_points_are_those_of_the_references() -> None:
    """Which share no code, and search without a bound."""
    rng = np.random.default_rng(3)
    places = 0.012 * rng.uniform(-1.0, 1.0, (300, 3))
    points, far = closest_points(places, *BALL, 0.004)
    known = SurfaceSearch(*BALL).closest(places)
    near = known.distances < 0.004
    assert near.any()
    np.testing.assert_array_equal(np.isfinite(far), near)
    np.testing.assert_allclose(far[near], known.distances[near], atol=1e-14)
    np.testing.assert_allclose(points[near], known.points[near], atol=1e-12)


@pytest.mark.parametrize("ending", [".stl", ".obj", ".ply", ".off", ".vtk"])
def test_formats(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"ball{ending}"
    if ending == ".vtk":
        meshio.write_points_cells(file, 1e3 * X, [("triangle", T)])
    else:
        trimesh.Trimesh(1e3 * X, T, process=False).export(file)
    shape = Tetrahedralized(str(file), 1e-3)
    assert shape.volume == pytest.approx(VOLUME, rel=1e-5), "binary STL has single precision"
    assert shape.bounds is not None
    np.testing.assert_allclose(shape.bounds, [X.min(axis=0), X.max(axis=0)], rtol=1e-6)


def test_a_file_that_was_changed_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "ball.stl"
    for factor in (1.0, 1.25):
        trimesh.Trimesh(factor * X, T, process=False).export(file)
        assert Tetrahedralized(str(file), 1.0).volume == pytest.approx(factor**3 * VOLUME, rel=1e-5)
        (tmp_path / "other.stl").write_bytes(b"")


# ------------------------------------------------------------------ the mesher


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "softmark" / "filled"


def test_what_was_made_is_kept_and_never_made_again(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same surface gives the same mesh; another size another one; what is broken in the cache is made again."""
    monkeypatch.setattr(tetrahedralization, "MESHER", "numpy")  # a package that is there
    made = []

    def mesher(surface: ClosedSurface, size: float, tolerance: float) -> Any:
        made.append(size)
        box = Box((0.01, 0.01, 0.01)).mesh("tet4", size)
        return box.points + 1e-9 * len(made), box.cells, 1.0

    monkeypatch.setattr(tetrahedralization, "_run_mesher", mesher)
    cube = Box((0.01, 0.01, 0.01)).surface(0.005)
    first, again, finer = (
        tetrahedralization.fill_surface(close_surface(*cube), size, 1e-4) for size in (0.005, 0.005, 0.004)
    )
    assert made == [0.005, 0.004]
    assert first.filling is not None
    assert again.filling is not None
    assert finer.filling is not None
    assert first.filling.digest == again.filling.digest != finer.filling.digest
    for file in kept.iterdir():
        file.write_bytes(file.read_bytes()[:100])
    tetrahedralization.fill_surface(close_surface(*cube), 0.005, 1e-4)
    assert made == [0.005, 0.004, 0.005]
    assert not list(kept.glob(".part*"))


def test_the_mesher_is_named_where_cells_are_finer_too(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And not one of the arrays that it is given then."""
    monkeypatch.setattr(tetrahedralization, "MESHER", "numpy")
    given: list[set[str]] = []

    def mesher(surface: ClosedSurface, size: float, tolerance: float, **field: Any) -> Any:
        given.append(set(field))
        box = Box((0.01, 0.01, 0.01)).mesh("tet4", size)
        return box.points, box.cells, 1.0

    monkeypatch.setattr(tetrahedralization, "_run_mesher", mesher)
    cube = Box((0.01, 0.01, 0.01))
    low = Condition.comparison("<=", Term.coordinate(2), Term.constant(0.0), 1)
    finer = Cut("", 0.0, finer=4.0, where=low)
    even, graded = (
        tetrahedralization.fill_surface(close_surface(*cube.surface(0.005)), 0.005, 1e-4, cuts)
        for cuts in ((), (finer,))
    )
    assert given == [set(), {"bg_vertices", "bg_tets", "bg_values"}]
    assert even.filling is not None
    assert graded.filling is not None
    assert graded.filling.mesher == even.filling.mesher == tetrahedralization.mesher_version()


def test_nodes_are_moved_onto_the_surface(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mesh that is off by less than three tolerances has its nodes on the cube to rounding, and its volume."""
    monkeypatch.setattr(tetrahedralization, "MESHER", "numpy")
    box = Box((0.01, 0.01, 0.01)).mesh("tet4", 0.003)
    off = 1e-4 * np.random.default_rng(1).uniform(-1.0, 1.0, box.points.shape)
    monkeypatch.setattr(
        tetrahedralization, "_run_mesher", lambda *arguments: (box.points + off, box.cells[:, [1, 0, 2, 3]], 1.0)
    )
    mesh = tetrahedralization.fill_surface(close_surface(*Box((0.01, 0.01, 0.01)).surface(0.01)), 0.003, 1e-4)
    assert mesh.volumes.min() > 0.0
    gaps = np.abs(mesh.points[np.unique(mesh.facets)][:, :, None] - np.array([0.0, 0.01])).min(axis=(1, 2))
    assert gaps.max() < 1e-15
    assert mesh.filling is not None
    assert mesh.filling.beside == 0


@pytest.mark.parametrize(("code", "said"), [(-11, "terminated by signal 11"), (1, "ImportError: no such thing")])
def test_a_mesher_that_fails_is_said_to(kept: Path, monkeypatch: pytest.MonkeyPatch, code: int, said: str) -> None:
    monkeypatch.setattr(tetrahedralization, "MESHER", "numpy")
    failed = subprocess.CompletedProcess([], code, "", "Traceback\nImportError: no such thing\n")
    monkeypatch.setattr("subprocess.run", lambda *arguments, **options: failed)
    with pytest.raises(UnreadableMesh, match=said) as refused:
        tetrahedralization.fill_surface(close_surface(*BALL), 0.005, 1e-4)
    assert refused.value.code == "E576"
    assert not kept.exists() or not list(kept.iterdir())


def _boxes(*corners: tuple[tuple[float, ...], tuple[float, ...]]) -> Surface:
    parts = [trimesh.creation.box(bounds=np.array(c)) for c in corners]
    return np.concatenate([p.vertices for p in parts]), np.concatenate(
        [p.faces + 8 * i for i, p in enumerate(parts)]
    ).astype(np.int64)


CUBE = _boxes(((0, 0, 0), (0.01, 0.01, 0.01)))
UNITED = _boxes(((0, 0, 0), (0.01, 0.01, 0.01)), ((0.006, 0.002, 0.003), (0.016, 0.009, 0.008)))
HOLLOW = both(CUBE, inward(_boxes(((0.003, 0.003, 0.003), (0.007, 0.007, 0.007)))))
FILLED = {  # a surface, and the volume within (mm^3), by hand
    "cube": (CUBE, 1000.0),
    "united": (UNITED, 1000.0 + 10 * 7 * 5 - 4 * 7 * 5),
    "hollow": (HOLLOW, 1000.0 - 64.0),
    "ball": (ball(3), signed_volume(*ball(3)) * 1e9),
    "holes": ((BALL[0], np.delete(T, [3, 200], axis=0)), VOLUME * 1e9),
}


@needs_mesher
@pytest.mark.slow
@pytest.mark.parametrize("name", FILLED)
def test_what_fills_a_surface_is_what_it_encloses(name: str, kept: Path) -> None:
    """Volume by hand to the tolerance times the area; both distances of Hausdorff within twice the tolerance."""
    surface, volume = FILLED[name]
    known = close_surface(*surface)
    mesh = tetrahedralization.fill_surface(known, 0.003, 1e-4)
    found = filled_mesh_report(SurfaceBody(), mesh)["filled"]
    assert abs(float(mesh.volumes.sum()) - 1e-9 * volume) < 1e-4 * known.area
    if not known.crossings:
        assert max(found["mesh_to_surface_m"], found["surface_to_mesh_m"]) < 2e-4
    assert cell_qualities(mesh).min() > 0.1
    again = tetrahedralization.fill_surface(known, 0.003, 1e-4)
    assert again.filling is not None
    assert again.filling.digest == found["digest"], "kept"


@needs_mesher
@pytest.mark.slow
@pytest.mark.parametrize("size", [1e-6, 1e3])
def test_no_scale_is_special(kept: Path, size: float) -> None:
    known = close_surface(size * CUBE[0], CUBE[1])
    mesh = tetrahedralization.fill_surface(known, 0.003 * size, 1e-4 * size)
    assert float(mesh.volumes.sum()) == pytest.approx(1e-6 * size**3, rel=1e-6), "flat faces are met exactly"


@needs_mesher
@pytest.mark.long
@pytest.mark.slow
def test_a_raw_surface_of_marching_cubes(kept: Path, needs_data: Any) -> None:
    """The scan of the silicone beam as it was published: 27 046 triangles with holes, flaps and tangles."""
    from softmark.references.data_download import find_local

    needs_data('"data:silicone-beam/truthcylinder1-bent.obj"')
    file = str(find_local("silicone-beam/truthcylinder1-bent.obj"))
    surface = Tetrahedralized(file, 4.85e-3, tolerance=1e-3)  # m a unit, about (its digest)
    known = surface.closed()
    said = "; ".join(known.repairs)
    assert all(word in said for word in ("41 holes", "12 triangles of walls without thickness", "4 specks", "passing"))
    # the beam has 201.9 cm^3; the unit is known to 1.5 %, and a scan's voxels are 1 mm
    assert known.volume == pytest.approx(2.019e-4, rel=0.1)
    mesh = surface.mesh("tet10", 0.02)
    # a boundary within 1 mm of that of a cylinder of radius 19 mm: 2/19 of the volume at most, all of it to one side
    assert float(mesh.volumes.sum()) == pytest.approx(known.volume, rel=0.05)


def test_an_element_of_ten_nodes_has_straight_edges(
    kept: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tetrahedralization, "MESHER", "numpy")
    box = Box((0.01, 0.01, 0.01)).mesh("tet4", 0.003)
    monkeypatch.setattr(tetrahedralization, "_run_mesher", lambda *arguments: (box.points, box.cells, 1.0))
    trimesh.Trimesh(*CUBE, process=False).export(tmp_path / "cube.stl")
    mesh = Tetrahedralized(str(tmp_path / "cube.stl"), 1.0).mesh("tet10", 0.003)
    assert len(mesh.cells) == len(box.cells)
    assert float(mesh.volumes.sum()) == pytest.approx(1e-6, rel=1e-6)
