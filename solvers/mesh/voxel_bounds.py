"""Least and largest values of an image inside boxes of voxels."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.runtime.kernel_cache import kernel

MANY = 4096  # largest number of voxels evaluated one by one; beyond, blocks are used


@dataclass(frozen=True)
class VoxelBounds:
    """Least and largest value of an image in each voxel: `low` and `high`, both (nx, ny, nz).

    If each voxel has a single value, both are the same array.
    """

    low: Floats
    high: Floats

    @cached_property
    def coarser(self) -> VoxelBounds:
        """Return the bounds over blocks of two by two by two voxels."""
        return VoxelBounds(_reduce_voxel_blocks(self.low, np.minimum), _reduce_voxel_blocks(self.high, np.maximum))

    def within(self, first: Ints, last: Ints) -> tuple[Floats, Floats]:
        """Return the least and largest values (n,) in boxes of voxels from `first` to `last`, inclusive, both (n, 3).

        For large boxes the bounds are those of a slightly larger box, which saves time.
        """
        low, high = np.empty(len(first)), np.empty(len(first))
        many = np.prod(last - first + 1.0, axis=1) > MANY
        some = np.flatnonzero(~many)
        found = np.empty((2, len(some)))
        _compute_box_extremes(self.low, self.high, first[some], last[some], found)
        low[some], high[some] = found
        if many.any():
            low[many], high[many] = self.coarser.within(first[many] // 2, last[many] // 2)
        return low, high


def _reduce_voxel_blocks(numbers: Floats, f: np.ufunc) -> Floats:
    for axis in range(3):
        numbers = f.reduceat(numbers, np.arange(0, numbers.shape[axis], 2), axis=axis)
    return np.ascontiguousarray(numbers)


@kernel
def _compute_box_extremes(low: Floats, high: Floats, first: Ints, last: Ints, found: Floats) -> None:
    for n in range(len(first)):
        least, most = np.inf, -np.inf
        for i in range(first[n, 0], last[n, 0] + 1):
            for j in range(first[n, 1], last[n, 1] + 1):
                for k in range(first[n, 2], last[n, 2] + 1):
                    least = min(least, low[i, j, k])
                    most = max(most, high[i, j, k])
        found[0, n], found[1, n] = least, most
