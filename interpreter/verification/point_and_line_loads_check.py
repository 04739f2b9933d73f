"""Independent nodal forces of point and line loads.

The solver finds where a line passes from cell to cell. Here no faces are used: a stretch of the line is halved as long
as two Lobatto rules give different forces at any node. These rules include the ends; without them both rules would miss
a face just before an end. The check shares with the solver only the cell of each point, and computes the local position
again.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array

from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.loads.load import Vector3
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, Ints
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.mesh import Mesh

RULES = (5, 8)  # points on a stretch
AGREE = 1e-11  # relative to the line: tolerance of two rules on a stretch
HALVED = 30  # times
NEWTON = 12  # iterations for local coordinates
BEYOND = 0.2  # limit of local coordinates outside the cell
SAME, CLOSE = 1e-9, 1e-6  # relative to the extent: tolerance in a cell, and for a linear continuation


def at_points(at: Vector3, force: Vector3, case: Case, mesh: DeformedMesh) -> Floats:
    """Return nodal forces (n, 3), N, of a force, N, at a point, m; for a plane body spread along z by Simpson's rule.

    Raises NoIndependentFormula.
    """
    if not case.planar:
        return _forces_at_one_point(at, force, mesh)
    x, y, _ = at
    rim, found = 0.5 * case.body.thing.thickness, np.zeros_like(mesh.points)
    for z, share in ((-rim, 1.0), (0.0, 4.0), (rim, 1.0)):
        found += share / 6.0 * _forces_at_one_point((x, y, z), force, mesh)
    return found


def _forces_at_one_point(at: Vector3, force: Vector3, mesh: DeformedMesh) -> Floats:
    """Return the nodal forces (n, 3), N, of a point load, from the shape functions of the cell around its point.

    The shape functions sum to one and reproduce the position of the point.
    """
    nodes, N = _shape_functions_at_points(mesh.mesh, np.array([at]))
    found: Floats = np.zeros_like(mesh.points)
    np.add.at(found, nodes[0], N[0][:, None] * np.array(force))
    return found


def _shape_functions_at_points(mesh: Mesh, X: Floats) -> tuple[Ints, Floats]:
    """Return nodes (n, a) and shape functions (n, a) of the cells that contain points X (n, 3), m, by Newton's method.

    Points outside their cell, where a mesh cuts off a curved surface, keep the linear continuation of `locate`. Raises
    NoIndependentFormula if the shape functions do not reproduce the point.
    """
    place = locate_points(mesh, X)
    corners, kind, N = mesh.points[place.nodes], mesh.kind, place.N.copy()
    low, high = solid_forces.node_positions(kind).min(axis=0), solid_forces.node_positions(kind).max(axis=0)
    xi = np.tile(solid_forces.node_positions(kind).mean(axis=0), (len(X), 1))
    for _ in range(NEWTON):
        left = X - np.einsum("na,nai->ni", solid_forces.shape_functions(kind, xi), corners)
        J = np.einsum("nai,naj->nij", corners, solid_forces.shape_derivatives(kind, xi))
        xi = np.clip(xi + np.linalg.solve(J, left[:, :, None])[:, :, 0], low - BEYOND, high + BEYOND)
    own = solid_forces.shape_functions(kind, xi)
    inside = np.linalg.norm(np.einsum("na,nai->ni", own, corners) - X, axis=1) <= SAME * mesh.extent
    inside &= ((xi >= low - SAME) & (xi <= high + SAME)).all(axis=1)
    N[inside] = own[inside]
    away = np.linalg.norm(np.einsum("na,nai->ni", N, corners) - X, axis=1)
    if np.any(away > CLOSE * mesh.extent) or np.any(np.abs(N.sum(axis=1) - 1.0) > SAME):
        raise NoIndependentFormula("a point force acts outside the mesh")
    return place.nodes, N


def along_line(start: Vector3, end: Vector3, force: Vector3, mesh: Mesh) -> tuple[Floats, float]:
    """Return nodal forces (n, 3), N, of a force per length, N/m, along a line, and their uncertainty, N.

    Raises NoIndependentFormula.
    """
    begin, way = np.array(start), np.array(end) - np.array(start)
    found, unsure = np.zeros(len(mesh.points)), 0.0
    ends = np.array([[0.0, 1.0]])
    for halved in range(HALVED + 1):
        coarse, fine = (_node_fractions_of_stretches(mesh, begin, way, ends, rule) for rule in RULES)
        apart = np.asarray(abs(fine - coarse).sum(axis=1)).ravel()
        done = (apart <= AGREE) | (halved == HALVED)
        found += np.asarray(fine.tocsr()[np.flatnonzero(done)].sum(axis=0)).ravel()
        unsure += float(apart[done].sum())
        middle = ends[~done].mean(axis=1)
        ends = np.concatenate([np.stack([ends[~done, 0], middle], axis=1), np.stack([middle, ends[~done, 1]], axis=1)])
        if not len(ends):
            break
    q = float(np.linalg.norm(way)) * np.array(force)
    return found[:, None] * q, unsure * float(np.linalg.norm(q))


def _lobatto(points: int) -> tuple[Floats, Floats]:
    """Return points (p,) and weights (p,) of the Lobatto rule on [-1, 1], which is exact to degree 2 p - 3."""
    P = np.polynomial.Legendre.basis(points - 1)
    x = np.concatenate([[-1.0], np.sort(P.deriv().roots().real), [1.0]])
    return x, 2.0 / (points * (points - 1) * P(x) ** 2)


def _node_fractions_of_stretches(mesh: Mesh, begin: Floats, way: Floats, ends: Floats, rule: int) -> coo_array:
    """Return the fraction of each node in stretches with `ends` (k, 2), relative to the length: sparse (k, n)."""
    x, w = _lobatto(rule)
    step = np.diff(ends, axis=1)
    s, weights = ends[:, :1] + 0.5 * step * (x + 1.0), 0.5 * step * w
    nodes, N = _shape_functions_at_points(mesh, begin + s.ravel()[:, None] * way)
    rows = np.repeat(np.arange(len(ends)), rule * nodes.shape[1])
    values = (weights.ravel()[:, None] * N).ravel()
    return coo_array((values, (rows, nodes.ravel())), shape=(len(ends), len(mesh.points)))
