"""Laws that every element obeys, asserted over the registry, and places of points in a mesh."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from softmark.solvers.elements import CELLS, ELEMENTS
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.elements.element import Element, Facet
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.mesh import bounding_box_search, element_interpolation
from softmark.solvers.mesh.bounding_box_search import find_boxes_of_points
from softmark.solvers.mesh.element_interpolation import integrate_cells, locate_points
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box, Cylinder

EVERY = pytest.mark.parametrize("element", CELLS.values(), ids=[*CELLS])
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def points_within(element: type[Element], count: int = 50) -> np.ndarray:
    """Local points xi (n, 3) of the reference cell."""
    rng = np.random.default_rng(1)
    if element.family == "hexahedra":
        return rng.uniform(-1, 1, (count, 3))
    if element.family == "wedges":
        return element.random_points(rng, count)
    return rng.dirichlet(np.ones(4), count)[:, 1:]


def loose(kind: str, count: int = 40) -> Mesh:
    """Cells of any shape, none flat, that share no points: affine images, then every node moved a little."""
    element, rng, made = CELLS[kind], np.random.default_rng(4), []
    while len(made) < count:
        A = rng.normal(size=(3, 3))
        if np.linalg.det(A) > 0.2:
            noise = 0.02 * rng.uniform(-1, 1, (element.nodes, 3))
            made.append((element.places() + noise) @ A + rng.normal(size=3))
    return Mesh(np.concatenate(made), np.arange(count * element.nodes).reshape(count, -1), kind)


def tetrahedra(count: int = 40) -> Mesh:
    """Cells of any shape, none flat, that share no points."""
    rng = np.random.default_rng(2)
    points = np.concatenate([CORNERS @ rng.normal(size=(3, 3)) + rng.normal(size=3) for _ in range(count)])
    cells = np.arange(4 * count).reshape(count, 4)
    flipped = Mesh(points, cells).volumes < 0
    cells[flipped, 2:] = cells[flipped, :1:-1]
    return Mesh(points, cells)


@EVERY
def test_shape_functions_are_a_partition_of_unity(element: type[Element]) -> None:
    xi = points_within(element)
    np.testing.assert_allclose(element.shape(xi).sum(axis=1), 1.0, rtol=2e-15)
    np.testing.assert_allclose(element.gradient(xi).sum(axis=1), 0.0, atol=4e-15)


@EVERY
def test_gradient_is_the_derivative_of_the_shape_functions(element: type[Element]) -> None:
    """Central differences are exact for polynomials up to degree two; round-off is 1e-16/1e-5."""
    xi, step = points_within(element), 1e-5
    differences = [(element.shape(xi + step * e) - element.shape(xi - step * e)) / (2 * step) for e in np.eye(3)]
    np.testing.assert_allclose(element.gradient(xi), np.stack(differences, axis=2), atol=1e-10)


@EVERY
def test_shape_functions_are_one_at_their_node(element: type[Element]) -> None:
    np.testing.assert_allclose(element.shape(element.places()), np.eye(element.nodes), atol=1e-15)


@EVERY
def test_facets_are_those_of_the_reference_cell_seen_from_outside(element: type[Element]) -> None:
    """Divergence theorem on the reference cell: a third of the flux of xi through the facets is its volume."""
    places, (xi, w) = element.places(), element.facet.quadrature()
    N, dN = element.facet.shape(xi), element.facet.gradient(xi)
    total = 0.0
    for facet in element.facets:
        x = places[list(facet)]
        area = np.cross(*np.einsum("qaj,ai->jqi", dN, x))
        total += float(np.einsum("q,qi,qi->", w, N @ x, area)) / 3
    assert total == pytest.approx(element.volume, rel=1e-14)


@pytest.mark.parametrize("facet", FACETS.values(), ids=FACETS)
def test_facets_are_a_partition_of_unity(facet: type[Facet]) -> None:
    """Sums 1 and 0; the gradient against central differences, exact for polynomials of degree two."""
    xi, step = np.random.default_rng(1).uniform(0.0, 0.5, (16, 2)), 1e-5
    np.testing.assert_allclose(facet.shape(xi).sum(axis=1), 1.0, rtol=2e-15)
    parts = [(facet.shape(xi + step * e) - facet.shape(xi - step * e)) / (2 * step) for e in np.eye(2)]
    np.testing.assert_allclose(facet.gradient(xi), np.stack(parts, axis=2), atol=1e-10)


@EVERY
def test_clipping_leaves_points_within_and_moves_others_in(element: type[Element]) -> None:
    xi = points_within(element)
    np.testing.assert_allclose(element.clip(xi), xi, atol=1e-15)
    moved = element.clip(3 * xi + 1)
    np.testing.assert_allclose(element.clip(moved), moved, atol=1e-15)


@EVERY
def test_linear_fields_are_reproduced(element: type[Element]) -> None:
    """sum_a x_a dN_a/dX = A for x = A X + b, whatever the cell; round-off of badly shaped cells."""
    mesh = loose(_kind(element))
    A, b = np.random.default_rng(3).normal(size=(3, 3)), np.array([1.0, -2.0, 3.0])
    x = mesh.points @ A.T + b
    gradient = np.einsum("mai,mqaj->mqij", x[mesh.cells], integrate_cells(mesh).dNdX)
    np.testing.assert_allclose(gradient, np.broadcast_to(A, gradient.shape), atol=1e-11)


@EVERY
def test_quadrature_integrates_the_products_it_must(element: type[Element]) -> None:
    """Over the unit tetrahedron the integral of xi^a eta^b zeta^c is a! b! c!/(a + b + c + 3)!, up to its order.

    Over the cube it is 8/((a + 1)(b + 1)(c + 1)) for even powers and 0 for odd ones, each up to three. Over the wedge
    2 a! b!/(a + b + 2)!/(c + 1) for even c, up to three.
    """
    xi, w = element.quadrature()
    cube = element.family == "hexahedra"
    for powers in np.ndindex(*[4 if cube else element.order + 1] * 2, element.order + 1 if element.corners == 4 else 4):
        if cube:
            exact = math.prod(2 / (p + 1) if p % 2 == 0 else 0.0 for p in powers)
        elif element.family == "wedges":
            a, b, c = powers
            if a + b > element.order:
                continue
            flat = math.factorial(a) * math.factorial(b) / math.factorial(a + b + 2)
            exact = 0.0 if c % 2 else 2 * flat / (c + 1)
        elif sum(powers) <= element.order:
            exact = math.prod(math.factorial(p) for p in powers) / math.factorial(sum(powers) + 3)
        else:
            continue
        assert w @ np.prod(xi ** np.array(powers), axis=1) == pytest.approx(exact, rel=1e-14, abs=1e-15)


@EVERY
def test_weights_add_up_to_the_volume(element: type[Element]) -> None:
    mesh = loose(_kind(element))
    np.testing.assert_allclose(integrate_cells(mesh).w.sum(axis=1), mesh.volumes, rtol=1e-12)


def _kind(element: type[Element]) -> str:
    return next(kind for kind, known in CELLS.items() if known is element)


def test_gradients_of_a_tetrahedron_are_its_face_normals() -> None:
    """dN_a/dX = -(area vector of the opposite face)/(3 V), from geometry alone."""
    mesh = tetrahedra()
    dNdX = integrate_cells(mesh, Tet4).dNdX[:, 0]
    p = mesh.points[mesh.cells]
    opposite = np.cross(p[:, 2] - p[:, 1], p[:, 3] - p[:, 1]) / 2  # of node 0, outward
    np.testing.assert_allclose(dNdX[:, 0], -opposite / (3 * mesh.volumes[:, None]), rtol=1e-10, atol=1e-12)


# ------------------------------------------------------------------ where points lie

# How far shape functions go below zero: -1/8 in a coordinate; of serendipity (1 + t)^3 (3 t - 2) / 8 at t = 1/4.
DIPS = {"tet10": -0.126, "hex20": -0.3052, "hex27": -0.126}
BARS = {kind: Box((0.2, 0.04, 0.06)).mesh(kind, 0.02) for kind in ELEMENTS}
ON = pytest.mark.parametrize("kind", BARS)


def linear(X: np.ndarray) -> np.ndarray:
    return X @ np.array([[1.0, 2.0, -1.0], [0.5, 0.0, 3.0], [-2.0, 1.0, 1.0]]) + [1.0, 2.0, 3.0]


@ON
def test_interpolation_reproduces_a_linear_field_everywhere_within(kind: str) -> None:
    X = np.random.default_rng(4).uniform((0, 0, 0), (0.2, 0.04, 0.06), (200, 3))
    bar = BARS[kind]
    place = locate_points(bar, X)
    np.testing.assert_allclose(place.interpolate(linear(bar.points)), linear(X), atol=1e-13)
    np.testing.assert_array_equal(place.outside, 0.0)
    assert place.N.min() > DIPS.get(kind, -1e-12)


def test_points_are_held_against_the_cells_around_them_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those within are found by boxes in a grid: time and memory went with points times cells."""
    asked = []
    every = element_interpolation._nearest_boxes

    def counted(low: Any, high: Any, X: Any, count: int) -> Any:
        asked.append(len(X))
        return every(low, high, X, count)

    monkeypatch.setattr(element_interpolation, "_nearest_boxes", counted)
    X = np.random.default_rng(6).uniform((0, 0, 0), (0.2, 0.04, 0.06), (100, 3))
    X[7] = (0.3, 0.02, 0.03)
    place = locate_points(BARS["tet10"], X)
    assert asked == [1]
    assert place.outside[7] == pytest.approx(0.1, rel=0.3)
    np.testing.assert_array_equal(np.delete(place.outside, 7), 0.0)
    np.testing.assert_allclose(place.interpolate(linear(BARS["tet10"].points)), linear(X), atol=1e-12)


