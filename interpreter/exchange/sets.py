"""Parts of a deck that have a name and that nothing in it asks for: they become regions of the scene, or are listed."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.exchange.record import Deck, Ints, Left, Set


def of_cells(deck: Deck, name: str, cells: Ints) -> None:
    """A set of cells (k,); that of all cells is the body, and says nothing."""
    if not len(cells):
        deck.left.append(Left(f"the set `{name[:60]}`", "none of its elements are cells of the body"))
    elif len(cells) < len(deck.cells):
        deck.named.append(Set(name, cells, faces=False))


def of_faces(deck: Deck, name: str, faces: Ints) -> None:
    """Faces (f, 2)."""
    inside = ~deck.sides.border.reshape(len(deck.cells), -1)[faces[:, 0], faces[:, 1]]
    if not len(faces) or inside.any():
        why = f"{int(inside.sum())} of its {len(faces)} faces are not of the surface of the body"
        deck.left.append(Left(f"the surface `{name[:60]}`", why))
        return
    deck.named.append(Set(name, faces, faces=True))


def of_nodes(deck: Deck, name: str, nodes: Ints) -> None:
    """A set of nodes (k,), as the faces of the surface that they are; that of all nodes is the body."""
    if len(own := np.unique(nodes)) == len(deck.points):
        return
    faces, alone = deck.sides.within(own)
    if not len(own) or len(alone):
        why = f"{len(alone)} of its {len(own)} nodes are of no face all of whose nodes it has"
        deck.left.append(Left(f"the set of nodes `{name[:60]}`", why))
        return
    deck.named.append(Set(name, faces, faces=True))
