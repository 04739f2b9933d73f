"""Closest points, normals, volumes, rays and smoothing of triangulated surfaces."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from softmark.references import surface_geometry
from softmark.references.surface_geometry import SurfaceSearch, closest_in_triangles
from softmark.references.surface_smoothing import taubin


def sphere(radius: float, subdivisions: int = 3) -> tuple[np.ndarray, np.ndarray]:
    ball = trimesh.creation.icosphere(subdivisions, radius)
    return np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)


def brute_force(p: np.ndarray, corners: np.ndarray) -> float:
    """Distance of p (3,) from a triangle (3, 3): its weights by non-negative least squares that sum to one."""
    heavy = 1e6  # the sum of the weights is asked for a million times as strongly as the place
    scale = np.abs(corners - p).max()
    A = np.vstack([(corners - p).T / scale, heavy * np.ones(3)])
    weights = nnls(A, np.array([0.0, 0.0, 0.0, heavy]))[0]
    return float(np.linalg.norm(weights / weights.sum() @ (corners - p)))


unit = st.floats(-1.0, 1.0, width=32)
point = st.tuples(unit, unit, unit)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(point, st.tuples(point, point, point))
def test_closest_point_of_a_triangle_against_another_method(p: tuple, corners: tuple) -> None:
    # Tolerance: least squares that weigh the sum of the weights by 1e6 miss the distance by up to 1e-6 of it.
    P, C = np.array(p, dtype=float), np.array(corners, dtype=float)
    found = closest_in_triangles(P[None], C[None])[0]
    area = np.linalg.norm(np.cross(C[1] - C[0], C[2] - C[0]))
    if area > 1e-3:  # a sliver has no well-conditioned second opinion
        assert np.linalg.norm(found - P) == pytest.approx(brute_force(P, C), abs=1e-5)


def test_closest_point_of_a_triangle_without_area_is_one_of_its_points() -> None:
    flat = np.array([[[0.0, 0, 0], [1, 0, 0], [0.25, 0, 0]], [[2.0, 0, 0], [2, 0, 0], [2, 0, 0]]])
    found = closest_in_triangles(np.array([[0.5, 1.0, 0.0], [0.0, 0.0, 0.0]]), flat)
    assert np.isfinite(found).all()
    assert found[1] == pytest.approx([2, 0, 0])


def test_search_by_tree_finds_what_looking_at_every_triangle_finds() -> None:
    # Two sizes of triangles, queries on, near, far from and at the centre of the surface. Both ways compute
    # the same numbers, so they agree to rounding.
    rng = np.random.default_rng(1)
    points, triangles = sphere(0.02, 3)
    big = np.array([[0.05, -0.2, -0.2], [0.05, 0.2, -0.2], [0.05, 0.0, 0.3]])
    points, triangles = np.vstack([points, big]), np.vstack([triangles, [[len(points) + i for i in range(3)]]])
    queries = np.vstack([rng.normal(scale=s, size=(60, 3)) for s in (0.02, 0.3)] + [points[:20], np.zeros((1, 3))])
    found = SurfaceSearch(points, triangles).closest(queries)
    for q, close, distance in zip(queries, found.points, found.distances, strict=True):
        every = closest_in_triangles(np.repeat(q[None], len(triangles), axis=0), points[triangles])
        assert distance == pytest.approx(np.linalg.norm(every - q, axis=1).min(), abs=1e-15)
        assert np.linalg.norm(close - q) == pytest.approx(distance, abs=1e-15)


def test_search_in_small_lots_finds_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    points, triangles = sphere(1.0, 2)
    queries = np.random.default_rng(2).normal(size=(200, 3))
    at_once = SurfaceSearch(points, triangles).closest(queries)
    monkeypatch.setattr(surface_geometry, "PAIRS", 50)
    in_lots = SurfaceSearch(points, triangles).closest(queries)
    assert np.array_equal(at_once.distances, in_lots.distances)
    assert np.array_equal(at_once.triangles, in_lots.triangles)


def test_no_queries_have_no_closest_points() -> None:
    assert SurfaceSearch(*sphere(1.0, 1)).closest(np.zeros((0, 3))).distances.shape == (0,)


def test_volume_area_and_centre_of_a_box() -> None:
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    points, triangles = np.asarray(box.vertices) + 5.0, np.asarray(box.faces)
    assert surface_geometry.signed_volume(points, triangles) == pytest.approx(6.0, rel=1e-14)
    assert surface_geometry.signed_volume(points, triangles[:, ::-1]) == pytest.approx(-6.0, rel=1e-14)
    assert surface_geometry.areas(points, triangles).sum() == pytest.approx(22.0, rel=1e-14)
    assert surface_geometry.area_centroid(points, triangles) == pytest.approx([5, 5, 5], rel=1e-14)
    assert surface_geometry.count_open_edges(triangles) == 0
    assert surface_geometry.count_open_edges(triangles[1:]) == 3
    assert surface_geometry.count_open_edges(np.vstack([triangles[1:], triangles[:1, ::-1]])) == 3  # one is turned over


def test_corner_normals_of_a_box_do_not_depend_on_how_its_faces_are_split() -> None:
    # Weighted by angle, three faces of a corner count alike whether they give it one triangle or two.
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    points, triangles = np.asarray(box.vertices), np.asarray(box.faces)
    assert surface_geometry.vertex_normals(points, triangles) == pytest.approx(
        np.sign(points) / math.sqrt(3), abs=1e-14
    )


def test_parts_are_told_apart() -> None:
    points, triangles = sphere(1.0, 1)
    both = np.vstack([triangles, triangles + len(points)])
    part = surface_geometry.find_connected_parts(2 * len(points), both)
    assert len(set(part[: len(triangles)])) == len(set(part[len(triangles) :])) == 1
    assert part[0] != part[-1]


def test_rays_meet_a_sphere_where_it_is() -> None:
    # The middle of a triangle, one of 5120, lies R (1 - cos(a)) inside the sphere, a = 0.044 rad on average: 1e-3 R.
    points, triangles = sphere(1.0, 4)
    directions = surface_geometry.unit_normals(points, triangles)[::37]
    out = surface_geometry.ray_distances(np.zeros_like(directions), directions, points, triangles)
    assert out == pytest.approx(np.ones(len(out)), abs=1.5e-3)
    past = surface_geometry.ray_distances(3 * directions, directions, points, triangles)
    assert np.isinf(past).all()
    toward = surface_geometry.normal_distances(3 * directions, directions, points, triangles)
    assert toward == pytest.approx(np.full(len(out), -2.0), abs=1.5e-3)


def test_a_ray_along_an_edge_is_not_lost() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    found = surface_geometry.ray_distances(np.array([[0.5, 0.5, 2.0]]), np.array([[0.0, 0, -1]]), points, triangles)
    assert found == pytest.approx([2.0])


def test_taubin_smooths_and_keeps_the_volume() -> None:
    # A sphere of 20 mm with white noise of 0.1 mm: the filter takes out most of it. 0.5 % of volume is 0.033 mm
    # of radius; Taubin's usual pass band of 0.1 would swell the coarse sphere by 2 % in a hundred steps.
    points, triangles = sphere(0.02, 4)
    rough = points + np.random.default_rng(3).normal(scale=1e-4, size=points.shape)
    smooth = taubin(rough, triangles, 10)
    before, after = (np.linalg.norm(p, axis=1).std() for p in (rough, smooth))
    assert after < 0.5 * before
    volume = surface_geometry.signed_volume(points, triangles)
    assert surface_geometry.signed_volume(smooth, triangles) == pytest.approx(volume, rel=5e-3)
    assert surface_geometry.signed_volume(taubin(points, triangles, 100), triangles) == pytest.approx(volume, rel=5e-3)


def test_taubin_moves_neither_a_point_without_neighbours_nor_anything_in_no_steps() -> None:
    points, triangles = sphere(1.0, 1)
    alone = np.vstack([points, [[9.0, 9.0, 9.0]]])
    assert taubin(alone, triangles, 5)[-1] == pytest.approx([9, 9, 9])
    assert np.array_equal(taubin(points, triangles, 0), points)


def test_a_target_answers_many_times() -> None:
    target = SurfaceSearch(*sphere(1.0, 2))
    first, second = (target.closest(np.array([[2.0, 0.1, 0.0]])) for _ in range(2))
    assert first.distances == pytest.approx(second.distances)
