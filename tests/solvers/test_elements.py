"""Laws that every element obeys, asserted over the registry, and places of points in a mesh."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softmark.solvers.elements import ELEMENTS
from softmark.solvers.elements.interpolation import integration, locate
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box, Cylinder

EVERY = pytest.mark.parametrize("element", ELEMENTS.values(), ids=ELEMENTS)
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def points_within(count: int = 50) -> np.ndarray:
    """Local points xi (n, 3) of the unit tetrahedron."""
    return np.random.default_rng(1).dirichlet(np.ones(4), count)[:, 1:]


def tetrahedra(count: int = 40) -> Mesh:
    """Cells of any shape, none flat, that share no points."""
    rng = np.random.default_rng(2)
    points = np.concatenate([CORNERS @ rng.normal(size=(3, 3)) + rng.normal(size=3) for _ in range(count)])
    cells = np.arange(4 * count).reshape(count, 4)
    flipped = Mesh(points, cells).volumes < 0
    cells[flipped, 2:] = cells[flipped, :1:-1]
    return Mesh(points, cells)


@EVERY
def test_shape_functions_are_a_partition_of_unity(element: type[Tet4]) -> None:
    xi = points_within()
    np.testing.assert_allclose(element.shape(xi).sum(axis=1), 1.0, rtol=1e-15)
    np.testing.assert_allclose(element.gradient(xi).sum(axis=1), 0.0, atol=1e-15)


@EVERY
def test_gradient_is_the_derivative_of_the_shape_functions(element: type[Tet4]) -> None:
    """Central differences are exact for polynomials up to degree two; round-off is 1e-16/1e-5."""
    xi, step = points_within(), 1e-5
    differences = [
        (element.shape(xi + step * e) - element.shape(xi - step * e)) / (2 * step) for e in np.eye(3)
    ]
    np.testing.assert_allclose(element.gradient(xi), np.stack(differences, axis=2), atol=1e-10)


def test_linear_shape_functions_are_one_at_their_node() -> None:
    np.testing.assert_array_equal(Tet4.shape(CORNERS), np.eye(4))


@EVERY
def test_linear_fields_are_reproduced(element: type[Tet4]) -> None:
    """sum_a x_a dN_a/dX = A for x = A X + b, whatever the cell; round-off of badly shaped cells."""
    mesh = tetrahedra()
    A, b = np.random.default_rng(3).normal(size=(3, 3)), np.array([1.0, -2.0, 3.0])
    x = mesh.points @ A.T + b
    gradient = np.einsum("mai,mqaj->mqij", x[mesh.cells], integration(mesh, element).dNdX)
    np.testing.assert_allclose(gradient, np.broadcast_to(A, gradient.shape), atol=1e-11)


@EVERY
def test_quadrature_integrates_the_products_it_must(element: type[Tet4]) -> None:
    """Over the unit tetrahedron the integral of xi^a eta^b zeta^c is a! b! c!/(a + b + c + 3)!."""
    xi, w = element.quadrature()
    for powers in np.ndindex(*[element.order + 1] * 3):
        if sum(powers) <= element.order:
            exact = math.prod(math.factorial(p) for p in powers) / math.factorial(sum(powers) + 3)
            assert w @ np.prod(xi ** np.array(powers), axis=1) == pytest.approx(exact, rel=1e-15)


@EVERY
def test_weights_add_up_to_the_volume(element: type[Tet4]) -> None:
    mesh = tetrahedra()
    np.testing.assert_allclose(integration(mesh, element).w.sum(axis=1), mesh.volumes, rtol=1e-12)


def test_gradients_of_a_tetrahedron_are_its_face_normals() -> None:
    """dN_a/dX = -(area vector of the opposite face)/(3 V), from geometry alone."""
    mesh = tetrahedra()
    dNdX = integration(mesh, Tet4).dNdX[:, 0]
    p = mesh.points[mesh.cells]
    opposite = np.cross(p[:, 2] - p[:, 1], p[:, 3] - p[:, 1]) / 2  # of node 0, outward
    np.testing.assert_allclose(dNdX[:, 0], -opposite / (3 * mesh.volumes[:, None]), rtol=1e-10, atol=1e-12)


# ------------------------------------------------------------------ where points lie

BAR = Box((0.2, 0.04, 0.06)).mesh(0.02)


def linear(X: np.ndarray) -> np.ndarray:
    return X @ np.array([[1.0, 2.0, -1.0], [0.5, 0.0, 3.0], [-2.0, 1.0, 1.0]]) + [1.0, 2.0, 3.0]


def test_interpolation_reproduces_a_linear_field_everywhere_within() -> None:
    X = np.random.default_rng(4).uniform((0, 0, 0), (0.2, 0.04, 0.06), (200, 3))
    place = locate(BAR, X)
    np.testing.assert_allclose(place.interpolate(linear(BAR.points)), linear(X), atol=1e-13)
    np.testing.assert_array_equal(place.outside, 0.0)
    assert place.N.min() > -1e-12


def test_a_mesh_point_gets_its_own_value() -> None:
    values = np.random.default_rng(5).normal(size=BAR.points.shape)
    place = locate(BAR, BAR.points)
    np.testing.assert_allclose(place.interpolate(values), values, atol=1e-12)
    np.testing.assert_array_equal(place.outside, 0.0)  # round-off on a face is not outside


@pytest.mark.parametrize("distance", [1e-6, 1e-3, 0.1])
def test_a_point_beyond_a_face_is_outside_by_about_its_distance(distance: float) -> None:
    """By the planes of one cell, which may touch the face with an edge only; linear fields go on beyond."""
    X = np.array([[0.1, 0.02, 0.06 + distance], [0.1, -distance, 0.03], [0.2 + distance, 0.02, 0.03]])
    place = locate(BAR, X)
    assert np.all((place.outside > 0.3 * distance) & (place.outside < 1.001 * distance))
    np.testing.assert_allclose(place.interpolate(linear(BAR.points)), linear(X), atol=1e-12)


def test_points_between_an_inscribed_mesh_and_its_cylinder_are_outside_by_the_sagitta() -> None:
    """About R (1 - cos(pi/N)), N points on the rim; none on the rim's own points."""
    cylinder = Cylinder(0.178, 0.019)
    mesh = cylinder.mesh(0.012)
    turn = np.pi / 8 * np.arange(16)  # points and middles of edges: two edges on a quarter
    X = np.stack([np.full(16, 0.0701), 0.019 * np.cos(turn), 0.019 * np.sin(turn)], axis=1)
    outside = np.sort(locate(mesh, X).outside)
    sagitta = 0.019 * (1 - math.cos(math.pi / 8))
    np.testing.assert_array_equal(outside[:8], 0.0)
    assert np.all((outside[8:] > 0.5 * sagitta) & (outside[8:] < 1.5 * sagitta))


def test_no_points_are_located_as_none() -> None:
    place = locate(BAR, np.zeros((0, 3)))
    assert place.interpolate(BAR.points).shape == (0, 3)
    assert len(place.outside) == 0
