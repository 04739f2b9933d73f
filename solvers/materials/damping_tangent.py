"""What of a law's stiffness damps: its stress left out, where a stiff volume would make much of a little.

Damping in proportion to a stiffness, C v = b K v, opposes rates of strain. K holds a second thing, the stress that
turns with the body, and of a nearly incompressible solid that is a pressure p = M g, which a change of volume of 1e-3
makes as large as the shear modulus. With it C hangs on volumes that the motion hardly knows of: p d2g/dx2 v pushes in
directions that shear alone resists, and iterations between state and damping part.
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
class Drag:
    """The definite tangent of psi_shape + M/2 g^2 without M g d2g/dF2 (Gauss and Newton's), of elements that have both.

    `shape` is the law of what remains, None where there is nothing; `modulus` is M, Pa.
    """

    shape: Law | None
    constraint: Constraint
    modulus: float

    def dPdF_projected(self, F: Array) -> Array:
        """The positive semi-definite tangent of the shape, and M dg/dF (x) dg/dF, Pa (m, 3, 3, 3, 3)."""
        G = self.constraint.gradient(F)
        modulus = np.reshape(self.modulus, (-1, 1, 1, 1, 1))  # one for all, or of each
        volume = modulus * np.einsum("miJ,mkL->miJkL", G, G)
        found: Array = volume if self.shape is None else self.shape.dPdF_projected(F) + volume
        return found
