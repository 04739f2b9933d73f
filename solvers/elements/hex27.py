"""27-node Lagrange hexahedron: quadratic shape functions, three by three by three Gauss points."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, ClassVar

from softmark.solvers.elements import quadratic_shape_functions
from softmark.solvers.elements.boundary_facets import Quad9
from softmark.solvers.elements.quadratic_hexahedron import QuadraticHexahedron
from softmark.solvers.elements.reference_cells import Hexahedron, facet_nodes, mirrored_order

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.elements.element import Facet, Rows

    Floats = NDArray[np.float64]

# Corners of the nodes 8 to 26: of edges, of the faces xi, eta, zeta = -1, 1 in turn, and of the cell. The order of
# faces is that of VTK's code (vtkTriQuadraticHexahedron.cxx); its documentation has another.
BETWEEN = (
    *Hexahedron.edges,
    *((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    (0, 1, 2, 3, 4, 5, 6, 7),
)


class Hex27(QuadraticHexahedron):
    """27-node hexahedron, triquadratic displacement: like `hex20`, but accurate in distorted cells too.

    Nodes are the corners, the middles of edges and faces, and the centre of the cell; 27 Gauss points. Displacements
    converge with h^3 and strains with h^2, whatever the shape of the cells. The nodes of facets on the side of a
    cylinder lie on the true surface. Near incompressibility this element locks on coarse meshes: in a thick sphere of
    two cells, 3 % of the displacement is lost at a Poisson ratio of 0.499 and a sixth at 0.4999. `formulation = mixed`
    adds pressures that are linear between corners, and removes the locking. There are twice as many unknowns as with
    `hex20` on the same cells.
    Source: Zienkiewicz, Taylor and Zhu (2013), section 6.
    """

    name: ClassVar[str] = "hex27"
    described: ClassVar[str] = "27-node hexahedra"
    briefly: ClassVar[str] = "hex27"
    meshio: ClassVar[str] = "hexahedron27"
    nodes: ClassVar[int] = 27
    locks: ClassVar[float] = 0.499
    most: ClassVar[float] = 5e5
    between: ClassVar[Rows] = BETWEEN
    mirrored_nodes: ClassVar[tuple[int, ...]] = mirrored_order(Hexahedron.mirror, BETWEEN)
    facets: ClassVar[Rows] = facet_nodes(Hexahedron.sides, 8, BETWEEN, Quad9)
    facet: ClassVar[type[Facet]] = Quad9
    monomials: ClassVar[Rows] = tuple(product(range(3), repeat=3))

    @staticmethod
    def shape(xi: Floats) -> Floats:
        """Return the shape functions N (m, 27) at local points xi (m, 3)."""
        return quadratic_shape_functions.lagrange(Hex27.places(), xi)

    @staticmethod
    def gradient(xi: Floats) -> Floats:
        """Return dN/dxi (m, 27, 3) at local points xi (m, 3)."""
        return quadratic_shape_functions.lagrange_gradient(Hex27.places(), xi)
