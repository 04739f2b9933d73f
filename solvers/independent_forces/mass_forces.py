"""Independent nodal masses, and forces per mass, of solid elements, by numpy from the nodes of a mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np

from softmark.solvers.independent_forces.quadrature_rules import extend_along_wedge, rule_by_moments, strang_rule
from softmark.solvers.independent_forces.solid_forces import (
    CHUNK,
    Floats,
    Ints,
    gradients,
    interpolate,
    is_tensor_product,
    is_wedge,
    node_positions,
    quadrature_rule,
    shape_functions,
)


@cache
def _mass_rule(kind: str) -> tuple[Floats, Floats]:
    """Return points and weights for products of shape functions, of degree five for tetrahedra (Stroud 1971)."""
    if is_tensor_product(kind):
        return quadrature_rule(kind)
    if is_wedge(kind):
        return extend_along_wedge(strang_rule(), [-np.sqrt(0.6), 0.0, np.sqrt(0.6)])
    (a, u), (b, v), (c, w) = (rule_by_moments(3, power) for power in (2, 1, 0))
    xi, weights = [], []
    for i in range(3):
        for j in range(3):
            for k in range(3):
                r, s, t = a[i], b[j], c[k]
                xi.append((r, (1 - r) * s, (1 - r) * (1 - s) * t))
                weights.append(u[i] * v[j] * w[k])
    return np.array(xi), np.array(weights)


def nodal_masses(
    points: Floats, cells: Ints, kind: str, density: Any, how: str, nodes: int, depth: float = 0.0, rules: Any = None
) -> Floats:
    """Return the mass at each node (nodes,), kg.

    `how` is the distribution: "consistent", "lumped" or "uniform". `density` is a number, kg/m^3, or a function of
    points (n, 3). `rules` are local points (m, q, 3) and weights (m, q) of each cell; None if all cells have the rule
    of their kind.
    """
    if how == "uniform":
        whole = float(nodal_masses(points, cells, kind, density, "consistent", nodes, rules=rules).sum())
        return np.full(nodes, whole / nodes)
    few = len(node_positions(kind)) == 4 and not callable(density)  # a quarter of a linear tetrahedron for each node
    rules = rules or (quadrature_rule(kind) if few else None)
    carried = np.zeros(nodes)
    for some, N, masses in _masses_at_points(points, cells, kind, density, depth, rules):
        share = interpolate(N.swapaxes(-1, -2), masses)
        if how == "lumped":  # Hinton, Rock and Zienkiewicz (1976)
            square = interpolate(N.swapaxes(-1, -2) ** 2, masses)
            share = square * (masses.sum(axis=1) / square.sum(axis=1))[:, None]
        carried += np.bincount(some.ravel(), share.ravel(), minlength=nodes)
    return carried


def affine_mass_forces(
    points: Floats,
    positions: Floats,
    cells: Ints,
    kind: str,
    density: Any,
    field: Callable[[Floats], Floats],
    depth: float = 0.0,
    rules: Any = None,
) -> Floats:
    """Return nodal forces (nodes, 3), N, of a force per mass, m/s^2, at the current `positions` (nodes, 3), m.

    `field` returns it (k, 3) at points (k, 3). `density` is a number, kg/m^3, or a function of undeformed points.
    """
    found = np.zeros_like(points)
    for some, N, masses in _masses_at_points(points, cells, kind, density, depth, rules):
        on = masses[:, :, None] * field((N @ positions[some]).reshape(-1, 3)).reshape(*masses.shape, 3)
        np.add.at(found, some, N.swapaxes(-1, -2) @ on)
    return found


def _masses_at_points(
    points: Floats, cells: Ints, kind: str, density: Any, depth: float, rules: Any
) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Yield some cells (m, a), shape functions (q, a) or (m, q, a), and masses (m, q), kg, at quadrature points.

    `rules` are local points and weights, of all cells or of each; None stands for the rule of the mass. With a `depth`,
    m, of a slice through a body of revolution, the masses are those of whole rings.
    """
    all_xi, all_w = rules or _mass_rule(kind)
    size = max(1, CHUNK // all_xi.shape[-2])
    for start in range(0, len(cells), size):
        at = slice(start, start + size) if all_xi.ndim == 3 else slice(None)
        some, xi, w = cells[start : start + size], all_xi[at], all_w[at]
        N = shape_functions(kind, xi)
        masses = w * gradients(points, some, kind, xi)[1]  # volumes so far
        if depth:
            masses = masses * (2.0 * np.pi / depth * interpolate(N, points[some][:, :, 0]))
        if callable(density):
            masses = masses * density((N @ points[some]).reshape(-1, 3)).reshape(masses.shape)
        else:
            masses = masses * density
        yield some, N, masses
