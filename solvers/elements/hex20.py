"""Twenty-node serendipity hexahedron: quadratic shape functions, three by three by three Gauss points."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements import quadratic_shape_functions
from softmark.solvers.elements.boundary_facets import Quad8
from softmark.solvers.elements.quadratic_hexahedron import QuadraticHexahedron
from softmark.solvers.elements.reference_cells import Hexahedron, facet_nodes, mirrored_order

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]

EDGES = Hexahedron.edges  # corners of the nodes 8 to 19


class Hex20(QuadraticHexahedron):
    """Twenty-node serendipity hexahedron, quadratic displacement: accurate in bending with few unknowns.

    Nodes are the corners and the middles of the edges, which may be curved; 27 Gauss points. Displacements converge
    with h^3 and strains with h^2 in nearly parallelepipedal cells. In strongly distorted cells it is less accurate than
    `hex27` (Arnold, Boffi and Falk 2002). The mid-edge nodes on the side of a cylinder lie on the true surface. Near
    incompressibility this element locks, later than linear cells and sooner than `tet10`: in a thick sphere of two
    cells, 4 % of the displacement is lost at a Poisson ratio of 0.49 and a third at 0.499. `formulation = mixed` adds
    pressures that are linear between corners, and removes the locking.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "hex20"
    described: ClassVar[str] = "twenty-node hexahedra"
    briefly: ClassVar[str] = "hex20"
    meshio: ClassVar[str] = "hexahedron20"
    nodes: ClassVar[int] = 20
    locks: ClassVar[float] = 0.49
    most: ClassVar[float] = 1e6
    between: ClassVar[Rows] = EDGES
    mirrored_nodes: ClassVar[tuple[int, ...]] = mirrored_order(Hexahedron.mirror, EDGES)
    facets: ClassVar[Rows] = facet_nodes(Hexahedron.sides, 8, EDGES, Quad8)
    facet: ClassVar[type[Facet]] = Quad8
    monomials: ClassVar[Rows] = (
        (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (0, 1, 1), (1, 0, 1),
        (2, 1, 0), (2, 0, 1), (1, 2, 0), (0, 2, 1), (1, 0, 2), (0, 1, 2), (1, 1, 1), (2, 1, 1), (1, 2, 1), (1, 1, 2),
    )  # fmt: skip

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 20) at local points xi (m, 3)."""
        return quadratic_shape_functions.serendipity(Hex20.places(), xi)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 20, 3) at local points xi (m, 3)."""
        return quadratic_shape_functions.serendipity_gradient(Hex20.places(), xi)
