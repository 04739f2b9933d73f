"""Elastic energies with pressures, either as separate unknowns or eliminated, with one pressure per cell.

L(u, p) = int psi_shape(F) + p g(F) - p^2 / (2 M) dV, with a volume constraint g. Equilibrium is the stationary point of
L, a saddle point: minimum in u and maximum in p. The incompressible solid, 1/M = 0, is no special case.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.elastic_energy import POINTS, Elastic, ElasticLaw
from softmark.solvers.energies.energy import SLACK, Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks


class VolumeConstraint(Protocol):
    """Interface of a volume constraint g over deformation gradients F (n, 3, 3); g is zero at rest."""

    def value(self, F: Floats) -> Floats:
        """Return g (n,), no unit."""

    def gradient(self, F: Floats) -> Floats:
        """Return dg/dF (n, 3, 3), no unit."""

    def curvature(self, F: Floats, p: Floats) -> Floats:
        """Return p d2g/dF2 (n, 3, 3, 3, 3), Pa, for pressures p (n,)."""


@dataclass(frozen=True)
class MixedSolid(Energy):
    """Mixed displacement-pressure energy of a solid: int psi_shape(F) + p g(F) - p^2/(2 M) dV, in J.

    `cells` (m, a), `dNdX` (m, q, a, 3) in 1/m and `w` (m, q) in m^3 are as in `Elastic`, and `law` is psi_shape. If
    `hoop` (m, q, a), 1/m, is given, the body is axisymmetric, as in `AxisymmetricElastic`. The state x holds the
    displacements (3 `nodes`,) in m, followed by the pressures in units of `shear` / `edge` (shear modulus in Pa over
    cell size in m), so that all unknowns are lengths and all equations forces. `pressures` (m, b) are the positions of
    the pressures of each cell in x. `Np`, (q, b) or (m, q, b) per cell, are the pressure shape functions. `compliance`
    is 1/M in 1/Pa, one value or one per point (m, q). Continuous linear pressures in ten-node tetrahedra are stable
    (Taylor and Hood 1973; Boffi, Brezzi and Fortin 2013, section 8.8). One pressure in each hexahedron, Q1/P0, is the
    element of Simo, Taylor and Pister (1985), which is not quite stable.
    """

    saddle = True
    integrates_cells = True

    cells: Ints
    dNdX: Floats
    w: Floats
    law: ElasticLaw
    constraint: VolumeConstraint
    compliance: Any
    pressures: Ints
    Np: Floats
    nodes: int
    shear: float
    edge: float
    conservative: bool = True
    hoop: Floats | None = None

    @property
    def unit(self) -> float:
        """Unit of the pressures in the state, Pa/m."""
        return self.shear / self.edge

    @cached_property
    def dofs(self) -> int:
        """Total number of unknowns."""
        return int(self.pressures.max()) + 1

    @cached_property
    def stencils(self) -> Ints:
        """Degrees of freedom of each cell (m, 3 a + b): three displacements of each node, and the pressures."""
        return np.concatenate([self._shape_energy.stencils, self.pressures], axis=1)

    @cached_property
    def _shape_energy(self) -> Elastic:
        """Elastic energy of psi_shape."""
        return _make_elastic(self.cells, self.dNdX, self.w, self.law, self.hoop)

    def displacements(self, x: Floats) -> Floats:
        """Return the displacements (3 nodes,), m, in the state x."""
        return x[: 3 * self.nodes]

    def F(self, x: Floats) -> Floats:
        """Return the deformation gradients (m q, 3, 3)."""
        return self._shape_energy.F(self.displacements(x))

    def pressure(self, x: Floats) -> Floats:
        """Return the pressure at every integration point (m, q), Pa; positive in tension."""
        p: Floats = self.unit * (self.Np @ x[self.pressures][:, :, None])[:, :, 0]
        return p

    def _integrate(self, values: Floats) -> Floats:
        """Return sum over points of N_b times `values` (m, q), for each pressure of a cell (m, b).

        The values may already include the volumes of the points.
        """
        found: Floats = (values[:, None] @ self.Np)[:, 0]
        return found

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N, caused by strains and by volumes."""
        volumes = self.unit * float(np.linalg.norm(self.w.sum(axis=1))) * float(np.finfo(np.float64).eps)
        u = self.displacements(x)
        return self._shape_energy.rounding(u) + volumes / self._shape_energy.magnification(u)

    def value(self, x: Floats) -> float:
        """Return L(u, p), J; infinite outside the domain of the law."""
        p, g = self.pressure(x), self._constraint(x)
        shape = self._shape_energy.value(self.displacements(x))
        total = shape + float(np.sum(self.w * (p * g - 0.5 * self.compliance * p**2)))
        return total if np.isfinite(total) else np.inf

    def _constraint(self, x: Floats) -> Floats:
        """Return g at every integration point (m, q), no unit."""
        F, up = _magnified_gradient(self._shape_energy, self.displacements(x))
        return self.constraint.value(F).reshape(self.w.shape) / up

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces, N, and the residual of the volume equation, also in N."""
        u, p = self.displacements(x), self.pressure(x)
        self._shape_energy.add_gradient(u, g[: u.size], scale)
        F = self.F(x)
        self._shape_energy.add_stresses(self.constraint.gradient(F) * p.reshape(-1, 1, 1), g[: u.size], scale)
        lacking = self._constraint(x) - self.compliance * p
        np.add.at(g, self.pressures, (scale * self.unit) * self._integrate(self.w * lacking))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the saddle-point matrix, N/m.

        If `projected`, the displacement block is positive semi-definite and contains no pressure stress.
        """
        p, width = self.pressure(x), 3 * self.cells.shape[1]
        F = self.F(x).reshape(*self.w.shape, 3, 3)
        _add_stiffness(self._shape_energy, self.constraint, F, p, slots[:, :width, :width], data, scale, projected)
        self._add_coupling(x, data, slots, scale * self.unit, width)

    def _add_coupling(self, x: Floats, data: Floats, slots: Ints, scale: float, width: int) -> None:
        """Add the blocks int N_b dg/du, on both sides of the diagonal, and the pressure block -int N_a N_b / M."""
        rows = self._shape_energy.derivative_by_displacements(
            self.constraint.gradient(self.F(x)).reshape(*self.w.shape, 3, 3)
        )
        B = rows.transpose(0, 2, 1) @ (self.w[:, :, None] * self.Np)  # (m, 3a, b)
        C = self.Np.swapaxes(-1, -2) @ ((self.w * self.compliance)[:, :, None] * self.Np)
        add_blocks(scale * B, slots[:, :width, width:], data)
        add_blocks(scale * B.transpose(0, 2, 1), slots[:, width:, :width], data)
        add_blocks((-scale * self.unit) * C, slots[:, width:, width:], data)

    @cached_property
    def spare(self) -> Floats:
        """Diagonal shift (dofs,), N/m, of the pressure equations; entries of displacements are zero.

        With it the tangent matrix can be factorised without pivoting. It corresponds to an additional compliance SLACK
        / shear modulus, 1/Pa, whose effect iterative refinement removes (linear/saddle_point.py).
        """
        spare = np.zeros(self.dofs)
        np.add.at(spare, self.pressures, (SLACK / self.shear * self.unit**2) * self._integrate(self.w))
        return spare


