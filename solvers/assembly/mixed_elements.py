"""Mixed displacement-pressure energies of meshes."""

from __future__ import annotations

import numpy as np

from softmark.solvers.elements import element_of
from softmark.solvers.energies.mixed_displacement_pressure import MixedSolid
from softmark.solvers.materials.volumetric_constraints import MixedSplit as Split
from softmark.solvers.mesh.element_interpolation import IntegrationPoints
from softmark.solvers.mesh.mesh import Floats, Mesh
from softmark.solvers.mesh.pressure_interpolation import build_pressure_space


def mixed_energy(mesh: Mesh, parts: IntegrationPoints, split: Split, mu: float) -> MixedSolid:
    """Return the mixed energy of a mesh, whose unknowns are displacements followed by the element's pressures.

    `split` is the law split into a shape part and a volume constraint. The unit of pressures is the shear modulus `mu`,
    Pa, divided by the edge length of a mean cell, m, so that the blocks of the matrix are balanced. Raises KeyError for
    an element without pressures.
    """
    known = build_pressure_space(mesh)
    edge = float(np.cbrt(parts.w.sum() / len(mesh.cells)))
    at, body = 3 * len(mesh.points) + known.cells, (mesh.cells, parts.dNdX, parts.w)
    pair = (split.shape, split.constraint, split.compliance)
    N = known.N if parts.N.ndim == 2 else pressure_shapes(mesh, parts)
    return MixedSolid(*body, *pair, at, N, len(mesh.points), mu, edge)


def pressure_shapes(mesh: Mesh, parts: IntegrationPoints) -> Floats:
    """Return the pressure shape functions (m, q, b) at integration points that differ from cell to cell.

    They are 1 for one pressure per cell. Else they are linear between corners, and are interpolated from their values
    at the nodes with the displacement shape functions.
    """
    if mesh.element.pressures == "cell":
        return np.ones((*parts.w.shape, 1))
    nodal = element_of(mesh.element.linear).shape(mesh.element.places())
    found: Floats = parts.N @ nodal
    return found
