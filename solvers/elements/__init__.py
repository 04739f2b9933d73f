"""Finite elements: shape functions, quadrature and geometry of a cell, independent of any material law.

Elements of plane problems are slices of solid ones (plane/).
To add an element: one file with its class (element.py lists its members), one line in ELEMENTS.
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


def solid_element_name(name: str) -> str:
    """Return the solid element of a mesh's cells; for a plane element, the one that it is a slice of."""
    return PLANE[name].slice_of if name in PLANE else name


class UnknownElement(ValueError):
    """There is no such element; the message gives its name and the available ones."""


def element_of(name: str) -> type[Element]:
    """Return the class of a solid element by its name. Raises UnknownElement."""
    if name not in CELLS:
        raise unknown_element_error(name)
    return CELLS[name]


def unknown_element_error(name: str) -> UnknownElement:
    """Return the error for an unknown element name."""
    return UnknownElement(f"there is no element `{name}`: elements are {', '.join(ELEMENTS)}")


def find_element(word: str) -> type[Element]:
    """Return the class of an element by the name used in models, including plane ones. Raises UnknownElement."""
    return PLANE[word] if word in PLANE else element_of(word)