def _magnified_gradient(shape: Elastic, u: Floats) -> tuple[Floats, float]:
    """Return F (m q, 3, 3) with very small displacements magnified, and the magnification factor."""
    up = shape.magnification(u)
    return shape.F(u if up == 1.0 else u * u.dtype.type(up)), up


@dataclass(frozen=True)
class MeanDilatation(Energy):
    """Energy with one eliminated pressure per cell: int psi_shape(F) dV + sum over cells of V M/2 (mean of g)^2.

    With g = tr eps this is B-bar with the mean dilatation (Hughes 1980, "Generalization of selective integration
    procedures"). With g = J - 1 it is the three-field element Q1/P0 of Simo, Taylor and Pister (1985), the consistent
    form of F-bar, with an energy and a symmetric tangent. `bulk` is M in Pa, one value or one per cell (m,). If M
    varies within cells, `bulk` is the harmonic mean V / int 1/M dV, as one pressure per cell implies. `expected` (m,)
    are pressures in Pa that the tangent takes instead of M times the mean of g (see assembly/pressure_predictor.py). If
    `hoop` (m, q, a), 1/m, is given, the body is axisymmetric, as in `AxisymmetricElastic`, and the mean is taken over
    whole rings.
    """

    integrates_cells = True

    cells: Ints
    dNdX: Floats
    w: Floats
    law: ElasticLaw
    constraint: VolumeConstraint
    bulk: Any
    expected: Floats | None = None
    conservative: bool = True
    hoop: Floats | None = None

    @cached_property
    def _shape_energy(self) -> Elastic:
        """Elastic energy of psi_shape."""
        return _make_elastic(self.cells, self.dNdX, self.w, self.law, self.hoop)

    @property
    def stencils(self) -> Ints:
        """Three degrees of freedom per node of each cell (m, 3 a)."""
        return self._shape_energy.stencils

    def F(self, x: Floats) -> Floats:
        """Return the deformation gradients (m q, 3, 3)."""
        return self._shape_energy.F(x)

    @cached_property
    def _unit_dilatation_rounding(self) -> float:
        """Machine epsilon times the norm of the nodal forces that a unit volume strain causes, N."""
        share = np.zeros(int(self.cells.max()) + 1)
        each = np.einsum("mq,mqa->ma", self.w, np.linalg.norm(self.dNdX, axis=3))
        np.add.at(share, self.cells, each * np.reshape(self.bulk, (-1, 1)))
        return float(np.finfo(np.float64).eps * 3.0 * np.linalg.norm(share))

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N."""
        return self._shape_energy.rounding(x) + self._unit_dilatation_rounding / self._shape_energy.magnification(x)

    @cached_property
    def _cell_volumes(self) -> Floats:
        """Volume of each cell (m,), m^3."""
        V: Floats = self.w.sum(axis=1)
        return V

    def with_predicted_pressures(self, x: Floats, d: Floats) -> MeanDilatation:
        """Return the energy whose tangent uses the cell pressures predicted at the end of a step d from the state x.

        The predicted pressures are M (g + dg/du . d), Pa, to first order in d.
        """
        F = self.F(x)
        H = (self.F(d) - np.eye(3)).reshape(*self.w.shape, 3, 3)
        G = self.constraint.gradient(F).reshape(H.shape)
        grown = np.einsum("mq,mqiJ,mqiJ->m", self.w, G, H, optimize=True) / self._cell_volumes
        return replace(self, expected=self.bulk * (self._mean_constraint_values(F) + grown))

    def with_constraint_pressures(self, constraint: VolumeConstraint, x: Floats) -> MeanDilatation:
        """Return the energy whose tangent uses the cell pressures computed from the given constraint in state x."""
        return replace(
            self, expected=self.bulk * replace(self, constraint=constraint)._mean_constraint_values(self.F(x))
        )

    def without_pressure_stress(self) -> MeanDilatation:
        """Return the energy whose tangent contains no pressure stress."""
        return replace(self, expected=np.zeros(len(self.w)))

    def _mean_constraint_values(self, F: Floats) -> Floats:
        """Return the mean of g over each cell (m,)."""
        means: Floats = (self.w * self.constraint.value(F).reshape(self.w.shape)).sum(axis=1) / self._cell_volumes
        return means

    def value(self, x: Floats) -> float:
        """Return the strain energy, J."""
        F, up = _magnified_gradient(self._shape_energy, x)
        g = self._mean_constraint_values(F) / up
        total = self._shape_energy.value(x) + 0.5 * float((self.bulk * self._cell_volumes) @ g**2)
        return total if np.isfinite(total) else np.inf

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal elastic forces, N."""
        self._shape_energy.add_gradient(x, g, scale)
        F, up = _magnified_gradient(self._shape_energy, x)
        p = self.bulk * self._mean_constraint_values(F) / up
        stress = self.constraint.gradient(self.F(x)).reshape(*self.w.shape, 3, 3) * p[:, None, None, None]
        self._shape_energy.add_stresses(stress, g, scale)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent stiffness, N/m.

        If `projected`, the part of psi_shape is positive semi-definite, and the pressure stress is omitted.
        """
        F = self.F(x).reshape(*self.w.shape, 3, 3)
        each = self.expected
        if each is None:
            each = self.bulk * self._mean_constraint_values(F.reshape(-1, 3, 3))
        p: Floats = np.repeat(each, self.w.shape[1]).reshape(self.w.shape)
        _add_stiffness(self._shape_energy, self.constraint, F, p, slots, data, scale, projected)
        stiff = scale * self.bulk / self._cell_volumes
        for some in _cell_batches(len(self.w)):
            b = self._constraint_gradients(F[some], some)
            block = stiff[some][:, None, None] * b[:, :, None] * b[:, None, :]
            add_blocks(block, slots[some], data)

    def _constraint_gradients(self, F: Floats, some: slice) -> Floats:
        """Return int dg/du dV of each of the cells `some` (c, 3a), m^2."""
        G = self.constraint.gradient(F.reshape(-1, 3, 3)).reshape(F.shape)
        b: Floats = (self.w[some][:, None] @ self._shape_energy.derivative_by_displacements(G, some))[:, 0]
        return b


def _make_elastic(cells: Ints, dNdX: Floats, w: Floats, law: ElasticLaw, hoop: Floats | None) -> Elastic:
    """Return the elastic energy of a law over cells, which is axisymmetric if `hoop` (m, q, a), 1/m, is given."""
    if hoop is None:
        return Elastic(cells, dNdX, w, law)
    from softmark.solvers.energies.axisymmetric import AxisymmetricElastic

    return AxisymmetricElastic(cells, dNdX, w, law, hoop=hoop)


def _add_stiffness(
    shape: Elastic, constraint: VolumeConstraint, F: Floats, p: Floats,
    slots: Ints, data: Floats, scale: float, projected: bool,
) -> None:  # fmt: skip
    """Add the tangent stiffness, N/m, of a law at F (m, q, 3, 3) and of pressures p (m, q), Pa.

    If `projected`, the tangent of the law is positive semi-definite, and the pressures are ignored.
    """
    tangent = "dPdF_projected" if projected else "dPdF"
    for some in shape._cell_batches():
        flat = F[some].reshape(-1, 3, 3)
        A = getattr(shape.law_of_cells(some), tangent)(flat)
        if not projected:
            A = A + constraint.curvature(flat, p[some].ravel())
        shape.add_moduli(A, some, data, slots[some], scale)


@dataclass(frozen=True)
class DisplacementEnergy(Energy):
    """An energy of displacements only, used in a state that holds further unknowns after the displacements.

    `dofs` is the number of displacement unknowns.
    """

    energy: Energy
    dofs: int

    @property
    def conservative(self) -> bool:
        """True if the wrapped energy is conservative."""
        return self.energy.conservative

    @property
    def stencils(self) -> Ints:
        """Stencils of the wrapped energy."""
        return self.energy.stencils

    def value(self, x: Floats) -> float:
        """Return the energy, J."""
        return self.energy.value(x[: self.dofs])

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces, N; the entries of the other unknowns are not changed."""
        self.energy.add_gradient(x[: self.dofs], g[: self.dofs], scale)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of the displacements, N/m, to the matrix values `data`, as `Energy.add_hessian` does."""
        self.energy.add_hessian(x[: self.dofs], data, slots, scale, projected)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N."""
        return self.energy.rounding(x[: self.dofs])


def _cell_batches(cells: int) -> Iterator[slice]:
    """Yield slices of the cells, small enough for their local blocks to fit in memory."""
    each = 4 * POINTS
    return (slice(at, min(at + each, cells)) for at in range(0, cells, each))
