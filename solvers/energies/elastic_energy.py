"""Elastic energy of a solid for any constitutive law and any element, and sums of such energies."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies import displacement_gradient_scaling, element_kernels
from softmark.solvers.energies.energy import Energy, Floats, Ints

POINTS = 4096  # points per evaluation of the law, so that results stay in the processor cache


class ElasticLaw(Protocol):
    """Interface of a law: energy density and its derivatives over a batch of deformation gradients F (n, 3, 3)."""

    def psi(self, F: Floats) -> Floats:
        """Return the energy per undeformed volume (n,), J/m^3."""

    def P(self, F: Floats) -> Floats:
        """Return the first Piola-Kirchhoff stress (n, 3, 3), Pa."""

    def dPdF(self, F: Floats) -> Floats:
        """Return dP_iJ/dF_kL (n, 3, 3, 3, 3), Pa."""

    def dPdF_projected(self, F: Floats) -> Floats:
        """Return dPdF with its negative eigenvalues set to zero."""


@runtime_checkable
class VaryingLaw(Protocol):
    """Interface of a law whose constants differ from point to point.

    Its methods take F (m q, 3, 3) at all q points of all m cells at once.
    """

    law: Any  # with its constants as arrays (m, q)

    def of(self, which: Any, kind: Any = None) -> Any:
        """Return the law of the cells `which`, with constants of the floating-point type `kind` if it is given."""

    def at_rest(self, measure: Callable[[Floats], Floats]) -> Floats:
        """Return a measure (m, q) of the stiffness of the undeformed material at every point.

        `measure` maps tensors dP/dF (k, 3, 3, 3, 3), Pa, to numbers (k,).
        """


class DampedLaw(Protocol):
    """Interface of a law whose stiffness is used for stiffness-proportional damping."""

    def dPdF_projected(self, F: Floats) -> Floats:
        """Return a positive semi-definite stiffness (n, 3, 3, 3, 3), Pa, for deformation gradients F (n, 3, 3)."""


@runtime_checkable
class InvariantLaw(Protocol):
    """Interface of a law psi(I1, J) with I1 = tr F^T F and J = det F.

    Its methods take `stretch` = I1 - 3 and `j` = J - 1, both (c, q). With C = cof F, P = a F + s C and dP/dF = a 1 + s
    dC/dF + c (F (x) C + C (x) F) + d C (x) C.
    """

    def energy(self, stretch: Floats, j: Floats) -> Floats:
        """Return the energy per undeformed volume (c, q), J/m^3."""

    def slopes(self, stretch: Floats, j: Floats) -> tuple[Floats, Floats]:
        """Return the factors a and s (c, q) of the stress P = a F + s C, Pa."""

    def curvatures(self, stretch: Floats, j: Floats) -> tuple[Floats | None, Floats]:
        """Return the factors c and d (c, q) of dP/dF, Pa; c is None if it is zero."""


@dataclass(frozen=True)
class Elastic(Energy):
    """Elastic energy: sum over integration points of w psi(F), with F = I + sum_a u_a (x) dN_a/dX.

    `cells` (m, a) are the nodes of each cell, `dNdX` (m, q, a, 3) the shape-function gradients in 1/m, and `w` (m, q)
    the integration volumes in m^3. The state x is the displacement (3 nodes,). `drag` is the law used for
    stiffness-proportional damping; if it is None, the positive semi-definite tangent of `law` is used.
    """

    integrates_cells = True

    cells: Ints
    dNdX: Floats
    w: Floats
    law: ElasticLaw
    conservative: bool = True
    drag: DampedLaw | None = None

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom per node of each cell (m, 3 a)."""
        return (3 * self.cells[:, :, None] + np.arange(3)).reshape(len(self.cells), -1)

    def F(self, x: Floats) -> Floats:
        """Return the deformation gradients (m q, 3, 3)."""
        F = np.empty((*self.w.shape, 3, 3), dtype=self.w.dtype)
        element_kernels.deformation_gradient(x.reshape(-1, 3), self.cells, self.dNdX, F)
        return F.reshape(-1, 3, 3)

    @cached_property
    def _unit_strain_rounding_error(self) -> float:
        """Machine epsilon times the norm of the nodal forces caused by a unit strain, N.

        The entries of F are near one, so that their rounding error is a strain of machine epsilon.
        """
        forces = np.zeros(int(self.cells.max()) + 1)
        share = np.einsum("mq,mqa->ma", self.w * self._rest_tangent_norm, np.linalg.norm(self.dNdX, axis=3))
        np.add.at(forces, self.cells, share)
        return float(np.finfo(np.float64).eps * np.linalg.norm(forces))

    @property
    def _rest_tangent_norm(self) -> Any:
        """Norm of dP/dF over its 81 entries at rest, Pa; an array (m, q) if the constants vary from point to point."""
        if self.has_varying_constants:
            return self._varying_law.at_rest(lambda A: np.linalg.norm(A.reshape(len(A), -1), axis=1))
        return np.linalg.norm(self.law.dPdF(np.eye(3)[None]))

    @cached_property
    def has_varying_constants(self) -> bool:
        """True if the constants of the law differ from point to point."""
        return isinstance(self.law, VaryingLaw)

    @property
    def _varying_law(self) -> VaryingLaw:
        known: Any = self.law
        return known  # type: ignore[no-any-return]

    @cached_property
    def _has_invariant_law(self) -> bool:
        """True if the law is an `InvariantLaw`."""
        return isinstance(self._varying_law.law if self.has_varying_constants else self.law, InvariantLaw)

    def law_of_cells(self, some: slice) -> Any:
        """Return the law of the cells `some`, which is `law` itself if its constants are uniform."""
        return self._varying_law.of(some, self.w.dtype) if self.has_varying_constants else self.law

    def _invariant_law(self, some: slice) -> Any:
        """Return the law of the cells `some` in the form that takes invariants (c, q), as an `InvariantLaw`."""
        return self.law_of_cells(some).law if self.has_varying_constants else self.law

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N."""
        return self._unit_strain_rounding_error / self.magnification(x)

    @cached_property
    def _is_stress_free_at_rest(self) -> bool:
        return displacement_gradient_scaling.has_no_rest_stress(
            self.law, self.w.size if self.has_varying_constants else 1
        )

    @cached_property
    def _linear(self) -> bool:
        return displacement_gradient_scaling.is_linear(self.law, self.w.size if self.has_varying_constants else 1)

    def magnification(self, x: Floats) -> float:
        """Return the power of two c >= 1 by which displacements are magnified before the law is evaluated.

        The energy is then divided by c^2 and the stress by c (see displacement_gradient_scaling.py).
        """
        reach = float(np.abs(x).max(initial=0.0)) * self._gradient_per_displacement
        if (
            not 0.0 < reach < 1.0
            or (reach >= displacement_gradient_scaling.SMALL and not self._linear)
            or not self._is_stress_free_at_rest
        ):
            return 1.0

        def largest(up: float) -> float:
            return float(np.abs(self.F(x * x.dtype.type(up)) - np.eye(3)).max())

        return displacement_gradient_scaling.find_scale(reach, self._linear, largest, self.w.dtype)

    @cached_property
    def _gradient_per_displacement(self) -> float:
        """Sum of the shape-function gradients, 1/m: a bound of the displacement gradient |H| per largest |u|."""
        return float(np.linalg.norm(self.dNdX, axis=3).sum(axis=2).max(initial=0.0))

    def value(self, x: Floats) -> float:
        """Return the strain energy, J."""
        up = self.magnification(x)
        return self._value(x if up == 1.0 else x * x.dtype.type(up)) / up / up

    def _value(self, x: Floats) -> float:
        if self._has_invariant_law:
            total = 0.0
            with np.errstate(all="ignore"):
                for some, _, i, j in self._batches_with_invariants(x):
                    total += float(np.vdot(self._invariant_law(some).energy(i, j), self.w[some]))
            return total
        return float(self.law.psi(self.F(x)) @ self.w.ravel())

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal elastic forces, N."""
        up = self.magnification(x)
        x, scale = (x, scale) if up == 1.0 else (x * x.dtype.type(up), scale / up)
        forces = g.reshape(-1, 3)
        if self._has_invariant_law:
            with np.errstate(all="ignore"):
                for some, h, i, j in self._batches_with_invariants(x):
                    a, s = self._invariant_law(some).slopes(i, j)
                    body = (self.cells, self.dNdX, self.w)
                    element_kernels.add_invariant_forces(h, a, s, *body, some.start, scale, forces)
            return
        self.add_stresses(self.law.P(self.F(x)), g, scale)

    def add_stresses(self, P: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces, N, of first Piola-Kirchhoff stresses P (m q, 3, 3), Pa: int P : dF/du."""
        each = np.ascontiguousarray(P).reshape(*self.w.shape, 3, 3)
        element_kernels.add_forces(each, self.cells, self.dNdX, self.w, scale, g.reshape(-1, 3))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent stiffness, N/m; dP/dF already contains the geometric stiffness."""
        if self._has_invariant_law and not projected:
            self._add_invariant_hessian(x, data, slots, scale, None)
            return
        tangent = "dPdF_projected" if projected else "dPdF"
        self._add_law_stiffness(self.law, tangent, x, data, slots, scale)

    def add_drag(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0) -> None:
        """Add the positive semi-definite stiffness used for stiffness-proportional damping, N/m."""
        if self.drag is None:
            self.add_hessian(x, data, slots, scale, True)
            return
        self._add_law_stiffness(self.drag, "dPdF_projected", x, data, slots, scale)

    def _add_law_stiffness(self, law: Any, tangent: str, x: Floats, data: Floats, slots: Ints, scale: float) -> None:
        """Add the stiffness of the tensors dP/dF that the method of `law` named by `tangent` returns, N/m."""
        F = self.F(x).reshape(*self.w.shape, 3, 3)
        for some in self._cell_batches():
            own = law.of(some, self.w.dtype) if self.has_varying_constants else law
            self.add_moduli(getattr(own, tangent)(F[some].reshape(-1, 3, 3)), some, data, slots[some], scale)

    def add_moduli(self, A: Floats, some: slice, data: Floats, slots: Ints, scale: float = 1.0) -> None:
        """Add the stiffness, N/m, of given tensors dP/dF (c q, 3, 3, 3, 3), Pa, at the points of the cells `some`."""
        each = np.ascontiguousarray(A).reshape(*self.w[some].shape, 3, 3, 3, 3)
        element_kernels.add_stiffness(each, self.dNdX[some], self.w[some], scale, np.ascontiguousarray(slots), data)

    def derivative_by_displacements(self, G: Floats, some: slice = slice(None)) -> Floats:
        """Return dg/du (c, q, 3a), 1/m, from G = dg/dF (c, q, 3, 3), at the points of the cells `some`."""
        rows: Floats = np.einsum("mqiJ,mqaJ->mqai", G, self.dNdX[some], optimize=True)
        return rows.reshape(*G.shape[:2], -1)

    def _add_invariant_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float, more: Floats | None) -> None:
        """Add the tangent stiffness of an `InvariantLaw`, N/m, without forming fourth-order tensors.

        `more` (m, q), Pa, if given, is an additional pressure: it is added to the factor s = dpsi/dJ of the law.
        """
        with np.errstate(all="ignore"):
            for some, h, i, j in self._batches_with_invariants(x):
                law = self._invariant_law(some)
                (a, s), (c, d) = law.slopes(i, j), law.curvatures(i, j)
                s = s if more is None else s + more[some]
                c = np.zeros((0, i.shape[1]), dtype=i.dtype) if c is None else c
                numbers = (h, j, a, s, c, d, self.dNdX, self.w)
                element_kernels.add_invariant_stiffness(*numbers, some.start, scale, slots[some], data)

    def _cell_batches(self) -> Iterator[slice]:
        """Yield slices of the cells that together cover all cells, each with about POINTS integration points."""
        cells = max(1, POINTS // self.w.shape[1])
        return (slice(at, min(at + cells, len(self.w))) for at in range(0, len(self.w), cells))

    def _batches_with_invariants(self, x: Floats) -> Iterator[tuple[slice, Floats, Floats, Floats]]:
        """Yield slices of the cells, each with du/dX (c, q, 9), I1 - 3 and J - 1 (c, q) at its points."""
        u, kind = x.reshape(-1, 3), self.w.dtype
        for some in self._cell_batches():
            shape = self.w[some].shape
            h, (stretch, j) = np.empty((*shape, 9), dtype=kind), np.empty((2, *shape), dtype=kind)
            element_kernels.compute_invariants(u, self.cells, self.dNdX, some.start, h, stretch, j)
            yield some, h, stretch, j


@dataclass(frozen=True)
class EnergySum(Energy):
    """Sum of energies over the same stencils, such as shear at all points plus volume change once per cell."""

    integrates_cells = True

    parts: tuple[Energy, ...]

    @property
    def conservative(self) -> bool:
        """True if all parts are conservative."""
        return all(part.conservative for part in self.parts)

    @property
    def stencils(self) -> Ints:
        """Stencils that all parts share."""
        return self.parts[0].stencils

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N."""
        return sum(part.rounding(x) for part in self.parts)

    def value(self, x: Floats) -> float:
        """Return the energy, J."""
        return sum(part.value(x) for part in self.parts)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces, N."""
        for part in self.parts:
            part.add_gradient(x, g, scale)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent stiffness, N/m."""
        for part in self.parts:
            part.add_hessian(x, data, slots, scale, projected)

    def add_drag(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0) -> None:
        """Add the positive semi-definite stiffness used for stiffness-proportional damping, N/m."""
        for part in self.parts:
            add_drag(part, x, data, slots, scale)


@runtime_checkable
class HasDampingStiffness(Protocol):
    """Interface of an energy whose damping stiffness differs from its positive semi-definite tangent."""

    def add_drag(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0) -> None:
        """Add the positive semi-definite stiffness used for stiffness-proportional damping, N/m."""


def add_drag(energy: Energy, x: Floats, data: Floats, slots: Ints, scale: float = 1.0) -> None:
    """Add the stiffness of an energy used for stiffness-proportional damping, N/m.

    By default this is the positive semi-definite tangent of the energy.
    """
    if isinstance(energy, HasDampingStiffness):
        energy.add_drag(x, data, slots, scale)
    else:
        energy.add_hessian(x, data, slots, scale, True)
