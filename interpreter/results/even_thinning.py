"""Fewer of many: numbers of evenly spaced items of a row, its first and its last among them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def picked(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the numbers 0 ... count - 1, in order; all where they are not more."""
    if count <= most:
        return np.arange(count)
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))
