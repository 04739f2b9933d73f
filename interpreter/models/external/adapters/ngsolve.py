"""NGSolve: linear elasticity in NGSolve's finite element spaces, with its sparse Cholesky factorization.

Nodes, cells, constraints, nodal forces and quadrature points are ours. Quadratic shape functions of NGSolve are
hierarchical: those of corners are linear, and each edge has a bubble function. The displacement at the midpoint of an
edge is therefore
    u = (u_a + u_b) / 2 + c x_ab        c: value of the bubble there
The spaces are equal, and so is the solution. Curved cells are represented by a deformation of the mesh.
Source: Schöberl (2014), C++11 Implementation of Finite Elements in NGSolve, ASC Report 30/2014, TU Wien.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from softmark.interpreter.models.external.adapters import package_process
from softmark.interpreter.models.external.external_problem import Answer, Problem

PACKAGE = package_process.Package(
    "softmark.interpreter.models.external.adapters.ngsolve", "ngsolve", "ngsolve", "ngsolve"
)
install, version, places = PACKAGE.install, PACKAGE.version, PACKAGE.places
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return an error for supports that hold a mid-edge node but not both corners of its edge.

    No hierarchical shape function represents such a support.
    """
    if problem.element != "tet10":
        return []
    held = problem.is_held
    pairs, middles = quadratic_edges(problem)
    if np.any(held[middles] & ~held[pairs].all(axis=1)):
        return [("supports that hold only mid-edge nodes", "its shape functions are hierarchical")]
    return []


def quadratic_edges(problem: Problem) -> tuple[Any, Any]:
    """Return the edges of quadratic cells: their corners (e, 2) and their mid-edge nodes (e,)."""
    from softmark.solvers.elements.tet10 import EDGES

    pairs = problem.cells[:, np.array(EDGES)].reshape(-1, 2)
    middles, first = np.unique(problem.cells[:, 4:].ravel(), return_index=True)
    return pairs[first], middles


def solved(problem: Problem) -> Answer:
    """Return the displacements at each requested load fraction."""
    import ngsolve as ng

    begin = time.perf_counter()
    ng.ngsglobals.msg_level = 0
    body = Body(problem)
    u, v = body.space.TnT()
    lam, mu = (body.cell_coefficient(c) for c in package_process.moduli(problem))

    def eps(w: Any) -> Any:
        """Return the small strain of a displacement function."""
        return 0.5 * (ng.Grad(w) + ng.Grad(w).trans)

    K = ng.BilinearForm(body.space, symmetric=True)
    K += (2.0 * mu * ng.InnerProduct(eps(u), eps(v)) + lam * ng.div(u) * ng.div(v)) * body.dx
    state, free = body.held()
    x, f = state.vec, state.vec.CreateVector()
    f.FV().NumPy()[:] = body.forces()
    ready = time.perf_counter()
    K.Assemble()
    f.data -= K.mat * x
    x.data += K.mat.Inverse(free, inverse="sparsecholesky") * f
    done = time.perf_counter()
    states = np.array(problem.shares)[:, None, None] * body.nodal_displacements(x.FV().NumPy())
    return Answer(states, None, 1, {"setup_s": ready - begin, "solve_s": done - ready})