@ON
def test_a_mesh_point_gets_its_own_value(kind: str) -> None:
    bar = BARS[kind]
    values = np.random.default_rng(5).normal(size=bar.points.shape)
    place = locate_points(bar, bar.points)
    np.testing.assert_allclose(place.interpolate(values), values, atol=1e-12)
    np.testing.assert_array_equal(place.outside, 0.0)  # round-off on a face is not outside


@ON
@pytest.mark.parametrize("distance", [1e-6, 1e-3, 0.1])
def test_a_point_beyond_a_face_is_outside_by_about_its_distance(kind: str, distance: float) -> None:
    """By the planes of one cell, which may touch the face with an edge only; linear fields go on beyond.

    In cells with curved faces it is the distance to a point of the cell near the nearest one: a little more.
    """
    X = np.array([[0.1, 0.02, 0.06 + distance], [0.1, -distance, 0.03], [0.2 + distance, 0.02, 0.03]])
    bar = BARS[kind]
    place = locate_points(bar, X)
    assert np.all((place.outside > 0.3 * distance) & (place.outside < (1.3 if kind == "tet10" else 1.001) * distance))
    np.testing.assert_allclose(place.interpolate(linear(bar.points)), linear(X), atol=1e-12)


@pytest.mark.parametrize("kind", ["tet4", "hex8"])
def test_points_between_an_inscribed_mesh_and_its_cylinder_are_outside_by_the_sagitta(kind: str) -> None:
    """About R (1 - cos(pi/N)), N points on the rim; none on the rim's own points."""
    cylinder = Cylinder(0.178, 0.019)
    mesh = cylinder.mesh(kind, 0.012)
    turn = np.pi / 8 * np.arange(16)  # points and middles of edges: two edges on a quarter
    X = np.stack([np.full(16, 0.0701), 0.019 * np.cos(turn), 0.019 * np.sin(turn)], axis=1)
    outside = np.sort(locate_points(mesh, X).outside)
    sagitta = 0.019 * (1 - math.cos(math.pi / 8))
    np.testing.assert_array_equal(outside[:8], 0.0)
    assert np.all((outside[8:] > 0.5 * sagitta) & (outside[8:] < 1.5 * sagitta))


