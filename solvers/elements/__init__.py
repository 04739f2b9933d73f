"""Finite elements: shape functions and quadrature, nothing of any law.

To add an element: one file with its class (element.py says what it needs), one line in ELEMENTS.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.solvers.elements.hex8 import Hex8
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.elements.tet10 import Tet10

if TYPE_CHECKING:
    from softmark.solvers.elements.element import Element

ELEMENTS: dict[str, type[Element]] = {
    "tet4": Tet4,
    "tet10": Tet10,
    "hex8": Hex8,
}
