"""Independent check of cell materials, by sample points of each cell instead of its volume.

A cell whose nodes and centre, moved slightly inward, all lie in one region has the material of that region. Cells that
a region border crosses are not checked: the model's own choice is used, and the report gives its error.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case

INWARD = 1e-6  # relative distance to the centroid by which sample points move off the border


def split_by_material(case: Case, mesh: DeformedMesh) -> list[tuple[Case, Any]]:
    """Return one case for each material, with the numbers of its cells; for a body of one material, with all cells."""
    if not case.parts:
        return [(case, slice(None))]
    from softmark.interpreter.models.shared.region_cells import materials_of_cells

    owner = np.where((seen := _common_material(case, mesh)) < 0, materials_of_cells(case, mesh.mesh).cells, seen)
    cases = [replace(case, other_material=material, parts=()) for material in case.materials]
    return [(own, np.flatnonzero(owner == i)) for i, own in enumerate(cases) if (owner == i).any()]


def _common_material(case: Case, mesh: DeformedMesh) -> Any:
    """Return the number of the material that all sample points of a cell have (m,), or -1 if they differ."""
    from softmark.interpreter.problem.material_layers import material_numbers
    from softmark.interpreter.problem.mesh_group_conditions import cell_membership

    corners = mesh.points[mesh.cells]
    middle = corners.mean(axis=1, keepdims=True)
    X = np.concatenate([corners + INWARD * (middle - corners), middle], axis=1)
    cells = cell_membership(mesh.mesh)
    found = material_numbers(case, X.reshape(-1, 3), lambda g: np.repeat(cells(g), X.shape[1])).reshape(X.shape[:2])
    return np.where((found == found[:, :1]).all(axis=1), found[:, 0], -1)
