"""Hyperreduction: a few weighted cells represent all cells, by energy-conserving sampling and weighting (ECSW).

The selected cells with weights w_e >= 0 reproduce the sum of the forces of all cells, projected on the fields V. They
do so in every training state, and for small displacements along every field. A weighted sum of cell energies is an
energy too, so the tangent stays symmetric. It is positive definite if those of the cells are.
Source: Farhat, Avery, Chapman and Cortial (2014).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg as dense

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.model_reduction.basis_products import expand, inner_products, project
from softmark.solvers.model_reduction.cell_energies import disconnect_cells, nodes_of_cells
from softmark.solvers.runtime.thread_limits import ALONE

SMALL = 1e-5  # relative to the body's size: displacements along a field that give each cell's stiffness at rest


@dataclass(frozen=True)
class CellSample:
    """Numbers of the selected cells (s,), ascending, and their weights (s,) > 0.

    `error` is the relative error of the fitted forces.
    """

    cells: Ints
    weights: Floats
    error: float


class CellContributions:
    """Contribution of each of m cells to the generalised forces and the stiffness of a reduced model with r fields."""

    def __init__(self, energies: Sequence[Energy], V: Floats, size: float) -> None:
        self.apart = [disconnect_cells(energy) for energy in energies]
        cells = nodes_of_cells(energies[0])
        self.dofs = (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), -1)  # (m, 3a)
        self.V, self.rows = V, V[self.dofs]  # (m, 3a, r)
        self.steps = SMALL * size / np.abs(V).max(axis=0)

    def _nodal_forces_of_cells(self, x: Floats) -> Floats:
        """Return the nodal forces of each cell, N, shape (m, 3a), at displacements x (dofs,), m."""
        y = np.ascontiguousarray(x[self.dofs].ravel())
        g = np.zeros_like(y)
        for energy in self.apart:
            energy.add_gradient(y, g)
        return g.reshape(self.dofs.shape)

    def forces(self, x: Floats) -> Floats:
        """Return the generalised forces of each cell (m, r) at displacements x (dofs,), m."""
        found: Floats = np.einsum("mk,mkr->mr", self._nodal_forces_of_cells(x), self.rows)
        return found

    def stiffness(self, x: Floats) -> Floats:
        """Return the reduced stiffness V^T K_e V of each cell (m, r, r) at displacements x (dofs,), m.

        It is computed by central differences of the forces.
        """
        columns = zip(self.V.T, self.steps, strict=True)
        K = np.stack([(self.forces(x + h * v) - self.forces(x - h * v)) / (2.0 * h) for v, h in columns], axis=2)
        symmetric: Floats = 0.5 * (K + K.swapaxes(1, 2))
        return symmetric


def sample_cells(energies: Sequence[Energy], V: Floats, states: Floats, size: float, tolerance: float) -> CellSample:
    """Return cells and weights that preserve the training states and the stiffness at rest, within `tolerance`.

    `states` (s, dofs), m, are displacements in the space of the fields V. Errors of the forces in a state are weighted
    by their effect: the change of the state K^-1 error, with K the stiffness in that state, relative to the length of
    the linear response (V^T M V = I). Errors of the stiffness are measured in the metric in which the stiffness of all
    cells is the identity. The tolerance holds for the root mean square over states and stiffness. `size` is the size of
    the body, m.
    """
    shares = CellContributions(energies, V, size)
    blocks = [_stiffness_rows(shares.stiffness(np.zeros(len(V))))]
    for x in states:
        moves = np.linalg.solve(shares.stiffness(x).sum(axis=0), shares.forces(x).T)  # (r, m)
        total = np.linalg.norm(moves.sum(axis=1))
        blocks += [moves / total] if total > 0 else []
    G = np.concatenate(blocks)
    w, error = fit_nonnegative(G, G.sum(axis=1), tolerance)
    cells = np.flatnonzero(w)
    return CellSample(cells, w[cells], error)


def _stiffness_rows(K: Floats) -> Floats:
    """Return the contribution of each cell to the total stiffness, which is scaled to the identity.

    The columns (r (r + 1) / 2, m) are the upper triangles of the contributions. They are scaled so that their sum has
    length one.
    """
    L = np.linalg.inv(np.linalg.cholesky(K.sum(axis=0)))
    rows, columns = np.triu_indices(len(L))
    unit = (L @ K @ L.T)[:, rows, columns]
    scaled: Floats = unit * np.where(rows == columns, 1.0, np.sqrt(2.0)) / np.sqrt(len(L))
    return scaled.T


def fit_nonnegative(G: Floats, b: Floats, tolerance: float) -> tuple[Floats, float]:
    """Return sparse weights w (m,) >= 0 with |G w - b| <= tolerance |b|, and the relative error reached.

    The active set method of Lawson and Hanson (1974, chapter 23) is stopped as soon as the tolerance is met.
    """
    w, active = np.zeros(G.shape[1]), np.zeros(0, dtype=np.int64)
    size, r = float(np.linalg.norm(b)), b.copy()
    for _ in range(3 * min(G.shape)):
        if np.linalg.norm(r) <= tolerance * size:
            break
        slope = project(G, r)
        slope[active] = 0.0
        best = int(np.argmax(slope))
        if slope[best] <= 1e-12 * size:
            break
        active = np.append(active, best)
        active = _fit_active_columns(G, b, w, active)
        r = b - expand(G[:, active], w[active])
    return w, float(np.linalg.norm(r)) / size if size else 0.0


def _fit_active_columns(G: Floats, b: Floats, w: Floats, active: Ints) -> Ints:
    """Write the nonnegative least squares solution over the active columns into w.

    Columns whose weights would become negative are dropped. Return the columns that stay active.
    """
    while True:
        target = _least_squares(G[:, active], b)
        if target.min() > 0.0:
            w[active] = target
            return active
        now = w[active]
        falls = target <= 0.0
        part = float(np.min(now[falls] / np.maximum(now[falls] - target[falls], 1e-300)))
        w[active] = now + part * (target - now)
        out = falls & (w[active] <= 1e-12 * w.max(initial=0.0))
        w[active[out]] = 0.0
        active = active[~out]


def _least_squares(A: Floats, b: Floats) -> Floats:
    """Return the least squares solution y of A y = b.

    The normal equations with one step of correction are used, and the SVD if their factorisation fails.
    """
    with ALONE:
        try:
            L = dense.cho_factor(inner_products(A, A), check_finite=False)
        except dense.LinAlgError:
            svd: Floats = dense.lstsq(A, b)[0]
            return svd
        y: Floats = dense.cho_solve(L, project(A, b), check_finite=False)
        y += dense.cho_solve(L, project(A, b - expand(A, y)), check_finite=False)
    return y
