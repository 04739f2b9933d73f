"""Unstable equilibria of bodies held only by contact: finds whether they move away as a rigid body or deform.

A body that stands on a point is balanced, not held: all states near that equilibrium have less energy, and load
stepping does not help. A column that buckles between two plates leaves its equilibrium too, but finds another.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats
from softmark.solvers.sparse.rigid_body_modes import rigid_motions
from softmark.solvers.statics.static_newton import Newton

WHOLE = 0.9  # of the squares of a motion are those of a body as a whole: it deforms little
LEAST = 0.1  # of the greatest part of such a motion: the middle goes along


def describe_rigid_instability(newton: Newton, x: Floats) -> str | None:
    """Return how a body leaves an unstable equilibrium x (dofs,) as a rigid body, as text; None if it deforms.

    This is the motion with the least stiffness. Raises NotConverged if no motion decreases the energy.
    """
    points, free = newton.assembly.points, newton.assembly.free
    if points is None:
        return None
    d = newton.downhill(x)[free]
    R = rigid_motions(points + x.reshape(-1, 3), free)
    by = np.asarray(np.linalg.lstsq(R, d, rcond=None)[0], dtype=np.float64)
    if float(np.sum((R @ by) ** 2)) < WHOLE * float(d @ d):
        return None
    carried, turned = by[:3], by[3:]
    if np.linalg.norm(carried) < LEAST * np.linalg.norm(turned):
        return f"it rotates away about {_direction_text(turned)}"
    return f"it slides away along {_direction_text(carried)}"


def _direction_text(motion: Floats) -> str:
    """Return a direction as text, with the sign that makes its first component of notable size positive."""
    v: Floats = motion / np.abs(motion).max()
    v = v * np.sign(v[np.flatnonzero(np.abs(v) > LEAST)[0]]) / np.linalg.norm(v)
    return f"({', '.join(f'{c:.2g}' for c in np.round(v, 2) + 0.0)})"
