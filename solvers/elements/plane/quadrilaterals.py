"""Quadrilaterals for plane problems: slices of hexahedra, one cell thick.

A body in plane strain or plane stress is modelled as a slice whose points stay in their planes. Displacements that are
uniform through its thickness satisfy the equations of the hexahedra, and these reduce to the equations of the
quadrilateral. The results agree to rounding, as tests against a program with plane elements show. To add a
quadrilateral: write a class derived from the hexahedron of which it is a slice, and add a line to PLANE.
"""

from __future__ import annotations

from typing import ClassVar

from softmark.solvers.elements.hex8 import Hex8
from softmark.solvers.elements.hex20 import Hex20
from softmark.solvers.elements.hex27 import Hex27


class Quad4(Hex8):
    """Four-node quadrilateral for plane strain and plane stress, bilinear displacement: stiff in bending.

    N_a = (1 + xi_a xi)(1 + eta_a eta)/4, four Gauss points. Displacements converge with h^2 and strains with h. In
    plane strain it locks from a Poisson ratio of about 0.45, unless `integration = selective` or a `formulation`
    prevents that; in plane stress there is no locking. It is a slice of `hex8`.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "quad4"
    described: ClassVar[str] = "four-node quadrilaterals"
    briefly: ClassVar[str] = "linear quadrilaterals"
    family: ClassVar[str] = "quadrilaterals"
    springs: ClassVar[bool] = False
    slice_of: ClassVar[str] = "hex8"


class Quad8(Hex20):
    """Eight-node serendipity quadrilateral for plane strain and plane stress, with quadratic sides.

    Nine Gauss points. Displacements converge with h^3 and strains with h^2 on cells that are parallelograms; on
    distorted cells `quad9` is better. With `formulation = mixed` pressures are linear between corners, and Poisson
    ratios up to 0.5 are possible. It is a slice of `hex20`.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "quad8"
    described: ClassVar[str] = "eight-node quadrilaterals"
    briefly: ClassVar[str] = "quad8"
    family: ClassVar[str] = "quadrilaterals"
    slice_of: ClassVar[str] = "hex20"


class Quad9(Hex27):
    """Nine-node quadrilateral for plane strain and plane stress, biquadratic: accurate in distorted cells too.

    Nine Gauss points. Displacements converge with h^3 and strains with h^2, whatever the shape of the cells. With
    `formulation = mixed` (Taylor and Hood's Q2/Q1) Poisson ratios up to 0.5 are possible. It is a slice of `hex27`.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "quad9"
    described: ClassVar[str] = "nine-node quadrilaterals"
    briefly: ClassVar[str] = "quad9"
    family: ClassVar[str] = "quadrilaterals"
    slice_of: ClassVar[str] = "hex27"