def test_curved_cells_hold_the_points_of_their_cylinder() -> None:
    """Surfaces of second degree instead of a cylinder.

    With h = 22.5 degrees, half an edge, a parabola through three points of the circle is off by
    1 - sqrt((1 - (1 - cos h)/4)^2 + sin(h)^2/4) = 5.4e-4 of the radius at a quarter of the edge.
    """
    mesh = Cylinder(0.178, 0.019).mesh("tet10", 0.012)
    turn = np.pi / 16 * np.arange(32)
    X = np.stack([np.full(32, 0.0701), 0.019 * np.cos(turn), 0.019 * np.sin(turn)], axis=1)
    place = locate_points(mesh, X)
    assert 0 < place.outside.max() < 1.5 * 5.4e-4 * 0.019  # the edges across a facet are longer
    np.testing.assert_allclose(place.interpolate(linear(mesh.points)), linear(X), atol=1e-12)


def test_points_of_distorted_hexahedra_are_found() -> None:
    """Points made from known local coordinates come back to the same place: Newton's method to round-off."""
    mesh = Box((1.0, 1.0, 1.0)).mesh("hex8", 0.25)
    inner = np.all((mesh.points > 0.01) & (mesh.points < 0.99), axis=1)
    points = mesh.points + inner[:, None] * np.random.default_rng(6).uniform(-0.06, 0.06, mesh.points.shape)
    bent = Mesh(points, mesh.cells, "hex8")
    N = ELEMENTS["hex8"].shape(points_within(ELEMENTS["hex8"], len(mesh.cells)))
    X = np.einsum("ma,mai->mi", N, bent.points[bent.cells])
    place = locate_points(bent, X)
    np.testing.assert_array_equal(place.outside, 0.0)
    np.testing.assert_allclose(place.interpolate(bent.points), X, atol=1e-13)
    values = np.random.default_rng(7).normal(size=mesh.points.shape)
    own = np.einsum("ma,mai->mi", N, values[bent.cells])
    np.testing.assert_allclose(place.interpolate(values), own, atol=1e-11)


