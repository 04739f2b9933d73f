"""Plane stress: any law of a solid, as it is in a thin plate whose faces are free.

The plate may grow thinner or thicker: the stretch across it, F33, is what leaves no stress there, P33 = 0. What is left
is a law of the motion within the plane, with the energy of the solid at that stretch.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.constitutive_law import project
from softmark.solvers.materials.isotropic_material import Isotropic, is_array
from softmark.solvers.materials.tensor_components import components
from softmark.solvers.materials.two_invariant_law import OfInvariants, invariants

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
else:
    from softmark.solvers.runtime.lazy_modules import np

ITERATIONS = 60
LEAST, MOST = 0.1, 10.0  # by which factor the stretch changes at most in one of them
FLAT = 1e-3  # of a thickness: some laws have no stress across what is flat
ROUNDING = 1e-14  # of the stretch: a smaller change is none


@dataclass(frozen=True)
class Thin(Isotropic):
    """A material in plane stress: the moduli are those of the solid that it is made `of`."""

    of: Isotropic | None = None
    thin = True

    @classmethod
    def made(cls, of: Isotropic) -> Isotropic:
        """A plate of a material; a material with fibres as it is, because no plate of one is known (E365)."""
        if isinstance(of, cls) or getattr(of, "directed", False):
            return of
        return cls(of.young, of.poisson, of.density, of)

    @property
    def polyconvex(self) -> bool:  # type: ignore[override]
        """As the solid."""
        return self.of is not None and self.of.polyconvex

    @property
    def steady_above(self) -> float:  # type: ignore[override]
        """As the solid, where that does not ask for its volume."""
        return math.inf if self.of is None or self.of.steady_above else 0.0

    @property
    def branches(self) -> tuple[tuple[float, float], ...]:  # type: ignore[override]
        """Those of the solid."""
        return () if self.of is None else self.of.branches

    def finite_law(self) -> Law | None:
        """The law of the solid: `law_for` makes that of the plate of it."""
        return None if self.of is None else self.of.finite_law()


@dataclass(frozen=True)
class PlaneStress:
    """The law of a plate, of a solid's: psi(F) is the least of the solid's over F33, whatever F33 is given.

    P is the solid's at that stretch, with P33 = 0, and dP/dF = A - A_:33 (x) A_33: / A_3333 with the solid's A: the
    stretch follows the motion (static condensation). Source: de Borst (1991), "The zero-normal-stress condition in
    plane-stress and shell elastoplasticity".
    """

    solid: Law

    def opened(self, F: Array) -> Array:
        """The same F (m, 3, 3) with the stretch across the plate that leaves no stress there; nan where none does.

        By Newton's method, each step of which it holds to a factor of ten.
        """
        F = F.copy()
        F[:, 2, 2] = self._first(F)
        left = np.arange(len(F))
        with np.errstate(all="ignore"):
            for _ in range(ITERATIONS):
                some, s = F[left], F[left, 2, 2]
                stress, slope = self._across(self._at(left), some)
                step = -stress / slope
                F[left, 2, 2] = np.clip(s + step, LEAST * s, MOST * s)
                left = left[~(np.abs(step) <= ROUNDING * s)]
                if not len(left):
                    return F
        F[left[~self._still(self._at(left), F[left])], 2, 2] = np.nan
        return F

    @staticmethod
    def _across(solid: Any, F: Array) -> tuple[Array, Array]:
        """P33 and dP33/dF33 (m,), Pa, of the solid: of laws of invariants without the tensors that they are part of."""
        if not isinstance(solid, OfInvariants):
            return solid.P(F)[:, 2, 2], solid.dPdF(F)[:, 2, 2, 2, 2]
        f = components(F)
        stretch, j = invariants(f)
        (a, s), (c, d) = solid.slopes(stretch, j), solid.curvatures(stretch, j)
        along, C = f[2, 2], f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]  # C = dJ/dF33
        slope = a + d * C**2
        return a * along + s * C, slope if c is None else slope + 2.0 * c * along * C

    def _at(self, which: Any) -> Any:
        """The law of the solid at some of the points: one for all unless its constants vary (heterogeneous.py)."""
        if not any(is_array(v) for v in vars(self.solid).values()):
            return self.solid
        from softmark.solvers.materials.heterogeneous import changed

        return changed(self.solid, lambda a: a[which])

    @staticmethod
    def _rest(solid: Any, F: Array) -> Array:
        """dP/dF of a solid at rest, one for all (1, 3, 3, 3, 3), or of each F where constants are arrays."""
        many = len(F) if any(is_array(v) for v in vars(solid).values()) else 1
        found: Array = solid.dPdF(np.broadcast_to(np.eye(3, dtype=F.dtype), (many, 3, 3)))
        return found

    def _still(self, solid: Any, F: Array) -> Any:
        """Whether the stress across the plate is rounding alone (m,)."""
        A = self._rest(solid, F)[:, 2, 2, 2, 2]
        found = np.abs(solid.P(F)[:, 2, 2]) <= 100.0 * np.finfo(F.dtype).eps * A
        return found & (F[:, 2, 2] > FLAT)

    def _first(self, F: Array) -> Array:
        """A stretch to start from (m,): J^-(lam / (lam + 2 mu)) of the area ratio J, right where strains are small."""
        A = self._rest(self.solid, F)
        area = F[:, 0, 0] * F[:, 1, 1] - F[:, 0, 1] * F[:, 1, 0]
        found: Array = np.maximum(area, LEAST) ** -(A[:, 2, 2, 0, 0] / A[:, 2, 2, 2, 2])
        return found

    def psi(self, F: Array) -> Array:
        """Energy per volume at rest, J/m^3 (m,); +inf where no stretch across the plate frees it of stress."""
        energy = self.solid.psi(self.opened(F))
        return np.where(np.isnan(energy), np.inf, energy)

    def P(self, F: Array) -> Array:
        """First Piola-Kirchhoff stress, Pa (m, 3, 3)."""
        P = self.solid.P(self.opened(F))
        P[:, 2, 2] = 0.0
        return P

    def dPdF(self, F: Array) -> Array:
        """dP_iJ/dF_kL, Pa (m, 3, 3, 3, 3): none of it with F33."""
        A = self.solid.dPdF(self.opened(F)).reshape(-1, 9, 9)
        A = A - A[:, :, 8:] * A[:, 8:, :] / A[:, 8:, 8:]
        A[:, 8, :] = A[:, :, 8] = 0.0
        return A.reshape(-1, 3, 3, 3, 3)

    def dPdF_projected(self, F: Array) -> Array:
        """The positive semi-definite 9x9 matrix nearest to dPdF, Pa (m, 3, 3, 3, 3)."""
        return project(self.dPdF(F))


def thickness(law: Law, F: Array) -> Array:
    """The stretch across a plate (m,) under F (m, 3, 3); of another law than a plate's that of F."""
    found: Array = (law.opened(F) if hasattr(law, "opened") else F)[:, 2, 2]
    return found
