"""Instability of bodies held only by contact: finds whether they move away as a rigid body or deform.

A body that stands on a point is balanced but not held: all neighbouring states have less energy, and load stepping does
not help. A column that buckles between two plates also leaves its equilibrium, but it finds another one.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats
from softmark.solvers.sparse.rigid_body_modes import rigid_motions
from softmark.solvers.statics.static_newton import Newton

WHOLE = 0.9  # least part of the squared motion that is rigid, for a rigid motion
LEAST = 0.1  # of the largest component: least translation that is named


def describe_rigid_instability(newton: Newton, x: Floats) -> str | None:
    """Return a text that describes how a body leaves an unstable equilibrium x (dofs,) as a rigid body.

    The motion is the one with the least stiffness. Returns None if the body deforms instead. Raises NotConverged if no
    motion decreases the energy.
    """
    points, free = newton.assembly.points, newton.assembly.free
    if points is None:
        return None
    d = newton.softest_direction(x)[free]
    R = rigid_motions(points + x.reshape(-1, 3), free)
    by = np.asarray(np.linalg.lstsq(R, d, rcond=None)[0], dtype=np.float64)
    if float(np.sum((R @ by) ** 2)) < WHOLE * float(d @ d):
        return None
    carried, turned = by[:3], by[3:]
    if np.linalg.norm(carried) < LEAST * np.linalg.norm(turned):
        return f"it rotates away about {_format_direction(turned)}"
    return f"it slides away along {_format_direction(carried)}"


def _format_direction(motion: Floats) -> str:
    """Return a direction as text, with the sign that makes its first component of notable size positive."""
    v: Floats = motion / np.abs(motion).max()
    v = v * np.sign(v[np.flatnonzero(np.abs(v) > LEAST)[0]]) / np.linalg.norm(v)
    return f"({', '.join(f'{c:.2g}' for c in np.round(v, 2) + 0.0)})"
