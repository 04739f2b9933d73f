"""Evenly spaced selection of a limited number of items, including the first and the last."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def pick_evenly(count: int, most: int) -> NDArray[np.int64]:
    """Return at most `most` of the indices 0 ... count - 1, evenly spaced and in order."""
    if count <= most:
        return np.arange(count)
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))
