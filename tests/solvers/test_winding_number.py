"""Whole turns of twisted bodies, which positions of their ends do not show."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softmark.solvers.statics.winding_number import COARSE, LOST, RotationSupport, find_cell_chains

LAYERS = 8


def bar(layers: int, flat: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, cells and layers of points of a bar along x of length 1 with square cells across; or of a strip."""
    section = [(-0.1, 0.0), (0.1, 0.0)] if flat else [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)]
    points = np.array([(x, y, z) for x in np.linspace(0.0, 1.0, layers + 1) for y, z in section])
    k = len(section)
    cells = np.array([[k * i + j for j in range(2 * k)] for i in range(layers)])
    return points, cells, np.arange(len(points)).reshape(-1, k)


def twisted(points: np.ndarray, degrees: float) -> np.ndarray:
    """Displacements of a bar whose sections turn about its axis in proportion to x, by so much at x = 1."""
    a = np.radians(degrees) * points[:, 0]
    y, z = points[:, 1], points[:, 2]
    moved = np.stack([points[:, 0], np.cos(a) * y - np.sin(a) * z, np.sin(a) * y + np.cos(a) * z], axis=1)
    return moved - points


@pytest.mark.parametrize("degrees", [30, 180, 270, 360, 540, 720, -400])
def test_a_twist_is_told_from_one_that_a_whole_turn_is_missing_of(degrees: float) -> None:
    """Ends are at the same places with a whole turn more or less; the cells between are not."""
    points, cells, layers = bar(LAYERS)
    grips = [
        RotationSupport(layers[0], (0.0, 0.0, 0.0)),
        RotationSupport(layers[-1], (math.radians(degrees), 0.0, 0.0)),
    ]
    (chain,) = find_cell_chains(points, cells, grips)
    assert np.array_equal(chain.cells, cells)
    assert chain.lost_turn_message(twisted(points, degrees), 1.0) is None
    assert chain.lost_turn_message(twisted(points, degrees - 360), 1.0) == LOST
    assert chain.lost_turn_message(twisted(points, degrees + 360), 1.0) == LOST
    assert chain.lost_turn_message(twisted(points, 0.5 * degrees), 0.5) is None


def test_what_cells_cannot_show_is_told() -> None:
    """Two cells bear a half turn and not a whole one: a half turn in each, where they have no rotation."""
    points, cells, layers = bar(2)
    for degrees, told in ((180, {None}), (340, {COARSE}), (360, {COARSE, LOST}), (380, {COARSE})):
        grips = [
            RotationSupport(layers[0], (0.0, 0.0, 0.0)),
            RotationSupport(layers[-1], (math.radians(degrees), 0.0, 0.0)),
        ]
        assert find_cell_chains(points, cells, grips)[0].lost_turn_message(twisted(points, degrees), 1.0) in told


def test_both_ends_may_turn_and_the_body_as_a_whole() -> None:
    """Opposite turns of 180 degrees are a twist of 360; equal turns none, wherever the body is."""
    points, cells, layers = bar(LAYERS)
    grips = [RotationSupport(layers[0], (-math.pi, 0.0, 0.0)), RotationSupport(layers[-1], (math.pi, 0.0, 0.0))]
    half = twisted(points - [0.5, 0.0, 0.0], 360)
    assert find_cell_chains(points, cells, grips)[0].lost_turn_message(half, 1.0) is None
    both = [RotationSupport(layers[0], (0.0, 0.0, 7.0)), RotationSupport(layers[-1], (0.0, 0.0, 7.0))]
    c, s = math.cos(7.0), math.sin(7.0)
    turned = points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) - points
    assert find_cell_chains(points, cells, both)[0].lost_turn_message(turned, 1.0) is None
    assert find_cell_chains(points, cells, both[:1]) == ()


def test_a_strip_in_a_plane_bends_into_a_ring() -> None:
    """Turned by a whole turn at one end, the body must not be taken for the undeformed one."""
    points, cells, layers = bar(LAYERS, flat=True)
    grips = [RotationSupport(layers[0], (0.0, 0.0, 0.0)), RotationSupport(layers[-1], (0.0, 0.0, 2.0 * math.pi))]
    a, r = 2.0 * math.pi * points[:, 0], 0.5 / math.pi - points[:, 1]
    ring = np.stack([r * np.sin(a), 0.5 / math.pi - r * np.cos(a), 0.0 * a], axis=1) - points
    (chain,) = find_cell_chains(points, cells, grips)
    assert chain.lost_turn_message(ring, 1.0) is None
    assert chain.lost_turn_message(np.zeros_like(points), 1.0) == LOST


def test_a_grip_of_one_edge_or_of_a_separate_piece_holds_no_chain() -> None:
    points, cells, layers = bar(LAYERS)
    wall = RotationSupport(layers[0], (0.0, 0.0, 0.0))
    assert find_cell_chains(points, cells, [wall, RotationSupport(layers[-1][:2], (1.0, 0.0, 0.0))]) == ()
    apart = [wall, RotationSupport(layers[-1] + len(points), (1.0, 0.0, 0.0))]
    assert (
        find_cell_chains(np.concatenate([points, points + 2.0]), np.concatenate([cells, cells + len(points)]), apart)
        == ()
    )
