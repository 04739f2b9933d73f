"""Fields from files: NRRD, NIfTI and VTU give the same numbers at the same places, however they lie in the scene."""

from __future__ import annotations

import gzip
import io
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

import softmark
from softmark.interpreter.language.expression_evaluation import Quantity
from softmark.interpreter.problem.field_files import Image, load_field, read_field
from softmark.interpreter.verification.heterogeneous_constants_check import (
    _weighted_integrands,
    integrate_by_boxes,
    read_field_again,
)
from softmark.interpreter.vocabulary.field_words import Field
from softmark.references.measured_data import Unreadable
from softmark.solvers.independent_forces.solid_forces import node_positions

Floats = NDArray[np.float64]

UNIT = Quantity(1e3, (-1, 1, -2, 0, 0))  # 1 kPa
RNG = np.random.default_rng(5)
NUMBERS = RNG.uniform(1.0, 9.0, (4, 5, 6))
STEPS = np.array([[0.0, 0.0, 3.0], [2.0, 0.0, 0.0], [0.0, -1.5, 0.0]]).T  # mm: i goes along z, j along x, k along -y
CORNER = np.array([1.0, 7.0, -2.0])  # mm


def nrrd_file(folder: Path, **more: Any) -> Path:
    """The numbers as NRRD, its axes as STEPS says."""
    nrrd = pytest.importorskip("nrrd")
    header = {"space": "left-posterior-superior", "space directions": STEPS.T, "space origin": CORNER}
    nrrd.write(str(folder / "f.nrrd"), NUMBERS, header | {"space units": ["mm"] * 3} | more)
    return folder / "f.nrrd"


def nifti_file(folder: Path) -> Path:
    """The same as NIfTI, by its affine."""
    nibabel = pytest.importorskip("nibabel")
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = STEPS, CORNER
    image = nibabel.Nifti1Image(NUMBERS, affine)
    image.header.set_xyzt_units("mm")
    nibabel.save(image, str(folder / "f.nii.gz"))
    return folder / "f.nii.gz"


def places(count: int = 200) -> tuple[Floats, Floats]:
    """Indices with fractions within the grid, and where they lie, m."""
    at = RNG.uniform(0.0, 1.0, (count, 3)) * (np.array(NUMBERS.shape) - 1)
    return at, 1e-3 * (at @ STEPS.T + CORNER)


def exact(at: Floats) -> Floats:
    """Linear along each axis, by scipy."""
    grid = RegularGridInterpolator([np.arange(n, dtype=float) for n in NUMBERS.shape], NUMBERS)
    found: Floats = 1e3 * grid(at)
    return found


@pytest.mark.parametrize("make", [nrrd_file, nifti_file])
def test_images_lie_as_their_headers_say(make: Any, tmp_path: Path) -> None:
    """Space directions and affines that turn and mirror the grid; single precision of NIfTI's data, 6e-8 relative."""
    field = Field(str(make(tmp_path)), UNIT)
    at, X = places()
    assert read_field(field, X) == pytest.approx(exact(at), rel=2e-7)
    assert read_field_again(field, X) == pytest.approx(exact(at), rel=2e-7)
    assert not load_field(field).outside(X).any()


def test_an_image_may_lie_elsewhere_in_the_scene(tmp_path: Path) -> None:
    """With x = z, z = y the scene's y axis is the file's x: the same numbers at places that are turned alike."""
    file = str(nrrd_file(tmp_path))
    turned = Field(file, UNIT, x=(0.0, 0.0, 1.0), z=(0.0, 1.0, 0.0), origin=(0.1, 0.2, 0.3))
    at, X = places()
    there = X[:, [2, 0, 1]] + np.array([0.1, 0.2, 0.3])
    assert read_field(turned, there) == pytest.approx(exact(at), rel=1e-12)


