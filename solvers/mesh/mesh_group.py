"""What a named part of a mesh is made of; what is done with such parts is in mesh_groups.py."""

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
    """`members` are numbers of cells (k,), faces (k, 2): a cell and the number of its side, or nodes (k, 2): a cell
    and the number of the node in it.

    `inside` of its faces lie between two cells; `foreign` are the facets (or points) of the file that are no face of
    a cell at all, and are not among the members. Supports hold a group of nodes; it has no faces and no cells.
    """

    kind: Literal["cells", "faces", "nodes"]
    members: Ints
    inside: int = 0
    foreign: int = 0

    @property
    def described(self) -> str:
        """`24 faces, 3 of them inside the body`."""
        count = len(self.members) + self.foreign
        words = f"{count} {self.kind if count != 1 else self.kind[:-1]}"
        return words + (f", {self.inside} inside the body" if self.inside else "")


Groups = Mapping[str, Group]
