"""St Venant-Kirchhoff material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.hyperelastic import Hyperelastic
from softmark.solvers.materials.isotropic_material import Isotropic
from softmark.solvers.materials.tensor_components import (
    add_carried,
    add_diagonal,
    add_geometric_stiffness,
    add_tensor_cross_product,
    cofactor,
    displacement_gradient,
    green_strain,
    inner,
    product,
    set_outer,
    trace,
    transposed,
)
from softmark.solvers.runtime.scalar_or_array import expm1

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.principal_axes_law import Principal
    from softmark.solvers.materials.volumetric_constraints import Constraint


@dataclass(frozen=True)
class StVenantKirchhoff(Hyperelastic, Isotropic):
    """St Venant-Kirchhoff: Hooke's law between Green's strain and the second Piola-Kirchhoff stress.

    psi = lam/2 (tr E)^2 + mu tr(E^2), E = (F^T F - I)/2 P = F S, S = lam tr(E) I + 2 mu E Valid for large
    rotations with small strains. In compression it softens and collapses: the uniaxial stress has its maximum
    at a stretch of 1/sqrt(3), and no energy barrier keeps elements from inverting.
    Source: Ciarlet, "Mathematical Elasticity I" (1988), chapters 3 and 4.
    """

    def finite_parts(self) -> tuple[Law, Law] | None:
        """Return the shear part and the volume part; the energy is linear in the two moduli."""
        return _Shear(**vars(self)), _Volume(**vars(self))

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """Return the shape law, with `local_lambda` for lam, and the volume constraint."""
        from softmark.solvers.materials.volumetric_constraints import GreenDilatation

        return _Shape(**vars(self)), GreenDilatation()

    def _psi(self, f: Array) -> Array:
        E = green_strain(displacement_gradient(f))
        tr = trace(E)
        return 0.5 * self.lame_lambda * tr * tr + self.shear_modulus * inner(E, E)

    def _P(self, f: Array) -> Array:
        return product(f, self._S(f))

    def _dPdF(self, f: Array, H: Array) -> None:
        """Write delta_ik S_JL + lam F_iJ F_kL + mu F_iL F_kJ + mu (F F^T)_ik delta_JL (see add_cross)."""
        mu, lam = self.shear_modulus, self.lame_lambda
        rows = f.reshape(9, -1)
        set_outer(H, rows, (lam + mu) * rows)
        add_tensor_cross_product(H, -mu * cofactor(f))
        add_carried(H, mu * product(f, transposed(f)))
        add_geometric_stiffness(H, self._S(f))

    def principal(self, e: Sequence[Any]) -> Principal:
        """Return psi, tau and d tau/de for logarithmic principal stretches e (principal_axes_law.py)."""
        mu, lam = self.shear_modulus, self.lame_lambda
        E = [0.5 * expm1(2.0 * a) for a in e]
        tr = E[0] + E[1] + E[2]
        own = [1.0 + 2.0 * a for a in E]  # squares of stretches
        tau = [s * (lam * tr + 2.0 * mu * a) for s, a in zip(own, E, strict=True)]
        bent = [[lam * s * other for other in own] for s in own]
        for a in range(3):
            bent[a][a] = bent[a][a] + 2.0 * (tau[a] + mu * own[a] * own[a])
        return 0.5 * lam * tr * tr + mu * sum(a * a for a in E), tau, bent

    def _S(self, f: Array) -> Array:
        """Return the second Piola-Kirchhoff stress lam tr(E) I + 2 mu E (3, 3, m)."""
        E = green_strain(displacement_gradient(f))
        pressure = self.lame_lambda * trace(E)
        return add_diagonal(2.0 * self.shear_modulus * E, pressure)


class _Shear(StVenantKirchhoff):
    """The part of the law proportional to mu."""

    volume_share = 0.0


class _Volume(StVenantKirchhoff):
    """The part of the law proportional to lam."""

    shear_share = 0.0


class _Shape(StVenantKirchhoff):
    """The law without the volume energy that a separate pressure carries."""

    @property
    def lame_lambda(self) -> float:
        """Part of the modulus that stays in the point-wise law, Pa."""
        return self.local_lambda