def test_a_length_takes_the_place_of_what_the_file_says(tmp_path: Path) -> None:
    at, X = places()
    assert read_field(Field(str(nrrd_file(tmp_path)), UNIT, length=1.0), 1e3 * X) == pytest.approx(exact(at), rel=1e-12)


def test_beyond_the_outermost_centres_numbers_are_those_of_the_voxel(tmp_path: Path) -> None:
    """Half a voxel beyond the centre its face ends: there is the outside, and it has the same number."""
    field = Field(str(nrrd_file(tmp_path)), UNIT)
    at = np.array([[-0.4, 2.0, 3.0], [-0.6, 2.0, 3.0], [3.4, 4.4, 5.4], [3.6, 4.0, 5.0]])
    X = 1e-3 * (at @ STEPS.T + CORNER)
    assert load_field(field).outside(X).tolist() == [False, True, False, True]
    clipped = np.clip(at, 0.0, np.array(NUMBERS.shape) - 1.0)
    assert read_field(field, X) == pytest.approx(exact(clipped), rel=1e-12)
    assert read_field_again(field, X) == pytest.approx(exact(clipped), rel=1e-12)


def test_meshes_have_numbers_on_nodes_and_on_cells(tmp_path: Path) -> None:
    """Two cubes of 10 mm side by side: linear on nodes is x y itself; cells have their own number up to the face."""
    x, y, z = np.meshgrid([0.0, 10.0, 20.0], [0.0, 10.0], [0.0, 10.0], indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    first = np.array([0, 4, 6, 2, 1, 5, 7, 3])
    cells = [("hexahedron", np.array([first, first + 4]))]
    data = {"on_nodes": points[:, 0] * points[:, 1]}
    meshio.Mesh(points, cells, point_data=data, cell_data={"on_cells": [np.array([3.0, 7.0])]}).write(
        tmp_path / "m.vtu"
    )
    nodes, own = (Field(str(tmp_path / "m.vtu"), UNIT, array=a, length=1e-3) for a in ("on_nodes", "on_cells"))
    X = 1e-3 * RNG.uniform(0.0, 1.0, (50, 3)) * np.array([20.0, 10.0, 10.0])
    assert read_field(nodes, X) == pytest.approx(1e9 * X[:, 0] * X[:, 1], rel=1e-9, abs=1e-6)
    assert read_field(own, X) == pytest.approx(np.where(X[:, 0] < 0.01, 3e3, 7e3))
    beyond = np.array([[0.025, 0.005, 0.005], [0.019, 0.005, 0.005]])
    assert load_field(own).outside(beyond).tolist() == [True, False]
    assert read_field(own, beyond) == pytest.approx([7e3, 7e3])
    with pytest.raises(Unreadable, match="it has 2 arrays; its arrays: `on_nodes`, `on_cells`"):
        load_field(Field(str(tmp_path / "m.vtu"), UNIT, length=1e-3))
    with pytest.raises(Unreadable, match="no array `stiff`"):
        load_field(Field(str(tmp_path / "m.vtu"), UNIT, array="stiff", length=1e-3))
    with pytest.raises(Unreadable, match="does not state its unit of length"):
        load_field(Field(str(tmp_path / "m.vtu"), UNIT, array="on_nodes"))


def test_numbers_of_a_mesh_that_are_none_have_a_place(tmp_path: Path) -> None:
    """Of two cubes that share a face: one point, one cell; a point that no solid cell has is never read."""
    x, y, z = np.meshgrid([0.0, 10.0, 20.0], [0.0, 10.0], [0.0, 10.0], indexing="ij")
    points = np.vstack([np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), [[99.0, 0.0, 0.0]]])
    cells = [("hexahedron", np.array([[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]]))]
    values = np.where(np.arange(13) == 9, np.nan, 1.0)
    meshio.Mesh(points, cells, point_data={"p": values}, cell_data={"c": [np.array([1.0, np.inf])]}).write(
        tmp_path / "nan.vtu"
    )
    field = Field(str(tmp_path / "nan.vtu"), UNIT, array="p", length=1e-3)
    with pytest.raises(Unreadable, match="1 of the 13 numbers of `p` are not finite, the first is of point 9, counted"):
        load_field(field)
    with pytest.raises(Unreadable, match="1 of the 2 numbers of `c` are not finite, the first is of solid cell 1,"):
        load_field(replace(field, array="c"))
    meshio.Mesh(points, cells, point_data={"p": np.where(np.arange(13) == 12, np.nan, 1.0)}).write(tmp_path / "ok.vtu")
    assert read_field(replace(field, path=str(tmp_path / "ok.vtu")), points[:12] * 1e-3) == pytest.approx(1e3)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("1.00000000000e+00", "inf", r"a coordinate is not a finite number: node 1 lies at \(inf, 0, 0\) m"),
        ("0\n1\n2\n3\n", "0\n1\n2\n-1\n", "cell 0 refers to node -1, but the file has nodes 0 to 3"),
        ("0\n1\n2\n3\n", "0\n1\n2\n9\n", "cell 0 refers to node 9, but the file has nodes 0 to 3"),
        ("0\n1\n2\n3\n", "0\n1\n2\n1\n", "1 of its 1 tetrahedra are flat"),
    ],
)
def test_points_of_a_mesh_that_are_none_have_a_place(old: str, new: str, reason: str, tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    mesh = meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3]]))], point_data={"p": np.full(4, 7.0)})
    mesh.write(tmp_path / "m.vtu", binary=False)
    text = (tmp_path / "m.vtu").read_text(encoding="utf-8")
    (tmp_path / "m.vtu").write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(Unreadable, match=reason):
        load_field(Field(str(tmp_path / "m.vtu"), UNIT, length=1e-3))


