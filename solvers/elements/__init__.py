"""Finite elements: shape functions and quadrature, nothing of any law.

To add an element: one file with its class, one line in ELEMENTS.
"""

from __future__ import annotations

from softmark.solvers.elements.tet4 import Tet4

ELEMENTS: dict[str, type[Tet4]] = {
    "tet4": Tet4,
}
