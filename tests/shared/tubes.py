"""A tube of triangles that bends: what pages are tested with that draw shapes."""

from __future__ import annotations

from typing import Any

import numpy as np


def tube(bend: float, along: int = 40, around: int = 20) -> tuple[Any, Any]:
    """Points and outward triangles of a tube of 100 mm by 10 mm along x whose end sinks by `bend` m."""
    s, a = np.meshgrid(np.linspace(0, 0.1, along), np.linspace(0, 2 * np.pi, around, endpoint=False), indexing="ij")
    X = np.stack([s, 0.005 * np.sin(a), 0.005 * np.cos(a) - bend * (s / 0.1) ** 2], axis=-1).reshape(-1, 3)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij"))
    k = (j + 1) % around
    A, B, C, D = (i * around + j, i * around + k, (i + 1) * around + k, (i + 1) * around + j)
    return X, np.concatenate([np.stack([A, B, D], axis=1), np.stack([B, C, D], axis=1)])
