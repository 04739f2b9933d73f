"""Parts of cells in adaptive quadrature: the integrals over them, and totals of the accepted parts of each cell."""

from __future__ import annotations

from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.mesh import Floats, Ints

Bools = Any  # (n,) of numpy

ALL_HIDDEN = 5.0  # of the tolerance: what all parts of a cell together may hide


@dataclass
class Parts:
    """Parts of reference cells: `cell` (n,) they belong to, local `vertices` (n, v, 3)."""

    cell: Ints
    vertices: Floats

    def __getitem__(self, which: Any) -> Parts:
        return Parts(self.cell[which], self.vertices[which])

    def __len__(self) -> int:
        return len(self.cell)


@dataclass
class Integrals:
    """Integrals of functions over parts: `magnitude` (g, n), `volume` (n,), m^3, and how far rules disagree.

    `differences` (g, r, n) are those of each other rule from the fine one, `error` (g, n) is the largest of them, also
    of functions times each local coordinate, and `hidden` (g, n) is what may be hidden between the points.
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
        """Join those of several groups of parts."""
        arrays = zip(*(own._arrays() for own in several), strict=True)
        return cls(*(np.concatenate(each, axis=-1) for each in arrays))

    def _arrays(self) -> tuple[Floats, ...]:
        return self.magnitude, self.volume, self.differences, self.error, self.hidden


class CellTotals:
    """Sums over the accepted parts of each cell: errors, and what the points cannot see; arrays (g, m).

    `size` is the integral of each function's magnitude over the cell, to which the tolerance is relative.
    """

    def __init__(self, cells: Integrals, floor: Floats, tolerance: float) -> None:
        self.tolerance, self.volumes = tolerance, cells.volume
        self.size = cells.magnitude + floor[:, None] * cells.volume
        self.hidden = np.zeros_like(self.size)
        self.differences, self.squares = np.zeros_like(cells.differences), np.zeros_like(self.size)
        self.taken, self.done = 0, list[Parts]()

    def enlarge_cells(self, parts: Parts, found: Integrals) -> None:
        """Take the larger magnitude of a cell where parts show more of a function than before, such as a peak."""
        self.size = np.maximum(self.size, self._sum(parts, found.magnitude))

    def find_rough(self, parts: Parts, found: Integrals) -> Bools:
        """Return the parts (n,) that must be halved, because of their error or of what they may hide."""
        share = self._share(parts)
        part = found.volume / self.volumes[parts.cell]
        most = ALL_HIDDEN * self.tolerance * self.size
        much = (self.hidden_with(parts, found) > most)[:, parts.cell] & (found.hidden > ALL_HIDDEN * share * part)
        unsettled = (self.errors_with(parts, found) > self.tolerance * self.size)[:, parts.cell]
        inexact = (found.error > share * np.sqrt(part)) & unsettled
        rough: Bools = (inexact | (found.hidden > share) | much).any(axis=0)
        return rough

    def excess(self, parts: Parts, found: Integrals) -> Floats:
        """Return the error of each part and what it may hide, relative to its tolerance (n,)."""
        worst: Floats = ((found.error + found.hidden) / self._share(parts)).max(axis=0)
        return worst

    def accept(self, parts: Parts, found: Integrals) -> None:
        """Add parts that are not halved again."""
        self.hidden = self.hidden_with(parts, found)
        self.differences += self._sum(parts, found.differences)
        self.squares += self._sum(parts, found.error**2)
        self.done.append(parts)
        self.taken += len(parts)

    def hidden_with(self, parts: Parts, found: Integrals) -> Floats:
        """Return what may be hidden in each cell if these parts are accepted."""
        return self._sum(parts, found.hidden) + self.hidden

    def errors_with(self, parts: Parts, found: Integrals) -> Floats:
        """Return the error of each cell if these parts are accepted."""
        squares = self.squares + self._sum(parts, found.error**2)
        return _errors(self.differences + self._sum(parts, found.differences), squares)

    @property
    def errors(self) -> Floats:
        """Errors of the cells by their accepted parts."""
        return _errors(self.differences, self.squares)

    def cells_with_much_hidden(self) -> Ints:
        """Return the cells whose accepted parts may hide more than the tolerance allows."""
        return np.flatnonzero((self.hidden > ALL_HIDDEN * self.tolerance * self.size).any(axis=0))

    def _share(self, parts: Parts) -> Floats:
        share: Floats = self.tolerance * self.size[:, parts.cell]
        return share

    def _sum(self, parts: Parts, each: Floats) -> Floats:
        return _by_cell(parts.cell, each, len(self.volumes))


def _errors(sums: Floats, squares: Floats) -> Floats:
    """Estimate errors of integrals over cells (g, m): by how much rules differ in all their parts, and its deviation.

    Differences in parts cancel where a function has a kink across many of them: their `sums` (g, r, m) and the root of
    the sum of their `squares` (g, m) are what a wrong sign of each part leaves.
    """
    found: Floats = np.abs(sums).max(axis=1) + np.sqrt(squares)
    return found


def _by_cell(cell: Ints, each: Floats, count: int) -> Floats:
    """Sums over cells (..., count) of numbers of their parts (..., n), of which `cell` (n,) tells the cell."""
    rows = each.reshape(int(np.prod(each.shape[:-1])), len(cell))
    found = np.array([np.bincount(cell, row, minlength=count) for row in rows])
    return found.reshape(*each.shape[:-1], count)
