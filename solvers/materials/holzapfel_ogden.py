"""Holzapfel-Ogden material for passive heart muscle: fibres in sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic_material import Bulk, Density, Fibres, Sheets
from softmark.solvers.materials.fiber_reinforced import ONSET, FiberLaw, FiberReinforced, Onset

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class HolzapfelOgden(FiberReinforced):
    """Passive heart muscle (Holzapfel and Ogden): exponential terms for matrix, fibres, sheets and their shear.

    psi = a/(2b) (exp(b (I1 - 3)) - 1) - a ln J + sum over i = f, s of a_i/(2 b_i) (exp(b_i <I4i - 1>^2) - 1)
        + a_fs/(2 b_fs) (exp(b_fs I8^2) - 1) + K/2 (J - 1)^2, I4i = |F i|^2, I8 = F f . F s
    Fibres and sheets resist only tension: <I4i - 1> = 0 where they are shortened, and for I4i - 1 below `onset` their
    stress is a cubic, so that the tangent is continuous. The term -a ln J makes the undeformed state free of stress.
    Without `bulk` J = 1, and `formulation = mixed` finds the pressure.
    Source: Holzapfel, Ogden (2009), "Constitutive modelling of passive myocardium", Phil. Trans. R. Soc. A 367:3445.
    """

    sheeted = True

    a: Annotated[float, "Pa in (0, inf)", "initial shear modulus of the matrix"]
    b: Annotated[float, "1 in (0, inf)", "rate of exponential stiffening of the matrix"]
    a_f: Annotated[float, "Pa in [0, inf)", "stiffness of the fibres"]
    b_f: Annotated[float, "1 in [0, inf)", "rate of exponential stiffening of the fibres"]
    a_s: Annotated[float, "Pa in [0, inf)", "stiffness of the sheets"]
    b_s: Annotated[float, "1 in [0, inf)", "rate of exponential stiffening of the sheets"]
    a_fs: Annotated[float, "Pa in [0, inf)", "stiffness of the shear between fibres and sheets"]
    b_fs: Annotated[float, "1 in [0, inf)", "rate of exponential stiffening of that shear"]
    density: Density
    fibres: Fibres
    sheets: Sheets = None
    bulk: Bulk = None
    onset: Onset = ONSET

    @property
    def families(self) -> tuple[tuple[tuple[float, float], FiberLaw], ...]:
        """Fibre and sheet families."""
        return ((1.0, 0.0), FiberLaw(self.a_f, self.b_f, self.onset)), (
            (0.0, 1.0),
            FiberLaw(self.a_s, self.b_s, self.onset),
        )

    @property
    def shear_coupling_law(self) -> FiberLaw | None:
        """Law of fibre-sheet shear, for either sign."""
        return FiberLaw(self.a_fs, self.b_fs)

    @property
    def matrix_modulus(self) -> float:
        """Matrix modulus a, Pa."""
        return self.a

    def _matrix_energy_derivatives(self, stretch: Array) -> tuple[Array | float, Array | float, Array | None]:
        grown = np.exp(self.b * stretch)
        return 0.5 * self.a / self.b * np.expm1(self.b * stretch), self.a * grown, 2.0 * self.a * self.b * grown
