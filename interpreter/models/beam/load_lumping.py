"""What the nodes of a straight piece of axis carry of what acts on it: each by its linear shape function."""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats


def of_line(begin: float, end: float, stations: Floats) -> Floats:
    """What each node at stations (n,), m, has of a line between two (n,), m: integrals of its function."""
    low, high = (np.clip(s, stations[:-1], stations[1:]) for s in (begin, end))
    length, middle = high - low, 0.5 * (low + high)
    behind = length * (middle - stations[:-1]) / np.diff(stations)
    found: Floats = np.concatenate([length - behind, [0.0]]) + np.concatenate([[0.0], behind])
    return found


def of_force(s: float, force: tuple[float, float, float], stations: Floats) -> tuple[slice, Floats]:
    """The two nodes that carry a force at a station, and what each has of it (2, 3), N."""
    node = int(np.clip(np.searchsorted(stations, s, side="right") - 1, 0, len(stations) - 2))
    part = float((s - stations[node]) / (stations[node + 1] - stations[node]))
    return slice(node, node + 2), np.outer([1.0 - part, part], force)