class Body:
    """Mesh and function space of the body in NGSolve.

    Unknowns x (3, v + e) are, for each component, the values of v vertices followed by those of e edges.
    """

    def __init__(self, problem: Problem) -> None:
        """Create the mesh from the corners of our cells, and curve it by our mid-edge nodes."""
        import netgen.meshing
        import ngsolve as ng

        self.problem, self.quadratic = problem, problem.element == "tet10"
        self.corners, inverse = np.unique(problem.cells[:, :4], return_inverse=True)
        cells = np.ascontiguousarray(inverse.reshape(-1, 4), dtype=np.int32)
        mesh = netgen.meshing.Mesh(3)
        mesh.AddPoints(np.ascontiguousarray(problem.points[self.corners]))
        mesh.AddElements(dim=3, index=1, data=cells, base=0)
        self.mesh = ng.Mesh(mesh)
        self.space = ng.VectorH1(self.mesh, order=2 if self.quadratic else 1)
        none: tuple[Any, Any] = np.zeros((0, 2), int), np.zeros(0, int)
        self.pairs, self.middles = quadratic_edges(problem) if self.quadratic else none
        self.edges = self._edges() if self.quadratic else self.middles
        self.bubble = self._edge_bubble_value() if self.quadratic else 1.0
        self._curve_edges()

    def _edges(self) -> Any:
        """Return the index of the NGSolve edge of each of our mid-edge nodes (e,)."""
        number = np.zeros(len(self.problem.points), dtype=np.int64)
        number[self.corners] = np.arange(len(self.corners))
        theirs = np.sort([[v.nr for v in edge.vertices] for edge in self.mesh.edges], axis=1)
        keys = theirs @ np.array([self.mesh.nv, 1])
        order = np.argsort(keys)
        wanted = np.sort(number[self.pairs], axis=1) @ np.array([self.mesh.nv, 1])
        return order[np.searchsorted(keys[order], wanted)]

    def _edge_bubble_value(self) -> float:
        """Return the value of the bubble function of an edge at its midpoint."""
        import ngsolve as ng

        element = ng.H1(self.mesh, order=2).GetFE(ng.ElementId(ng.VOL, 0))
        values = np.array(element.CalcShape(0.5, 0.5, 0.0))[4:]
        return float(values[np.abs(values).argmax()])

    def _curve_edges(self) -> None:
        """Deform the mesh by the offsets of our mid-edge nodes from straight edges."""
        import ngsolve as ng

        points = self.problem.points
        beside = points[self.middles] - points[self.pairs].mean(axis=1)
        if not np.any(np.abs(beside) > 1e-12 * np.ptp(points, axis=0).max()):
            return
        self.bend = ng.GridFunction(self.space)
        self._unknowns_view(self.bend)[:, self.mesh.nv + self.edges] = beside.T / self.bubble
        self.mesh.SetDeformation(self.bend)

    @property
    def dx(self) -> Any:
        """Integration measure with the quadrature points of our elements."""
        import ngsolve as ng

        from softmark.solvers.elements import element_of

        xi, w = element_of(self.problem.element).quadrature()
        rule = ng.IntegrationRule([tuple(x) for x in xi.tolist()], w.tolist())
        return ng.dx(intrules={ng.ET.TET: rule})

    def cell_coefficient(self, values: Any) -> Any:
        """Return a coefficient function with one of the `values` (m,) in each cell."""
        import ngsolve as ng

        found = ng.GridFunction(ng.L2(self.mesh, order=0))
        found.vec.FV().NumPy()[:] = values
        return found

    def _unknowns_view(self, function: Any) -> Any:
        """Return a view of the unknowns of a grid function (3, v + e)."""
        return function.vec.FV().NumPy().reshape(3, -1)

    def unknowns_from_displacements(self, u: Any) -> Any:
        """Return the unknowns (3, v + e) that represent nodal displacements u (n, 3), m."""
        x = np.zeros((3, self.space.ndof // 3))
        x[:, : len(self.corners)] = u[self.corners].T
        x[:, self.mesh.nv + self.edges] = (u[self.middles] - u[self.pairs].mean(axis=1)).T / self.bubble
        return x

    def nodal_displacements(self, x: Any) -> Any:
        """Return the nodal displacements (n, 3), m, that unknowns x (3, v + e) represent."""
        x = x.reshape(3, -1)
        u = np.zeros_like(self.problem.points)
        u[self.corners] = x[:, : len(self.corners)].T
        u[self.middles] = u[self.pairs].mean(axis=1) + self.bubble * x[:, self.mesh.nv + self.edges].T
        return u

    def forces(self) -> Any:
        """Return the forces on the unknowns (3 (v + e),) that do the same work as our nodal forces."""
        f = self.problem.forces.copy()
        between = f[self.middles]
        for i in (0, 1):
            np.add.at(f, self.pairs[:, i], 0.5 * between)
        x = np.zeros((3, self.space.ndof // 3))
        x[:, : len(self.corners)] = f[self.corners].T
        x[:, self.mesh.nv + self.edges] = self.bubble * between.T
        return x.ravel()

    def held(self) -> tuple[Any, Any]:
        """Return a state with the imposed displacements and zeros elsewhere, and a mask of the free unknowns."""
        import ngsolve as ng

        node, component = self.problem.held.T
        u, is_held = np.zeros(self.problem.points.shape), self.problem.is_held
        u[node, component] = self.problem.values
        state = ng.GridFunction(self.space)
        fixed = np.zeros((3, self.space.ndof // 3), dtype=bool)
        fixed[:, : len(self.corners)] = is_held[self.corners].T
        fixed[:, self.mesh.nv + self.edges] = is_held[self.middles].T
        self._unknowns_view(state)[:] = np.where(fixed, self.unknowns_from_displacements(u), 0.0)
        free = ng.BitArray(self.space.ndof)
        free.Clear()
        for dof in np.flatnonzero(~fixed.ravel()).tolist():
            free.Set(dof)
        return state, free


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
