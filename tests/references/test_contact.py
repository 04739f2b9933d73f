"""Contact: numbers of the shared catalogue (3.10), Hertz's own formulas, and the equations that the fields obey."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from softmark.references.cattaneo_mindlin import CattaneoMindlin, PartialSlip
from softmark.references.dimitriadis import Dimitriadis
from softmark.references.half_space_indentation import HalfSpace, Surroundings, Tip
from softmark.references.hertz import Hertz
from softmark.references.hertz_line import HertzLine
from softmark.references.indentation import Indentation
from softmark.references.layer_indentation import PressedLayer
from softmark.references.layer_integral_equation import Layer, base_stiffening
from softmark.references.line_contact import LineContact, Strip, half_width
from softmark.references.signorini import StoppedBar
from softmark.references.sneddon import Sneddon
from softmark.references.straight_cantilever import NotApplicable

BALL = Tip.sphere(10e-3)
UP = (0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)
PRESSED = Indentation("sphere", 10e-3, 0.5e-3, 10e3, 0.3, ORIGIN, UP, Surroundings())
TIPS = [BALL, Tip.cone(1.1), Tip.punch(5e-3)]


@pytest.mark.parametrize(
    ("nu", "d", "a", "F", "p0"),
    [
        (0.3, 0.2, 1.4142, 4.14422, 989.36), (0.3, 0.5, 2.2361, 16.38145, 1564.31),
        (0.3, 1.0, 3.1623, 46.33374, 2212.27),
        (0.49, 0.2, 1.4142, 4.96281, 1184.78), (0.49, 0.5, 2.2361, 19.61721, 1873.31),
        (0.49, 1.0, 3.1623, 55.48586, 2649.25),
    ],
)  # fmt: skip
def test_spheres_of_the_catalogue(nu: float, d: float, a: float, F: float, p0: float) -> None:
    """All the digits that it prints: mm, mN and Pa."""
    found = Hertz("b").solve(replace(PRESSED, depth=1e-3 * d, poisson=nu))
    assert isinstance(found, HalfSpace)
    assert 1e3 * found.radius == pytest.approx(a, abs=6e-5)
    assert 1e3 * found.push == pytest.approx(F, abs=6e-6)
    assert found.largest_pressure == pytest.approx(p0, abs=6e-3)
    assert found.area == pytest.approx(math.pi * found.radius**2, rel=1e-14)


def test_the_punch_and_the_cone_of_the_catalogue() -> None:
    """65.798 mN of the punch; F = 2/pi E* tan(angle) d^2 of the cone, and a = 2/pi tan(angle) d (Sneddon 1965)."""
    punch = Sneddon("b").solve(replace(PRESSED, kind="punch", size=5e-3, poisson=0.49))
    assert 1e3 * punch.push == pytest.approx(65.798, abs=6e-4)
    cone = Sneddon("b").solve(replace(PRESSED, kind="cone", size=1.0))
    assert cone.push == pytest.approx(2.0 / math.pi * cone.modulus * math.tan(1.0) * 0.25e-6, rel=1e-14)
    assert cone.radius == pytest.approx(2.0 / math.pi * math.tan(1.0) * 0.5e-3, rel=1e-14)
    assert cone.largest_pressure == punch.largest_pressure == math.inf


@pytest.mark.parametrize("tip", TIPS)
def test_pressures_add_up_to_the_force_and_work_to_energy(tip: Tip) -> None:
    """By adaptive quadrature, to its 1e-9, which r = a sin(t) makes smooth; slopes by central differences, 1e-8."""
    found = HalfSpace(tip, 0.5e-3, 10e3, 0.4)
    a = found.radius

    def ring(t: float) -> float:
        r = a * math.sin(t)
        return float(2.0 * math.pi * r * found.pressure(np.array([r]))[0] * a * math.cos(t))

    assert quad(ring, 0.0, 0.5 * math.pi)[0] == pytest.approx(found.push, rel=1e-8)
    h = 1e-9
    slope = (replace(found, depth=found.depth + h).energy - replace(found, depth=found.depth - h).energy) / (2 * h)
    assert slope == pytest.approx(found.push, rel=1e-7)


def test_the_surface_moves_as_hertz_says() -> None:
    """Within contact d - r^2/2R, and beside it, and across it, as Johnson (1985) has it: (3.41) and (3.42)."""
    found = HalfSpace(BALL, 0.5e-3, 10e3, 0.3)
    a, p0 = found.radius, found.largest_pressure
    within, beside = a * np.array([0.0, 0.3, 0.9]), a * np.array([1.1, 2.0, 9.0])
    out, into = found.moved(within, np.zeros(3))
    assert into == pytest.approx(0.5e-3 - within**2 / 20e-3, rel=1e-10)
    across = (1 - 2 * 0.3) * 1.3 / (3 * 10e3) * a**2 * p0
    assert out[1:] == pytest.approx(-across / within[1:] * (1 - (1 - (within[1:] / a) ** 2) ** 1.5), rel=1e-9)
    out, into = found.moved(beside, np.zeros(3))
    x = beside / a
    own = (2 - x**2) * np.arcsin(1 / x) + np.sqrt(x**2 - 1)
    assert into == pytest.approx(p0 / (2 * found.modulus) * a * own, rel=1e-10)
    assert out == pytest.approx(-across / beside, rel=1e-10)


@pytest.mark.parametrize("tip", TIPS)
def test_every_field_is_in_balance_and_ends_as_that_of_a_point_force(tip: Tip) -> None:
    """(1 - 2 nu) div grad u + grad div u = 0 by differences: 1e-3 of its terms; far below, Boussinesq's (z/a)^-2."""
    found = HalfSpace(tip, 0.5e-3, 10e3, 0.4, (1e-3, 0.0, 2e-3), (0.0, 0.6, 0.8))
    X = np.array(found.at) + np.array([1.3e-3, -2.0e-3, -1.5e-3]) - 2e-3 * np.array(found.normal)
    h, E = 2e-5, np.eye(3)

    def u(x: np.ndarray) -> np.ndarray:
        return found.displacement(x[None])[0]

    second = np.array([
        [(u(X + h * a + h * b) - u(X + h * a - h * b) - u(X - h * a + h * b) + u(X - h * a - h * b)) / (4 * h * h)
         for a in E] for b in E
    ])  # fmt: skip
    spread, rise = np.einsum("iik->k", second), np.einsum("kii->k", second)
    assert 0.2 * spread + rise == pytest.approx(np.zeros(3), abs=1e-3 * np.abs(rise).max())
    z = 300.0 * found.radius
    _, into = found.moved(np.zeros(1), np.array([z]))
    point = found.push * 1.4 * (3 - 2 * 0.4) / (2 * math.pi * 10e3 * z)
    assert into[0] == pytest.approx(point, rel=1e-4)


