"""The imaging chain on shapes that are known exactly: voxels, blur, noise, marching cubes, smoothing."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from softmark.references import virtual_scan
from softmark.references.measured_data import Unreadable
from softmark.references.surface_geometry import signed_volume
from softmark.references.virtual_scan import Scanner, VirtualScan, coverage, scan

VOXEL = (0.425e-3, 0.425e-3, 0.62e-3)  # of the CT of Marchal et al. 2008, 512 x 512 x 113 of them
BAR = 0.2e-3
R, LENGTH, BEND = 0.019, 0.178, 0.15  # the silicone beam on an arc of 150 mm, which turns its tip by 68 degrees


def bent_cylinder(around: int = 96, along: int = 160) -> tuple[np.ndarray, np.ndarray]:
    """The surface of a cylinder whose centre line is an arc: rings, each closed by a fan at the ends."""
    turns = 2 * np.pi * np.arange(around) / around
    s = np.linspace(0, LENGTH, along + 1)
    section = R * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    rings = np.concatenate([_placed(si, section) for si in s])
    points = np.vstack([rings, _placed(0.0, np.zeros((1, 2))), _placed(LENGTH, np.zeros((1, 2)))])
    k, j = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    a, b = (k * around + j).ravel(), (k * around + (j + 1) % around).ravel()
    wall = np.vstack([np.stack([a, b, b + around], 1), np.stack([a, b + around, a + around], 1)])
    first, last = np.arange(around), along * around + np.arange(around)
    ends = [np.stack([np.full(around, len(rings)), np.roll(first, -1), first], 1),
            np.stack([np.full(around, len(rings) + 1), last, np.roll(last, -1)], 1)]  # fmt: skip
    triangles = np.vstack([wall, *ends])
    return points, triangles if signed_volume(points, triangles) > 0 else triangles[:, ::-1].copy()


def _placed(s: float, section: np.ndarray) -> np.ndarray:
    """Points of a section (n, 2) at the station s: a turn of s / BEND about an axis along y, BEND below."""
    phi = s / BEND
    across, up = section.T
    return np.stack([(BEND + up) * math.sin(phi), across, (BEND + up) * math.cos(phi) - BEND], axis=1)


def exact_distance(points: np.ndarray) -> np.ndarray:
    """Distance of points near the wall of the bent cylinder from it: a torus."""
    radial = np.hypot(points[:, 0], points[:, 2] + BEND)
    return np.abs(np.hypot(radial - BEND, points[:, 1]) - R)


def on_the_wall(points: np.ndarray) -> np.ndarray:
    phi = np.arctan2(points[:, 0], points[:, 2] + BEND)
    return (phi > 3e-3 / BEND) & (phi < (LENGTH - 3e-3) / BEND)


def test_boxes_fill_voxels_by_the_share_they_cover() -> None:
    # A box with faces along the grid: each voxel's share is a product. Along the rays, z here, it is
    # exact; across, four rays count, and faces are laid where four rays are right.
    made = trimesh.creation.box(bounds=[[1.5, 2.25, 3.1], [4.0, 5.5, 7.7]])
    found = coverage(np.asarray(made.vertices), np.asarray(made.faces), np.full(3, 0.5),
                     np.array([1.0, 1.0, 1.0 + 1e-12]), (6, 8, 9))  # fmt: skip

    def shares(low: float, high: float, n: int) -> np.ndarray:
        return np.clip(np.minimum(high, np.arange(1, n + 1)) - np.maximum(low, np.arange(n)), 0, 1)

    expected = np.einsum("i,j,k->ijk", shares(1.5, 4.0, 6), shares(2.25, 5.5, 8), shares(3.1, 7.7, 9))
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("longest", [0, 1, 2])
def test_filled_volume_is_the_volume_whichever_way_the_rays_go(longest: int) -> None:
    # Sixteen rays a voxel over a smooth ball: errors of the single columns cancel to 1e-5 of the volume.
    ball = trimesh.creation.icosphere(4, 0.01)
    points, triangles = np.asarray(ball.vertices) + np.array([0.003, 0.001, -0.002]), np.asarray(ball.faces)
    voxel = np.roll(VOXEL, longest + 1)
    volume = scan(points, triangles, Scanner(tuple(voxel)))
    filled = volume.values.sum() * voxel.prod()
    assert filled == pytest.approx(signed_volume(points, triangles), rel=1e-4)
    centre = np.einsum("ijk,aijk->a", volume.values, np.indices(volume.values.shape)) / volume.values.sum()
    assert volume.points(centre[None])[0] == pytest.approx([0.003, 0.001, -0.002], abs=1e-6)
    assert volume.values.min() > -1e-12
    assert volume.values.max() < 1 + 1e-12


def test_rays_through_edges_and_corners_count_once() -> None:
    # Corners of the mesh lie on rays: every ray fills whole voxels, none is lost or counted twice.
    grid = trimesh.creation.box(bounds=[[1, 1, 1], [5, 5, 5]]).subdivide().subdivide()
    points = np.asarray(grid.vertices) + np.array([0.125, 0.125, 0.0])  # rays stand at odd eighths
    voxel = np.array([1.0, 1.0, 1.0 + 1e-12])  # rays go along the longest edge, here z
    found = coverage(points, np.asarray(grid.faces), np.full(3, 0.5), voxel, (7, 7, 7))
    assert found.sum() == pytest.approx(64.0, rel=1e-10)
    assert np.allclose(found * 16, np.round(found * 16))


@pytest.mark.slow
@pytest.mark.long
def test_lots_of_triangles_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = trimesh.creation.icosphere(2, 0.01)
    whole = scan(np.asarray(ball.vertices), np.asarray(ball.faces), Scanner(VOXEL)).values
    monkeypatch.setattr(virtual_scan, "PAIRS", 2000)
    parts = scan(np.asarray(ball.vertices), np.asarray(ball.faces), Scanner(VOXEL)).values
    assert parts == pytest.approx(whole, abs=1e-12)


def test_the_same_seed_gives_the_same_noise() -> None:
    ball = trimesh.creation.icosphere(2, 0.005)
    shape = np.asarray(ball.vertices), np.asarray(ball.faces)
    first, same, other = (scan(*shape, Scanner(VOXEL, 0.3e-3, 0.05, seed)).values for seed in (1, 1, 2))
    assert np.array_equal(first, same)
    assert not np.array_equal(first, other)
    clean = scan(*shape, Scanner(VOXEL, 0.3e-3)).values
    assert (first - clean).std() == pytest.approx(0.05, rel=0.03)  # 30 000 voxels: 0.4 %


def test_a_field_of_view_of_ones_own() -> None:
    ball = trimesh.creation.icosphere(2, 0.005)
    volume = scan(np.asarray(ball.vertices), np.asarray(ball.faces), Scanner(VOXEL), shape=(64, 48, 33))
    assert volume.values.shape == (64, 48, 33)
    assert volume.points(np.array([[31.5, 23.5, 16.0]]))[0] == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("sphere", trimesh.creation.icosphere(5, 0.019)),
        pytest.param(
            "cylinder",
            trimesh.creation.cylinder(0.019, 0.05, sections=96).subdivide().subdivide(),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_chain_is_right_to_a_fraction_of_a_voxel(name: str, shape: trimesh.Trimesh) -> None:
    # The bar is 0.2 mm, half of the smaller voxel. Reached: 0.02 mm on the ball, 0.03 mm on the cylinder,
    # whose sharp rims a blur of 0.4 mm rounds.
    pytest.importorskip("skimage", reason="needs the extra `imaging`")
    points, triangles = np.asarray(shape.vertices), np.asarray(shape.faces, dtype=np.int64)
    found = VirtualScan("model", noise=0.03, seed=7).load(points, triangles)
    assert found.uncertainty < 0.25 * BAR
    assert found.notes[0].startswith("imaging chain on ")
    assert found.source == "a virtual scan of `model`"
    if name == "sphere":
        radii = np.linalg.norm(found.points, axis=1)
        assert abs(radii.mean() - 0.019) < 0.02e-3
    volume = signed_volume(points, triangles)
    assert signed_volume(found.points, found.triangles) == pytest.approx(volume, rel=5e-3)


@pytest.mark.long
@pytest.mark.slow
def test_the_chain_on_a_beam_that_is_bent_along_a_known_arc() -> None:
    # The wall is a torus, so the distance needs no triangles. The mesh that is scanned lies 0.01 mm inside of it.
    pytest.importorskip("skimage", reason="needs the extra `imaging`")
    points, triangles = bent_cylinder()
    scanner = VirtualScan("model", voxel=(0.425e-3, 0.62e-3, 0.425e-3), noise=0.03, seed=1)
    found = scanner.load(points, triangles)
    wall = found.points[on_the_wall(found.points)]
    d = exact_distance(wall)
    assert d.mean() < 0.1 * BAR
    assert d.std() < 0.1 * BAR
    assert d.max() < BAR
    assert found.uncertainty < 0.25 * BAR


@pytest.mark.slow
def test_more_noise_and_coarser_voxels_make_more_error() -> None:
    pytest.importorskip("skimage", reason="needs the extra `imaging`")
    ball = trimesh.creation.icosphere(4, 0.012)
    shape = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    fine, noisy, coarse = (
        VirtualScan("m", voxel, noise=noise).load(*shape).uncertainty
        for voxel, noise in ((VOXEL, 0.01), (VOXEL, 0.1), ((2e-3, 2e-3, 2e-3), 0.01))
    )
    assert fine < noisy
    assert fine < coarse


def test_what_cannot_be_scanned() -> None:
    ball = trimesh.creation.icosphere(1, 0.01)
    points, triangles = np.asarray(ball.vertices), np.asarray(ball.faces)
    with pytest.raises(Unreadable, match="is not closed"):
        scan(points, triangles[1:], Scanner(VOXEL))
    with pytest.raises(Unreadable, match=r"the grid would have .* voxels; use larger voxels"):
        scan(points, triangles, Scanner((1e-6, 1e-6, 1e-6)))
