"""A named part of a mesh; operations on such parts are in mesh_groups.py."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """Members of a named part: cells (k,), faces (k, 2) as cell and side number, or nodes (k, 2) as cell and node
    number.

    `inside` counts faces between two cells; `foreign` counts facets (or points) of the file that belong to no cell, and
    are not among the members. Supports can hold a group of nodes; it has no faces and no cells.
    """

    kind: Literal["cells", "faces", "nodes"]
    members: Ints
    inside: int = 0
    foreign: int = 0

    @property
    def described(self) -> str:
        """Description, as in `24 faces, 3 of them inside the body`."""
        count = len(self.members) + self.foreign
        words = f"{count} {self.kind if count != 1 else self.kind[:-1]}"
        return words + (f", {self.inside} inside the body" if self.inside else "")


Groups = Mapping[str, Group]
