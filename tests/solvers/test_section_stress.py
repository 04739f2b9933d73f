"""Stress in sections: what it adds up to, that none crosses the border, and what equilibrium and compatibility ask."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.mesh.cross_sections import Disc, Rectangle
from softmark.solvers.mesh.shape import Section
from softmark.solvers.mesh.tubes import Annulus
from softmark.solvers.stress_recovery.section_stress import section_stress, tapered_section_stress

SECTIONS = {"disc": Disc(2.0), "ring": Annulus(2.0, 1.2), "high": Rectangle(1.0, 3.0), "wide": Rectangle(2.5, 1.0)}
KINDS = pytest.mark.parametrize("section", SECTIONS.values(), ids=SECTIONS)
CARRIED = np.array([3.0, -2.0, 5.0, 0.7, -1.1, 0.4])


def places(section: Section, n: int = 40) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (m,) of a section by Gauss's rule, and their areas (m,)."""
    x, w = np.polynomial.legendre.leggauss(n)
    if isinstance(section, Rectangle):
        u, v = np.meshgrid(0.5 * section.width * x, 0.5 * section.height * x, indexing="ij")
        return u.ravel(), v.ravel(), 0.25 * section.area * np.outer(w, w).ravel()
    inner, outer = section.hole_radius or 0.0, 0.5 * section.extents[0]
    r, turn = inner + (outer - inner) * 0.5 * (1.0 + x), 2.0 * np.pi * np.arange(n) / n
    weights = np.outer(r * w * 0.5 * (outer - inner), np.full(n, 2.0 * np.pi / n))
    return np.outer(r, np.cos(turn)).ravel(), np.outer(r, np.sin(turn)).ravel(), weights.ravel()


@KINDS
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_it_adds_up_to_what_is_carried(section: Section, poisson: float) -> None:
    """N, V2, V3, T, M2, M3 by quadrature, to what series of 200 terms leave of a rectangle."""
    u, v, w = places(section)
    s = section_stress(section, poisson, np.tile(CARRIED, (len(u), 1)), u, v)
    found = [
        s[:, 0] @ w,
        s[:, 1] @ w,
        s[:, 2] @ w,
        (u * s[:, 2] - v * s[:, 1]) @ w,
        (v * s[:, 0]) @ w,
        -(u * s[:, 0]) @ w,
    ]
    np.testing.assert_allclose(found, CARRIED, rtol=1e-3 if isinstance(section, Rectangle) else 1e-10)


@KINDS
def test_none_crosses_the_border(section: Section) -> None:
    """Of torsion and of both forces: three thousandths of the largest at corners of rectangles, by 200 terms."""
    if isinstance(section, Rectangle):
        t = np.linspace(-0.5, 0.5, 21)
        half = np.full_like(t, 0.5)
        u = np.concatenate([t, t, half, -half]) * section.width
        v = np.concatenate([half, -half, t, t]) * section.height
        normal = np.repeat([[0.0, 1.0], [1.0, 0.0]], 42, axis=0)
    else:
        turn = np.linspace(0.0, 6.0, 31)
        radii = [r for r in (0.5 * section.extents[0], section.hole_radius) if r]
        normal = np.tile(np.stack([np.cos(turn), np.sin(turn)], axis=1), (len(radii), 1))
        u, v = (np.repeat(radii, 31)[:, None] * normal).T
    for k in (1, 2, 3):
        s = section_stress(section, 0.3, np.tile(np.eye(6)[k], (len(u), 1)), u, v)[:, 1:]
        assert np.abs((s * normal).sum(axis=1)).max() < 3e-3 * np.abs(s).max()


