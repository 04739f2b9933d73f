"""Small-strain law in the fixed frame, valid for small rotations only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.solvers.materials.batching import BatchedLaw
from softmark.solvers.materials.tensor_components import add_diagonal, displacement_gradient, inner, trace, transposed

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class SmallStrain(BatchedLaw):
    """Small-strain energy: mu eps : eps + lam/2 (tr eps)^2, with eps = (F + F^T)/2 - I.

    mu and lam are the moduli at rest, Pa. P = 2 mu eps + lam tr(eps) I. It is not objective: a rotation by th gives
    eps_xx = cos th - 1.
    Source: Timoshenko, Goodier, "Theory of Elasticity", chapter 1.
    """

    mu: float
    lam: float

    def _psi(self, f: Array) -> Array:
        eps = _small_strain(f)
        tr = trace(eps)
        return self.mu * inner(eps, eps) + 0.5 * self.lam * tr * tr

    def _P(self, f: Array) -> Array:
        eps = _small_strain(f)
        pressure = self.lam * trace(eps)
        return add_diagonal(2.0 * self.mu * eps, pressure)

    def _dPdF(self, f: Array, H: Array) -> None:
        H[...] = hooke(self.mu, self.lam).reshape(9, 9, -1)

    def dPdF_projected(self, F: Array) -> Array:
        """Return dPdF itself, Pa (m, 3, 3, 3, 3): eigenvalues 2 mu, 2 mu + 3 lam > 0, and 0 for rotations."""
        return self.dPdF(F)


def hooke(mu: float, lam: float) -> Array:
    """Return the elasticity tensor of Hooke's law, Pa, (3, 3, 3, 3), or (3, 3, 3, 3, n) for moduli (n,).

    It is mu (delta_ik delta_JL + delta_iL delta_kJ) + lam delta_iJ delta_kL.
    """
    d = np.eye(3)
    pairs = d[:, None, :, None] * d[None, :, None, :]  # delta_ik delta_JL
    shear, volume = pairs + pairs.swapaxes(2, 3), d[:, :, None, None] * d
    if np.ndim(mu) or np.ndim(lam):
        shear, volume = shear[..., None], volume[..., None]
    return mu * shear + lam * volume


def _small_strain(f: Array) -> Array:
    """Return the small strain eps (3, 3, m)."""
    h = displacement_gradient(f)
    return 0.5 * (h + transposed(h))
