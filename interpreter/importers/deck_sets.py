"""Parts of a deck that have a name and that nothing in it asks for: they become regions of the scene, or are listed."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.importers.imported_deck import Deck, Ints, Left, Set


def of_cells(deck: Deck, name: str, cells: Ints) -> None:
    """A set of cells (k,); that of all cells is the body, and says nothing."""
    if not len(cells):
        deck.left.append(Left(f"the set `{name[:60]}`", "none of its elements are cells of the body"))
    elif len(cells) < len(deck.cells):
        deck.named.append(Set(name, cells, "cells"))


def of_faces(deck: Deck, name: str, faces: Ints) -> None:
    """Faces (f, 2)."""
    inside = ~deck.sides.border.reshape(len(deck.cells), -1)[faces[:, 0], faces[:, 1]]
    if not len(faces) or inside.any():
        why = f"{int(inside.sum())} of its {len(faces)} faces are not of the surface of the body"
        deck.left.append(Left(f"the surface `{name[:60]}`", why))
        return
    deck.named.append(Set(name, faces, "faces"))


def of_nodes(deck: Deck, name: str, nodes: Ints) -> None:
    """Add a set of nodes (k,), as the faces of the surface that they are, or else as nodes; all nodes are the body."""
    if len(own := np.unique(nodes)) == len(deck.points):
        return
    faces, alone = deck.sides.within(own)
    if not len(own):
        deck.left.append(Left(f"the set of nodes `{name[:60]}`", "none of its nodes are of a cell of the body"))
    elif len(alone):
        deck.named.append(Set(name, own, "nodes"))
    else:
        deck.named.append(Set(name, faces, "faces"))