@KINDS
@pytest.mark.parametrize("poisson", [0.0, 0.4])
def test_it_is_in_equilibrium_and_its_strains_fit(section: Section, poisson: float) -> None:
    """d sigma_11/ds + d sigma_12/du + d sigma_13/dv = 0, moments growing as dM2/ds = V3, dM3/ds = -V2.

    And of Beltrami's equations the two with the axis: nabla^2 tau_1j + d2 sigma_11/ds dxj / (1 + nu) = 0. By central
    differences; both are polynomials or harmonic, so that 1e-4 is of the differences.
    """
    rng, h = np.random.default_rng(3), 1e-3
    u, v, _ = places(section, 12)
    keep = rng.choice(len(u), 30, replace=False)
    u, v = 0.9 * u[keep], 0.9 * v[keep]
    if section.hole_radius:
        r = np.hypot(u, v)
        scale = np.maximum(r, section.hole_radius + 0.1) / r
        u, v = scale * u, scale * v

    def of(carried: np.ndarray, du: float = 0.0, dv: float = 0.0) -> np.ndarray:
        return section_stress(section, poisson, np.tile(carried, (len(u), 1)), u + du, v + dv)

    along = np.array([0.0, 0.0, 0.0, 0.0, CARRIED[2], -CARRIED[1]])  # what grows with s
    by_s = of(along)[:, 0]
    s, size = of(CARRIED), np.abs(of(CARRIED)[:, 1:]).max()
    by_u, by_v = ((of(CARRIED, *d) - of(CARRIED, *(-np.array(d)))) / (2.0 * h) for d in ((h, 0.0), (0.0, h)))
    assert np.abs(by_s + by_u[:, 1] + by_v[:, 2]).max() < 1e-3 * size
    laplace = sum(of(CARRIED, *d) + of(CARRIED, *(-np.array(d))) - 2.0 * s for d in ((h, 0.0), (0.0, h))) / h**2
    mixed = [(of(along, *d)[:, 0] - of(along, *(-np.array(d)))[:, 0]) / (2.0 * h) for d in ((h, 0.0), (0.0, h))]
    for j in (1, 2):
        assert np.abs(laplace[:, j] + mixed[j - 1] / (1.0 + poisson)).max() < 1e-3 * size


def test_published_numbers() -> None:
    """Torsion of rectangles: T / (k2 a^2 b), k2 = 0.208 of a square and 0.246 of 1:2 (Timoshenko and Goodier, table 7).

    The flexure of a circle: (3 + 2 nu) / (8 (1 + nu)) V a^2 / I in the middle, 1.38 V / A of nu = 0.3 (section 122).
    Of a square 1.126 times 1.5 V / A at the middle of its sides, nu = 0.25 (section 124).
    """
    one = np.ones((1, 1))
    for height, k2 in ((1.0, 0.208), (2.0, 0.246)):
        s = section_stress(Rectangle(1.0, height), 0.3, one * np.eye(6)[3], np.array([0.5]), np.array([0.0]))
        assert s[0, 2] == pytest.approx(1.0 / (k2 * height), rel=3e-3)
    s = section_stress(Disc(1.0), 0.3, one * np.eye(6)[1], np.array([0.0]), np.array([0.0]))
    assert s[0, 1] * np.pi == pytest.approx(1.38, abs=5e-3)
    s = section_stress(Rectangle(1.0, 1.0), 0.25, one * np.eye(6)[2], np.array([0.5, 0.0]), np.array([0.0, 0.0]))
    assert s[0, 2] / 1.5 == pytest.approx(1.126, abs=1e-3)
    assert s[1, 2] / 1.5 == pytest.approx(0.940, abs=1e-3)


@pytest.mark.parametrize("name", ["disc", "high", "wide"])
def test_stress_follows_sides_that_lean(name: str) -> None:
    """None crosses a border that leans, and resultants are what is carried: to rounding of Gauss's sums."""
    section, rates = SECTIONS[name], (0.02, 0.02) if name == "disc" else (0.02, -0.03)
    x2, x3, dA = places(section)
    found = tapered_section_stress(section, rates, 0.3, np.tile(CARRIED, (len(dA), 1)), x2, x3)
    T = dA @ (found[:, 2] * x2 - found[:, 1] * x3)
    np.testing.assert_allclose([*(dA @ found), T], CARRIED[:4], rtol=1e-3, atol=1e-3)
    if name == "disc":
        t = np.linspace(0.0, 6.0, 7)
        n = np.stack([np.cos(t), np.sin(t)], axis=1)
        X = 2.0 * n
    else:
        n, X = np.tile([1.0, 0.0], (5, 1)), np.stack([np.full(5, 0.5 * section.extents[0])] * 2, axis=1)
        X[:, 1] = np.linspace(-0.3, 0.3, 5) * section.extents[1]
    found = tapered_section_stress(section, rates, 0.3, np.tile(CARRIED, (len(X), 1)), X[:, 0], X[:, 1])
    leans = (n * X * rates).sum(axis=1)  # how much the border moves out along the axis
    np.testing.assert_allclose((found[:, 1:] * n).sum(axis=1), found[:, 0] * leans, rtol=1e-6, atol=2e-3)
