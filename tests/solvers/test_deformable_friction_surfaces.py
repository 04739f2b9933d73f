"""Friction between surfaces that deform: its derivatives, what holds of any state, and the same by other formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from softmark.solvers.contact.closest_face_points import closest_point_weights
from softmark.solvers.contact.contact_surface import build_contact_surface
from softmark.solvers.independent_forces import deformable_friction_forces as again
from softmark.solvers.mesh.disjoint_shapes import DisjointShapes
from softmark.solvers.mesh.plane_regions import Quadrilateral
from softmark.solvers.mesh.shapes import Box

pytest.importorskip("ipctk")
from softmark.solvers.contact.deformable_contact import IpcContact
from softmark.solvers.contact.deformable_friction import DeformableFriction

GAP, MU = 2e-3, 0.4
CASES = [("tet4", 0.0), ("hex8", 0.0), ("tri6", 0.0), ("quad8", 0.05)]


def made(kind, depth=0.0):
    """Two blocks, or slices of them, whose meshes do not match, with friction; and a state (dofs,), m."""
    if kind.startswith(("quad", "tri")):
        low = Quadrilateral((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0))
        high = Quadrilateral((0.0, 1.0 + GAP, 0.0), (1.0, 1.0 + GAP, 0.0), (1.0, 2.0, 0.0), (0.0, 2.0, 0.0))
        mesh = DisjointShapes(low, high, 1.4).slice(0.05).mesh(kind, 0.25)
    else:
        high = Box((1.0, 1.0, 1.0), (0.0, 0.0, 1.0 + GAP))
        mesh = DisjointShapes(Box((1.0, 1.0, 1.0)), high, 0.68).mesh(kind, 0.5)
    flat = kind.startswith(("quad", "tri"))
    pressing = IpcContact(build_contact_surface(mesh, mesh.points.size, 3, None, flat, depth), 2 * GAP, 100.0, True)
    x = 2e-4 * np.random.default_rng(1).standard_normal(mesh.points.size)
    return DeformableFriction(pressing, MU), mesh, x


def gradient(energy, x):
    """Minus its forces (dofs,), N."""
    g = np.zeros(len(x))
    energy.add_gradient(x, g)
    return g


@pytest.mark.parametrize(("kind", "depth"), CASES)
def test_derivatives(kind, depth):
    """With a lag they are those of its energy (differences over 1e-8 m).

    Without, the tangent lacks how surfaces turn in the way: 1e-2 of the forces' change here.
    """
    energy, _, x = made(kind, depth)
    d, h = np.random.default_rng(2).standard_normal(len(x)), 1e-8
    lag = replace(energy.lagged(2e-4 * np.random.default_rng(3).standard_normal(len(x))), dual=None)
    assert (lag.value(x + h * d) - lag.value(x - h * d)) / (2 * h) == pytest.approx(gradient(lag, x) @ d, rel=1e-5)
    for own, part in ((lag, 1e-4), (energy, 1e-2)):
        difference = (gradient(own, x + h * d) - gradient(own, x - h * d)) / (2 * h)
        np.testing.assert_allclose(own.matrix(x) @ d, difference, atol=part * np.abs(difference).max())
    K = lag.matrix(x, projected=True).toarray()
    assert np.linalg.eigvalsh(0.5 * (K + K.T)).min() >= -1e-12 * np.abs(K).max()


@pytest.mark.parametrize(("kind", "depth"), CASES[:-1])
def test_forces_add_up_to_nothing_and_turn_nothing(kind, depth):
    """To rounding, in any state: the gap between surfaces gives friction no arm."""
    energy, mesh, x = made(kind, depth)
    f = (gradient(energy, x) - gradient(energy.pressing, x)).reshape(-1, 3)
    size = np.abs(f).max()
    assert size > 0.0
    np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=1e-12 * size)
    moment = np.cross(mesh.points + x.reshape(-1, 3), f).sum(axis=0)
    np.testing.assert_allclose(moment[2:] if energy.skin.flat else moment, 0.0, atol=1e-12 * size)


def test_a_motion_of_all_together_is_no_slip():
    """Turned by 1e-4 rad and shifted by half its size, what sticks is not stretched more than by the square of that."""
    energy, mesh, x = made("hex8")
    held = replace(energy, since=energy.final_history(x)[0])
    before = held.tangential_coupling(x).slip(x, MU)
    turn, shift = np.array([1e-4, -5e-5, 8e-5]), np.array([0.5, -0.2, 0.1])
    place = mesh.points + x.reshape(-1, 3)
    y = x + (np.cross(turn, place) + shift).ravel()
    after = held.tangential_coupling(y).slip(y, MU)
    np.testing.assert_allclose(after.size, before.size, atol=1e-7)


def test_what_slides_loses_heat_and_what_is_left_is_its_spring():
    """A state goes on from itself with the same forces, and without heat."""
    energy, _, x = made("hex8")
    since, slid, heat = energy.final_history(x)
    assert slid.min() >= 0.0
    assert slid.max() > 0.0
    assert heat > 0.0
    held = replace(energy, since=since)
    np.testing.assert_allclose(gradient(held, x), gradient(energy, x), atol=1e-9 * np.abs(gradient(energy, x)).max())
    _, slid, heat = held.final_history(x)
    assert slid.max() < 1e-12
    assert 0.0 <= heat < 1e-12


@pytest.mark.parametrize(("kind", "depth"), CASES)
def test_forces_by_other_formulas(kind, depth):
    """Pressures by Gram's matrix and sums over faces, sides and corners; forces at corners by linear systems."""
    energy, _, x = made(kind, depth)
    skin, c = energy.skin, energy.pressing
    since, _, _ = energy.final_history(x)
    V, which = skin.places(x), np.flatnonzero(since.n.any(axis=1))
    p, X = V[skin.corners + which], V[: skin.corners]
    pairs = again.find_candidate_pairs(p, X, skin.faces, c.distance)
    pairs = pairs[skin.patch[skin.corners + which[pairs[:, 0]]] != skin.patch[skin.faces[pairs[:, 1], 0]]]
    area = 0.5 * skin.A[which]
    f = area[:, None] * again.contact_pressures(p, X, skin.faces, pairs, c.distance, c.stiffness)
    known = -c.forces(x)[skin.corners + which]
    np.testing.assert_allclose(f, known, atol=1e-9 * np.abs(known).max())
    most = MU * np.abs((again.normals(X[skin.faces[skin.own[which]]]) * f).sum(axis=1))
    rubs, on = again.friction_forces(p, X, skin.faces, pairs, (area * energy.spring)[:, None] * since.s[which], most)
    each = np.zeros_like(V)
    each[: skin.corners], each[skin.corners + which] = on, rubs
    known = gradient(energy, x) - gradient(c, x)
    np.testing.assert_allclose(-(skin.M.T @ each.ravel()), known, atol=1e-9 * np.abs(known).max())


def test_nearest_points():
    """No point of a lattice on triangles is nearer than those that are found, and the least of those is near them."""
    rng = np.random.default_rng(5)
    p, t = rng.standard_normal((50, 3)), rng.standard_normal((50, 3, 3))
    far = np.linalg.norm(p - np.einsum("ca,cai->ci", closest_point_weights(p, t), t), axis=1)
    lattice = np.array([(i, j, 60 - i - j) for i in range(61) for j in range(61 - i)]) / 60.0
    every = np.linalg.norm(p[:, None] - np.einsum("la,cai->cli", lattice, t), axis=2).min(axis=1)
    assert (far <= every + 1e-12).all()
    assert (every - far).max() < 0.05
