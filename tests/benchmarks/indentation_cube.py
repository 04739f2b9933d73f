"""How much stiffer a cube is than the cylinder inside it, where both are pressed in the middle of the top.

    .venv/bin/python tests/benchmarks/indentation_cube.py [--edge 1.0 0.7]

Linear elasticity of one quarter by quadratic hexahedra (scikit-fem's shape functions). Cube and cylinder have one mesh
about the middle, bent to a circle further out, so that what either misses there is the same. Hertz's pressure over a
radius of 2 mm; the mean of the displacement by that pressure, for each mN. In mm, kPa and mN.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from indentation_section import HEIGHT, LAM, MU, WIDTH, graded, symmetric
from scipy import sparse
from skfem import Basis, ElementHex2, ElementVector, FacetBasis, MeshHex

ACROSS, EVEN = 2.0, 6.0  # mm: radius of the pressure, and as far as both meshes are the same


def quarter(edge: float, turned: bool) -> MeshHex:
    """The mesh of a quarter of the cube, or of the cylinder."""
    x, z = graded(edge, 4.0, WIDTH, 1.3), HEIGHT - graded(edge, 3.0, HEIGHT, 1.3)[::-1]
    mesh = MeshHex.init_tensor(x, x, z)
    if not turned:
        return mesh
    points = mesh.p.copy()
    side, far = np.maximum(points[0], points[1]), np.hypot(points[0], points[1])
    bent = np.clip((side - EVEN) / (WIDTH - EVEN), 0.0, 1.0)
    points[:2] *= 1.0 - bent + bent * np.where(far > 0, side / np.maximum(far, 1e-9), 1.0)
    return MeshHex(points, mesh.t)


def stiffness(basis: Any) -> Any:
    """The matrix of linear elasticity."""
    G = np.array([basis.basis[a][0].grad for a in range(basis.Nbfun)])  # (functions, 3, 3, cells, points)
    S, w = 0.5 * (G + G.swapaxes(1, 2)), basis.dx
    A = (np.moveaxis(S, 3, 0) * np.sqrt(2 * MU * w)[:, None, None, None]).reshape(len(w), basis.Nbfun, -1)
    B = np.moveaxis(np.trace(G, axis1=1, axis2=2), 1, 0) * np.sqrt(LAM * w)[:, None]
    K, d = A @ A.swapaxes(1, 2) + B @ B.swapaxes(1, 2), basis.element_dofs.T
    rows, columns = np.repeat(d, basis.Nbfun, 1).ravel(), np.tile(d, (1, basis.Nbfun)).ravel()
    return sparse.coo_matrix((K.ravel(), (rows, columns)), (basis.N, basis.N)).tocsc()


def pressure(mesh: MeshHex) -> Any:
    """The forces of Hertz's pressure, 1 kPa in the middle."""
    top = mesh.facets_satisfying(lambda x: x[2] > HEIGHT - 1e-9)
    face = FacetBasis(mesh, ElementVector(ElementHex2()), facets=top, intorder=10)
    x = face.global_coordinates().value
    p = np.sqrt(np.maximum(1.0 - (x[0] ** 2 + x[1] ** 2) / ACROSS**2, 0.0)) * face.dx
    f = np.array([np.sum(face.basis[a][0].value[2] * p, axis=1) for a in range(face.Nbfun)])
    return np.bincount(face.element_dofs.ravel(), f.ravel(), face.N)


def sinking(mesh: MeshHex) -> tuple[float, int]:
    """The mean displacement under the pressure for each mN of its force, mm/mN, and how many unknowns gave it."""
    basis = Basis(mesh, ElementVector(ElementHex2()), intorder=4)
    planes = ((2, ("u^1", "u^2", "u^3")), (0, ("u^1",)), (1, ("u^2",)))
    held = [basis.get_dofs(lambda x, a=a: x[a] < 1e-9).all(list(names)) for a, names in planes]
    free = np.setdiff1d(np.arange(basis.N), np.concatenate(held))
    K, f, u = stiffness(basis)[free][:, free], pressure(mesh), np.zeros(basis.N)
    u[free] = symmetric(K).solve(f[free])
    return float(f @ u / f.sum() ** 2) / 4.0, len(free)


def main() -> None:
    """Print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--edge", type=float, nargs="+", default=[1.0], help="mm, of cells in the middle")
    for edge in parser.parse_args().edge:
        (cube, count), (cylinder, _) = (sinking(quarter(edge, turned)) for turned in (False, True))
        print(f"edge {edge}: {count} unknowns, cube {cube:.6e}, cylinder {cylinder:.6e}, {cube - cylinder:.3e} mm/mN")


if __name__ == "__main__":
    main()
