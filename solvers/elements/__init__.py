"""Finite elements: shape functions, quadrature and geometry of a cell, independent of any material law.

Plane elements are slices of solid elements, one cell thick (package plane). To add an element: write one file with its
class (element.py lists the members) and add one line to ELEMENTS.
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

__all__ = [
    "CELLS",
    "ELEMENTS",
    "PLANE",
    "WORDS",
    "UnknownElement",
    "element_of",
    "find_element",
    "solid_element_name",
    "unknown_element_error",
]

ELEMENTS: dict[str, type[Element]] = {
    "tet4": Tet4,
    "tet10": Tet10,
    "hex8": Hex8,
    "hex20": Hex20,
    "hex27": Hex27,
}

SLICES: dict[str, type[Element]] = {
    "wedge6": Wedge6,
    "wedge15": Wedge15,
}  # solid elements used only for slices: plane triangles
CELLS: Mapping[str, type[Element]] = ChainMap(ELEMENTS, SLICES)  # elements of meshes
WORDS: Mapping[str, type[Element]] = ChainMap(dict(PLANE), ELEMENTS)  # elements by their names in scenes


def solid_element_name(name: str) -> str:
    """Return the name of the solid element of which a plane element is a slice; other names unchanged."""
    return PLANE[name].slice_of if name in PLANE else name


class UnknownElement(ValueError):
    """Raised for an unknown element name; the message lists the available elements."""


def element_of(name: str) -> type[Element]:
    """Return the class of a solid element by its name, such as `hex8`. Raises UnknownElement."""
    if name not in CELLS:
        raise unknown_element_error(name)
    return CELLS[name]


def finer_element(element: type[Element]) -> type[Element]:
    """Return the element of the finer space: one of higher order on the same cells, or itself on cells split."""
    return element_of(element.finer) if element.finer else element


def unknown_element_error(name: str) -> UnknownElement:
    """Return the error for an unknown element name."""
    return UnknownElement(f"there is no element `{name}`: elements are {', '.join(ELEMENTS)}")


def find_element(word: str) -> type[Element]:
    """Return the class of a solid or plane element by the name used in scenes. Raises UnknownElement."""
    return PLANE[word] if word in PLANE else element_of(word)
