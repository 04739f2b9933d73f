"""Gradients and tangents of energies as dense arrays, and the differences that they are held against."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def gradient(energy: Any, x: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """The forces (n,) on unknowns x (n,)."""
    g = np.zeros_like(x)
    energy.add_gradient(x, g, scale)
    return g


def tangent(energy: Any, x: np.ndarray, scale: float = 1.0, projected: bool = False) -> np.ndarray:
    """The Hessian as a dense matrix: every entry of a row-major matrix is its own slot."""
    K = np.zeros(x.size**2)
    rows, columns = energy.stencils[:, :, None], energy.stencils[:, None, :]
    energy.add_hessian(x, K, rows * x.size + columns, scale, projected)
    return K.reshape(x.size, x.size)


def differences(f: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """The derivatives of f (m,) by x (n,), central: (m, n)."""
    return np.array([(f(x + step * d) - f(x - step * d)) / (2 * step) for d in np.eye(x.size)]).T
