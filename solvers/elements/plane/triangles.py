"""Triangles for plane problems: slices of wedges, one cell thick, as quadrilaterals are of hexahedra.

To add one: a class on the wedge that it is a slice of, and a line in PLANE; quadrilaterals.py explains why that is
exact.
"""

from __future__ import annotations

from typing import ClassVar

from softmark.solvers.elements.wedge6 import Wedge6
from softmark.solvers.elements.wedge15 import Wedge15


class Tri3(Wedge6):
    """Three-node triangle for plane strain, plane stress and axial symmetry: uniform strain in its plane.

    One point. Displacements converge with h^2 and strains with h; in bending it is much too stiff, and in plane strain
    and axial symmetry it locks from a Poisson ratio of about 0.45, without a remedy of its own: use `tri6`, or `quad4`
    with `formulation = mean_dilatation`. Meshes of regions cut each cell of their grid in two, with diagonals that
    meet. Source: Turner, Clough, Martin and Topp (1956), "Stiffness and deflection analysis".
    """

    name: ClassVar[str] = "tri3"
    described: ClassVar[str] = "three-node triangles"
    briefly: ClassVar[str] = "linear triangles"
    family: ClassVar[str] = "triangles"
    slice_of: ClassVar[str] = "wedge6"


class Tri6(Wedge15):
    """Six-node triangle for plane strain, plane stress and axial symmetry, quadratic: sides may be curved.

    Three points. Displacements converge with h^3 and strains with h^2. With `formulation = mixed` (Taylor and Hood's
    P2/P1) Poisson ratios up to 0.5 are possible. Meshes of regions cut each cell of their grid in two. Source:
    Zienkiewicz, Taylor and Zhu (2013), 6.
    """

    name: ClassVar[str] = "tri6"
    described: ClassVar[str] = "six-node triangles"
    briefly: ClassVar[str] = "tri6"
    family: ClassVar[str] = "triangles"
    slice_of: ClassVar[str] = "wedge15"
