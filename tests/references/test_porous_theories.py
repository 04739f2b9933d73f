"""Theories of porous bodies: against published numbers, numerical inversion of Laplace's transform, and finite volumes.

Numbers of the shared catalogue (section 3.9) come from series and, for Armstrong's disc, from Laplace's domain.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import erfc, iv

from softmark.references.confined_compression import Confined, Permeability, PressedColumn, chebyshev_matrix
from softmark.references.elastica_collocation import NotSolved
from softmark.references.mandel import Mandel
from softmark.references.poroelastic_compression import CompressedPorousBody, find_mode_roots
from softmark.references.porous_skeletons import Skeleton
from softmark.references.prony import Amplitude, HarmonicAmplitudeSegment
from softmark.references.rubber_energies import Rubber
from softmark.references.straight_cantilever import NotApplicable
from softmark.references.terzaghi import Column, Terzaghi

ONCE = Amplitude([(0.0, 1.0)], [])
RAMP = Amplitude([], [HarmonicAmplitudeSegment(0.0, 0.1, 10.0)])
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)


def column(
    t: float, force: bool = True, drains: str = "driven", driven: Amplitude = ONCE, amount: float = -1.0
) -> Column:
    """Of unit height, area, modulus and permeability."""
    return Column(1.0, 1.0, ORIGIN, Z, drains, 1.0, 1.0, force, amount, driven, t)


def squeezed(n: int, nu: float, t: float, force: bool, driven: Amplitude = ONCE) -> CompressedPorousBody:
    """Of unit shear modulus, half-width, height and time of diffusion; area 2 of a slab, pi of a disc."""
    modulus = 2.0 * (1.0 - nu) / (1.0 - 2.0 * nu)
    area = 2.0 if n == 1 else math.pi
    return CompressedPorousBody(n, 1.0, 1.0, area, ORIGIN, Z, X, 1.0, modulus, 1.0 / modulus, force, -1.0, driven, t)


def places(*z: float) -> np.ndarray:
    return np.array([[0.0, 0.0, s] for s in z])


def across(*x: float) -> np.ndarray:
    return np.array([[s, 0.0, 0.0] for s in x])


def inverted(transform: Callable[[complex], complex], t: float, n: int = 32) -> float:
    """Laplace's transform inverted by the fixed Talbot rule (Abate and Valko 2004), to about 1e-9."""
    r = 0.4 * n / t
    total = 0.5 * cmath.exp(r * t) * transform(complex(r, 0.0))
    for k in range(1, n):
        a = k * math.pi / n
        s = r * a * complex(1.0 / math.tan(a), 1.0)
        sigma = a + (a / math.tan(a) - 1.0) / math.tan(a)
        total += cmath.exp(s * t) * transform(s) * complex(1.0, sigma)
    return (r / n * total).real


# ------------------------------------------------------------------ columns


@pytest.mark.parametrize(
    ("T", "U"),
    [(0.01, 0.112838), (0.05, 0.252313), (0.1, 0.356823), (0.197, 0.500338), (0.5, 0.763950), (1.0, 0.931260)],
)
def test_settlement(T: float, U: float) -> None:
    assert -column(T).travel == pytest.approx(U, abs=1e-6)
    assert column(T).lost == pytest.approx(U, abs=1e-6)


@pytest.mark.parametrize(("T", "p"), [(0.01, 1.0), (0.1, 0.949305), (0.5, 0.370777), (1.0, 0.107977)])
def test_pressure_at_the_tight_end(T: float, p: float) -> None:
    assert column(T).pressure(places(0.0))[0] == pytest.approx(p, abs=1e-6)


@pytest.mark.parametrize(("T", "s"), [(0.15, 0.184776), (0.2, 0.148339), (0.5, 0.102453), (1.0, 0.100018)])
def test_relaxation_after_a_ramp(T: float, s: float) -> None:
    """Mow 1980."""
    assert -column(T, force=False, driven=RAMP, amount=-0.1).pull == pytest.approx(s, abs=1e-6)


