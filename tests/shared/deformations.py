"""Deformation gradients that laws are asked at, and how what they say is compared."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rotations(rng: np.random.Generator, m: int) -> Array:
    """Uniform rotations (m, 3, 3)."""
    Q = np.linalg.qr(rng.standard_normal((m, 3, 3)))[0]
    return np.asarray(Q * np.sign(np.linalg.det(Q))[:, None, None])


def difference(f: Callable[[Array], Array], F: Array, step: float = 1e-5) -> Array:
    """df/dF_kL by central differences; the indices k, L come last."""
    D = np.eye(9).reshape(9, 3, 3) * step
    columns = [(f(F + d) - f(F - d)) / (2.0 * step) for d in D]
    return np.stack(columns, -1).reshape(*columns[0].shape, 3, 3)


def close(a: Array, b: Array, tolerance: float) -> None:
    """|a - b| <= tolerance times the largest |b|."""
    np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance * np.abs(b).max())