@ON
def test_no_points_are_located_as_none(kind: str) -> None:
    place = locate_points(BARS[kind], np.zeros((0, 3)))
    assert place.interpolate(BARS[kind].points).shape == (0, 3)
    assert len(place.outside) == 0


def to_cells(mesh: Mesh, X: np.ndarray) -> np.ndarray:
    """Distances (n, m) of points from tetrahedra, as the constrained least squares problems that they are.

    min |sum_a N_a x_a - X| with N >= 0 and sum N = 1, a row of weight 1e4 edge lengths: off by about 1e-8 of them.
    """
    found = np.empty((len(X), len(mesh.cells)))
    for i, cell in enumerate(mesh.cells):
        A = np.vstack([mesh.points[cell].T - mesh.points[cell[0]][:, None], np.full(4, 1e3)])
        for j, x in enumerate(X):
            N, _ = nnls(A, np.append(x - mesh.points[cell[0]], 1e3))
            found[j, i] = np.linalg.norm(N / N.sum() @ mesh.points[cell] - x)
    return found


def test_points_outside_are_given_to_the_nearest_cell() -> None:
    """By distances to all cells; cells of very different shapes, where barycentric coordinates misjudge."""
    mesh = Cylinder(0.06, 0.019).mesh("tet4", 0.012)
    mesh = Mesh(mesh.points * [1.0, 1.0, 0.2], mesh.cells)
    rng = np.random.default_rng(3)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    X = rng.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), (60, 3))
    place, distances = locate_points(mesh, X), to_cells(mesh, X)
    assert 10 < np.sum(place.outside > 0) < 60
    order = {tuple(cell): i for i, cell in enumerate(mesh.cells)}
    given = np.array([order[tuple(nodes)] for nodes in place.nodes])
    assert np.all(distances[np.arange(60), given] <= distances.min(axis=1) + 1e-7 * mesh.extent)
    np.testing.assert_allclose(place.interpolate(linear(mesh.points)), linear(X), atol=1e-12)


