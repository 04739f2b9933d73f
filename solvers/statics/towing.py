"""States that are started from, carried along by rigid bodies that what touches them sticks to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.clear import pushed

if TYPE_CHECKING:
    from softmark.solvers.statics.problem import Statics


def towed(problem: Statics, x: Floats) -> Floats:
    """A state x that is started from, carried on as if all that touches stuck to the rigid bodies, which have moved.

    Solves (K + C) d = C v, C the stiffness of contacts that hold on and v the way of each node with its rigid body.
    """
    assembly, way, old = problem.assembly, np.zeros_like(x), []
    for energy in assembly.loads:
        known: Any = energy
        old.append(known.towing(x, way) if energy.rubs else known.before() if energy.driven else energy)
    C = Assembly(assembly.dofs, problem.fixed, [], [e for e in old if e.driven]).tangent(x, 1.0)
    change = np.zeros_like(x)
    change[assembly.free] = -C @ way[assembly.free]
    return pushed(assembly.acting(assembly.internal, old), x, change)
