"""Tie constraint: springs between two overlapping surfaces glued together, for meshes that do not match."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.surface_overlap import FacetOverlaps, find_overlaps
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks
from softmark.solvers.mesh.mesh import Mesh


@dataclass(frozen=True)
class TieConstraint(Energy):
    """Tie energy E = 1/2 int k |u - v|^2 dA over the overlap of two surfaces with displacements u and v.

    A stress sigma opens the joint by sigma / k. The `stiffness` k (Pa/m) is large compared with E / h of the cells,
    with Young's modulus E and cell size h. A uniform stress stays uniform on any two meshes, because the overlaps of
    facets are exact (a patch test).
    """

    nodes: Ints  # (p, a + b) of both facets of each pair
    K: Floats  # (p, 3 (a + b), 3 (a + b)), N/m
    area: float  # m^2
    stiffness: float
    reaction_nodes: Any = None  # nodes (n,) of all pieces but the first
    conservative: bool = True

    @cached_property
    def stencils(self) -> Ints:
        """Degrees of freedom (p, 3 (a + b)) of the nodes of each pair of facets."""
        return (3 * self.nodes[:, :, None] + np.arange(3)).reshape(len(self.nodes), -1)

    def value(self, x: Floats) -> float:
        """Return the energy of the springs, J."""
        u = np.asarray(x, dtype=np.float64)[self.stencils]
        return 0.5 * float(np.einsum("pi,pij,pj->", u, self.K, u, optimize=True))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add `scale` times the negative forces of the springs on nodes, N, to g (dofs,)."""
        np.add.at(g, self.stencils, scale * np.einsum("pij,pj->pi", self.K, x[self.stencils]))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the stiffness of the springs, which is constant and positive semidefinite."""
        add_blocks(scale * self.K, slots, data)

    def rounding(self, x: Floats) -> float:
        """Return the error of the spring forces due to rounding of displacements, N."""
        u = np.abs(np.asarray(x)[self.stencils])
        return float(np.finfo(np.asarray(x).dtype).eps * np.linalg.norm(np.einsum("pij,pj->pi", np.abs(self.K), u)))


def tie_surfaces(
    mesh: Mesh, one: Ints, other: Ints, stiffness: float, reach: float, depth: float = 0.0
) -> TieConstraint:
    """Return springs between facets `one` and `other` (k,) of a mesh that overlap within a distance `reach`, m.

    The stiffness is in Pa/m. For an axisymmetric model `depth` is the thickness of the slice, m, and whole rings are
    tied.
    """
    common = find_overlaps(mesh, one, other, reach)
    A = common.A
    if depth:
        from softmark.solvers.energies.axisymmetric import circumference_in_slices

        A = A * circumference_in_slices(common.X[:, 0], depth)
    pairs, which = np.unique(np.stack([common.first, common.second], axis=1), axis=0, return_inverse=True)
    nodes = np.concatenate([mesh.facets[pairs[:, 0]], mesh.facets[pairs[:, 1]]], axis=1)
    return TieConstraint(
        nodes, _integrate_springs(mesh, common, stiffness * A, which.ravel(), len(pairs)), float(A.sum()), stiffness
    )


def _integrate_springs(mesh: Mesh, common: FacetOverlaps, weights: Floats, which: Ints, pairs: int) -> Floats:
    """Return stiffness matrices (pairs, 3 (a + b), 3 (a + b)), N/m, of the springs of all facet pairs.

    They are the integrals of k N_a N_b over the overlap of each pair, with the shape functions of the second facet
    negated. `weights` (p,), N/m, are k times the areas of the integration points, and `which` (p,) are their pairs.
    """
    shape = FACETS[mesh.facets.shape[1]].shape
    N = np.concatenate([shape(common.xi), -shape(common.eta)], axis=1)
    M = np.zeros((pairs, N.shape[1], N.shape[1]))
    np.add.at(M, which, np.einsum("p,pa,pb->pab", weights, N, N))
    k = 3 * N.shape[1]
    found: Floats = np.einsum("pab,ij->paibj", M, np.eye(3)).reshape(pairs, k, k)
    return found
