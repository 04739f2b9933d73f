"""What pieces of a body do to each other counted once more, for the watchdog, as beds are (bed_check.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.pairing import pairs_on

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared import Moved
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.checks.solids import Floats


def of_pairs(case: Case, mesh: Moved, u: Floats) -> dict[str, Floats]:
    """Forces on the nodes (n, 3), N, of every contact of the body with itself and of every tie, by its name."""
    found = {}
    for name, pair in pairs_on(case, mesh.mesh).items():
        g = np.zeros(u.size)
        pair.add_gradient(u.ravel(), g)
        found[name] = -g.reshape(-1, 3)
    return found
