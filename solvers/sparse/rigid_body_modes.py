"""Rigid body modes as vectors of unknowns: the motions that an elastic body does not resist."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.solvers.energies.energy import Floats, Ints

Modes = Floats | Callable[[], Floats | None] | None  # (n, 6) modes of the unknowns, or a function that returns them


def rigid_motions(points: Floats, free: Ints) -> Floats:
    """Return the rigid body modes of points, shape (f, 6): three translations, then three rotations.

    `points` (n, 3) are the positions, and `free` (f,) the unknowns to keep, out of 3 n. Rotations are about the centre
    of the points and are divided by the size of the body, so that all columns have similar magnitude.
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
    """Return the positions of nodes (g, 3), relative to the centre and scaled, from their rigid body modes.

    `motions` (n, 6) are the modes of the unknowns, and `start` (g + 1,) the first unknown of each node. The rotation
    modes of an unknown along one axis contain the two other coordinates of its node. If no unknown of a node determines
    a coordinate, as when two axes are fixed, that coordinate is set to the centre's.
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