def test_the_ramp_itself_is_that_of_a_half_space() -> None:
    """2 sqrt(T/pi) while the far end knows nothing, to exp(-1/T). The catalogue's 0.252263 at 0.05 is a sum cut off."""
    for T in (1e-6, 1e-3, 0.02, 0.05):
        own = column(T, force=False, driven=RAMP, amount=-0.1)
        assert -own.pull == pytest.approx(2.0 * math.sqrt(T / math.pi), rel=1e-7)


@pytest.mark.parametrize("T", [1e-7, 1e-5, 1e-3])
def test_what_is_young_is_a_layer_at_the_open_end(T: float) -> None:
    """p = 1 - erfc(y / 2 sqrt T) at a distance y from the open end, u = 2 sqrt(T / pi) there."""
    y = math.sqrt(T) * np.array([0.1, 0.5, 1.0, 2.0])
    own = column(T)
    np.testing.assert_allclose(own.pressure(places(*(1.0 - y))), 1.0 - erfc(0.5 * y / math.sqrt(T)), rtol=1e-9)
    assert -own.travel == pytest.approx(2.0 * math.sqrt(T / math.pi), rel=1e-9)
    assert own.estimated_error < 1e-9


def test_nothing_has_left_at_once() -> None:
    own = column(0.0)
    assert own.travel == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_allclose(own.pressure(places(0.0, 0.5, 1.0)), [1.0, 1.0, 0.0], atol=1e-14)
    with pytest.raises(NotSolved, match="infinite"):
        Terzaghi("plug").solve(column(0.0, force=False))


@pytest.mark.parametrize("force", [True, False])
def test_what_modes_do_not_tell_is_not_told(force: bool) -> None:
    """A force 9 times too large, 1e-12 of the time of diffusion after a ramp begins, by as many modes as there are."""
    driven = ONCE if force else Amplitude([], [HarmonicAmplitudeSegment(0.0, 1.0, 1.0)])
    for t, told in ((1e-12, False), (1e-7, True)):
        own = column(t, force, driven=driven)
        if told:
            found = Terzaghi("plug").solve(own)
            half_space = 2.0 * math.sqrt(t / math.pi)
            assert -(found.travel if force else found.pull) == pytest.approx(half_space, rel=1e-6)
        else:
            with pytest.raises(NotSolved, match="sum over modes"):
                Terzaghi("plug").solve(own)
    with pytest.raises(NotSolved, match="sum over modes"):
        Mandel("slab").solve(squeezed(1, 0.2, 1e-12, True))


def test_a_layer_too_thin_for_collocation_is_not_told() -> None:
    with pytest.raises(NotSolved):
        Confined("plug").solve(pressed(1e-11, True, -0.2, ONCE, MOW))


def stepped(column: Column, n: int = 200) -> tuple[np.ndarray, np.ndarray, float]:
    """Finite volumes in space, BDF in time: z, p and the total stress, of RAMP.

    Under a force of the pressure, p_t = p_zz - s_t; where it is moved of the strain, e_t = e_zz, whose flux at the open
    end is how fast it is moved, and p is e less what it is there.
    """
    z = (np.arange(n) + 0.5) / n
    left, right = {"driven": (0.0, 1.0), "held": (1.0, 0.0), "both": (0.5, 0.5)}[column.drains]

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        slope = column.amount * 10.0 if t <= 0.1 else 0.0
        flux = np.zeros(n + 1)
        flux[1:-1] = np.diff(y) * n
        if column.force:
            flux[0] = (9.0 * y[0] - y[1]) / 3.0 * n if left else 0.0  # of second order to y = 0 at the face
            flux[-1] = -(9.0 * y[-1] - y[-2]) / 3.0 * n if right else 0.0
            return np.diff(flux) * n - slope
        flux[0], flux[-1] = -left * slope, right * slope
        return np.diff(flux) * n

    y = np.zeros(n)
    for begin, end in ((0.0, 0.1), (0.1, column.now)):
        y = solve_ivp(rate, (begin, end), y, method="BDF", rtol=1e-8, atol=1e-11).y[:, -1]
    if column.force:
        return z, y, column.amount
    at_end = (
        (15.0 * y[0] - 10.0 * y[1] + 3.0 * y[2]) / 8.0 if left else (15.0 * y[-1] - 10.0 * y[-2] + 3.0 * y[-3]) / 8.0
    )
    return z, y - at_end, at_end


