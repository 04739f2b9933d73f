"""Muscle that pulls: any law, and a tension along its fibres."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic import FIBRES, Anisotropic, along, lengthened
from softmark.solvers.materials.components import add_turned, displacement_gradient

if TYPE_CHECKING:
    from softmark.solvers.materials.frame import Frame
    from softmark.solvers.materials.law import Array


@dataclass(frozen=True)
class Tension(Anisotropic):
    """The part of the stress of muscle that pulls: T f (x) f, second Piola-Kirchhoff, whatever the deformation.

    psi = T/2 (|F f|^2 - 1)
    """

    tension: float
    fibres: Any
    density: float = 0.0
    bulk = None

    def _shape_psi(self, f: Array, axes: Array) -> Array:
        return 0.5 * self.tension * lengthened(along(displacement_gradient(f), axes[0]), axes[0])

    def _shape_P(self, f: Array, axes: Array) -> Array:
        P: Array = (self.tension * along(f, axes[0]))[:, None] * axes[0][None]
        return P

    def _set_shape(self, f: Array, axes: Array, H: Array) -> None:
        H[...] = 0.0
        self.add_stiffness(H, axes)

    def add_stiffness(self, H: Array, axes: Array) -> None:
        """H (9, 9, m) += delta_ik T f_J f_L, on and above the diagonal."""
        add_turned(H, self.tension * (axes[0][:, None] * axes[0][None]))

    @property
    def shear_modulus(self) -> float:
        """That of its stress, Pa."""
        return abs(self.tension)


@dataclass(frozen=True)
class Active(Anisotropic):
    """Muscle that pulls along its fibres with a tension, in whatever law it has at rest.

    S = S of the law + T f (x) f, the second Piola-Kirchhoff stress; f are the fibres before deformation
    The tension grows with the loads: in a static analysis both come in the same steps, to their full size, and where it
    has states the tension is whole in each. As it is
    Ta f (x) f, force per area before deformation over stretch, stress along stretched fibres grows with the square of
    their stretch. `fibres` are those of the law; one without, as rubber, takes its own here.
    Source: Land et al. (2015), Proc. R. Soc. A 471:20150641, problem 3; Nash, Hunter (2000), J. Elasticity 61:113.
    """

    law: Annotated[Any, "material", "the material that it is when it does not pull"]
    tension: Annotated[float, "Pa in [0, inf)", "T, of the second Piola-Kirchhoff stress along the fibres"]
    own: Annotated[Any, "fibres", FIBRES + "; those of the law without"] = None

    @property
    def fibres(self) -> Any:
        """Along which it pulls; None where there are none."""
        return getattr(self.law, "fibres", None) if self.own is None else self.own

    @property
    def passive(self) -> Any:
        """What it is when it does not pull."""
        return self.law

    @property
    def pull(self) -> Tension:
        """The law of the tension alone."""
        return Tension(self.tension, self.fibres)

    # ------------------------------------------------------------------ the sum of both

    def _psi(self, f: Array) -> Array:
        psi: Array = self.law._psi(f) + self.pull._psi(f)
        return psi

    def _P(self, f: Array) -> Array:
        P: Array = self.law._P(f) + self.pull._P(f)
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        self.law._dPdF(f, H)
        self.pull.add_stiffness(H, self.frame.axes(f.dtype))

    def _shape_psi(self, f: Array, axes: Array) -> Array:
        raise TypeError("an active law is the sum of two")

    _shape_P = _set_shape = _shape_psi  # type: ignore[assignment]

    def _with_bulk(self, bulk: float) -> Any:
        raise TypeError("an active law is taken apart by its passive one")

    def finite_mixed(self) -> Any:
        """As the passive law, with the tension in the part of shape."""
        parts = self.law.finite_mixed()
        return None if parts is None else (replace(self, law=parts[0]), parts[1])

    # ------------------------------------------------------------------ of the passive law

    @property
    def frame(self) -> Frame:
        """Its directions. Raises TypeError where they are made of places, and none are known."""
        return self.pull.frame if self.own is not None else self.law.frame

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
        return bool(self.law.uniform) and not hasattr(self.own, "at")

    @property
    def turning(self) -> bool:
        """Whether its directions are made of places."""
        return getattr(self.law, "turning", False) or hasattr(self.own, "at")

    @property
    def sampled(self) -> bool:
        """Whether constants or directions are arrays, of every point of integration."""
        return bool(self.law.sampled) or bool(getattr(self.own, "sampled", False))

    def placed(self, X: Array, read: Any = None) -> Any:
        """The same with its directions at points X (m, q, 3), m; `read` reads fields. Raises NoDirection."""
        law = self.law.placed(X, read) if hasattr(self.law, "placed") else self.law
        if not hasattr(self.own, "at"):
            return replace(self, law=law)
        return replace(self, law=law, own=Tension(1.0, self.own).placed(X, read).fibres)

    @property
    def shear_modulus(self) -> float:
        """That of the law, Pa."""
        return float(self.law.shear_modulus)

    @property
    def local_bulk(self) -> float:
        """What of K stays at every point of a cell where a pressure takes the rest, Pa."""
        return math.inf if self.bulk is None else self.bulk - self.pressure_modulus

    @property
    def pressure_modulus(self) -> float:
        """M of `finite_mixed`, Pa; infinite where its volume cannot change."""
        return float(self.law.pressure_modulus)
