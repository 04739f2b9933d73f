"""The closed form for small deflections."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.references.small_deflection import SmallDeflection
from softmark.references.straight_cantilever import Cantilever


def test_tip_of_the_silicone_beam(silicone_beam: Cantilever) -> None:
    # w L^4 / (8 EI) = 0.2432452377118005 m (references.json, linear_small_strain): the same formula.
    u = SmallDeflection(body=None).solve(silicone_beam).displacement(np.array([[0.178, 0.0, 0.0]]))[0]
    np.testing.assert_allclose(u, [0, 0, -0.2432452377118005], atol=1e-15)


def test_curve_is_the_textbooks(silicone_beam: Cantilever) -> None:
    # w x^2 (6 L^2 - 4 L x + x^2) / (24 EI), evaluated as printed; only rounding may differ.
    beam = silicone_beam
    line = SmallDeflection(body=None).solve(beam)
    x, L = np.linspace(0, 0.178, 7), beam.length
    printed = beam.weight_per_length * x**2 * (6 * L**2 - 4 * L * x + x**2) / (24 * beam.bending_stiffness)
    np.testing.assert_allclose(line.transverse(x), printed, atol=1e-15)
    np.testing.assert_array_equal(line.axial(x), 0)
    assert np.abs(line.transverse(x) - printed).max() <= line.estimated_error


def test_rotation_is_the_slope_of_the_curve(silicone_beam: Cantilever) -> None:
    # Central differences of a quartic over 1e-4 m: truncation h^2 v''' / 6 with v''' = k / L^2 = 345 is 6e-7.
    line = SmallDeflection(body=None).solve(silicone_beam)
    x, h = np.linspace(0.01, 0.17, 5), 1e-4
    slope = (line.transverse(x + h) - line.transverse(x - h)) / (2 * h)
    np.testing.assert_allclose(line.rotation(x), slope, atol=1e-6)


def test_root_carries_the_moment_of_the_whole_weight(silicone_beam: Cantilever) -> None:
    # EI v''(0) = w L^2 / 2, by statics of the undeformed beam.
    beam = silicone_beam
    curvature = SmallDeflection(body=None).solve(beam).root_curvature
    moment = beam.weight_per_length * beam.length**2 / 2
    assert beam.bending_stiffness * curvature == pytest.approx(moment, rel=1e-14)
