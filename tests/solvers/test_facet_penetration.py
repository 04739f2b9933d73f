"""Points that join those which are kept clear: where they are, their planes, and their forces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.contact.barrier_law import Barrier
from softmark.solvers.contact.facet_contact_points import make_searched_facets
from softmark.solvers.contact.facet_penetration import _common_normal, find_penetrating_points
from softmark.solvers.contact.rigid_contact import RigidContact, node_areas
from softmark.solvers.contact.rigid_friction import add_friction
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.mesh.shapes import Box

X = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
TRIANGLES = np.array([[0, 2, 1], [0, 3, 2]])  # seen from below, where the box comes from
REST = np.zeros(12)


def touching(
    size: tuple[float, float, float], origin: tuple[float, float, float], pose: RigidMotion | None = None
) -> RigidContact:
    """A square of two triangles, and a box under it that is somewhere."""
    gap: Any = gap_of(Box(size, origin=origin))
    body = MovedGap(gap, RigidMotion() if pose is None else pose)
    nodes, areas = node_areas(X, TRIANGLES, ((0, 1, 2),))
    return RigidContact(
        nodes,
        X[nodes],
        areas,
        Barrier(1e-3, 1.0),
        lambda share: body,
        facing=make_searched_facets(X, TRIANGLES, 1),
    )


def test_a_point_half_way_between_sides_has_a_normal_of_one_of_them() -> None:
    """A trial step may bring a facet as deep as the middle of a box, where the normals around it cancel."""
    around = np.vstack([np.eye(3)[:2], -np.eye(3)[:2]])
    found = _common_normal(1e-5 * around, around)
    assert np.linalg.norm(found) == pytest.approx(1.0)


def test_an_edge_that_lies_across_is_met_where_it_leaves() -> None:
    """A box turned by 45 degrees, its upper edge 0.05 above a facet: across both triangles, with normals of both edges.

    It leaves the square at x = 0.3, and crosses the diagonal there: planes lie across the facet, at its depth.
    """
    turned = RigidMotion((0.3, 0.0, 0.05 - np.sqrt(0.5)), (0.0, np.pi / 4, 0.0))
    contact = touching((1.0, 4.0, 1.0), (-0.5, -2.0, -0.5), turned)
    found = find_penetrating_points(contact, REST)
    assert found is not None
    assert found.points.X[:, 0] == pytest.approx(0.3, abs=1e-4)  # as finely as is looked: 2e-5 of a side
    assert set(np.round(found.points.X[:, 1], 3)) == {0.0, 0.3, 1.0}
    held = contact.with_added_points(found, REST)
    _, n = held.added_point_planes(held.body)
    assert n == pytest.approx(np.broadcast_to([0.0, 0.0, 1.0], n.shape), abs=1e-6)
    assert held.gaps(REST)[held.lasting :] == pytest.approx(-0.05, abs=1e-4)


def test_a_corner_is_met_within_a_facet() -> None:
    """One of a box that stands on its diagonal, 0.02 above: at the corner, along the normal of the facet."""
    about = np.cross([1.0, 1.0, 1.0], [0.0, 0.0, 1.0])
    turn = np.arccos(3.0**-0.5) * about / np.linalg.norm(about)
    pose = RigidMotion((0.7, 0.2, 0.02 - np.sqrt(0.75)), tuple(turn.tolist()))
    contact = touching((1.0, 1.0, 1.0), (-0.5, -0.5, -0.5), pose)
    found = find_penetrating_points(contact, REST)
    assert found is not None
    inside = found.which < len(TRIANGLES)
    assert inside.sum() == 1
    assert found.points.X[inside][0] == pytest.approx([0.7, 0.2, 0.0], abs=1e-3)
    held = contact.with_added_points(found, REST)
    assert held.gaps(REST)[held.lasting :][inside] == pytest.approx(-0.02, abs=1e-3)


def test_nothing_joins_where_nothing_cuts() -> None:
    assert find_penetrating_points(touching((1.0, 4.0, 1.0), (-0.5, -2.0, -1.1)), REST) is None


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_forces_of_what_joins_are_derivatives(friction: float) -> None:
    """Central differences, with friction those of the lag, which has an energy: to 1e-6 of the largest entry."""
    turned = RigidMotion((0.3, 0.0, 0.05 - np.sqrt(0.5)), (0.0, np.pi / 4, 0.0))
    contact = touching((1.0, 4.0, 1.0), (-0.5, -2.0, -0.5), turned)
    made: Any = add_friction(contact, friction, lambda share: turned) if friction else contact
    made = made.with_added_points(find_penetrating_points(contact, REST), REST)
    x = np.tile([0.0, 0.0, 0.0505], 4) + 1e-4 * np.random.default_rng(2).standard_normal(12)
    assert (made.pressures(x)[made.lasting :] > 0.0).all()
    made = made.lagged(x) if friction else made
    assembly, h = Assembly(12, np.zeros(0, dtype=np.int64), [], [made]), 1e-7
    g, K = assembly.gradient(x, 1.0), assembly.tangent(x, 1.0).toarray()
    along = [(x + h * d, x - h * d) for d in np.eye(12)]
    slopes = [(assembly.value(a, 1.0) - assembly.value(b, 1.0)) / (2 * h) for a, b in along]
    changes = np.array([(assembly.gradient(a, 1.0) - assembly.gradient(b, 1.0)) / (2 * h) for a, b in along])
    assert slopes == pytest.approx(g, abs=1e-6 * np.abs(g).max())
    assert np.abs(changes - K).max() < 1e-5 * np.abs(K).max()


def test_the_pattern_of_a_tangent_holds_stencils_within_it() -> None:
    """Of a joined point every entry is found, held ones are -1, and what is not coupled is refused."""
    contact = touching((1.0, 4.0, 1.0), (-0.5, -2.0, -1.1))
    assembly = Assembly(12, np.array([0]), [], [contact])
    number = np.concatenate([[-1], np.arange(11)])
    with pytest.raises(ValueError, match="lacks couplings"):
        assembly.pattern.places(number, np.arange(6)[None])
    assert assembly.pattern.places(number, np.arange(3)[None])[0, 0].tolist() == [-1, -1, -1]
