"""Quadrilaterals for plane problems: slices of hexahedra, one of them thick.

A body of plane strain or plane stress is a slice whose points stay in their planes. Displacements that are the same
through its thickness then fulfil the equations of its hexahedra, and these are the equations of the quadrilateral: the
answers are the same to rounding, as the tests hold against a program of plane elements. To add one: a class on the
hexahedron that it is a slice of, and a line in PLANE.
"""

from __future__ import annotations

from typing import ClassVar

from softmark.solvers.elements.hex8 import Hex8
from softmark.solvers.elements.hex20 import Hex20
from softmark.solvers.elements.hex27 import Hex27


class Quad4(Hex8):
    """Four-node quadrilateral for plane strain and plane stress, bilinear displacement: stiff in bending.

    N_a = (1 + xi_a xi)(1 + eta_a eta)/4, four Gauss points. Displacements converge with h^2 and strains with h. In
    plane strain it locks from a Poisson ratio of about 0.45, unless `integration = selective` or a `formulation` keeps
    it from that; in plane stress nothing locks. It is a slice of `hex8`. Source: Zienkiewicz, Taylor and Zhu (2013), 6.
    """

    name: ClassVar[str] = "quad4"
    described: ClassVar[str] = "four-node quadrilaterals"
    briefly: ClassVar[str] = "linear quadrilaterals"
    family: ClassVar[str] = "quadrilaterals"
    springs: ClassVar[bool] = False
    slice_of: ClassVar[str] = "hex8"


class Quad8(Hex20):
    """Eight-node quadrilateral of serendipity for plane strain and plane stress, sides of second degree.

    Nine Gauss points. Displacements converge with h^3 and strains with h^2 on cells that are parallelograms; on
    distorted ones `quad9` is better. With `formulation = mixed` pressures are linear between corners, and it takes
    Poisson ratios up to 0.5. It is a slice of `hex20`. Source: Zienkiewicz, Taylor and Zhu (2013), 6.
    """

    name: ClassVar[str] = "quad8"
    described: ClassVar[str] = "eight-node quadrilaterals"
    briefly: ClassVar[str] = "quad8"
    family: ClassVar[str] = "quadrilaterals"
    slice_of: ClassVar[str] = "hex20"


class Quad9(Hex27):
    """Nine-node quadrilateral for plane strain and plane stress, biquadratic: good in distorted cells too.

    Nine Gauss points. Displacements converge with h^3 and strains with h^2, whatever the shape of the cells. With
    `formulation = mixed` (Taylor and Hood's Q2/Q1) it takes Poisson ratios up to 0.5. It is a slice of `hex27`.
    Source: Zienkiewicz, Taylor and Zhu (2013), 6.
    """

    name: ClassVar[str] = "quad9"
    described: ClassVar[str] = "nine-node quadrilaterals"
    briefly: ClassVar[str] = "quad9"
    family: ClassVar[str] = "quadrilaterals"
    slice_of: ClassVar[str] = "hex27"
