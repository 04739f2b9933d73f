"""What supports hold, and how they move rigid bodies, found once more for the watchdog."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.evidence.materials import INWARD
from softmark.interpreter.models.shared.prepared import Moved
from softmark.interpreter.problem.case import Case, Touch
from softmark.interpreter.problem.members import apart, of_cells, of_facets, of_nodes

Floats = NDArray[np.float64]


def held(case: Case, mesh: Moved) -> NDArray[np.bool_]:
    """Which degrees of freedom supports hold (n, 3): of the nodes that they select, and of whole cells and facets.

    Cells and facets are taken as selected where all their corners are, seen from a little inside: a selection without
    its border holds up to it.
    """
    points = mesh.points
    found = np.zeros(points.shape, dtype=np.bool_)
    extent = float(np.sqrt((np.ptp(points, axis=0) ** 2).sum()))
    for support in case.supports:
        where = np.zeros(len(points), dtype=np.bool_)
        for condition, which in apart(support.thing.where, of_nodes(mesh.mesh)):
            x, y, z = points[which].T
            where[which] = np.broadcast_to(condition.holds(x, y, z, extent), len(x))
        for nodes, members in ((mesh.cells, of_cells(mesh.mesh)), (mesh.mesh.facets, of_facets(mesh.mesh))):
            corners = points[nodes]
            X = corners + INWARD * (corners.mean(axis=1, keepdims=True) - corners)
            for condition, which in apart(support.thing.where, members):
                x, y, z = np.moveaxis(X[which], 2, 0)
                inside = np.broadcast_to(condition.holds(x, y, z, extent), x.shape)
                where[nodes[which][inside.all(axis=1)]] = True
        for c in support.thing.components:
            found[:, c] |= where
    return found


def motion(touch: Touch) -> tuple[Floats, Floats, Floats]:
    """How a rigid body has moved: its shift, m, its turn, rad, and the point that this is around, m."""
    shift, rotation, through = np.zeros(3), np.zeros(3), np.zeros(3)
    if touch.along is not None:
        shift[touch.along] += touch.gone
    for support in (moved.thing for moved in touch.moved):
        for c in support.components:
            shift[c] += support.displacement[c]
        if support.turns:
            rotation, through = np.array(support.rotation), np.array(support.through)
    return shift, rotation, through
