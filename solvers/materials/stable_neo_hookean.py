"""Stable neo-Hookean material of computer graphics: finite energy and forces for every F."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.hyperelastic import Hyperelastic
from softmark.solvers.materials.isotropic_material import Isotropic
from softmark.solvers.materials.tensor_components import (
    add_identity,
    add_outer,
    add_tensor_cross_product,
    cofactor,
    displacement_gradient,
    inner,
    set_outer,
    volume_change,
)
from softmark.solvers.materials.two_invariant_law import shifted_invariants
from softmark.solvers.runtime.scalar_or_array import expm1, log1p

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.principal_axes_law import Principal
    from softmark.solvers.materials.volumetric_constraints import Constraint


@dataclass(frozen=True)
class StableNeoHookean(Hyperelastic, Isotropic):
    """Stable neo-Hookean rubber for simulators: defined for every deformation, including inverted elements.

    psi = m/2 (I1 - 3) + l/2 (J - a)^2 - m/2 ln((I1 + 1)/4) - l/2 (1 - a)^2, I1 = tr F^T F, J = det F P = m (1 -
    1/(I1 + 1)) F + l (J - a) cof F with m = 4 mu/3, l = lam + 5 mu/6 and a = 1 + 3m/4l, where mu and lam are
    the small-strain moduli. The undeformed state is free of stress and has the stiffness of Hooke's law.
    Without the barrier of ln J, elements can invert under load, and recover when it is removed.
    Source: Smith, De Goes, Kim (2018), "Stable Neo-Hookean Flesh Simulation", ACM Trans. Graph. 37(2):12, section 3.
    """

    polyconvex = True

    def finite_parts(self) -> tuple[Law, Law] | None:
        """Return the shear part and the volume part lam/2 (J - 1)^2; the energy is linear in the two moduli."""
        return _Shear(**vars(self)), _Volume(**vars(self))

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """Return the shape law, with `local_lambda` for lam, and the volume constraint."""
        from softmark.solvers.materials.volumetric_constraints import VolumeRatio

        return _Shape(**vars(self)), VolumeRatio()

    @property
    def _energy_moduli(self) -> tuple[float, float]:
        """Moduli m and l, Pa; l (J - a) = l (J - 1) - 3m/4."""
        return 4.0 / 3.0 * self.shear_modulus, self.lame_lambda + 5.0 / 6.0 * self.shear_modulus

    def _psi(self, f: Array) -> Array:
        psi: Array = self._energy(*shifted_invariants(f))
        return psi

    def _P(self, f: Array) -> Array:
        m, l = self._energy_moduli
        stretch, j = shifted_invariants(f)
        # 3/4 m (F - cof F), zero at rest, is computed separately from terms of higher order
        P = (l * j) * cofactor(f)
        P += 0.75 * m * (f - cofactor(f))
        P += (0.25 * m * stretch / (stretch + 4.0)) * f
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        """Write m (1 - 1/(I1 + 1)) 1 + 2m/(I1 + 1)^2 F (x) F + l C (x) C + l (J - a) dC/dF, C = cof F."""
        m, l = self._energy_moduli
        rows, C = f.reshape(9, -1), cofactor(f).reshape(9, -1)
        more = inner(f, f) + 1.0
        set_outer(H, C, l * C)
        add_outer(H, rows, 2.0 * m / more**2 * rows)
        add_tensor_cross_product(H, (l * volume_change(displacement_gradient(f)) - 0.75 * m) * f)
        add_identity(H, m * (1.0 - 1.0 / more))

    def principal(self, e: Sequence[Any]) -> Principal:
        """Return psi, tau and d tau/de for logarithmic principal stretches e (principal_axes_law.py)."""
        m, l = self._energy_moduli
        x, j = [expm1(2.0 * a) for a in e], expm1(e[0] + e[1] + e[2])
        stretch, J, own = x[0] + x[1] + x[2], 1.0 + j, [1.0 + a for a in x]
        more, soft = 0.25 * m * stretch / (stretch + 4.0), 2.0 * m / (stretch + 4.0) ** 2
        tau = [0.75 * m * (a - j) + more * s + l * j * J for a, s in zip(x, own, strict=True)]
        bent = [[soft * s * other + (l * (J + j) - 0.75 * m) * J for other in own] for s in own]
        for a in range(3):
            bent[a][a] = bent[a][a] + 2.0 * (0.75 * m + more) * own[a]
        return self._energy(stretch, j), tau, bent

    def _energy(self, stretch: Any, j: Any) -> Any:
        """Return psi, J/m^3, from I1 - 3 and J - 1."""
        m, l = self._energy_moduli
        return 0.5 * m * (stretch - log1p(0.25 * stretch)) + j * (0.5 * l * j - 0.75 * m)


class _Shear(StableNeoHookean):
    """The part of the law proportional to mu."""

    volume_share = 0.0


class _Volume(StableNeoHookean):
    """The part of the law proportional to lam."""

    shear_share = 0.0


class _Shape(StableNeoHookean):
    """The law without the volume energy that a separate pressure carries."""

    @property
    def lame_lambda(self) -> float:
        """Part of the modulus that stays in the point-wise law, Pa."""
        return self.local_lambda
