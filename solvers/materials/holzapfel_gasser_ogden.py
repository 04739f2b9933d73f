"""Holzapfel-Gasser-Ogden material for artery walls: two families of dispersed fibres."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic_material import Bulk, Density, Fibres, Sheets
from softmark.solvers.materials.fiber_reinforced import ONSET, FiberLaw, FiberReinforced, Onset

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


@dataclass(frozen=True)
class HolzapfelGasserOgden(FiberReinforced):
    """Artery wall: a matrix with two families of dispersed collagen fibres at angles of plus and minus `angle`.

    psi = c/2 (I1 - 3 - 2 ln J) + sum over both of k1/(2 k2) (exp(k2 <E>^2) - 1) + K/2 (J - 1)^2
    E = kappa (I1 - 3) + (1 - 3 kappa) (I4 - 1), I4 = |F a|^2, a = cos(angle) f +- sin(angle) s
    `fibres` is the direction from which the angle is measured (circumferential), and `sheets` the second direction in
    the plane of the fibres (axial). kappa = 0: all fibres of a family are parallel; 1/3: isotropic dispersion. A family
    with E < 0 is slack, <E> = 0; for E below `onset` its stress is a cubic, so that the tangent is continuous. The
    invariants are those of F, not of its isochoric part; the two forms differ where the volume changes. Without `bulk`
    J = 1, and `formulation = mixed` finds the pressure.
    Source: Gasser, Ogden, Holzapfel (2006), J. R. Soc. Interface 3:15; Nolan et al. (2014), "A robust anisotropic
    hyperelastic formulation for the modelling of soft tissue".
    """

    sheeted = True

    c: Annotated[float, "Pa in (0, inf)", "shear modulus of the matrix"]
    k1: Annotated[
        float, "Pa in (0, inf)", "fibre stiffness: a quarter of the modulus that a family adds when just taut"
    ]
    k2: Annotated[float, "1 in [0, inf)", "rate of exponential stiffening of the fibres"]
    angle: Annotated[
        float, "rad in [0, 1.5707963267948966]", "angle between `fibres` and each family, one on either side"
    ]
    density: Density
    fibres: Fibres
    sheets: Sheets
    kappa: Annotated[float, "1 in [0, 0.3333333333333333]", "dispersion of fibres: 0 parallel, 1/3 isotropic"] = 0.0
    bulk: Bulk = None
    onset: Onset = ONSET

    @property
    def dispersion(self) -> float:  # type: ignore[override]
        """Dispersion kappa."""
        return self.kappa

    @property
    def families(self) -> tuple[tuple[tuple[float, float], FiberLaw], ...]:
        """Two fibre families, at plus and minus the angle."""
        c, s, strand = math.cos(self.angle), math.sin(self.angle), FiberLaw(self.k1, self.k2, self.onset)
        return (((c, s), strand), ((c, -s), strand))

    @property
    def matrix_modulus(self) -> float:
        """Matrix modulus c, Pa."""
        return self.c

    def _matrix_energy_derivatives(self, stretch: Array) -> tuple[Array | float, Array | float, Array | None]:
        return 0.5 * self.c * stretch, self.c, None
