"""Named sets that nothing in a deck refers to; they become regions of the scene, or are listed."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.importers.imported_deck import Deck, Ints, NamedSet, NotImported


def add_cell_set(deck: Deck, name: str, cells: Ints) -> None:
    """Add a set of cells (k,) to the record of the deck, unless it contains all cells and is therefore the body."""
    if not len(cells):
        deck.left.append(NotImported(f"the set `{name[:60]}`", "none of its elements is a cell of the body"))
    elif len(cells) < len(deck.cells):
        deck.named.append(NamedSet(name, cells, "cells"))


def add_face_set(deck: Deck, name: str, faces: Ints) -> None:
    """Add a set of faces (f, 2) to the record of the deck."""
    inside = ~deck.sides.border.reshape(len(deck.cells), -1)[faces[:, 0], faces[:, 1]]
    if not len(faces) or inside.any():
        why = f"{int(inside.sum())} of its {len(faces)} faces are not on the surface of the body"
        deck.left.append(NotImported(f"the surface `{name[:60]}`", why))
        return
    deck.named.append(NamedSet(name, faces, "faces"))


def add_node_set(deck: Deck, name: str, nodes: Ints) -> None:
    """Add a set of nodes (k,) to the record of the deck, unless it contains all nodes and is therefore the body.

    A set that consists of all nodes of some faces is recorded as a set of faces. Nodes without a cell are reported as
    not imported.
    """
    if len(own := np.unique(nodes)) == len(deck.points):
        return
    faces, alone = deck.sides.within(own)
    if not len(own):
        deck.left.append(
            NotImported(f"the set of nodes `{name[:60]}`", "none of its nodes belongs to a cell of the body")
        )
    elif len(alone):
        deck.named.append(NamedSet(name, own, "nodes"))
    else:
        deck.named.append(NamedSet(name, faces, "faces"))
