"""The geometrically exact rod against known solutions: cantilevers, loops, the curved cantilever, the
silicone beam.

Numbers come from the catalogue of verification problems (sections 1.3, 3.2 and 3.4): closed forms or
boundary value problems solved there independently of any finite element.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from end_force import concentrated

from softmark.solvers.energies.energy import Space
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_section import RodStiffness, circular
from softmark.solvers.energies.rod_state import RodChain, RodSpace, chain_elements, rod_at_rest


@dataclass(frozen=True)
class Cantilever:
    """A rod clamped at its first node under one dead load."""

    elastic: RodElastic
    load: RodForces
    space: Space

    @property
    def free(self) -> np.ndarray:
        return np.arange(6, self.space.dofs)

    def energy(self, x: np.ndarray) -> float:
        return self.elastic.value(x) + self.load.value(x)

    def residual(self, x: np.ndarray) -> np.ndarray:
        g = np.zeros(self.space.dofs)
        self.elastic.add_gradient(x, g)
        self.load.add_gradient(x, g)
        return np.asarray(g[self.free])

    def tangent(self, x: np.ndarray, projected: bool = False) -> np.ndarray:
        dofs, stencils = self.space.dofs, self.elastic.stencils
        data = np.zeros(dofs * dofs)
        slots = stencils[:, :, None] * dofs + stencils[:, None, :]
        self.elastic.add_hessian(x, data, slots, projected=projected)
        return np.asarray(data.reshape(dofs, dofs)[6:, 6:])


def clamped(rest: np.ndarray, stiffness: RodStiffness, load: RodForces, *, plain: bool = False) -> Cantilever:
    nodes = rest.size // 7
    held = np.zeros((nodes, 3), dtype=bool)
    held[0] = True
    space: Space = RodSpace(nodes) if plain else RodChain(rest, held)
    return Cantilever(RodElastic(rest, chain_elements(nodes), stiffness), load, space)


def straight(length: float, segments: int) -> np.ndarray:
    """Along x, e3 = z."""
    return rod_at_rest(np.linspace([0.0, 0, 0], [length, 0, 0], segments + 1), up=np.array([0.0, 0.0, 1.0]))


def solve(rod: Cantilever, start: np.ndarray | None = None) -> tuple[np.ndarray, int]:
    """Newton's method at full load, from rest or `start`, backtracking on the energy: state and steps.

    It stops when the energy still to be gained is 1e-20 of the strain energy: an error of 1e-10 in the state.
    """
    x = rod.elastic.rest if start is None else start
    for step in range(200):
        g = rod.residual(x)
        d = np.linalg.solve(rod.tangent(x), -g)
        if g @ d > 0:
            d = np.linalg.solve(rod.tangent(x, projected=True), -g)
        if step and -(g @ d) < 1e-20 * rod.elastic.value(x):
            return x, step
        x = backtrack(rod, x, d, float(g @ d))
    raise AssertionError("Newton's method did not converge")


def backtrack(rod: Cantilever, x: np.ndarray, d: np.ndarray, slope: float) -> np.ndarray:
    """The first of 1, 1/2, 1/4 ... that decreases the energy; round-off counts as equal."""
    start, length = rod.energy(x), 1.0
    increment = np.concatenate([np.zeros(6), d])
    while length > 1e-9:
        y = rod.space.move(x, length * increment)
        if rod.energy(y) <= start + 1e-4 * length * slope + 1e-13 * abs(start):
            break
        length /= 2
    return y


def solve_rigid(rod: Cantilever) -> np.ndarray:
    """With switched-off modes: solve, take their strain into the multipliers, solve again; it must go."""
    x, _ = solve(rod)
    assert 0 < rod.elastic.rigid_fraction(x) < 1e-4
    tight = replace(rod, elastic=rod.elastic.with_multipliers(x))
    y, steps = solve(tight, x)
    assert steps <= 3
    assert tight.elastic.rigid_fraction(y) < 1e-12
    return y


def tip(x: np.ndarray) -> np.ndarray:
    return x.reshape(-1, 7)[-1, :3]


@pytest.mark.parametrize(("h", "total"), [(0.1, 0.040312), (0.2, 0.002578), (0.5, 7.648e-05)])
def test_small_deflection_is_that_of_timoshenko(h: float, total: float) -> None:
    """Section 3.2: square side h, L = 1 m, E = 1 MPa, nu = 0.3, P = 1 N, kappa = 5/6; the table has 4 to 5
    digits.

    One point per element makes the bending part 1 - 1/(4 n^2) of the exact one: n = 50 costs 1e-4, and no
    locking.
    """
    E, G, A, I = 1e6, 1e6 / 2.6, h * h, h**4 / 12
    stiffness = RodStiffness(E * A, 5 / 6 * G * A, 5 / 6 * G * A, 0.141 * G * h**4, E * I, E * I)
    rest = straight(1.0, 50)
    rod = clamped(rest, stiffness, concentrated(rest, -1, np.array([0.0, 0.0, 1.0])))
    u = np.linalg.solve(rod.tangent(rest), -rod.residual(rest))
    assert u[-4] == pytest.approx(total, rel=2e-4)
    assert u[-4] == pytest.approx(1 / (3 * E * I) * (1 - 1 / 10000) + 1 / (5 / 6 * G * A), rel=1e-9)


def test_small_twist_and_stretch_are_exact() -> None:
    """Linear elements reproduce P L / EA and, with a moment about the axis, M L / GJ: round-off."""
    rest = straight(2.0, 7)
    stiffness = RodStiffness(3.0, 1.0, 1.0, 0.5, 0.7, 0.8)
    rod = clamped(rest, stiffness, concentrated(rest, -1, np.array([1e-3, 0.0, 0.0])))
    K, moment = rod.tangent(rest), np.zeros(42)
    moment[-3] = 1e-3
    assert np.linalg.solve(K, -rod.residual(rest))[-6] == pytest.approx(1e-3 * 2 / 3, rel=1e-12)
    assert np.linalg.solve(K, moment)[-3] == pytest.approx(1e-3 * 2 / 0.5, rel=1e-12)


@pytest.mark.parametrize(
    ("degrees", "x_L", "y_L"),
    [(90, 0.636620, 0.636620), (180, 0.0, 0.636620), (270, -0.212207, 0.212207), (360, 0.0, 0.0)],
)
def test_moment_rolls_the_rod_up(degrees: float, x_L: float, y_L: float) -> None:
    """Section 3.4: M = theta EI / L bends the rod to a circle of radius L / theta.

    The elements are chords of length l, so the polygon is larger than the circle by (delta / 2) / sin(delta
    / 2), delta = theta / n: this discrete solution is met to round-off, the circle to that factor (0.16 %
    at most here). One Newton step gets there, as twist and bending are linear in the increment when all
    rotations share an axis.
    """
    n, L, EI, theta = 32, 2.0, 3.0, np.radians(degrees)
    rest = straight(L, n)
    rod = clamped(rest, RodStiffness(1e3, 4e2, 4e2, 1.0, EI, EI), RodForces(rest, np.zeros((n + 1, 3))))
    moment = np.zeros(6 * n)
    moment[-1] = theta * EI / L
    x = rod.space.move(rest, np.concatenate([np.zeros(6), np.linalg.solve(rod.tangent(rest), moment)]))
    np.testing.assert_allclose(rod.residual(x), moment, atol=1e-9)
    factor = (theta / n / 2) / np.sin(theta / n / 2)
    exact = np.array([np.sin(theta), 1 - np.cos(theta)]) * L / theta
    np.testing.assert_allclose(tip(x)[:2], factor * exact, atol=1e-10)
    np.testing.assert_allclose(tip(x)[:2] / L, [x_L, y_L], atol=2e-3 * float(np.hypot(x_L, y_L)) + 1e-6)


def bend(P: float, segments: int, *, plain: bool = False) -> Cantilever:
    """Bathe & Bolourchi 1979: radius 100, 45 degrees, unit square, E = 1e7, nu = 0, GJ = EI, kappa = 5/6."""
    a = np.linspace(0.0, np.pi / 4, segments + 1)
    rest = rod_at_rest(100 * np.stack([np.sin(a), 1 - np.cos(a), 0 * a], axis=1), up=np.array([0.0, 0.0, 1.0]))
    stiffness = RodStiffness(1e7, 5e6 * 5 / 6, 5e6 * 5 / 6, 1e7 / 12, 1e7 / 12, 1e7 / 12)
    return clamped(rest, stiffness, concentrated(rest, -1, np.array([0.0, 0.0, P])), plain=plain)


@pytest.mark.parametrize(
    ("P", "exact"),
    [
        (300.0, (58.77889732, 22.24467942, 40.19239233)),
        (450.0, (52.23826184, 18.50806487, 48.50349154)),
        (600.0, (47.15009623, 15.68468948, 53.47547800)),
    ],
)
def test_curved_cantilever_under_out_of_plane_load(P: float, exact: tuple[float, float, float]) -> None:
    """Section 3.4, boundary value problem of the same rod (residual 1e-11). Bending, twist and stretch
    interact.

    With 16 elements the tip is 0.034 to 0.035 off (0.06 % of its displacement) and the order is 2;
    Richardson's extrapolation from 16 and 32 leaves an error of fourth order, at most 1.8e-5.
    """
    coarse, fine = (tip(solve(bend(P, n))[0]) for n in (16, 32))
    np.testing.assert_allclose((4 * fine - coarse) / 3, exact, atol=3e-5)
    ratio = np.linalg.norm(coarse - exact) / np.linalg.norm(fine - exact)
    assert np.log2(ratio) == pytest.approx(2.0, abs=0.1)
    assert np.linalg.norm(coarse - exact) < 0.04


@pytest.mark.parametrize(
    ("alpha", "down", "back"),
    [(1.0, 0.301721, 0.056433), (4.0, 0.669964, 0.328941), (10.0, 0.810609, 0.554996)],
)
def test_end_load_on_an_inextensible_unshearable_rod(alpha: float, down: float, back: float) -> None:
    """Section 3.4, Bisshopp & Drucker 1945: P L^2 / EI = alpha, elliptic integrals, six digits.

    Richardson's extrapolation from 20 and 40 elements; tolerance: the sixth digit of the table and the
    error of fourth order, together 4e-7 as measured.
    """
    tips = []
    for n in (20, 40):
        rest = straight(1.0, n)
        stiffness = RodStiffness(9.0, 8.0, 8.0, 0.5, 1.0, 1.0).with_suppressed_modes(1.0, shear=False, axial=False)
        rod = clamped(rest, stiffness, concentrated(rest, -1, np.array([0.0, 0.0, -alpha])))
        tips.append(tip(solve_rigid(rod)))
    extrapolated = (4 * tips[1] - tips[0]) / 3
    np.testing.assert_allclose(extrapolated, [1 - back, 0.0, -down], atol=1e-6)


@pytest.mark.parametrize(("shear", "axial"), [(False, True), (True, False)])
def test_one_mode_can_be_off_alone(shear: bool, axial: bool) -> None:
    """The other mode keeps its own strain; the limit is that of an ever larger stiffness, here 1e8 B / L^2.

    That penalty leaves 10 L / 1e8, the tolerance.
    """
    rest = straight(1.0, 10)
    load = concentrated(rest, -1, np.array([0.0, 0.0, -4.0]))
    soft = RodStiffness(300.0, 100.0, 100.0, 0.5, 1.0, 1.0)
    tight = solve_rigid(clamped(rest, soft.with_suppressed_modes(1.0, shear=shear, axial=axial), load))
    stiff, _ = solve(clamped(rest, soft.with_suppressed_modes(1.0, shear=shear, axial=axial, ratio=1e8), load))
    np.testing.assert_allclose(tip(tight), tip(stiff), atol=1e-7)
    assert np.linalg.norm(tip(tight) - tip(solve(clamped(rest, soft, load))[0])) > 1e-3


def test_switching_modes_off_costs_no_newton_steps() -> None:
    """Moves of a chain keep the steps at the 7 of the flexible rod; with plain moves the penalty takes over
    80.
    """
    rest = straight(1.0, 10)
    load = RodForces.uniform(rest, chain_elements(11), np.array([0.0, 0.0, -10.93237]))
    soft = RodStiffness(347.0, 105.0, 105.0, 0.67, 1.0, 1.0)
    stiff = soft.with_suppressed_modes(1.0, shear=False, axial=False)
    _, steps_soft = solve(clamped(rest, soft, load))
    _, steps_stiff = solve(clamped(rest, stiff, load))
    assert steps_soft <= 9
    assert steps_stiff <= 10


def test_chain_moves_spare_newton_steps_in_space() -> None:
    """45-degree bend at P = 300 in one load step: 6 steps against about 40, to the same equilibrium."""
    (x, steps), (y, plain_steps) = (solve(bend(300.0, 8, plain=plain)) for plain in (False, True))
    np.testing.assert_allclose(tip(x), tip(y), atol=1e-7)
    assert steps <= 8 < plain_steps


SILICONE_TIP = np.array([0.11082205454830377, 0.0, -0.13372721540648552])
SILICONE_LENGTH = 0.178


def silicone(segments: int, **modes: bool) -> Cantilever:
    """R = 19 mm, rho = 1070 kg/m^3, E = 60 kPa, nu = 0.49, g = 9.81 m/s^2, clamped, at full weight."""
    section = circular(0.019, 60e3, 0.49)
    rest = straight(SILICONE_LENGTH, segments)
    load = RodForces.uniform(rest, chain_elements(segments + 1), np.array([0.0, 0.0, -1070 * 9.81 * section.area]))
    stiffness = section.stiffness.with_suppressed_modes(SILICONE_LENGTH, **modes) if modes else section.stiffness
    return clamped(rest, stiffness, load)


def test_silicone_beam_sags_as_the_reissner_rod() -> None:
    """Section 1.3, planar Simo-Reissner boundary value problem: tip (110.82, -133.73) mm; 40 segments
    within 0.5 %.

    The error must fall with order 2: 0.109, 0.0266, 0.00661 and 0.00165 mm were measured.
    """
    errors = np.array([np.linalg.norm(tip(solve(silicone(n))[0]) - SILICONE_TIP) for n in (10, 20, 40, 80)])
    assert errors[2] < 0.005 * np.linalg.norm([0.06718, 0.13373])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.1)


def test_silicone_beam_without_shear_and_stretch_is_the_elastica() -> None:
    """Section 1.3: tip (111.85239521, -128.44934884) mm. Richardson from 20 and 40 segments: 4e-8 m was
    measured.
    """
    coarse, fine = (tip(solve_rigid(silicone(n, shear=False, axial=False))) for n in (20, 40))
    exact = [0.11185239521246813, 0.0, -0.12844934883944195]
    np.testing.assert_allclose((4 * fine - coarse) / 3, exact, atol=1.5e-7)


def test_rounding_bounds_what_newton_leaves() -> None:
    """With switched-off modes the residual stalls near machine epsilon times their stiffness, and not far
    below.
    """
    rod = silicone(40, shear=False, axial=False)
    x, _ = solve(rod)
    left = np.linalg.norm(rod.residual(x).reshape(-1, 6)[:, :3])
    assert 0.01 < left / rod.elastic.rounding(x) < 1.0
