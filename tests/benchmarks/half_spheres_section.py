"""The two half-spheres of `half_spheres.py` without any of softmark: their sections, with exact contact at points.

    .venv/bin/python tests/benchmarks/half_spheres_section.py [--cells 4 8] [--law calculix] [--friction 0.5]

Nine-node quadrilaterals whose sides are curved (scikit-fem gives shape functions and integration points), the walls
touching from the start. A point of the inner body's outer side is pushed back by k/2 <-g>^2, g the exact distance from
the curved sides of the outer body as they have moved; the plate is a plane, exactly. Friction is a spring of the same
k along the side, from the place of it that the point sticks to, and gives way at mu times the pressure. Forces on a
quarter, N, at each mm of travel. In mm, MPa and N.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
from indentation_section import LAWS, Revolved
from scipy import sparse
from scipy.sparse.linalg import splu
from skfem import BoundaryFacetBasis, MeshQuad, MeshQuad2

Floats = np.ndarray[Any, np.dtype[np.float64]]

YOUNG, POISSON = 1.0, 0.3
MU, LAM = YOUNG / 2 / (1 + POISSON), YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
INNER, MIDDLE, OUTER = 10.0, 12.0, 14.0  # mm


class Ring(Revolved):
    """A quarter of a ring: `through` cells through its wall, `along` from the axis (y) to the rim (x)."""

    def __init__(self, inner: float, outer: float, through: int, along: int) -> None:
        turned = np.linspace(0.0, np.pi / 2, along + 1)  # from the axis
        flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(np.linspace(inner, outer, through + 1), turned))
        r, t = flat.doflocs
        super().__init__(MeshQuad2(np.array([r * np.sin(t), r * np.cos(t)]), flat.t))
        near = 1e-6
        axis = self.inside.get_dofs(lambda x: x[0] < near).all(["u^1"])
        rim = self.inside.get_dofs(lambda x: x[1] < near).all(["u^2"])
        self.held = np.union1d(axis, rim)

    def side(self, radius: float, points: int) -> Any:
        """Integration points of a side."""
        return BoundaryFacetBasis(self.mesh, self.inside.elem, facets=self.facets(radius), intorder=points)

    def facets(self, radius: float) -> Any:
        """Of a side."""
        far = np.hypot(*self.mesh.p[:, self.mesh.facets])
        return np.flatnonzero((np.abs(far - radius) < 1e-6).all(0))

    def curve(self, radius: float) -> Any:
        """Unknowns (edges, 3, 2) of a side: first end, last end, middle; from the axis to the rim."""
        facets, basis = self.facets(radius), self.inside
        a, b = self.mesh.facets[:, facets]
        a, b = np.where(self.mesh.p[1, a] > self.mesh.p[1, b], (a, b), (b, a))
        edges = np.stack([basis.nodal_dofs[:, a], basis.nodal_dofs[:, b], basis.facet_dofs[:, facets]]).transpose(
            2, 0, 1
        )
        return edges[np.argsort(-self.mesh.p[1, a])]


def shape(s: Floats) -> tuple[Floats, Floats, Floats]:
    """Functions of an edge of three nodes and their slopes, (3, n)."""
    N = np.array([0.5 * s * (s - 1), 0.5 * s * (s + 1), 1 - s**2])
    return N, np.array([s - 0.5, s + 0.5, -2 * s]), np.array([1 + 0 * s, 1 + 0 * s, -2 + 0 * s])


def on(nodes: Floats, N: Floats) -> Floats:
    """(n, 2) of nodes (n, 3, 2) and functions (3, n)."""
    return np.einsum("nai,an->ni", nodes, N)


def foot(x: Floats, nodes: Floats) -> Floats:
    """Where on its edge, nodes (n, 3, 2), each point (n, 2) is closest: -1 to 1, or a little beyond."""
    s = np.zeros(len(x))
    for _ in range(30):
        N, D, DD = shape(s)
        r, t = x - on(nodes, N), on(nodes, D)
        slope = (t * t).sum(1) - np.maximum((r * on(nodes, DD)).sum(1), 0.0)
        s = np.clip(s + np.clip((r * t).sum(1) / slope, -0.5, 0.5), -1.5, 1.5)
    return s


def closest(x: Floats, nodes: Floats) -> tuple[Any, Floats]:
    """The edge (n,) of nodes (m, 3, 2) closest to points (n, 2), and where on it."""
    near = np.argsort(((x[:, None] - nodes[None, :, 2]) ** 2).sum(-1), axis=1)[:, :3].T
    feet = np.array([foot(x, nodes[edge]) for edge in near])
    over = np.maximum(np.abs(feet) - 1.0, 0.0)  # before the axis and beyond the rim an edge goes on
    best = np.argmin(over + 1e-6 * np.arange(3)[:, None], axis=0)
    return np.choose(best, near), np.choose(best, feet)


def pushed(x: Floats, nodes: Floats, slid: Floats, half: Floats, k: float, mu: float) -> tuple[Floats, Floats]:
    """What pushes points (n, 2) that are behind their edges, by area (n, 2), and the share of it of each node (n, 3).

    `slid` (n,) is where the edge's middle is along the side, from where the point sticks; `half` the edge's length.
    """
    s = foot(x, nodes)
    N, D, _ = shape(s)
    r, t = x - on(nodes, N), on(nodes, D)
    t /= np.hypot(*t.T)[:, None]
    behind = t[:, 0] * r[:, 1] - t[:, 1] * r[:, 0]  # the side runs from the axis to the rim
    p = k * np.maximum(behind, 0.0)
    along = np.clip(k * (slid + s * half), -mu * p, mu * p)
    normal = np.stack([-t[:, 1], t[:, 0]], axis=1)
    return p[:, None] * normal + along[:, None] * t, N.T


class Pair:
    """Both rings, the plate, and what they do to each other."""

    def __init__(self, cells: int, law: Any, mu: float = 0.0, coarser: float = 1.3, points: int = 8) -> None:
        along = round(cells / 2 * INNER * np.pi / 2)
        self.one, self.other = Ring(INNER, MIDDLE, cells, along), Ring(MIDDLE, OUTER, cells, round(along / coarser))
        self.law, self.mu, self.first = law, mu, self.one.inside.N
        self.size = self.first + self.other.inside.N
        self.X = np.concatenate([self.one.inside.doflocs, self.other.inside.doflocs], axis=1)
        self.free = np.setdiff1d(np.arange(self.size), np.concatenate([self.one.held, self.first + self.other.held]))
        self.lid, self.skin = self.other.side(OUTER, points), self.one.side(MIDDLE, points)
        self.curve = self.first + self.other.curve(MIDDLE)
        self.long = MIDDLE * np.pi / 2 / len(self.curve)  # of an edge, mm
        X = self.skin.global_coordinates().value
        self.stuck = MIDDLE * np.arctan2(*X).ravel()  # (points,): along the side from the axis, mm
        self.area = (2 * np.pi * X[0] * self.skin.dx).ravel()  # of each point before it deforms, mm^2
        self.N = np.array([self.skin.basis[a][0].value for a in range(self.skin.Nbfun)])
        self.points = X.reshape(2, -1)
        self.nodes = self.X[:, self.curve[..., 0]].transpose(1, 2, 0)

    def elastic(self, u: Floats) -> tuple[Floats, Any]:
        """Of both bodies."""
        a, b = self.one.elastic(u[: self.first], self.law), self.other.elastic(u[self.first :], self.law)
        return np.concatenate([a[0], b[0]]), sparse.block_diag([a[1], b[1]], format="csc")

    def least(self, u: Floats) -> float:
        """The least determinant of F."""
        return min(self.one.least(u[: self.first]), self.other.least(u[self.first :]))

    def plate(self, u: Floats, travel: float, k: float) -> tuple[Floats, Any, float]:
        """Forces and stiffness of the plate, and what it feels."""
        basis = self.lid
        N = np.array([basis.basis[a][0].value[1] for a in range(basis.Nbfun)])
        X, dofs = basis.global_coordinates().value, basis.element_dofs
        g = OUTER - travel - X[1] - np.einsum("acq,ac->cq", N, u[self.first + dofs])
        w = 2 * np.pi * X[0] * basis.dx * k * (g < 0)
        f, K = self.other.summed(basis, np.einsum("acq,cq->ac", N, -w * g), np.einsum("acq,cq,bcq->abc", N, w, N))
        empty = sparse.csc_matrix((self.first, self.first))
        return (
            np.concatenate([np.zeros(self.first), f]),
            sparse.block_diag([empty, K], format="csc"),
            float(-(w * g).sum()),
        )

    def skins(self, u: Floats) -> tuple[Floats, Floats]:
        """Points (n, 2) of the inner body's side, and nodes (m, 3, 2) of the outer's, where they are now."""
        local = u[: self.first][self.skin.element_dofs]
        x = self.points + np.einsum("aicq,ac->icq", self.N, local).reshape(2, -1)
        return x.T, self.nodes + u[self.curve]

    def rub(self, u: Floats, k: float) -> tuple[Floats, Any]:
        """Forces and stiffness between both, by differences of what each point does with its edge."""
        x, nodes = self.skins(u)
        edge, s = closest(x, nodes)
        i = np.flatnonzero(self.depth(x, nodes[edge], s) > -1e-3)
        edge, half = edge[i], 0.5 * self.long
        slid = (edge + 0.5) * self.long - self.stuck[i]
        z = np.concatenate([x[i], nodes[edge].reshape(-1, 6)], axis=1)

        def local(z: Floats) -> Floats:
            f, N = pushed(z[:, :2], z[:, 2:].reshape(-1, 3, 2), slid, half, k, self.mu)
            return np.concatenate([f, -(N[:, :, None] * f[:, None]).reshape(-1, 6)], axis=1)

        steps = 1e-7 * np.eye(8)
        K = np.stack([(local(z + h) - local(z - h)) / 2e-7 for h in steps], axis=2)
        L, w = self.rows(len(self.area))[i], self.area[i]
        f = np.einsum("n,nia,ni->na", w, L, local(z))
        return self.gathered(i, edge, f, np.einsum("n,nia,nij,njb->nab", w, L, K, L, optimize=True))

    @staticmethod
    def depth(x: Floats, nodes: Floats, s: Floats) -> Floats:
        """How far points are behind their edges."""
        N, D, _ = shape(s)
        r, t = x - on(nodes, N), on(nodes, D)
        return (t[:, 0] * r[:, 1] - t[:, 1] * r[:, 0]) / np.hypot(*t.T)

    def stick(self, u: Floats) -> None:
        """From here on points stick to where they are, or to as far from it as friction bears."""
        x, nodes = self.skins(u)
        edge, s = closest(x, nodes)
        bears = self.mu * np.maximum(self.depth(x, nodes[edge], s), 0.0)
        here = (edge + 0.5 + 0.5 * s) * self.long
        self.stuck = here - np.clip(here - self.stuck, -bears, bears)

    def rows(self, n: int) -> Floats:
        """How a point (2) and its edge (6) move with the 18 unknowns of its cell and the 6 of the edge, (n, 8, 24)."""
        L = np.zeros((n, 8, 24))
        L[:, :2, :18] = self.N.transpose(2, 3, 1, 0).reshape(n, 2, -1)
        L[:, 2:, 18:] = np.eye(6)
        return L

    def gathered(self, i: Any, edge: Any, f: Floats, K: Floats) -> tuple[Floats, Any]:
        """Over points i."""
        d = np.repeat(self.skin.element_dofs.T, self.N.shape[3], axis=0)[i]
        d = np.concatenate([d, self.curve[edge].reshape(len(edge), 6)], axis=1)
        rows, columns = np.repeat(d, d.shape[1], 1).ravel(), np.tile(d, (1, d.shape[1])).ravel()
        K = sparse.coo_matrix((K.ravel(), (rows, columns)), (self.size, self.size)).tocsc()
        return np.bincount(d.ravel(), f.ravel(), self.size), K

    def forces(self, u: Floats, travel: float, k: float) -> tuple[Floats, Any, float]:
        """Of all on the free unknowns, their stiffness, and what the plate feels."""
        (fe, Ke), (fp, Kp, push), (fr, Kr) = self.elastic(u), self.plate(u, travel, k), self.rub(u, k)
        return (fe + fp + fr)[self.free], (Ke + Kp + Kr)[self.free][:, self.free], push

    def balanced(self, u: Floats, travel: float, k: float) -> tuple[Floats, float]:
        """Newton's method at one travel: displacements, and the force on the plate."""
        u, step = u.copy(), np.ones(self.size)
        left, K, push = self.forces(u, travel, k)
        for _ in range(60):
            size = float(np.abs(left).max() / max(push, 1e-3))
            if size < 1e-5 or np.abs(step).max() < 1e-8:  # points that come and go leave more than 1e-5
                return u, push
            step = np.zeros_like(u)
            step[self.free] = splu(K.tocsc()).solve(left)
            step *= min(1.0, 0.5 / np.abs(step).max())
            while self.least(u - step) < 0.1:
                step *= 0.5
            work, much = abs(step[self.free] @ left), np.linalg.norm(left)
            for _ in range(12):  # until what is left is less, or does not work against the step
                left, K, push = self.forces(u - step, travel, k)
                if step[self.free] @ left > -0.1 * work or np.linalg.norm(left) < much:
                    break
                step, work = 0.5 * step, 0.5 * work
            u -= step
        raise RuntimeError(f"not converged at {travel} mm: {size:.1e}")


