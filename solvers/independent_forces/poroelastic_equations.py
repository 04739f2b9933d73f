"""Independent fluid equations of a porous solid in the deformed body: pressure forces, fluid content and flow.

The solver pulls everything back to the undeformed mesh. Here gradients and volumes are those of the deformed mesh, with
Darcy's law in its spatial form, v = -k grad_x p, and the change of volume is a difference of two volumes. Pressures are
linear between the corners of cells. Time steps are those of SDIRK2 (Alexander 1977), whose first stage ends at the
fraction 1 - sqrt(1/2) of a step.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import EPS, Floats, Ints

FIRST = 1.0 - 2.0**-0.5  # end of the first stage, relative to the step
SURE = 1e-6  # relative to a step: tolerance of the first stage's time


@dataclass(frozen=True)
class PoroelasticBody:
    """A mesh filled with fluid: `points` (n, 3), m, `cells` (m, a), and pressures `p` (m, c) at their corners, Pa.

    Pressures are positive in compression. `permeable` returns k, m^4/(N s), at volume ratios J (...). If `small`,
    strain is linear in the displacements, everything is evaluated in the undeformed mesh, and k is that at rest. If
    `depth`, m, is given, the mesh is a slice of that thickness through a body of revolution.
    """

    points: Floats
    cells: Ints
    kind: str
    p: Floats
    permeable: Callable[[Floats], Floats]
    small: bool
    depth: float = 0.0

    def _deformed_geometry(self, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return dN/dx (m, q, a, 3), 1/m, volumes (m, q), m^3, and distances from the axis (m, q), m, of the points."""
        xi, weights = solid_forces.quadrature_rule(self.kind)
        x = self.points if self.small else self.points + u
        dN, det = solid_forces.gradients(x, self.cells, self.kind, xi)
        r = x[self.cells][:, :, 0] @ solid_forces.shape_functions(self.kind, xi).T
        around = 2.0 * np.pi * r / self.depth if self.depth else 1.0
        return dN, weights * det * around, r

    @property
    def _corner_shape_functions(self) -> Floats:
        """Pressure shape functions at the integration points (q, c)."""
        return solid_forces.shape_functions(CELLS[self.kind].linear, solid_forces.quadrature_rule(self.kind)[0])

    def _sum_at_nodes(self, each: Floats) -> Floats:
        """Return the sums at the nodes (n,) of values at the corners of cells (m, c)."""
        c = each.shape[1]
        found: Floats = np.bincount(self.cells[:, :c].ravel(), each.ravel(), len(self.points)).astype(np.float64)
        return found

    def forces(self, u: Floats) -> tuple[Floats, float]:
        """Return the nodal forces of the fluid pressure, -int p dN/dx dv (n, 3), N, and their rounding error."""
        dN, w, r = self._deformed_geometry(u)
        p = self.p @ self._corner_shape_functions.T
        f = -np.einsum("mq,mqai->mai", w * p, dN)
        if self.depth:
            f[:, :, 2] = 0.0
            f[:, :, 0] -= (w * p / r) @ solid_forces.shape_functions(
                self.kind, solid_forces.quadrature_rule(self.kind)[0]
            )
        found = np.zeros_like(self.points)
        for i in range(3):
            found[:, i] = np.bincount(self.cells.ravel(), f[:, :, i].ravel(), minlength=len(found))
        size = float(np.linalg.norm(np.einsum("mq,mqai->mai", np.abs(w * p), np.abs(dN))))
        return found, EPS * size

    def volumes(self, u: Floats) -> Floats:
        """Return the fluid volumes gained since rest, int N_b (dv - dV), at the corners (n,), m^3."""
        dN, w, r = self._deformed_geometry(u)
        if self.small:
            grown = np.einsum("mqai,mai->mq", dN, u[self.cells] - u[self.cells[:, :1]])
            grown = grown + (
                u[self.cells][:, :, 0]
                @ solid_forces.shape_functions(self.kind, solid_forces.quadrature_rule(self.kind)[0]).T
                / r
                if self.depth
                else 0.0
            )
            return self._sum_at_nodes((w * grown) @ self._corner_shape_functions)
        before = self._deformed_geometry(np.zeros_like(u))[1]
        return self._sum_at_nodes((w - before) @ self._corner_shape_functions)

    def flow(self, u: Floats) -> Floats:
        """Return the inflow rates -int grad N_b . k grad p dv at the corners (n,), m^3/s."""
        w = self._deformed_geometry(u)[1]
        k = self.permeable(w / self._deformed_geometry(np.zeros_like(u))[1])
        slopes = self._pressure_shape_gradients(u)
        grad = np.einsum("mqci,mc->mqi", slopes, self.p)
        return self._sum_at_nodes(-np.einsum("mq,mqci,mqi->mc", w * k, slopes, grad))

    def _pressure_shape_gradients(self, u: Floats) -> Floats:
        """Return the gradients of the pressure shape functions (m, q, c, 3), 1/m, in the deformed mesh."""
        xi, _ = solid_forces.quadrature_rule(self.kind)
        x = self.points if self.small else self.points + u
        X = x[self.cells] - x[self.cells[:, :1]]
        cof, det = solid_forces.cofactor(np.einsum("mai,qaj->mqij", X, solid_forces.shape_derivatives(self.kind, xi)))
        corners = solid_forces.shape_derivatives(CELLS[self.kind].linear, xi)
        found: Floats = np.einsum("qcj,mqij->mqci", corners, cof / det[..., None, None])
        return found

    def stage_residual(self, times: tuple[float, ...], states: tuple[Floats, ...]) -> Floats:
        """Return the residual of the fluid equation of the last stage at each corner (n,), m^3.

        At drained corners it is the outflow. `times`, s, and `states` hold all stages so far, with displacements (n,
        3), m, from rest. Raises ValueError if the last two stages do not form a time step.
        """
        now, rest = states[-1], np.zeros_like(states[-1])
        earlier = [rest, *states]
        when = [times[0], *times]
        if when[-1] <= when[-2]:
            return self.volumes(now) - self.volumes(earlier[-2])
        h = when[-1] - when[-3]
        if abs((when[-2] - when[-3]) / h - FIRST) > SURE:
            raise ValueError("its last time step is not a two-stage step")
        begin, middle = (self.volumes(u) for u in (earlier[-3], earlier[-2]))
        due = begin + (1.0 - FIRST) / FIRST * (middle - begin)
        return self.volumes(now) - due - FIRST * h * self.flow(now)
