"""Whether supports hold a body: rigid motions that constrained degrees of freedom leave free."""

from __future__ import annotations

import numpy as np

from softmark.solvers.energies.energy import Floats

NAMES = ("move along x", "move along y", "move along z", "turn about x", "turn about y", "turn about z")


def point_rows(points: Floats, components: tuple[int, ...]) -> Floats:
    """What the six rigid motions do to `components` of `points` (n, 3), as rows (n len(components), 6)."""
    rows = np.zeros((len(points), 3, 6))
    rows[:, :, :3] = np.eye(3)
    x, y, z = points.T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y  # omega x r
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows[:, list(components)].reshape(-1, 6)


def free_motions(rows: Floats) -> list[str]:
    """Names of the rigid motions that no row resists; empty where the body is held."""
    if len(rows) == 0:
        return list(NAMES)
    _, s, vt = np.linalg.svd(rows, full_matrices=True)
    rank = int(np.sum(s > 1e-9 * s[0]))
    if rank == 6:
        return []
    null = vt[rank:]
    share = np.linalg.norm(null, axis=0)  # how much of each basic motion is in the free space
    named = [name for name, part in zip(NAMES, share, strict=True) if part > 1 - 1e-6]
    return named or [name for name, part in zip(NAMES, share, strict=True) if part > 0.3]
