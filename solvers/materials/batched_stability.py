"""What is asked of a law at many states, such as whether it is stable there: law by law, and a block at a time.

States come as deformation gradients F (m, 3, 3), and what is found is of each of them (m,), or None where it is not
known.
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
STIFF = 1e6  # times the rest of the law: what holds a volume that must be kept
BLOCK = 4096  # points at a time


@dataclass(frozen=True, eq=False)
class Held:
    """What holds the volume beside a law: pressures (m,), Pa, on a constraint, and its modulus, infinite or of each."""

    constraint: Constraint
    modulus: Any
    pressure: Array

    def of(self, some: slice | NDArray[np.intp]) -> Held:
        """The same of some of the states."""
        own = self.modulus[some] if np.ndim(self.modulus) else self.modulus
        return Held(self.constraint, own, self.pressure[some])


def law_by_law(look: Callable[[Any, Array, Held | None], Bools | None], law: Any, F: Array,
               held: Held | None) -> Bools | None:  # fmt: skip
    """What `look` finds: of a plate with the law of its solid, of constants that vary with those of each block."""
    if hasattr(law, "solid"):  # of a plate (plane_stress.py)
        return law_by_law(look, law.solid, law.opened(F), None)
    if not hasattr(law, "at_rest"):
        return look(law, F, held)
    found = np.zeros(len(F), dtype=np.bool_)
    for some, own in law._blocks(len(F)):  # of constants that vary (heterogeneous.py)
        part = law_by_law(look, own, F[some], None if held is None else held.of(some))
        if part is None:
            return None
        found[some] = part
    return found


def in_blocks(look: Callable[[Any, Array, Held | None], Bools], law: Any, F: Array, held: Held | None) -> Bools:
    """What `look` finds of one law; numbers may end there."""
    found = np.zeros(len(F), dtype=np.bool_)
    with np.errstate(all="ignore"):
        for start in range(0, len(F), BLOCK):
            some = slice(start, start + BLOCK)
            found[some] = look(law, F[some], None if held is None else held.of(some))
    return found
