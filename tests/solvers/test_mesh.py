"""Meshes: of cylinders and boxes, what every one of them must be, and of files, what must be refused."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import meshio
import numpy as np
import pytest

from softmark.solvers.mesh.file import Unreadable
from softmark.solvers.mesh.mesh import Mesh, shape_quality
from softmark.solvers.mesh.shapes import Box, Cylinder, MeshFile, transverse

MADE = {
    "beam": (Cylinder(0.178, 0.019), 0.012),
    "beam, fine": (Cylinder(0.178, 0.019), 0.005),
    "beam, size above the body": (Cylinder(0.178, 0.019), 1.0),
    "along -y": (Cylinder(0.1, 0.02, axis=(0.0, -1.0, 0.0)), 0.01),
    "oblique and far off": (Cylinder(0.1, 0.02, (1 / 3, 2 / 3, -2 / 3), (1.0, -2.0, 3.0)), 0.01),
    "needle": (Cylinder(10.0, 0.001), 0.05),
    "coin": (Cylinder(0.0005, 0.05), 0.01),
    "micrometres": (Cylinder(1e-6, 1e-7), 5e-8),
    "kilometres": (Cylinder(1e4, 1e3), 7e2),
    "box": (Box((0.1, 0.02, 0.03)), 0.01),
    "box along z": (Box((0.02, 0.03, 0.1), origin=(-1.0, 2.0, 0.5)), 0.008),
    "sheet": (Box((1.0, 1.0, 1e-3)), 0.2),
    "wire": (Box((1e-3, 2e-3, 1.0)), 0.05),
    "cube": (Box((1.0, 1.0, 1.0)), 0.24),
}
EVERY = pytest.mark.parametrize("name", MADE)


def made(name: str) -> Mesh:
    shape, size = MADE[name]
    return shape.mesh(size)


@EVERY
def test_cells_have_positive_volume(name: str) -> None:
    mesh = made(name)
    assert mesh.volumes.min() > 1e-3 * mesh.volumes.mean()  # structured: no cell much smaller than the others


@EVERY
def test_interior_faces_are_shared_by_two_cells_and_the_boundary_is_closed(name: str) -> None:
    mesh = made(name)
    faces = np.sort(mesh.cells[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    _, count = np.unique(faces, axis=0, return_counts=True)
    assert set(count) <= {1, 2}
    assert np.sum(count == 1) == len(mesh.faces)
    edges = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    directed, count = np.unique(edges, axis=0, return_counts=True)
    assert set(count) == {1}  # each edge once in each direction: closed, and the faces turn the same way
    assert {tuple(e) for e in directed} == {tuple(e[::-1]) for e in directed}
    # Euler: vertices - edges + faces = 2 on a surface like a sphere
    assert len(np.unique(mesh.faces)) - len(directed) // 2 + len(mesh.faces) == 2


@EVERY
def test_faces_look_outward(name: str) -> None:
    """Divergence theorem: the volume is a third of the flux of x through the faces, to round-off."""
    mesh = made(name)
    a, b, c = (mesh.points[mesh.faces[:, i]] for i in range(3))
    flux = np.einsum("fi,fi->f", np.cross(b - a, c - a) / 2, a - mesh.points[0]).sum() / 3
    assert flux == pytest.approx(mesh.volumes.sum(), rel=1e-11)


@EVERY
def test_every_point_is_used_and_lies_within_the_bounds(name: str) -> None:
    (shape, _), mesh = MADE[name], made(name)
    assert np.array_equal(np.unique(mesh.cells), np.arange(len(mesh.points)))
    low, high = shape.bounds
    slack = 1e-14 * (mesh.extent + np.abs(mesh.points).max())
    np.testing.assert_array_less(np.array(low) - slack, mesh.points.min(axis=0))
    np.testing.assert_array_less(mesh.points.max(axis=0), np.array(high) + slack)


@pytest.mark.parametrize("name", [n for n, (shape, _) in MADE.items() if isinstance(shape, Box)])
def test_a_box_is_filled(name: str) -> None:
    (shape, _), mesh = MADE[name], made(name)
    assert mesh.volumes.sum() == pytest.approx(shape.volume, rel=1e-12)


@pytest.mark.parametrize("name", [n for n, (shape, _) in MADE.items() if isinstance(shape, Cylinder)])
def test_points_of_the_side_lie_on_the_cylinder(name: str) -> None:
    (shape, _), mesh = MADE[name], made(name)
    offset = mesh.points - np.array(shape.origin)
    along = offset @ np.array(shape.axis)
    r = np.linalg.norm(offset - along[:, None] * np.array(shape.axis), axis=1)
    slack = 4e-16 * np.linalg.norm(shape.origin) + 1e-13 * shape.radius
    assert r.max() <= shape.radius + slack
    tolerance = 1e-9 * shape.length
    inner = (along > tolerance) & (along < shape.length - tolerance)
    side = np.unique(mesh.faces)[inner[np.unique(mesh.faces)]]
    np.testing.assert_allclose(r[side], shape.radius, atol=slack, rtol=0)
    for end in (0.0, shape.length):
        assert np.sum(np.abs(along - end) < tolerance) > 8


def test_volume_is_that_of_the_inscribed_prism_and_converges_with_order_two() -> None:
    """Exactly N/2 R^2 sin(2 pi/N) L for N points on the rim, which is pi R^2 L (1 - 2/3 (pi/N)^2 + ...)."""
    cylinder = Cylinder(0.178, 0.019)
    errors = []
    for n in (4, 8, 16):
        mesh = cylinder.mesh(math.pi * cylinder.radius / (2 * n))  # n edges on a quarter of the rim
        N = 4 * n
        prism = N / 2 * cylinder.radius**2 * math.sin(2 * math.pi / N) * cylinder.length
        assert mesh.volumes.sum() == pytest.approx(prism, rel=1e-12)
        errors.append(1 - mesh.volumes.sum() / cylinder.volume)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.02)  # the next term is (pi/N)^2/5 of the first, 0.8 %


@pytest.mark.parametrize("size", [0.012, 0.01, 0.008, 0.0065, 0.005, 0.004, 0.003])
def test_cells_of_a_cylinder_are_well_shaped(size: float) -> None:
    """Mean-ratio quality above 0.5, of 1 for the regular tetrahedron and 0.84 for the corner of a cube."""
    assert shape_quality(Cylinder(0.178, 0.019).mesh(size)).min() > 0.5


def test_quality_of_known_tetrahedra() -> None:
    """Liu and Joe (1994): 1 for a regular one, 12 (1/2)^(2/3)/9 for the corner of a cube, 0 if flat."""
    regular = np.array([[1.0, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]])
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    flat = corner * [1, 1, 0]
    cells = np.arange(12).reshape(3, 4)
    quality = shape_quality(Mesh(np.concatenate((regular, corner, flat)), cells))
    np.testing.assert_allclose(quality, [1.0, 12 * 0.5 ** (2 / 3) / 9, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    "name", ["beam", "beam, fine", "oblique and far off", "along -y", "box", "box along z", "wire", "cube"]
)
@pytest.mark.parametrize("side", [0, 1])
def test_the_split_is_its_own_mirror_image(name: str, side: int) -> None:
    """Across both planes through the axis: reflected cells are cells, so a bend has no preferred side."""
    (shape, size), mesh = MADE[name], made(name)
    normal = np.array(transverse(shape.axis)[side])
    offset = mesh.points - np.array(shape.root)
    mirrored = offset - 2 * (offset @ normal)[:, None] * normal
    step = 1e-6 * size
    keys = {tuple(k): i for i, k in enumerate(np.rint(offset / step).astype(np.int64).tolist())}
    image = np.array([_near(keys, k) for k in np.rint(mirrored / step).astype(np.int64).tolist()])
    cells = {frozenset(cell) for cell in mesh.cells.tolist()}
    assert {frozenset(cell) for cell in image[mesh.cells].tolist()} == cells


def _near(keys: dict[tuple[int, ...], int], key: list[int]) -> int:
    """The point at `key`, give or take one step of rounding in each coordinate."""
    for shift in np.ndindex(3, 3, 3):
        at = tuple(k + s - 1 for k, s in zip(key, shift, strict=True))
        if at in keys:
            return keys[at]
    raise AssertionError(f"no mirror image at {key}")


def test_tets_of_the_five_way_split_fill_the_cube() -> None:
    """Four corners of a sixth each and a third in the middle."""
    volumes = Box((1.0, 1.0, 1.0)).mesh(1.0).volumes  # even divisions: 2 x 2 x 1 bricks
    np.testing.assert_allclose(np.sort(volumes) * 4, np.repeat([1 / 6, 1 / 3], [16, 4]), rtol=1e-14)


# ------------------------------------------------------------------ files


@pytest.fixture
def beam() -> Mesh:
    return Cylinder(0.178, 0.019).mesh(0.02)


def written(path: Path, points: np.ndarray, cells: np.ndarray, kind: str = "tetra", **options: object) -> str:
    with warnings.catch_warnings():  # meshio's own deprecations are not under test
        warnings.simplefilter("ignore")
        meshio.Mesh(points, [(kind, cells)]).write(path, **options)
    return str(path)


FORMATS = pytest.mark.parametrize(
    ("suffix", "kind"),
    [("vtk", "vtk"), ("vtu", "vtu"), ("msh", "gmsh"), ("inp", "abaqus"), ("mesh", "medit")],
)


@FORMATS
def test_a_written_mesh_reads_back_the_same(tmp_path: Path, beam: Mesh, suffix: str, kind: str) -> None:
    """16 digits or binary: volumes agree to the last bits."""
    path = written(tmp_path / f"beam.{suffix}", beam.points, beam.cells, file_format=kind)
    read = MeshFile(path, unit=1.0).mesh(0.1)
    assert np.array_equal(read.cells, beam.cells)
    np.testing.assert_allclose(read.volumes, beam.volumes, rtol=1e-12)


def test_coordinates_are_in_the_given_unit(tmp_path: Path, beam: Mesh) -> None:
    path = written(tmp_path / "beam.vtu", 1000 * beam.points, beam.cells)
    np.testing.assert_allclose(MeshFile(path, unit=1e-3).mesh(0.1).volumes, beam.volumes, rtol=1e-12)


def test_cells_that_are_inside_out_are_turned(tmp_path: Path, beam: Mesh) -> None:
    cells = beam.cells.copy()
    cells[::2] = cells[::2][:, [1, 0, 2, 3]]
    read = MeshFile(written(tmp_path / "turned.vtk", beam.points, cells), 1.0).mesh(0.1)
    np.testing.assert_allclose(read.volumes, beam.volumes, rtol=1e-12)


def test_points_that_no_cell_uses_are_dropped(tmp_path: Path, beam: Mesh) -> None:
    """Among them one far away and one that is not a number: neither may touch the extent."""
    points = np.concatenate(([[9.0, 9.0, 9.0]], beam.points, [[np.nan] * 3]))
    read = MeshFile(written(tmp_path / "orphans.vtu", points, beam.cells + 1), 1.0).mesh(0.1)
    np.testing.assert_array_equal(read.points, beam.points)
    assert read.extent == beam.extent


def test_cells_of_other_kinds_are_left_out(tmp_path: Path, beam: Mesh) -> None:
    path = tmp_path / "mixed.vtu"
    meshio.Mesh(beam.points, [("triangle", beam.faces), ("tetra", beam.cells)]).write(path)
    assert len(MeshFile(str(path), 1.0).mesh(0.1).cells) == len(beam.cells)


def refusal(path: str) -> str:
    with pytest.raises(Unreadable) as caught:
        MeshFile(path, 1.0).mesh(0.1)
    return str(caught.value)


def test_flat_cells_are_refused(tmp_path: Path, beam: Mesh) -> None:
    cells = beam.cells.copy()
    cells[7, 3] = cells[7, 2]
    text = refusal(written(tmp_path / "flat.vtu", beam.points, cells))
    assert text == f"1 of its {len(cells)} tetrahedra are flat, the first is cell 7"


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_coordinates_that_are_not_numbers_are_refused(tmp_path: Path, beam: Mesh, bad: float) -> None:
    points = beam.points.copy()
    points[3, 1] = bad
    assert refusal(written(tmp_path / "nan.vtu", points, beam.cells)) == "a coordinate is not a finite number"


def test_a_file_without_tetrahedra_is_refused_and_says_what_it_has(tmp_path: Path, beam: Mesh) -> None:
    text = refusal(written(tmp_path / "surface.vtu", beam.points, beam.faces, "triangle"))
    assert text == "it has no four-node tetrahedra (its cells: triangle)"


def test_a_cell_that_names_a_missing_point_is_refused(tmp_path: Path, beam: Mesh) -> None:
    cells = beam.cells.copy()
    cells[0, 0] = len(beam.points)
    text = refusal(written(tmp_path / "dangling.vtk", beam.points, cells))
    assert text == "a cell names a point that does not exist"


@FORMATS
@pytest.mark.parametrize("part", [0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9])
def test_a_truncated_file_is_refused(tmp_path: Path, beam: Mesh, suffix: str, kind: str, part: float) -> None:
    """Whatever meshio makes of it: no other exception leaves, and no mesh with a hole in it is returned."""
    whole = written(tmp_path / f"whole.{suffix}", beam.points, beam.cells, file_format=kind)
    data = Path(whole).read_bytes()
    cut = tmp_path / f"cut.{suffix}"
    cut.write_bytes(data[: int(part * len(data))])
    assert refusal(str(cut))


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("noise.vtu", b"\x00\xff" * 99, "it is no vtu file"),
        ("text.vtk", b"no mesh at all", ""),
        ("noise.msh", b"\xff", ""),
        ("mesh.unknown", b"1 2 3", "Could not deduce file format"),
        ("short.dat", b'VARIABLES = "x"\n', "it may never finish"),  # Tecplot: meshio's reader loops for ever
    ],
)
def test_a_file_that_is_no_mesh_is_refused(tmp_path: Path, name: str, content: bytes, why: str) -> None:
    (tmp_path / name).write_bytes(content)
    text = refusal(str(tmp_path / name))
    assert text.startswith("meshio cannot read it (")
    assert why in text


@pytest.mark.parametrize("part", [0.5, 1.0])
def test_nothing_is_printed_while_reading(
    tmp_path: Path, beam: Mesh, part: float, capfd: pytest.CaptureFixture[str]
) -> None:
    """A report on stdout must stay clean, and what meshio prints belongs in the message."""
    path = tmp_path / "beam.vtu"
    written(path, beam.points, beam.cells)
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    capfd.readouterr()
    if part == 1.0:
        MeshFile(str(path), 1.0).mesh(0.1)
    else:
        refusal(str(path))
    assert capfd.readouterr() == ("", "")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    missing = str(tmp_path / "missing.vtu")
    assert refusal(missing) == f"there is no file {missing}"
    assert refusal(str(tmp_path)) == f"there is no file {tmp_path}"
