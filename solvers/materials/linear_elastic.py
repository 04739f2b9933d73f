"""Linear elastic (Hooke) material."""

from __future__ import annotations

from softmark.records import dataclass
from softmark.solvers.materials.isotropic_material import Isotropic


@dataclass(frozen=True)
class LinearElastic(Isotropic):
    """Hooke's law: stress proportional to strain.

    sigma = 2 mu eps + lam tr(eps) I. The law is not defined for finite strain. Use it only in models with small strain:
    in the fixed frame (`strain = small`) or in the frame that rotates with the material (`strain = corotational`).
    Valid for strains up to a few per cent.
    Source: Timoshenko, Goodier, "Theory of Elasticity", chapter 1.
    """