def test_a_file_that_changes_is_read_again(tmp_path: Path) -> None:
    import os

    nrrd = pytest.importorskip("nrrd")
    file, X = nrrd_file(tmp_path), places(5)[1]
    field = Field(str(file), UNIT)
    before = read_field(field, X)
    values, header = nrrd.read(str(file))
    nrrd.write(str(file), 2.0 * values, header)
    os.utime(file, ns=(1, 1))
    assert read_field(field, X) == pytest.approx(2.0 * before)


def test_what_is_no_field_is_refused(tmp_path: Path) -> None:
    """Voxels that are no number; a kind of file that is none; a name of an array where there is one alone."""
    pytest.importorskip("nrrd")
    file = nrrd_file(tmp_path)
    with pytest.raises(Unreadable, match="an image has one array"):
        load_field(Field(str(file), UNIT, array="stiffness"))
    (tmp_path / "f.png").write_bytes(b"none")
    with pytest.raises(Unreadable):
        load_field(Field(str(tmp_path / "f.png"), UNIT))
    (tmp_path / "broken.nii.gz").write_bytes(b"none")
    with pytest.raises(Unreadable, match="cannot be read"):
        load_field(Field(str(tmp_path / "broken.nii.gz"), UNIT))


SCENE = """
field    ct  = field("f.nrrd", unit = 1 kPa)
material gel = neo_hookean(young = 1 kPa + 2 * ct, poisson = 0.3, density = 1000 kg/m^3)
body     bar = solid(box(size = (8, 7.5, 9) mm, origin = {origin}), gel)
support  low = fixed(bar, where = z <= -2 mm)
load     up  = gravity(9.81 m/s^2, direction = +z)
model    hex = fem(hex8, strain = corotational, size = 2 mm)
model    ten = fem(tet10, strain = finite, size = 3 mm, formulation = mixed)
probe    end = point(bar, at = (1, 2, 7) mm)
metric   far = displacement(end, along = +z)
"""


