"""Parts of cells in adaptive quadrature: integrals over parts, and sums of each cell's accepted parts.

A part is a piece of a cell. It is accepted when its error is small enough, else it is halved.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.mesh import Floats, Ints

Bools = Any  # numpy array (n,)

ALL_HIDDEN = 5.0  # relative to the tolerance: largest hidden integral of all parts of a cell together


@dataclass
class Parts:
    """Parts of the reference cells of a mesh: the `cell` (n,) of each part and its local `vertices` (n, v, 3)."""

    cell: Ints
    vertices: Floats

    def __getitem__(self, which: Any) -> Parts:
        return Parts(self.cell[which], self.vertices[which])

    def __len__(self) -> int:
        return len(self.cell)


@dataclass
class Integrals:
    """Integrals of g functions over n parts, with estimates of their errors.

    `magnitude` (g, n) is the integral of the absolute value and `volume` (n,) the volume, m^3. `differences` (g, r, n)
    are the differences of r other rules from the fine rule. `error` (g, n) is the largest difference, also for the
    functions times each local coordinate. `hidden` (g, n) bounds the integral that peaks between the quadrature points
    contribute.
    """

    magnitude: Floats
    volume: Floats
    differences: Floats
    error: Floats
    hidden: Floats

    def __getitem__(self, which: Bools) -> Integrals:
        return Integrals(*(each[..., which] for each in self._arrays()))

    @classmethod
    def joined(cls, several: list[Integrals]) -> Integrals:
        """Return the integrals over several groups of parts as one object."""
        arrays = zip(*(own._arrays() for own in several), strict=True)
        return cls(*(np.concatenate(each, axis=-1) for each in arrays))

    def _arrays(self) -> tuple[Floats, ...]:
        return self.magnitude, self.volume, self.differences, self.error, self.hidden


class CellTotals:
    """Errors and hidden integrals of g functions in m cells, summed over accepted parts of cells.

    Arrays have the shape (g, m). The hidden integral bounds what peaks between the quadrature points contribute to the
    integral. `size` is the integral of each function's magnitude over the cell; the tolerance is relative to it.
    """

    def __init__(self, cells: Integrals, floor: Floats, tolerance: float) -> None:
        self.tolerance, self.volumes = tolerance, cells.volume
        self.size = cells.magnitude + floor[:, None] * cells.volume
        self.hidden = np.zeros_like(self.size)
        self.differences, self.squares = np.zeros_like(cells.differences), np.zeros_like(self.size)
        self.taken, self.done = 0, list[Parts]()

    def enlarge_cells(self, parts: Parts, found: Integrals) -> None:
        """Increase the integral of a function's magnitude over a cell if parts of the cell add up to more.

        This happens if finer parts reveal a peak.
        """
        self.size = np.maximum(self.size, self._sum_parts(parts, found.magnitude))

    def inaccurate_part_mask(self, parts: Parts, found: Integrals) -> Bools:
        """Return a mask (n,) of the parts that must be halved because their error or hidden integral is too large."""
        share = self._cell_tolerances(parts)
        part = found.volume / self.volumes[parts.cell]
        most = ALL_HIDDEN * self.tolerance * self.size
        much = (self.hidden_with(parts, found) > most)[:, parts.cell] & (found.hidden > ALL_HIDDEN * share * part)
        unsettled = (self.errors_with(parts, found) > self.tolerance * self.size)[:, parts.cell]
        inexact = (found.error > share * np.sqrt(part)) & unsettled
        rough: Bools = (inexact | (found.hidden > share) | much).any(axis=0)
        return rough

    def error_tolerance_ratio(self, parts: Parts, found: Integrals) -> Floats:
        """Return the error plus hidden integral of each part, divided by the tolerance of the part, shape (n,)."""
        worst: Floats = ((found.error + found.hidden) / self._cell_tolerances(parts)).max(axis=0)
        return worst

    def accept(self, parts: Parts, found: Integrals) -> None:
        """Add parts that are not halved any further to the totals of their cells."""
        self.hidden = self.hidden_with(parts, found)
        self.differences += self._sum_parts(parts, found.differences)
        self.squares += self._sum_parts(parts, found.error**2)
        self.done.append(parts)
        self.taken += len(parts)

    def hidden_with(self, parts: Parts, found: Integrals) -> Floats:
        """Return the hidden integral of each function in each cell (g, m) if `parts` were accepted now."""
        return self._sum_parts(parts, found.hidden) + self.hidden

    def errors_with(self, parts: Parts, found: Integrals) -> Floats:
        """Return the error of each function's integral over each cell (g, m) if `parts` were accepted now."""
        squares = self.squares + self._sum_parts(parts, found.error**2)
        return _estimate_cell_errors(self.differences + self._sum_parts(parts, found.differences), squares)

    @property
    def errors(self) -> Floats:
        """Errors of each function's integral over each cell (g, m), from the accepted parts."""
        return _estimate_cell_errors(self.differences, self.squares)

    def cells_with_much_hidden(self) -> Ints:
        """Return the numbers of the cells whose hidden integral exceeds ALL_HIDDEN times the tolerance."""
        return np.flatnonzero((self.hidden > ALL_HIDDEN * self.tolerance * self.size).any(axis=0))

    def _cell_tolerances(self, parts: Parts) -> Floats:
        share: Floats = self.tolerance * self.size[:, parts.cell]
        return share

    def _sum_parts(self, parts: Parts, each: Floats) -> Floats:
        return _sum_by_cell(parts.cell, each, len(self.volumes))


def _estimate_cell_errors(sums: Floats, squares: Floats) -> Floats:
    """Return estimates of the errors of integrals over cells (g, m).

    `sums` (g, r, m) are the differences between rules, summed over the parts of each cell, and `squares` (g, m) the
    sums of squared errors of parts. If a function has a kink across many parts, their differences cancel in the sum;
    the root of the squares is added, because it is the error left by random signs.
    """
    found: Floats = np.abs(sums).max(axis=1) + np.sqrt(squares)
    return found


def _sum_by_cell(cell: Ints, each: Floats, count: int) -> Floats:
    """Return sums (..., count) over the parts of each cell; parts have values (..., n) and cells (n,)."""
    rows = each.reshape(int(np.prod(each.shape[:-1])), len(cell))
    found = np.array([np.bincount(cell, row, minlength=count) for row in rows])
    return found.reshape(*each.shape[:-1], count)
