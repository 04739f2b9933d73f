"""Rods that share points: derivatives, invariances, and what one rod cut in two must be."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.energies.energy import Energy
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_joints import JointedRods, Joints
from softmark.solvers.energies.rod_loads import EccentricRodForces, RodMoments
from softmark.solvers.energies.rod_rotation import exponential, product, quaternion, rotation
from softmark.solvers.energies.rod_section import RodStiffness
from softmark.solvers.energies.rod_state import RodChain, RodSpace, chain_elements, rod_at_rest
from softmark.solvers.statics.rod_frame_state import RodNetwork

UNIT = RodStiffness(EA=1.0, GA2=0.7, GA3=0.5, GJ=0.4, EI2=1.1, EI3=0.8)
POINT = np.array([0, 1, 2, 2, 3, 4, 2, 5])  # three rods, of two, two and one elements, that meet at point 2
ELEMENTS = np.array([[0, 1], [1, 2], [3, 4], [4, 5], [6, 7]])


def star(rng: np.random.Generator) -> tuple[np.ndarray, Joints]:
    """Nodes at rest of three rods from one point, and how they hang on points whose axes are any."""
    ways = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    X = [np.linspace(-2.0, 0.0, 3)[:, None] * ways[0], np.linspace(0.0, 2.0, 3)[:, None] * ways[1],
         np.linspace(0.0, 1.0, 2)[:, None] * ways[2]]  # fmt: skip
    rest = np.concatenate([rod_at_rest(part) for part in X])
    axes = rotation(random_turns(rng, 6))
    return rest, Joints.of(rest, POINT, axes)


def random_turns(rng: np.random.Generator, count: int) -> np.ndarray:
    q = rng.normal(size=(count, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def moved(rest: np.ndarray, joints: Joints, d: np.ndarray) -> np.ndarray:
    """The nodes after a plain increment of the points (6 p,)."""
    return RodSpace(len(joints.point)).move(rest, joints.node_increments(d))


def gradient(energy: Energy, x: np.ndarray) -> np.ndarray:
    g = np.zeros(6 * (POINT.max() + 1))
    energy.add_gradient(x, g)
    return g


def tangent(energy: Energy, x: np.ndarray, projected: bool = False) -> np.ndarray:
    n, s = 6 * (POINT.max() + 1), energy.stencils
    data = np.zeros(n * n)
    energy.add_hessian(x, data, s[:, :, None] * n + s[:, None, :], projected=projected)
    return data.reshape(n, n)


def test_nodes_at_one_point_stay_at_one_point_and_keep_their_angles() -> None:
    """After three increments of half a radian: angles between frames at the joint to rounding."""
    rng = np.random.default_rng(1)
    rest, joints = star(rng)
    x = rest
    for _ in range(3):
        x = moved(x, joints, 0.5 * rng.normal(size=36))
    nodes, start = x.reshape(-1, 7), rest.reshape(-1, 7)
    meet = np.flatnonzero(POINT == 2)
    assert np.abs(nodes[meet, :3] - nodes[meet[0], :3]).max() < 1e-14
    for a in meet:
        for b in meet:
            now, before = (rotation(s[a, 3:]).T @ rotation(s[b, 3:]) for s in (nodes, start))
            np.testing.assert_allclose(now, before, atol=1e-13)


def test_forces_are_adjoint_to_increments() -> None:
    """<spread d, g> = <d, gathered g>, so that the work is one."""
    rng = np.random.default_rng(2)
    _, joints = star(rng)
    d, g = rng.normal(size=36), rng.normal(size=48)
    assert joints.node_increments(d) @ g == pytest.approx(d @ joints.forces_at_points(g), rel=1e-13)


def energies(rest: np.ndarray, joints: Joints) -> list[JointedRods]:
    rng = np.random.default_rng(3)
    nodes = np.array([2, 5])
    return [
        JointedRods(RodElastic(rest, ELEMENTS, UNIT), joints),
        JointedRods(RodForces(rest, rng.normal(size=(8, 3))), joints),
        JointedRods(EccentricRodForces(rest, nodes, rng.normal(size=(2, 3)), rng.normal(size=(2, 3))), joints),
    ]


@pytest.mark.parametrize("which", range(3))
def test_derivatives(which: int) -> None:
    """Gradients and tangents against central differences along points' increments, 1e-6 apart: 1e-7 of the largest."""
    rng = np.random.default_rng(4)
    rest, joints = star(rng)
    energy = energies(rest, joints)[which]
    x, h = moved(rest, joints, 0.4 * rng.normal(size=36)), 1e-6
    way = rng.normal(size=36)
    ends = [moved(x, joints, sign * h * way) for sign in (1.0, -1.0)]
    slope = (energy.value(ends[0]) - energy.value(ends[1])) / (2.0 * h)
    assert gradient(energy, x) @ way == pytest.approx(slope, rel=1e-7)
    if energy.stencils.size:
        H = tangent(energy, x)
        second = (energy.value(moved(x, joints, 1e-4 * way)) + energy.value(moved(x, joints, -1e-4 * way))
                  - 2.0 * energy.value(x)) / 1e-8  # fmt: skip
        assert way @ H @ way == pytest.approx(second, rel=1e-5)
        np.testing.assert_allclose(H, H.T, atol=1e-12 * np.abs(H).max())
        assert np.linalg.eigvalsh(tangent(energy, x, projected=True)).min() > -1e-12 * np.abs(H).max()


