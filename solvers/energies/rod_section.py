"""Cross-sections of a rod and their stiffnesses.

To add a section, write a function that returns a `RodSection`, as `circular` does.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import pi

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats


@dataclass(frozen=True)
class RodStiffness:
    """Rod stiffnesses: stretch and shears (EA, GA2, GA3) in N, twist and bendings (GJ, EI2, EI3) in N m^2.

    GA2 and GA3 include the shear factor. EI2 resists the curvature about e2, which is bending in the plane e1-e3.
    `rigid` lists the modes, numbered from 0 in this order, that are penalised as constraints (see `without`).
    """

    EA: float
    GA2: float
    GA3: float
    GJ: float
    EI2: float
    EI3: float
    rigid: tuple[int, ...] = ()

    @cached_property
    def diagonal(self) -> Floats:
        """Diagonal of the stiffness matrix (6,), in the order of the strains (Gamma1, Gamma2, Gamma3, K1, K2, K3)."""
        return np.array([self.EA, self.GA2, self.GA3, self.GJ, self.EI2, self.EI3])

    def with_suppressed_modes(self, length: float, *, shear: bool, axial: bool, ratio: float = 1e6) -> RodStiffness:
        """Return the stiffness of a rod of this `length`, m, whose shear or stretch is suppressed.

        `shear` and `axial` are True for modes that stay flexible. A suppressed mode gets the penalty stiffness max(its
        own stiffness, ratio B / length^2), with B the largest of GJ, EI2 and EI3. A cantilever under a load P with P
        length^2 / B = 10 then stores 20 / ratio of its strain energy in such a mode and has an error of 10 length /
        ratio at its tip, both growing with the load. `RodElastic.with_multipliers` removes this error;
        `RodElastic.rigid_fraction` measures it.

        The penalty costs no Newton steps with `RodChain`, whose moves do not stretch elements that only rotate. The
        condition number of the tangent grows as `ratio`, and rounding limits residuals to a fraction of
        `RodElastic.rounding`.
        """
        floor = ratio * max(self.GJ, self.EI2, self.EI3) / length**2
        return replace(
            self,
            EA=self.EA if axial else max(self.EA, floor),
            GA2=self.GA2 if shear else max(self.GA2, floor),
            GA3=self.GA3 if shear else max(self.GA3, floor),
            rigid=(() if axial else (0,)) + (() if shear else (1, 2)),
        )


@dataclass(frozen=True)
class VaryingStiffness:
    """Rod stiffnesses that differ between elements: `diagonal` (n, 6), each row ordered as in `RodStiffness`."""

    diagonal: Floats
    rigid: tuple[int, ...] = ()

    def with_suppressed_modes(self, length: float, *, shear: bool, axial: bool, ratio: float = 1e6) -> VaryingStiffness:
        """Return the stiffnesses with suppressed modes, as `RodStiffness.without` does.

        B is the largest bending or twisting stiffness of all elements.
        """
        rigid = (() if axial else (0,)) + (() if shear else (1, 2))
        diagonal = self.diagonal.copy()
        floor = ratio * float(diagonal[:, 3:].max()) / length**2
        diagonal[:, rigid] = np.maximum(diagonal[:, rigid], floor)
        return VaryingStiffness(diagonal, rigid)


@dataclass(frozen=True)
class RodSection:
    """A homogeneous isotropic cross-section, with e2 and e3 along its principal axes."""

    area: float  # m^2
    I2: float  # integral of X3^2, m^4
    I3: float  # integral of X2^2, m^4
    J: float  # Saint-Venant torsion constant, m^4
    k2: float  # shear factors
    k3: float
    young: float  # Pa
    shear: float  # shear modulus, Pa

    @property
    def stiffness(self) -> RodStiffness:
        """Stiffnesses EA, k2 GA, k3 GA, N, and GJ, EI2, EI3, N m^2."""
        E, G = self.young, self.shear
        shears = (self.k2 * G * self.area, self.k3 * G * self.area)
        return RodStiffness(E * self.area, *shears, G * self.J, E * self.I2, E * self.I3)


def circular(radius: float, young: float, poisson: float) -> RodSection:
    """Return a circular section of this `radius`, m, and Young's modulus, Pa.

    A = pi R^2, I = pi R^4 / 4, J = 2 I, and the shear factor k = 6 (1 + nu) / (7 + 6 nu) (Cowper 1966).
    """
    I = pi * radius**4 / 4
    k = 6 * (1 + poisson) / (7 + 6 * poisson)
    return RodSection(pi * radius**2, I, I, 2 * I, k, k, young, young / (2 * (1 + poisson)))
