"""Interface of a constitutive law: energy density, stress, and the derivative of the stress.

An energy sees only the `Law` of a material: functions of plain arrays over a batch of deformation gradients F = dx/dX.
To add a law, write a class with these four methods. The base class in batching.py makes it fast, and `project` serves
as `dPdF_projected` if nothing better is known.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np


class Law(Protocol):
    """Interface of a law: psi, P and dP/dF over a batch of deformation gradients F (m, 3, 3)."""

    def psi(self, F: Array) -> Array:
        """Return the energy per undeformed volume, J/m^3 (m,); +inf outside the law's domain."""
        ...

    def P(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress dpsi/dF_iJ, Pa (m, 3, 3)."""
        ...

    def dPdF(self, F: Array) -> Array:
        """Return dP_iJ/dF_kL at [i, J, k, L], Pa (m, 3, 3, 3, 3)."""
        ...

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite 9x9 matrix nearest to dPdF, Pa (m, 3, 3, 3, 3)."""
        ...


def project(dPdF: Array) -> Array:
    """Return the positive semi-definite tensors nearest to dPdF (m, 3, 3, 3, 3) in the Frobenius norm.

    Negative eigenvalues of the 9x9 matrices become zero. The function is slow, but valid for any law. dPdF has major
    symmetry; units are kept. Raises LinAlgError on NaN.
    Source: Teran et al. (2005), "Robust quasistatic finite elements and flesh simulation".
    """
    H = dPdF.reshape(-1, 9, 9)
    w, v = np.linalg.eigh(H)  # (m, 9), (m, 9, 9)
    projected = (v * np.maximum(w, 0.0)[:, None, :]) @ v.transpose(0, 2, 1)
    return np.where((w[:, 0] < 0.0)[:, None, None], projected, H).reshape(dPdF.shape)
