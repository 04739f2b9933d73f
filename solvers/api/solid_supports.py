"""Supports of a solid: displacements prescribed at nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softmark.records import dataclass
from softmark.solvers.api.elastic_solid import Solid
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.sparse.rigid_body_modes import rigid_motions


@dataclass(frozen=True)
class Clamp:
    """Support of a solid: constrained degrees of freedom (c,) and their prescribed displacements (c,), m."""

    dofs: Ints
    values: Floats


def clamp(solid: Solid, nodes: Ints, by: tuple[float, float, float] = (0.0, 0.0, 0.0), along: str = "xyz") -> Clamp:
    """Return a support that displaces nodes (k,) by the vector `by`, m, along the axes named in `along`.

    The displacement along other axes stays free. Raises ValueError.
    """
    nodes, axes = np.asarray(nodes), sorted("xyz".find(a) for a in along)
    if not axes or axes[0] < 0 or len(set(axes)) < len(axes):
        raise ValueError(f"a clamp must hold some of x, y and z, not {along!r}")
    if nodes.dtype.kind not in "iu" or not np.isin(nodes, np.arange(len(solid.points))).all():
        raise ValueError(f"node numbers must be between 0 and {len(solid.points) - 1}")
    if not np.isfinite(by).all():
        raise ValueError(f"the displacement of a clamp must be finite, not {by}")
    dofs = (3 * np.unique(nodes)[:, None] + axes).ravel()
    return Clamp(dofs, np.tile(np.array(by, dtype=np.float64)[axes], len(dofs) // len(axes)))


def merge_clamps(solid: Solid, clamps: Sequence[Clamp], free: bool = False) -> tuple[Ints, Floats]:
    """Return the constrained degrees of freedom of all clamps, each listed once, and their displacements, m.

    Raises ValueError if two clamps prescribe different values, or if no degree of freedom is left free. Raises
    ValueError also if a rigid motion is left free, unless `free` allows it.
    """
    every = np.concatenate([np.zeros(0, dtype=np.int64), *(c.dofs for c in clamps)])
    values = np.concatenate([np.zeros(0), *(c.values for c in clamps)])
    dofs, first, back = np.unique(every, return_index=True, return_inverse=True)
    if not np.array_equal(values[first][back], values):
        raise ValueError("two clamps prescribe different displacements at one node")
    if len(dofs) == solid.points.size:
        raise ValueError("the clamps hold all nodes, so nothing can deform")
    rank = np.linalg.matrix_rank(rigid_motions(solid.points, dofs)) if len(dofs) else 0
    if rank < 6 and not free:
        raise ValueError(f"the clamps leave {6 - rank} of 6 rigid body motions free")
    return dofs, values[first]
