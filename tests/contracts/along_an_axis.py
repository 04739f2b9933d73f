"""What every body of one section along an axis keeps, and its section."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from softmark.solvers.mesh.shape import Section, Swept


def check_swept(shape: Swept) -> None:
    """Its section along its axis is what it says of itself; bounds between two stations hold it, and no more."""
    section, slack = shape.section, 1e-9 * shape.length
    assert np.isclose(shape.volume, section.area * shape.length, rtol=1e-12)
    np.testing.assert_allclose(shape.centre(0.0), shape.root, atol=slack)
    np.testing.assert_allclose(shape.frame(0.0)[0], shape.axis, atol=1e-12)
    for first, last in ((0.0, 1.0), (0.2, 0.3), (0.6, 0.95)):
        stations = np.linspace(first, last, 61) * shape.length
        found = np.array([_section_at(shape, s) for s in stations.tolist()])  # (61, k, 3)
        low, high = (np.array(end) for end in shape.bounds_between(stations[0], stations[-1]))
        np.testing.assert_array_less(low - slack, found.min(axis=(0, 1)))
        np.testing.assert_array_less(found.max(axis=(0, 1)), high + slack)
        np.testing.assert_allclose(found.min(axis=(0, 1)), low, atol=1e-3 * shape.length)
        np.testing.assert_allclose(found.max(axis=(0, 1)), high, atol=1e-3 * shape.length)
        s, u, v = shape.coordinates(found.reshape(-1, 3))
        np.testing.assert_allclose(
            s.reshape(found.shape[:2]), np.repeat(stations[:, None], found.shape[1], 1), atol=slack
        )
        assert section.outside(u, v) == pytest.approx(0.0, abs=slack)
        own = [shape.section_coordinates(tuple(place)) for place in found[::6, 0].tolist()]
        np.testing.assert_allclose(np.stack(shape.coordinates(found[::6, 0]), axis=1), own, atol=slack)
    for s in (0.0, 0.3, 1.0):  # a frame is one, and along the axis
        t, e, f = (np.array(way) for way in shape.frame(s * shape.length))
        np.testing.assert_allclose(np.array([t, e, f]) @ np.array([t, e, f]).T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(np.cross(e, f), t, atol=1e-12)
        step = 1e-5 * shape.length
        way = np.array(shape.centre(s * shape.length + step)) - np.array(shape.centre(s * shape.length - step))
        np.testing.assert_allclose(way / (2.0 * step), t, atol=1e-9)
    inside = [tuple(_section_at(shape, s * shape.length)[0]) for s in (-0.1, 0.0, 0.5, 1.0, 1.1)]
    assert [shape.contains(point) for point in inside] == [False, True, True, True, False]
    _check_section(section)


def _section_at(shape: Swept, station: float) -> Any:
    """Its samples and points of its border (k, 3), m."""
    _, first, second = (np.array(way) for way in shape.frame(station))
    places = np.concatenate([shape.section.samples(), shape.section.outline(64)])
    return np.array(shape.centre(station)) + places @ np.array([first, second])


def _check_section(section: Section) -> None:
    """What a section says of its measures is so of its border."""
    ways = np.array([[math.cos(t), math.sin(t)] for t in np.linspace(0.0, 6.0, 13)])
    most = (section.outline(256) @ ways.T).max(axis=0)
    assert [section.support(*way) for way in ways.tolist()] == pytest.approx(most, rel=1e-3)
    outline = section.outline(256)
    assert np.ptp(outline, axis=0) == pytest.approx(section.extents, rel=1e-3)
    assert section.outside(*outline.T) == pytest.approx(0.0, abs=1e-12)
    assert np.all(section.outside(*(1.01 * outline).T) > 0.0)
    assert all(section.contains(u, v, 1e-12) for u, v in section.samples())
    assert not any(section.contains(u, v, 0.0) for u, v in 1.01 * outline)
    hole = section.hole(256)
    if hole is not None:
        assert len(hole) == len(outline)
        assert not any(section.contains(u, v, 0.0) for u, v in 0.99 * hole)
    borders = np.array(_of_polygon(outline)) - (0.0 if hole is None else np.array(_of_polygon(hole)))
    # a circle's area falls short of it by (2 pi / 256)^2 / 6 = 1e-4, its moments by twice that
    assert borders == pytest.approx([section.area, *section.moments], rel=1e-3)
    assert 0.5 < section.shear_factor(0.3) < 1.0
    assert 0.0 < section.torsion <= sum(section.moments) * (1.0 + 1e-12), "no section is stiffer than round ones"


def _of_polygon(X: Any) -> tuple[float, float, float]:
    """Area and second moments about the first and the second axis of a polygon (k, 2), counter-clockwise (Green)."""
    (u, v), (s, t) = X.T, np.roll(X, -1, axis=0).T
    w = u * t - s * v
    return float(w.sum()) / 2, float(w @ (v * v + v * t + t * t)) / 12, float(w @ (u * u + u * s + s * s)) / 12
