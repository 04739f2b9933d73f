"""Blocks end to end: by the solver's own law, by Hooke's rule, by what limits of the formulas are, and by balance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from softmark.references.contact_patch_test import Block, BlockMaterial, DeformedStack, Joint, PatchTest, Stack
from softmark.references.straight_cantilever import NotApplicable
from softmark.solvers.materials.neo_hookean import NeoHookean

HOOKE = BlockMaterial(1e6, 0.3, False, 2)
RUBBER = BlockMaterial(1e6, 0.3, True, 2)


def stack(*solids: BlockMaterial, gap: float = 1e-4, ends: tuple[float | None, float | None] = (0.0, -1e-3)) -> Stack:
    """Cubes of 10 mm along z, one of each solid, with a gap between."""
    lows = [i * (0.01 + gap) for i in range(len(solids))]
    blocks = tuple(Block(low, low + 0.01, solid, (0.0, 0.0, 0.0)) for low, solid in zip(lows, solids, strict=True))
    joints = tuple(Joint(gap) for _ in solids[1:])
    high = (0.01, 0.01, lows[-1] + 0.01)
    return Stack(blocks, joints, 2, (0, 1), (0.0, 0.0, 0.0), high, 1e-4, False, ends)


def solved(of: Stack) -> DeformedStack:
    """What becomes of it."""
    return PatchTest("b").solve(of)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("free", [1, 2])
@pytest.mark.parametrize("e", [-0.8, -1e-6, 0.5])
def test_the_stress_of_rubber_is_that_of_its_law(nu: float, free: int, e: float) -> None:
    """The law of the solvers, whose formulas are its own, at the stretches found: nothing across, P along; rounding."""
    solid = BlockMaterial(1e6, nu, True, free)
    l, t = math.exp(e), math.exp(solid.lateral_log_stretch(e)[0])
    F = np.diag([t, t if free == 2 else 1.0, l])[None]
    law = NeoHookean(young=1e6, poisson=nu, density=1.0).finite_law()
    assert law is not None
    P = law.P(F)[0]
    own, slope = solid.pull(e)
    assert P[2, 2] == pytest.approx(own, rel=1e-9, abs=1e-7)
    assert P[0, 0] == pytest.approx(0.0, abs=1e-9 * abs(own) + 1e-7)
    assert slope == pytest.approx((solid.pull(e + 1e-6)[0] - solid.pull(e - 1e-6)[0]) / 2e-6, rel=1e-6)
    along, across, softness = solid.strains(own)
    assert (along, across) == pytest.approx((l - 1.0, t - 1.0), rel=1e-9, abs=1e-15)
    assert softness == pytest.approx(l / slope, rel=1e-9)
    axial, held = solid.stresses(own)
    J = float(np.linalg.det(F[0]))
    assert axial == pytest.approx(P[2, 2] * l / J, rel=1e-9, abs=1e-7)
    assert free == 2 or held == pytest.approx(P[1, 1] / J, rel=1e-8, abs=1e-7)


def test_rubber_that_keeps_its_volume_is_the_limit() -> None:
    """P = mu (l - l^-2), in plane strain mu (l - l^-3); small strains are Hooke's, to the strain of 1e-7."""
    for free, power in ((2, -2.0), (1, -3.0)):
        pull, _ = BlockMaterial(3e6, 0.5, True, free).pull(math.log(0.7))
        assert pull == pytest.approx(1e6 * (0.7 - 0.7**power), rel=1e-12)
        for nu in (0.0, 0.3, 0.5):
            large, small = (BlockMaterial(1e6, nu, law, free).strains(-0.1)[:2] for law in (True, False))
            assert large == pytest.approx(small, rel=1e-6, abs=1e-20)


def test_a_pressure_acts_on_what_the_end_has_become() -> None:
    """Cauchy stress is -p; a dead traction is P itself."""
    P = RUBBER.stress_under_loads(0.0, 4e5)
    assert RUBBER.stresses(P)[0] == pytest.approx(-4e5, rel=1e-12)
    assert RUBBER.stress_under_loads(-4e5, 0.0) == pytest.approx(-4e5, rel=1e-12)
    assert HOOKE.stress_under_loads(-1.0, 3.0) == -4.0


