"""Loads: dead nodal forces, which have an energy, and follower pressure, which has none."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints, no_stencils


@dataclass(frozen=True)
class DeadForces:
    """Nodal forces `f` (dofs,) in N that keep their direction: E = -f . x."""

    f: Floats
    stencils: Ints = field(default_factory=no_stencils)
    conservative: bool = True

    def value(self, x: Floats) -> float:
        """Potential of the forces, J."""
        return -float(self.f @ x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """g -= scale f."""
        g -= scale * self.f

    def add_hessian(
        self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False
    ) -> None:
        """Nothing: the forces are constant."""

    def rounding(self, x: Floats) -> float:
        """None: the forces are constant."""
        return 0.0


@dataclass(frozen=True)
class FollowerPressure:
    """Pressure `p` (Pa) on triangles `faces` (f, 3), along their current inward normal.

    Force of a flat triangle on each of its nodes: -p/6 (x2 - x1) x (x3 - x1); its tangent is not symmetric
    on a surface with a free edge (Bonet and Wood 2008, section 9.5), so there is no energy.
    """

    points: Floats  # (n, 3) undeformed
    faces: Ints
    p: float | Floats  # or (f,), one for each face
    conservative: bool = False

    @property
    def stencils(self) -> Ints:
        """Nine degrees of freedom per triangle (f, 9)."""
        return (3 * self.faces[:, :, None] + np.arange(3)).reshape(len(self.faces), 9)

    def value(self, x: Floats) -> float:
        """There is none: follower forces on an open surface have no potential."""
        raise TypeError("a follower load has no energy")

    def _edges(self, x: Floats) -> tuple[Floats, Floats]:
        y = (self.points + x.reshape(-1, 3))[self.faces]
        return y[:, 1] - y[:, 0], y[:, 2] - y[:, 0]

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Minus the nodal forces, N."""
        e1, e2 = self._edges(x)
        minus_force = scale / 6.0 * np.reshape(self.p, (-1, 1)) * np.cross(e1, e2)
        for corner in range(3):
            np.add.at(g.reshape(-1, 3), self.faces[:, corner], minus_force)

    def add_hessian(
        self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False
    ) -> None:
        """Load stiffness, not symmetric; left out of a projected tangent, which must stay definite."""
        if projected:
            return
        e1, e2 = self._edges(x)
        # d(e1 x e2) = -[e2]x de1 + [e1]x de2 with de1 = dx1 - dx0, de2 = dx2 - dx0
        d1, d2 = -_cross_matrix(e2), _cross_matrix(e1)
        row = (
            np.concatenate([-(d1 + d2), d1, d2], axis=2) * np.reshape(self.p, (-1, 1, 1)) * (scale / 6.0)
        )  # (f, 3, 9)
        block = np.tile(row, (1, 3, 1))
        keep = slots >= 0
        np.add.at(data, slots[keep], block[keep])

    def rounding(self, x: Floats) -> float:
        """Far below that of the body that carries it."""
        return 0.0


def _cross_matrix(a: Floats) -> Floats:
    """[a]x (n, 3, 3) with [a]x b = a x b."""
    m = np.zeros((len(a), 3, 3))
    m[:, 0, 1], m[:, 0, 2], m[:, 1, 2] = -a[:, 2], a[:, 1], -a[:, 0]
    return m - m.transpose(0, 2, 1)
