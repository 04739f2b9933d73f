"""Decompositions of a single 3 x 3 matrix inside compiled kernels, by Jacobi rotations in the caller's work array.

LAPACK calls through numba take ten times longer to compile than all other code of an element.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softmark.solvers.runtime.kernel_cache import kernel_part

Floats = NDArray[np.float64]
Nine = tuple[float, float, float, float, float, float, float, float, float]
SWEEPS = 30  # six suffice: convergence is quadratic


@kernel_part
def orthogonalise(M: Floats) -> None:
    """Rotate the columns of M (6, 3) until those in the first three rows are orthogonal.

    M holds F in its upper half and I in its lower half. One-sided Jacobi rotations (Hestenes 1958) turn them into U S
    and V of the singular value decomposition F = U S V^T, with singular values in no order and det V = 1.
    """
    for _ in range(SWEEPS):
        turned = False
        for p in range(3):
            q = (p + 1) % 3
            a, b, c = 0.0, 0.0, 0.0
            for i in range(3):
                a += M[i, p] * M[i, p]
                b += M[i, q] * M[i, q]
                c += M[i, p] * M[i, q]
            if abs(c) <= 1e-16 * math.sqrt(a * b):
                continue
            turned = True
            z = (b - a) / (2.0 * c)
            t = math.copysign(1.0, z) / (abs(z) + math.sqrt(1.0 + z * z))
            cosine = 1.0 / math.sqrt(1.0 + t * t)
            for i in range(6):
                x, y = M[i, p], M[i, q]
                M[i, p], M[i, q] = cosine * (x - t * y), cosine * (t * x + y)
        if not turned:
            break


@kernel_part
def nearest_rotation(M: Floats) -> Nine:
    """Return the rotation R that maximises tr(R^T F), row by row, from U S and V in M (6, 3) (`orthogonalise`).

    R = U V^T; if det F < 0 the axis of the smallest singular value is reversed. Both cases are R = u1 v1^T + u2 v2^T +
    (u1 x u2) (v1 x v2)^T, with the vectors of the two largest singular values. If F has rank one or zero, one of the
    maximising rotations is chosen.
    """
    m, k, largest, second = 0, 1, -1.0, -1.0
    for j in range(3):
        size = math.sqrt(M[0, j] * M[0, j] + M[1, j] * M[1, j] + M[2, j] * M[2, j])
        if size > largest:
            m, k, largest, second = j, m, size, largest
        elif size > second:
            k, second = j, size
    if not largest > 0.0:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    a0, a1, a2 = M[0, m] / largest, M[1, m] / largest, M[2, m] / largest
    b0, b1, b2 = M[0, k], M[1, k], M[2, k]
    if not second > 1e-15 * largest:  # rank one: any perpendicular direction will do
        b0, b1, b2 = 0.0, 0.0, 0.0
        if abs(a0) <= abs(a1) and abs(a0) <= abs(a2):
            b0 = 1.0
        elif abs(a1) <= abs(a2):
            b1 = 1.0
        else:
            b2 = 1.0
    along = a0 * b0 + a1 * b1 + a2 * b2
    b0, b1, b2 = b0 - along * a0, b1 - along * a1, b2 - along * a2
    size = math.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
    b0, b1, b2 = b0 / size, b1 / size, b2 / size
    c0, c1, c2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    x0, x1, x2 = M[3, m], M[4, m], M[5, m]
    y0, y1, y2 = M[3, k], M[4, k], M[5, k]
    z0, z1, z2 = x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0
    return (
        a0 * x0 + b0 * y0 + c0 * z0, a0 * x1 + b0 * y1 + c0 * z1, a0 * x2 + b0 * y2 + c0 * z2,
        a1 * x0 + b1 * y0 + c1 * z0, a1 * x1 + b1 * y1 + c1 * z1, a1 * x2 + b1 * y2 + c1 * z2,
        a2 * x0 + b2 * y0 + c2 * z0, a2 * x1 + b2 * y1 + c2 * z1, a2 * x2 + b2 * y2 + c2 * z2,
    )  # fmt: skip


@kernel_part
def set_above_identity(
    M: Floats, a00: float, a01: float, a02: float, a10: float, a11: float, a12: float, a20: float, a21: float,
    a22: float,
) -> None:  # fmt: skip
    """Set M (6, 3) to the 3 x 3 matrix A above the identity matrix."""
    M[0, 0], M[0, 1], M[0, 2] = a00, a01, a02
    M[1, 0], M[1, 1], M[1, 2] = a10, a11, a12
    M[2, 0], M[2, 1], M[2, 2] = a20, a21, a22
    M[3, 0], M[3, 1], M[3, 2] = 1.0, 0.0, 0.0
    M[4, 0], M[4, 1], M[4, 2] = 0.0, 1.0, 0.0
    M[5, 0], M[5, 1], M[5, 2] = 0.0, 0.0, 1.0
