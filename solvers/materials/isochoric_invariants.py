"""Laws W(i, k) + K/2 g(J)^2 of the isochoric invariants i = J^(-2/3) I1 - 3 and k = J^(-4/3) I2 - 3."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.hyperelastic import Hyperelastic
from softmark.solvers.materials.isochoric_split import IsochoricMaterial, add_volumetric_terms, volumetric_derivatives
from softmark.solvers.materials.principal_axes_law import Principal, add_symmetric_dyad, deviatoric_derivatives
from softmark.solvers.materials.tensor_components import (
    add_carried,
    add_diagonal,
    add_geometric_stiffness,
    add_identity,
    add_outer,
    add_tensor_cross_product,
    cofactor,
    displacement_gradient,
    inner,
    product,
    set_outer,
    trace,
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

Number = Any  # one value, or one per point (m,)


class IsochoricInvariantMaterial(IsochoricMaterial):
    """Base class of materials with energy W(i, k) of isochoric invariants (see the module docstring).

    A derivative by an invariant that W does not contain is None.
    """

    second = True  # whether W depends on k

    @property
    def convex(self) -> bool:
        """True if W depends on i only, and is convex and increasing.

        The energy is then polyconvex. Terms in k are not polyconvex.
        Source: Hartmann and Neff (2003), Int. J. Solids Struct. 40:2767.
        """
        return not self.second

    @property
    def is_log_convex(self) -> bool:
        """True if W is convex in logarithmic stretches, because it is convex and increasing in i.

        i is a sum of exponentials of logarithmic stretches.
        """
        return self.convex

    @abstractmethod
    def energy(self, i: Array, k: Array) -> Array:
        """Return W (m,), J/m^3, for i and k (m,), which are both 0 at rest; +inf outside the domain of W."""

    @abstractmethod
    def slopes(self, i: Array, k: Array) -> tuple[Number, Number]:
        """Return dW/di and dW/dk, Pa; NaN outside the domain."""

    @abstractmethod
    def curvatures(self, i: Array, k: Array) -> tuple[Number, Number, Number]:
        """Return d2W/di2, d2W/di dk and d2W/dk2, Pa."""

    def with_bulk(self, modulus: Any) -> Law:
        """Return the law with the bulk modulus `modulus`, Pa."""
        return IsochoricInvariantLaw(self, modulus, self.constraint)


@dataclass(frozen=True)
class IsochoricInvariantLaw(Hyperelastic):
    """Law of a material with W(i, k) and bulk modulus K.

    With B = I1 F - F F^T F = dI2/dF / 2 and C = cof F = dJ/dF at each point, di/dF = 2 x with x = J^(-2/3) F - (i +
    3)/(3 J) C, and dk/dF = 2 y with y = J^(-4/3) B - 2 (k + 3)/(3 J) C.
    Source: Holzapfel (2000), "Nonlinear Solid Mechanics", section 6.4.
    """

    material: IsochoricInvariantMaterial
    modulus: Number
    constraint: VolumeRatioConstraint

    def _psi(self, f: Array) -> Array:
        i, k, j = self._isochoric_invariants(f)
        g = self.constraint.of(j)[0]
        return np.where(j > -1.0, self.material.energy(i, k) + 0.5 * self.modulus * g * g, np.inf)

    def _P(self, f: Array) -> Array:
        i, k, j = self._isochoric_invariants(f)
        first, second = self.material.slopes(i, k)
        J = 1.0 + j
        a, s = 2.0 * first * J ** (-2.0 / 3.0), self.modulus * volumetric_derivatives(self.constraint, j)[0]
        s = s - 2.0 * first * (1.0 + i / 3.0) / J
        P: Array = a * f
        if second is not None:
            P += (2.0 * second * J ** (-4.0 / 3.0)) * _half_i2_gradient(f)
            s = s - 4.0 * second * (1.0 + k / 3.0) / J
        P += s * cofactor(f)
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        i, k, j = self._isochoric_invariants(f)
        J, C, rows = 1.0 + j, cofactor(f), f.reshape(9, -1)
        first, second = self.material.slopes(i, k)
        swell, stiffen = volumetric_derivatives(self.constraint, j)
        a, third = 2.0 * first * J ** (-2.0 / 3.0), (1.0 + i / 3.0) / J
        s, d = self.modulus * swell - 2.0 * first * third, self.modulus * stiffen + 10.0 / 3.0 * first * third / J
        cofs = C.reshape(9, -1)
        mixed = (-2.0 / 3.0 * a / J) * rows  # right factor of C, and by symmetry its left factor
        if second is not None:
            b, more = 2.0 * second * J ** (-4.0 / 3.0), (1.0 + k / 3.0) / J
            B = _half_i2_gradient(f)
            s, d = s - 4.0 * second * more, d + 28.0 / 3.0 * second * more / J
            mixed += (-4.0 / 3.0 * b / J) * B.reshape(9, -1)
        set_outer(H, cofs, d * cofs + mixed)
        add_outer(H, mixed, cofs)
        turned = s * f
        if second is not None:
            turned += b * C
            add_outer(H, b * rows, rows)
            add_geometric_stiffness(H, -b * product(transposed(f), f))
            add_carried(H, -b * product(f, transposed(f)))
            a = a + b * inner(f, f)
        add_tensor_cross_product(H, turned)
        add_identity(H, a)
        x = (J ** (-2.0 / 3.0) * f - third * C).reshape(9, -1)
        y = None if second is None else (J ** (-4.0 / 3.0) * B - (2.0 * more) * C).reshape(9, -1)
        self._add_invariant_curvatures(H, self.material.curvatures(i, k), x, y)

    def principal(self, e: Sequence[Number]) -> Principal:
        """Return psi, tau and d tau/de for logarithmic principal stretches e (principal_axes_law.py)."""
        v = e[0] + e[1] + e[2]
        t, j = [a - v / 3.0 for a in e], expm1(v)
        x = [expm1(2.0 * a) for a in t]
        y = [expm1(-2.0 * a) for a in t] if self.material.second else x
        i, k = x[0] + x[1] + x[2], y[0] + y[1] + y[2]
        first, second = self.material.slopes(i, k)
        ii, ik, kk = self.material.curvatures(i, k)
        slopes, bends = [2.0 * first * a for a in x], [4.0 * first * (1.0 + a) for a in x]
        if second is not None:
            slopes = [s - 2.0 * second * b for s, b in zip(slopes, y, strict=True)]
            bends = [s + 4.0 * second * (1.0 + b) for s, b in zip(bends, y, strict=True)]
        tau, bent = deviatoric_derivatives(slopes, bends)
        X = [2.0 * (a - i / 3.0) for a in x]
        if ii is not None:
            add_symmetric_dyad(bent, ii, X, X)
        if second is not None and (ik is not None or kk is not None):
            Y = [2.0 * (k / 3.0 - b) for b in y]
            add_symmetric_dyad(bent, 0.0 if ik is None else 2.0 * ik, X, Y)
            add_symmetric_dyad(bent, 0.0 if kk is None else kk, Y, Y)
        swelling = add_volumetric_terms(self.constraint, self.modulus, j, tau, bent)
        return self.material.energy(i, k) + swelling, tau, bent

    @staticmethod
    def _add_invariant_curvatures(
        H: Array, curvatures: tuple[Number, Number, Number], x: Array, y: Array | None
    ) -> None:
        """Add H += 4 (W_ii x (x) x + W_ik (x (x) y + y (x) x) + W_kk y (x) y)."""
        ii, ik, kk = curvatures
        if ii is not None:
            add_outer(H, 4.0 * ii * x, x)
        if y is not None and ik is not None:
            add_outer(H, 4.0 * ik * x, y)
            add_outer(H, 4.0 * ik * y, x)
        if y is not None and kk is not None:
            add_outer(H, 4.0 * kk * y, y)

    def _isochoric_invariants(self, f: Array) -> tuple[Array, Array, Array]:
        """Return i, k and J - 1 (m,), without cancellation; k is i if the law does not use it."""
        h = displacement_gradient(f)
        first, j = 2.0 * trace(h) + inner(h, h), volume_change(h)
        log = np.log1p(j)
        i = first + np.expm1(-2.0 / 3.0 * log) * (first + 3.0)
        if not self.material.second:
            return i, i, j
        g = add_diagonal(cofactor(h) - transposed(h), trace(h))  # cof F - 1
        more = 2.0 * trace(g) + inner(g, g)
        return i, more + np.expm1(-4.0 / 3.0 * log) * (more + 3.0), j


def _half_i2_gradient(f: Array) -> Array:
    """Return B = I1 F - F F^T F (3, 3, m): half of dI2/dF."""
    found: Array = inner(f, f) * f
    found -= product(f, product(transposed(f), f))
    return found
