"""Hyperelastic laws with isochoric-volumetric split: psi = W(J^(-1/3) F) + K/2 g(J)^2.

To add a law, write a dataclass with its constants, and add one line to MATERIALS. If W depends on the first two
invariants, derive it from `IsochoricInvariantMaterial` (isochoric_invariants.py); if W depends on principal stretches,
from `PrincipalStretchMaterial` (principal_stretches.py). Young's modulus and Poisson's ratio at rest, the parts for
selective integration and for pressures, and g are computed by the base classes.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import field
from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.ranges import InvalidCombination
from softmark.records import dataclass
from softmark.solvers.materials.isotropic_material import Isotropic, clamp_value, is_array
from softmark.solvers.materials.principal_axes_law import add_volume_derivatives
from softmark.solvers.materials.two_invariant_law import TwoInvariantLaw
from softmark.solvers.materials.volumetric_constraints import (
    LogarithmicVolume,
    ReciprocalVolume,
    VolumeRatio,
    VolumeRatioConstraint,
)
from softmark.solvers.runtime.scalar_or_array import full_like, where

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.volumetric_constraints import Constraint
else:
    from softmark.solvers.runtime.lazy_modules import np

LATER: Any = None  # set in __post_init__
VOLUMETRIC: dict[str, type[VolumeRatioConstraint]] = {
    "squared": VolumeRatio,
    "logarithmic": LogarithmicVolume,
    "reciprocal": ReciprocalVolume,
}


@dataclass(frozen=True)
class IsochoricMaterial(Isotropic):
    """Base class of hyperelastic materials with isochoric-volumetric split.

    The volume stiffness is given either by Poisson's ratio at rest (0.5 for incompressible) or by the bulk modulus.
    Young's modulus at rest follows from the constants.
    """

    young: float = field(init=False, repr=False, compare=False)
    poisson: Annotated[float, "1 in (-1, 0.5]", "initial Poisson's ratio; alternatively give `bulk`"] = field(
        default=LATER, kw_only=True
    )
    density: Annotated[float, "kg/m^3 in (0, inf)", "mass per volume of the undeformed solid"] = field(kw_only=True)
    bulk: Annotated[float | None, "Pa in (0, inf)", "initial bulk modulus, instead of `poisson`"] = field(
        default=None, kw_only=True
    )
    volumetric: Annotated[
        Literal["squared", "logarithmic", "reciprocal"],
        "energy of a volume change: K/2 g^2 with g = J - 1, ln J or (J - 1/J)/2",
    ] = field(default="squared", kw_only=True)
    varying = ("density",)  # type: ignore[assignment]
    either = (("poisson", "bulk"),)  # a scene must give exactly one of these fields

    powerless = (
        "",
        "the initial shear modulus is zero or negative",
        "no shear stiffness",
        "use constants with a positive initial shear modulus",
    )

    @property
    @abstractmethod
    def initial_shear_modulus(self) -> float:
        """Shear modulus of the undeformed solid, Pa, from the constants of the law."""

    @abstractmethod
    def with_bulk(self, modulus: Any) -> Law:
        """Return the law with the bulk modulus `modulus`, Pa."""

    def __post_init__(self) -> None:
        """Compute Young's modulus and, if `bulk` is given, Poisson's ratio.

        Raises ValueError if neither the bulk modulus nor Poisson's ratio is given.
        """
        mu, nu = self.initial_shear_modulus, self.poisson
        if nu is None and self.bulk is None:
            raise ValueError(f"{type(self).__name__} needs `poisson` or `bulk`")
        if not np.all(mu > 0.0) if is_array(mu) else not mu > 0.0:
            raise InvalidCombination(*self.powerless)
        if self.bulk is not None:
            nu = (3.0 * self.bulk - 2.0 * mu) / (6.0 * self.bulk + 2.0 * mu)
            object.__setattr__(self, "poisson", nu)
        object.__setattr__(self, "young", 2.0 * mu * (1.0 + nu))

    @property
    def polyconvex(self) -> bool:  # type: ignore[override]
        """True if the shape energy is polyconvex and `volumetric` is `squared`.

        (ln J)^2 is not convex. The square of the `reciprocal` constraint is convex, but not for points that share a
        pressure.
        """
        return self.volumetric == "squared" and self.convex

    @property
    def convex(self) -> bool:
        """True if the constants guarantee a polyconvex shape energy."""
        return False

    @property
    def convex_above(self) -> float:  # type: ignore[override]
        """Lower bound of J above which the volume energy is convex in ln J.

        (ln J)^2 and (J - 1/J)^2 are always convex, (J - 1)^2 is above 1/2.
        """
        if not self.is_log_convex:
            return math.inf
        return 0.5 if self.volumetric == "squared" else 0.0

    @property
    def is_log_convex(self) -> bool:
        """True if the constants guarantee that the shape energy is convex in logarithmic stretches."""
        return False

    @property
    def constraint(self) -> VolumeRatioConstraint:
        """Volume constraint g, selected by `volumetric`."""
        return VOLUMETRIC[self.volumetric]()

    def finite_law(self) -> Law | None:
        """Return the whole law."""
        return self.with_bulk(self.bulk_modulus)

    def isochoric(self) -> Law:
        """Return the law without the volume energy."""
        return self.with_bulk(0.0)

    def finite_parts(self) -> tuple[Law, Law] | None:
        """Return the shear part and the volume part of the law.

        The shear part keeps 5 mu/3 of the bulk modulus, as at nu = 1/4, which makes it stable in tension.
        """
        kept = (2.0 / 3.0 + clamp_value(-1.0, self._ratio, 1.0)) * self.shear_modulus
        return self.with_bulk(kept), VolumetricLaw(self.constraint, self.bulk_modulus - kept)

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """Return the law with `local_lambda` in place of `lame_lambda`, and the volume constraint."""
        return self.with_bulk(self.local_lambda + 2.0 / 3.0 * self.shear_modulus), self.constraint


@dataclass(frozen=True)
class VolumetricLaw(TwoInvariantLaw):
    """Volume energy K/2 g(J)^2 as a law; `modulus` is K in Pa."""

    constraint: VolumeRatioConstraint
    modulus: Any

    def energy(self, stretch: Array, j: Array) -> Array:
        """Return psi (m,), J/m^3, of J - 1."""
        g = self.constraint.of(j)[0]
        found: Array = where(j > -1.0, 0.5 * self.modulus * g * g, math.inf)
        return found

    def slopes(self, stretch: Array, j: Array) -> tuple[Array, Array]:
        """Return the first derivatives of the energy, Pa."""
        return full_like(j, 0.0), self.modulus * volumetric_derivatives(self.constraint, j)[0]

    def curvatures(self, stretch: Array, j: Array) -> tuple[Array | None, Array]:
        """Return the second derivatives of the energy, Pa."""
        return None, self.modulus * volumetric_derivatives(self.constraint, j)[1]


def volumetric_derivatives(constraint: VolumeRatioConstraint, j: Array) -> tuple[Array, Array]:
    """Return the first two derivatives of g^2/2 by J (m,), from j = J - 1."""
    return _half_square_derivatives(*constraint.of(j))


def add_volumetric_terms(
    constraint: VolumeRatioConstraint, modulus: Any, j: Any, tau: list[Any], bent: list[list[Any]]
) -> Any:
    """Return the volume energy K/2 g^2, J/m^3, from j = J - 1, and add its derivatives to `tau` and `bent`.

    `tau` are the principal Kirchhoff stresses, Pa, and `bent` their derivatives by the logarithms of the principal
    stretches (see principal_axes_law.py). `modulus` is K, Pa, and g the value of `constraint`.
    """
    known, J = constraint.of(j), 1.0 + j
    g, (swell, stiffen) = known[0], _half_square_derivatives(*known)
    add_volume_derivatives(tau, bent, modulus * swell * J, modulus * (swell + stiffen * J) * J)
    return 0.5 * modulus * g * g


def _half_square_derivatives(g: Array, first: Array, second: Array | None) -> tuple[Array, Array]:
    return g * first, first * first if second is None else first * first + g * second
