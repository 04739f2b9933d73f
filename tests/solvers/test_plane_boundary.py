"""The border of a slice: what stands across it, and of a body of revolution is not on its axis."""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.plane_boundary import is_on_border


def test_facets_of_faces_and_of_the_axis_are_no_border() -> None:
    """A square from x = 0 to 1 in a slice of 0.1: its axis, its outer side, and a face."""
    low = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    points = np.concatenate([low, low + np.array([0.0, 0.0, 0.1])])
    facets = np.array([(0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 2, 3)])
    assert is_on_border(points, facets).tolist() == [True, True, False]
    assert is_on_border(points, facets, revolved=True).tolist() == [False, True, False]
    assert is_on_border(points, facets[:0]).tolist() == []
