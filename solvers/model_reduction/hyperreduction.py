"""Few cells that stand for all: energy-conserving sampling and weighting (Farhat, Avery, Chapman and Cortial 2014).

Of the forces that cells exert on the fields V, a few with weights w_e >= 0 give the sum over all: in every training
state, and for small displacements along every field. A weighted energy is an energy: the tangent stays symmetric, and
definite where the cells' own are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg as dense

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.model_reduction.basis_products import down, inner, up
from softmark.solvers.model_reduction.cell_energies import apart, cells_of
from softmark.solvers.runtime.thread_limits import ALONE

SMALL = 1e-5  # of the body's size: displacements along a field that say how stiff each cell is at rest


@dataclass(frozen=True)
class Sample:
    """Cells (s,), ascending, their weights (s,) > 0, and the relative error of the forces that they were fitted to."""

    cells: Ints
    weights: Floats
    error: float


class Shares:
    """What each cell does to each field: generalised forces and stiffness by cell."""

    def __init__(self, energies: Sequence[Energy], V: Floats, size: float) -> None:
        self.apart = [apart(energy) for energy in energies]
        cells = cells_of(energies[0])
        self.dofs = (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), -1)  # (m, 3a)
        self.V, self.rows = V, V[self.dofs]  # (m, 3a, r)
        self.steps = SMALL * size / np.abs(V).max(axis=0)

    def _by_cell(self, x: Floats) -> Floats:
        """Forces (m, 3a) of each cell at displacements x (dofs,)."""
        y = np.ascontiguousarray(x[self.dofs].ravel())
        g = np.zeros_like(y)
        for energy in self.apart:
            energy.add_gradient(y, g)
        return g.reshape(self.dofs.shape)

    def forces(self, x: Floats) -> Floats:
        """Generalised forces (m, r) at displacements x (dofs,)."""
        found: Floats = np.einsum("mk,mkr->mr", self._by_cell(x), self.rows)
        return found

    def stiffness(self, x: Floats) -> Floats:
        """V^T K_e V (m, r, r) at displacements x (dofs,), by central differences."""
        columns = zip(self.V.T, self.steps, strict=True)
        K = np.stack([(self.forces(x + h * v) - self.forces(x - h * v)) / (2.0 * h) for v, h in columns], axis=2)
        symmetric: Floats = 0.5 * (K + K.swapaxes(1, 2))
        return symmetric


def sample(energies: Sequence[Energy], V: Floats, states: Floats, size: float, tolerance: float) -> Sample:
    """Cells and weights that keep the reduced states (s, dofs) in place, and the stiffness at rest, within `tolerance`.

    An error in the forces is weighed by what it does: K^-1 times it, K the stiffness in that state, is how far the
    state moves, here as a part of the length of its linear response (V^T M V = I); stiffness is measured where that of
    all cells is the identity. The tolerance holds for the root mean square over states and stiffness. `size` is that of
    the body, m.
    """
    shares = Shares(energies, V, size)
    blocks = [_stiffness_rows(shares.stiffness(np.zeros(len(V))))]
    for x in states:
        moves = np.linalg.solve(shares.stiffness(x).sum(axis=0), shares.forces(x).T)  # (r, m)
        total = np.linalg.norm(moves.sum(axis=1))
        blocks += [moves / total] if total > 0 else []
    G = np.concatenate(blocks)
    w, error = nonnegative(G, G.sum(axis=1), tolerance)
    cells = np.flatnonzero(w)
    return Sample(cells, w[cells], error)


def _stiffness_rows(K: Floats) -> Floats:
    """What each cell adds to the identity (r (r + 1) / 2, m), scaled so that their sum has length one."""
    L = np.linalg.inv(np.linalg.cholesky(K.sum(axis=0)))
    rows, columns = np.triu_indices(len(L))
    unit = (L @ K @ L.T)[:, rows, columns]
    scaled: Floats = unit * np.where(rows == columns, 1.0, np.sqrt(2.0)) / np.sqrt(len(L))
    return scaled.T


def nonnegative(G: Floats, b: Floats, tolerance: float) -> tuple[Floats, float]:
    """w (m,) >= 0, mostly zero, with |G w - b| <= tolerance |b|, and the relative error that was reached.

    The active set method of Lawson and Hanson (1974, chapter 23), which ends as soon as the tolerance is met.
    """
    w, active = np.zeros(G.shape[1]), np.zeros(0, dtype=np.int64)
    size, r = float(np.linalg.norm(b)), b.copy()
    for _ in range(3 * min(G.shape)):
        if np.linalg.norm(r) <= tolerance * size:
            break
        slope = down(G, r)
        slope[active] = 0.0
        best = int(np.argmax(slope))
        if slope[best] <= 1e-12 * size:
            break
        active = np.append(active, best)
        active = _fitted(G, b, w, active)
        r = b - up(G[:, active], w[active])
    return w, float(np.linalg.norm(r)) / size if size else 0.0


def _fitted(G: Floats, b: Floats, w: Floats, active: Ints) -> Ints:
    """Least squares over the active columns into w, on the way dropping those that would become negative."""
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
    """The y with the least |A y - b|: by the normal equations with one correction, or where they fail by the SVD."""
    with ALONE:
        try:
            L = dense.cho_factor(inner(A, A), check_finite=False)
        except dense.LinAlgError:
            svd: Floats = dense.lstsq(A, b)[0]
            return svd
        y: Floats = dense.cho_solve(L, down(A, b), check_finite=False)
        y += dense.cho_solve(L, down(A, b - up(A, y)), check_finite=False)
    return y
