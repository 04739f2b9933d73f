"""A force on one node of a rod, as textbooks load their beams."""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.geometrically_exact_rod import RodForces


def concentrated(rest: Floats, node: int, force: Floats) -> RodForces:
    """`force` (3,) in N on one node of a rod whose undeformed state is `rest` (7n,)."""
    forces = np.zeros((rest.size // 7, 3))
    forces[node] = force
    return RodForces(rest, forces)
