"""Bowls: walls between two ellipsoids that are cut off straight, in space and by their section."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from softmark.solvers.mesh.ellipsoidal_shells import TruncatedEllipsoidSection, TruncatedEllipsoidShell
from softmark.solvers.mesh.plane_regions import Slice

WALL = (0.007, 0.017, 0.010, 0.020)
PLACED = {"axis": (0.0, 0.6, -0.8), "origin": (0.1, -0.2, 0.3)}


def between(rim: float, power: int) -> float:
    """Integral of r^power over the height, outer less inner, by quadrature."""
    a, b, c, d = WALL
    each = [
        quad(lambda y, a=a, b=b: (a * math.sqrt(1 - (y / b) ** 2)) ** power, -b, rim, epsabs=0.0, epsrel=1e-10)[0]
        for a, b in ((c, d), (a, b))
    ]
    return float(each[0] - each[1])


@pytest.mark.parametrize("rim", [-0.004, 0.0, 0.005])
def test_area_and_volume_are_integrals(rim: float) -> None:
    assert TruncatedEllipsoidSection(*WALL, rim).area == pytest.approx(between(rim, 1), rel=1e-8)
    assert TruncatedEllipsoidShell(*WALL, rim).volume == pytest.approx(math.pi * between(rim, 2), rel=1e-8)


@pytest.mark.parametrize("more", [{}, PLACED, {"tip": 0.3}], ids=["along z", "anywhere", "finer about the tip"])
@pytest.mark.parametrize("kind", ["hex20", "hex27", "tet10", "hex8"])
def test_nodes_lie_on_the_wall_and_its_rim(kind: str, more: dict[str, tuple[float, float, float]]) -> None:
    """All nodes of curved sides on them, those between corners too, but of linear elements' sides between; a flat rim.

    Quadratic cells hold the volume to 1 % on this mesh of two layers; the rim of the hole is a circle of the ellipsoid.
    """
    bowl = TruncatedEllipsoidShell(*WALL, 0.005, 2, **more)
    mesh = bowl.mesh(kind, 0.006)
    assert mesh.volumes.min() > 0.0
    Y = mesh.points - np.array(bowl.origin)
    z = Y @ np.array(bowl.axis)
    r = np.linalg.norm(Y - z[:, None] * np.array(bowl.axis), axis=1)
    corners = mesh.points[mesh.facets]
    inner, outer = (side.of(corners) for side in bowl.sides[::-1])
    rim = (np.abs((corners - np.array(bowl.origin)) @ np.array(bowl.axis) - 0.005) < 1e-9).all(axis=1)
    assert (inner.astype(int) + outer + rim == 1).all()
    edge = np.unique(mesh.facets[rim])
    on = edge[np.abs(np.hypot(r[edge] / 0.007, z[edge] / 0.017) - 1.0) < 1e-9]
    np.testing.assert_allclose(r[on], 0.007 * math.sqrt(1.0 - (5.0 / 17.0) ** 2), rtol=1e-9)
    low, high = bowl.bounds
    assert (mesh.points > np.array(low) - 1e-9).all()
    assert (mesh.points < np.array(high) + 1e-9).all()
    assert all(bowl.contains(tuple(X)) for X in mesh.points[::7].tolist())
    if kind != "hex8":
        assert float(mesh.volumes.sum()) == pytest.approx(bowl.volume, rel=0.01)


def test_bounds_are_reached() -> None:
    """Of a bowl that lies askew: by points of its outer side and of its rim."""
    bowl = TruncatedEllipsoidShell(*WALL, 0.005, **PLACED)
    v, u = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 721), np.linspace(0.0, math.acos(-0.005 / 0.020), 721))
    e3 = np.array(bowl.axis)
    e1 = np.cross(e3, [1.0, 0.0, 0.0])
    X = np.stack([0.010 * np.sin(u) * np.cos(v), 0.010 * np.sin(u) * np.sin(v), -0.020 * np.cos(u)], axis=-1)
    X = X.reshape(-1, 3) @ np.stack([e1, np.cross(e3, e1), e3]) + np.array(bowl.origin)
    np.testing.assert_allclose(X.min(axis=0), bowl.bounds[0], atol=1e-7)
    np.testing.assert_allclose(X.max(axis=0), bowl.bounds[1], atol=1e-7)


def test_a_section_has_its_layers_and_turns_into_the_bowl() -> None:
    section = TruncatedEllipsoidSection(*WALL, 0.005, 3)
    mesh = Slice(section, 1e-3).mesh("quad9", 0.004)
    assert Slice(section, 1e-3).counts(0.004)[0] == 3
    x, y, _ = mesh.points.T
    assert x.min() == 0.0
    assert y.max() == 0.005
    assert float(mesh.volumes.sum()) == pytest.approx(section.area * 1e-3, rel=1e-3)


@pytest.mark.parametrize("tip", [1.0, 0.4])
def test_cells_are_shorter_about_the_tip(tip: float) -> None:
    """Along the inner side of a section, of 16 cells: (15 tip + 1) / 16 of the mean at the tip, 2 - that at the rim."""
    section = TruncatedEllipsoidSection(*WALL, 0.005, 1, tip)
    _, z = section(np.zeros(17), np.linspace(0.0, 1.0, 17))
    steps = np.diff(np.arccos(-z / 0.017)) / np.arccos(-0.005 / 0.017) * 16.0
    assert steps[0] == pytest.approx((15.0 * tip + 1.0) / 16.0, rel=1e-9)
    assert steps[-1] == pytest.approx(2.0 - (15.0 * tip + 1.0) / 16.0, rel=1e-9)


def test_walls_that_are_not_there_are_refused() -> None:
    assert TruncatedEllipsoidShell(0.010, 0.017, 0.010, 0.020, 0.005).fault
    assert TruncatedEllipsoidShell(*WALL, 0.018).fault
    assert not TruncatedEllipsoidShell(*WALL, 0.005).fault
