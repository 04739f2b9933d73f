"""A rigid sphere pressed into a cylinder, by the section alone: what CalculiX finds, found without it.

    .venv/bin/python tests/benchmarks/indentation_section.py [--edge 0.1] [--law neo_hookean] [--size 20 40]

Points (r, z) of the section are the unknowns, with nine-node quadrilaterals (scikit-fem gives shape functions and
integration points). Contact is k/2 <-g>^2 over the top face before it deforms, g the exact distance of the deformed
point from the sphere: no nodes of a rigid body, no pairing. The force is the slope of the energy in the travel; it is
printed for each stiffness k on the way to the last. In mm, kPa and mN.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from skfem import Basis, BoundaryFacetBasis, ElementQuad2, ElementVector, MeshQuad

Floats = np.ndarray[Any, np.dtype[np.float64]]

YOUNG, POISSON, RADIUS, TRAVELS = 10.0, 0.45, 10.0, (0.25, 0.5, 1.0)  # kPa, 1, mm, mm
WIDTH, HEIGHT = 20.0, 40.0  # mm: radius of the cylinder, and how high it is
FINE = 4.0  # mm: as far from the first touch cells are even; the contact radius at 1 mm is 3 mm
MU, LAM = YOUNG / 2 / (1 + POISSON), YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
I = np.eye(3)


def graded(edge: float, fine: float, end: float, growth: float = 1.15) -> Floats:
    """Places from 0 to `end`, `edge` apart up to `fine`, then each cell `growth` times the one before."""
    steps = [edge] * round(fine / edge)
    while sum(steps) + 0.6 * steps[-1] * growth < end:
        steps.append(steps[-1] * growth)
    places = np.concatenate([[0.0], np.cumsum(steps)])
    over = places > fine + 1e-9
    places[over] = fine + (places[over] - fine) * (end - fine) / (places[-1] - fine)
    return places


def small(F: Floats, mu: float = MU, lam: float = LAM) -> tuple[Floats, Floats]:
    """Linear elasticity: stress (3, 3, ...) and slope (3, 3, 3, 3, ...) of H = F - I."""
    H = F - I[:, :, None, None]
    e = 0.5 * (H + H.swapaxes(0, 1))
    A = lam * np.einsum("ij,kl->ijkl", I, I) + mu * (np.einsum("ik,jl->ijkl", I, I) + np.einsum("il,jk->ijkl", I, I))
    P = 2 * mu * e + lam * I[:, :, None, None] * np.trace(e)
    return P, np.broadcast_to(A[..., None, None], A.shape + F.shape[2:])


def inverse(F: Floats) -> tuple[Floats, Floats]:
    """J and F^-T of (3, 3, ...)."""
    M = np.moveaxis(F, (0, 1), (-2, -1))
    return np.linalg.det(M), np.moveaxis(np.linalg.inv(M), (-1, -2), (0, 1))


def neo_hookean(F: Floats, mu: float = MU, lam: float = LAM) -> tuple[Floats, Floats]:
    """psi = mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2."""
    J, G = inverse(F)
    p = lam * np.log(J)
    P = mu * (F - G) + p * G
    A = mu * np.einsum("ik,jl->ijkl", I, I)[..., None, None]
    A = A + (mu - p) * np.einsum("il...,kj...->ijkl...", G, G) + lam * np.einsum("ij...,kl...->ijkl...", G, G)
    return P, A


def calculix(F: Floats, mu: float = MU, lam: float = LAM) -> tuple[Floats, Floats]:
    """psi = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2, the law of CalculiX and Abaqus under the same name."""
    kappa = lam + 2 / 3 * mu
    J, G = inverse(F)
    m, I1 = mu * J ** (-2 / 3), np.einsum("ij...,ij...", F, F)
    D, q = F - I1 / 3 * G, kappa * (J - 1) * J
    GG, turned = np.einsum("ij...,kl...->ijkl...", G, G), np.einsum("il...,kj...->ijkl...", G, G)
    A = np.einsum("ik,jl->ijkl", I, I)[..., None, None] + I1 / 3 * turned
    A = m * (A - 2 / 3 * np.einsum("ij...,kl...->ijkl...", D, G) - 2 / 3 * np.einsum("ij...,kl...->ijkl...", G, F))
    return m * D + q * G, A + kappa * (2 * J - 1) * J * GG - q * turned


LAWS = {"small": small, "neo_hookean": neo_hookean, "calculix": calculix}


class Revolved:
    """A section that is revolved about y, its unknowns, and what they give at integration points."""

    def __init__(self, mesh: Any) -> None:
        self.mesh = mesh
        self.inside = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
        self.B = self._gradients()
        self.w = 2 * np.pi * self.inside.global_coordinates().value[0] * self.inside.dx

    def _gradients(self) -> Floats:
        """(3, 3, functions, cells, points): slopes of r, z and the hoop of each function."""
        r = self.inside.global_coordinates().value[0]
        B = np.zeros((3, 3, self.inside.Nbfun, *r.shape))
        for a in range(self.inside.Nbfun):
            field = self.inside.basis[a][0]
            B[:2, :2, a] = field.grad
            B[2, 2, a] = field.value[0] / r
        return B

    def elastic(self, u: Floats, law: Any) -> tuple[Floats, Any]:
        """Forces and stiffness of the body."""
        local = u[self.inside.element_dofs]
        F = I[:, :, None, None] + np.einsum("ijacq,ac->ijcq", self.B, local, optimize=True)
        P, A = law(F)
        f = np.einsum("ijacq,ijcq,cq->ac", self.B, P, self.w, optimize=True)
        AB = np.einsum("ijklcq,klbcq,cq->ijbcq", A, self.B, self.w, optimize=True)
        K = np.einsum("ijacq,ijbcq->abc", self.B, AB, optimize=True)
        return self.summed(self.inside, f, K)

    def least(self, u: Floats) -> float:
        """The least determinant of F."""
        F = I[:, :, None, None] + np.einsum("ijacq,ac->ijcq", self.B, u[self.inside.element_dofs], optimize=True)
        return float(((F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]) * F[2, 2]).min())

    def summed(self, basis: Any, f: Floats, K: Floats) -> tuple[Floats, Any]:
        d, n = basis.element_dofs, basis.N
        rows = np.broadcast_to(d[:, None], K.shape).ravel()
        columns = np.broadcast_to(d[None], K.shape).ravel()
        return np.bincount(d.ravel(), f.ravel(), n), sparse.coo_matrix((K.ravel(), (rows, columns)), (n, n)).tocsc()


class Section(Revolved):
    """The cylinder's section below the sphere."""

    def __init__(self, edge: float, width: float = WIDTH, height: float = HEIGHT) -> None:
        r, z = graded(edge, FINE, width), height - graded(edge, FINE / 2, height)[::-1]
        super().__init__(MeshQuad.init_tensor(r, z))
        top = self.mesh.facets_satisfying(lambda x: (x[1] > height - 1e-9) & (x[0] < FINE + 1))
        self.face = BoundaryFacetBasis(self.mesh, self.inside.elem, facets=top, intorder=8)
        self.height = height
        dofs = self.inside.get_dofs(lambda x: x[1] < 1e-9).all()
        axis = self.inside.get_dofs(lambda x: x[0] < 1e-9).all(["u^1"])
        self.free = np.setdiff1d(np.arange(self.inside.N), np.concatenate([dofs, axis]))

    def contact(self, u: Floats, travel: float, k: float) -> tuple[Floats, Any, float]:
        """Forces and stiffness of the sphere, and the force that it feels upwards."""
        basis = self.face
        local, N = u[basis.element_dofs], np.array([basis.basis[a][0].value for a in range(basis.Nbfun)])
        X = basis.global_coordinates().value
        x = X + np.einsum("aicq,ac->icq", N, local)
        x[1] -= self.height + RADIUS - travel
        far = np.linalg.norm(x, axis=0)
        n, g = x / far, far - RADIUS
        w = 2 * np.pi * X[0] * basis.dx * k * (g < 0)
        H = (np.eye(2)[:, :, None, None] - np.einsum("icq,jcq->ijcq", n, n)) / far
        f = np.einsum("aicq,icq,cq->ac", N, n, w * g)
        C = np.einsum("icq,jcq->ijcq", n, n) * w + w * g * H
        K = np.einsum("aicq,ijcq,bjcq->abc", N, C, N, optimize=True)
        return *self.summed(basis, f, K), float(abs(np.sum(w * g * n[1])))