# ------------------------------------------------------------------ layers


@pytest.mark.parametrize(
    ("d", "bonded", "sliding"), [(0.2, 5.46480, 5.36295), (0.5, 22.73437, 22.04538), (1.0, 68.26690, 65.25966)]
)
def test_layers_of_the_catalogue(d: float, bonded: float, sliding: float) -> None:
    """R = 10, h = 20 mm, E = 10 kPa, nu = 0.5: all the digits that it prints, mN. The bonded series is within 1 % of
    the integral equation, the sliding one 1 to 2.5 % too stiff (first coefficient 0.884, of which 0.744 is exact)."""
    one = replace(PRESSED, depth=1e-3 * d, poisson=0.5, around=Surroundings(20e-3))
    found = Dimitriadis("b").solve(one)
    assert 1e3 * found.push == pytest.approx(bonded, abs=6e-6)
    assert abs(found.relative_errors["series"]) < 0.01
    found = Dimitriadis("b").solve(replace(one, around=Surroundings(20e-3, bonded=False)))
    assert 1e3 * found.push == pytest.approx(sliding, abs=6e-6)
    assert -0.025 < found.relative_errors["series"] < -0.005


def test_first_coefficients_of_layers() -> None:
    """int (1 - L) dw: 1.168 of a layer that slides (Alexandrov 1963), and within 1 % what Dimitriadis fits, bonded."""
    x, weights = np.polynomial.legendre.leggauss(200)
    w, weights = 12.0 * (x + 1.0), 12.0 * weights
    assert weights @ base_stiffening(w, 0.3, False) == pytest.approx(1.168, abs=5e-4)
    for nu in (0.3, 0.5):
        fitted = (1.2876 - 1.4678 * nu + 1.3442 * nu**2) / (1.0 - nu)
        assert weights @ base_stiffening(w, nu, True) == pytest.approx(fitted, rel=0.01)


