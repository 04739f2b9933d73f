"""Biphasic (poroelastic) material: an elastic skeleton saturated with fluid that flows by Darcy's law."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class Biphasic:
    """A porous skeleton saturated with a fluid, neither of which changes its own volume: cartilage, discs, gels, soil.

    The stress is that of the skeleton less the pressure p of the fluid, and fluid flows from high pressure to low:
    P = P_law(F) - p J F^-T,  dJ/dt = div_X(J F^-1 k F^-T grad_X p)
    `law` is the skeleton once it has drained, with the Poisson's ratio that it then has. `permeability` is Darcy's, in
    m^4/(N s): that of the rock or tissue in m^2 over the viscosity of the fluid in Pa s. It is isotropic in the
    deformed body. With an `exponent` or a `stiffening` it changes with the volume (Holmes and Mow),
    k = permeability ((J - solid) / (1 - solid))^exponent exp(stiffening (J^2 - 1) / 2),
    where `solid` is the share of the volume at rest that is solid; J never falls to it, for there no pores are left.
    Small strain takes a constant k alone.

    `fem(tet10)`, `fem(hex20)` and `fem(hex27)` take it, in the time of `analysis quasistatic`; pressures are continuous
    and linear between corners (Taylor and Hood), so that nothing oscillates where fluid has had no time to flow. Faces
    are sealed but where `support drained(...)` or `pore_pressure(...)` say otherwise. Loads are those of skeleton and
    fluid together. No inertia counts. Gravity pulls on the density of the law and not on the fluid by itself: for a
    body under water give what it weighs there, and pressures are those above the water's. Source: Biot (1941), J. Appl.
    Phys. 12:155; Mow, Kuei, Lai and Armstrong (1980), J. Biomech. Eng. 102:73; Holmes and Mow (1990), J. Biomech.
    23:1145; Coussy (2004), "Poromechanics", chapters 3 and 4.
    """

    law: Annotated[Any, "material", "drained solid skeleton"]
    permeability: Annotated[
        float, "m^4/(N*s) in (0, inf)", "initial permeability over viscosity, such as `1e-15 m^4/(N*s)`"
    ]
    exponent: Annotated[float, "1 in [0, 100]", "exponent of the decrease with pore volume"] = 0.0
    stiffening: Annotated[float, "1 in [0, 100]", "M of Holmes and Mow, in the exponential"] = 0.0
    solid: Annotated[float, "1 in [0, 1)", "initial solid volume fraction"] = 0.0

    def __getattr__(self, name: str) -> Any:
        """Return any other material attribute from the drained skeleton."""
        if name.startswith("__") or name == "law":
            raise AttributeError(name)
        return getattr(self.law, name)

    def permeable(self, J: Array) -> Array:
        """Return k at volume ratios J (...), m^4/(N s); zero if no pores are left."""
        open_ = np.maximum(J - self.solid, 0.0) / (1.0 - self.solid)
        found: Array = self.permeability * open_**self.exponent * np.exp(0.5 * self.stiffening * (J * J - 1.0))
        return found

    def permeable_slope(self, J: Array) -> Array:
        """Return dk/dJ (...), m^4/(N s), where pores are left."""
        found: Array = self.permeable(J) * (self.exponent / (J - self.solid) + self.stiffening * J)
        return found
