"""How the boundary of a mesh is found: rows of node numbers as keys, and the cells that facets belong to."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh.mesh import _row_keys
from softmark.solvers.mesh.shapes import Cylinder


@pytest.mark.parametrize("largest", [10, 2**21 + 5, 2**31 + 7, 2**40])
@pytest.mark.parametrize("width", [2, 3, 4])
def test_keys_tell_rows_apart_whatever_their_numbers(largest: int, width: int) -> None:
    """Products of such numbers leave 64 bits from 2^21 on in rows of three: rows are equal where their keys are."""
    rng = np.random.default_rng(width)
    rows = rng.choice(rng.integers(0, largest, 6), (300, width))  # few numbers: many rows come twice
    rows[:2] = [[largest] * width, [largest] * (width - 1) + [largest - 1]]
    keys = _row_keys(rows.astype(np.int64))
    same = np.all(rows[:, None] == rows[None], axis=2)
    np.testing.assert_array_equal(keys[:, None] == keys[None], same)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_every_boundary_facet_has_its_cell(kind: str) -> None:
    mesh = Cylinder(0.05, 0.01).mesh(kind, 0.008)
    for facet, cell in zip(mesh.facets, mesh.facet_cells, strict=True):
        assert set(facet) <= set(mesh.cells[cell])