def test_blocks_of_two_moduli_by_hand() -> None:
    """0.9 mm are left of 1 mm: P = -0.9 mm / (10 mm / 1 MPa + 10 mm / 4 MPa) = -72 kPa, and 7.2 N through 1 cm^2."""
    found = solved(stack(HOOKE, replace(HOOKE, young=4e6)))
    assert found.stress == pytest.approx(-72e3, rel=1e-12)
    assert (found.push, found.left) == pytest.approx((7.2, 0.0))
    points = np.array([[0.01, 0.0, 0.0], [0.01, 0.0, 0.01], [0.01, 0.0, 0.0101], [0.01, 0.0, 0.0201]])
    moved = found.displacement(points)
    assert moved[:, 2] == pytest.approx([0.0, -0.72e-3, -0.82e-3, -1e-3], abs=1e-15)
    assert moved[:, 0] == pytest.approx([0.3 * 0.072 * 0.01] * 2 + [0.3 * 0.018 * 0.01] * 2, rel=1e-12)
    assert found.relative_errors["strain"] == pytest.approx(0.072)
    assert found.relative_errors["overhang"] == pytest.approx(1.0 - (1.0054 / 1.0216) ** 2, rel=1e-9)
    assert found.area == 1e-4


@pytest.mark.parametrize("solids", [(HOOKE, HOOKE), (RUBBER, RUBBER), (RUBBER, replace(RUBBER, young=3e6), RUBBER)])
def test_ends_go_where_they_are_moved_and_faces_meet(solids: tuple[BlockMaterial, ...]) -> None:
    """To rounding, by as much as half of its length."""
    own = stack(*solids, ends=(2e-4, -0.005 * len(solids)))
    found = solved(own)
    ends = np.array([[0.0, 0.0, block.low] for block in own.blocks] + [[0.0, 0.0, block.high] for block in own.blocks])
    z = ends[:, 2] + found.displacement(ends)[:, 2]
    n = len(solids)
    assert z[0] == pytest.approx(2e-4, rel=1e-12)
    assert z[-1] == pytest.approx(own.high[2] + own.ends[1], rel=1e-12)
    assert z[1:n] == pytest.approx(z[n : 2 * n - 1], abs=1e-15)


def test_a_gap_that_is_not_closed() -> None:
    """Nothing presses, blocks go with their ends, and the rest of the gap is left."""
    found = solved(stack(HOOKE, HOOKE, ends=(1e-5, -4e-5)))
    assert (found.stress, found.push, found.area, found.left) == pytest.approx((0.0, 0.0, 0.0, 5e-5))
    moved = found.displacement(np.array([[0.01, 0.01, 0.005], [0.01, 0.01, 0.02]]))
    assert moved == pytest.approx(np.array([[0.0, 0.0, 1e-5], [0.0, 0.0, -4e-5]]), abs=1e-18)


def test_blocks_that_only_touch_do_not_press() -> None:
    """A travel of the gap, or by rounding more: 1e-17 m would be a push that is nothing else than rounding."""
    for more in (0.0, 1e-17):
        found = solved(stack(HOOKE, HOOKE, ends=(0.0, -1e-4 - more)))
        assert (found.stress, found.area) == (0.0, 0.0)
        assert found.left == pytest.approx(0.0, abs=1e-16)


def test_gradients_are_those_of_displacements_and_work_is_force_times_way() -> None:
    """By central differences, 1e-9; dW/dd of the stack is the push: P is the slope of the energy of its law."""
    found = solved(stack(RUBBER, RUBBER, ends=(0.0, -4e-3)))
    X = np.array([[0.003, 0.004, 0.006], [0.002, 0.001, 0.013]])
    H, sigma = found.fields(X)
    h = 1e-6
    for c in range(3):
        step = h * np.eye(3)[c]
        slope = (found.displacement(X + step) - found.displacement(X - step)) / (2.0 * h)
        assert H[:, :, c] == pytest.approx(slope, abs=1e-9)
    F = H + np.eye(3)
    areas = np.linalg.det(F) / F[:, 2, 2]
    assert sigma[:, 2, 2] * areas == pytest.approx([found.stress] * 2, rel=1e-12)
    assert found.joint_contact_area(0) == pytest.approx(1e-4 * areas[0], rel=1e-12)


def test_what_no_law_holds() -> None:
    with pytest.raises(NotApplicable, match="exceeds what the law can carry"):
        RUBBER.strains(-math.inf)
    with pytest.raises(NotApplicable, match="reduce the compression"):
        RUBBER.stress_under_loads(0.0, math.inf)
