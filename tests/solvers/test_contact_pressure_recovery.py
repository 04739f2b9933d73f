"""What presses on a surface, from forces at nodes."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.contact.axis_pressure_correction import correct_axis_pressures
from softmark.solvers.contact.contact_pressure_recovery import ContactPressure
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Floats
from softmark.solvers.mesh.shapes import Box

FACET_OF = {"hex8": 4, "hex20": 8, "hex27": 9, "tet4": 3, "tet10": 6}


def top(kind: str, size: float) -> tuple[Floats, Floats]:
    """Nodes and facets of the upper face of a plate of 4 m by 4 m."""
    mesh = Box((4.0, 4.0, 1.0), (-2.0, -2.0, -1.0)).mesh(kind, size)
    facets = mesh.facets[np.abs(mesh.points[mesh.facets][..., 2]).max(axis=1) < 1e-9]
    return mesh.points, facets


def forces(points: Floats, facets: Floats, pressure: Floats) -> Floats:
    """Consistent forces of a pressure (f, q) at fine points."""
    facet, (xi, w) = FACETS[facets.shape[1]], moment_fitted_quadrature.gauss_rule(facets.shape[1])
    t = np.einsum("qaj,kai->jkqi", facet.gradient(xi), points[facets])
    dA = w * np.linalg.norm(np.cross(t[0], t[1]), axis=-1)
    found = np.zeros(len(points))
    np.add.at(found, facets, (pressure * dA) @ facet.shape(xi))
    return found


@pytest.mark.parametrize("kind", FACET_OF)
def test_a_uniform_pressure_is_found_whatever_the_facet(kind: str) -> None:
    """Corners of quadratic triangles carry nothing, those of serendipity squares pull: to rounding all the same."""
    points, facets = top(kind, 1.0)
    f = forces(points, facets, np.full((len(facets), 100), 7.0))
    own = ContactPressure(facets, points, f, np.zeros(len(points)), 1.0)
    assert own.pressures[np.unique(facets)] == pytest.approx(7.0, rel=1e-12)
    assert f.sum() == pytest.approx(7.0 * 16.0, rel=1e-12)


@pytest.mark.parametrize("kind", FACET_OF)
def test_what_presses_on_a_face_is_not_spread_around_its_edges(kind: str) -> None:
    """A third of the pressure was left at corners, and half along edges, where the sides are told of as well."""
    mesh = Box((4.0, 4.0, 1.0), (-2.0, -2.0, -1.0)).mesh(kind, 1.0)
    points, facets = top(kind, 1.0)
    f = forces(points, facets, np.full((len(facets), 100), 7.0))
    on = np.isin(np.arange(len(points)), facets)
    own = ContactPressure(mesh.facets, points, f, np.where(on, 0.0, 1.0), 1.0, on=on)
    assert own.pressures[np.unique(facets)] == pytest.approx(7.0, rel=1e-12)
    assert own.area == pytest.approx(16.0, rel=1e-12)
    assert own.border == 0.0


@pytest.mark.parametrize(("kind", "size", "most"), [("hex8", 0.25, 0.03), ("tet4", 0.25, 0.03), ("tet10", 0.5, 0.06)])
def test_the_circle_of_hertz_is_found_between_nodes(kind: str, size: float, most: float) -> None:
    """Of p = sqrt(1 - r^2), g = r^2/2 - 1 + ((2 - r^2) asin(1/r) + sqrt(r^2 - 1))/pi with E' = pi/2 the area is pi.

    Johnson 1985, eqs. 3.39 to 3.42, with a = R = 1. Nodes lie a quarter of the radius apart: counted by nodes it would
    be off by 7 %, as they happen to lie (the circle of Gauss). Asked are 3 %; of the largest pressure, a mean around a
    corner, 3 % as well, and 6 % where corners are twice as far apart.
    """
    points, facets = top(kind, size)
    xi, _ = moment_fitted_quadrature.gauss_rule(facets.shape[1])
    at = np.einsum("qa,kai->kqi", FACETS[facets.shape[1]].shape(xi), points[facets])
    f = forces(points, facets, np.sqrt(np.maximum(1.0 - (at[..., :2] ** 2).sum(axis=2), 0.0)))
    r = np.linalg.norm(points[:, :2], axis=1)
    q = np.maximum(r, 1.0)
    g = np.where(r >= 1.0, 0.5 * q**2 - 1.0 + ((2.0 - q**2) * np.arcsin(1.0 / q) + np.sqrt(q**2 - 1.0)) / np.pi, 0.0)
    own = ContactPressure(facets, points, np.where(r < 1.0, f, 0.0), g, 0.5 * np.pi)
    assert own.area == pytest.approx(np.pi, rel=0.03)
    assert own.largest == pytest.approx(1.0, rel=most)
    edge = 0.25  # of triangles, of quadratic facets half theirs; the border is a circle of 2 pi, and crosses some twice
    assert abs(own.area - np.pi) <= 0.5 * own.border <= 2.0 * np.pi * edge


def test_beside_what_is_held_the_area_is_a_number() -> None:
    """Nodes that supports hold have no gap: facets up to them count as pressed, 16 m^2 of them all."""
    points, facets = top("hex8", 1.0)
    held = points[:, 0] < -2.0 + 1e-9
    f = np.where(held, 0.0, forces(points, facets, np.full((len(facets), 100), 7.0)))
    own = ContactPressure(facets, points, f, np.where(held, np.inf, 0.0), 1.0)
    assert own.area == pytest.approx(16.0, rel=1e-3)


@pytest.mark.parametrize("defect", [0.2, -0.08])
def test_what_an_axis_has_too_much_goes_back_to_its_ring(defect: float) -> None:
    """Of p = 1 - r^2 / 50 on rings of 1 m: the axis to 1 % of p(0), and no force is lost.

    Mean pressures around rings are those of linear shape functions, by their moments: r^2 is 3/10 at the axis, 3/2 and
    9/2 (of the hat from 0 to 2 m, and from 1 to 3 m) around the first two rings; areas are as 1/6, 1 and 2.
    """
    r, area = np.arange(4.0), np.array([1 / 6, 1.0, 2.0, 3.0])
    right = 1.0 - np.array([0.3, 1.5, 4.5, 9.5]) / 50
    p = right.copy()
    p[0], p[1] = right[0] + defect, right[1] - defect / 6
    facets = np.array([[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]])
    both = np.tile(np.arange(4), 2)
    found = correct_axis_pressures(np.tile(p, 2), np.tile(area, 2), facets, np.tile(r, 2), both)
    assert found[:4] == pytest.approx(found[4:])
    assert found[0] == pytest.approx(1.0, abs=0.01)
    assert area @ found[:4] == pytest.approx(area @ right)
    uniform = np.tile(np.array([1.0 + defect, 1.0 - defect / 6, 1.0, 1.0]), 2)
    assert correct_axis_pressures(uniform, np.tile(area, 2), facets, np.tile(r, 2), both) == pytest.approx(1.0)


def test_an_axis_that_nothing_presses_stays_so() -> None:
    """Under a ring that presses from the second node on there is nothing within; and above it is not below."""
    r, area = np.arange(4.0), np.array([1 / 6, 1.0, 2.0, 3.0])
    facets = np.array([[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]])
    ring, full = np.array([0.0, 0.0, 5.0, 1.0]), np.array([1.2, 1.0, 0.9, 0.8])
    both = np.tile(np.arange(4), 2)
    assert correct_axis_pressures(np.tile(ring, 2), np.tile(area, 2), facets, np.tile(r, 2), both) == pytest.approx(
        np.tile(ring, 2)
    )
    above = correct_axis_pressures(np.tile(full, 2), np.tile(area, 2), facets, np.tile(r, 2), both)
    surfaces = np.concatenate([facets, facets + 8])
    p, numbers = np.concatenate([np.tile(full, 2), np.zeros(8)]), np.concatenate([both, both + 4])
    found = correct_axis_pressures(p, np.tile(area, 4), surfaces, np.tile(r, 4), numbers)
    assert found == pytest.approx(np.concatenate([above, np.zeros(8)]))
