"""Finite elements: all that is known of a cell by itself, nothing of any law.

Those of plane problems are slices of others (plane/).
To add an element: one file with its class (element.py says what it needs), one line in ELEMENTS.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from typing import TYPE_CHECKING

from softmark.solvers.elements.hex8 import Hex8
from softmark.solvers.elements.hex20 import Hex20
from softmark.solvers.elements.hex27 import Hex27
from softmark.solvers.elements.plane import PLANE
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.elements.tet10 import Tet10
from softmark.solvers.elements.wedge6 import Wedge6
from softmark.solvers.elements.wedge15 import Wedge15

if TYPE_CHECKING:
    from softmark.solvers.elements.element import Element

__all__ = ["CELLS", "ELEMENTS", "PLANE", "WORDS", "UnknownElement", "element_of", "named", "sliced", "unknown"]

ELEMENTS: dict[str, type[Element]] = {
    "tet4": Tet4,
    "tet10": Tet10,
    "hex8": Hex8,
    "hex20": Hex20,
    "hex27": Hex27,
}

SLICES: dict[str, type[Element]] = {"wedge6": Wedge6, "wedge15": Wedge15}  # of which plane triangles are, no others
CELLS: Mapping[str, type[Element]] = ChainMap(ELEMENTS, SLICES)  # of meshes
WORDS: Mapping[str, type[Element]] = ChainMap(dict(PLANE), ELEMENTS)  # for scenes


def sliced(name: str) -> str:
    """The element that cells of a mesh have: of a plane one, that which it is a slice of."""
    return PLANE[name].slice_of if name in PLANE else name


class UnknownElement(ValueError):
    """There is no such element; the message has its name, and those that there are."""


def element_of(name: str) -> type[Element]:
    """The class of an element by its word. Raises UnknownElement."""
    if name not in CELLS:
        raise unknown(name)
    return CELLS[name]


def unknown(name: str) -> UnknownElement:
    """That there is no such element."""
    return UnknownElement(f"there is no element `{name}`: elements are {', '.join(ELEMENTS)}")


def named(word: str) -> type[Element]:
    """What a model calls its element, those of plane bodies too. Raises UnknownElement."""
    return PLANE[word] if word in PLANE else element_of(word)
