"""Content of a result file, before its unit is known and before it is matched to a body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class ResultFile:
    """Points (n, 3) of a result file, and vectors at them (t, n, 3), by name, at `times` (t,).

    Without times, states are in the order of the file. `cells` (m, a) are of one element type, in the order of
    solvers/elements; None if there are only points or unknown elements. If there are only plane cells, they are in
    `flat`, with meshio's name of their type. `points` are undeformed according to the file; if a series moves them,
    `moved` (t, n, 3) are the moved points.
    """

    points: Floats
    fields: Mapping[str, Floats]
    cells: Ints | None = None
    kind: str | None = None  # element
    times: Floats | None = None
    moved: Floats | None = None
    left: tuple[str, ...] = ()  # descriptions of unused content, such as "scalars `p`" or "24 triangles"
    ids: Ints | None = field(default=None)  # numbers of the points in the file (n,)
    flat: tuple[str, Ints] | None = None
