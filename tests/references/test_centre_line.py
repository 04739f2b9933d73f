"""Laws that the centre line of every theory of cantilevers obeys."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softmark.references import REFERENCES
from softmark.references.beam_centre_line import CentreLine
from softmark.references.straight_cantilever import Cantilever, Disc, NotApplicable

Array = NDArray[np.float64]


def of_centre_lines(cls: Any) -> bool:
    """Whether a reference solves a cantilever for its centre line: `rucker_webster` solves another rod."""
    return hasattr(cls, "solve") and cls.solve.__annotations__["return"] == "CentreLine"


@pytest.fixture(params=[name for name, cls in REFERENCES.items() if of_centre_lines(cls)])
def reference(request: pytest.FixtureRequest) -> Any:
    return REFERENCES[request.param](body=None)


@pytest.fixture
def line(reference: Any, silicone_beam: Cantilever) -> CentreLine:
    solved: CentreLine = reference.solve(silicone_beam)
    return solved


def points_of(beam: Cantilever, n: int = 50) -> Array:
    """Points spread over the body, both ends included: (n, 3)."""
    rng = np.random.default_rng(1)
    X = rng.uniform(-0.019, 0.019, (n, 3))
    X[:, 0] = np.linspace(0, beam.length, n)
    return X


def test_clamp_does_not_move(line: CentreLine) -> None:
    # phi(0) = 0 and the root is fixed: every point of the root section stays, to rounding of 0.1 m.
    X = points_of(line.cantilever)
    X[:, 0] = 0
    assert np.abs(line.displacement(X)).max() < 1e-16


def test_root_curvature_is_the_slope_of_the_rotation(line: CentreLine) -> None:
    # A one-sided second-order difference over 1e-5 m: truncation below 1e-4 of 22 to 31 per metre for a
    # rotation whose third derivative is k / L^3 = 2e3; rounding 1e-16 / 1e-5.
    h = 1e-5
    phi = line.rotation(np.array([0.0, h, 2 * h]))
    slope = (-3 * phi[0] + 4 * phi[1] - phi[2]) / (2 * h)
    assert slope == pytest.approx(line.root_curvature, rel=1e-6)


def test_sections_keep_their_width_across_the_plane_of_bending(line: CentreLine) -> None:
    # Two points that differ across the plane move alike: exact but for the rounding of two sums.
    X = points_of(line.cantilever)
    Y = X.copy()
    Y[:, 1] += 0.005
    np.testing.assert_allclose(line.displacement(X), line.displacement(Y), atol=1e-16)


@pytest.mark.parametrize("name", ["elastica", "simo_reissner"])
def test_sections_stay_rigid(name: str, silicone_beam: Cantilever) -> None:
    # A rotation keeps distances; coordinates of 0.2 m are rounded at 3e-17.
    line = REFERENCES[name](body=None).solve(silicone_beam)
    X = points_of(silicone_beam)
    Y = X + np.array([0.0, 0.004, -0.007])
    deformed = Y + line.displacement(Y) - X - line.displacement(X)
    np.testing.assert_allclose(np.linalg.norm(deformed, axis=1), np.hypot(0.004, 0.007), rtol=1e-13)


def test_section_turns_from_the_axis_towards_gravity(silicone_beam: Cantilever) -> None:
    # The tip section of the elastica turns by 62.7738509771296 degrees (references.json): the point 1 cm
    # above the centre moves forward by sin and down by 1 - cos of that. Tolerance: the printed 16 digits
    # of an angle near 1, times 1 cm.
    line = REFERENCES["elastica"](body=None).solve(silicone_beam)
    centre, above = line.displacement(np.array([[0.178, 0, 0], [0.178, 0, 0.01]]))
    phi = np.radians(62.7738509771296)
    expected = 0.01 * np.array([np.sin(phi), 0, np.cos(phi) - 1])
    np.testing.assert_allclose(above - centre, expected, atol=1e-14)


def test_small_deflection_turns_sections_to_first_order(silicone_beam: Cantilever) -> None:
    # v'(L) = w L^3 / (6 EI) = k / 6; a point 1 cm above the axis moves forward by that times 1 cm, and no
    # further down than the centre. Closed form, so only rounding.
    line = REFERENCES["small_deflection"](body=None).solve(silicone_beam)
    centre, above = line.displacement(np.array([[0.178, 0, 0], [0.178, 0, 0.01]]))
    np.testing.assert_allclose(above - centre, [0.01 * silicone_beam.load_parameter / 6, 0, 0], atol=1e-16)


def test_turning_and_moving_the_beam_turns_its_displacements(
    reference: Any, line: CentreLine, silicone_beam: Cantilever
) -> None:
    # Space has no preferred place or direction. The orthogonal matrix comes from a QR factorisation of fixed
    # random numbers; tolerance: rounding of coordinates near 3 m (4e-16), amplified by slopes near 2.
    Q, _ = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))
    root = np.array([1.0, -2.0, 3.0])
    turned = replace(
        silicone_beam,
        root=tuple(root.tolist()),
        axis=tuple((Q @ silicone_beam.axis).tolist()),
        gravity=tuple((Q @ silicone_beam.gravity).tolist()),
    )
    X = points_of(silicone_beam)
    u = reference.solve(turned).displacement(X @ Q.T + root)
    np.testing.assert_allclose(u, line.displacement(X) @ Q.T, atol=1e-14)


def test_scaling_the_lengths_scales_the_displacements(reference: Any, line: CentreLine) -> None:
    # Lengths times 2 with gravity halved keep k and all strains, so displacements double: powers of two,
    # hence no rounding but that of the square roots inside; 1e-13 of 0.2 m.
    beam = line.cantilever
    doubled = replace(beam, length=0.356, section=Disc(0.038), gravity=(0.0, 0.0, -9.81 / 2))
    X = points_of(beam)
    u = reference.solve(doubled).displacement(2 * X)
    np.testing.assert_allclose(u, 2 * line.displacement(X), atol=1e-14)


@pytest.mark.parametrize("station", [-1e-6, 1.000001])
def test_refuses_points_beyond_the_ends(line: CentreLine, station: float) -> None:
    X = np.array([[0.1, 0.0, 0.0], [station * line.cantilever.length, 0.0, 0.0]])
    with pytest.raises(NotApplicable, match="1 of 2 points lie beyond the ends"):
        line.displacement(X)


def test_takes_points_that_were_rounded_beyond_the_ends(line: CentreLine) -> None:
    # 1e-10 L is inside the stated 1e-9 L; such points count as the ends, so the tip's own value returns.
    L = line.cantilever.length
    u = line.displacement(np.array([[-1e-10 * L, 0, 0], [(1 + 1e-10) * L, 0, 0], [L, 0, 0]]))
    assert np.abs(u[0]).max() < 1e-16
    np.testing.assert_array_equal(u[1], u[2])


def test_refuses_what_are_not_points(line: CentreLine) -> None:
    with pytest.raises(NotApplicable, match="shape"):
        line.displacement(np.zeros(3))
    with pytest.raises(NotApplicable, match="not finite"):
        line.displacement(np.array([[np.nan, 0.0, 0.0]]))


def test_no_points_have_no_displacements(line: CentreLine) -> None:
    assert line.displacement(np.zeros((0, 3))).shape == (0, 3)