@pytest.mark.parametrize("tip", TIPS)
@pytest.mark.parametrize("bonded", [True, False])
def test_thick_layers_are_half_spaces_and_thin_ones_confined(tip: Tip, bonded: bool) -> None:
    """1e4 times as thick as the contact: 1e-4 left. Pressure is that of its own force to quadrature, 1e-8."""
    thick, space = Layer(tip, 0.5e-3, 10e3, 0.4, 50.0, bonded), HalfSpace(tip, 0.5e-3, 10e3, 0.4)
    assert thick.push == pytest.approx(space.push, rel=2e-4)
    assert thick.radius == pytest.approx(space.radius, rel=2e-4)
    thin = replace(thick, thickness=4e-3)
    a = thin.radius

    def ring(t: float) -> float:
        r = a * math.sin(t)
        return float(2.0 * math.pi * r * thin.pressure(np.array([r]))[0] * a * math.cos(t))

    assert quad(ring, 0.0, 0.5 * math.pi)[0] == pytest.approx(thin.push, rel=1e-7)


def test_a_layer_under_a_wide_punch_is_a_column() -> None:
    """Bonded, the radius six times the thickness: in the middle the layer cannot grow across, and pressure is
    E (1 - nu) / ((1 + nu) (1 - 2 nu)) d/h; within 2 %."""
    found = Layer(Tip.punch(30e-3), 0.1e-3, 10e3, 0.3, 5e-3, True)
    confined = 10e3 * 0.7 / (1.3 * 0.4) * 0.1e-3 / 5e-3
    assert found.pressure(np.zeros(1))[0] == pytest.approx(confined, rel=0.02)
    with pytest.raises(NotApplicable, match="times the thickness"):
        _ = replace(found, thickness=4e-3).push


def test_a_strip_that_a_cylinder_presses() -> None:
    """The catalogue has a = 1.273620 and p0 = 17.494776; thick, it is as wide as Hertz has it of its force."""
    modulus = 200.0 / (1.0 - 0.09)
    a = half_width(35.0, 8.0, modulus)
    assert a == pytest.approx(1.273620, abs=6e-7)
    assert 2.0 * 35.0 / (math.pi * a) == pytest.approx(17.494776, abs=6e-7)
    strip = Strip(8.0, 0.1, 200.0, 0.3, 2000.0, True)
    assert strip.half == pytest.approx(half_width(strip.force, 8.0, modulus), rel=1e-6)
    found = LineContact(strip, 2.0, ORIGIN, Surroundings(2000.0, 4000.0))
    assert found.push == pytest.approx(2.0 * strip.force, rel=1e-14)
    assert found.area == pytest.approx(4.0 * strip.half, rel=1e-6)
    assert found.largest_pressure == pytest.approx(float(strip.pressure(np.zeros(1))[0]), rel=1e-6)
    assert abs(found.relative_errors["pressure"]) < 1e-6


