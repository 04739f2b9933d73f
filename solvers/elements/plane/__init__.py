"""Plane elements by name; each is a slice of a solid element."""

from __future__ import annotations

from softmark.solvers.elements.plane.quadrilaterals import Quad4, Quad8, Quad9
from softmark.solvers.elements.plane.triangles import Tri3, Tri6

PLANE: dict[str, type[Quad4 | Quad8 | Quad9 | Tri3 | Tri6]] = {
    "quad4": Quad4,
    "quad8": Quad8,
    "quad9": Quad9,
    "tri3": Tri3,
    "tri6": Tri6,
}
