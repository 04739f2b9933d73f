"""The geometrically exact rod: derivatives, invariances, motion, and how it reads and places material
points.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from end_force import concentrated

from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_kinematics import RodElements
from softmark.solvers.energies.rod_rotation import (
    conjugate,
    exponential,
    interpolate_rotation,
    logarithm,
    product,
    quaternion,
    rotation,
)
from softmark.solvers.energies.rod_section import RodStiffness, circular
from softmark.solvers.energies.rod_state import (
    RodChain,
    RodSpace,
    chain_elements,
    displacement_at,
    lengths,
    rod_at_rest,
)

NODES = 5
UNIT = RodStiffness(EA=1.0, GA2=0.7, GA3=0.5, GJ=0.4, EI2=1.1, EI3=0.8)


def random_quaternions(rng: np.random.Generator, count: int) -> np.ndarray:
    q = rng.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return q


def random_state(rng: np.random.Generator, nodes: int = NODES) -> np.ndarray:
    """Positions about one apart, frames turned at will: relative rotations up to 180 degrees."""
    return np.concatenate(
        [np.cumsum(rng.normal(size=(nodes, 3)), axis=0), random_quaternions(rng, nodes)], axis=1
    ).ravel()


def random_rod(rng: np.random.Generator) -> RodElastic:
    """A rod whose undeformed state is bent, twisted and sheared already."""
    return RodElastic(random_state(rng), chain_elements(NODES), UNIT)


def gradient(elastic: RodElastic, x: np.ndarray) -> np.ndarray:
    g = np.zeros(x.size // 7 * 6)
    elastic.add_gradient(x, g)
    return g


def tangent(elastic: RodElastic, x: np.ndarray, projected: bool = False) -> np.ndarray:
    """The dense stiffness, through the slots of a full matrix."""
    dofs = x.size // 7 * 6
    data = np.zeros(dofs * dofs)
    stencils = elastic.stencils
    elastic.add_hessian(x, data, stencils[:, :, None] * dofs + stencils[:, None, :], projected=projected)
    return data.reshape(dofs, dofs)


def derivative(f: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """Five-point differences of f along every degree of freedom: error h^4 + eps / h, about 1e-11 at h =
    2e-3.
    """
    h, dofs = 2e-3, x.size // 7 * 6
    move = RodSpace(x.size // 7).move
    columns = [
        (8 * (f(move(x, h * e)) - f(move(x, -h * e))) - (f(move(x, 2 * h * e)) - f(move(x, -2 * h * e)))) / (12 * h)
        for e in np.eye(dofs)
    ]
    return np.stack(columns, axis=-1)


def turned(x: np.ndarray, q: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """The state after a rigid motion."""
    nodes = x.reshape(-1, 7)
    return np.concatenate([nodes[:, :3] @ rotation(q).T + shift, product(q, nodes[:, 3:])], axis=1).ravel()


def test_quaternions_and_matrices_multiply_alike() -> None:
    """R(p q) = R(p) R(q), and q is recovered from R(q) up to its sign; round-off of a few 1e-16 only."""
    p, q = random_quaternions(np.random.default_rng(0), 400).reshape(2, 200, 4)
    np.testing.assert_allclose(rotation(product(p, q)), rotation(p) @ rotation(q), atol=3e-15)
    recovered = quaternion(rotation(q))
    np.testing.assert_allclose(recovered, q * np.sign(q[:, :1]), atol=3e-15)
    np.testing.assert_allclose(product(conjugate(q), q), np.tile([1.0, 0, 0, 0], (200, 1)), atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.43, 0.44, 0.45, 2.0, 3.141])
def test_logarithm_inverts_exponential(angle: float) -> None:
    """To round-off on either side of the switch between series and closed form (0.44 rad)."""
    phi = angle * np.array([[2.0, -1.0, 2.0]]) / 3
    np.testing.assert_allclose(logarithm(exponential(phi)), phi, rtol=1e-14)
    np.testing.assert_allclose(logarithm(-exponential(phi)), phi, rtol=1e-14)


def test_interpolation_runs_along_the_geodesic() -> None:
    """At t of the way the rotation has turned by t of the relative angle, whatever sign the quaternions
    have.
    """
    q = random_quaternions(np.random.default_rng(1), 1)
    phi = np.array([[0.3, -1.0, 2.0]])
    middle = interpolate_rotation(q, -product(q, exponential(phi)), np.array([0.3]))
    np.testing.assert_allclose(rotation(middle), rotation(product(q, exponential(0.3 * phi))), atol=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_is_the_derivative_of_the_energy(seed: int) -> None:
    """Unit moduli, lengths of order one, large rotations; tolerance: the accuracy of the differences."""
    rng = np.random.default_rng(seed)
    elastic, x = random_rod(rng), random_state(rng)
    numerical = derivative(lambda y: np.array(elastic.value(y)), x)
    np.testing.assert_allclose(gradient(elastic, x), numerical, atol=2e-9)


@pytest.mark.parametrize("seed", range(3))
def test_hessian_is_the_derivative_of_the_gradient(seed: int) -> None:
    """The gradient is given in axes that turn with the nodes, so its derivative is the Hessian plus a skew
    part.
    """
    rng = np.random.default_rng(seed)
    elastic, x = random_rod(rng), random_state(rng)
    numerical = derivative(lambda y: gradient(elastic, y), x)
    np.testing.assert_allclose(tangent(elastic, x), (numerical + numerical.T) / 2, atol=2e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 1e-3, 0.435, 0.447, 1.0, 2.5])
def test_derivatives_hold_at_every_relative_angle(angle: float) -> None:
    """The two formulas for the rotation vector meet at 0.44 rad; both must be right at their worst, near
    it.
    """
    rng = np.random.default_rng(7)
    x = random_state(rng, 2).reshape(2, 7)
    x[1, 3:] = product(x[0, 3:], exponential(angle * np.array([0.6, 0.0, -0.8])))
    elastic = RodElastic(random_state(rng, 2), chain_elements(2), UNIT)
    numerical = derivative(lambda y: gradient(elastic, y), x.ravel())
    np.testing.assert_allclose(tangent(elastic, x.ravel()), (numerical + numerical.T) / 2, atol=2e-9)


def test_derivatives_hold_with_an_offset() -> None:
    """A rod whose switched-off modes carry multipliers: same tolerance."""
    rng = np.random.default_rng(16)
    stiffness = replace(UNIT, rigid=(0, 2))
    x = random_state(rng)
    elastic = RodElastic(random_state(rng), chain_elements(NODES), stiffness).with_multipliers(random_state(rng))
    numerical = derivative(lambda y: np.array(elastic.value(y)), x)
    np.testing.assert_allclose(gradient(elastic, x), numerical, atol=2e-9)
    numerical = derivative(lambda y: gradient(elastic, y), x)
    np.testing.assert_allclose(tangent(elastic, x), (numerical + numerical.T) / 2, atol=2e-9)


def test_tightening_doubles_the_forces_of_switched_off_modes_only() -> None:
    """In the same state the offset equals the strain: resultants of these modes double, others stay."""
    rng = np.random.default_rng(17)
    x = random_state(rng)
    loose = RodElastic(random_state(rng), chain_elements(NODES), replace(UNIT, rigid=(0, 2)))
    factor = np.array([2.0, 1.0, 2.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(loose.with_multipliers(x).resultants(x), factor * loose.resultants(x), atol=1e-14)
    np.testing.assert_allclose(loose.with_multipliers(x).strains(x), loose.strains(x))
    assert loose.rigid_fraction(loose.rest) == 0.0


def test_tangent_is_symmetric_out_of_balance() -> None:
    """By construction; round-off of a few 1e-16 of its largest entry."""
    rng = np.random.default_rng(3)
    elastic, x = random_rod(rng), random_state(rng)
    K = tangent(elastic, x)
    np.testing.assert_allclose(K, K.T, atol=1e-14 * np.abs(K).max())


def test_projected_blocks_are_semi_definite() -> None:
    """Each local block: no eigenvalue below round-off, and no change where the exact block has none below
    zero.
    """
    rng = np.random.default_rng(4)
    elastic, x = random_rod(rng), random_state(rng)
    assert np.linalg.eigvalsh(elastic.local_hessians(x)).min() < -0.01
    w = np.linalg.eigvalsh(tangent(elastic, x, projected=True))
    assert w.min() > -1e-13 * w.max()
    at_rest = tangent(elastic, elastic.rest)
    np.testing.assert_allclose(
        tangent(elastic, elastic.rest, projected=True), at_rest, atol=1e-13 * np.abs(at_rest).max()
    )


def test_hessian_skips_constrained_slots_and_scales() -> None:
    """Entries with slot -1 are dropped, the rest multiplied by `scale`."""
    rng = np.random.default_rng(5)
    elastic, x = random_rod(rng), random_state(rng)
    free = np.arange(6, 6 * NODES)
    number = np.full(6 * NODES, -1)
    number[free] = np.arange(len(free))
    rows, columns = number[elastic.stencils][:, :, None], number[elastic.stencils][:, None, :]
    data = np.zeros(len(free) ** 2)
    elastic.add_hessian(x, data, np.where((rows < 0) | (columns < 0), -1, rows * len(free) + columns), scale=-2.0)
    np.testing.assert_allclose(data.reshape(len(free), -1), -2 * tangent(elastic, x)[np.ix_(free, free)], atol=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_rigid_motions_cost_nothing(seed: int) -> None:
    """Any rotation and shift of the undeformed rod: strains, forces and energy zero to round-off."""
    rng = np.random.default_rng(seed)
    elastic = random_rod(rng)
    y = turned(elastic.rest, random_quaternions(rng, 1)[0], rng.normal(size=3))
    assert elastic.value(y) < 1e-28
    np.testing.assert_allclose(gradient(elastic, y), 0.0, atol=3e-14)


def test_energy_is_objective_in_deformed_states() -> None:
    """Equal energy, resultants and moments about the material axes; the forces turn with the rod. Round-off
    only.
    """
    rng = np.random.default_rng(6)
    elastic, x, q = random_rod(rng), random_state(rng), random_quaternions(rng, 1)[0]
    y = turned(x, q, rng.normal(size=3))
    assert elastic.value(y) == pytest.approx(elastic.value(x), rel=1e-14)
    np.testing.assert_allclose(elastic.resultants(y), elastic.resultants(x), atol=1e-13)
    g, g_y = gradient(elastic, x).reshape(-1, 6), gradient(elastic, y).reshape(-1, 6)
    np.testing.assert_allclose(g_y[:, 3:], g[:, 3:], atol=1e-13)
    np.testing.assert_allclose(g_y[:, :3], g[:, :3] @ rotation(q).T, atol=1e-13)


def test_signs_of_quaternions_do_not_matter() -> None:
    """q and -q are one rotation."""
    rng = np.random.default_rng(8)
    elastic, x = random_rod(rng), random_state(rng)
    y = x.reshape(-1, 7).copy()
    y[1::2, 3:] *= -1
    np.testing.assert_allclose(gradient(elastic, y.ravel()), gradient(elastic, x), atol=1e-14)


@pytest.mark.parametrize("bend", [0.0, 1.0])
def test_a_free_rod_has_six_rigid_modes(bend: float) -> None:
    """Straight or curved, the stiffness at rest has exactly six zero eigenvalues: round-off, then a gap."""
    s = np.linspace(0.0, 1.0, 9)
    rest = rod_at_rest(np.stack([s, bend * s**2, bend * s**3], axis=1))
    w = np.linalg.eigvalsh(tangent(RodElastic(rest, chain_elements(9), UNIT), rest))
    assert np.abs(w[:6]).max() < 1e-13 * w[-1]
    assert w[6] > 1e-5 * w[-1]


def test_constant_twist_and_curvature_are_read_exactly() -> None:
    """Frames exp(s k): K = k on every element, up to 172 degrees per element, since they turn along a
    geodesic.
    """
    s, k = np.linspace(0.0, 4.0, 3), np.array([0.9, -1.0, 0.65])
    x = np.concatenate([np.zeros((3, 3)), exponential(s[:, None] * k)], axis=1).ravel()
    strains = RodElements.of(x, chain_elements(3), np.full(2, 2.0)).strains
    np.testing.assert_allclose(strains[:, 3:], np.tile(k, (2, 1)), rtol=1e-13)


def test_plain_move_keeps_unit_quaternions() -> None:
    """Normalised after each move; positions move by d in space."""
    rng = np.random.default_rng(9)
    x, d = random_state(rng), 3 * rng.normal(size=6 * NODES)
    y = RodSpace(NODES).move(x, d).reshape(-1, 7)
    np.testing.assert_allclose(np.linalg.norm(y[:, 3:], axis=1), 1.0, atol=3e-16)
    np.testing.assert_allclose(y[:, :3], x.reshape(-1, 7)[:, :3] + d.reshape(-1, 6)[:, :3], atol=1e-15)
    assert RodSpace(NODES).dofs == RodChain(x, np.zeros((NODES, 3), dtype=bool)).dofs == 6 * NODES


def test_chain_move_agrees_with_the_plain_move_to_first_order() -> None:
    """Their difference falls by four when the increment is halved (by 3.9 to 4.1 at this size)."""
    rng = np.random.default_rng(10)
    x, d = random_state(rng), rng.normal(size=6 * NODES)
    held = np.zeros((NODES, 3), dtype=bool)
    held[0] = True

    def gap(size: float) -> float:
        plain, carried = RodSpace(NODES).move(x, size * d), RodChain(x, held).move(x, size * d)
        return float(np.linalg.norm(plain - carried))

    assert gap(0.002) / gap(0.001) == pytest.approx(4.0, abs=0.1)


def test_chain_move_turns_a_rod_without_straining_it() -> None:
    """The increment of a rigid rotation by any angle changes no strain: its derivative along that increment
    is zero.
    """
    rng = np.random.default_rng(11)
    elastic, x = random_rod(rng), random_state(rng)
    omega = np.array([1.0, -2.0, 0.5])
    nodes = x.reshape(-1, 7)
    about_axes = np.einsum("nki,k->ni", rotation(nodes[:, 3:]), omega)
    d = np.concatenate([np.cross(omega, nodes[:, :3]), about_axes], axis=1).ravel()
    y = RodChain(elastic.rest, np.zeros((NODES, 3), dtype=bool)).move(x, d)
    np.testing.assert_allclose(elastic.strains(y), elastic.strains(x), atol=1e-13)


def test_chain_move_leaves_held_components_to_the_increment() -> None:
    """A pinned end, a roller and a prescribed shift: held components move by d to round-off."""
    rng = np.random.default_rng(12)
    x, d = random_state(rng), rng.normal(size=6 * NODES)
    held = np.zeros((NODES, 3), dtype=bool)
    held[0], held[2], held[-1] = True, (False, True, False), (True, True, False)
    y = RodChain(x, held).move(x, d).reshape(-1, 7)
    shift = (y - x.reshape(-1, 7))[:, :3]
    np.testing.assert_allclose(shift[held], d.reshape(-1, 6)[:, :3][held], atol=1e-14)


def test_uniform_load_is_consistent_and_has_its_potential() -> None:
    """Total w L; end nodes take half of what middle ones take; gradient and value of a linear potential
    agree.
    """
    rest = rod_at_rest(np.linspace([0.0, 0, 0], [2.0, 0, 0], NODES))
    load = RodForces.uniform(rest, chain_elements(NODES), np.array([0.0, 1.0, -3.0]))
    np.testing.assert_allclose(load.forces.sum(axis=0), [0.0, 2.0, -6.0], atol=1e-15)
    np.testing.assert_allclose(load.forces[0], load.forces[2] / 2)
    x = random_state(np.random.default_rng(13))
    g = np.zeros(6 * NODES)
    load.add_gradient(x, g, scale=2.0)
    np.testing.assert_allclose(g, 2 * derivative(lambda y: np.array(load.value(y)), x), atol=1e-10)
    assert load.value(rest) == 0.0
    assert load.stencils.shape == (0, 0)


def test_concentrated_load_acts_on_its_node() -> None:
    """-f . u on one node, and no stiffness."""
    rest = rod_at_rest(np.linspace([0.0, 0, 0], [2.0, 0, 0], NODES))
    load = concentrated(rest, -1, np.array([0.0, 0.0, 5.0]))
    d = np.zeros((NODES, 6))
    d[-1, 2] = 0.25
    assert load.value(RodSpace(NODES).move(rest, d.ravel())) == pytest.approx(-1.25)
    data = np.zeros(1)
    load.add_hessian(rest, data, np.zeros((0, 0), dtype=np.int64))
    assert data[0] == 0.0


def test_frames_follow_an_arc_exactly() -> None:
    """On a circle cut evenly the tangents are those of the circle, ends included; e3 is the given
    direction.
    """
    a = np.linspace(0.2, 1.7, 7)
    rest = rod_at_rest(np.stack([np.cos(a), np.sin(a), 0 * a], axis=1), up=np.array([0.0, 0.0, 2.0]))
    R = rotation(rest.reshape(-1, 7)[:, 3:])
    np.testing.assert_allclose(R[:, :, 0], np.stack([-np.sin(a), np.cos(a), 0 * a], axis=1), atol=1e-14)
    np.testing.assert_allclose(R[:, :, 2], np.tile([0.0, 0.0, 1.0], (7, 1)), atol=1e-14)
    np.testing.assert_allclose(lengths(rest, chain_elements(7)), 2 * np.sin(0.125), rtol=1e-14)


def test_the_reference_direction_defaults_to_the_farthest_axis() -> None:
    """A rod along z with a slight lean in x takes y for e3."""
    rest = rod_at_rest(np.linspace([0.0, 0, 0], [0.1, 0, 1.0], 3))
    np.testing.assert_allclose(
        rotation(rest.reshape(-1, 7)[:, 3:])[:, :, 2], np.tile([0.0, 1.0, 0.0], (3, 1)), atol=1e-15
    )


@pytest.mark.parametrize(
    ("points", "up"),
    [
        ([[0.0, 0, 0]], None),
        ([[0.0, 0, 0], [0, 0, 0], [1, 0, 0]], None),
        ([[0.0, 0, 0], [1, 0, 0]], [1.0, 0, 0]),
    ],
)
def test_impossible_rods_are_refused(points: list[list[float]], up: list[float] | None) -> None:
    """One point, repeated points, and a reference direction along the rod."""
    with pytest.raises(ValueError, match="rod"):
        rod_at_rest(np.array(points), None if up is None else np.array(up))


def test_circular_section() -> None:
    """R = 19 mm, E = 60 kPa, nu = 0.49: A, I, kappa and EI as in the reference card of the silicone beam."""
    section = circular(0.019, 60e3, 0.49)
    assert section.area == pytest.approx(1.1341149e-3, rel=1e-7)
    assert pytest.approx(6.141232443e-3, rel=1e-9) == section.stiffness.EI2
    assert pytest.approx(20.53729281994615, rel=1e-12) == section.stiffness.GA3
    assert pytest.approx(20134.228187919463 * np.pi * 0.019**4 / 2, rel=1e-12) == section.stiffness.GJ


def test_switching_a_mode_off_touches_that_mode_only() -> None:
    """The floor is ratio B / length^2, and never softens a mode that is stiffer already."""
    k = RodStiffness(EA=1.0, GA2=2.0, GA3=1e9, GJ=3.0, EI2=4.0, EI3=5.0)
    assert k.with_suppressed_modes(0.5, shear=True, axial=True) == k
    off = k.with_suppressed_modes(0.5, shear=False, axial=True, ratio=1e6)
    assert off == RodStiffness(EA=1.0, GA2=2e7, GA3=1e9, GJ=3.0, EI2=4.0, EI3=5.0, rigid=(1, 2))
    assert k.with_suppressed_modes(0.5, shear=True, axial=False, ratio=1e6).EA == 2e7


def straight() -> np.ndarray:
    return rod_at_rest(np.linspace([0.1, 0.2, 0.3], [0.1, 2.2, 0.3], 6))


def test_material_points_follow_a_rigid_motion() -> None:
    """Points on, off and beyond the axis move as the body does, to round-off."""
    rng = np.random.default_rng(14)
    X = rng.uniform([-0.3, -0.5, 0.0], [0.5, 2.7, 0.6], size=(50, 3))
    q, shift = random_quaternions(rng, 1)[0], rng.normal(size=3)
    u = displacement_at(turned(straight(), q, shift), straight(), X)
    np.testing.assert_allclose(u, X @ rotation(q).T + shift - X, atol=1e-14)


def test_cross_sections_turn_rigidly_in_a_bent_rod() -> None:
    """Uniform bending: a point at half an element has the middle position and half the angle between its
    nodes.
    """
    rest = straight()
    d = np.zeros((6, 6))
    d[:, :3] = np.random.default_rng(15).normal(size=(6, 3))
    d[:, 5] = 0.4 * np.arange(6)
    x = RodSpace(6).move(rest, d.ravel())
    R0 = rotation(rest[3:7])
    foot, offset = np.array([0.1, 0.2 + 1.5 * 0.4, 0.3]), 0.05 * R0[:, 1]
    middle = x.reshape(-1, 7)[1:3, :3].mean(axis=0)
    angle = 0.6
    expected = middle + 0.05 * R0 @ np.array([-np.sin(angle), np.cos(angle), 0.0])
    u = displacement_at(x, rest, (foot + offset)[None])
    np.testing.assert_allclose(u[0], expected - foot - offset, atol=1e-14)


def test_material_points_need_a_straight_axis() -> None:
    """A bent undeformed rod has no coordinate along one axis."""
    rest = rod_at_rest(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0.1, 0]]))
    with pytest.raises(ValueError, match="not straight"):
        displacement_at(rest, rest, np.zeros((1, 3)))


def test_a_rod_needs_numpy_alone() -> None:
    """A scene with a beam and nothing else starts without numba and scipy."""
    rod = "softmark.solvers.energies.geometrically_exact_rod"
    code = f"import sys, {rod}; print(sorted({{'numba', 'scipy'}} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
