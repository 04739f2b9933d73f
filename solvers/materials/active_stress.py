"""Active stress: muscle with a tension along its fibres, in any law."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass
from softmark.solvers.materials.active_wrapper import ActiveMaterial
from softmark.solvers.materials.anisotropic_material import (
    FIBRES,
    Anisotropic,
    constant_at,
    squared_stretch_change,
    transform_direction,
)
from softmark.solvers.materials.tensor_components import add_geometric_stiffness, displacement_gradient

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class ActiveTension(Anisotropic):
    """Active part of the stress of muscle: the second Piola-Kirchhoff stress T f (x) f along the fibres f.

    It is independent of the deformation, with the energy psi = T/2 (|F f|^2 - 1).
    """

    tension: Any
    fibres: Any
    density: float = 0.0
    bulk = None
    varying = ("tension",)

    @property
    def turning(self) -> bool:
        """True if the directions or the tension are functions of position."""
        return super().turning or hasattr(self.tension, "values")

    @property
    def sampled(self) -> bool:
        """True if the directions or the tension are arrays, one value per integration point."""
        return super().sampled or hasattr(self.tension, "shape")

    def placed(self, X: Array, read: Any = None) -> Any:
        """Return the law with directions and tension evaluated at points X (m, q, 3), m; `read` reads field files.

        Raises InvalidDirection.
        """
        made = super().placed(X, read)
        if not hasattr(self.tension, "values"):
            return made
        return replace(made, tension=constant_at(self.tension, X, read))

    def _shape_psi(self, f: Array, axes: Array) -> Array:
        psi: Array = (
            0.5 * self.tension * squared_stretch_change(transform_direction(displacement_gradient(f), axes[0]), axes[0])
        )
        return psi

    def _shape_P(self, f: Array, axes: Array) -> Array:
        P: Array = (self.tension * transform_direction(f, axes[0]))[:, None] * axes[0][None]
        return P

    def _set_shape(self, f: Array, axes: Array, H: Array) -> None:
        H[...] = 0.0
        self.add_stiffness(H, axes)

    def add_stiffness(self, H: Array, axes: Array) -> None:
        """Add the stiffness delta_ik T f_J f_L to H (9, 9, m), on and above the diagonal, Pa."""
        add_geometric_stiffness(H, self.tension * (axes[0][:, None] * axes[0][None]))

    @property
    def shear_modulus(self) -> float:
        """Shear modulus at rest that the tension adds, Pa."""
        return float(np.abs(self.tension).max())


@dataclass(frozen=True)
class Active(ActiveMaterial):
    """Muscle by active stress: a tension along the fibres is added to any passive law.

    S = S of the law + T f (x) f, the second Piola-Kirchhoff stress; f are the fibres before deformation
    In a static analysis the tension is raised together with the loads. An `amplitude` scales it as it scales loads:
    over the states of a static analysis, or over time in a quasistatic or dynamic one; by default the full tension acts
    from the start. Its work is part of the energy balance of a dynamic analysis and listed as `muscle_work`, a part of
    `load_work`. T is a second Piola-Kirchhoff stress (force per undeformed area, divided by the stretch), so the Cauchy
    stress along the fibres grows with the square of their stretch. T may vary in space, by an expression or a field.
    The fibres are those of the law; give `own` for a law without fibres, such as rubber.
    Source: Land et al. (2015), Proc. R. Soc. A 471:20150641, problem 3; Nash, Hunter (2000), J. Elasticity 61:113.
    """

    law: Annotated[Any, "material", "passive material"]
    tension: Annotated[float, "Pa in [0, inf)", "T, active second Piola-Kirchhoff stress along the fibres"]
    own: Annotated[Any, "fibres", FIBRES + "; default: those of the law"] = None
    amplitude: Annotated[Any | None, "amplitude", "amplitude of the tension; default: full tension from the start"] = (
        None
    )
    varying = ("density", "tension")
    does = "tension"
    pulls = True  # the active stress is applied together with the loads

    @property
    def pull(self) -> ActiveTension:
        """Law of the active tension, without the passive law."""
        return ActiveTension(self.tension, self.fibres)

    # ------------------------------------------------------------------ sum of passive and active part

    def _psi(self, f: Array) -> Array:
        psi: Array = self.within._psi(f) + self.pull._psi(f)
        return psi

    def _P(self, f: Array) -> Array:
        P: Array = self.within._P(f) + self.pull._P(f)
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        self.within._dPdF(f, H)
        self.pull.add_stiffness(H, self.frame.axes(f.dtype))
