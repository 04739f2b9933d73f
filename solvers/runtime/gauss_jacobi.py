"""Gauss-Jacobi quadrature for collapsed cubes, without scipy.special, which takes 0.1 s to import."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def gauss_jacobi(n: int, power: int) -> tuple[Floats, Floats]:
    """Return Gauss-Jacobi points s (n,), ascending, and weights (n,) on [-1, 1], for the weight (1 - s)^power.

    The rule is exact for polynomials up to degree 2n - 1 times (1 - s)^power. The points are the eigenvalues of the
    three-term recurrence matrix. The weights are the squares of the first entries of its eigenvectors times the total
    weight, 2^(power + 1) / (power + 1).

    Source: Golub and Welsch (1969); the recurrence of Jacobi polynomials P^(power, 0), Abramowitz and Stegun 22.7.
    """
    k = np.arange(n, dtype=np.float64)
    twice = 2.0 * k + power
    diagonal = np.full(n, -power / (power + 2.0))  # holds for the first entry
    diagonal[1:] = -(power**2) / (twice[1:] * (twice[1:] + 2.0))
    j, full = k[1:], twice[1:]
    beside = np.sqrt(4.0 * j**2 * (j + power) ** 2 / (full**2 * (full + 1.0) * (full - 1.0)))
    s, vectors = np.linalg.eigh(np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1))
    return s, vectors[0] ** 2 * 2.0 ** (power + 1) / (power + 1)
