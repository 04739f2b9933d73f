"""scikit-fem: linear elasticity with its bases and forms, and its default solver (SuperLU).

Nodes, cells, constraints and nodal forces are ours. Curved cells are also curved in scikit-fem (isoparametric meshes of
tet10 and hex27). Its cell of 20 nodes, `ElementHexS2`, has straight edges and is not supported.
Source: Gustafsson and McBain (2020), J. Open Source Software 5(52), 2369.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from softmark.interpreter.models.external.adapters import package_process
from softmark.interpreter.models.external.external_problem import Answer, Problem

PACKAGE = package_process.Package(
    "softmark.interpreter.models.external.adapters.scikit_fem", "skfem", "scikit-fem", "scikit-fem"
)
install, version, places, refuses = PACKAGE.install, PACKAGE.version, PACKAGE.places, PACKAGE.refuses
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read

# mesh, element and the degree up to which its quadrature is exact: as many points as we take
ELEMENTS = {
    "tet4": ("MeshTet", "ElementTetP1", 1),
    "tet10": ("MeshTet2", "ElementTetP2", 2),
    "hex8": ("MeshHex", "ElementHex1", 3),
    "hex27": ("MeshHex2", "ElementHex2", 5),
}


def solved(problem: Problem) -> Answer:
    """Return the displacements at each requested load fraction."""
    import skfem

    begin = time.perf_counter()
    mesh_class, element_class, degree = ELEMENTS[problem.element]
    element = getattr(skfem, element_class)()
    cells = problem.cells[:, match_node_order(problem.element, element)]
    mesh = getattr(skfem, mesh_class)(np.ascontiguousarray(problem.points.T), np.ascontiguousarray(cells.T))
    basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=degree)
    places = np.zeros(problem.points.shape, dtype=np.int64)  # of ours among its degrees of freedom (n, 3)
    places[cells] = basis.element_dofs.T.reshape(*cells.shape, 3)
    lam, mu = (c[:, None] * np.ones(basis.dx.shape) for c in package_process.moduli(problem))
    f, x = basis.zeros(), basis.zeros()
    f[places] = problem.forces
    fixed = places[problem.held[:, 0], problem.held[:, 1]]
    x[fixed] = problem.values
    ready = time.perf_counter()
    K = skfem.BilinearForm(stiffness).assemble(basis, lam=lam, mu=mu)
    u = skfem.solve(*skfem.condense(K, f, x=x, D=fixed))[places]
    done = time.perf_counter()
    states = np.array(problem.shares)[:, None, None] * u
    return Answer(states, None, 1, {"setup_s": ready - begin, "solve_s": done - ready})


def stiffness(u: Any, v: Any, w: Any) -> Any:
    """Return the bilinear form lam tr(eps(u)) tr(eps(v)) + 2 mu eps(u) : eps(v)."""
    from skfem.helpers import ddot, sym_grad, trace

    return w["lam"] * trace(sym_grad(u)) * trace(sym_grad(v)) + 2.0 * w["mu"] * ddot(sym_grad(u), sym_grad(v))


def match_node_order(name: str, element: Any) -> list[int]:
    """Return, for each node of a scikit-fem cell, the index of our node at the same position."""
    from softmark.solvers.elements import element_of

    ours = element_of(name).places()
    theirs = element.doflocs if name.startswith("tet") else 2.0 * element.doflocs - 1.0
    return [int(np.flatnonzero(np.abs(ours - X).max(axis=1) < 1e-12)[0]) for X in theirs]


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