def test_the_surface_of_a_strip_follows_the_cylinder() -> None:
    """u = 2/(pi E*) int p^ L/k cos(kx) dk by the trapezoidal rule, 1e-3 of the depth, which leaves 1/k^2.5 out."""
    strip = Strip(8.0, 0.1, 200.0, 0.3, 5.0, True)
    theta = math.pi * (np.arange(64) + 0.5) / 64
    s = strip.half * np.cos(theta)
    weighed = strip.pressure(s) * strip.half * np.sin(theta) * math.pi / 64
    k = np.linspace(1e-6, 60.0, 6001)
    L = 1.0 - np.where(5.0 * k < 20.0, base_stiffening(np.minimum(5.0 * k, 20.0), 0.3, True), 0.0)
    for x in (0.0, 0.5 * strip.half):
        own = (
            np.trapezoid(np.cos(np.outer(k, s)) @ weighed * L / k * np.cos(k * x), k) * 2.0 / (math.pi * strip.modulus)
        )
        assert own == pytest.approx(0.1 - x**2 / 16.0, abs=1e-4)


# ------------------------------------------------------------------ friction


@pytest.mark.parametrize(
    ("q", "c", "travel"),
    [(0.1, 0.96549, 0.02059), (0.25, 0.90856, 0.05298), (0.5, 0.7937, 0.11233), (0.75, 0.62996, 0.1831),
     (0.9, 0.46416, 0.23817), (1.0, 0.0, 0.30357)],
)  # fmt: skip
def test_partial_slip_of_the_catalogue(q: float, c: float, travel: float) -> None:
    """Its digits, mm: the travel is given, Q and the circle that sticks are found."""
    rubbed = replace(PRESSED, friction=0.5)
    most = CattaneoMindlin("b").solve(rubbed).most
    exact = most * (1.0 - (1.0 - q) ** (2.0 / 3.0))
    assert 1e3 * exact == pytest.approx(travel, abs=6e-6)
    found = CattaneoMindlin("b").solve(replace(rubbed, slid=(0.6 * exact, 0.8 * exact, 0.0)))
    assert found.drag == pytest.approx(q * 0.5 * found.push, rel=1e-9)
    assert found.dragged == pytest.approx((0.6 * found.drag, 0.8 * found.drag, 0.0), rel=1e-12)
    assert found.stick_radius / found.radius == pytest.approx(c, abs=6e-6)


def test_tractions_of_partial_slip_add_up_and_its_loss_is_that_of_the_loop() -> None:
    """int q dA = Q by quadrature, 1e-8. A closed loop loses 4 times what its first quarter does (Masing), and that is
    the catalogue's 0.00587 x 9 mu^2 P^2 (2 - nu) / (10 a G) where Q = mu P / 2: its three digits."""
    most = PartialSlip(HalfSpace(BALL, 0.5e-3, 10e3, 0.3), 0.5, ORIGIN).most
    exact = most * (1.0 - 0.5 ** (2.0 / 3.0))
    found = PartialSlip(HalfSpace(BALL, 0.5e-3, 10e3, 0.3), 0.5, (exact, 0.0, 0.0))
    a, P, G = found.radius, found.push, 10e3 / 2.6

    def ring(r: float) -> float:
        return float(2.0 * math.pi * r * found.traction(np.array([r]))[0])

    total = quad(ring, 0.0, a, points=[found.stick_radius], epsabs=0.0, epsrel=1e-9)[0]
    assert total == pytest.approx(found.drag, rel=1e-7)
    assert 4.0 * found.dissipated == pytest.approx(0.00587 * 0.9 * 0.25 * P**2 * 1.7 / (a * G), rel=1e-3)
    beyond = replace(found, slid=(1.5 * most, 0.0, 0.0))
    last = replace(found, slid=(most, 0.0, 0.0))
    assert beyond.drag == pytest.approx(0.5 * P, rel=1e-14)
    assert beyond.dissipated - last.dissipated == pytest.approx(0.5 * P * 0.5 * most, rel=1e-12)