@pytest.mark.parametrize("drains", ["driven", "held", "both"])
@pytest.mark.parametrize("force", [True, False])
def test_a_ramp_against_finite_volumes(drains: str, force: bool) -> None:
    """The difference is that of 200 cells: of a mode's rate M^2 <= 4 pi^2, (M / 200)^2 / 12, so 1.6e-4 after 0.05."""
    own = column(0.15, force, drains, RAMP)
    z, p, stress = stepped(own)
    np.testing.assert_allclose(own.pressure(places(*z)), p, atol=2e-4 * np.abs(p).max())
    assert own.pull == pytest.approx(stress, rel=2e-4)
    np.testing.assert_allclose(own.displacement(places(0.0, 1.0))[:, 2], [0.0, own.travel], atol=1e-12)
    strain = (own.pull + own.pressure(places(*z))).mean()  # of all of it
    assert strain == pytest.approx(own.travel, abs=1e-5)


def test_a_swing_of_a_column() -> None:
    """Steady swings: a half space's impedance; the far end counts no more than exp(-sqrt(w/2))."""
    w, t = 2000.0, 0.7
    own = column(t, False, "driven", Amplitude([], [HarmonicAmplitudeSegment(0.0, 1.0, w, w)]))
    steady = (cmath.sqrt(1j * w) * cmath.exp(1j * w * t)).imag
    assert -own.pull == pytest.approx(steady, rel=1e-2 * abs(cmath.sqrt(1j * w)) / abs(steady))


# ------------------------------------------------------------------ between plates


@pytest.mark.parametrize(
    ("nu", "T", "relaxation", "creep"),
    [
        (0.0, 0.01, 1.44115, 0.69364),
        (0.0, 0.1, 1.30025, 0.76531),
        (0.0, 0.5, 1.07682, 0.91007),
        (0.1, 0.01, 1.31656, 0.75935),
        (0.1, 0.1, 1.20755, 0.82529),
        (0.3, 0.01, 1.12896, 0.88568),
        (0.3, 0.5, 1.01240, 0.98583),
    ],
)
def test_unconfined_compression(nu: float, T: float, relaxation: float, creep: float) -> None:
    young = 2.0 * (1.0 + nu)
    assert -squeezed(2, nu, T, False).pull / (math.pi * young) == pytest.approx(relaxation, abs=1e-5)
    assert -squeezed(2, nu, T, True).axial * young * math.pi == pytest.approx(creep, abs=1e-5)


def test_roots_of_the_disc_that_is_moved() -> None:
    known = {0.0: (1.8412, 5.3314, 8.5363), 0.1: (1.9233, 5.3530, 8.5495), 0.3: (2.1257, 5.4139, 8.5870)}
    for nu, own in known.items():
        g = 0.5 * (1.0 - 2.0 * nu) / (1.0 - nu)
        np.testing.assert_allclose(find_mode_roots(2, g, False, 3), own, atol=1e-4)


@pytest.mark.parametrize(
    ("x", "T", "p"),
    [
        (0.0, 0.01, 1.04376),
        (0.0, 0.05, 1.09888),
        (0.0, 0.1, 1.09541),
        (0.0, 0.2, 0.96811),
        (0.0, 0.5, 0.59279),
        (0.0, 1.0, 0.25884),
        (0.5, 0.01, 1.04335),
        (0.5, 0.1, 0.86090),
        (0.5, 0.5, 0.42813),
    ],
)
def test_mandel(x: float, T: float, p: float) -> None:
    """Of F = 1 on a width of 2 the fluid has 1/4 at once."""
    assert squeezed(1, 0.2, T, True).pressure(across(x))[0] / 0.25 == pytest.approx(p, abs=1e-5)


