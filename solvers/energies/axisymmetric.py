"""Bodies of revolution by their meridian: energies of a slice of it, weighed by the way around the axis.

The slice lies in the plane of x, the distance r from the axis, and y, along it, and is `depth` thick. What moves in the
plane alone stretches rings around the axis by 1 + u_x / r, and an integral over the slice becomes one over all of the
body times 2 pi r / depth. Source: Bonet and Wood (2008), "Nonlinear Continuum Mechanics", section 9.
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

ALONG_Z, HOOP = 2, 8  # of displacements; of a tensor (9,): its component around the axis


def around(r: Floats, depth: float) -> Floats:
    """How many slices as thick as `depth` (m) go around the axis at distances r, m."""
    return 2.0 * np.pi / depth * r


class OfSlice(Protocol):
    """An energy over cells (m, a) of a slice, with the volumes w (m, q) of its points, m^3."""

    @property
    def cells(self) -> Ints: ...
    @property
    def w(self) -> Floats: ...


def carried(like: OfSlice, N: Floats, points: Floats, depth: float) -> tuple[Floats, Floats]:
    """N_a / r (m, q, a), 1/m, of a slice with nodes (n, 3), m, and the volumes of whole rings (m, q), m^3.

    Shape functions N are those at the points of all cells (q, a), or of each (m, q, a).
    """
    each = N if N.ndim == 3 else N[None]
    r = (each @ points[like.cells, 0][:, :, None])[:, :, 0]
    return each / r[:, :, None], like.w * around(r, depth)


@dataclass(frozen=True)
class Revolved(Elastic):
    """sum over points of w psi(F), with F of the slice but F33 = 1 + u_x / r: `hoop` (m, q, a) is N_a / r in 1/m.

    `w` (m, q) are those of the whole body, m^3. Displacements along z are taken for zero.
    """

    hoop: Floats | None = None
    depth: float = 1.0

    @classmethod
    def of(cls, like: Elastic, N: Floats, points: Floats, depth: float) -> Revolved:
        """The energy of a slice with nodes (n, 3), m, and shape functions N (q, a), carried around the axis."""
        hoop, w = carried(like, N, points, depth)
        return cls(like.cells, like.dNdX, w, like.law, drag=like.drag, hoop=hoop, depth=depth)

    @property
    def _rings(self) -> Floats:
        if self.hoop is None:
            raise TypeError("a body of revolution without its distances from the axis")
        return self.hoop

    def F(self, x: Floats) -> Floats:
        """Deformation gradients (m q, 3, 3)."""
        F = super().F(x)
        u = x.reshape(-1, 3)[self.cells, 0]
        F[:, 2, 2] = 1.0 + np.einsum("mqa,ma->mq", self._rings, u).ravel()
        return F

    def value(self, x: Floats) -> float:
        """Strain energy of the whole body, J."""
        up = self.magnification(x)
        return self._value(x if up == 1.0 else x * x.dtype.type(up)) / up / up

    def _value(self, x: Floats) -> float:
        return float(self.law.psi(self.F(x)) @ self.w.ravel())

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Nodal elastic forces, N, of whole rings."""
        up = self.magnification(x)
        self.add_stresses(self.law.P(self.F(x if up == 1.0 else x * x.dtype.type(up))), g, scale / up)

    @cached_property
    def _steepest(self) -> float:
        """The sum of the gradients of shape functions and of the hoop terms N_a / r, 1/m, which bounds |H| / |u|."""
        return super()._steepest + float(np.abs(self._rings).sum(axis=2).max(initial=0.0))

    def add_stresses(self, P: Floats, g: Floats, scale: float = 1.0) -> None:
        """Nodal forces, N, of stresses P (m q, 3, 3), Pa, of whole rings."""
        wP = P.reshape(*self.w.shape, 3, 3) * (scale * self.w)[:, :, None, None]
        ring = wP[:, :, 2, 2].copy()
        wP[:, :, 2, 2] = 0.0
        f = np.einsum("mqiJ,mqaJ->mai", wP, self.dNdX, optimize=True)
        f[:, :, 0] += np.einsum("mq,mqa->ma", ring, self._rings)
        np.add.at(g.reshape(-1, 3), self.cells, f)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Tangent stiffness, N/m."""
        self._add_tensors(self.law, "dPdF_projected" if projected else "dPdF", x, data, slots, scale)

    def add_moduli(self, A: Floats, some: slice, data: Floats, slots: Ints, scale: float = 1.0) -> None:
        """Stiffness, N/m, of tensors dP/dF (c q, 3, 3, 3, 3), Pa, at the points of some cells."""
        B, w = self._strains(some), self.w[some]
        each = A.reshape(*w.shape, 9, 9) * (scale * w)[:, :, None, None]
        flat = len(w), -1, B.shape[3]  # points one below the other: their sum is one product
        add_blocks(B.reshape(flat).swapaxes(1, 2) @ (each @ B).reshape(flat), slots, data)

    def slope(self, G: Floats, some: slice = slice(None)) -> Floats:
        """dg/du (c, q, 3a), 1/m, of what has dg/dF = G (c, q, 3, 3) at the points of some cells."""
        found: Floats = (G.reshape(*G.shape[:2], 1, 9) @ self._strains(some))[:, :, 0]
        return found

    def _strains(self, some: slice) -> Floats:
        """dF/du of some cells (c, q, 9, 3a), 1/m."""
        dNdX, rings = self.dNdX[some], self._rings[some]
        B = np.zeros((*dNdX.shape[:2], 9, dNdX.shape[2], 3))
        for i in range(3):
            B[:, :, 3 * i : 3 * i + 3, :, i] = dNdX.swapaxes(2, 3)
        B[:, :, HOOP, :, ALONG_Z] = 0.0
        B[:, :, HOOP, :, 0] = rings
        return B.reshape(*dNdX.shape[:2], 9, -1)


@dataclass(frozen=True)
class RevolvedPressure(FollowerPressure):
    """Pressure on the edge of a meridian, along the current inward normal, on rings of the current radius.

    Force on node a: -p int N_a (2 pi x_r / depth) (dx/dxi x dx/deta) dxi deta.
    """

    depth: float = 1.0

    def _weights_at(self, x: Floats) -> Floats:
        """Of whole rings (f, q), from where facets are now."""
        N, _, _, w = self._rule
        y = (self.points[:, 0] + x.reshape(-1, 3)[:, 0])[self.faces]
        return w * around(y @ N.T, self.depth)

    def _slopes(self, x: Floats) -> Floats:
        """As of a slice, with rings that grow as they move out."""
        block = super()._slopes(x)
        N, _, _, w = self._rule
        areas = w[:, :, None] * np.cross(*self._tangents(x))
        block[..., 0] += around(np.einsum("qa,qb,fqi->faib", N, N, areas, optimize=True), self.depth)
        return block
