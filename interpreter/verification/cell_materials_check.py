"""Which material each cell of a solution has, found again for the watchdog: by points of the cell, not by its volume.

A cell whose nodes and centre, seen from a little inside, all lie in one part is of that part. Of a cell that a border
passes this says nothing: there the model's own choice is taken, of which the report says what it misses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case

INWARD = 1e-6  # of the way to its centroid: where a cell is looked at, so that its border is not


def alone(case: Case, mesh: DeformedMesh) -> list[tuple[Case, Any]]:
    """A case of each material, and which cells are of it: all of a body of one material."""
    if not case.parts:
        return [(case, slice(None))]
    from softmark.interpreter.models.shared.region_cells import materials_of_cells

    owner = np.where((seen := _seen(case, mesh)) < 0, materials_of_cells(case, mesh.mesh).cells, seen)
    cases = [replace(case, other_material=material, parts=()) for material in case.materials]
    return [(own, np.flatnonzero(owner == i)) for i, own in enumerate(cases) if (owner == i).any()]


def _seen(case: Case, mesh: DeformedMesh) -> Any:
    """The number of the material that all points of a cell are of (m,), -1 where they are of several."""
    from softmark.interpreter.problem.group_conditions import cell_membership
    from softmark.interpreter.problem.material_layers import material_numbers

    corners = mesh.points[mesh.cells]
    middle = corners.mean(axis=1, keepdims=True)
    X = np.concatenate([corners + INWARD * (middle - corners), middle], axis=1)
    cells = cell_membership(mesh.mesh)
    found = material_numbers(case, X.reshape(-1, 3), lambda g: np.repeat(cells(g), X.shape[1])).reshape(X.shape[:2])
    return np.where((found == found[:, :1]).all(axis=1), found[:, 0], -1)
