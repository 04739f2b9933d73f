"""NGSolve: forms compiled to C++ where a compiler is at hand, blocks of 3 x 3, its supernodal sparse Cholesky.

The tangent is written out: that takes half the time of `Variation` of the energy, and the compiled form two thirds of
the interpreted one. What the compiler takes is left out.
"""

from __future__ import annotations

import os
import shutil
import sys
import time
from typing import Any

import netgen.meshing
import ngsolve as ng
import numpy as np
from protocol import CAP, Found, NotConverged, Problem, balanced, main, tolerance_at

os.environ["PATH"] = os.path.dirname(sys.executable) + os.pathsep + os.environ["PATH"]  # its wrapper of the compiler
COMPILED = shutil.which("g++") is not None and shutil.which("ngscxx") is not None


def meshed(problem: Problem) -> Any:
    """Its mesh from our corners."""
    mesh = netgen.meshing.Mesh(3)
    mesh.AddPoints(np.ascontiguousarray(problem.points[: problem.corners]))
    mesh.AddElements(dim=3, index=1, data=np.ascontiguousarray(problem.cells[:, :4].astype(np.int32)), base=0)
    return ng.Mesh(mesh)


def edges(mesh: Any) -> Any:
    """Ends of its edges (e, 2)."""
    return np.array([[v.nr for v in edge.vertices] for edge in mesh.edges])


def free_dofs(problem: Problem, mesh: Any, space: Any) -> Any:
    """All but those of the wall."""
    free, wall = ng.BitArray(space.ndof), np.zeros(space.ndof, bool)
    free.Set()
    wall[: mesh.nv] = problem.points[: mesh.nv, 0] < 1e-9
    if problem.quadratic:
        wall[mesh.nv :] = wall[edges(mesh)].all(axis=1)
    for dof in np.nonzero(wall)[0].tolist():
        free.Clear(dof)
    return free, wall


def forms(problem: Problem, space: Any, state: Any) -> tuple[Any, Any, Any]:
    """Tangent and internal force in a state, and the weight."""
    (u, v), mu, lam = space.TnT(), problem.mu, problem.lam
    xi, weights = problem.rule
    dx = ng.dx(intrules={ng.ET.TET: ng.IntegrationRule([tuple(x) for x in xi.tolist()], weights.tolist())})
    F, H = ng.Grad(state) + ng.Id(3), ng.Grad(u)
    G, log = ng.Inv(F), ng.log(ng.Det(F))
    dP = mu * H + (mu - lam * log) * (G * H * G).trans + lam * ng.InnerProduct(G.trans, H) * G.trans
    P = mu * F + (lam * log - mu) * G.trans
    K, f, weight = ng.BilinearForm(space, symmetric=True), ng.LinearForm(space), ng.LinearForm(space)
    K += ng.InnerProduct(dP, ng.Grad(v)).Compile(COMPILED, wait=True) * dx
    f += ng.InnerProduct(P, ng.Grad(v)).Compile(COMPILED, wait=True) * dx
    weight += -problem.density * problem.gravity * v[2] * dx
    weight.Assemble()
    return K, f, weight


def nodal(problem: Problem, mesh: Any, state: Any) -> Any:
    """Displacements (n, 3) of our points."""
    x = state.vec.FV().NumPy().reshape(-1, 3)
    u = np.zeros_like(problem.points)
    u[: mesh.nv] = x[: mesh.nv]
    if problem.quadratic:  # hierarchical: the mean of the ends and a bubble
        pairs = problem.cells[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]].reshape(-1, 2)
        ends = np.sort(edges(mesh), axis=1)
        keys = ends[:, 0] * mesh.nv + ends[:, 1]
        order, wanted = np.argsort(keys), np.sort(pairs, axis=1)
        edge = order[np.searchsorted(keys[order], wanted[:, 0] * mesh.nv + wanted[:, 1])]
        u[problem.cells[:, 4:].ravel()] = u[pairs].mean(axis=1) + bubble(mesh) * x[mesh.nv + edge]
    return u


def bubble(mesh: Any) -> float:
    """What its quadratic shape function of an edge is in the middle of it."""
    space = ng.H1(mesh, order=2)
    values = space.GetFE(ng.ElementId(ng.VOL, 0)).CalcShape(0.5, 0.5, 0.0)
    return float(np.array(values)[4:][np.abs(np.array(values)[4:]).argmax()])


def solve(problem: Problem, steps: int) -> Found:
    """The beam by NGSolve."""
    mesh = meshed(problem)
    space = ng.H1(mesh, order=2 if problem.quadratic else 1, dim=3)
    free, wall = free_dofs(problem, mesh, space)
    state = ng.GridFunction(space)
    before = time.perf_counter(), time.process_time()
    K, f, weight = forms(problem, space, state)
    aside = time.perf_counter() - before[0] - (time.process_time() - before[1])
    ready, iterations, load = time.process_time(), 0, weight.vec.FV().NumPy().reshape(-1, 3)
    for step in range(1, steps + 1):
        part = step / steps
        for _ in range(CAP):
            f.Assemble()
            f.vec.data -= part * weight.vec
            r = f.vec.FV().NumPy().reshape(-1, 3)
            if balanced(r[~wall], r[wall], part * load, tolerance_at(part)):
                break
            K.Assemble()
            state.vec.data -= K.mat.Inverse(free, inverse="sparsecholesky") * f.vec
            iterations += 1
        else:
            raise NotConverged
    note = "sparsecholesky" + (", forms in C++" if COMPILED else "")
    return Found(nodal(problem, mesh, state), ready, iterations, steps, f"NGSolve {ng.__version__}", note, aside)


if __name__ == "__main__":
    main(solve)
