"""Stiffness used for stiffness-proportional damping: the tangent without the pressure term of the volume energy.

Damping C v = b K v opposes strain rates. K also contains the stress stiffness. In a nearly incompressible solid the
pressure p = M g is as large as the shear modulus at a volume change of 1e-3. With it, C would depend on volume changes
that the motion hardly resolves: p d2g/dx2 v acts in shear directions, and iterations between state and damping diverge.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.volumetric_constraints import Constraint
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class DampingTangent:
    """Damping tangent: the definite tangent of psi_shape + M/2 g^2 without the term M g d2g/dF2 (Gauss-Newton).

    `shape` is the law without the volume energy; None if there is no such part. `modulus` is M, Pa.
    """

    shape: Law | None
    constraint: Constraint
    modulus: float

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite shape tangent plus M dg/dF (x) dg/dF, Pa (m, 3, 3, 3, 3)."""
        G = self.constraint.gradient(F)
        modulus = np.reshape(self.modulus, (-1, 1, 1, 1, 1))  # one value, or one per state
        volume = modulus * np.einsum("miJ,mkL->miJkL", G, G)
        found: Array = volume if self.shape is None else self.shape.dPdF_projected(F) + volume
        return found
