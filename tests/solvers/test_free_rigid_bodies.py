"""Free rigid bodies: their mass against closed forms, and forces that are derivatives and balance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.contact.barrier_law import Barrier
from softmark.solvers.contact.facet_contact_points import add_points_inside_facets
from softmark.solvers.contact.free_rigid_bodies import (
    FreeBodyChart,
    FreeBodyFriction,
    FreeRigidBody,
    make_contact_with_free_body,
    right_jacobian,
)
from softmark.solvers.contact.rigid_body_loads import RigidBodyLoad
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_friction import add_friction
from softmark.solvers.contact.rigid_mass_properties import VOLUMES, mass_properties_of
from softmark.solvers.contact.rigid_transform import RigidMotion, rotation_from_vector
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.contact.signed_distance.triangle_surface import TriangleSurface
from softmark.solvers.mesh.revolved_bodies import Cone, Revolved
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.mesh.tubes import Tube

R, L, AXIS, AT = 0.3, 1.0, (0.0, 0.6, 0.8), (0.1, 0.2, 0.3)
ACROSS = (3.0 * R**2 + L**2) / 12.0
KNOWN = {  # volume, moments of inertia per mass, ascending: any table of them
    "box": (Box((1.0, 0.7, 0.5), origin=AT), 0.35, (0.74 / 12, 1.25 / 12, 1.49 / 12)),
    "sphere": (Sphere(R, origin=AT), 4 / 3 * np.pi * R**3, (0.4 * R**2,) * 3),
    "shell": (
        SphericalShell(R, 0.5 * R, origin=AT),
        4 / 3 * np.pi * R**3 * 0.875,
        (0.4 * R**2 * (1 - 0.5**5) / (1 - 0.5**3),) * 3,
    ),
    "cylinder": (Cylinder(L, R, AXIS, AT), np.pi * R**2 * L, (0.5 * R**2, ACROSS, ACROSS)),
    "tube": (
        Tube(L, R, 0.5 * R, AXIS, AT),
        np.pi * R**2 * L * 0.75,
        (0.5 * R**2 * 1.25, *((3.0 * R**2 * 1.25 + L**2) / 12.0,) * 2),
    ),
    "cone": (Cone(L, R, 0.0, AXIS, AT), np.pi * R**2 * L / 3, (0.3 * R**2, *(0.15 * R**2 + 0.0375 * L**2,) * 2)),
}


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_mass_of_shapes(name: str) -> None:
    """To rounding."""
    shape, V, J = KNOWN[name]
    gap: Any = gap_of(shape)
    found = mass_properties_of(gap)
    assert found is not None
    assert pytest.approx(V, rel=1e-12) == found.V
    assert found.principal[0] == pytest.approx(sorted(J), rel=1e-9)
    assert np.linalg.det(found.principal[1]) == pytest.approx(1.0)
    assert found.middle == pytest.approx(gap.centroid, abs=1e-12)


def test_mass_of_a_closed_surface() -> None:
    """Two triangles on each face of a box: its own, to rounding; and of all shapes that may be free there is one."""
    box = Box((1.0, 0.7, 0.5), origin=AT)
    corners = np.array([[x, y, z] for x in (0.1, 1.1) for y in (0.2, 0.9) for z in (0.3, 0.8)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    solid: Any = gap_of(box)
    found, right = mass_properties_of(TriangleSurface(corners, triangles)), mass_properties_of(solid)
    assert found is not None
    assert right is not None
    assert pytest.approx(right.V, rel=1e-12) == found.V
    assert pytest.approx(right.C, rel=1e-12, abs=1e-15) == found.C
    section = ((0.0, 0.0), (0.3, 0.0), (0.0, 0.5))
    own = [gap_of(shape) for shape, _, _ in KNOWN.values()] + [gap_of(Revolved(section, AXIS, AT))]
    assert {type(gap) for gap in own} <= set(VOLUMES)
    assert all(shape.has_mass_properties for shape, _, _ in KNOWN.values())
    assert Revolved.has_mass_properties


@pytest.mark.parametrize("parts", [1, 2])
def test_forces_of_a_free_body_are_derivatives_and_balance(parts: int) -> None:
    """Central differences to 1e-8 of the largest; forces and moments of nodes and body add up to nothing: rounding.

    Moments are about the body's own axes, so that a rotation vector takes them by the transposed right Jacobian.
    """
    rng = np.random.default_rng(0)
    gap: Any = gap_of(Cylinder(L, R, AXIS, AT))
    volume: Any = mass_properties_of(gap)
    points = volume.middle + 0.5 * rng.standard_normal((9, 3))
    nodes, n = np.arange(9), 27
    touching = RigidContact(nodes, points, rng.uniform(0.5, 1.0, 9), Barrier(0.8, 2.0), lambda share: gap)
    if parts > 1:
        touching = add_points_inside_facets(touching, points, nodes.reshape(3, 3), parts)
    body = FreeRigidBody(n, 2.0, 2.0 * volume.principal[0], volume.principal[1], volume.middle)
    chart = FreeBodyChart([body])
    chart.turned[0] = chart.turned[0] @ rotation_from_vector(np.array([0.3, -0.2, 0.5]))
    whole = Assembly(n + 6, np.zeros(0, dtype=np.int64), [touch := make_contact_with_free_body(touching, chart, 0)], [])
    x, h = 0.1 * rng.standard_normal(n + 6), 1e-6
    x[-3:] = 0.1, -0.2, 0.15
    ways = np.eye(n + 6)
    g = whole.gradient(x, 1.0)
    slopes = np.array([(whole.value(x + h * e, 1.0) - whole.value(x - h * e, 1.0)) / (2 * h) for e in ways])
    by_vector = g.copy()
    by_vector[-3:] = right_jacobian(x[-3:]).T @ g[-3:]
    assert slopes == pytest.approx(by_vector, abs=1e-8 * np.abs(g).max())
    K = whole.tangent(x, 1.0).toarray()
    changes = np.array([(whole.gradient(x + h * e, 1.0) - whole.gradient(x - h * e, 1.0)) / (2 * h) for e in ways]).T
    assert np.abs(K - changes).max() < 1e-8 * np.abs(K).max()
    f, at = -g[:n].reshape(-1, 3), points + x[:n].reshape(-1, 3)
    assert touch.forces(x) == pytest.approx(f, abs=1e-14)
    assert f.sum(axis=0) - g[n : n + 3] == pytest.approx(0.0, abs=1e-14)
    own = np.cross(chart.middle(0, x), -g[n : n + 3]) - chart.axes(0, x) @ g[n + 3 :]
    assert np.cross(at, f).sum(axis=0) + own == pytest.approx(0.0, abs=1e-14)
    definite = whole.tangent(x, 1.0, projected=True).toarray()[:n, :n]
    assert np.linalg.eigvalsh(definite).min() > -1e-10 * np.abs(definite).max()
    assert touch.gaps(x).min() < 0.8


@pytest.mark.parametrize("parts", [1, 2])
def test_friction_of_a_free_body_is_a_derivative_and_balances(parts: int) -> None:
    """With a lag: central differences to 1e-8 of the largest, of points that stick and that slide; and no resultant."""
    rng = np.random.default_rng(3)
    gap: Any = gap_of(Cylinder(L, R, AXIS, AT))
    volume: Any = mass_properties_of(gap)
    points = volume.middle + 0.5 * rng.standard_normal((9, 3))
    touching = RigidContact(np.arange(9), points, rng.uniform(0.5, 1.0, 9), Barrier(0.8, 2.0), lambda share: gap)
    if parts > 1:
        touching = add_points_inside_facets(touching, points, np.arange(9).reshape(3, 3), parts)
    body = FreeRigidBody(27, 2.0, 2.0 * volume.principal[0], volume.principal[1], volume.middle)
    chart = FreeBodyChart([body])
    held = make_contact_with_free_body(add_friction(touching, 0.5, lambda share: RigidMotion()), chart, 0)
    assert isinstance(held, FreeBodyFriction)
    chart.turned[0] = chart.turned[0] @ rotation_from_vector(np.array([0.3, -0.2, 0.5]))
    x, h = 0.1 * rng.standard_normal(33), 1e-6
    touch = held.lagged(x)
    x[:27] += 0.02 * rng.standard_normal(27)
    x[-3:] = 0.1, -0.2, 0.15
    on = touch.pressures(x) > 0.0
    assert 0 < np.count_nonzero(touch.slip(x).slides & on) < np.count_nonzero(on)
    whole = Assembly(33, np.zeros(0, dtype=np.int64), [touch], [])
    g, ways = whole.gradient(x, 1.0), np.eye(33)
    by_vector = g.copy()
    by_vector[-3:] = right_jacobian(x[-3:]).T @ g[-3:]
    slopes = np.array([(whole.value(x + h * e, 1.0) - whole.value(x - h * e, 1.0)) / (2 * h) for e in ways])
    assert slopes == pytest.approx(by_vector, abs=1e-8 * np.abs(g).max())
    K = whole.tangent(x, 1.0).toarray()
    changes = np.array([(whole.gradient(x + h * e, 1.0) - whole.gradient(x - h * e, 1.0)) / (2 * h) for e in ways]).T
    assert np.abs(K - changes).max() < 1e-7 * np.abs(K).max()
    f, at = -g[:27].reshape(-1, 3), points + x[:27].reshape(-1, 3)
    assert f.sum(axis=0) - g[27:30] == pytest.approx(0.0, abs=1e-14)
    own = np.cross(chart.middle(0, x), -g[27:30]) - chart.axes(0, x) @ g[30:]
    assert np.cross(at, f).sum(axis=0) + own == pytest.approx(0.0, abs=1e-14)


def test_a_pull_at_a_free_body_is_its_force_and_its_moment() -> None:
    """About its own axes they are those in space, to rounding; the tangent by central differences to 1e-9."""
    body = FreeRigidBody(
        2, 1.0, np.ones(3), rotation_from_vector(np.array([0.4, 0.1, -0.3])), np.array([0.5, -0.2, 0.1])
    )
    chart, force, moment = FreeBodyChart([body]), np.array([1.0, 2.0, -1.5]), np.array([0.3, -0.1, 0.2])
    at = np.array([0.9, 0.3, -0.2])
    pull = RigidBodyLoad(chart, 0, force, at, moment)
    x, h = np.array([0.0, 0.0, 0.1, 0.2, -0.1, 0.2, -0.3, 0.1]), 1e-6

    def gradient(x: Any) -> Any:
        g = np.zeros(8)
        pull.add_gradient(x, g)
        return g

    Q = chart.axes(0, x) @ body.axes.T
    right = Q.T @ (np.cross(Q @ (at - body.middle), force) + moment)
    assert gradient(x)[2:5] == pytest.approx(-force)
    assert gradient(x)[5:] == pytest.approx(-body.axes.T @ right, abs=1e-14)
    K = Assembly(8, np.arange(2), [pull], []).tangent(x, 1.0).toarray()
    changes = np.array([(gradient(x + h * e) - gradient(x - h * e)) / (2 * h) for e in np.eye(8)]).T[2:, 2:]
    assert np.abs(K - changes).max() < 1e-9


def test_turns_are_counted_anew() -> None:
    """After many steps axes are those of one turn, and still of length one: to rounding."""
    body = FreeRigidBody(0, 1.0, np.ones(3), np.eye(3), np.zeros(3))
    chart, x = FreeBodyChart([body]), np.array([0.0, 0.0, 0.0, 0.02, -0.01, 0.03])
    for _ in range(1000):
        new = chart.rebase(x)
        assert not new[3:].any()
    assert chart.turned[0] == pytest.approx(rotation_from_vector(1000 * x[3:]), abs=1e-11)
    assert chart.turned[0] @ chart.turned[0].T == pytest.approx(np.eye(3), abs=1e-14)
