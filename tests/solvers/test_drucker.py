"""Drucker's stability in Hencky's strain against formulas of one stretch, and against changes of strain at random."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from softmark.solvers.api.elastic_solid import material
from softmark.solvers.materials import law_for, mixed_for
from softmark.solvers.materials.batched_stability import VolumePressure
from softmark.solvers.materials.drucker_stability import find_instability
from softmark.solvers.statics.material_point import ImposedDeformation, MaterialPoint

Floats = NDArray[np.float64]
RNG = np.random.default_rng(3)


def point(name: str, **constants: Any) -> MaterialPoint:
    split = mixed_for(material(name, poisson=0.5, density=1.0, **constants), "finite")
    assert split is not None
    return MaterialPoint(split.shape, split.constraint)


def of_yeoh(c1: float, c2: float, c3: float) -> Callable[[float], tuple[float, float]]:
    """Of a pull to t of what keeps its volume: dsigma/dt, and what resists a change of its width."""

    def found(t: float) -> tuple[float, float]:
        i = t * t + 2.0 / t - 3.0
        W, bend = c1 + 2.0 * c2 * i + 3.0 * c3 * i * i, 2.0 * c2 + 6.0 * c3 * i
        return 2.0 * (2.0 * t + t**-2) * W + 4.0 * (t * t - 1.0 / t) ** 2 / t * bend, W

    return found


def of_ogden(mu: tuple[float, ...], alpha: tuple[float, ...]) -> Callable[[float], tuple[float, float]]:
    """The same: sigma = sum mu (t^a - t^(-a/2)), and w'' = sum mu a t^(-a/2) across."""
    terms = list(zip(mu, alpha, strict=True))
    return lambda t: (
        sum(m * a * (t ** (a - 1.0) + 0.5 * t ** (-0.5 * a - 1.0)) for m, a in terms),
        sum(m * a * t ** (-0.5 * a) for m, a in terms),
    )


@pytest.mark.parametrize(("name", "constants", "formula", "far"), [
    ("yeoh", {"c1": 10.0, "c2": -1.0, "c3": 0.0}, of_yeoh(10.0, -1.0, 0.0), 2.5),
    ("yeoh", {"c1": 10.0, "c2": -1.0, "c3": 0.0}, of_yeoh(10.0, -1.0, 0.0), 0.3),
    ("yeoh", {"c1": 10.0, "c2": 0.5, "c3": -0.02}, of_yeoh(10.0, 0.5, -0.02), 6.0),
    ("ogden", {"mu": (10.0, -0.1), "alpha": (2.0, 4.0)}, of_ogden((10.0, -0.1), (2.0, 4.0)), 9.0),
    ("ogden", {"mu": (10.0, 0.1), "alpha": (2.0, -4.0)}, of_ogden((10.0, 0.1), (2.0, -4.0)), 9.0),
    ("ogden", {"mu": (10.0, 0.1), "alpha": (2.0, -4.0)}, of_ogden((10.0, 0.1), (2.0, -4.0)), 0.2),
])  # fmt: skip
def test_a_pull_loses_it_where_a_formula_of_one_stretch_says(
    name: str, constants: dict[str, Any], formula: Callable[[float], tuple[float, float]], far: float
) -> None:
    """The first stretch on the way at which one of two slopes is zero, to 1e-7 of it."""
    found, first = point(name, **constants), far
    way = np.linspace(1.0, far, 2001)
    for k in (0, 1):
        values = [formula(t)[k] for t in way]
        for a, b, fa, fb in zip(way, way[1:], values, values[1:], strict=False):
            if fa > 0.0 >= fb:
                root = brentq(lambda t, k=k: formula(t)[k], a, b, xtol=1e-14)
                first = root if abs(root - 1.0) < abs(first - 1.0) else first
                break
    assert first != far
    assert found.constraint is not None
    held = VolumePressure(
        found.constraint, math.inf, np.zeros(2)
    )  # a pressure does no work in changes that keep a volume
    at = [first * (1.0 + e) if far > 1.0 else first * (1.0 - e) for e in (-1e-7, 1e-7)]
    F = np.array([np.diag([t, t**-0.5, t**-0.5]) for t in at])
    np.testing.assert_array_equal(find_instability(found.law, F, held), [False, True])


def test_a_point_says_from_which_stretch_on_it_is_lost() -> None:
    """To 1e-7, as thirty bisections tell 1e-9 of the way."""
    found, formula = point("yeoh", c1=10.0, c2=-1.0, c3=0.0), of_yeoh(10.0, -1.0, 0.0)
    drive = ImposedDeformation(np.array([2.3, math.nan, math.nan]))
    assert not found.is_drucker_stable(found.state(drive))
    first = brentq(lambda t: formula(t)[0], 1.5, 2.3, xtol=1e-14)
    assert found.first_drucker_unstable_state(drive).F[0, 0] == pytest.approx(first, rel=1e-7)


def test_kirchhoff_loses_it_where_its_stress_peaks_along_an_axis() -> None:
    """With nu = 0 each axis is by itself, tau = mu s^2 (s^2 - 1), whose slope by ln s is zero at s = 1/sqrt(2)."""
    law, l = law_for(material("st_venant_kirchhoff", young=1.0, poisson=0.0, density=1.0), "finite"), 1.0 / math.sqrt(2)
    F = np.array([np.diag([a, 1.0, 1.0]) for a in (l * (1 - 1e-9), l * (1 + 1e-9))])
    np.testing.assert_array_equal(find_instability(law, F), [True, False])


@pytest.mark.parametrize(("volumetric", "held"), [("squared", False), ("logarithmic", True), ("reciprocal", True)])
def test_a_volume_that_is_squared_holds_down_to_a_half(volumetric: str, held: bool) -> None:
    """K/2 (J - 1)^2 has the slope K (2 J^2 - J) by ln J twice, zero at J = 1/2; the others are convex."""
    made: Any = material("mooney_rivlin", c1=6.0, c2=4.0, poisson=0.4, density=1.0, volumetric=volumetric)
    law = law_for(made, "finite")
    for J, sound in ((0.5 * (1 + 1e-6), True), (0.5 * (1 - 1e-6), held)):
        F = np.eye(3)[None] * J ** (1 / 3)
        assert find_instability(law, F)[0] == (not sound)  # type: ignore[index]
    assert made.convex_above == (0.0 if held else 0.5)


def work(law: Any, F: Floats, kept: bool) -> float:
    """The least d tau : d ln V of changes of ln V at random, of unit size, by differences: another formula."""
    w, axes = np.linalg.eigh(F @ F.T)
    E = 0.5 * (axes * np.log(w)) @ axes.T

    def tau(of: Floats) -> Floats:
        w, axes = np.linalg.eigh(of)
        V = np.einsum("mia,ma,mja->mij", axes, np.exp(w), axes)
        found: Floats = law.P(V) @ V
        return found

    d, h = RNG.normal(size=(300, 3, 3)), 1e-6
    d = d + d.transpose(0, 2, 1)
    if kept:
        d -= np.trace(d, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    d /= np.linalg.norm(d, axis=(1, 2))[:, None, None]
    done = ((tau(E + h * d) - tau(E - h * d)) * d).sum(axis=(1, 2)) / (2.0 * h)
    return float(done.min())


@pytest.mark.parametrize("kept", [False, True])
@pytest.mark.parametrize(("name", "constants"), [
    ("st_venant_kirchhoff", {"young": 1.0}), ("neo_hookean", {"young": 1.0}), ("stable_neo_hookean", {"young": 1.0}),
    ("yeoh", {"c1": 0.2, "c2": -0.04, "c3": 0.0}), ("veronda_westmann", {"c": 0.4, "a": 0.4}),
    ("ogden", {"mu": (0.4, -0.02), "alpha": (2.0, 4.0)}),
])  # fmt: skip
def test_what_is_lost_is_what_some_change_of_strain_loses(name: str, constants: dict[str, Any], kept: bool) -> None:
    law = law_for(material(name, poisson=0.3, density=1.0, **constants), "finite")
    R = np.linalg.qr(RNG.normal(size=(12, 3, 3)))[0]
    F = np.einsum("mij,mj,mkj->mik", R, np.exp(RNG.uniform(-0.6, 0.6, (12, 3))), R)
    from softmark.solvers.materials.volumetric_constraints import VolumeRatio

    held = VolumePressure(VolumeRatio(), math.inf, np.zeros(len(F))) if kept else None
    found, seen = find_instability(law, F, held), np.array([work(law, one, kept) for one in F])
    assert found is not None
    assert found[seen < -1e-6].all()  # a change tells it for sure
    assert not found[seen > 0.15].any()  # and 300 leave little between them


def test_a_law_with_directions_is_not_asked() -> None:
    made: Any = material("neo_hookean", young=1.0, poisson=0.3, density=1.0)
    assert made.convex_above == 0.0
    assert find_instability(object(), np.eye(3)[None]) is None


def test_what_is_pressed_flat_is_not_asked() -> None:
    """Slopes by ln s are as s^2 of a stretch that vanishes: their signs are rounding, and change with the machine."""
    law = law_for(material("st_venant_kirchhoff", young=1.0, poisson=0.3, density=1.0), "finite")
    flat = np.array([np.diag([2.3, t, t * (1.0 + 1e-9)]) for t in (1e-7, 1e-12, 1e-16)])
    assert not find_instability(law, flat).any()
    assert find_instability(law, np.array([np.diag([0.5, 0.5, 0.5])])).all()  # tau is as s^2 (s^2 - 1): below 0.71