def test_a_moment_in_space_does_the_same_work_at_any_node_of_a_joint() -> None:
    """Its forces at the point do not hang on which rod's node it is put on."""
    rng = np.random.default_rng(5)
    rest, joints = star(rng)
    x = moved(rest, joints, 0.4 * rng.normal(size=36))
    m = rng.normal(size=(1, 3))
    found = [gradient(JointedRods(RodMoments(np.array([n]), m), joints), x) for n in (2, 3, 6)]
    np.testing.assert_allclose(found[1:], [found[0]] * 2, atol=1e-13)


def test_a_rigid_motion_strains_nothing() -> None:
    """All of it turned by any angle and shifted: energy and forces vanish to rounding."""
    rng = np.random.default_rng(6)
    rest, joints = star(rng)
    q = exponential(np.array([0.3, -1.2, 2.0]))
    nodes = rest.reshape(-1, 7)
    X = nodes[:, :3] @ rotation(q).T + [1.0, 2.0, 3.0]
    x = np.concatenate([X, product(np.tile(q, (8, 1)), nodes[:, 3:])], axis=1).ravel()
    energy = energies(rest, joints)[0]
    assert energy.value(x) < 1e-26
    assert np.abs(gradient(energy, x)).max() < 1e-13


def test_a_stencil_with_a_part_of_a_rotation_is_refused() -> None:
    _, joints = star(np.random.default_rng(7))
    with pytest.raises(ValueError, match="part of the rotation of a node"):
        joints.point_stencils_with_derivatives(np.array([[0, 1, 2, 3, 4]]))


@pytest.mark.parametrize("held", [[0], [0, 4], []])
def test_one_rod_moves_as_a_chain_does(held: list[int]) -> None:
    """A rod cut in two at a node: `RodNetwork` moves it where `RodChain` moves one that is whole, to rounding."""
    rng = np.random.default_rng(8)
    X = np.array([0.0, 0.3, 1.0, 1.8, 2.0])[:, None] * [1.0, 0.0, 0.0]
    whole = rod_at_rest(X)
    nodes = whole.reshape(-1, 7)
    rest, point = np.concatenate([nodes[:3], nodes[2:]]).ravel(), np.array([0, 1, 2, 2, 3, 4])
    fixed = np.zeros((5, 3), dtype=bool)
    fixed[held] = True
    joints = Joints.of(rest, point, rotation(nodes[:, 3:]))
    network = RodNetwork(rest, np.array([[0, 1], [1, 2], [3, 4], [4, 5]]), joints, fixed)
    single = RodChain(whole, fixed)
    a, b = whole, rest
    for _ in range(3):
        d = 0.5 * rng.normal(size=30)
        d.reshape(-1, 6)[held, :3] = 0.0
        a, b = single.move(a, d), network.move(b, d)
    np.testing.assert_allclose(b.reshape(-1, 7)[[0, 1, 2, 4, 5]], a.reshape(-1, 7), atol=1e-12)
    np.testing.assert_array_equal(b.reshape(-1, 7)[2], b.reshape(-1, 7)[3])


def test_axes_of_points_are_free() -> None:
    """Axes of the points are names for their turns: energies of states that are one in space are one."""
    rng = np.random.default_rng(9)
    rest, joints = star(rng)
    own = Joints.of(rest, POINT, np.tile(np.eye(3), (6, 1, 1)))
    axes = rotation(quaternion(np.einsum("nij,nkj->nik", rotation(rest.reshape(-1, 7)[:, 3:]), joints.turns)))
    d = 0.4 * rng.normal(size=(6, 6))
    first = np.array([0, 1, 2, 4, 5, 7])
    in_space = np.concatenate([d[:, :3], np.einsum("pij,pj->pi", axes[first], d[:, 3:])], axis=1)
    a, b = moved(rest, joints, d.ravel()), moved(rest, own, in_space.ravel())
    np.testing.assert_allclose(a, b, atol=1e-13)


def test_the_chain_of_elements_is_that_of_a_rod() -> None:
    """Elements of one rod in the network are those of `chain`: so its energy is that of the rod alone."""
    rng = np.random.default_rng(10)
    rest, joints = star(rng)
    x = moved(rest, joints, 0.4 * rng.normal(size=36))
    parts = [slice(0, 3), slice(3, 6), slice(6, 8)]
    alone = sum(
        RodElastic(rest.reshape(-1, 7)[p].ravel(), chain_elements(len(rest.reshape(-1, 7)[p])), UNIT).value(
            x.reshape(-1, 7)[p].ravel()
        )
        for p in parts
    )
    assert energies(rest, joints)[0].value(x) == pytest.approx(alone, rel=1e-13)
