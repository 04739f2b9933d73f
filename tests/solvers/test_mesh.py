"""Meshes: of cylinders and boxes, what every one of them must be, and of files, what must be refused."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import meshio
import numpy as np
import pytest

from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh.cell_splitting import NotTwoColourable, split_into_five
from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh
from softmark.solvers.mesh.mesh import Mesh, jacobians
from softmark.solvers.mesh.mesh_distortion import cell_qualities
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
    return shape.mesh("tet4", size)


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
        mesh = cylinder.mesh("tet4", math.pi * cylinder.radius / (2 * n))  # n edges on a quarter of the rim
        N = 4 * n
        prism = N / 2 * cylinder.radius**2 * math.sin(2 * math.pi / N) * cylinder.length
        assert mesh.volumes.sum() == pytest.approx(prism, rel=1e-12)
        errors.append(1 - mesh.volumes.sum() / cylinder.volume)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.02)  # the next term is (pi/N)^2/5 of the first, 0.8 %


@pytest.mark.parametrize("size", [0.012, 0.01, 0.008, 0.0065, 0.005, 0.004, 0.003])
def test_cells_of_a_cylinder_are_well_shaped(size: float) -> None:
    """Mean-ratio quality above 0.5, of 1 for the regular tetrahedron and 0.84 for the corner of a cube."""
    assert cell_qualities(Cylinder(0.178, 0.019).mesh("tet4", size)).min() > 0.5


def test_quality_of_known_tetrahedra() -> None:
    """Liu and Joe (1994): 1 for a regular one, 12 (1/2)^(2/3)/9 for the corner of a cube, 0 if flat."""
    regular = np.array([[1.0, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]])
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    flat = corner * [1, 1, 0]
    cells = np.arange(12).reshape(3, 4)
    quality = cell_qualities(Mesh(np.concatenate((regular, corner, flat)), cells))
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
    volumes = Box((1.0, 1.0, 1.0)).mesh("tet4", 1.0).volumes  # even divisions: 2 x 2 x 1 bricks
    np.testing.assert_allclose(np.sort(volumes) * 4, np.repeat([1 / 6, 1 / 3], [16, 4]), rtol=1e-14)


# ------------------------------------------------------------------ other cells

OTHER = pytest.mark.parametrize("kind", [kind for kind in ELEMENTS if kind != "tet4"])


@EVERY
@OTHER
def test_other_cells_fill_the_same_body(name: str, kind: str) -> None:
    """No cell folds where it is integrated; closed facets hold the volume of the cells (divergence theorem)."""
    shape, size = MADE[name]
    mesh = shape.mesh(kind, size)
    assert jacobians(mesh, mesh.element.quadrature()[0]).min() > 0
    xi, w = mesh.element.facet.quadrature()
    N, dN = mesh.element.facet.shape(xi), mesh.element.facet.gradient(xi)
    x = mesh.points[mesh.facets] - mesh.points[0]
    area = np.cross(*np.einsum("qaj,fai->jfqi", dN, x))
    flux = np.einsum("q,qa,fai,fqi->", w, N, x, area) / 3
    assert flux == pytest.approx(
        mesh.volumes.sum(), rel=1e-3 if ELEMENTS[kind].order > 1 else 1e-11
    )  # curved: by quadrature
    flat = name in ("box", "cube", "wire", "sheet", "box along z")
    linear = made(name).volumes.sum()
    assert mesh.volumes.sum() == pytest.approx(linear, rel=1e-11) if flat or kind == "hex8" else True


def test_curved_cells_lose_little_volume() -> None:
    """Eight edges on the rim: straight ones lose 10 % of the disc, parabolas 1.5e-3 or less (order four)."""
    cylinder = Cylinder(0.178, 0.019)
    lost = [1 - cylinder.mesh(kind, 0.012).volumes.sum() / cylinder.volume for kind in ("hex8", "tet10")]
    assert lost[0] == pytest.approx(1 - 4 / math.pi * math.sin(math.pi / 4), rel=1e-12)
    assert abs(lost[1]) < 1.5e-3
    mesh = cylinder.mesh("tet10", 0.012)
    r = np.hypot(mesh.points[:, 1], mesh.points[:, 2])
    side = np.unique(mesh.facets)[np.abs(r[np.unique(mesh.facets)] - 0.019) < 1e-12]
    assert set(side) & set(np.unique(mesh.facets[:, 3:]))  # mid-edge points are on the cylinder


@OTHER
def test_faces_are_triangles_over_the_points_of_facets(kind: str) -> None:
    mesh = Cylinder(0.178, 0.019).mesh(kind, 0.012)
    assert set(np.unique(mesh.faces)) == set(np.unique(mesh.facets))
    edges = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}  # closed


@pytest.mark.parametrize("shape", [Cylinder(0.178, 0.019), Box((0.1, 0.02, 0.03))])
def test_surfaces_enclose_the_body(shape: Cylinder | Box) -> None:
    """Flux of x through outward triangles is three times the volume of the inscribed mesh."""
    points, triangles = shape.surface(0.005)
    assert np.array_equal(np.unique(triangles), np.arange(len(points)))
    a, b, c = (points[triangles[:, i]] for i in range(3))
    flux = np.einsum("fi,fi->", np.cross(b - a, c - a) / 2, a) / 3
    assert flux == pytest.approx(shape.mesh("tet4", 0.005).volumes.sum(), rel=1e-11)


# ------------------------------------------------------------------ files


@pytest.fixture
def beam() -> Mesh:
    return Cylinder(0.178, 0.019).mesh("tet4", 0.02)


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
    read = MeshFile(path, unit=1.0).mesh("tet4", 0.1)
    assert np.array_equal(read.cells, beam.cells)
    np.testing.assert_allclose(read.volumes, beam.volumes, rtol=1e-12)


def test_coordinates_are_in_the_given_unit(tmp_path: Path, beam: Mesh) -> None:
    path = written(tmp_path / "beam.vtu", 1000 * beam.points, beam.cells)
    np.testing.assert_allclose(MeshFile(path, unit=1e-3).mesh("tet4", 0.1).volumes, beam.volumes, rtol=1e-12)


def test_cells_that_are_inside_out_are_turned(tmp_path: Path, beam: Mesh) -> None:
    cells = beam.cells.copy()
    cells[::2] = cells[::2][:, [1, 0, 2, 3]]
    read = MeshFile(written(tmp_path / "turned.vtk", beam.points, cells), 1.0).mesh("tet4", 0.1)
    np.testing.assert_allclose(read.volumes, beam.volumes, rtol=1e-12)


def test_points_that_no_cell_uses_are_dropped(tmp_path: Path, beam: Mesh) -> None:
    """Among them one far away and one that is not a number: neither may touch the extent."""
    points = np.concatenate(([[9.0, 9.0, 9.0]], beam.points, [[np.nan] * 3]))
    read = MeshFile(written(tmp_path / "orphans.vtu", points, beam.cells + 1), 1.0).mesh("tet4", 0.1)
    np.testing.assert_array_equal(read.points, beam.points)
    assert read.extent == beam.extent


def test_cells_of_other_kinds_are_left_out(tmp_path: Path, beam: Mesh) -> None:
    path = tmp_path / "mixed.vtu"
    meshio.Mesh(beam.points, [("triangle", beam.faces), ("tetra", beam.cells)]).write(path)
    assert len(MeshFile(str(path), 1.0).mesh("tet4", 0.1).cells) == len(beam.cells)


def refusal(path: str) -> str:
    with pytest.raises(UnreadableMesh) as caught:
        MeshFile(path, 1.0).mesh("tet4", 0.1)
    return str(caught.value)


def test_flat_cells_are_refused(tmp_path: Path, beam: Mesh) -> None:
    cells = beam.cells.copy()
    cells[7, 3] = cells[7, 2]
    text = refusal(written(tmp_path / "flat.vtu", beam.points, cells))
    assert text.startswith(f"1 of its {len(cells)} tetrahedra are flat, the first is cell 7 at (")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_coordinates_that_are_not_numbers_are_refused(tmp_path: Path, beam: Mesh, bad: float) -> None:
    points = beam.points.copy()
    points[3, 1] = bad
    text = refusal(written(tmp_path / "nan.vtu", points, beam.cells))
    assert text.startswith("a coordinate is not a finite number: node 3 lies at (")


def test_a_file_without_tetrahedra_is_refused_and_says_what_it_has(tmp_path: Path, beam: Mesh) -> None:
    text = refusal(written(tmp_path / "surface.vtu", beam.points, beam.faces, "triangle"))
    assert text == "it has no tetrahedra and no hexahedra (its cells: triangle)"


def test_a_cell_that_names_a_missing_point_is_refused(tmp_path: Path, beam: Mesh) -> None:
    cells = beam.cells.copy()
    cells[0, 0] = len(beam.points)
    text = refusal(written(tmp_path / "dangling.vtk", beam.points, cells))
    assert text.startswith("a cell refers to a point that does not exist: cell 0 refers to node ")


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
        ("noise.vtu", b"\x00\xff" * 99, "it is not a vtu file"),
        ("text.vtk", b"no mesh at all", ""),
        ("noise.msh", b"\xff", ""),
        ("mesh.unknown", b"1 2 3", "Could not deduce file format"),
        ("short.dat", b'VARIABLES = "x"\n', "may not terminate"),  # Tecplot: meshio's reader loops for ever
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
        MeshFile(str(path), 1.0).mesh("tet4", 0.1)
    else:
        refusal(str(path))
    assert capfd.readouterr() == ("", "")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    missing = str(tmp_path / "missing.vtu")
    assert refusal(missing) == f"there is no file {missing}"
    assert refusal(str(tmp_path)) == "it cannot be read (it is a folder)"


# ------------------------------------------------------------------ files of other cells


@pytest.fixture
def bricks() -> Mesh:
    return Cylinder(0.178, 0.019).mesh("hex8", 0.012)


@pytest.mark.parametrize("split", ["five", "repeated", "alternating", "kuhn"])
@pytest.mark.parametrize("kind", ["tet4", "tet10"])
def test_hexahedra_of_a_file_are_split(tmp_path: Path, bricks: Mesh, split: str, kind: str) -> None:
    """Faces are nearly flat: the volume is that of the hexahedra to 1e-12 on a prism; the boundary stays the same."""
    path = written(tmp_path / "bricks.vtu", bricks.points, bricks.cells, "hexahedron")
    mesh = MeshFile(path, 1.0, split).mesh(kind)
    assert len(mesh.cells) == len(bricks.cells) * (5 if split in ("five", "repeated") else 6)
    assert mesh.volumes.min() > 0
    assert mesh.volumes.sum() == pytest.approx(bricks.volumes.sum(), rel=1e-12)
    assert len(mesh.facets) == 2 * len(bricks.facets)
    corners = mesh.element.facet.corners
    assert set(np.unique(mesh.facets[:, :corners])) == set(np.unique(bricks.facets))
    if kind == "tet10":  # every middle lies between the right corners
        six = mesh.points[mesh.facets]
        np.testing.assert_allclose(six[:, 3:], (six[:, :3] + six[:, [1, 2, 0]]) / 2, atol=1e-15)


def test_the_alternating_split_is_that_of_sofa() -> None:
    """The first cell of a mesh, mirrored along its first edge, as TetrahedronFEMForceField.inl lists its six."""
    mesh = Box((1.0, 1.0, 1.0)).mesh("hex8", 1.0)
    one = Mesh(mesh.points, mesh.cells[:1], "hex8")
    c = one.cells[0][[1, 0, 3, 2, 5, 4, 7, 6]]
    listed = [(0, 5, 1, 6), (0, 1, 3, 6), (1, 3, 6, 2), (6, 3, 0, 7), (6, 7, 0, 5), (7, 5, 4, 0)]
    from softmark.solvers.mesh.cell_splitting import split_into_six_alternating

    assert {frozenset(t) for t in split_into_six_alternating(one).cells.tolist()} == {
        frozenset(c[list(t)].tolist()) for t in listed
    }


def test_hexahedra_around_an_odd_ring_cannot_be_split_in_five(tmp_path: Path) -> None:
    """Three around an edge: their outline has six corners, and each face around the edge an odd neighbour."""
    turn = 2 * np.pi * np.arange(6) / 6
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    flat = np.concatenate([[[0.0, 0.0]], ring])
    points = np.concatenate([np.c_[flat, np.zeros(7)], np.c_[flat, np.ones(7)]])
    quads = np.array([[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 1]])
    fine = Mesh(points, np.concatenate([quads, quads + 7], axis=1), "hex8")
    assert len(split_into_five(fine).cells) == 15  # this one can be coloured: the ring is even
    turn = 2 * np.pi * np.arange(3) / 3
    triangle = np.c_[np.cos(turn), np.sin(turn)]
    rings = [np.c_[r * triangle, np.full(3, z)] for z in (0.0, 1.0) for r in (1.0, 2.0)]
    i, j = np.arange(3), (np.arange(3) + 1) % 3
    lower = np.stack([i, 3 + i, 3 + j, j], axis=1)
    odd = Mesh(np.concatenate(rings), np.concatenate([lower, lower + 6], axis=1), "hex8")
    with pytest.raises(NotTwoColourable):
        split_into_five(odd)
    path = written(tmp_path / "odd.vtu", odd.points, odd.cells, "hexahedron")
    assert "cannot be coloured like a chessboard" in refusal(path)
    assert len(MeshFile(path, 1.0, "kuhn").mesh("tet4").cells) == 18


@OTHER
def test_turned_cells_of_other_kinds_are_turned_back(tmp_path: Path, kind: str) -> None:
    mesh = Box((0.1, 0.02, 0.03)).mesh(kind, 0.01)
    mirrored = mesh.points * [-1, 1, 1]
    name = ELEMENTS[kind].meshio
    read = MeshFile(written(tmp_path / "turned.vtu", mirrored, mesh.cells, name), 1.0).mesh(kind)
    np.testing.assert_allclose(read.volumes, mesh.volumes, rtol=1e-12)
    assert jacobians(read, ELEMENTS[kind].quadrature()[0]).min() > 0


def test_quadratic_tetrahedra_of_a_file_are_read_and_simplified(tmp_path: Path) -> None:
    mesh = Cylinder(0.178, 0.019).mesh("tet10", 0.012)
    path = written(tmp_path / "curved.vtu", mesh.points, mesh.cells, "tetra10")
    np.testing.assert_allclose(MeshFile(path, 1.0).mesh("tet10").volumes, mesh.volumes, rtol=1e-12)
    assert len(MeshFile(path, 1.0).mesh("tet4").points) == len(np.unique(mesh.cells[:, :4]))
    with pytest.raises(UnreadableMesh, match="it has ten-node tetrahedra, but the model needs hexahedra"):
        MeshFile(path, 1.0).mesh("hex8")


def test_a_folded_hexahedron_is_refused(tmp_path: Path, bricks: Mesh) -> None:
    cells = bricks.cells.copy()
    cells[3, [0, 1]] = cells[3, [1, 0]]
    text = refusal(written(tmp_path / "folded.vtu", bricks.points, cells, "hexahedron"))
    assert "its 180 hexahedra" in text
    assert "cell 3" in text


GMSH1 = """$NOD
6
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 1
50 1 1 1
60 9 9 9
$ENDNOD
$ELM
3
1 2 7 7 3 10 20 30
2 4 7 7 4 10 20 30 40
3 4 7 7 4 20 50 30 40
$ENDELM
"""


def test_the_first_format_of_gmsh_is_read(tmp_path: Path) -> None:
    """A format by hand: numbers with gaps, a point that no cell uses, one cell inside out; volumes 1/6 and 1/3."""
    path = tmp_path / "old.msh"
    path.write_text(GMSH1)
    mesh = MeshFile(str(path), 2.0).mesh("tet4")
    np.testing.assert_allclose(mesh.volumes, [8 / 6, 8 / 3])
    assert len(mesh.points) == 5


@pytest.mark.parametrize("lines", [1, 3, 8, 10, 12, 14])
def test_a_truncated_file_of_the_first_format_is_refused(tmp_path: Path, lines: int) -> None:
    path = tmp_path / "cut.msh"
    path.write_text("\n".join(GMSH1.split("\n")[:lines]))
    assert "Gmsh file of format 1" in refusal(str(path))


def test_a_surface_is_the_boundary_or_the_triangles_of_the_file(tmp_path: Path, beam: Mesh) -> None:
    solid = written(tmp_path / "solid.vtu", beam.points, beam.cells)
    sheet = written(tmp_path / "sheet.vtu", beam.points, beam.faces, "triangle")
    for path in (solid, sheet):
        points, triangles = MeshFile(path, 1.0).surface()
        a, b, c = (points[triangles[:, i]] for i in range(3))
        flux = np.einsum("fi,fi->", np.cross(b - a, c - a) / 2, a) / 3
        assert flux == pytest.approx(beam.volumes.sum(), rel=1e-11)
    np.testing.assert_array_equal(MeshFile(solid, 1.0).points(), beam.points)
