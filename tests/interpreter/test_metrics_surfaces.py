"""Metrics of surfaces, against distances that were worked out by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from softmark.interpreter.metrics.hausdorff import Hausdorff
from softmark.interpreter.metrics.measurement import MetricInput, ReferenceData
from softmark.interpreter.metrics.surface_distance import SurfaceDistance, summarize_relative_distances
from softmark.interpreter.metrics.target_surface import side_of_surface
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.references.surface_geometry import SurfaceSearch

# a cube of corners (0 or 1)^3, number 4 x + 2 y + z, its triangles counter-clockwise from outside
CORNERS = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
CUBE = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])


@dataclass(frozen=True)
class Scan:
    points: np.ndarray
    triangles: np.ndarray
    uncertainty: float = 0.0


def sphere(radius: float, turns: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """A sphere cut by meridians and parallels: points on the sphere, triangles outward."""
    rings = turns // 2
    theta, phi = np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(turns) / turns
    ring = [(math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)) for t in theta for p in phi]
    points = radius * np.array([*ring, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
    north, south, last = len(ring), len(ring) + 1, (rings - 2) * turns
    triangles = []
    for j in range(turns):
        k = (j + 1) % turns
        triangles += [(north, j, k), (south, last + k, last + j)]
        for i in range(0, last, turns):
            triangles += [(i + j, i + turns + j, i + turns + k), (i + j, i + turns + k, i + k)]
    return points, np.array(triangles)


def sagitta(radius: float, turns: int = 48) -> float:
    """How far a facet of such a sphere lies inside it at most: its corners are pi / turns off its middle, both ways."""
    return radius * (1.0 - math.cos(math.sqrt(2.0) * math.pi / turns))


def seen(X: Any, triangles: Any, scan: Scan | None, u: Any = None, known: ReferenceData | None = None) -> MetricInput:
    X = np.asarray(X, dtype=float)
    u = np.zeros_like(X) if u is None else np.asarray(u, dtype=float)
    none: Any = None
    return MetricInput("model", none, X, u, triangles, known=known or ReferenceData("scan", surface=scan))


def distance(*arguments: Any, **fields: Any) -> Any:
    return SurfaceDistance("skin", "scan", **fields).measure(seen(*arguments))


# ------------------------------------------------------------------ distances


@pytest.mark.parametrize("along", ["nearest", "normal"])
def test_concentric_spheres_are_the_difference_of_their_radii_apart(along: Any) -> None:
    inner, outer = sphere(1.0), sphere(1.25)
    # every facet of the outer sphere lies inside the sphere, by its sagitta at most: 0.0053 m. That leaves room for
    # the angle between normal and radius, which lengthens the way along a normal
    tolerance = sagitta(1.25)
    found = distance(*inner, Scan(*outer), along=along)
    assert 0.25 - tolerance <= found.value <= 0.25 + 1e-12
    assert found.details["bias_m"] == pytest.approx(-found.value, rel=1e-12)  # inside
    assert found.details["sd_m"] < tolerance
    outside = distance(*outer, Scan(*inner), along=along)
    assert 0.25 - 1e-12 <= outside.value <= 0.25 + sagitta(1.0)
    assert outside.details["bias_m"] == pytest.approx(outside.value, rel=1e-12)


def test_a_sphere_over_a_plane() -> None:
    # the points of a sphere of radius 1 m whose centre is 3 m above a plane: d_i = 3 + z_i, by symmetry 3 m on average;
    # nothing is rounded but sums
    points, triangles = sphere(1.0)
    plane = Scan(np.array([[-9.0, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    found = distance(points, triangles, plane, np.full_like(points, 3.0) * [0.0, 0.0, 1.0])
    assert found.value == pytest.approx(3.0, rel=1e-12)
    assert (found.details["max_m"], found.details["min_m"]) == pytest.approx((4.0, 2.0))
    assert found.details["sd_m"] == pytest.approx(points[:, 2].std(), rel=1e-9)
    assert found.details["bias_m"] == pytest.approx(3.0, rel=1e-12)  # on the side that the plane faces
    assert found.at_points == pytest.approx(3.0 + points[:, 2])


def test_normals_that_meet_nothing_are_left_out_and_counted() -> None:
    # only the two normals that point straight up and down meet a small plate 3 m below the centre of the sphere:
    # 2 m from the south pole outwards, 4 m from the north pole inwards. Those of the ring next to the poles are
    # 7.5 degrees off, and miss by 0.4 m
    points, triangles = sphere(1.0)
    plate = np.array([[-1.0, -1, -30], [1, -1, -30], [0, 2, -30]]) / 10.0
    scan = Scan(plate, np.array([[0, 1, 2]]))
    found = distance(points, triangles, scan, along="normal", reach=5.0)
    assert (found.details["points"], found.details["without_hit"]) == (2, len(points) - 2)
    assert found.value == pytest.approx(3.0)
    assert found.details["reach_m"] == 5.0
    assert found.at_points is None
    assert distance(points, triangles, scan, along="normal", reach=2.5).value == pytest.approx(2.0)
    with pytest.raises(Undefined, match="within the search distance"):
        distance(points, triangles, scan, along="normal", reach=1.0)


def test_shifted_cubes() -> None:
    # a cube shifted by 0.5 m along x: the four corners at x = 0.5 lie on the other's surface, those at x = 1.5 half a
    # metre off; of the unshifted cube, at x = 0, half a metre off as well
    shift = np.full((8, 3), 0.5) * [1.0, 0.0, 0.0]
    found = distance(CORNERS, CUBE, Scan(CORNERS, CUBE), shift)
    assert found.value == pytest.approx(0.25)
    assert found.details["sd_m"] == pytest.approx(0.25)  # 0 and 0.5 in equal number, over n
    assert found.details["rms_m"] == pytest.approx(math.sqrt(0.125))
    assert found.details["by_displacement_mean"] == pytest.approx(0.5)
    far = Hausdorff("skin", "scan").measure(seen(CORNERS, CUBE, Scan(CORNERS, CUBE), shift))
    assert far.value == pytest.approx(0.5)
    assert far.details == {
        "to_reference_m": pytest.approx(0.5),
        "to_model_m": pytest.approx(0.5),
        "reference_closed": True,
    }


@pytest.mark.parametrize(
    ("statistic", "value", "unit"),
    [
        ("mean", 0.25, "m"),
        ("sd", 0.25, "m"),
        ("max", 0.5, "m"),
        ("rms", math.sqrt(0.125), "m"),
    ],
)
def test_statistics_of_a_surface_distance(statistic: Any, value: float, unit: str) -> None:
    metric = SurfaceDistance("skin", "scan", statistic)
    shift = np.full((8, 3), 0.5) * [1.0, 0.0, 0.0]
    assert metric.measure(seen(CORNERS, CUBE, Scan(CORNERS, CUBE), shift)).value == pytest.approx(value)
    assert metric.unit == unit
    assert metric.uncertain is (statistic != "sd")


# ------------------------------------------------------------------ the authors' relative error


def test_relative_error_as_the_authors_define_it() -> None:
    # Four points of a model over the plane z = 1. They stood at z = 0, -1, -3 and 0 and came to 1, 1.5, 0.6 and 1.2.
    # Their feet are straight above or below them at z = 1, so they went 1, 2, 4 and 1 m; without the motion of the
    # first, d0 = 0, 1, 3 and 0 m. Only the second and the third have a ratio: 0.5 / 1 and 0.4 / 3
    plane = Scan(np.array([[-9.0, -9, 1], [9, -9, 1], [9, 9, 1], [-9, 9, 1]]), np.array([[0, 1, 2], [0, 2, 3]]))
    X = np.array([[0.0, 0, 0], [1, 0, -1], [2, 0, -3], [3, 0, 0]])
    u = np.array([[0.0, 0, 1], [0, 0, 2.5], [0, 0, 3.6], [0, 0, 1.2]])
    found = distance(X, None, plane, u, statistic="relative_mean")
    first, second = 0.5, 0.4 / 3
    assert found.value == pytest.approx((first + second) / 2)
    assert found.details["relative_sd"] == pytest.approx((first - second) / 2)  # of two values, over n = 2
    assert (found.details["relative_points"], found.details["relative_offset_m"]) == (2, 1.0)
    assert found.details["mean_m"] == pytest.approx((0.0 + 0.5 + 0.4 + 0.2) / 4)
    # by its own displacement in the model each of the four has one: 0, 0.5 / 2.5, 0.4 / 3.6 and 0.2 / 1.2
    own = (0.0 + 0.2 + 0.4 / 3.6 + 0.2 / 1.2) / 4
    assert found.details["by_displacement_mean"] == pytest.approx(own)
    spread = distance(X, None, plane, u, statistic="relative_sd")
    assert spread.value == found.details["relative_sd"]
    assert SurfaceDistance("skin", "scan", "relative_sd").unit == "1"


def test_relative_error_does_not_depend_on_the_order_of_points() -> None:
    # the offset is that of the point which moves least, wherever it stands: as the one above, in another order
    X = np.array([[1.0, 0, -1], [0, 0, 0], [2, 0, -3]])
    u = np.array([[0.0, 0, 2.5], [0, 0, 1], [0, 0, 3.6]])
    foot = np.array([[1.0, 0, 1], [0, 0, 1], [2, 0, 1]])
    found = summarize_relative_distances(np.array([0.5, 0.0, 0.4]), X, u, foot)
    assert found["relative_mean"] == pytest.approx((0.5 + 0.4 / 3) / 2)
    assert found["relative_offset_m"] == 1.0


def test_what_moved_no_more_than_a_micrometre_is_left_out() -> None:
    X = np.zeros((3, 3))
    foot = np.array([[0.0, 0, 0], [0.9e-6, 0, 0], [1.1e-6, 0, 0]])
    assert summarize_relative_distances(np.ones(3), X, X, foot)["relative_points"] == 1
    assert summarize_relative_distances(np.ones(2), X[:2], X[:2], foot[:2]) == {
        "relative_points": 0,
        "relative_offset_m": 0.0,
    }
    plane = Scan(CORNERS, CUBE)
    with pytest.raises(Undefined, match="no point moves"):
        distance(CORNERS, CUBE, plane, statistic="relative_mean")


# ------------------------------------------------------------------ what is measured to


def test_a_field_of_displacements_deforms_the_surface_of_the_probe() -> None:
    # the reference moves the cube by 0.5 m along x, the model does not move: half the corners are 0.5 m off
    known = ReferenceData("theory", u=np.full((8, 3), 0.5) * [1.0, 0.0, 0.0])
    found = SurfaceDistance("skin", "theory").measure(seen(CORNERS, CUBE, None, known=known))
    assert found.value == pytest.approx(0.25)
    with pytest.raises(Undefined, match="not a surface of triangles"):
        SurfaceDistance("line", "theory").measure(seen(CORNERS, None, None, known=known))
    with pytest.raises(Undefined, match="neither"):
        SurfaceDistance("line", "theory").measure(seen(CORNERS, CUBE, None, known=ReferenceData("theory")))
    with pytest.raises(Undefined, match="normals need"):
        distance(CORNERS, None, Scan(CORNERS, CUBE), along="normal")


def test_an_open_surface_is_named_in_the_other_direction() -> None:
    # a cube in a tube of the same cross-section, 3 m long and open at both ends: every corner of the cube lies in the
    # wall of the tube, whose far ends are 1 m away from the cube
    tube = CORNERS * [1.0, 1.0, 3.0] - [0.0, 0.0, 1.0]
    walls = np.array([t for t in CUBE if len({round(float(z), 9) for z in tube[t][:, 2]}) == 2])
    assert len(walls) == 8
    found = Hausdorff("skin", "scan").measure(seen(CORNERS, CUBE, Scan(tube, walls)))
    assert (found.details["to_reference_m"], found.details["to_model_m"]) == pytest.approx((0.0, 1.0))
    assert found.value == pytest.approx(1.0)
    assert found.details["reference_closed"] is False
    assert "open" in found.details["note"]
    with pytest.raises(Undefined, match="surface probe"):
        Hausdorff("axis", "scan").measure(seen(CORNERS, None, Scan(tube, walls)))


# ------------------------------------------------------------------ inside and outside


def test_the_side_is_right_at_faces_edges_and_corners() -> None:
    target = SurfaceSearch(CORNERS, CUBE)
    x = np.array([
        [0.5, 0.4, 1.2], [0.5, 0.4, 0.9],  # over a face and under it
        [0.5, 1.1, 1.1], [1.1, 1.2, 1.3],  # beyond an edge and beyond a corner
        [0.5, 0.5, 1.1], [0.6, 0.6, -0.1],  # over a diagonal of a face
    ])  # fmt: skip
    assert side_of_surface(x, target.closest(x), target).tolist() == [1.0, -1.0, 1.0, 1.0, 1.0, 1.0]


def test_the_side_is_right_around_a_sharp_spike() -> None:
    # a thin spike: near its tip the normal of the nearest face alone, or their plain sum, tells many points wrongly.
    # Inside is what lies below the tip and within the four slanted faces
    points = np.array([[1.0, 0, 0], [0, 0.05, 0], [-1, 0, 0], [0, -0.05, 0], [0, 0, 4]])
    triangles = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 3, 2], [0, 2, 1]])
    x = np.random.default_rng(3).uniform([-1, -0.2, -0.5], [1, 0.2, 5], (4000, 3))
    within = (np.abs(x[:, 0]) + np.abs(x[:, 1]) / 0.05 < 1 - x[:, 2] / 4) & (x[:, 2] > 0)
    assert within.any()
    target = SurfaceSearch(points, triangles)
    assert np.array_equal(side_of_surface(x, target.closest(x), target) < 0, within)
