"""The base of the laws here: runs a law over blocks of the batch that stay in the processor's cache.

A subclass writes `_psi`, `_P` and `_dPdF` on components f (3, 3, m) (see tensor_components.py) and never sees how
the batch is cut or laid out. What it computes is of the precision of F.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from softmark.solvers.materials.tensor_components import components, precision, write_symmetric

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

BLOCK = 4096  # matrices; measured: shorter rows cost calls, longer ones leave the cache


class Blockwise(ABC):
    """psi, P, dPdF of a law written on components; outside its domain psi is +inf, P and dPdF are NaN."""

    @abstractmethod
    def _psi(self, f: Array) -> Array:
        """Energy density (m,) of f (3, 3, m)."""

    @abstractmethod
    def _P(self, f: Array) -> Array:
        """Stress (3, 3, m) of f (3, 3, m)."""

    @abstractmethod
    def _dPdF(self, f: Array, H: Array) -> None:
        """Writes dP_iJ/dF_kL into H (9, 9, m) at [3 i + J, 3 k + L], on and above the diagonal."""

    def psi(self, F: Array) -> Array:
        """Energy per volume at rest, J/m^3 (m,)."""
        out = np.empty(len(F), dtype=precision(F))
        with np.errstate(all="ignore"):
            for block in _blocks(len(F)):
                out[block] = self._psi(components(F[block]))
        return out

    def P(self, F: Array) -> Array:
        """First Piola-Kirchhoff stress, Pa (m, 3, 3)."""
        out = np.empty(F.shape, dtype=precision(F))
        with np.errstate(all="ignore"):
            for block in _blocks(len(F)):
                out[block] = self._P(components(F[block])).transpose(2, 0, 1)
        return out

    def dPdF(self, F: Array) -> Array:
        """dP_iJ/dF_kL at [i, J, k, L], Pa (m, 3, 3, 3, 3)."""
        return tensors(F, self._dPdF)


def tensors(F: Array, write: Callable[[Array, Array], None]) -> Array:
    """(m, 3, 3, 3, 3) from `write`, which fills the upper triangle H (9, 9, m) for components f (3, 3, m)."""
    out = np.empty((len(F), 3, 3, 3, 3), dtype=precision(F))
    scratch = np.empty((9, 9, min(len(F), BLOCK)), dtype=precision(F))
    with np.errstate(all="ignore"):
        for block in _blocks(len(F)):
            H = scratch[:, :, : len(F[block])]
            write(components(F[block]), H)
            write_symmetric(H, out[block])
    return out


def _blocks(m: int) -> Iterator[slice]:
    """The batch in pieces of BLOCK."""
    return (slice(start, start + BLOCK) for start in range(0, m, BLOCK))