@pytest.mark.long
@pytest.mark.slow
def test_a_body_from_an_image_is_checked_and_said(tmp_path: Path) -> None:
    """Random voxels: forces are found again by scipy's interpolation, and what lies outside is a number."""
    nrrd_file(tmp_path)
    (tmp_path / "ct.scene").write_text(SCENE.format(origin="(1, -1, -2) mm"))
    report = softmark.load(tmp_path / "ct.scene").run()
    for model in report.models.values():
        assert model.status == "converged", model.message
        assert model.solve["checks"]["residual"] < 1e-8
        said = model.solve["graded"]["bar.young"]
        assert said["outside_share"] == pytest.approx(0.0, abs=1e-12)
        assert 3e3 < said["least"] < said["mean"] < said["most"] < 19e3
    (tmp_path / "ct.scene").write_text(SCENE.format(origin="(-3.5, -1, -2) mm"))
    report = softmark.load(tmp_path / "ct.scene").run()
    said = report.models["hex"].solve["graded"]["bar.young"]
    # x from -3.5 mm, of which the first voxel begins at 0: 3.5 of 8 mm are outside, to what a rule of four points sees
    assert said["outside_share"] == pytest.approx(3.5 / 8.0, abs=0.07)
    assert "W336" in {w.code for w in report.warnings}


@pytest.mark.long
@pytest.mark.slow
def test_a_ratio_from_a_file_is_warned_of_where_elements_lock(tmp_path: Path) -> None:
    """Nothing is known of it before it is read: voxels of up to 9, times 0.055, come to more than 0.45."""
    nrrd_file(tmp_path)
    scene = SCENE.format(origin="(1, -1, -2) mm").replace(
        "young = 1 kPa + 2 * ct, poisson = 0.3", "young = 9 kPa, poisson = 0.055 * ct"
    )
    scene = scene.replace("unit = 1 kPa", "unit = 1").replace(
        "mixed)", "mixed)\nmodel lin = fem(tet4, strain = small, size = 3 mm)"
    )
    (tmp_path / "ct.scene").write_text(scene)
    report = softmark.load(tmp_path / "ct.scene").run("lin")
    assert "W301" in {w.code for w in report.warnings}
    assert report.models["lin"].solve["checks"]["residual"] < 1e-8


@pytest.mark.parametrize(("header", "reason"), [
    ({"space directions": np.diag([1.0, np.inf, 1.0])}, r"voxels of \(0.001, inf, 0.001\) m .* absurdly large"),
    ({"space directions": np.diag([1.0, 1e99, 1.0])}, "absurdly large"),
    ({"space directions": np.array([[1.0, 0, 0], [0, 1, 0], [2, 0, 0]])}, "linearly dependent"),
    ({"space directions": np.diag([1.0, 0.0, 1.0])}, "linearly dependent"),
    ({"space origin": np.array([0.0, np.inf, 0.0])}, "absurdly large, or no finite numbers"),
])  # fmt: skip
def test_voxels_without_a_size_or_a_place_are_refused(header: dict[str, Any], reason: str, tmp_path: Path) -> None:
    with pytest.raises(Unreadable, match=reason):
        load_field(Field(str(nrrd_file(tmp_path, **header)), UNIT))


def test_a_hexahedron_may_be_collapsed_to_a_wedge(tmp_path: Path) -> None:
    """The Jacobian matrix is singular at the sharp edge, to which points beyond it are nearest."""
    points = np.array([[0.0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0], [0, 0, 2], [4, 0, 2], [4, 0, 2], [0, 2, 2]])
    cells = [("hexahedron", np.arange(8)[None])]
    meshio.Mesh(points, cells, point_data={"p": 1.0 + points @ [1.0, 2.0, 3.0]}).write(tmp_path / "m.vtu")
    X = 1e-3 * np.array([[4.0, 0, 2], [4, 0.5, 1.5], [1, 1, 1], [3.9, 0.1, 1.8], [5, 0, 2.5]])
    found = read_field(Field(str(tmp_path / "m.vtu"), UNIT, length=1e-3), X)
    assert found[:4] == pytest.approx(1e3 * (1.0 + 1e3 * X[:4] @ [1.0, 2.0, 3.0]))
    assert 1e3 <= found[4] <= 14e3


