"""Stress and strain of a solved solid at any point, recovered on request."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.element_interpolation import Rule
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.stress_recovery.patch_recovery import PatchRecovery
from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC, DeformedState, StressUnavailable
from softmark.solvers.stress_recovery.stress_measures import Tensors, TensorsBySide, von_mises

Number = Callable[[Tensors], Floats]  # of each tensor (n,)
Chosen = Callable[[Floats], Any]  # returns a mask (n,) of points (n, 3), m
Part = Literal["stress", "stress deviator", "strain"]
TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])  # by SYMMETRIC: multiplicity of each component in a tensor
ROUNDED = 1e-6  # relative to the typical stress: smaller deviators are rounding of a uniform pressure
PEAKS = 2000  # cells whose nodes are searched for an extreme
TINY = float(np.finfo(np.float64).tiny)


def tensor_norm(six: Floats) -> Floats:
    """Return the norms (n,) of symmetric tensors (n, 6), with components ordered as SYMMETRIC."""
    norm: Floats = np.sqrt((TWICE * six**2).sum(axis=1))
    return norm


def _deviator_norm(values: Floats) -> Floats:
    """Return the norm (n,), Pa, of the stress deviator: |s|^2 = |sigma|^2 - (tr sigma)^2 / 3.

    `values` (n, 22) are those of `Stresses.values`, or the root mean square differences of cell values from them.
    """
    norm: Floats = np.sqrt(np.maximum(tensor_norm(values[:, :6]) ** 2 - values[:, 15] ** 2 / 3.0, 0.0))
    return norm


def _relative_norm(left: Floats, size: Floats) -> Floats:
    """Return the norms (n,) of tensors `left` (n, 6), divided by reference norms `size` (n,)."""
    share: Floats = tensor_norm(left) / np.maximum(size, TINY)
    return share


@dataclass(frozen=True)
class Stresses:
    """Stress field of a deformed state; nodal values are recovered once, on request. Raises StressUnavailable."""

    state: DeformedState

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields to pickle, without recovered values."""
        return {"state": self.state}

    @cached_property
    def _patch_recovery(self) -> PatchRecovery:
        """Patch recovery of the stress, the displacement gradient, the trace of the stress, and the strain."""

        def sample(rule: Rule) -> tuple[Floats, Floats]:
            """Return positions (m, q, 3), m, and values (m, q, 22) at the points of a rule."""
            X, six, H = self.state.sampled(rule)
            return X, np.concatenate([six, H, six[..., :3].sum(axis=2, keepdims=True), self._green(H)], axis=2)

        return PatchRecovery(self.state.mesh, sample, self.state.plane)

    def at(self, X: Floats) -> Tensors:
        """Return stress and deformation at points X (n, 3), m, of the undeformed body."""
        return self._tensors(self.values(X))

    def sides(self, X: Floats) -> TensorsBySide:
        """Return stress and deformation at points X (n, 3), m, with one row for each point.

        The body has only one material, so that no point lies on an interface.
        """
        return TensorsBySide(np.arange(len(X)), np.zeros(len(X), dtype=np.int64), self.at(X))

    def interface_crossings(self, begin: Floats, end: Floats) -> Floats:
        """Return the sorted fractions (k,) of a line from `begin` to `end` (3,), m, at which the material changes.

        The result is empty, because the body has only one material.
        """
        return np.zeros(0)

    @property
    def spacing(self) -> float:
        """Typical cell size, m: cube root of the cell volume, or square root of the cell area in a plane model."""
        mesh = self.state.mesh
        size = float(np.median(np.abs(mesh.volumes)))
        if not self.state.plane:
            return float(size ** (1.0 / 3.0))
        return float((size / np.ptp(mesh.points[:, 2])) ** 0.5)

    def peaks(self, number: Number, chosen: Chosen, surface: bool = False) -> Floats:
        """Return the nodes (k, 3), m, of the PEAKS cells in which a scalar is largest.

        `number` returns the scalar (n,) of tensors. Cells are compared by its largest magnitude at their integration
        points. `chosen` returns a mask of points; only nodes in this mask are returned, and with `surface` only those
        on the boundary.
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
        """Return the rows of X (n, 3), m, nodes of the mesh, that lie on the boundary of the body."""
        mesh = self.state.mesh
        outer = {tuple(point) for point in mesh.points[np.unique(mesh.facets)].tolist()}
        on: Floats = X[[tuple(point) in outer for point in X.tolist()]].reshape(-1, 3)
        return on

    def at_nodes(self) -> Tensors:
        """Return stress and deformation at every node of the mesh."""
        return self._tensors(self.values_at_nodes())

    def values(self, X: Floats) -> Floats:
        """Return the 22 recovered values (n, 22) at points X (n, 3), m.

        They are the stress (6), Pa, du/dX (9), the trace of the stress (1), Pa, and Green's strain (6).
        """
        return self._patch_recovery.at(X)

    def values_at_nodes(self) -> Floats:
        """Return the 22 values of `values` at every node (nodes, 22); NaN for nodes without cells."""
        return self._patch_recovery.values_at_all_nodes()

    def count_interface_points(self, X: Floats) -> int:
        """Return the number of points X (n, 3), m, at which several materials meet; 0 for one material."""
        return 0

    def _tensors(self, values: Floats) -> Tensors:
        """Return stress and deformation from values (n, 22)."""
        return Tensors(values[:, :6], values[:, 6:15], self.state.strain == "small")

    def _green(self, H: Floats) -> Floats:
        """Return Green's strain (m, q, 6), ordered as SYMMETRIC, of displacement gradients H (m, q, 9)."""
        E = Tensors(np.zeros(0), H.reshape(-1, 9), self.state.strain == "small").strain("green")
        return np.stack([E[:, i, j] for i, j in SYMMETRIC], axis=1).reshape(*H.shape[:2], 6)

    def unresolved(self, X: Floats) -> Floats:
        """Return how far cell stresses around points X (n, 3), m, differ from the recovered stress, (n,), Pa.

        The difference is the root mean square over the sampling points of the surrounding cells.
        """
        return tensor_norm(self._patch_recovery.fit_residuals(X)[:, :6])

    def relative_fit_residual(self, X: Floats, of: Part) -> Floats:
        """Return the relative difference (n,) between cell tensors around points X (n, 3), m, and recovered tensors.

        The difference is relative to the local or the typical tensor, whichever is larger. `of` selects the tensor: the
        stress, its deviator, whose error a large pressure would hide, or the strain.
        """
        values, fit_residuals = self._patch_recovery.at(X), self._patch_recovery.fit_residuals(X)
        if of == "strain":
            return _relative_norm(fit_residuals[:, 16:], np.maximum(tensor_norm(values[:, 16:]), self.usual[1]))
        if of == "stress":
            return _relative_norm(fit_residuals[:, :6], np.maximum(tensor_norm(values[:, :6]), self.usual[0]))
        size = np.maximum(_deviator_norm(values), self.usual[2])
        found: Floats = _deviator_norm(fit_residuals) / np.maximum(size, ROUNDED * max(self.usual[0], TINY))
        return found

    def sampled(self) -> None:
        """Compute the stress in every cell once. Raises StressUnavailable if it is not available or not finite."""
        if not np.isfinite(self.usual).all():
            raise StressUnavailable("the stress is not finite in every cell")

    @cached_property
    def usual(self) -> tuple[float, float, float]:
        """Typical norms: root mean squares over the body of stress, Pa, strain, and deviatoric stress, Pa."""
        rule = self.state.mesh.element.quadrature()
        _, six, H = self.state.sampled(rule)
        found = Tensors(six.reshape(-1, 6), H.reshape(-1, 9), self.state.strain == "small")
        w = np.repeat(np.abs(self.state.mesh.volumes), six.shape[1])
        deviator = von_mises(found.cauchy) ** 2 / 1.5
        norms = *(np.sum(t**2, axis=(1, 2)) for t in (found.cauchy, found.strain("green"))), deviator
        stress, strain, shape = (float(np.sqrt(w @ n / w.sum())) for n in norms)
        return stress, strain, shape

    def moved(self, step: Floats) -> Stresses:
        """Return the stress field with displacements `step` (n, 3), m, added at the nodes.

        The result for the last `step` is cached.
        """
        if not self._moved_field_cache or self._moved_field_cache[0][0] is not step:
            self._moved_field_cache[:] = [(step, self._moved(step))]
        return self._moved_field_cache[0][1]

    @cached_property
    def _moved_field_cache(self) -> list[tuple[Floats, Stresses]]:
        """Cache of the last result of `moved`."""
        return []

    def _moved(self, step: Floats) -> Stresses:
        """Return the stress field with displacements `step` (n, 3), m, added at the nodes."""
        return Stresses(replace(self.state, u=self.state.u + step))

    def strain(self) -> Floats:
        """Return Green's strain, or the small strain, at every node (nodes, 6), ordered as SYMMETRIC, for files."""
        tensors = self.at_nodes().strain("green")
        return np.stack([tensors[:, i, j] for i, j in SYMMETRIC], axis=1)

    def von_mises(self) -> Floats:
        """Return the von Mises stress at every node (nodes,), Pa, for pictures and files."""
        return von_mises(self.at_nodes().cauchy)