def transforms(n: int, nu: float, force: bool, r: float) -> dict[str, Callable[[complex], complex]]:
    """Of the answers to a step, by the boundary-value problem itself: t = A C(q r), and the conditions at r = 1."""
    G, H = 1.0, 2.0 * (1.0 - nu) / (1.0 - 2.0 * nu)

    def solved(s: complex) -> tuple[complex, complex, complex, complex]:
        q = cmath.sqrt(s)  # diffusion takes a time of 1
        at, mean = (cmath.cosh(q), cmath.sinh(q) / q) if n == 1 else (iv(0, q), 2.0 * iv(1, q) / q)
        inside = cmath.cosh(q * r) if n == 1 else iv(0, q * r)
        within = (cmath.sinh(q * r) / (q * r)) if n == 1 else 2.0 * iv(1, q * r) / (q * r)
        if n == 1:  # A at = 2 G/H e; stress 2 G (2 e - A mean)
            rows = [[at, -2.0 * G / H], [-2.0 * G * mean, 4.0 * G]]
        else:  # A at = G/H (e + A mean); stress G (3 e - A mean)
            rows = [[at - G / H * mean, -G / H], [-G * mean, 3.0 * G]]
        area = 2.0 if n == 1 else math.pi
        if force:
            A, e = np.linalg.solve(np.array(rows), np.array([0.0, -1.0 / (area * s)]))
        else:
            e = -1.0 / s
            A = -rows[0][1] * e / rows[0][0]
        stress = rows[1][0] * A + rows[1][1] * e
        return H * A * (inside - at), r / n * (A * within - e), e, area * stress

    return {name: (lambda s, i=i: solved(s)[i]) for i, name in enumerate(("pressure", "bulge", "axial", "pull"))}


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("force", [True, False])
@pytest.mark.parametrize("nu", [-0.3, 0.0, 0.3, 0.49])
def test_points_between_plates_by_inversion_of_the_transform(n: int, force: bool, nu: float) -> None:
    for T in (0.003, 0.05, 0.4):
        own, r = squeezed(n, nu, T, force), 0.6
        known = {name: inverted(f, T) for name, f in transforms(n, nu, force, r).items()}
        assert own.pressure(across(r))[0] == pytest.approx(known["pressure"], abs=1e-7)
        assert own.displacement(across(r))[0, 0] == pytest.approx(known["bulge"], abs=1e-7)
        assert own.axial == pytest.approx(known["axial"], abs=1e-7)
        assert own.pull == pytest.approx(known["pull"], rel=1e-7)


@pytest.mark.parametrize(("n", "at_once", "in_the_end"), [(1, 4.0, 4.0 / 1.6), (2, 3.0, 2.4)])
def test_at_once_it_keeps_its_volume_and_in_the_end_it_is_drained(n: int, at_once: float, in_the_end: float) -> None:
    """Of nu = 0.2 and G = 1: 4 G to 4 G (1 - g) = E / (1 - nu^2) in plane strain, 3 G to E without."""
    area = 2.0 if n == 1 else math.pi
    assert -squeezed(n, 0.2, 0.0, False).pull == pytest.approx(at_once * area)
    assert -squeezed(n, 0.2, 50.0, False).pull == pytest.approx(in_the_end * area)
    assert -squeezed(n, 0.2, 0.0, True).axial == pytest.approx(1.0 / (at_once * area))
    moved = squeezed(n, 0.2, 0.0, True).displacement(np.array([[1.0, 0.0, 1.0]]))[0]
    assert moved[0] == pytest.approx(-moved[2] / n)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2])
def test_a_course_moves_it_as_the_force_of_that_course_presses(n: int) -> None:
    """What a force brings about in time, imposed as a table, takes that force: each way is the other's check."""
    times = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 250)])
    e = np.array([squeezed(n, 0.2, float(t), True).axial for t in times])
    swings = [
        HarmonicAmplitudeSegment(a, b, (q - p) / (b - a))
        for a, b, p, q in zip(times, times[1:], -e, -e[1:], strict=False)
    ]
    for t in (0.05, 0.2, 0.7):
        own = squeezed(n, 0.2, t, False, Amplitude([(0.0, -float(e[0]))], swings))
        assert own.pull == pytest.approx(-1.0, rel=1e-4)
        pressed = squeezed(n, 0.2, t, True).pressure(across(0.0, 0.5))
        np.testing.assert_allclose(own.pressure(across(0.0, 0.5)), pressed, rtol=3e-4)


# ------------------------------------------------------------------ far

SOFT = Skeleton("neo_hookean", 0.5, 0.3)
MOW = Permeability(1.0, 2.0, 1.5, 0.2)