LADDER = (30.0, 300.0, 3e3, 3e4, 3e5)  # k, kPa/mm: each from the answer of the one before


def forces(section: Section, law: Any, travels: Any = TRAVELS) -> dict[float, list[float]]:
    """For each stiffness of the ladder the force at each travel, mN."""
    u = np.zeros(section.inside.N)
    found: dict[float, list[float]] = {k: [] for k in LADDER}
    for travel in travels:
        for k in LADDER:
            u = balanced(section, law, k, u, travel)
            found[k].append(section.contact(u, travel, k)[2])
    return found


def symmetric(K: Any) -> Any:
    """A factor of a symmetric matrix that needs no pivots."""
    return splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def balanced(section: Section, law: Any, k: float, u: Floats, travel: float) -> Floats:
    """Newton's method at one travel; steps are halved while they turn the body inside out."""
    free, u = section.free, u.copy()
    for _ in range(60):
        fe, Ke = section.elastic(u, law)
        fc, Kc, _push = section.contact(u, travel, k)
        left = (fe + fc)[free]
        size = float(np.abs(left).max() / max(np.abs(fc).max(), 1e-12))
        if size < 1e-8:
            return u
        step = np.zeros_like(u)
        step[free] = symmetric((Ke + Kc)[free][:, free]).solve(left)
        while law is not small and section.least(u - step) < 0.2:
            step *= 0.5
        u -= step
    raise RuntimeError(f"not converged at {travel}: {size:.1e}")


def hertz(travel: float) -> float:
    """mN."""
    return float(4 / 3 * YOUNG / (1 - POISSON**2) * RADIUS**0.5 * travel**1.5)


def main() -> None:
    """Print forces."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--edge", type=float, nargs="+", default=[0.2, 0.1])
    parser.add_argument("--law", nargs="+", choices=LAWS, default=list(LAWS))
    parser.add_argument("--size", type=float, nargs=2, default=(WIDTH, HEIGHT), help="mm: radius and height")
    options = parser.parse_args()
    print("hertz", [round(hertz(t), 4) for t in TRAVELS])
    for edge in options.edge:
        section = Section(edge, *options.size)
        for law in options.law:
            start = time.process_time()
            for k, found in forces(section, LAWS[law]).items():
                print(f"{law:12} edge {edge:<5} k {k:<7g} " + " ".join(f"{f:9.5f}" for f in found), flush=True)
            print(f"{time.process_time() - start:.1f} s of CPU")


if __name__ == "__main__":
    main()
