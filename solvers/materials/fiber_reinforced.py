"""Fibre-reinforced solids: a matrix and families of fibres, in terms of invariants.

psi = matrix(I1, J) + sum over families of strand(E_a) + K/2 (J - 1)^2, E_a = kappa (I1 - 3) + (1 - 3 kappa) (I4a - 1),
I4a = |F a|^2, with a the direction of a family. The fibre law (strand) is k1/(2 k2) (exp(k2 E^2) - 1), or zero if E < 0
for fibres that do not resist compression. Invariants are those of F itself, not of its isochoric part: otherwise fibres
would not be strained by their true stretch (Helfenstein et al. 2010; Nolan et al. 2014).
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic_material import (
    Anisotropic,
    dyad,
    squared_stretch_change,
    transform_direction,
)
from softmark.solvers.materials.tensor_components import (
    add_geometric_stiffness,
    add_identity,
    add_outer,
    add_tensor_cross_product,
    cofactor,
    displacement_gradient,
)
from softmark.solvers.materials.two_invariant_law import shifted_invariants

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

Onset = Annotated[
    float, "1 in (0, 0.1]", "strain over which fibres become taut; beyond it the fibre law holds unchanged"
]
ONSET = 1e-4
TAUT = 4.0 / 15.0  # fraction of k1 that fibres add to the direction-averaged shear modulus


@dataclass(frozen=True)
class FiberLaw:
    """Fibre law: psi(E) = k1/(2 k2) (exp(k2 E^2) - 1), or k1/2 E^2 with k2 = 0; `k1` in Pa.

    With an `onset` the fibres resist tension only: psi is zero if E < 0. Otherwise the tangent would jump at E = 0, so
    up to the onset the stress is a cubic that matches the formula's stress and slope at the onset. The stress never
    decreases with E.
    """

    k1: float
    k2: float
    onset: float | None = None

    def energy_and_derivatives(self, E: Array) -> tuple[Array, Array, Array]:
        """Return psi, dpsi/dE and d2psi/dE2 (m,), Pa."""
        psi, slope, curvature = self._energy_with_derivatives(E)
        if (onset := self.onset) is None:
            return psi, slope, curvature
        (whole, end, steep), t = self._energy_with_derivatives(np.array(onset)), np.clip(E / onset, 0.0, 1.0)
        b = steep * onset
        square, cube = 3.0 * end - b, b - 2.0 * end
        begun = onset * (square / 3.0 + cube / 4.0)
        far, some = onset <= E, E > 0.0
        psi = np.where(far, psi - whole + begun, onset * t**3 * (square / 3.0 + cube / 4.0 * t))
        slope = np.where(far, slope, t * t * (square + cube * t))
        return psi, slope, np.where(far, curvature, np.where(some, t * (2.0 * square + 3.0 * cube * t) / onset, 0.0))

    def _energy_with_derivatives(self, E: Array) -> tuple[Array, Array, Array]:
        x = self.k2 * E * E
        grown = np.exp(x)
        psi = 0.5 * self.k1 * (np.expm1(x) / self.k2 if self.k2 else E * E)
        return psi, self.k1 * E * grown, self.k1 * (1.0 + 2.0 * x) * grown


class FiberReinforced(Anisotropic):
    """Base class of laws of a matrix with fibres."""

    dispersion = 0.0  # kappa

    @property
    @abstractmethod
    def families(self) -> tuple[tuple[tuple[float, float], FiberLaw], ...]:
        """Fibre families: the direction (components along f and s) and the law of each."""

    @property
    def shear_coupling_law(self) -> FiberLaw | None:
        """Law of the shear I8 = F f . F s between fibres and sheets; None if there is none."""
        return None

    @abstractmethod
    def _matrix_energy_derivatives(self, stretch: Array) -> tuple[Array | float, Array | float, Array | None]:
        """Return the energy w of the matrix and its derivatives, from `stretch` = I1 - 3 (m,).

        They are w without the term -m ln J, J/m^3; 2 dw/dI1, Pa; and 4 d2w/dI1^2, Pa, or None if zero.
        """

    @property
    @abstractmethod
    def matrix_modulus(self) -> float:
        """Shear modulus of the matrix at rest, m = 2 dw/dI1, Pa."""

    @property
    def polyconvex(self) -> bool:
        """True if the energy is polyconvex: all fibres resist tension only, and there is no fibre-sheet shear term.

        The energy is then a convex function of the invariants I1 and I4a that never decreases, and the invariants are
        convex in F. Source: Schroeder and Neff (2003), "Invariant formulation of hyperelastic transverse isotropy based
        on polyconvex free energy functions".
        """
        slack = all(strand.onset is not None or strand.k1 == 0.0 for _, strand in self.families)
        return slack and (self.shear_coupling_law is None or self.shear_coupling_law.k1 == 0.0)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus of the matrix plus the contribution of taut fibres, Pa."""
        share = TAUT * (1.0 - 3.0 * self.dispersion) ** 2
        return self.matrix_modulus + share * sum(strand.k1 for _, strand in self.families)

    def _family_strains(self, f: Array, axes: Array, stretch: Array) -> list[tuple[Array, Array, FiberLaw, Array]]:
        """Return, for each family, its direction a (3, m or 1), F a (3, m), its law and its strain E (m,)."""
        h, found = displacement_gradient(f), []
        k = self.dispersion
        for (c, s), strand in self.families:
            a = c * axes[0] + s * axes[1]
            moved = transform_direction(h, a)  # F a - a
            found.append((a, moved + a, strand, k * stretch + (1.0 - 3.0 * k) * squared_stretch_change(moved, a)))
        return found

    def _fibre_sheet_shear(self, f: Array, axes: Array) -> tuple[Array, Array, Array]:
        """Return the deformed directions F f and F s (3, m) and their product I8 (m,)."""
        a, b = transform_direction(f, axes[0]), transform_direction(f, axes[1])
        return a, b, np.add.reduce(a * b, axis=0)

    def _shape_psi(self, f: Array, axes: Array) -> Array:
        stretch, j = shifted_invariants(f)
        psi = self._matrix_energy_derivatives(stretch)[0] - self.matrix_modulus * np.log1p(
            np.where(j > -1.0, j, np.nan)
        )
        for _, _, strand, E in self._family_strains(f, axes, stretch):
            psi = psi + strand.energy_and_derivatives(E)[0]
        if self.shear_coupling_law is not None:
            psi = psi + self.shear_coupling_law.energy_and_derivatives(self._fibre_sheet_shear(f, axes)[2])[0]
        return psi

    def _shape_P(self, f: Array, axes: Array) -> Array:
        stretch, j = shifted_invariants(f)
        a, k = self._matrix_energy_derivatives(stretch)[1], self.dispersion
        P = (-self.matrix_modulus / (1.0 + j)) * cofactor(f)
        for d, moved, strand, E in self._family_strains(f, axes, stretch):
            slope = strand.energy_and_derivatives(E)[1]
            a = a + 2.0 * k * slope
            P += ((2.0 * (1.0 - 3.0 * k)) * slope * moved)[:, None] * d[None]
        if self.shear_coupling_law is not None:
            x, y, I8 = self._fibre_sheet_shear(f, axes)
            slope = self.shear_coupling_law.energy_and_derivatives(I8)[1]
            P += (slope * y)[:, None] * axes[0][None] + (slope * x)[:, None] * axes[1][None]
        P += a * f
        return P

    def _set_shape(self, f: Array, axes: Array, H: Array) -> None:
        """Write delta_ik M_JL + sum psi'' G (x) G plus the matrix term into H, with G = dE/dF.

        M is the sum of the terms of all invariants I4 and I8.
        """
        stretch, j = shifted_invariants(f)
        C, rows, k = cofactor(f).reshape(9, -1), f.reshape(9, -1), self.dispersion
        _, a, c = self._matrix_energy_derivatives(stretch)
        H[...] = 0.0
        over = self.matrix_modulus / (1.0 + j)
        add_outer(H, (over / (1.0 + j)) * C, C)
        add_tensor_cross_product(H, -over * f)
        if c is not None:
            add_outer(H, c * rows, rows)
        M: Array = np.zeros((3, 3, f.shape[2]), dtype=f.dtype)
        for d, moved, strand, E in self._family_strains(f, axes, stretch):
            _, slope, curvature = strand.energy_and_derivatives(E)
            a = a + 2.0 * k * slope
            M += ((2.0 * (1.0 - 3.0 * k)) * slope) * (d[:, None] * d[None])
            G = (2.0 * (1.0 - 3.0 * k)) * dyad(moved, d)
            G = G + (2.0 * k) * rows if k else G
            add_outer(H, curvature * G, G)
        if self.shear_coupling_law is not None:
            x, y, I8 = self._fibre_sheet_shear(f, axes)
            _, slope, curvature = self.shear_coupling_law.energy_and_derivatives(I8)
            both = axes[0][:, None] * axes[1][None]
            M += slope * (both + both.swapaxes(0, 1))
            G = dyad(y, axes[0]) + dyad(x, axes[1])
            add_outer(H, curvature * G, G)
        add_identity(H, a)
        add_geometric_stiffness(H, M)
