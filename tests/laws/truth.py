"""What is right for a random case: scikit-fem on meshes that conform to its selections, and motion by modes.

Shares nothing with softmark but the numbers of a case. Hexahedra of second degree on a tensor grid whose planes lie on
every border of a selection, denser towards them, so that the singularities there cost little; a disc is met by
holding what lies inside. Two grids, and their distance says how good the finer one is. Motion is that of the slowest
modes and the quasi-static rest, each mode exactly for a course that is linear between points far denser than its times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
import skfem
from cases import Case, Region
from skfem.models.elasticity import lame_parameters, linear_elasticity

MODES = 40


@dataclass(frozen=True)
class Truth:
    """Displacements (n, 3), or (t, n, 3) at times (t,), and by what share of their norm they may be off."""

    u: np.ndarray
    uncertainty: float
    times: np.ndarray | None = None


def lines(extent: float, cuts: list[float], count: float) -> np.ndarray:
    """Coordinates of grid planes in [0, extent], about `count` in all, denser towards the cuts and the ends (mm)."""
    inner = sorted({round(c, 9) for c in cuts if 1e-9 * extent < c < extent * (1 - 1e-9)})
    ends = [0.0, *inner, extent]
    found = [np.zeros(1)]
    for low, high in pairwise(ends):
        n = max(2, round(count * (high - low) / extent))
        found.append(low + (high - low) * 0.5 * (1 - np.cos(np.pi * np.arange(1, n + 1) / n)))
    return np.concatenate(found)


def inside(region: Region, X: np.ndarray, size: tuple[float, float, float]) -> np.ndarray:
    """Which of the points X (3, ...), mm, lie in a region."""
    slack = 1e-7 * max(size)
    held = np.ones(X.shape[1:], dtype=bool)
    for i in range(3):
        held &= (X[i] >= region.low[i] - slack) & (X[i] <= region.high[i] + slack)
    if region.disc is not None:
        axis, p, q, r = region.disc
        u, v = (X[i] for i in range(3) if i != axis)
        held &= (u - p) ** 2 + (v - q) ** 2 <= r**2 * (1 + 1e-9)
    return held


@dataclass
class Body:
    """The discrete body on one grid: stiffness, mass, full load, free unknowns and values at the probe."""

    K: Any
    M: Any
    f: np.ndarray
    free: np.ndarray
    probe: Any

    @staticmethod
    def of(case: Case, count: float, mass: bool) -> Body:
        """Assembled on a grid of about `count` cells along the body; SI inside."""
        planes = [
            1e-3 * lines(s, case.support.cuts(i) + case.load.where.cuts(i), count * max(0.45, s / max(case.size)))
            for i, s in enumerate(case.size)
        ]
        mesh = skfem.MeshHex.init_tensor(*planes)
        basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=4)
        K = linear_elasticity(*lame_parameters(case.young, case.poisson)).assemble(basis)
        M = None
        if mass:
            M = skfem.BilinearForm(lambda u, v, w: case.density * sum(u[i] * v[i] for i in range(3))).assemble(basis)
        free = np.flatnonzero(~inside(case.support, 1e3 * basis.doflocs, case.size))
        X = np.linspace(*(1e-3 * np.array(p) for p in case.probe), 5).T
        return Body(K, M, _load(case, mesh), free, basis.probes(X))

    def at_rest(self) -> np.ndarray:
        """Displacements under the full load (dofs,), m."""
        u = np.zeros(self.K.shape[0])
        u[self.free] = solved(self.K[self.free][:, self.free], self.f[self.free])
        return u

    def seen(self, u: np.ndarray) -> np.ndarray:
        """Displacements at the probe (n, 3), m."""
        found: np.ndarray = (self.probe @ u).reshape(3, -1).T
        return found


def _load(case: Case, mesh: Any) -> np.ndarray:
    """Nodal forces of the full load, N: over facets that lie in the region, or with a disc by many points in each."""
    element, where, load = skfem.ElementVector(skfem.ElementHex2()), case.load.where, case.load
    middles = 1e3 * mesh.p[:, mesh.facets].mean(axis=1)
    border = mesh.boundary_facets()
    box = Region(where.low, where.high)
    chosen = border[inside(box, middles[:, border], case.size)]
    basis = skfem.FacetBasis(mesh, element, facets=chosen, intorder=30 if where.disc else 4)

    def work(v: Any, w: Any) -> Any:
        t = [-load.pressure * w.n[i] for i in range(3)] if load.vector is None else load.vector
        share = inside(where, 1e3 * np.asarray(w.x), case.size) if where.disc else 1.0
        return share * sum(t[i] * v[i] for i in range(3))

    f: np.ndarray = skfem.LinearForm(work).assemble(basis)
    return f


def solved(A: Any, b: np.ndarray) -> np.ndarray:
    """A x = b by Pardiso where it is installed, and else by SuperLU."""
    try:
        from pypardiso import PyPardisoSolver
    except ImportError:
        return np.asarray(spla.spsolve(A.tocsc(), b))
    solver = PyPardisoSolver(mtype=2)
    x = solver.solve(sp.csr_matrix(sp.triu(A)), b)
    solver.free_memory(everything=True)
    return np.asarray(x)


def at_rest(case: Case, count: float = 11.0) -> Truth:
    """Static equilibrium: two grids. The finer one is nearer by more than their distance, singularities included."""
    first, second = (_rest(case, n) for n in (count, 1.4 * count))
    away = np.linalg.norm(second - first) / np.linalg.norm(second)
    return Truth(second, 1.5 * away + 1e-3 * (1 + 2 * (case.load.where.disc is not None)))


def _rest(case: Case, count: float) -> np.ndarray:
    body = Body.of(case, count, mass=False)
    return body.seen(body.at_rest())


def in_motion(case: Case, times: np.ndarray, count: float = 5.0) -> Truth:
    """The motion from rest under a course, at times (t,) in s: modes of two grids."""
    first, second = (_motion(case, times, n) for n in (count, 1.5 * count))
    away = np.linalg.norm(second - first) / np.linalg.norm(second)
    return Truth(second, 1.5 * away + 3e-3, times)


def _motion(case: Case, times: np.ndarray, count: float) -> np.ndarray:
    body = Body.of(case, count, mass=True)
    K, M, f = (m[body.free][:, body.free] if m.ndim == 2 else m[body.free] for m in (body.K, body.M, body.f))
    squares, modes = spla.eigsh(K.tocsc(), MODES, M.tocsc(), sigma=0.0)
    pushed = modes.T @ f
    rest = np.zeros(body.K.shape[0])
    rest[body.free] = solved(K, f) - modes @ (pushed / squares)
    shapes = np.zeros((body.K.shape[0], MODES))
    shapes[body.free] = modes
    fine = _grid(case, times, 2 * np.pi / math.sqrt(squares.max()))
    q = np.stack([_answer(case, w2, p, fine) for w2, p in zip(squares, pushed, strict=True)])
    at = np.searchsorted(fine, times - 1e-12 * times[-1])
    seen, quasi = np.stack([body.seen(s) for s in shapes.T]), body.seen(rest)
    share = np.array([case.course.at(t) for t in times]) if case.course else np.ones(len(times))
    u: np.ndarray = np.einsum("mt,mni->tni", q[:, at], seen) + share[:, None, None] * quasi
    return u


def _grid(case: Case, times: np.ndarray, shortest: float) -> np.ndarray:
    """Times between which the course is as good as linear, s: its breaks and the asked times among them."""
    assert case.course is not None
    step = min(case.step / 20, shortest / 4)
    if case.course.name == "sine":
        step = min(step, 0.01 / case.course.numbers[0])
    else:
        step = min(step, np.ptp(case.course.breaks) / 100)
    dense = np.arange(0.0, times[-1], step)
    breaks = [b for b in case.course.breaks if 0 < b < times[-1]]
    return np.unique(np.concatenate([dense, times, breaks, np.array(breaks) * (1 + 1e-12)]))


def _answer(case: Case, square: float, force: float, t: np.ndarray) -> np.ndarray:
    """q(t) of q'' + a q' + w^2 q = force c(t), from rest, c linear between the times: exact in each interval."""
    assert case.course is not None
    w2, a = float(square), case.damping
    c = force * np.array([case.course.at(x) for x in t])
    root = complex(a * a / 4 - w2) ** 0.5
    first, second = -a / 2 + root, -a / 2 - root
    q, v, found = 0.0 + 0j, 0.0 + 0j, [0.0]
    for h, c0, c1 in zip(np.diff(t), c[:-1], c[1:], strict=True):
        slope = (c1 - c0) / h if h > 1e-9 * t[-1] / len(t) else 0.0
        # particular solution p0 + p1 s: w2 p1 = slope, a p1 + w2 p0 = c0
        p1 = slope / w2
        p0 = (c0 - a * p1) / w2
        A = ((v - p1) - second * (q - p0)) / (first - second)
        B = (q - p0) - A
        e1, e2 = np.exp(first * h), np.exp(second * h)
        q, v = A * e1 + B * e2 + p0 + p1 * h, A * first * e1 + B * second * e2 + p1
        found.append(q.real)
    return np.array(found)
