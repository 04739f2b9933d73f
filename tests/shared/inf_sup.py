"""The inf-sup value of a pair of displacements and pressures: whether a mixed element is stable."""

from __future__ import annotations

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import splu

from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.pressure_interpolation import build_pressure_space


def inf_sup(mesh: Mesh, fixed: Ints) -> Floats:
    """The numerical inf-sup test of Chapelle and Bathe (1993): all beta, ascending (pressures,), no unit.

    beta^2 are the eigenvalues of B S^-1 B^T q = beta^2 M q, with B = int q div u, S = int grad u : grad u and
    M = int q q; `fixed` are held degrees of freedom. Zeros are pressures that no displacement feels. An element is
    stable where the smallest of the others stays away from zero as the mesh is refined. Dense: for a thousand
    pressures or so. Raises KeyError for an element without pressures.
    """
    parts, known = integrate_cells(mesh), build_pressure_space(mesh)
    m, a = mesh.cells.shape
    columns = (3 * mesh.cells[:, :, None] + np.arange(3)).reshape(m, -1)
    B = np.einsum("mq,qb,mqai->mbai", parts.w, known.N, parts.dNdX, optimize=True).reshape(m, -1, 3 * a)
    S = np.einsum("mq,mqai,mqbi->mab", parts.w, parts.dNdX, parts.dNdX, optimize=True)
    M = np.einsum("mq,qb,qc->mbc", parts.w, known.N, known.N, optimize=True)
    free = np.setdiff1d(np.arange(mesh.points.size), fixed)
    whole = sparse.kron(_summed(S, mesh.cells, mesh.cells), sparse.eye(3)).tocsc()[free][:, free]
    divergence = _summed(B, known.cells, columns).toarray()[:, free]
    schur = divergence @ splu(whole).solve(np.ascontiguousarray(divergence.T))
    squares = linalg.eigh(0.5 * (schur + schur.T), _summed(M, known.cells, known.cells).toarray(), eigvals_only=True)
    betas: Floats = np.sqrt(np.maximum(squares, 0.0))
    return betas


def _summed(blocks: Floats, rows: Ints, columns: Ints) -> sparse.csr_matrix:
    """The sparse sum of blocks (m, k, l) at rows (m, k) and columns (m, l)."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    shape = int(rows.max()) + 1, int(columns.max()) + 1
    return sparse.coo_matrix((blocks.ravel(), (i.ravel(), j.ravel())), shape).tocsr()
