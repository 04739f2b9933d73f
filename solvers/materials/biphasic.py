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
    """Porous skeleton saturated with fluid, both incompressible (poroelastic): cartilage, discs, gels, soil.

    The stress is that of the skeleton minus the fluid pressure p, and fluid flows from high to low pressure:
    P = P_law(F) - p J F^-T,  dJ/dt = div_X(J F^-1 k F^-T grad_X p)
    `law` is the drained skeleton, with its drained Poisson's ratio. `permeability` is the hydraulic permeability in
    Darcy's law, in m^4/(N s): the intrinsic permeability in m^2 divided by the viscosity of the fluid in Pa s. It is
    isotropic in the deformed body. With an `exponent` or a `stiffening` it changes with the volume (Holmes and Mow),
    k = permeability ((J - solid) / (1 - solid))^exponent exp(stiffening (J^2 - 1) / 2),
    where `solid` is the initial solid volume fraction; J always stays above `solid`, where no pores would be
    left. Small strain accepts only a constant k.

    It needs `fem(tet10)`, `fem(hex20)` or `fem(hex27)` and a `quasistatic` analysis. Pressures are continuous and
    linear between corners (Taylor and Hood), so they do not oscillate before fluid has had time to flow. Surfaces are
    sealed unless `support drained(...)` or `pore_pressure(...)` opens them. Loads act on skeleton and fluid together.
    Inertia is neglected. Gravity acts on the density of the law, not separately on the fluid: for a submerged body give
    its submerged density; pressures are then relative to the hydrostatic pressure.
    Source: Biot (1941), J. Appl. Phys. 12:155; Mow, Kuei, Lai and Armstrong (1980), J. Biomech. Eng. 102:73; Holmes and
    Mow (1990), J. Biomech. 23:1145; Coussy (2004), "Poromechanics", chapters 3 and 4.
    """

    law: Annotated[Any, "material", "the drained skeleton"]
    permeability: Annotated[float, "m^4/(N*s) in (0, inf)", "initial hydraulic permeability: `1e-15 m^4/(N*s)`"]
    exponent: Annotated[float, "1 in [0, 100]", "exponent of the decrease of permeability as pores close"] = 0.0
    stiffening: Annotated[float, "1 in [0, 100]", "M of Holmes and Mow, exponent of the exponential factor"] = 0.0
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
