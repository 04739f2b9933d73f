"""Points of a surface that go with its material: between nodes as well as at them."""

from __future__ import annotations

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints


@dataclass(frozen=True)
class Points:
    """x_p = sum_a N_pa x_a, `shares` N (p, a) of nodes `of` (p, a), each standing for an area A (p,), m^2."""

    of: Ints
    shares: Floats
    A: Floats
