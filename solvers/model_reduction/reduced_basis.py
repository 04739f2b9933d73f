"""Basis of a reduced model: vibration modes, modal derivatives, principal fields of training states.

Fields are the columns of arrays (n, k) over n free unknowns. M (n, n) is the mass matrix, kg. The fields V satisfy
V^T M V = I, so the unknowns of a reduced model have the unit m kg^(1/2).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.dynamics.vibration_modes import lowest_modes
from softmark.solvers.energies.energy import Floats
from softmark.solvers.linear.factorisations import factor

DEPENDENT = 1e-9  # relative to its length: smallest independent part of a field
STEP = 1e-3  # relative to the body's size: displacement step of force differences
PAIRED = 8  # fields for modal derivatives: 36 pairs

Solve = Callable[[Floats], Floats]


@dataclass(frozen=True)
class PrincipalFields:
    """Orthonormal principal fields V (n, r) of a set of states, with the accuracy of their space.

    `captured` is the fraction of the squared length of all states that the fields contain. `error` is the largest
    relative distance of a state from the space of the fields.
    """

    V: Floats
    captured: float
    error: float


def orthonormalize(S: Floats, M: sparse.csr_matrix) -> tuple[Floats, Floats]:
    """Return Q (n, r) and R (r, k) with S = Q R and Q^T M Q = I; linearly dependent columns of S (n, k) add no field.

    Gram-Schmidt orthogonalisation is applied twice to each column, which suffices (Giraud, Langou and Rozloznik 2005).
    """
    Q, R = np.empty((len(S), 0)), np.zeros((S.shape[1], S.shape[1]))
    for k, column in enumerate(S.T):
        rest, known = column.copy(), Q.shape[1]
        length = float(np.sqrt(column @ (M @ column)))
        for _ in range(2):
            part = Q.T @ (M @ rest)
            rest -= Q @ part
            R[:known, k] += part
        left = float(np.sqrt(max(rest @ (M @ rest), 0.0)))
        if left > DEPENDENT * length:
            Q = np.column_stack([Q, rest / left])
            R[known, k] = left
    return Q, R[: Q.shape[1]]


def principal_fields(S: Floats, W: sparse.csr_matrix, modes: int | None, tolerance: float) -> PrincipalFields:
    """Return the principal fields of the states S (n, k), with lengths measured by the matrix W (Sirovich 1987).

    They are the first `modes` fields. If `modes` is None, they are as many as leave at most the fraction `tolerance` of
    the root mean square of the states.
    """
    Q, R = orthonormalize(S, W)
    U, s, _ = np.linalg.svd(R, full_matrices=False)
    total = float(np.sum(s**2))
    left = np.append(np.cumsum(s[::-1] ** 2)[::-1], 0.0)  # beyond the first 0, 1, 2 ... fields
    enough = int(np.argmax(left <= tolerance**2 * total))
    r = min(len(s), enough if modes is None else modes)
    missed = np.linalg.norm(U[:, r:].T @ R, axis=0)
    lengths = np.linalg.norm(R, axis=0)
    error = float(np.max(missed[lengths > 0] / lengths[lengths > 0], initial=0.0))
    return PrincipalFields(Q @ U[:, :r], 1.0 - float(left[r]) / total if total else 1.0, error)


def vibration_modes(K: sparse.csr_matrix, M: sparse.csr_matrix, count: int) -> tuple[Floats, Floats]:
    """Return the lowest angular frequencies w (count,), rad/s, and their modes (n, count) with Phi^T M Phi = I.

    They solve K phi = w^2 M phi (see `lowest_modes`). Raises Singular if K is singular.
    """
    values, modes = lowest_modes(K, M, count, lambda: factor(K))
    return np.sqrt(np.maximum(values, 0.0)), modes


def modal_derivatives(gradient: Solve, solve: Solve, fields: Floats, size: float) -> Floats:
    """Return the modal derivatives -K^-1 D^2 g [v_i, v_j] (n, pairs), static responses of second order.

    g is the internal force. Its second derivative at rest is computed by central differences between displacements of
    `size` times STEP, m.
    Source: Idelsohn and Cardona (1985); Barbic and James (2005), section 4.2.
    """
    found = []
    for i, j in combinations_with_replacement(range(min(PAIRED, fields.shape[1])), 2):
        first, second = fields[:, i], fields[:, j]
        a, b = (STEP * size / np.abs(v).max() for v in (first, second))
        plus, minus = a * first + b * second, a * first - b * second
        change = gradient(plus) - gradient(minus) - gradient(-minus) + gradient(-plus)
        found.append(-solve(change / (4.0 * a * b)))
    return np.column_stack(found)