@pytest.mark.slow
def test_points_on_faces_edges_and_corners_have_the_values_that_any_cell_there_gives() -> None:
    """Against a search through all cells, of a continuous field: on a face either cell may answer; and outside."""
    mesh = Cylinder(0.06, 0.019).mesh("tet4", 0.008)
    corners = mesh.points[mesh.cells]
    inside = np.einsum("ma,mai->mi", np.random.default_rng(8).dirichlet(np.ones(4), len(corners)), corners)
    X = np.concatenate([inside, corners[:, :3].mean(axis=1), corners[:, :2].mean(axis=1), mesh.points])
    values = np.random.default_rng(9).normal(size=mesh.points.shape)
    edges = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    xi = np.einsum("mij,nmj->nmi", edges, X[:, None] - corners[:, 0])
    N = np.concatenate([1.0 - xi.sum(axis=2, keepdims=True), xi], axis=2)
    best = N.min(axis=2).argmax(axis=1)
    due = np.einsum("na,nai->ni", N[np.arange(len(X)), best], values[mesh.cells[best]])
    place = locate_points(mesh, np.concatenate([X, 1.1 * inside]))
    np.testing.assert_allclose(place.interpolate(values)[: len(X)], due, atol=1e-9)
    np.testing.assert_array_equal(place.outside[: len(X)], 0.0)
    assert place.outside.max() > 1e-3


def test_a_grid_finds_the_boxes_that_hold_a_point() -> None:
    """What every point and every box says; boxes of sizes over five decades, one as large as all, flat ones; rims."""
    rng = np.random.default_rng(8)
    low = rng.uniform(0.0, 1.0, (400, 3))
    high = low + rng.uniform(0.0, 1.0, (400, 3)) * 10.0 ** rng.uniform(-5.0, -0.5, (400, 1))
    high[:20, 2] = low[:20, 2]
    low[20], high[20] = 0.0, 1.0
    X = np.concatenate([rng.uniform(-0.5, 1.5, (300, 3)), low[:100], high[:100], 0.5 * (low + high)])
    for count in (400, 1):
        held = ((X[:, None] >= low[:count]) & (X[:, None] <= high[:count])).all(axis=2)
        which, box = find_boxes_of_points(low[:count], high[:count], X)
        order = np.lexsort((box, which))
        np.testing.assert_array_equal(np.stack([which[order], box[order]]), np.stack(np.nonzero(held)))
    assert len(find_boxes_of_points(low, high, X[:0])[0]) == 0


def test_a_grid_looks_at_few_boxes_however_many_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many for a point where there are eight times as many cells, all of which were looked at once."""
    looked: list[Any] = []
    runs = bounding_box_search._expand_ranges

    def counted(*arguments: Any) -> Any:
        looked.append(runs(*arguments))
        return looked[-1]

    monkeypatch.setattr(bounding_box_search, "_expand_ranges", counted)
    for size in (0.008, 0.004):
        mesh = Cylinder(0.06, 0.019).mesh("tet4", size)
        X = mesh.points[mesh.cells].mean(axis=1)
        looked.clear()
        np.testing.assert_array_equal(locate_points(mesh, X).nodes, mesh.cells)
        lists, pairs = (len(found[0]) for found in looked)
        assert lists < bounding_box_search.MOST * len(mesh.cells)
        assert pairs < 150 * len(X)


def test_points_that_are_asked_for_again_are_not_looked_for_again() -> None:
    """A probe's own points are asked for some thirty times a run; others, and changed ones, are looked for."""
    mesh = Box((1.0, 1.0, 1.0)).mesh("tet10", 0.5)
    X = np.random.default_rng(0).uniform(0.1, 0.9, (20, 3))
    first = locate_points(mesh, X)
    assert locate_points(mesh, X.copy()) is first
    X[0, 0] += 0.01
    again = locate_points(mesh, X)
    assert again is not first
    np.testing.assert_allclose(again.interpolate(mesh.points), X, atol=1e-12)
