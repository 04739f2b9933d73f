"""The geometrically exact rod: elastic energy and dead loads of beams that turn and bend without limit.

Simo-Reissner rods: every cross-section stays plane and moves rigidly. Two-node elements with one
integration point in the middle: second order, free of shear locking, objective and independent of the path.
Stiffnesses are in `rod_section`, states and motion in `rod_state`, strains and their derivatives in
`rod_kinematics`.

To add an energy of a rod, write a class beside `RodElastic` with the members of `energy.Energy`.
"""

from __future__ import annotations

from dataclasses import field, replace
from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints, no_stencils
from softmark.solvers.energies.local_blocks import OverElements
from softmark.solvers.energies.rod_kinematics import Segments, segments_of
from softmark.solvers.energies.rod_section import RodStiffness, VaryingStiffness
from softmark.solvers.energies.rod_state import lengths


@dataclass(frozen=True)
class RodElastic(OverElements):
    """E = sum of l/2 (eps - eps0) . C (eps - eps0), eps = (Gamma, K) at the middle of each element, in J.

    eps0 are the strains of the undeformed state `rest` (nodes * 7,), which may be bent, twisted and placed
    at will; C = diag(EA, GA2, GA3, GJ, EI2, EI3), one or one of each element. A rigid motion changes neither energy
    nor resultants.
    Neighbouring nodes must turn by less than 180 degrees against each other: beyond, the shorter way round
    counts. Sources: Simo & Vu-Quoc 1986 (energy and strains), Crisfield & Jelenic 1999 (objective
    interpolation).
    """

    rest: Floats
    elements: Ints  # (n, 2)
    stiffness: RodStiffness | VaryingStiffness
    offset: Floats = field(default_factory=lambda: np.zeros(6))  # (n, 6) or (6,), added to eps - eps0
    conservative: bool = True

    @cached_property
    def lengths(self) -> Floats:
        """Undeformed lengths (n,), m."""
        return lengths(self.rest, self.elements)

    @cached_property
    def rest_strains(self) -> Floats:
        """Strains (n, 6) of the undeformed state."""
        return Segments.of(self.rest, self.elements, self.lengths).strains

    def stiffened(self, stiffness: VaryingStiffness, offset: Floats) -> RodElastic:
        """The same rod of other stiffnesses, with an offset; what is known of it at rest is not found again."""
        made = replace(self, stiffness=stiffness, offset=offset)
        vars(made).update(lengths=self.lengths, rest_strains=self.rest_strains)
        return made

    def segments(self, x: Floats) -> Segments:
        """The elements in the state x."""
        return segments_of(x, self.elements, self.lengths)

    def strains(self, x: Floats) -> Floats:
        """Gamma - Gamma0 (1) and K - K0 (1/m), (n, 6)."""
        return self.segments(x).strains - self.rest_strains

    def resultants(self, x: Floats) -> Floats:
        """Forces (N) and moments (N m) in the material axes at the middle of each element, (n, 6)."""
        return (self.strains(x) + self.offset) * self.stiffness.diagonal

    def mode_energies(self, x: Floats) -> Floats:
        """Strain energy (6,) in J of stretch, the two shears, twist and the two bendings."""
        return np.asarray(self.lengths @ (self.strains(x) ** 2 * self.stiffness.diagonal) / 2)

    def rigid_fraction(self, x: Floats) -> float:
        """Part of the strain energy that switched-off modes still hold."""
        energies = self.mode_energies(x)
        total = float(np.sum(energies))
        return float(np.sum(energies[list(self.stiffness.rigid)])) / total if total > 0 else 0.0

    def tightened(self, x: Floats) -> RodElastic:
        """The rod whose switched-off modes carry their forces in x without strain: method of multipliers.

        Their present strain joins `offset`, so stiffness times offset is the multiplier (Hestenes 1969,
        Powell 1969). Solved again from x, the strain left in these modes falls a millionfold in a cantilever,
        for one or two Newton steps more.
        """
        rigid = list(self.stiffness.rigid)
        offset = np.broadcast_to(self.offset, (len(self.elements), 6)).copy()
        offset[:, rigid] += self.strains(x)[:, rigid]
        return replace(self, offset=offset)

    def rounding(self, x: Floats) -> float:
        """Bound, N, on the gradient that rounding of positions leaves: eps |x| C / l, root of squares."""
        noise = np.finfo(np.float64).eps * np.max(np.abs(x.reshape(-1, 7)[:, :3]))
        largest = np.max(self.stiffness.diagonal[..., :3])
        return float(noise * largest * np.sqrt(2 * np.sum(1 / self.lengths**2)))

    def value(self, x: Floats) -> float:
        """Strain energy, J; with an offset, that of the springs behind the switched-off modes included."""
        strains = self.strains(x) + self.offset
        return float(np.sum(self.lengths @ (strains**2 * self.stiffness.diagonal)) / 2)

    def local_forces(self, x: Floats) -> Floats:
        """B^T l C (eps - eps0), (n, 12)."""
        segments = self.segments(x)
        return segments.forces(self._weighted(segments))

    def local_hessians(self, x: Floats) -> Floats:
        """B^T l C B plus the geometric part, (n, 12, 12)."""
        segments = self.segments(x)
        return segments.hessians(self._weighted(segments), self._stiffnesses)

    @cached_property
    def _stiffnesses(self) -> Floats:
        """l C, (n, 6)."""
        return np.asarray(self.lengths[:, None] * self.stiffness.diagonal)

    def _weighted(self, segments: Segments) -> Floats:
        """l C (eps - eps0 + offset), (n, 6)."""
        return np.asarray(self._stiffnesses * (segments.strains - self.rest_strains + self.offset))


@dataclass(frozen=True)
class RodLoad(Energy):
    """Nodal forces (nodes, 3) in N that keep their direction, no moments: E = -sum of f . (x - x_rest), J."""

    rest: Floats
    forces: Floats
    conservative: bool = True

    @property
    def stencils(self) -> Ints:
        """None: it has no Hessian."""
        return no_stencils()

    @staticmethod
    def uniform(rest: Floats, elements: Ints, w: Floats) -> RodLoad:
        """`w` (3,) in N per undeformed m, such as rho A g: l w / 2 on each node of an element."""
        forces = np.zeros((rest.size // 7, 3))
        np.add.at(forces, elements, (lengths(rest, elements)[:, None] / 2 * w)[:, None, :])
        return RodLoad(rest, forces)

    def value(self, x: Floats) -> float:
        """Potential, zero in the undeformed state, J."""
        return -float(np.sum(self.forces * (x - self.rest).reshape(-1, 7)[:, :3]))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """g -= scale f on the displacements."""
        g.reshape(-1, 6)[:, :3] -= scale * self.forces

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Nothing: the forces are constant."""

    def rounding(self, x: Floats) -> float:
        """None: the forces are constant."""
        return 0.0
