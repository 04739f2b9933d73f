"""Rigid body modes, as vectors of unknowns: the motions that an elastic body does not resist."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints

Modes = Floats | Callable[[], Floats | None] | None  # (n, 6) rigid motions of the unknowns, or what makes them


def rigid_motions(points: Floats, free: Ints) -> Floats:
    """Return three translations and three rotations of points (n, 3) about their centre, by unknowns `free` (free, 6).

    Rotations are divided by the size of the body, so that all columns are of similar size.
    """
    x = points - points.mean(axis=0)
    x /= max(float(np.abs(x).max(initial=0.0)), np.finfo(float).tiny)
    motions = np.zeros((len(points), 3, 6))
    motions[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for axis, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        motions[:, i, 3 + axis] = -x[:, j]
        motions[:, j, 3 + axis] = x[:, i]
    found: Floats = motions.reshape(-1, 6)[free]
    return found


def positions_from_modes(motions: Floats, start: Ints) -> Floats:
    """Return positions of nodes (g, 3) from rigid motions (n, 6) of their unknowns; `start` (g + 1,) are first
    unknowns.

    An unknown along one axis rotates with the two other coordinates of its node. A coordinate that no unknown of a node
    gives, as where two are fixed, is taken from the centre.
    """
    sums, known = np.zeros((len(motions), 3)), np.zeros((len(motions), 3))
    for axis, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        for along, coordinate, sign in ((i, j, -1.0), (j, i, 1.0)):
            rows = motions[:, along] != 0.0
            sums[rows, coordinate] += sign * motions[rows, 3 + axis]
            known[rows, coordinate] += 1.0
    first = start[:-1]
    found: Floats = np.add.reduceat(sums, first) / np.maximum(np.add.reduceat(known, first), 1.0)
    return found
