"""Independent check of supported degrees of freedom and of the motion of rigid bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case, RigidBodyContact
from softmark.interpreter.problem.mesh_group_conditions import (
    cell_membership,
    facet_membership,
    node_membership,
    split_by_groups,
)
from softmark.interpreter.verification.cell_materials_check import INWARD

Floats = NDArray[np.float64]
PLACED = 1e-6  # relative to the motion that a support imposes: what may be lacking of it, in single precision too
ROUNDED = 1e-9  # relative to the body size: what rounding may leave


def held_components(case: Case, mesh: DeformedMesh) -> NDArray[np.bool_]:
    """Return a mask of degrees of freedom that supports hold (n, 3), at nodes and in whole cells and facets.

    Cells and facets count as selected if all their corners are, moved slightly inward, because a selection may exclude
    its border.
    """
    points = mesh.points
    found = np.zeros(points.shape, dtype=np.bool_)
    extent = float(np.sqrt((np.ptp(points, axis=0) ** 2).sum()))
    for support in case.supports:
        where = np.zeros(len(points), dtype=np.bool_)
        for condition, which in split_by_groups(support.thing.where, node_membership(mesh.mesh)):
            x, y, z = points[which].T
            where[which] = np.broadcast_to(condition.holds(x, y, z, extent), len(x))
        for nodes, members in (
            (mesh.cells, cell_membership(mesh.mesh)),
            (mesh.mesh.facets, facet_membership(mesh.mesh)),
        ):
            corners = points[nodes]
            X = corners + INWARD * (corners.mean(axis=1, keepdims=True) - corners)
            for condition, which in split_by_groups(support.thing.where, members):
                x, y, z = np.moveaxis(X[which], 2, 0)
                inside = np.broadcast_to(condition.holds(x, y, z, extent), x.shape)
                where[nodes[which][inside.all(axis=1)]] = True
        for c in support.thing.components:
            found[:, c] |= where
    return found


def support_deviation(case: Case, mesh: DeformedMesh) -> tuple[float, str | None]:
    """Return the largest deviation from prescribed motion, relative to the body's size, and the name of its support.

    The prescribed motion is computed by the second formula of each support; supports without one are left out. The
    name is None if rounding explains the deviation.
    """
    u, worst, name = np.asarray(mesh.displacement, dtype=np.float64), 0.0, None
    X = mesh.points * (1.0, 1.0, 0.0) if case.planar else mesh.points
    for support in case.supports:
        if (asked := support.thing.independent_positions(X)) is None:
            continue
        own = held_components(replace(case, supports=(support,)), mesh)
        size = mesh.mesh.extent + float(np.abs(asked - X).max(initial=0.0))
        off = float(np.abs((u - (asked - X))[own]).max(initial=0.0)) / size
        moved = float(np.abs((asked - X)[own]).max(initial=0.0)) / size
        if off > worst:
            worst = off
            name = support.name if off > PLACED * moved + ROUNDED else name
    return worst, name


def rigid_motion(touch: RigidBodyContact) -> tuple[Floats, Floats, Floats]:
    """Return the motion of a rigid body: displacement, m, rotation vector, rad, and centre of rotation, m."""
    shift, rotation, through = np.zeros(3), np.zeros(3), np.zeros(3)
    if touch.along is not None:
        shift[touch.along] += touch.force_travel
    for support in (moved.thing for moved in touch.moved):
        for c in support.components:
            shift[c] += support.displacement[c]
        if support.rotates:
            rotation, through = np.array(support.rotation), np.array(support.through)
    return shift, rotation, through
