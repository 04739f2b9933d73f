"""Distribution of loads to the nodes of a straight axis by linear shape functions."""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats


def lump_line(begin: float, end: float, stations: Floats) -> Floats:
    """Return the integrals (n,), m, of nodal shape functions over a line between two stations.

    `stations` (n,), m, are the nodes.
    """
    low, high = (np.clip(s, stations[:-1], stations[1:]) for s in (begin, end))
    length, middle = high - low, 0.5 * (low + high)
    behind = length * (middle - stations[:-1]) / np.diff(stations)
    found: Floats = np.concatenate([length - behind, [0.0]]) + np.concatenate([[0.0], behind])
    return found


def lump_force(s: float, force: tuple[float, float, float], stations: Floats) -> tuple[slice, Floats]:
    """Return the two nodes that carry a force at a station s, m, and the part of the force on each (2, 3), N."""
    node = int(np.clip(np.searchsorted(stations, s, side="right") - 1, 0, len(stations) - 2))
    part = float((s - stations[node]) / (stations[node + 1] - stations[node]))
    return slice(node, node + 2), np.outer([1.0 - part, part], force)
