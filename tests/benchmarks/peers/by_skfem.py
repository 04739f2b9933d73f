"""scikit-fem: hand-written forms as in its example of hyperelasticity, MKL Pardiso for symmetric matrices."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import skfem
from protocol import CAP, Found, NotConverged, Problem, balanced, main, symmetric_pardiso, tolerance_at
from skfem.helpers import ddot, det, grad, inv, mul, trace, transpose


@skfem.LinearForm
def force(v: Any, w: Any) -> Any:
    """Virtual work of the first Piola-Kirchhoff stress."""
    return ddot(w["P"], grad(v))


@skfem.BilinearForm
def tangent(u: Any, v: Any, w: Any) -> Any:
    """Its derivative; G = F^-1, q = mu - lam ln J."""
    D = mul(w["G"], grad(u))
    turned = w["q"] * ddot(transpose(mul(D, w["G"])), grad(v))
    return w["mu"] * ddot(grad(u), grad(v)) + turned + w["lam"] * trace(D) * ddot(transpose(w["G"]), grad(v))


def middles(problem: Problem, basis: Any, x: Any) -> Any:
    """Displacements (n, 3): scikit-fem numbers edges by their ends, we by our own points."""
    u = np.zeros_like(problem.points)
    u[: problem.corners] = x[basis.nodal_dofs].T
    if problem.quadratic:
        ours = np.sort(problem.cells[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]], axis=2).reshape(-1, 2)
        place = ours[:, 0] * problem.corners + ours[:, 1]
        ends = np.sort(basis.mesh.edges, axis=0)
        theirs = ends[0] * problem.corners + ends[1]
        order = np.argsort(theirs)
        edge = order[np.searchsorted(theirs[order], place)]
        u[problem.cells[:, 4:].ravel()] = x[basis.edge_dofs].T[edge]
    return u


def solve(problem: Problem, steps: int) -> Found:
    """The beam by scikit-fem."""
    mu, lam, count = problem.mu, problem.lam, problem.corners
    points = np.ascontiguousarray(problem.points[:count].T)
    mesh = skfem.MeshTet(points, np.ascontiguousarray(problem.cells[:, :4].T))
    element = skfem.ElementVector(skfem.ElementTetP2() if problem.quadratic else skfem.ElementTetP1())
    xi, weights = problem.rule
    basis = skfem.Basis(mesh, element, quadrature=(np.ascontiguousarray(xi.T), weights))
    weight = skfem.LinearForm(lambda v, w: -problem.density * problem.gravity * v[2]).assemble(basis)
    fixed = basis.get_dofs(lambda x: x[0] < 1e-9).all()
    free, x, solver = basis.complement_dofs(fixed), basis.zeros(), symmetric_pardiso()
    ready, iterations = time.process_time(), 0
    for step in range(1, steps + 1):
        part = step / steps
        for _ in range(CAP):
            F = basis.interpolate(x).grad + np.eye(3)[:, :, None, None]
            G, log = inv(F), np.log(det(F))
            r = force.assemble(basis, P=mu * F + (lam * log - mu) * transpose(G)) - part * weight
            if balanced(r[free], r[fixed], part * weight, tolerance_at(part)):
                break
            K = tangent.assemble(basis, G=G, q=mu - lam * log, mu=mu, lam=lam)
            x[free] -= solver(K[free][:, free], r[free])
            iterations += 1
        else:
            raise NotConverged
    return Found(middles(problem, basis, x), ready, iterations, steps, f"scikit-fem {skfem.__version__}")


if __name__ == "__main__":
    main(solve)
