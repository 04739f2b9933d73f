"""What a law that is made around another has of that: muscle that pulls, and muscle that grows shorter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from softmark.solvers.materials.anisotropic_material import Anisotropic, constant_at, directions_at, of_places
from softmark.solvers.materials.material_axes import Frame

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array


class Muscle(Anisotropic):
    """A `law` that does something along fibres, those of it or its `own`: as much as its field `does` says."""

    law: Any
    own: Any
    course: Any
    does = ""

    @property
    def fibres(self) -> Any:
        """Along which it acts; None where there are none."""
        return getattr(self.law, "fibres", None) if self.own is None else self.own

    @property
    def passive(self) -> Any:
        """What it is when it does nothing."""
        return self.law

    @property
    def within(self) -> Any:
        """The law of finite strain that its material has, or its law where that is known."""
        made = getattr(self.law, "finite_law", None)
        return self.law if made is None else made()

    @property
    def much(self) -> Any:
        """As much as it does: a number, or one that is made of places, or an array."""
        return getattr(self, self.does)

    def part(self, share: float) -> Any:
        """The same doing a part of it."""
        return self._with(**{self.does: self.much * share})

    def _shape_psi(self, f: Array, axes: Array) -> Array:
        raise TypeError("a law around another is no shape and volume of its own")

    _shape_P = _set_shape = _shape_psi  # type: ignore[assignment]

    def _with_bulk(self, bulk: float) -> Any:
        raise TypeError("a law around another is taken apart by that")

    def finite_mixed(self) -> Any:
        """As the law within, with what muscle does in the part of shape."""
        parts = self.law.finite_mixed()
        return None if parts is None else (self._with(law=parts[0]), parts[1])

    # ------------------------------------------------------------------ of the law within

    @property
    def polyconvex(self) -> bool:
        """Whether the law's energy is: T/2 |F f|^2 is convex, and F Fa^-1 linear in F."""
        return bool(getattr(self.within, "polyconvex", False))

    @property
    def frame(self) -> Frame:
        """Its directions. Raises TypeError where they are made of places, and none are known."""
        if self.own is None:
            found: Frame = self.law.frame
            return found
        if of_places(self.own):
            raise TypeError("directions that vary in space, without places")
        return self.own if isinstance(self.own, Frame) else Frame.of(self.own)

    @property
    def density(self) -> Any:  # type: ignore[override]
        """Mass per volume at rest, kg/m^3."""
        return self.law.density

    @property
    def bulk(self) -> float | None:  # type: ignore[override]
        """That of the law; None where its volume cannot change."""
        return None if self.law.incompressible else self.law.bulk_modulus

    @property
    def uniform(self) -> bool:
        """Whether its directions and constants are the same everywhere."""
        return bool(self.law.uniform) and not self._places

    @property
    def turning(self) -> bool:
        """Whether its directions are made of places."""
        return getattr(self.law, "turning", False) or self._places

    @property
    def _places(self) -> bool:
        """Whether what is its own is made of places."""
        return of_places(self.own) or hasattr(self.much, "values")

    @property
    def sampled(self) -> bool:
        """Whether constants or directions are arrays, of every point of integration."""
        own = getattr(self.own, "sampled", False) or hasattr(self.much, "shape")
        return bool(self.law.sampled) or bool(own)

    def placed(self, X: Array, read: Any = None) -> Any:
        """The same with its directions at points X (m, q, 3), m; `read` reads fields. Raises NoDirection."""
        law = self.law.placed(X, read) if hasattr(self.law, "placed") else self.law
        new: dict[str, Any] = {"law": law}
        if of_places(self.own):
            new["own"] = directions_at(self.own, None, X, read)
        if hasattr(self.much, "values"):
            new[self.does] = constant_at(self.much, X, read)
        return self._with(**new)

    @property
    def shear_modulus(self) -> float:
        """That of the law within, Pa."""
        return float(self.law.shear_modulus)

    @property
    def local_bulk(self) -> float:
        """What of K stays at every point of a cell where a pressure takes the rest, Pa."""
        return math.inf if self.bulk is None else self.bulk - self.pressure_modulus

    @property
    def pressure_modulus(self) -> float:
        """M of `finite_mixed`, Pa; infinite where its volume cannot change."""
        return float(self.law.pressure_modulus)
