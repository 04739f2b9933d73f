"""Base class of active materials, which wrap a passive law: active stress and active strain."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from softmark.solvers.materials.anisotropic_material import Anisotropic, constant_at, depends_on_position, directions_at
from softmark.solvers.materials.material_axes import MaterialFrame

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


class ActiveMaterial(Anisotropic):
    """A passive `law` with an activation along its fibres, or along the direction `own` if that is given.

    The class attribute `does` is the name of the field that holds the activation.
    """

    law: Any
    own: Any
    amplitude: Any
    does = ""

    @property
    def fibres(self) -> Any:
        """Direction of activation; None if neither the law nor the material has fibres."""
        return getattr(self.law, "fibres", None) if self.own is None else self.own

    @property
    def passive(self) -> Any:
        """Passive material, without activation."""
        return self.law

    @property
    def within(self) -> Any:
        """Finite-strain law of the wrapped material."""
        made = getattr(self.law, "finite_law", None)
        return self.law if made is None else made()

    @property
    def activation_value(self) -> Any:
        """Value of the activation: a number, a function of position, or an array of one value per point."""
        return getattr(self, self.does)

    def part(self, share: float) -> Any:
        """Return the material with the fraction `share` of its activation."""
        return self._with(**{self.does: self.activation_value * share})

    def _shape_psi(self, f: Array, axes: Array) -> Array:
        raise TypeError("a wrapped law has no isochoric-volumetric split of its own")

    _shape_P = _set_shape = _shape_psi  # type: ignore[assignment]

    def _with_bulk(self, bulk: float) -> Any:
        raise TypeError("a wrapped law is split by the law inside it")

    def finite_mixed(self) -> Any:
        """Return the mixed split of the wrapped law, with the activation in the shape part."""
        parts = self.law.finite_mixed()
        return None if parts is None else (self._with(law=parts[0]), parts[1])

    # ------------------------------------------------------------------ attributes of the wrapped law

    @property
    def polyconvex(self) -> bool:
        """True if the energy is polyconvex, which it is if the passive energy is.

        Reason: T/2 |F f|^2 is convex, and F Fa^-1 is linear in F.
        """
        return bool(getattr(self.within, "polyconvex", False))

    @property
    def frame(self) -> MaterialFrame:
        """Fibre directions. Raises TypeError if they are functions of position that were not evaluated."""
        if self.own is None:
            found: MaterialFrame = self.law.frame
            return found
        if depends_on_position(self.own):
            raise TypeError("directions that vary in space, without places")
        return self.own if isinstance(self.own, MaterialFrame) else MaterialFrame.of(self.own)

    @property
    def density(self) -> Any:  # type: ignore[override]
        """Mass per undeformed volume, kg/m^3."""
        return self.law.density

    @property
    def bulk(self) -> float | None:  # type: ignore[override]
        """Bulk modulus of the wrapped law, Pa; None if it is incompressible."""
        return None if self.law.incompressible else self.law.bulk_modulus

    @property
    def uniform(self) -> bool:
        """True if directions and constants are the same everywhere."""
        return bool(self.law.uniform) and not self._has_position_function

    @property
    def turning(self) -> bool:
        """True if the directions are functions of position."""
        return getattr(self.law, "turning", False) or self._has_position_function

    @property
    def _has_position_function(self) -> bool:
        """True if the direction `own` or the activation is a function of position."""
        return depends_on_position(self.own) or hasattr(self.activation_value, "values")

    @property
    def sampled(self) -> bool:
        """True if constants or directions are arrays, one value per integration point."""
        own = getattr(self.own, "sampled", False) or hasattr(self.activation_value, "shape")
        return bool(self.law.sampled) or bool(own)

    def placed(self, X: Array, read: Any = None) -> Any:
        """Return the material with directions and activation evaluated at points X (m, q, 3), m.

        `read` reads field files. Raises InvalidDirection.
        """
        law = self.law.placed(X, read) if hasattr(self.law, "placed") else self.law
        new: dict[str, Any] = {"law": law}
        if depends_on_position(self.own):
            new["own"] = directions_at(self.own, None, X, read)
        if hasattr(self.activation_value, "values"):
            new[self.does] = constant_at(self.activation_value, X, read)
        return self._with(**new)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus of the wrapped law, Pa."""
        return float(self.law.shear_modulus)

    @property
    def local_bulk(self) -> float:
        """Part of the bulk modulus that stays in the point-wise law if a cell pressure carries the other part, Pa."""
        return math.inf if self.bulk is None else self.bulk - self.pressure_modulus

    @property
    def pressure_modulus(self) -> float:
        """Modulus M of the energy term M/2 g^2 of `finite_mixed`, Pa; infinite if incompressible."""
        return float(self.law.pressure_modulus)
