"""Energies of axisymmetric bodies, integrated over a slice of the meridian plane.

The slice lies in the plane of x (the distance r from the axis) and y (the coordinate along the axis) and is `depth`
thick, in m. A displacement in this plane stretches the material rings around the axis by the factor 1 + u_x / r. An
integral over the slice, weighted by 2 pi r / depth, is the integral over the whole body.
Source: Bonet and Wood (2008), "Nonlinear Continuum Mechanics", section 9.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.external_loads import FollowerPressure
from softmark.solvers.energies.local_blocks import add_blocks

ALONG_Z, HOOP = 2, 8  # index of the z displacement; index of the hoop component of a tensor (9,)


def circumference_in_slices(r: Floats, depth: float) -> Floats:
    """Return the number 2 pi r / depth of slices, `depth` m thick, that fit around the axis at distances r, m."""
    return 2.0 * np.pi / depth * r


class SliceEnergy(Protocol):
    """Interface of an energy over the cells of a meridian slice; `w` (m, q), m^3, are its integration volumes.

    `cells` (m, a) are the node numbers of each cell.
    """

    @property
    def cells(self) -> Ints: ...
    @property
    def w(self) -> Floats: ...


def hoop_terms_and_ring_volumes(like: SliceEnergy, N: Floats, points: Floats, depth: float) -> tuple[Floats, Floats]:
    """Return N_a / r (m, q, a), 1/m, and the volumes of whole rings (m, q), m^3, at the integration points.

    `like` is an energy over the cells of the slice, and `points` (n, 3), m, are the nodes. The shape functions N at the
    integration points are either the same for all cells (q, a) or given for each cell (m, q, a).
    """
    each = N if N.ndim == 3 else N[None]
    r = (each @ points[like.cells, 0][:, :, None])[:, :, 0]
    return each / r[:, :, None], like.w * circumference_in_slices(r, depth)


@dataclass(frozen=True)
class AxisymmetricElastic(Elastic):
    """Elastic energy of an axisymmetric body: sum over integration points of w psi(F), with F33 = 1 + u_x / r.

    `hoop` (m, q, a) is N_a / r in 1/m. `w` (m, q) are the volumes of the whole body, m^3. Displacements along z are
    taken as zero.
    """

    hoop: Floats | None = None
    depth: float = 1.0

    @classmethod
    def of(cls, like: Elastic, N: Floats, points: Floats, depth: float) -> AxisymmetricElastic:
        """Return the axisymmetric energy of a slice with nodes (n, 3), m (see `hoop_terms_and_ring_volumes`)."""
        hoop, w = hoop_terms_and_ring_volumes(like, N, points, depth)
        return cls(like.cells, like.dNdX, w, like.law, drag=like.drag, hoop=hoop, depth=depth)

    @property
    def _required_hoop_terms(self) -> Floats:
        if self.hoop is None:
            raise TypeError("a body of revolution without its distances from the axis")
        return self.hoop

    def F(self, x: Floats) -> Floats:
        """Return the deformation gradients (m q, 3, 3)."""
        F = super().F(x)
        u = x.reshape(-1, 3)[self.cells, 0]
        F[:, 2, 2] = 1.0 + np.einsum("mqa,ma->mq", self._required_hoop_terms, u).ravel()
        return F

    def value(self, x: Floats) -> float:
        """Return the strain energy of the whole body, J."""
        up = self.magnification(x)
        return self._value(x if up == 1.0 else x * x.dtype.type(up)) / up / up

    def _value(self, x: Floats) -> float:
        return float(self.law.psi(self.F(x)) @ self.w.ravel())

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal elastic forces of whole rings, N."""
        up = self.magnification(x)
        self.add_stresses(self.law.P(self.F(x if up == 1.0 else x * x.dtype.type(up))), g, scale / up)

    @cached_property
    def _gradient_per_displacement(self) -> float:
        """Bound of |H| per largest |u|, 1/m, with H the displacement gradient and u the nodal displacements.

        It is the sum of the shape-function gradients and of the hoop terms N_a / r.
        """
        return super()._gradient_per_displacement + float(
            np.abs(self._required_hoop_terms).sum(axis=2).max(initial=0.0)
        )

    def add_stresses(self, P: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces of whole rings, N, caused by stresses P (m q, 3, 3), Pa, to g."""
        wP = P.reshape(*self.w.shape, 3, 3) * (scale * self.w)[:, :, None, None]
        ring = wP[:, :, 2, 2].copy()
        wP[:, :, 2, 2] = 0.0
        f = np.einsum("mqiJ,mqaJ->mai", wP, self.dNdX, optimize=True)
        f[:, :, 0] += np.einsum("mq,mqa->ma", ring, self._required_hoop_terms)
        np.add.at(g.reshape(-1, 3), self.cells, f)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent stiffness, N/m."""
        self._add_law_stiffness(self.law, "dPdF_projected" if projected else "dPdF", x, data, slots, scale)

    def add_moduli(self, A: Floats, some: slice, data: Floats, slots: Ints, scale: float = 1.0) -> None:
        """Add the stiffness, N/m, of given tensors dP/dF (c q, 3, 3, 3, 3), Pa, at the points of the cells `some`."""
        B, w = self._deformation_gradient_derivative(some), self.w[some]
        each = A.reshape(*w.shape, 9, 9) * (scale * w)[:, :, None, None]
        flat = len(w), -1, B.shape[3]  # stack the points, so that their sum is one matrix product
        add_blocks(B.reshape(flat).swapaxes(1, 2) @ (each @ B).reshape(flat), slots, data)

    def derivative_by_displacements(self, G: Floats, some: slice = slice(None)) -> Floats:
        """Return dg/du (c, q, 3a), 1/m, from G = dg/dF (c, q, 3, 3), at the points of the cells `some`."""
        found: Floats = (G.reshape(*G.shape[:2], 1, 9) @ self._deformation_gradient_derivative(some))[:, :, 0]
        return found

    def _deformation_gradient_derivative(self, some: slice) -> Floats:
        """Return dF/du of the cells `some` (c, q, 9, 3a), 1/m."""
        dNdX, rings = self.dNdX[some], self._required_hoop_terms[some]
        B = np.zeros((*dNdX.shape[:2], 9, dNdX.shape[2], 3))
        for i in range(3):
            B[:, :, 3 * i : 3 * i + 3, :, i] = dNdX.swapaxes(2, 3)
        B[:, :, HOOP, :, ALONG_Z] = 0.0
        B[:, :, HOOP, :, 0] = rings
        return B.reshape(*dNdX.shape[:2], 9, -1)


@dataclass(frozen=True)
class AxisymmetricPressure(FollowerPressure):
    """Follower pressure on an axisymmetric surface, along the inward normal and over rings of the current radius.

    Force on node a: -p int N_a (2 pi x_r / depth) (dx/dxi x dx/deta) dxi deta.
    """

    depth: float = 1.0

    def _weights_at(self, x: Floats) -> Floats:
        """Return the quadrature weights (f, q) of whole rings, whose circumference is that of the state x."""
        N, _, _, w = self._rule
        y = (self.points[:, 0] + x.reshape(-1, 3)[:, 0])[self.faces]
        return w * circumference_in_slices(y @ N.T, self.depth)

    def _unit_pressure_stiffness(self, x: Floats) -> Floats:
        """Return the derivative of minus the forces under unit pressure, with the change of circumference."""
        block = super()._unit_pressure_stiffness(x)
        N, _, _, w = self._rule
        areas = w[:, :, None] * np.cross(*self._tangents(x))
        block[..., 0] += circumference_in_slices(np.einsum("qa,qb,fqi->faib", N, N, areas, optimize=True), self.depth)
        return block