def law(name: str) -> Any:
    """A law of `indentation_section.py` with the rubber's moduli."""
    return lambda F: LAWS[name](F, MU, LAM)


def forces(pair: Pair, k: float, steps: int = 4, travel: float = 5.0) -> list[float]:
    """On a quarter at each mm, N."""
    u, found = np.zeros(pair.size), []
    for i in range(round(travel * steps)):
        for softer in (100.0, 10.0, 1.0):
            u, push = pair.balanced(u, (i + 1) / steps, k / softer)
        pair.stick(u)
        if (i + 1) % steps == 0:
            found.append(push / 4)
    return found


def main() -> None:
    """Print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[2, 4], help="through each wall")
    parser.add_argument("--law", nargs="+", choices=LAWS, default=["neo_hookean"])
    parser.add_argument("--stiffness", type=float, nargs="+", default=[1e3], help="k, MPa/mm")
    parser.add_argument("--friction", type=float, default=0.0)
    parser.add_argument("--steps", type=int, default=4, help="states for each mm")
    options = parser.parse_args()
    for name in options.law:
        for cells in options.cells:
            for k in options.stiffness:
                start = time.process_time()
                found = forces(Pair(cells, law(name), options.friction), k, options.steps)
                numbers = " ".join(f"{force:.4f}" for force in found)
                print(f"{name:12} {cells} cells, k {k:<7g} {numbers}  {time.process_time() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
