"""Rigid registration: a motion that is known is found again, and what it leaves is stated."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from softmark.references.registration import RigidMotion, face_to_face, icp, kabsch, rotation_matrix, shortest_rotation
from softmark.references.surface_geometry import SurfaceSearch


def bracket() -> tuple[np.ndarray, np.ndarray]:
    """A closed surface without symmetry, 40 x 30 x 20 mm, of small triangles."""
    box = trimesh.creation.box((0.04, 0.03, 0.02)).subdivide().subdivide().subdivide()
    points = np.asarray(box.vertices).copy()
    points[:, 2] += 8 * points[:, 0] ** 2 + 5 * points[:, 0] * points[:, 1]
    return points, np.asarray(box.faces, dtype=np.int64)


def known(angle: float = 0.05) -> RigidMotion:
    return RigidMotion(rotation_matrix(angle * np.array([1.0, 2.0, -2.0]) / 3), np.array([1e-3, -2e-3, 0.5e-3]))


def undone(motion: RigidMotion, found: RigidMotion) -> float:
    """How far the two motions, one after the other, are from rest, over a body of 50 mm."""
    both = motion.then(found)
    return float(np.abs(both.rotation - np.eye(3)).max() * 0.05 + np.abs(both.shift).max())


def test_rotations_are_rotations() -> None:
    R = rotation_matrix(np.array([0.0, 0.0, math.pi / 2]))
    assert pytest.approx([0, 1, 0], abs=1e-15) == R @ [1, 0, 0]
    assert RigidMotion(rotation_matrix(np.array([0.1, -0.2, 0.2])), np.zeros(3)).angle == pytest.approx(0.3, rel=1e-12)
    a, b = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])
    assert shortest_rotation(a, b) @ a == pytest.approx(b, abs=1e-15)
    assert np.array_equal(shortest_rotation(a, a), np.eye(3))


def test_points_onto_their_own_to_rounding() -> None:
    points, _ = bracket()
    found = kabsch(known(2.0)(points), points)
    assert undone(known(2.0), found.motion) < 1e-9
    assert found.residual.max < 1e-15


def test_points_of_a_plane_are_not_mirrored() -> None:
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 1, 0]])
    found = kabsch(known(2.5)(flat), flat)
    assert np.linalg.det(found.motion.rotation) == pytest.approx(1.0)
    assert found.residual.max < 1e-14


def test_residual_is_the_noise() -> None:
    # White noise of sigma per coordinate leaves distances of root mean square sigma sqrt(3) less six of the
    # 3 n degrees of freedom; its own scatter is sigma sqrt(3 / (2 n)), 1.2 % here, four of them 5 %.
    points, _ = bracket()
    sigma = 1e-4
    noisy = points + np.random.default_rng(4).normal(scale=sigma, size=points.shape)
    n = len(points)
    expected = sigma * math.sqrt(3 * (1 - 6 / (3 * n)))
    assert kabsch(known()(noisy), points).residual.rms == pytest.approx(expected, rel=0.05)


def test_weights_of_zero_leave_points_out() -> None:
    points, _ = bracket()
    moved = known()(points)
    moved[0] += 1.0
    weights = np.ones(len(points))
    weights[0] = 0.0
    assert undone(known(), kabsch(moved, points, weights).motion) < 1e-9


def test_points_of_a_surface_onto_it() -> None:
    # Points inside triangles, whose distances are differentiable: convergence is quadratic, to rounding.
    points, triangles = bracket()
    weights = np.array([0.5, 0.3, 0.2])
    inside = np.einsum("i,tij->tj", weights, points[triangles])
    found = icp(known()(inside), SurfaceSearch(points, triangles))
    assert found.converged
    assert undone(known(), found.motion) < 1e-9
    assert found.residual.max < 1e-9


def test_residual_onto_a_surface_is_the_noise_across_it() -> None:
    # Only the component across the surface is a distance, sigma in the root mean square where the surface is flat over
    # several sigma; six of n degrees of freedom are fitted. Edges, where more components count, are few: 5 %.
    points, triangles = bracket()
    inside = np.einsum("i,tij->tj", np.array([0.5, 0.3, 0.2]), points[triangles])
    noisy = inside + np.random.default_rng(5).normal(scale=5e-5, size=inside.shape)
    found = icp(known()(noisy), SurfaceSearch(points, triangles))
    assert found.converged
    assert found.residual.rms == pytest.approx(5e-5, rel=0.07)
    assert undone(known(), found.motion) < 5e-5


def test_outliers_can_be_left_out_of_the_motion_but_not_of_the_residual() -> None:
    points, triangles = bracket()
    inside = np.einsum("i,tij->tj", np.array([0.5, 0.3, 0.2]), points[triangles])
    outliers = inside[:20] + np.array([0.0, 0.0, 0.02])
    found = icp(known(0.02)(np.vstack([inside, outliers])), SurfaceSearch(points, triangles), keep=0.95)
    assert undone(known(0.02), found.motion) < 1e-6
    assert found.residual.max > 5e-3


def test_a_motion_that_the_surface_does_not_see_is_left_alone() -> None:
    # A sphere turns on itself unseen: the registration shifts it and turns it by nothing.
    ball = trimesh.creation.icosphere(4, 0.02)
    points, triangles = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    found = icp(1.0 * points + [1e-3, 0, 0], SurfaceSearch(points, triangles))
    assert found.motion.shift == pytest.approx([-1e-3, 0, 0], abs=1e-6)
    assert found.motion.angle < 1e-3


def test_face_onto_face() -> None:
    # A disc that was tilted and moved comes back to rounding, but for its turn about its own normal.
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rim = 0.019 * np.stack([np.zeros(24), np.cos(turns), np.sin(turns)], axis=1)
    disc = np.vstack([np.zeros((1, 3)), rim])
    fan = np.array([[0, 1 + (i + 1) % 24, 1 + i] for i in range(24)])
    moved = known(0.2)(disc)
    found = face_to_face(moved, fan, disc, fan)
    placed = found.motion(moved)
    assert placed[:, 0] == pytest.approx(np.zeros(25), abs=1e-15)
    assert placed[0] == pytest.approx(np.zeros(3), abs=1e-15)
    assert found.residual.max < 1e-15
    bulged = disc + np.array([[1e-4, 0, 0]]) * (np.arange(25) == 0)[:, None]
    assert face_to_face(bulged, fan, disc, fan).residual.max > 5e-5
