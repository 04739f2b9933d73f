"""The rod that tendons drive, against its closed form, another theory, the energy that its equations do not use."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from softmark.references.simo_reissner import SimoReissner
from softmark.references.straight_cantilever import Cantilever, NotApplicable
from softmark.references.tendon_driven_rod import (
    DrivenRod,
    DrivenRodSolution,
    RodEquations,
    TendonRoute,
    solve_driven_rod,
    states_at,
)

Array = NDArray[np.float64]
L, EI = 0.2, 1e-3
STIFF = (40.0, 13.0, 13.0, 0.8e-3, EI, 2 * EI)
FRAME = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NONE = (0.0, 0.0, 0.0)


def rod(
    *routes: TendonRoute, weight: tuple[float, float, float] = NONE, tip: tuple[float, float, float] = NONE
) -> DrivenRod:
    return DrivenRod(L, STIFF, NONE, FRAME, weight, tip, routes)


def end(shape: DrivenRodSolution) -> Array:
    """Where the free end comes to rest, m."""
    found: Array = shape.displacement(np.array([[L, 0.0, 0.0]]))[0] + [L, 0.0, 0.0]
    return found


@pytest.mark.parametrize("circles", [0.25, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_straight_tendon_gives_an_arc(circles: float) -> None:
    """kappa = T d / E I and a stretch of 1 - T / E A, exactly: collocation has a polynomial of little to find."""
    d = 0.01
    T = circles * 2 * np.pi * EI / (L * d)
    found = solve_driven_rod(rod(TendonRoute(0.0, L, (0.0, d), (0.0, d), 0.0, T)))
    kappa, stretch = T * d / EI, 1.0 - T / STIFF[0]
    arc = stretch / kappa * np.array([np.sin(kappa * L), 0.0, 1.0 - np.cos(kappa * L)])
    np.testing.assert_allclose(end(found), arc, atol=1e-9 * L)
    assert np.abs(end(found) - arc).max() <= found.estimated_error


def test_without_tendons_it_is_the_planar_rod_under_its_weight(silicone_beam: Cantilever) -> None:
    """That of Simo and Reissner, which is solved by other unknowns in another way to 1e-10."""
    c = silicone_beam
    stiff = (c.axial_stiffness, c.shear_stiffness, c.shear_stiffness, 1.0, c.bending_stiffness, c.bending_stiffness)
    hangs = tuple(c.weight_per_length * g for g in c.down)
    found = solve_driven_rod(DrivenRod(c.length, stiff, c.root, FRAME, (hangs[0], hangs[1], hangs[2]), NONE, ()))
    X = np.array([[0.5 * c.length, 0.0, 0.0], [c.length, 0.0, 0.01]]) + np.array(c.root)
    apart = found.displacement(X) - SimoReissner(body=None).solve(c).displacement(X)
    assert np.abs(apart).max() <= found.estimated_error + 1e-10 < 1e-7


WOUND = TendonRoute(0.0, L, (0.0, 8e-3), (0.0, 8e-3), 2 * np.pi, 0.9)
SLANT = TendonRoute(0.03, 0.11, (-8e-3, 0.0), (-4e-3, 2e-3), 0.0, 1.2)


@pytest.mark.long
@pytest.mark.slow
def test_its_energy_is_stationary() -> None:
    """Strain energy and tension times length of the solution, the weights' too: moved by any smooth change of strains,
    nothing of first order is left, to 1e-6 of the change of its largest part. The equations know forces, no energy."""
    weight, tip = (0.0, -0.05, 0.02), (0.01, 0.02, -0.01)
    full = rod(WOUND, SLANT, weight=weight, tip=tip)
    shape, equations = solve_driven_rod(full), RodEquations(full, 1.0)
    cuts = [p.begin for p in shape.stretches] + [1.0]
    x, w = np.polynomial.legendre.leggauss(40)
    s = np.concatenate([a + (b - a) * 0.5 * (x + 1) for a, b in itertools.pairwise(cuts)])
    w = np.concatenate([0.5 * (b - a) * w for a, b in itertools.pairwise(cuts)])
    y = states_at(shape.stretches, shape.solution, s)
    v, u = equations.strains(y)
    q, n, m = y[3:7], y[7:10], y[10:13]
    R = _rotations(q)
    rng = np.random.default_rng(4)
    for _ in range(3):
        a, b, k = rng.normal(size=(3, 6, 3))

        def change(t: Array, a: Array = a, b: Array = b, k: Array = k) -> tuple[Array, Array]:
            """A displacement and a turn in space, none at the clamp (6, n), and their slopes."""
            f = sum(a[:, [j]] * np.sin((b[:, [j]] + 2) * t + k[:, [j]]) for j in range(3)) * t
            h = 1e-5
            g = [sum(a[:, [j]] * np.sin((b[:, [j]] + 2) * z + k[:, [j]]) for j in range(3)) * z for z in (t + h, t - h)]
            return f, (g[0] - g[1]) / (2 * h)

        f, slope = change(s)
        p_slope = np.einsum("ijn,jn->in", R, v)
        # of R^T p' and of the axial vector of R^T R', for dp = f[:3] and turns f[3:] in space
        dv = np.einsum("jin,jn->in", R, slope[:3] - np.cross(f[3:], p_slope, axis=0))
        du = np.einsum("jin,jn->in", R, slope[3:])
        inner = (n * dv + m * du).sum(axis=0)
        for part in equations.stretches:
            own = (s > part.begin) & (s < part.end)
            for route in part.routes:
                arm, bent, _ = route.section_position(s[own])
                way = v[:, own] + np.cross(u[:, own], arm, axis=0) + bent
                moved = dv[:, own] + np.cross(du[:, own], arm, axis=0)
                inner[own] += route.tension * (way * moved).sum(axis=0) / np.linalg.norm(way, axis=0)
        outer = (equations.weight[:, None] * f[:3]).sum(axis=0)
        at_end = change(np.array([1.0]))[0][:3, 0]
        left = w @ (inner - outer) - equations.tip @ at_end
        assert abs(left) < 1e-6 * (w @ np.abs(inner))


def _rotations(q: Array) -> Array:
    from scipy.spatial.transform import Rotation

    found: Array = Rotation.from_quat(q.T, scalar_first=True).as_matrix().transpose(1, 2, 0)
    return found


@pytest.mark.slow
def test_a_frame_that_is_turned_turns_all_of_it() -> None:
    """The same rod along another axis, with its loads turned too."""
    from scipy.spatial.transform import Rotation

    R = Rotation.from_rotvec([0.4, -0.9, 0.3])
    weight, tip = (0.0, -0.05, 0.02), (0.01, 0.02, -0.01)
    plain = end(solve_driven_rod(rod(WOUND, weight=weight, tip=tip)))
    vectors = [tuple(R.apply(v).tolist()) for v in (*FRAME, weight, tip)]
    turned = solve_driven_rod(
        DrivenRod(L, STIFF, (1.0, 2.0, 3.0), tuple(vectors[:3]), vectors[3], vectors[4], (WOUND,))
    )  # type: ignore[arg-type]
    X = np.array([[1.0, 2.0, 3.0]]) + R.apply([[L, 0.0, 0.0]])
    np.testing.assert_allclose(X + turned.displacement(X), [R.apply(plain) + np.array([1.0, 2.0, 3.0])], atol=1e-9)


@pytest.mark.slow
@pytest.mark.long
def test_what_is_no_rod_is_refused() -> None:
    with pytest.raises(NotApplicable, match="along the beam"):
        rod(TendonRoute(0.1, 0.1, (0.0, 1.0), (0.0, 1.0), 0.0, 1.0))
    with pytest.raises(NotApplicable, match="not positive"):
        DrivenRod(L, (0.0, *STIFF[1:]), NONE, FRAME, NONE, NONE, (WOUND,))  # type: ignore[arg-type]
    with pytest.raises(NotApplicable, match="beyond the ends"):
        solve_driven_rod(rod(WOUND)).displacement(np.array([[1.1 * L, 0.0, 0.0]]))
