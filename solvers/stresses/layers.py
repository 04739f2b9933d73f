"""Stress and strain of a solid of several materials: recovered in the cells of each alone.

Where two materials meet stress and strain jump, and a polynomial over cells of both would smooth what is there. At a
point that lies where they meet, the numbers are those of the side with the larger stress.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.groups import same_rows
from softmark.solvers.mesh.interpolation import Located, locate, located
from softmark.solvers.mesh.mesh import Floats, Mesh
from softmark.solvers.stresses.field import Part, Stresses, norm_of
from softmark.solvers.stresses.sampled import State

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.solvers.materials import Isotropic
    from softmark.solvers.mesh.mesh import Ints

    Bools = NDArray[np.bool_]

AT = 1e-9  # a shape function below it is zero: the point lies on a face of its cell, on which the function is


@dataclass(frozen=True)
class Layers(Stresses):
    """The same of several states, each of the cells of one material over the nodes of all; `state` is of all cells."""

    each: tuple[Stresses, ...] = ()

    @staticmethod
    def of(state: State, materials: tuple[Isotropic, ...], owners: Ints) -> Layers:
        """Of a state whose cells are of one of some materials, by its number (m,)."""
        found = []
        for number, material in enumerate(materials):
            which = np.flatnonzero(owners == number)
            if len(which):
                mesh = Mesh(state.mesh.points, state.mesh.cells[which], state.mesh.kind)
                pressures = None if state.pressures is None else state.pressures[which]
                found.append(Stresses(replace(state, mesh=mesh, material=material, pressures=pressures)))
        return Layers(state, tuple(found))

    def values(self, X: Floats) -> Floats:
        """As `Stresses` has them: where materials meet, of the side with the larger stress."""
        found, size = np.zeros((len(X), 0)), np.full(len(X), -1.0)
        for own, here in self._owners(X):
            values = own.values(X[here])
            found = found if found.size else np.full((len(X), values.shape[1]), np.nan)
            own_size = _size(values)
            larger = own_size > size[here]
            found[here[larger]] = values[larger]
            size[here] = np.maximum(size[here], own_size)
        return found

    def values_at_nodes(self) -> Floats:
        """Of nodes that several materials share, of the side with the larger stress."""
        found = [own.values_at_nodes() for own in self.each]
        size = np.stack([_size(values) for values in found])
        picked: Floats = np.stack(found)[size.argmax(axis=0), np.arange(size.shape[1])]
        return picked

    def unresolved(self, X: Floats) -> Floats:
        """By how much stresses of the cells around X (n, 3) differ from what is recovered of them (n,), Pa."""
        return self._most(X, lambda own, here: own.unresolved(here))

    def disagreement(self, X: Floats, of: Part) -> Floats:
        """By what share cells of one material around X (n, 3) differ (n,), as `Stresses` has it: the larger."""
        return self._most(X, lambda own, here: own.disagreement(here, of))

    def _most(self, X: Floats, of: Callable[[Stresses, Floats], Floats]) -> Floats:
        found = np.zeros(len(X))
        for own, here in self._owners(X):
            found[here] = np.maximum(found[here], of(own, X[here]))
        return found

    def shared(self, X: Floats) -> int:
        """How many of the points X (n, 3) lie where materials meet."""
        count = np.zeros(len(X), dtype=np.int64)
        for _, here in self._owners(X):
            count[here] += 1
        return int((count > 1).sum())

    def sampled(self) -> None:
        """Look at every cell once. Raises NoStress where that cannot be."""
        for own in self.each:
            own.sampled()

    @cached_property
    def usual(self) -> tuple[float, float, float]:
        """The root mean squares of the norms of stress, Pa, of strain, and of deviators, Pa, over the body."""
        sizes = np.array([float(np.abs(own.state.mesh.volumes).sum()) for own in self.each])
        squares = np.array([own.usual for own in self.each]) ** 2
        stress, strain, shape = np.sqrt(sizes @ squares / sizes.sum()).tolist()
        return stress, strain, shape

    def _moved(self, step: Floats) -> Layers:
        moved = tuple(own.moved(step) for own in self.each)
        return Layers(replace(self.state, u=self.state.u + step), moved)

    def _owners(self, X: Floats) -> Iterator[tuple[Stresses, Ints]]:
        """Materials, and which of the points X (n, 3) are in their cells, or nearest to them; found once for each X."""
        key = X.tobytes()
        if key not in self._known:
            self._known[key] = self._found(X)
        for own, here in zip(self.each, self._known[key], strict=True):
            if here.any():
                yield own, np.flatnonzero(here)

    @cached_property
    def _known(self) -> dict[bytes, Bools]:
        return {}

    @cached_property
    def _touched(self) -> Bools:
        """Which nodes cells of each material have (r, nodes)."""
        found = np.zeros((len(self.each), len(self.state.mesh.points)), dtype=np.bool_)
        for row, own in zip(found, self.each, strict=True):
            row[own.state.mesh.cells] = True
        return found

    def _found(self, X: Floats) -> Bools:
        """Which materials each point is of (r, n): that of its cell, and those that meet there.

        Where a point lies on a face, an edge or a corner of its cell, all shape functions but those of its nodes are
        zero; the materials of the cells that have these nodes meet there.
        """
        where = locate(self.state.mesh, X)
        found = np.stack([same_rows(own.state.mesh.cells, where.nodes) for own in self.each])
        alone = found.copy()
        counts = np.abs(where.N) > AT
        several = (self._touched[:, where.nodes] | ~counts).all(axis=2).sum(axis=0) > 1
        for point in np.flatnonzero(several & ~counts.all(axis=1)).tolist():
            nodes = where.nodes[point][counts[point]]
            for row, own in zip(found, self.each, strict=True):
                row[point] |= bool(np.isin(own.state.mesh.cells, nodes).sum(axis=1).max() == len(nodes))
        for own, row, here in zip(self.each, found, alone, strict=True):
            if row.any() and (row == here).all():  # its cells have all of these points: they need not be found again
                located(own.state.mesh, X[row], Located(where.nodes[row], where.N[row], where.outside[row]))
        return found


def _size(values: Floats) -> Floats:
    """The norm of stress (n,), Pa; of nodes that a material does not have, below any."""
    norm = norm_of(values[:, :6])
    return np.where(np.isnan(norm), -1.0, norm)
