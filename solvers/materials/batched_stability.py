"""Evaluation of stability criteria at many states, for each kind of law and in blocks.

States are deformation gradients F (m, 3, 3). A result has one entry per state (m,), or is None if it is unknown. The
argument `look` is the function that evaluates the criterion. `held` is the volume constraint with its pressure, if the
law has one in addition.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array
    from softmark.solvers.materials.volumetric_constraints import Constraint

Bools = NDArray[np.bool_]
STIFF = 1e6  # penalty for incompressibility, relative to the rest of the law
BLOCK = 4096  # points per block


@dataclass(frozen=True, eq=False)
class VolumePressure:
    """Volume constraint that acts in addition to a law, with its pressures at m states.

    `pressure` is (m,), Pa, and `modulus` the modulus of the constraint, Pa, one or one per state, which may be
    infinite.
    """

    constraint: Constraint
    modulus: Any
    pressure: Array

    def of(self, some: slice | NDArray[np.intp]) -> VolumePressure:
        """Return the constraint at the states `some`."""
        own = self.modulus[some] if np.ndim(self.modulus) else self.modulus
        return VolumePressure(self.constraint, own, self.pressure[some])


def evaluate_by_law(look: Callable[[Any, Array, VolumePressure | None], Bools | None], law: Any, F: Array,
               held: VolumePressure | None) -> Bools | None:  # fmt: skip
    """Return the results of the criterion `look` at the states F (m, 3, 3), for any kind of law.

    For a plate it uses the law of the solid with the thickness stretch of the plate. For a law whose constants differ
    from point to point it uses blocks with their own constants. `held` is the additional volume constraint, or None.
    """
    if hasattr(law, "solid"):  # a plate (plane_stress.py)
        return evaluate_by_law(look, law.solid, law.opened(F), None)
    if not hasattr(law, "at_rest"):
        return look(law, F, held)
    found = np.zeros(len(F), dtype=np.bool_)
    for some, own in law._blocks_with_laws(len(F)):  # varying constants (heterogeneous.py)
        part = evaluate_by_law(look, own, F[some], None if held is None else held.of(some))
        if part is None:
            return None
        found[some] = part
    return found


def evaluate_in_blocks(
    look: Callable[[Any, Array, VolumePressure | None], Bools], law: Any, F: Array, held: VolumePressure | None
) -> Bools:
    """Return the results of the criterion `look` at the states F (m, 3, 3) of one law, evaluated in blocks.

    `held` is the additional volume constraint, or None. Floating-point errors are ignored.
    """
    found = np.zeros(len(F), dtype=np.bool_)
    with np.errstate(all="ignore"):
        for start in range(0, len(F), BLOCK):
            some = slice(start, start + BLOCK)
            found[some] = look(law, F[some], None if held is None else held.of(some))
    return found