def test_a_header_that_is_put_right_is_not_talked_about(tmp_path: Path) -> None:
    """nibabel prints that to the standard error of when it was imported."""
    nibabel = pytest.importorskip("nibabel")
    data = bytearray(gzip.decompress(nifti_file(tmp_path).read_bytes()))
    data[0], data[255] = 93, 32  # the size of the header, which is 348, and the code of its axes
    (tmp_path / "f.nii").write_bytes(data)
    out = io.StringIO()
    handler = logging.StreamHandler(out)
    nibabel.imageglobals.logger.addHandler(handler)
    try:
        found = load_field(Field(str(tmp_path / "f.nii"), UNIT))
    finally:
        nibabel.imageglobals.logger.removeHandler(handler)
    assert found.values(places(3)[1]).shape == (3,)
    assert not out.getvalue()


def test_inverted_cells_keep_their_numbers(tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    cells = [("tetra", np.array([[0, 2, 1, 3]]))]
    meshio.Mesh(points, cells, point_data={"p": 1.0 + points @ [1.0, 2.0, 3.0]}).write(tmp_path / "m.vtu")
    X = 1e-3 * RNG.dirichlet(np.ones(4), 20) @ points
    found = read_field(Field(str(tmp_path / "m.vtu"), UNIT, length=1e-3), X)
    assert found == pytest.approx(1e3 * (1.0 + 1e3 * X @ [1.0, 2.0, 3.0]))


@pytest.mark.parametrize("kind", ["hex8", "wedge6", "tet4"])
def test_integrals_between_voxels_are_exact_in_cells_along_them(kind: str, tmp_path: Path) -> None:
    """An image is linear along each axis between centres of voxels, and boxes that end there need no halving."""
    pytest.importorskip("nrrd")
    image = load_field(Field(str(nrrd_file(tmp_path)), UNIT))
    assert isinstance(image, Image)
    A, b = np.diag([3.1e-3, 2.3e-3, 4.7e-3]), np.array([4e-3, 3e-3, 4e-3])
    corners = node_positions(kind) @ A.T + b
    many = 0

    def rows(X: Any) -> Any:
        nonlocal many
        many += len(X)
        return image.values(X)[None]

    f, kinks = _weighted_integrands(rows, [image], kind, corners)
    flat = [axis for axis in range(3) if len(kinks[axis])]
    assert flat == {"hex8": [0, 1, 2], "wedge6": [0, 2], "tet4": [0]}[kind]
    hints, close = node_positions(kind), np.array([1e-9])
    own, left = integrate_by_boxes(kind, f, hints, close, kinks)
    taken, many = many, 0
    other, more = integrate_by_boxes(kind, f, hints, close)
    assert np.abs(own - other).max() <= left[0] + more[0]
    assert left[0] <= more[0]
    if kind == "hex8":
        assert taken < 0.2 * many
        planes = [np.unique([0.0, 1.0, *(k for k in along if 0.0 < k < 1.0)]) for along in kinks]
        t, w = np.polynomial.legendre.leggauss(2)  # exact for what is linear along each axis
        points = [(p[:-1, None] + np.diff(p)[:, None] * 0.5 * (t + 1.0)).ravel() for p in planes]
        weights = [(np.diff(p)[:, None] * 0.5 * w).ravel() for p in planes]
        xi = 2.0 * np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 3) - 1.0
        volume = 8.0 * float(np.linalg.det(A)) * np.einsum("i,j,k->ijk", *weights).ravel()
        whole = float(image.values(xi @ A.T + b) @ volume)
        assert own[0, 0] == pytest.approx(whole, rel=1e-9)
        assert left[0] < 1e-9 * abs(whole)