def pressed(t: float, force: bool, amount: float, driven: Amplitude, k: Permeability, drains: str = "driven",
            skeleton: Skeleton = SOFT) -> PressedColumn:  # fmt: skip
    """Of unit height, area and permeability."""
    return PressedColumn(1.0, 1.0, ORIGIN, Z, drains, skeleton, k, force, amount, driven, t)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("drains", ["driven", "held", "both"])
@pytest.mark.parametrize(("force", "driven"), [pytest.param(True, ONCE, marks=pytest.mark.slow), (False, RAMP)])
def test_a_little_it_is_terzaghis_column(drains: str, force: bool, driven: Amplitude) -> None:
    """To the strain itself, 1e-6."""
    skeleton = Skeleton("neo_hookean", 0.5, 0.0)
    for t in (0.01, 0.3):
        own = pressed(t, force, -1e-6, driven, Permeability(1.0), drains, skeleton)
        known = column(t, force, drains, driven, -1e-6)
        at = places(0.0, 0.2, 0.5, 0.9)
        np.testing.assert_allclose(own.displacement(at), known.displacement(at), atol=2e-12)
        np.testing.assert_allclose(own.pressure(at), known.pressure(at), atol=1e-11)
        assert own.pull == pytest.approx(known.pull, rel=1e-5)


def by_volumes(own: PressedColumn, n: int) -> tuple[float, float, np.ndarray]:
    """Finite volumes for the stretch in cells that narrow to the open end: travel, total stress, and the volumes.

    J_t = (k(J)/J P(J)_X)_X with the mean of cells, harmonic between them, and the neo-Hookean P written out.
    """
    faces = 1.0 - (1.0 - np.arange(n + 1) / n) ** 2
    middle, wide = 0.5 * (faces[1:] + faces[:-1]), np.diff(faces)
    mu, lam = own.skeleton.mu, own.skeleton.lam
    k = own.permeability

    def stress(J):
        return mu * (J - 1.0 / J) + lam * np.log(J) / J

    def loss(J):
        return k.at_rest * ((J - k.solid) / (1 - k.solid)) ** k.exponent * np.exp(k.stiffening * (J**2 - 1) / 2) / J

    def top(J, t):
        """The stretch at the open end: where it is moved the last cell's flux is what leaves."""
        if own.force:
            low, high = 0.05, 1.0
            for _ in range(60):
                mid = 0.5 * (low + high)
                low, high = (low, mid) if stress(mid) > own.amount else (mid, high)
            return low
        rate = own.amount * (10.0 if t <= 0.1 else 0.0)
        half = faces[-1] - middle[-1]
        low, high = 0.05, 1.5
        for _ in range(60):
            mid = 0.5 * (low + high)
            flux = 0.5 * (loss(mid) + loss(J[-1])) * (stress(mid) - stress(J[-1])) / half
            low, high = (low, mid) if flux > rate else (mid, high)
        return 0.5 * (low + high)

    def rate(t, J):
        a = loss(J)
        mean = 0.5 * (a[1:] + a[:-1])
        flux = np.zeros(n + 1)
        flux[1:-1] = mean * np.diff(stress(J)) / np.diff(middle)
        if own.force:
            s = top(J, t)
            flux[-1] = 0.5 * (loss(s) + a[-1]) * (stress(s) - stress(J[-1])) / (faces[-1] - middle[-1])
        else:
            flux[-1] = own.amount * (10.0 if t <= 0.1 else 0.0)
        return np.diff(flux) / wide

    J = np.ones(n)
    for begin, end in ((0.0, min(0.1, own.now)), (0.1, own.now)):
        if end > begin:
            J = solve_ivp(rate, (begin, end), J, method="BDF", rtol=1e-7, atol=1e-9, jac=None).y[:, -1]
    return float((J * wide).sum()) - 1.0, float(stress(top(J, own.now))), J


