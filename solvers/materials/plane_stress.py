"""Plane stress: any law of a solid, in a thin plate with free faces.

The plate may change its thickness: the thickness stretch F33 makes the stress across the plate zero, P33 = 0. The
result is a law of the in-plane motion, with the energy of the solid at that stretch.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.constitutive_law import project
from softmark.solvers.materials.isotropic_material import Isotropic, is_array
from softmark.solvers.materials.tensor_components import components
from softmark.solvers.materials.two_invariant_law import TwoInvariantLaw, shifted_invariants

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.materials.constitutive_law import Array, Law
else:
    from softmark.solvers.runtime.lazy_modules import np

ITERATIONS = 60
LEAST, MOST = 0.1, 10.0  # bounds of the change of stretch in one iteration
FLAT = 1e-3  # thickness stretch: some laws have no stress across a flattened plate
ROUNDING = 1e-14  # relative change of stretch that counts as converged


@dataclass(frozen=True)
class Plate(Isotropic):
    """A material in plane stress; its moduli are those of the solid `of`."""

    of: Isotropic | None = None
    thin = True

    @classmethod
    def from_material(cls, of: Isotropic) -> Isotropic:
        """Return the plate of a material.

        A material with fibres is returned unchanged, because plates of such materials are refused (E365).
        """
        if isinstance(of, cls) or getattr(of, "directed", False):
            return of
        return cls(of.young, of.poisson, of.density, of)

    @property
    def polyconvex(self) -> bool:  # type: ignore[override]
        """True if the energy of the solid is polyconvex."""
        return self.of is not None and self.of.polyconvex

    @property
    def convex_above(self) -> float:  # type: ignore[override]
        """Lower bound of J for convexity in ln J: 0 if the solid's energy is convex for every J, else infinite."""
        return math.inf if self.of is None or self.of.convex_above else 0.0

    @property
    def branches(self) -> tuple[tuple[float, float], ...]:  # type: ignore[override]
        """Relaxation branches of the solid."""
        return () if self.of is None else self.of.branches

    def finite_law(self) -> Law | None:
        """Return the law of the solid; `law_for` turns it into the law of the plate."""
        return None if self.of is None else self.of.finite_law()


