"""Transversely isotropic material: a neo-Hookean matrix with one family of fibres."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic_material import Bulk, Density, Fibres
from softmark.solvers.materials.fiber_reinforced import ONSET, FiberLaw, FiberReinforced, Onset

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


@dataclass(frozen=True)
class TransverselyIsotropic(FiberReinforced):
    """Transversely isotropic soft tissue with one family of parallel fibres: tendon, ligament, muscle.

    psi = mu/2 (I1 - 3 - 2 ln J) + k1/(2 k2) (exp(k2 (I4 - 1)^2) - 1) + K/2 (J - 1)^2, I1 = tr F^T F, I4 = |F f|^2
    With k2 = 0 the fibre term is k1/2 (I4 - 1)^2: the fibres add 4 k1 to the initial modulus along them. With `resists
    = tension` fibres carry no compression: the fibre term is zero for I4 < 1, and its stress is a cubic for I4 - 1
    below `onset`, so that the tangent is continuous. Without `bulk` J = 1, and `formulation = mixed` finds the
    pressure.
    Source: Holzapfel, Gasser, Ogden (2000), J. Elasticity 61:1, with one family; Weiss, Maker, Govindjee (1996),
    "Finite element implementation of incompressible, transversely isotropic hyperelasticity", with another exponential.
    """

    shear: Annotated[float, "Pa in (0, inf)", "mu, shear modulus of the matrix"]
    k1: Annotated[float, "Pa in (0, inf)", "fibre stiffness: a quarter of the modulus that fibres add when just taut"]
    k2: Annotated[float, "1 in [0, inf)", "rate of exponential stiffening of the fibres"]
    density: Density
    fibres: Fibres
    resists: Annotated[Literal["tension", "both"], "loads that fibres carry: only tension, or also compression"] = (
        "tension"
    )
    bulk: Bulk = None
    onset: Onset = ONSET

    @property
    def families(self) -> tuple[tuple[tuple[float, float], FiberLaw], ...]:
        """One fibre family, along the fibre direction."""
        return (((1.0, 0.0), FiberLaw(self.k1, self.k2, self.onset if self.resists == "tension" else None)),)

    @property
    def matrix_modulus(self) -> float:
        """Matrix modulus mu, Pa."""
        return self.shear

    def _matrix_energy_derivatives(self, stretch: Array) -> tuple[Array | float, Array | float, Array | None]:
        return 0.5 * self.shear * stretch, self.shear, None
