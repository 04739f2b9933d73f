"""Meshes with nodes on given surfaces: everywhere on them, with sound cells, and as ever where nothing is asked."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.elements import UnknownElement
from softmark.solvers.mesh.cell_counts import OFF_CENTRE
from softmark.solvers.mesh.conforming_planes import LEAST, Cut, grid_lines
from softmark.solvers.mesh.files.mesh_reader import convert_cells
from softmark.solvers.mesh.mesh_distortion import cell_qualities
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.simplex_clipping import Pieces

KINDS = ("tet4", "tet10", "hex8")


def crossed(level: np.ndarray, slack: float) -> int:
    """How many cells have nodes on both sides of a border, by the level at their nodes (m, a)."""
    return int(((level.min(axis=1) < -slack) & (level.max(axis=1) > slack)).sum())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(12))
def test_planes_across_the_edges_of_boxes_are_met(kind: str, seed: int) -> None:
    """No cell is crossed, none is thinner than 1/20 of its size but for the rounding of counts; the volume is exact."""
    rng = np.random.default_rng(seed)
    size, origin = rng.uniform(0.01, 0.1, 3), rng.uniform(-0.05, 0.05, 3)
    box, h = Box(tuple(size), tuple(origin)), float(size.min() / rng.integers(2, 5))
    share, axes = rng.uniform(0.0, 1.0, 3), rng.choice(3, rng.integers(1, 4), replace=False)
    cuts = tuple(Cut("xyz"[i], float(origin[i] + share[i] * size[i])) for i in axes)
    mesh, plain = box.mesh(kind, h, cuts), box.mesh(kind, h)
    even = np.ptp(plain.points, axis=0) / [len(np.unique(np.round(c, 9))) - 1 for c in plain.points.T]
    even *= 2.0 if kind == "tet10" else 1.0
    for i, cut in zip(axes, cuts, strict=True):
        if min(share[i], 1.0 - share[i]) * size[i] < 1.01 * LEAST * even[i]:
            continue  # too near to a face: left unmet, and reported as missed
        assert crossed(mesh.points[mesh.cells][:, :, i] - cut.at, 1e-9 * size[i]) == 0
    assert mesh.volumes.min() > 0.0
    assert mesh.volumes.sum() == pytest.approx(box.volume, rel=1e-12)
    # three layers of 1/20 of a cell meet in its worst corner: mean ratio 3 (l1 l2 l3)^(2/3) / (l1^2 + l2^2 + l3^2)
    assert cell_qualities(mesh).min() > 0.5 * LEAST * cell_qualities(plain).min()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(12))
def test_planes_and_circles_in_cylinders_are_met(kind: str, seed: int) -> None:
    """Chords of the section up to 0.6 radii off the middle, circles from 0.2 radii, planes across the axis."""
    rng = np.random.default_rng(100 + seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    length, radius = float(rng.uniform(0.05, 0.2)), float(rng.uniform(0.01, 0.03))
    body = Cylinder(length, radius, tuple(axis), tuple(rng.normal(size=3)))
    station = Cut("along", float(rng.uniform(0.1, 0.9) * body.length))
    offset, turn = float(rng.uniform(-1, 1) * OFF_CENTRE * body.radius), float(rng.uniform(-np.pi, np.pi))
    circle = Cut("radius", float(rng.uniform(0.25, 0.9) * body.radius))
    for cuts in ((station, Cut("chord", offset, turn=turn)), (station, circle)):
        mesh = body.mesh(kind, body.radius / 3, cuts)
        assert mesh.volumes.min() > 0.0
        assert cell_qualities(mesh).min() > 0.05
        s, p, r = own(body, mesh.points, turn)
        cells = mesh.cells[:, : mesh.element.corners]
        assert crossed(s[cells] - station.at, 1e-9 * body.length) == 0
        level = p - offset if cuts[1].axis == "chord" else r - circle.at
        assert crossed(level[cells], 1e-9 * body.radius) == 0
        assert np.isclose(r.max(), body.radius, rtol=1e-12)


def own(body: Cylinder, X: np.ndarray, turn: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of points: stations, distances from the middle in a direction of the section, and radii, m."""
    from softmark.solvers.mesh.shapes import transverse

    first, second = (np.array(v) for v in transverse(body.axis))
    d = X - np.array(body.origin)
    u, v = d @ first, d @ second
    return d @ np.array(body.axis), u * np.cos(turn) + v * np.sin(turn), np.hypot(u, v)


@pytest.mark.parametrize("kind", KINDS)
def test_cuts_that_are_met_already_change_no_bit(kind: str) -> None:
    box = Box((0.06, 0.02, 0.02))
    on_the_grid = (Cut("x", 0.01), Cut("z", 0.0), Cut("z", 0.02), Cut("y", 0.005))
    assert np.array_equal(box.mesh(kind, 0.005).points, box.mesh(kind, 0.005, on_the_grid).points)
    rod = Cylinder(0.1, 0.02)
    across = (Cut("along", 0.05), Cut("chord", 0.0, turn=0.5 * np.pi), Cut("radius", 0.02))
    assert np.array_equal(rod.mesh(kind, 0.005).points, rod.mesh(kind, 0.005, across).points)


def test_a_line_moves_rather_than_one_being_added() -> None:
    assert grid_lines(0.0, 20.0, 4, [Cut("z", 14.9)]) == pytest.approx([0.0, 14.9 / 3, 29.8 / 3, 14.9, 20.0])
    assert grid_lines(0.0, 20.0, 4, [Cut("z", 19.9)]) is None  # a needle: left out
    assert grid_lines(0.0, 20.0, 4, [Cut("z", 19.9, thin=True)]) is not None  # all held: as thin as it likes
    near = grid_lines(0.0, 20.0, 4, [Cut("z", 12.0), Cut("z", 12.1)])
    assert near is not None
    assert 12.0 in near
    assert 12.1 not in near


@pytest.mark.parametrize("k", [2, 3, 4])
def test_pieces_add_up_and_lie_on_one_side(k: int) -> None:
    """Segments, triangles and tetrahedra cut by random planes, exactly."""
    rng = np.random.default_rng(k)
    whole = Pieces(rng.normal(size=(40, k, 3)), np.arange(40))
    pieces = whole
    for _ in range(3):
        n, d = rng.normal(size=3), float(rng.normal() * 0.3)
        pieces = pieces.cut(lambda X, n=n, d=d: X @ n - d, 1e-12, curved=False)
        level = pieces.corners @ n - d
        assert not ((level.min(axis=1) < -1e-9) & (level.max(axis=1) > 1e-9)).any()
    assert np.bincount(pieces.of, pieces.sizes) == pytest.approx(whole.sizes, rel=1e-10)


@pytest.mark.parametrize("shape", [Box((0.06, 0.02, 0.02)), Cylinder(0.1, 0.02)])
def test_an_element_that_no_mesh_is_made_of_is_refused(shape: Box | Cylinder) -> None:
    with pytest.raises(UnknownElement, match="`hex8b`"):
        shape.mesh("hex8b", 0.005)
    with pytest.raises(UnknownElement, match="`hex8b`"):
        convert_cells(shape.mesh("hex8", 0.01), "hex8b", "five")
