"""Base class of laws, which evaluates a law over blocks of the batch that fit in the processor cache.

A subclass writes `_psi`, `_P` and `_dPdF` on components f (3, 3, m) (see tensor_components.py), so that it does not
depend on the layout of the batch. Results have the precision of F.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from softmark.solvers.materials.tensor_components import components, result_dtype, write_symmetric

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

BLOCK = 4096  # matrices per block; measured: shorter rows cost calls, longer ones leave the cache


class BatchedLaw(ABC):
    """Base class of laws whose subclasses compute with the components of F, as arrays f (3, 3, m) over m points.

    The public methods take F (m, 3, 3). Outside the domain of a law, psi is +inf, and P and dPdF are NaN.
    """

    @abstractmethod
    def _psi(self, f: Array) -> Array:
        """Return the energy density (m,), J/m^3, for the components f (3, 3, m) of F."""

    @abstractmethod
    def _P(self, f: Array) -> Array:
        """Return the first Piola-Kirchhoff stress (3, 3, m), Pa, for the components f (3, 3, m) of F."""

    @abstractmethod
    def _dPdF(self, f: Array, H: Array) -> None:
        """Write dP_iJ/dF_kL, Pa, into H (9, 9, m) at [3 i + J, 3 k + L], only on and above the diagonal.

        f (3, 3, m) are the components of F.
        """

    def psi(self, F: Array) -> Array:
        """Return the energy per undeformed volume (m,), J/m^3, for deformation gradients F (m, 3, 3)."""
        out = np.empty(len(F), dtype=result_dtype(F))
        with np.errstate(all="ignore"):
            for block in _batch_slices(len(F)):
                out[block] = self._psi(components(F[block]))
        return out

    def P(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress (m, 3, 3), Pa, for deformation gradients F (m, 3, 3)."""
        out = np.empty(F.shape, dtype=result_dtype(F))
        with np.errstate(all="ignore"):
            for block in _batch_slices(len(F)):
                out[block] = self._P(components(F[block])).transpose(2, 0, 1)
        return out

    def dPdF(self, F: Array) -> Array:
        """Return dP_iJ/dF_kL at [i, J, k, L] (m, 3, 3, 3, 3), Pa, for deformation gradients F (m, 3, 3)."""
        return tensors(F, self._dPdF)


def tensors(F: Array, write: Callable[[Array, Array], None]) -> Array:
    """Return the tensors (m, 3, 3, 3, 3) that `write` computes for F (m, 3, 3).

    `write` fills the entries of H (9, 9, m) on and above the diagonal, from f (3, 3, m).
    """
    out = np.empty((len(F), 3, 3, 3, 3), dtype=result_dtype(F))
    scratch = np.empty((9, 9, min(len(F), BLOCK)), dtype=result_dtype(F))
    with np.errstate(all="ignore"):
        for block in _batch_slices(len(F)):
            H = scratch[:, :, : len(F[block])]
            write(components(F[block]), H)
            write_symmetric(H, out[block])
    return out


def _batch_slices(m: int) -> Iterator[slice]:
    """Yield slices of BLOCK entries over the batch."""
    return (slice(start, start + BLOCK) for start in range(0, m, BLOCK))
