"""Laws W(t1, t2, t3) + K/2 g(J)^2 of isochoric principal stretches t = J^(-1/3) s, with W = sum w(ln t_a).

Derivatives of such laws contain quotients of differences, which lose digits and become 0/0 if two stretches are equal.
Here the quotients are functions of m = (e_a + e_b)/2 and d = (e_a - e_b)/2, e = ln t, by sinh, without case
distinction.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.hyperelastic import PLANES, Hyperelastic, add_modes
from softmark.solvers.materials.isochoric_split import IsochoricMaterial, add_volumetric_terms, volumetric_derivatives
from softmark.solvers.materials.polar_decomposition import spectrum
from softmark.solvers.materials.principal_axes_law import Principal, deviatoric_derivatives
from softmark.solvers.materials.tensor_components import (
    displacement_gradient,
    green_strain,
    product,
    transposed,
    volume_change,
)
from softmark.solvers.materials.volumetric_constraints import VolumeRatioConstraint
from softmark.solvers.runtime.scalar_or_array import expm1

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
else:
    from softmark.solvers.runtime.lazy_modules import np


class PrincipalStretchMaterial(IsochoricMaterial):
    """Base class of materials with W = w(ln t1) + w(ln t2) + w(ln t3)."""

    @abstractmethod
    def energy(self, e: Array) -> Array:
        """Return w, J/m^3, at logarithmic stretches e of any shape; w is 0 at e = 0.

        The slope of w at e = 0 is arbitrary, because the sum of e over the three axes is zero.
        """

    @abstractmethod
    def slope(self, e: Array) -> Array:
        """Return dw/de minus its value at e = 0, Pa; a constant slope would affect only the volume."""

    @abstractmethod
    def curvature(self, e: Array) -> Array:
        """Return d2w/de2, Pa."""

    @abstractmethod
    def quotient(self, m: Array, d: Array) -> Array:
        """Return (w'(m + d) - w'(m - d)) / (2 sinh d), Pa, which is the curvature at m if d = 0."""

    def with_bulk(self, modulus: Any) -> Law:
        """Return the law with the bulk modulus `modulus`, Pa."""
        return PrincipalStretchLaw(self, modulus, self.constraint)


@dataclass(frozen=True)
class PrincipalStretchLaw(Hyperelastic):
    """Law of a material of principal stretches, with bulk modulus K.

    F = U diag(s) V^T; tau_a = dpsi/d ln s_a are the principal Kirchhoff stresses. dP/dF couples the three axes by
    d2psi/ds_a ds_b. In each plane ab it has two more eigenvalues: (tau_a s_b + tau_b s_a) / (s_a s_b (s_a + s_b)) for
    the twist and (psi_a - psi_b)/(s_a - s_b), psi_a = tau_a/s_a, for the flip.
    Sources: Ogden (1984), "Non-linear elastic deformations", section 6.1; Smith, De Goes, Kim (2019), "Analytic
    eigensystems for isotropic distortion energies".
    """

    material: PrincipalStretchMaterial
    modulus: Any
    constraint: VolumeRatioConstraint

    def _psi(self, f: Array) -> Array:
        h = displacement_gradient(f)
        j = volume_change(h)
        e = np.log1p(spectrum(2.0 * green_strain(h))[0]) / 2.0
        g = self.constraint.of(j)[0]
        shape = self.material.energy(e - np.log1p(j) / 3.0).sum(axis=0)
        return np.where(j > -1.0, shape + 0.5 * self.modulus * g * g, np.inf)

    def _P(self, f: Array) -> Array:
        """Return P = F S (3, 3, m), Pa, with S the second Piola-Kirchhoff stress."""
        s, e, v, j = _principal_kinematics(f)
        return product(f, product(v * (self._kirchhoff_stresses(e, j) / (s * s)), transposed(v)))

    def _dPdF(self, f: Array, H: Array) -> None:
        self._set_tangent(f, H, False)

    def _projected(self, f: Array, H: Array) -> None:
        """Write the tangent at f (3, 3, m), with negative eigenvalues set to zero, into H (9, 9, m), upper triangle."""
        self._set_tangent(f, H, True)

    def _set_tangent(self, f: Array, H: Array, projected: bool) -> None:
        s, e, v, j = _principal_kinematics(f)
        axes, twist, flip = self._principal_tangent_blocks(s, e, j)
        if projected:
            w, q = spectrum(axes)
            axes = product(q * np.maximum(w, 0.0), transposed(q))
            twist, flip = ([np.maximum(value, 0.0) for value in each] for each in (twist, flip))
        H[...] = 0.0
        add_modes(H, product(f, v) / s, v, axes, twist, flip)

    def principal(self, e: Sequence[Any]) -> Principal:
        """Return psi, tau and d tau/de for logarithmic principal stretches e (principal_axes_law.py)."""
        v = e[0] + e[1] + e[2]
        t, j, of = [a - v / 3.0 for a in e], expm1(v), self.material
        tau, bent = deviatoric_derivatives([of.slope(a) for a in t], [of.curvature(a) for a in t])
        swelling = add_volumetric_terms(self.constraint, self.modulus, j, tau, bent)
        return sum(of.energy(a) for a in t) + swelling, tau, bent

    def _kirchhoff_stresses(self, e: Array, j: Array) -> Array:
        """Return the principal Kirchhoff stresses tau (3, m), Pa."""
        slope = self.material.slope(e)
        slope -= slope.sum(axis=0) / 3.0
        slope += self.modulus * volumetric_derivatives(self.constraint, j)[0] * (1.0 + j)
        return slope

    def _principal_tangent_blocks(self, s: Array, e: Array, j: Array) -> tuple[Array, list[Array], list[Array]]:
        """Return d2psi/ds_a ds_b (3, 3, m), and the eigenvalues of twist and flip of each plane, Pa."""
        tau, bend, J = self._kirchhoff_stresses(e, j), self.material.curvature(e), 1.0 + j
        swell, stiffen = volumetric_derivatives(self.constraint, j)
        rest = bend.sum(axis=0) / 9.0 + self.modulus * (swell * J + stiffen * J * J)
        axes = np.empty((3, *s.shape), dtype=s.dtype)
        for a in range(3):
            axes[a, a] = (bend[a] / 3.0 + rest - tau[a]) / (s[a] * s[a])
        twist, flip = [], []
        for a, b in PLANES:
            both = s[a] * s[b]
            axes[a, b] = axes[b, a] = (rest - (bend[a] + bend[b]) / 3.0) / both
            twist.append((tau[a] * s[b] + tau[b] * s[a]) / (both * (s[a] + s[b])))
            quotient = self.material.quotient(0.5 * (e[a] + e[b]), 0.5 * (e[a] - e[b])) / np.sqrt(both)
            flip.append(0.5 * ((s[a] + s[b]) * quotient - tau[a] - tau[b]) / both)
        return axes, twist, flip


def _principal_kinematics(f: Array) -> tuple[Array, Array, Array, Array]:
    """Return stretches s (3, m), ln t (3, m), the principal axes v[:, a] (3, 3, m) and J - 1 (m,); NaN if J <= 0."""
    h = displacement_gradient(f)
    j = volume_change(h)
    squares, v = spectrum(2.0 * green_strain(h))  # eigenvalues of F^T F - 1
    e = 0.5 * np.log1p(squares)
    s = np.exp(e)
    return s, e - np.log1p(np.where(j > -1.0, j, np.nan)) / 3.0, v, j
