"""Which material each cell of a solution has, found again for the watchdog: by points of the cell, not by its volume.

A cell whose nodes and centre, seen from a little inside, all lie in one part is of that part. Of a cell that a border
passes this says nothing: there the model's own choice is taken, of which the report says what it misses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.models.shared.prepared import Moved
from softmark.interpreter.problem.case import Case

INWARD = 1e-6  # of the way to its centroid: where a cell is looked at, so that its border is not


def alone(case: Case, mesh: Moved) -> list[tuple[Case, Any]]:
    """A case of each material, and which cells are of it: all of a body of one material."""
    if not case.parts:
        return [(case, slice(None))]
    from softmark.interpreter.models.shared.regions import owners

    owner = np.where((seen := _seen(case, mesh)) < 0, owners(case, mesh.mesh).cells, seen)
    cases = [replace(case, other_material=material, parts=()) for material in case.materials]
    return [(own, np.flatnonzero(owner == i)) for i, own in enumerate(cases) if (owner == i).any()]


def _seen(case: Case, mesh: Moved) -> Any:
    """The number of the material that all points of a cell are of (m,), -1 where they are of several."""
    from softmark.interpreter.problem.regions import remaining

    corners = mesh.points[mesh.cells]
    middle = corners.mean(axis=1, keepdims=True)
    X = np.concatenate([corners + INWARD * (middle - corners), middle], axis=1)
    extent = float(np.sqrt((np.ptp(mesh.points, axis=0) ** 2).sum()))
    x, y, z = np.moveaxis(X, 2, 0)
    number = np.zeros(X.shape[:2], dtype=np.int64)
    for i, where in enumerate(remaining(case), start=1):
        number[np.broadcast_to(where.holds(x, y, z, extent), number.shape)] = i
    return np.where((number == number[:, :1]).all(axis=1), number[:, 0], -1)
