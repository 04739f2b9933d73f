"""Triangles for plane problems: slices of wedges, one cell thick.

To add a triangle: write a class derived from the wedge of which it is a slice, and add a line to PLANE.
quadrilaterals.py explains why a slice gives exactly the equations of the plane element.
"""

from __future__ import annotations

from typing import ClassVar

from softmark.solvers.elements.wedge6 import Wedge6
from softmark.solvers.elements.wedge15 import Wedge15


class Tri3(Wedge6):
    """Three-node triangle for plane strain, plane stress and axial symmetry: uniform strain in its plane.

    One integration point. Displacements converge with h^2 and strains with h. In bending the element is much too stiff.
    In plane strain and axial symmetry it locks from a Poisson ratio of about 0.45, and no option prevents that: use
    `tri6`, or `quad4` with `formulation = mean_dilatation`. Meshes of plane regions split each quadrilateral of their
    grid into two triangles; the diagonals of neighbours meet at common points.
    Source: Turner, Clough, Martin and Topp (1956), "Stiffness and deflection analysis".
    """

    name: ClassVar[str] = "tri3"
    described: ClassVar[str] = "three-node triangles"
    briefly: ClassVar[str] = "linear triangles"
    family: ClassVar[str] = "triangles"
    slice_of: ClassVar[str] = "wedge6"


class Tri6(Wedge15):
    """Six-node triangle for plane strain, plane stress and axial symmetry, quadratic: sides may be curved.

    Three integration points. Displacements converge with h^3 and strains with h^2. With `formulation = mixed` (Taylor
    and Hood's P2/P1) Poisson ratios up to 0.5 are possible. Meshes of plane regions split each quadrilateral of their
    grid into two triangles.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "tri6"
    described: ClassVar[str] = "six-node triangles"
    briefly: ClassVar[str] = "tri6"
    family: ClassVar[str] = "triangles"
    slice_of: ClassVar[str] = "wedge15"
