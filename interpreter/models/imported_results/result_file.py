"""What a file of results tells, as it has it: no unit is known yet, and nothing is matched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Told:
    """Points (n, 3) and vectors at them by name (t, n, 3), at `times` (t,) or in order where the file has none.

    `cells` (m, a) of one kind of element, in the order of solvers/elements, None of points alone, or where no element
    of ours is theirs. Where there are plane cells alone, `flat` are those, with meshio's word for them. `points` are
    undeformed as the file says; where a series moves them, `moved` (t, n, 3) are they.
    """

    points: Floats
    fields: Mapping[str, Floats]
    cells: Ints | None = None
    kind: str | None = None  # element
    times: Floats | None = None
    moved: Floats | None = None
    left: tuple[str, ...] = ()  # what else it has, in words: "scalars `p`", "24 triangles"
    ids: Ints | None = field(default=None)  # the file's own numbers of the points (n,)
    flat: tuple[str, Ints] | None = None
