"""What energies do with the local blocks of their Hessians."""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints


def add_blocks(blocks: Floats, slots: Ints, data: Floats) -> None:
    """data[slots] += blocks, both (m, k, l), skipping what is held, at -1."""
    # that is counted in front and left out
    data += np.bincount(slots.ravel() + 1, blocks.ravel(), len(data) + 1)[1:]


def definite(blocks: Floats) -> Floats:
    """The nearest positive semi-definite of symmetric blocks (m, k, k): negative eigenvalues become zero."""
    w, V = np.linalg.eigh(blocks)
    found: Floats = (V * np.maximum(w, 0.0)[:, None, :]) @ V.swapaxes(1, 2)
    return found


def cross_matrix(a: Floats) -> Floats:
    """[a]x (..., 3, 3) with [a]x b = a x b."""
    m = np.zeros((*a.shape, 3))
    m[..., 0, 1], m[..., 0, 2], m[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    return m - m.swapaxes(-1, -2)