@dataclass(frozen=True)
class PlaneStress:
    """Plane-stress law of a solid: psi(F) is the minimum of the solid's psi over F33; the given F33 is ignored.

    P is the solid's stress at that thickness stretch, with P33 = 0. Because the stretch follows the motion (static
    condensation), dP/dF = A - A_:33 (x) A_33: / A_3333 with the solid's A.
    Source: de Borst (1991), "The zero-normal-stress condition in plane-stress and shell elastoplasticity".
    """

    solid: Law

    def opened(self, F: Array) -> Array:
        """Return F (m, 3, 3) with the thickness stretch that makes the stress across the plate zero.

        The stretch is NaN if there is none. It is found by Newton's method; each step changes it by at most a factor of
        ten.
        """
        F = F.copy()
        F[:, 2, 2] = self._initial_thickness_stretch(F)
        planar = np.full((2, len(F)), np.nan)
        if hasattr(self.solid, "principal") and not isinstance(self.solid, TwoInvariantLaw):
            planar = _planar_log_stretches(F)
        known = np.isfinite(planar).all(axis=0)
        with np.errstate(all="ignore"):
            self._find_thickness_stretches(F, np.flatnonzero(known), planar)
            self._find_thickness_stretches(F, np.flatnonzero(~known), None)
        return F

    def _find_thickness_stretches(self, F: Array, left: NDArray[np.intp], planar: Array | None) -> None:
        """Set the thickness stretch of the points `left` (k,) in F (m, 3, 3).

        `planar` (2, m) are the logarithms of the principal stretches in the plane; without them full tensors are used.
        """
        for _ in range(ITERATIONS):
            if not len(left):
                return
            solid, s = self._solid_at_points(left), F[left, 2, 2]
            if planar is None:
                stress, slope = self._transverse_stress_and_stiffness(solid, F[left])
            else:
                stress, slope = _principal_transverse_stress(solid, planar[:, left], s)
            step = -stress / slope
            F[left, 2, 2] = np.clip(s + step, LEAST * s, MOST * s)
            left = left[~(np.abs(step) <= ROUNDING * s) & ~np.isnan(step)]  # outside the domain of the law
        F[left[~self._is_transverse_stress_zero(self._solid_at_points(left), F[left])], 2, 2] = np.nan

    @staticmethod
    def _transverse_stress_and_stiffness(solid: Any, F: Array) -> tuple[Array, Array]:
        """Return P33 and dP33/dF33 (m,), Pa, of the solid; laws of two invariants give them without full tensors."""
        if not isinstance(solid, TwoInvariantLaw):
            return solid.P(F)[:, 2, 2], solid.dPdF(F)[:, 2, 2, 2, 2]
        f = components(F)
        stretch, j = shifted_invariants(f)
        (a, s), (c, d) = solid.slopes(stretch, j), solid.curvatures(stretch, j)
        along, C = f[2, 2], f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]  # C = dJ/dF33
        slope = a + d * C**2
        return a * along + s * C, slope if c is None else slope + 2.0 * c * along * C

    def _solid_at_points(self, which: Any) -> Any:
        """Return the law of the solid at the points `which`; it is the same for all unless constants vary."""
        if not any(is_array(v) for v in vars(self.solid).values()):
            return self.solid
        from softmark.solvers.materials.heterogeneous import map_arrays

        return map_arrays(self.solid, lambda a: a[which])

    @staticmethod
    def _rest_tangent(solid: Any, F: Array) -> Array:
        """Return dP/dF of a solid at rest, Pa: (1, 3, 3, 3, 3), or one per F if its constants are arrays."""
        many = len(F) if any(is_array(v) for v in vars(solid).values()) else 1
        found: Array = solid.dPdF(np.broadcast_to(np.eye(3, dtype=F.dtype), (many, 3, 3)))
        return found

    def _is_transverse_stress_zero(self, solid: Any, F: Array) -> Any:
        """Return whether the stress across the plate is rounding error (m,)."""
        A = self._rest_tangent(solid, F)[:, 2, 2, 2, 2]
        found = np.abs(solid.P(F)[:, 2, 2]) <= 100.0 * np.finfo(F.dtype).eps * A
        return found & (F[:, 2, 2] > FLAT)

    def _initial_thickness_stretch(self, F: Array) -> Array:
        """Return the initial thickness stretch for Newton's method (m,), which is exact for small strains.

        It is A^-(lam / (lam + 2 mu)) for the area ratio A.
        """
        A = self._rest_tangent(self.solid, F)
        area = F[:, 0, 0] * F[:, 1, 1] - F[:, 0, 1] * F[:, 1, 0]
        found: Array = np.maximum(area, LEAST) ** -(A[:, 2, 2, 0, 0] / A[:, 2, 2, 2, 2])
        return found

    def psi(self, F: Array) -> Array:
        """Return the energy per undeformed volume, J/m^3 (m,).

        It is +inf if no thickness stretch gives zero stress across the plate.
        """
        energy = self.solid.psi(self.opened(F))
        return np.where(np.isnan(energy), np.inf, energy)

    def P(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress, Pa (m, 3, 3)."""
        P = self.solid.P(self.opened(F))
        P[:, 2, 2] = 0.0
        return P

    def dPdF(self, F: Array) -> Array:
        """Return dP_iJ/dF_kL, Pa (m, 3, 3, 3, 3), with zeros for F33."""
        A = self.solid.dPdF(self.opened(F)).reshape(-1, 9, 9)
        A = A - A[:, :, 8:] * A[:, 8:, :] / A[:, 8:, 8:]
        A[:, 8, :] = A[:, :, 8] = 0.0
        return A.reshape(-1, 3, 3, 3, 3)

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite 9x9 matrix nearest to dPdF, Pa (m, 3, 3, 3, 3)."""
        return project(self.dPdF(F))


def _planar_log_stretches(F: Array) -> Array:
    """Return the logarithms of both principal stretches in the plane (2, m), of F (m, 3, 3).

    They are NaN at inverted points, where a stretch would be negative, and in single precision, where they are not
    accurate enough.
    """
    h = F[:, :2, :2] - np.eye(2, dtype=F.dtype)
    change = h[:, 0, 0] + h[:, 1, 1] + h[:, 0, 0] * h[:, 1, 1] - h[:, 0, 1] * h[:, 1, 0]  # area ratio - 1
    change = np.where((change > -1.0) & (F.dtype == np.float64), change, np.nan)
    E = h + h.swapaxes(1, 2) + h.swapaxes(1, 2) @ h  # F^T F - 1
    mean, half = 0.5 * (E[:, 0, 0] + E[:, 1, 1]), np.hypot(0.5 * (E[:, 0, 0] - E[:, 1, 1]), E[:, 0, 1])
    largest = 0.5 * np.log1p(mean + half)
    return np.stack([largest, np.log1p(change) - largest])


def _principal_transverse_stress(solid: Any, planar: Array, s: Array) -> tuple[Array, Array]:
    """Return P33 = tau_3 / s and dP33/dF33 (m,), Pa, of an isotropic law at a thickness stretch s (m,).

    `planar` (2, m) are the logarithms of the other two principal stretches.
    """
    _, tau, bent = solid.principal([*planar, np.log(s)])
    return tau[2] / s, (bent[2][2] - tau[2]) / (s * s)


def thickness_stretch(law: Law, F: Array) -> Array:
    """Return the thickness stretch of a plate (m,) under F (m, 3, 3); for the law of a solid, it is F33 itself."""
    found: Array = (law.opened(F) if hasattr(law, "opened") else F)[:, 2, 2]
    return found
