"""Geometrically exact rod: elastic energy and dead loads of beams with large rotations and large bending.

Simo-Reissner rods: every cross-section stays plane and moves rigidly. Two-node elements with one integration point at
midspan: second order, free of shear locking, objective and path-independent. Stiffnesses are in `rod_section`, states
and motion in `rod_state`, strains and their derivatives in `rod_kinematics`.

To add a rod energy, write a class next to `RodElastic` with the members of `energy.Energy`.
"""

from __future__ import annotations

from dataclasses import field, replace
from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints, no_stencils
from softmark.solvers.energies.local_blocks import RodElementEnergy
from softmark.solvers.energies.rod_kinematics import RodElements, cached_elements
from softmark.solvers.energies.rod_section import RodStiffness, VaryingStiffness
from softmark.solvers.energies.rod_state import lengths


@dataclass(frozen=True)
class RodElastic(RodElementEnergy):
    """Strain energy of a rod, J: sum over elements of l/2 (eps - eps0) . C (eps - eps0), with eps = (Gamma, K).

    Strains are taken in the middle of each element. eps0 are the strains of the undeformed state `rest` (nodes * 7,),
    which may be bent, twisted and placed anywhere. C = diag(EA, GA2, GA3, GJ, EI2, EI3) is shared by all elements or
    given for each. A rigid motion changes neither energy nor resultants. Adjacent nodes must rotate by less than 180
    degrees relative to each other; beyond that the shorter rotation is taken.
    Sources: Simo & Vu-Quoc 1986 (energy and strains), Crisfield & Jelenic 1999 (objective interpolation).
    """

    rest: Floats
    elements: Ints  # (n, 2)
    stiffness: RodStiffness | VaryingStiffness
    offset: Floats = field(default_factory=lambda: np.zeros(6))  # (n, 6) or (6,), added to eps - eps0
    conservative: bool = True

    @cached_property
    def lengths(self) -> Floats:
        """Undeformed lengths of the elements (n,), m."""
        return lengths(self.rest, self.elements)

    @cached_property
    def rest_strains(self) -> Floats:
        """Strains (Gamma, K) of the elements in the undeformed state (n, 6)."""
        return RodElements.of(self.rest, self.elements, self.lengths).strains

    def with_stiffness_and_offset(self, stiffness: VaryingStiffness, offset: Floats) -> RodElastic:
        """Return the same rod with other stiffnesses and another strain offset; its undeformed state is reused."""
        made = replace(self, stiffness=stiffness, offset=offset)
        vars(made).update(lengths=self.lengths, rest_strains=self.rest_strains)
        return made

    def segments(self, x: Floats) -> RodElements:
        """Return the kinematics of the elements in state x."""
        return cached_elements(x, self.elements, self.lengths)

    def strains(self, x: Floats) -> Floats:
        """Return the strains Gamma - Gamma0 (no unit) and K - K0 (1/m) of the elements, (n, 6)."""
        return self.segments(x).strains - self.rest_strains

    def resultants(self, x: Floats) -> Floats:
        """Return section forces (N) and moments (N m) in the material axes at the middle of each element, (n, 6)."""
        return (self.strains(x) + self.offset) * self.stiffness.diagonal

    def mode_energies(self, x: Floats) -> Floats:
        """Return the strain energy of each mode (6,), J: stretch, two shears, twist and two bendings."""
        return np.asarray(self.lengths @ (self.strains(x) ** 2 * self.stiffness.diagonal) / 2)

    def rigid_fraction(self, x: Floats) -> float:
        """Return the fraction of the strain energy that is stored in modes declared rigid."""
        energies = self.mode_energies(x)
        total = float(np.sum(energies))
        return float(np.sum(energies[list(self.stiffness.rigid)])) / total if total > 0 else 0.0

    def with_multipliers(self, x: Floats) -> RodElastic:
        """Return the rod with a Lagrange multiplier for each rigid mode: the force that the mode has in state x.

        This is the method of multipliers (Hestenes 1969, Powell 1969). The strain that the rigid modes have in x is
        added to `offset`, so that stiffness times offset is the multiplier, and the force remains without strain. In a
        cantilever solved again from x, the remaining strain of these modes falls a millionfold, for one or two more
        Newton steps.
        """
        rigid = list(self.stiffness.rigid)
        offset = np.broadcast_to(self.offset, (len(self.elements), 6)).copy()
        offset[:, rigid] += self.strains(x)[:, rigid]
        return replace(self, offset=offset)

    def rounding(self, x: Floats) -> float:
        """Return a bound of the gradient error due to rounding of positions, N.

        It is the root of the sum of (eps |x| C / l)^2 over elements.
        """
        noise = np.finfo(np.float64).eps * np.max(np.abs(x.reshape(-1, 7)[:, :3]))
        largest = np.max(self.stiffness.diagonal[..., :3])
        return float(noise * largest * np.sqrt(2 * np.sum(1 / self.lengths**2)))

    def value(self, x: Floats) -> float:
        """Return the strain energy, J; with an `offset`, that of the penalty springs of rigid modes is included."""
        strains = self.strains(x) + self.offset
        return float(np.sum(self.lengths @ (strains**2 * self.stiffness.diagonal)) / 2)

    def local_forces(self, x: Floats) -> Floats:
        """Return the gradient of each element (n, 12), B^T l C (eps - eps0), with B the strain derivative."""
        segments = self.segments(x)
        return segments.forces(self._scaled_resultants(segments))

    def local_hessians(self, x: Floats) -> Floats:
        """Return the Hessian of each element (n, 12, 12), B^T l C B plus the geometric stiffness."""
        segments = self.segments(x)
        return segments.hessians(self._scaled_resultants(segments), self._scaled_stiffnesses)

    @cached_property
    def _scaled_stiffnesses(self) -> Floats:
        """Stiffnesses times lengths, l C, of each element (n, 6)."""
        return np.asarray(self.lengths[:, None] * self.stiffness.diagonal)

    def _scaled_resultants(self, segments: RodElements) -> Floats:
        """Return the section forces and moments times lengths, l C (eps - eps0 + offset), of each element (n, 6)."""
        return np.asarray(self._scaled_stiffnesses * (segments.strains - self.rest_strains + self.offset))


@dataclass(frozen=True)
class RodForces(Energy):
    """Dead nodal forces (nodes, 3), N, without moments: E = -sum of f . (x - x_rest), J."""

    rest: Floats
    forces: Floats
    conservative: bool = True

    @property
    def stencils(self) -> Ints:
        """Empty stencils: this load has no Hessian."""
        return no_stencils()

    @staticmethod
    def uniform(rest: Floats, elements: Ints, w: Floats) -> RodForces:
        """Return the load of `w` (3,), N per undeformed m, such as rho A g.

        Each element puts l w / 2 on each of its nodes.
        """
        forces = np.zeros((rest.size // 7, 3))
        np.add.at(forces, elements, (lengths(rest, elements)[:, None] / 2 * w)[:, None, :])
        return RodForces(rest, forces)

    def value(self, x: Floats) -> float:
        """Return the potential, zero in the undeformed state, J."""
        return -float(np.sum(self.forces * (x - self.rest).reshape(-1, 7)[:, :3]))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the forces from the displacement entries: g -= scale f."""
        g.reshape(-1, 6)[:, :3] -= scale * self.forces

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Do nothing: the forces are constant."""

    def rounding(self, x: Floats) -> float:
        """Return zero: the forces are constant."""
        return 0.0
