"""Single-precision assembly: geometry, state, stresses, forces and tangents as 32-bit numbers.

Arrays are rounded to single precision. Kernels are compiled for the types of their arguments; they sum over the nodes
of one cell in double precision.
"""

from __future__ import annotations

from copy import copy
from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import EnergySum
from softmark.solvers.energies.energy import Energy, Floats

RATIO = float(np.finfo(np.float32).eps / np.finfo(np.float64).eps)
GEOMETRY = ("dNdX", "w", "f", "p", "points", "bulk")  # fields that are numbers of the body and its loads


def round_to_single(energy: Energy) -> Energy:
    """Return an energy with its arrays of geometry, loads and moduli rounded to single precision."""
    known: Any = energy
    if isinstance(energy, EnergySum):
        return EnergySum(tuple(round_to_single(part) for part in energy.parts))
    rounded = {f.name: _round_arrays(getattr(known, f.name)) for f in fields(known) if f.name in GEOMETRY}
    found: Energy = replace(known, **rounded)
    return found


def _round_arrays(value: Any) -> Any:
    """Return an array rounded to single precision; any other value unchanged."""
    return value.astype(np.float32) if isinstance(value, np.ndarray) else value


class SingleAssembly(Assembly):
    """Assembly of energies in single precision, with the sparsity pattern of a double-precision assembly, `whole`."""

    kind: Any = np.float32
    whole: Assembly

    @classmethod
    def of(cls, whole: Assembly) -> SingleAssembly:
        """Return the assembly `whole` with its energies and loads in single precision."""
        made = cls.__new__(cls)
        made.__dict__.update(copy(whole).__dict__)
        made.whole = whole
        made.internal = tuple(round_to_single(e) for e in whole.internal)
        made.loads = tuple(round_to_single(e) for e in whole.loads)
        return made

    @cached_property
    def _largest_shape_gradient(self) -> float:
        """Largest gradient of a shape function, 1/m, which converts rounding of displacements to strain."""
        whole: list[Any] = [part for e in self.internal for part in (e.parts if isinstance(e, EnergySum) else (e,))]
        steepest = [float(np.abs(part.dNdX).max()) for part in whole if hasattr(part, "dNdX")]  # springs have none
        return max(steepest, default=0.0)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error of the gradient at x, N, due to strains and displacements."""
        noise = self.whole.rounding(x)
        return RATIO * noise * (1.0 + float(np.abs(x).max(initial=0.0)) * self._largest_shape_gradient)
