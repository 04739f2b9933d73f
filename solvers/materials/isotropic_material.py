"""Base class of isotropic materials: two elastic constants at rest and a density."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Law
    from softmark.solvers.materials.volumetric_constraints import Constraint
else:
    from softmark.solvers.runtime.lazy_modules import np  # so that `dsl explain` needs no numpy


@dataclass(frozen=True)
class Isotropic:
    """Base class of isotropic elastic materials.

    Young's modulus and Poisson's ratio of the undeformed solid give its two moduli at rest, mu = E / (2 (1 + nu)) and
    lam = E nu / ((1 + nu) (1 - 2 nu)). The law at finite strain is that of the subclass. At nu = 0.5 a solid is
    incompressible: lam and K are infinite. Only models with pressure unknowns accept it, and models without volume
    change, such as beams. Each of the three constants may vary in space: `young = 10 kPa * (1 + z / 5 cm)`, in
    undeformed coordinates, or `young = field("stiffness.nrrd", unit = 1 kPa)`, or both. Finite elements evaluate them
    at integration points.
    """

    young: Annotated[float, "Pa in (0, inf)", "Young's modulus of the undeformed solid"]
    poisson: Annotated[float, "1 in (-1, 0.5]", "Poisson's ratio of the undeformed solid"]
    density: Annotated[float, "kg/m^3 in (0, inf)", "mass per volume of the undeformed solid"]
    # Factors of the two moduli, 0 in the parts of a split law. They are not fields, so scenes do not see them
    shear_share = 1.0
    volume_share = 1.0
    varying = ("young", "poisson", "density")  # constants that may vary in space
    thin = False  # in plane stress (plane_stress.py)
    polyconvex = False  # energy known to be polyconvex: ellipticity is never lost (ellipticity.py)
    # volume ratio above which the energy is known to be convex in ln V (drucker_stability.py)
    convex_above = math.inf
    # Prony series: shares, and relaxation times in s (viscoelastic.py)
    branches: ClassVar[tuple[tuple[float, float], ...]] = ()

    @property
    def polyconvexity_violation(self) -> tuple[str, str] | None:
        """Name of a constant that makes the energy not polyconvex, and the reason; None for most materials."""
        return None

    @property
    def ends(self) -> str | None:
        """Description of the states that no force can reach, in words; None for most materials."""
        return None

    @property
    def shear_modulus(self) -> float:
        """Shear modulus mu = E / (2 (1 + nu)), Pa."""
        return self.shear_share * (self.young / (2.0 * (1.0 + self.poisson)))

    @property
    def lame_lambda(self) -> float:
        """Lame constant lam = E nu / ((1 + nu) (1 - 2 nu)), Pa; infinite at nu = 0.5."""
        if self.incompressible:
            return self._incompressible_modulus
        lam = _safe_quotient(self.young * self.poisson, (1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
        return self.volume_share * lam if self.volume_share else 0.0

    @property
    def bulk_modulus(self) -> float:
        """Bulk modulus K = lam + 2 mu / 3 = E / (3 (1 - 2 nu)), Pa; infinite at nu = 0.5."""
        if self.incompressible:
            return self._incompressible_modulus
        whole = _safe_quotient(self.young, 3.0 * (1.0 - 2.0 * self.poisson))
        return self.volume_share * whole if self.volume_share else 0.0

    @property
    def pressure_modulus(self) -> float:
        """Modulus M of the energy term M/2 g^2 of `finite_mixed`, Pa; infinite at nu = 0.5."""
        return self.lame_lambda - self.local_lambda

    @property
    def local_lambda(self) -> float:
        """Part of lam that stays in the point-wise law of `finite_mixed`, Pa; a cell pressure carries the other part.

        A pressure controls the mean volume of a cell, but volumes may still differ between its points. Only the
        point-wise law resists that, and without any K (lam = -2 mu/3) it is unstable: stretched by t, a neo-Hookean
        solid resists strains h along its axes by mu sum (b_i + 1/t) h_i^2 - 2 mu/3 (tr h)^2, b = (t^2, 1/t, 1/t), which
        is indefinite for every t > 1. So mu/3 of lam stays. Then the K of the point-wise law is mu and nothing locks,
        as in grad-div stabilisation of Taylor-Hood elements (Olshanskii and Reusken 2004, "Grad-div stabilization for
        Stokes equations"). If lam < 4 mu/3 (nu < 2/7) the pressure keeps mu, or all of K if K is less.
        """
        kept: float = self.shear_modulus * clamp_value(-2.0 / 3.0, self._ratio - 1.0, 1.0 / 3.0)
        return kept

    @property
    def _ratio(self) -> float:
        """Ratio lam / mu, infinite at nu = 0.5."""
        return math.inf if self.incompressible else _safe_quotient(2.0 * self.poisson, 1.0 - 2.0 * self.poisson)

    @property
    def incompressible(self) -> bool:
        """True if the volume cannot change: nu = 0.5, or so close that 1/K underflows in double precision."""
        spare: Any = 1.0 - 2.0 * self.poisson
        return bool((spare <= 0.0).all() if is_array(spare) else spare <= 0.0)

    @property
    def uniform(self) -> bool:
        """True if each constant is a single number."""
        return all(isinstance(value, float | int) for value in constants(self).values())

    @property
    def sampled(self) -> bool:
        """True if some constants are arrays, one value per integration point (heterogeneous.py)."""
        return any(is_array(value) for value in constants(self).values())

    @property
    def _incompressible_modulus(self) -> float:
        return math.inf if self.volume_share else 0.0

    def finite_law(self) -> Law | None:
        """Return the finite-strain law; None if there is none."""
        return None

    def finite_parts(self) -> tuple[Law, Law] | None:
        """Return two finite-strain laws whose sum is the law: the shear part and the volume part.

        Return None if there is no finite-strain law, or if it cannot be split.
        """
        return None

    def isochoric(self) -> Law | None:
        """Return the part of the finite-strain law that depends only on F / J^(1/3); None if there is none."""
        return None

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """Return the finite-strain law minus M/2 g^2, and the volume constraint g, with M = lam - `local_lambda`.

        Return None if there is no finite-strain law, or if its volume energy is not of this form.
        """
        return None


def constants(material: Any) -> dict[str, Any]:
    """Return the constants of a material that may vary in space, by name."""
    return {name: getattr(material, name) for name in material.varying}


def is_array(value: Any) -> bool:
    """Return whether a value is an array of one value per point, without importing numpy."""
    return bool(getattr(value, "shape", ()))


def clamp_value(low: float, value: Any, high: float) -> Any:
    """Clamp a value, or each entry of an array, between two bounds."""
    return np.clip(value, low, high) if is_array(value) else max(low, min(high, value))


def _safe_quotient(a: Any, b: Any) -> Any:
    """Return a / b; infinite at points where b is zero."""
    if not is_array(b):
        return a / b
    with np.errstate(divide="ignore"):
        return a / b
