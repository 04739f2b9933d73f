"""The stress and the strain of a solid that was solved, anywhere in it: recovered where they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.element_interpolation import Rule
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.stress_recovery.patch_recovery import Recovered
from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC, NoStress, State
from softmark.solvers.stress_recovery.stress_measures import Sides, Tensors, von_mises

Number = Callable[[Tensors], Floats]  # of each tensor (n,)
Chosen = Callable[[Floats], Any]  # which of points (n, 3), m (n,)
Part = Literal["stress", "stress deviator", "strain"]
TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])  # by SYMMETRIC: how often a component stands in a tensor
ROUNDED = 1e-6  # of the usual stress: deviators below are those of an even pressure, to what solvers leave
PEAKS = 2000  # cells whose nodes are looked at for an extreme
TINY = float(np.finfo(np.float64).tiny)


def norm_of(six: Floats) -> Floats:
    """The norm of tensors (n, 6) by SYMMETRIC: (n,)."""
    norm: Floats = np.sqrt((TWICE * six**2).sum(axis=1))
    return norm


def _deviator(values: Floats) -> Floats:
    """The norm of the deviator (n,), from that of the stress and from its trace: |s|^2 = |sigma|^2 - (tr sigma)^2 / 3.

    Of values as `Stresses` has them, or of how far cells differ from these in the mean square.
    """
    norm: Floats = np.sqrt(np.maximum(norm_of(values[:, :6]) ** 2 - values[:, 15] ** 2 / 3.0, 0.0))
    return norm


def _share(left: Floats, size: Floats) -> Floats:
    share: Floats = norm_of(left) / np.maximum(size, TINY)
    return share


@dataclass(frozen=True)
class Stresses:
    """Of a state: nothing is computed before it is asked for, and each node once. Raises NoStress."""

    state: State

    def __getstate__(self) -> dict[str, Any]:
        """Without what has been recovered."""
        return {"state": self.state}

    @cached_property
    def _recovered(self) -> Recovered:
        def sample(rule: Rule) -> tuple[Floats, Floats]:
            X, six, H = self.state.sampled(rule)
            return X, np.concatenate([six, H, six[..., :3].sum(axis=2, keepdims=True), self._green(H)], axis=2)

        return Recovered(self.state.mesh, sample, self.state.plane)

    def at(self, X: Floats) -> Tensors:
        """At points X (n, 3) of the undeformed body."""
        return self._tensors(self.values(X))

    def sides(self, X: Floats) -> Sides:
        """Tensors at points X (n, 3), m, of each material that meets there: here of one."""
        return Sides(np.arange(len(X)), np.zeros(len(X), dtype=np.int64), self.at(X))

    def crossings(self, begin: Floats, end: Floats) -> Floats:
        """Sorted shares (k,) of the way from `begin` to `end` (3,), m, at which a straight line changes material."""
        return np.zeros(0)

    @property
    def spacing(self) -> float:
        """The cube root of the usual volume of a cell, in a plane the square root of its area, m."""
        mesh = self.state.mesh
        size = float(np.median(np.abs(mesh.volumes)))
        if not self.state.plane:
            return float(size ** (1.0 / 3.0))
        return float((size / np.ptp(mesh.points[:, 2])) ** 0.5)

    def peaks(self, number: Number, chosen: Chosen, surface: bool = False) -> Floats:
        """The nodes (n, 3), m, that are `chosen`, of the PEAKS cells in which a number of the tensors is largest.

        Cells are compared by the largest magnitude at their integration points; with `surface` only nodes on the
        boundary are returned.
        """
        mesh = self.state.mesh
        held = chosen(mesh.points)
        cells = np.flatnonzero(held[mesh.cells].any(axis=1))
        if len(cells) > PEAKS:
            _, six, H = self.state.sampled(mesh.element.quadrature())
            tensors = Tensors(six[cells].reshape(-1, 6), H[cells].reshape(-1, 9), self.state.strain == "small")
            size = np.abs(number(tensors)).reshape(len(cells), -1).max(axis=1)
            cells = cells[np.argpartition(-size, PEAKS)[:PEAKS]]
        nodes = np.unique(mesh.cells[cells])
        found: Floats = mesh.points[nodes[held[nodes]]]
        return found if not surface else self._on_boundary(found)

    def _on_boundary(self, X: Floats) -> Floats:
        """Return the nodes among X (n, 3), m, that lie on the boundary."""
        mesh = self.state.mesh
        outer = {tuple(point) for point in mesh.points[np.unique(mesh.facets)].tolist()}
        on: Floats = X[[tuple(point) in outer for point in X.tolist()]].reshape(-1, 3)
        return on

    def at_nodes(self) -> Tensors:
        """At every node of the mesh."""
        return self._tensors(self.values_at_nodes())

    def values(self, X: Floats) -> Floats:
        """At points X (n, 3) stress, Pa, du/dX of nine components, trace of stress, Pa, and Green's strain: (n, 22)."""
        return self._recovered.at(X)

    def values_at_nodes(self) -> Floats:
        """The same at every node (nodes, 22); no numbers where it has no cells."""
        return self._recovered.everywhere()

    def shared(self, X: Floats) -> int:
        """How many of the points X (n, 3) have more than one stress."""
        return 0

    def _tensors(self, values: Floats) -> Tensors:
        return Tensors(values[:, :6], values[:, 6:15], self.state.strain == "small")

    def _green(self, H: Floats) -> Floats:
        """Green's strain of gradients (m, q, 9) by SYMMETRIC (m, q, 6)."""
        E = Tensors(np.zeros(0), H.reshape(-1, 9), self.state.strain == "small").strain("green")
        return np.stack([E[:, i, j] for i, j in SYMMETRIC], axis=1).reshape(*H.shape[:2], 6)

    def unresolved(self, X: Floats) -> Floats:
        """By how much stresses of the cells around X (n, 3) differ from what is recovered of them (n,), Pa."""
        return norm_of(self._recovered.left(X)[:, :6])

    def disagreement(self, X: Floats, of: Part) -> Floats:
        """By what share cells around X (n, 3) differ (n,): of the tensor there, or of what is usual where that is more.

        `of` the stress, of its deviator, which a pressure would hide, or of the strain.
        """
        values, left = self._recovered.at(X), self._recovered.left(X)
        if of == "strain":
            return _share(left[:, 16:], np.maximum(norm_of(values[:, 16:]), self.usual[1]))
        if of == "stress":
            return _share(left[:, :6], np.maximum(norm_of(values[:, :6]), self.usual[0]))
        size = np.maximum(_deviator(values), self.usual[2])
        found: Floats = _deviator(left) / np.maximum(size, ROUNDED * max(self.usual[0], TINY))
        return found

    def sampled(self) -> None:
        """Look at every cell once. Raises NoStress where that cannot be."""
        if not np.isfinite(self.usual).all():
            raise NoStress("its stress is not a finite number in every cell")

    @cached_property
    def usual(self) -> tuple[float, float, float]:
        """The root mean squares of the norms of stress, Pa, of strain, and of deviators, Pa, over the body."""
        rule = self.state.mesh.element.quadrature()
        _, six, H = self.state.sampled(rule)
        found = Tensors(six.reshape(-1, 6), H.reshape(-1, 9), self.state.strain == "small")
        w = np.repeat(np.abs(self.state.mesh.volumes), six.shape[1])
        deviator = von_mises(found.cauchy) ** 2 / 1.5
        norms = *(np.sum(t**2, axis=(1, 2)) for t in (found.cauchy, found.strain("green"))), deviator
        stress, strain, shape = (float(np.sqrt(w @ n / w.sum())) for n in norms)
        return stress, strain, shape

    def moved(self, step: Floats) -> Stresses:
        """The same with displacements added to its nodes (n, 3), m: made once while the same step is asked for."""
        if not self._moves or self._moves[0][0] is not step:
            self._moves[:] = [(step, self._moved(step))]
        return self._moves[0][1]

    @cached_property
    def _moves(self) -> list[tuple[Floats, Stresses]]:
        return []

    def _moved(self, step: Floats) -> Stresses:
        return Stresses(replace(self.state, u=self.state.u + step))

    def strain(self) -> Floats:
        """Green's at every node (nodes, 6) by SYMMETRIC, where strains are small the small one: for files."""
        tensors = self.at_nodes().strain("green")
        return np.stack([tensors[:, i, j] for i, j in SYMMETRIC], axis=1)

    def von_mises(self) -> Floats:
        """At every node (nodes,), Pa: for pictures and files."""
        return von_mises(self.at_nodes().cauchy)