# ------------------------------------------------------------------ a bar that is stopped


def test_the_bar_of_the_catalogue() -> None:
    """L = 1, E A = 1000, gap 0.01, P = 20: u = 0.01, and the plane carries 10. Not met, u = P L / (E A)."""
    bar = StoppedBar(1.0, 1.0, 1000.0, 0.25, 0.01, 20.0, ORIGIN, (1.0, 0.0, 0.0))
    assert (bar.lengthening, bar.push, bar.carried) == pytest.approx((0.01, 10.0, 10.0), rel=1e-12)
    u = bar.displacement(np.array([[1.0, 0.2, 0.0], [0.0, 0.0, 0.0]]))
    assert u == pytest.approx(np.array([[0.01, -0.0005, 0.0], [0.0, 0.0, 0.0]]), abs=1e-15)
    free = replace(bar, load=5.0)
    assert (free.lengthening, free.push, free.area) == pytest.approx((0.005, 0.0, 0.0))
    squeezed = replace(bar, away=-0.02, load=0.0)
    assert (squeezed.lengthening, squeezed.push, squeezed.largest_pressure) == pytest.approx((-0.02, 20.0, 20.0))


# ------------------------------------------------------------------ what they do not hold for


def test_what_they_do_not_hold_for() -> None:
    for word, wrong, why in (
        (Hertz, replace(PRESSED, friction=0.1), "friction"),
        (Hertz, replace(PRESSED, kind="cone", size=1.0), "cone"),
        (Hertz, replace(PRESSED, depth=6e-3), "of the radius"),
        (Hertz, replace(PRESSED, around=Surroundings(4e-3)), "far face"),
        (Hertz, replace(PRESSED, around=Surroundings(math.inf, 4e-3)), "free side"),
        (HertzLine, replace(PRESSED, kind="cylinder"), "plane strain"),
        (Hertz, replace(PRESSED, kind="cylinder"), "cylinder"),
        (Sneddon, PRESSED, "sphere"),
        (Sneddon, replace(PRESSED, kind="cone", size=2.0), "half-angle"),
        (Dimitriadis, replace(PRESSED, around=Surroundings(10e-3)), "0.3; the series holds for 0.5"),
        (Dimitriadis, replace(PRESSED, poisson=0.5, around=Surroundings(2e-3)), "times the thickness"),
        (PressedLayer, replace(PRESSED, around=Surroundings(10e-3, 4e-3)), "free side"),
        (CattaneoMindlin, PRESSED, "no friction"),
        (CattaneoMindlin, replace(PRESSED, friction=0.1, turned=True), "while it is pressed in"),
    ):
        with pytest.raises(NotApplicable, match=why):
            word("b").solve(wrong)


@pytest.mark.parametrize("word", [Hertz, Dimitriadis, PressedLayer])
def test_what_does_not_touch_carries_nothing(word: type) -> None:
    found = word("b").solve(replace(PRESSED, depth=-1e-3, poisson=0.5, around=Surroundings(20e-3, 40e-3)))
    assert found.push == 0.0
    assert set(found.relative_errors.values()) == {0.0}


@pytest.mark.parametrize("bonded", [True, False])
def test_sides_of_a_layer_matter_less_than_those_of_a_half_space(bonded: bool) -> None:
    """Thick, its surface moves as that of a half-space, P / (pi E* r); three thicknesses away it hardly moves."""
    thick = Layer(BALL, 0.5e-3, 10e3, 0.4, 10.0, bonded)
    alone = thick.push / (math.pi * thick.modulus)
    assert thick.surface_displacement(0.05) == pytest.approx(alone / 0.05, rel=0.02)
    assert abs(replace(thick, thickness=20e-3).surface_displacement(0.06)) < 0.1 * alone / 0.06