@pytest.mark.slow
@pytest.mark.parametrize("k", [Permeability(1.0), MOW])
@pytest.mark.parametrize(("force", "driven", "amount"), [(True, ONCE, -0.3), (False, RAMP, -0.2)])
@pytest.mark.parametrize("t", [0.08, 0.4])
def test_a_column_pressed_far_against_finite_volumes(
    k: Permeability, force: bool, driven: Amplitude, amount: float, t: float
) -> None:
    """20 to 30 %: travel, force and pressure, the volumes' error by Richardson's rule from two of them."""
    own = pressed(t, force, 0.6 * amount if k is MOW and not force else amount, driven, k)
    (u, s, _), (v, r, J) = by_volumes(own, 100), by_volumes(own, 200)
    assert own.travel == pytest.approx(v + (v - u) / 3.0, abs=2e-5)
    assert own.pull == pytest.approx(r + (r - s) / 3.0, rel=5e-4)
    tight = float(SOFT.stress(J[:1])[0]) - r
    assert own.pressure(places(0.0))[0] == pytest.approx(tight, rel=2e-3, abs=1e-5)
    assert own.estimated_error < 1e-5


def test_what_leaves_no_pores_says_so() -> None:
    with pytest.raises(NotSolved, match="the pores at the open end are closed"):
        pressed(
            0.05,
            False,
            -0.5,
            Amplitude([], [HarmonicAmplitudeSegment(0.0, 0.1, 10.0)]),
            Permeability(1.0, 2.0, 4.0, 0.4),
        ).profile()


def test_a_jump_of_the_end_is_refused() -> None:
    with pytest.raises(NotApplicable, match="displaced instantaneously"):
        pressed(1.0, False, -0.1, ONCE, MOW)


def test_points_of_chebyshev() -> None:
    """A polynomial of their degree is exact, to rounding of the derivative."""
    Y, D = chebyshev_matrix(12)
    np.testing.assert_allclose(D @ Y**11, 11.0 * Y**10, atol=1e-11)


@pytest.mark.parametrize("word", ["neo_hookean", "st_venant_kirchhoff", "stable_neo_hookean", "neo_hookean_isochoric"])
def test_skeletons_against_the_laws(word: str) -> None:
    """The stress of the solvers' laws in confined compression, which these share nothing with."""
    from softmark.solvers.materials import MATERIALS, law_for

    law = MATERIALS[word](young=3.0, poisson=0.2, density=1.0)
    rubber = Rubber.neo_hookean(law.shear_modulus) if word == "neo_hookean_isochoric" else None
    own = Skeleton(word, law.shear_modulus, law.lame_lambda, rubber)
    J = np.array([0.5, 0.8, 0.95, 1.0, 1.1, 1.6])
    F = np.stack([np.diag([j, 1.0, 1.0]) for j in J])
    np.testing.assert_allclose(own.stress(J), law_for(law, "finite").P(F)[:, 0, 0], rtol=1e-12, atol=1e-13)
    h = 1e-5
    np.testing.assert_allclose(own.slope(J), (own.stress(J + h) - own.stress(J - h)) / (2 * h), rtol=1e-8)
    assert own.slope(np.ones(1))[0] == pytest.approx(law.lame_lambda + 2.0 * law.shear_modulus, rel=1e-9)


@pytest.mark.parametrize("volumetric", ["squared", "logarithmic", "reciprocal"])
def test_rubbers_with_pores_against_the_laws(volumetric: str) -> None:
    from softmark.solvers.materials import MATERIALS, law_for

    law = MATERIALS["mooney_rivlin"](c1=1.0, c2=0.4, poisson=0.25, density=1.0, volumetric=volumetric)
    rubber = Rubber("mooney_rivlin", (("c1", 1.0), ("c2", 0.4)))
    own = Skeleton("mooney_rivlin", law.shear_modulus, law.lame_lambda, rubber, volumetric)
    J = np.array([0.5, 0.8, 0.95, 1.1, 1.6])
    F = np.stack([np.diag([j, 1.0, 1.0]) for j in J])
    np.testing.assert_allclose(own.stress(J), law_for(law, "finite").P(F)[:, 0, 0], rtol=1e-11)


def test_a_stress_that_no_stretch_has_is_refused() -> None:
    """St. Venant and Kirchhoff's law gives way at J = 1/sqrt(3): -(2 mu + lam) / (3 sqrt 3) is the most."""
    own = Skeleton("st_venant_kirchhoff", 1.0, 0.0)
    assert own.stretch(-0.38) == pytest.approx(0.6, abs=0.1)
    with pytest.raises(NotApplicable, match="cannot carry a stress"):
        own.stretch(-0.39)
