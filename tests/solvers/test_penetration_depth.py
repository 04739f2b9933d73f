"""How deep facets cut into rigid bodies between their nodes: by hand, and against a dense lattice of points."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.independent_forces import rigid_contact_forces, solid_forces
from softmark.solvers.independent_forces.penetration_depth import find_deepest_point

FLAT = np.array([[(-2.0, -1.5, 0.0), (2.5, -1.5, 0.0), (0.0, 3.0, 0.0)]])
O, Z = np.zeros(3), np.array([0.0, 0.0, 1.0])
BODIES = {
    "ball": rigid_contact_forces.ball_distance(np.array([0.3, 0.1, 0.9]), 1.0),
    "box": rigid_contact_forces.box_distance(np.array([-0.3, -0.3, -0.2]), np.array([0.3, 0.3, 1.0])),
    "cone": rigid_contact_forces.revolved_distance(
        rigid_contact_forces.polygon_distance([(0.0, -0.25), (1.0, 1.0), (0.0, 1.0)], mirrored=True), O, Z
    ),
    "half_space": rigid_contact_forces.half_space_distance(-0.5 * Z, np.array([0.0, 0.6, -0.8])),
    "hollow": rigid_contact_forces.hollow_ball_distance(np.array([0.3, 0.1, 0.9]), 1.0, 0.95),
}


def cut(body: str, X: np.ndarray, convex: bool = True) -> tuple[float, np.ndarray]:
    kind = FACETS[X.shape[1]]
    triangles = np.array(kind.rim)[np.array(kind.halves)]
    return find_deepest_point(BODIES[body], X, partial(solid_forces.shape_functions, X.shape[1]), triangles, convex)


@pytest.mark.parametrize(("body", "depth", "within"), [
    ("ball", 0.1, 1e-3),  # its radius less its height: to a thousandth, which is where it ends
    ("box", 0.2, 1e-12),  # down to its lowest face
    ("cone", 0.25 / np.hypot(1.0, 1.25), 3e-2),  # from (0, 0) to its flank from (0, -1/4) to (1, 1)
])  # fmt: skip
def test_depths_by_hand(body: str, depth: float, within: float) -> None:
    """No corner of the triangle is behind a surface."""
    found, place = cut(body, FLAT)
    assert -found == pytest.approx(depth, rel=within)
    assert place[2] == 0.0


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("nodes", [3, 4, 6, 8, 9])
def test_nothing_is_deeper_on_a_dense_lattice(body: str, nodes: int) -> None:
    """Of 200 bent facets: 60 steps along a side find nothing deeper, but for a part of 2^-9 of a side at edges."""
    kind, one = FACETS[nodes], np.random.default_rng(nodes)
    local = np.array(kind.rim)
    local = np.concatenate([local, *([0.5 * (local + np.roll(local, -1, axis=0))] if nodes in (6, 8, 9) else []),
                            *([np.zeros((1, 2))] if nodes == 9 else [])])  # fmt: skip
    X = np.concatenate([local, np.zeros((nodes, 1))], axis=1) + one.uniform(-0.1, 0.1, (200, nodes, 3))
    N = solid_forces.shape_functions(nodes, kind.lattice(60))
    g = BODIES[body](np.einsum("qa,fai->fqi", N, X).reshape(-1, 3))[0]
    found, _ = cut(body, X, convex=body != "hollow")
    assert found <= min(0.0, float(g.min())) + (0.004 if body != "hollow" else 0.04)


def test_what_lies_flat_on_a_surface_does_not_cut() -> None:
    """A billionth above it: nothing is halved, and nothing is found."""
    found, place = find_deepest_point(
        rigid_contact_forces.half_space_distance(O, Z),
        FLAT + 1e-9,
        partial(solid_forces.shape_functions, 3),
        np.array(FACETS[3].rim)[np.array(FACETS[3].halves)],
        True,
    )
    assert found == 0.0
    assert np.isnan(place).all()
