"""Finite elements: all that is known of a cell by itself, nothing of any law.

To add an element: one file with its class (element.py says what it needs), one line in ELEMENTS.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.solvers.elements.hex8 import Hex8
from softmark.solvers.elements.hex20 import Hex20
from softmark.solvers.elements.hex27 import Hex27
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.elements.tet10 import Tet10

if TYPE_CHECKING:
    from softmark.solvers.elements.element import Element

ELEMENTS: dict[str, type[Element]] = {
    "tet4": Tet4,
    "tet10": Tet10,
    "hex8": Hex8,
    "hex20": Hex20,
    "hex27": Hex27,
}


class UnknownElement(ValueError):
    """There is no such element; the message has its name, and those that there are."""


def element_of(name: str) -> type[Element]:
    """The class of an element by its word. Raises UnknownElement."""
    if name not in ELEMENTS:
        raise UnknownElement(f"there is no element `{name}`: elements are {', '.join(ELEMENTS)}")
    return ELEMENTS[name]
