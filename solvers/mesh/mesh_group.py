"""A named group of a mesh; mesh_groups.py has the operations on groups."""

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
    """A named group of a mesh: cells, faces or nodes.

    `members` are cells (k,), faces (k, 2) as cell and side number, or nodes (k, 2) as cell and node number in the cell.
    `inside` counts the faces between two cells. `foreign` counts facets (or points) of the file that belong to no cell;
    they are not among the members. A group of nodes can be used for supports; it has no faces and no cells.
    """

    kind: Literal["cells", "faces", "nodes"]
    members: Ints
    inside: int = 0
    foreign: int = 0

    @property
    def described(self) -> str:
        """Description for messages, such as `24 faces, 3 of them inside the body`."""
        count = len(self.members) + self.foreign
        words = f"{count} {self.kind if count != 1 else self.kind[:-1]}"
        return words + (f", {self.inside} inside the body" if self.inside else "")


Groups = Mapping[str, Group]
