"""What is right for a random case: elements of second degree on grids that conform to its selections, motion by modes.

Shares nothing with softmark but the numbers of a case. The planes of a tensor grid lie on every border of a selection,
denser towards them, so that the singularities there cost little; a disc is met by holding what lies inside. Two grids,
and their distance says how good the finer one is. Motion is that of the slowest modes and the quasi-static rest, each
mode exactly for a course that is linear between points far denser than its times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from cases import Case, Region

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


@dataclass(frozen=True)
class Axis:
    """Lagrange's elements of second degree along one edge of the box: nodes (n,), m, and their integrals (n, n)."""

    x: np.ndarray
    mass: Any  # int N_a N_b
    stiff: Any  # int N_a' N_b'
    mixed: Any  # int N_a N_b'

    @staticmethod
    def of(planes: np.ndarray) -> Axis:
        """Cells between the planes (k,), m, each with a node in its middle."""
        h = np.diff(planes)
        x = np.empty(2 * len(planes) - 1)
        x[::2], x[1::2] = planes, 0.5 * (planes[1:] + planes[:-1])
        g, w = np.polynomial.legendre.leggauss(3)
        N, dN = shapes(g), slopes(g)
        blocks = ((w * N.T @ N, 0.5), (w * dN.T @ dN, 2.0), (w * N.T @ dN, None))
        rows = 2 * np.arange(len(h))[:, None] + np.arange(3)
        i, j = np.repeat(rows, 3, axis=1).ravel(), np.tile(rows, 3).ravel()
        found = []
        for block, power in blocks:
            scale = np.ones_like(h) if power is None else (0.5 * h if power == 0.5 else 2.0 / h)
            found.append(sp.csr_matrix(((scale[:, None] * block.ravel()).ravel(), (i, j)), (len(x), len(x))))
        return Axis(x, *found)

    def at(self, points: np.ndarray) -> np.ndarray:
        """The shape functions at points (m,) within the edge: (m, n)."""
        cell = np.clip(np.searchsorted(self.x[::2], points, side="right") - 1, 0, len(self.x) // 2 - 1)
        low, high = self.x[2 * cell], self.x[2 * cell + 2]
        found = np.zeros((len(points), len(self.x)))
        rows = np.arange(len(points))[:, None]
        found[rows, 2 * cell[:, None] + np.arange(3)] = shapes((2 * points - low - high) / (high - low))
        return found

    def integral(self, low: float, high: float) -> np.ndarray:
        """int N_a (n,), m, between two places: exact, cell by cell."""
        ends = np.unique(np.clip(np.concatenate([self.x[::2], [low, high]]), low, high))
        if len(ends) < 2:
            return np.zeros(len(self.x))
        g, w = np.polynomial.legendre.leggauss(2)
        half, middle = 0.5 * np.diff(ends), 0.5 * (ends[1:] + ends[:-1])
        places = (middle[:, None] + half[:, None] * g).ravel()
        found: np.ndarray = (half[:, None] * w).ravel() @ self.at(places)
        return found


def shapes(s: np.ndarray) -> np.ndarray:
    """Lagrange's polynomials of second degree at s (m,) in [-1, 1]: (m, 3)."""
    return np.stack([0.5 * s * (s - 1), 1 - s * s, 0.5 * s * (s + 1)], axis=1)


def slopes(s: np.ndarray) -> np.ndarray:
    """Their derivatives (m, 3)."""
    return np.stack([s - 0.5, -2 * s, s + 0.5], axis=1)


def product(parts: list[Any]) -> Any:
    """The Kronecker product of three matrices or vectors, x slowest."""
    if parts[0].ndim == 1:
        return np.einsum("i,j,k->ijk", *parts).ravel()
    return sp.kron(sp.kron(parts[0], parts[1]), parts[2], format="csr")


@dataclass
class Body:
    """The discrete body on one grid: stiffness, mass, full load, free unknowns and values at the probe.

    On a tensor grid every integral is a Kronecker product of integrals along the edges: no element loop, no mesh.
    Unknowns are those of x at all nodes, then of y, then of z.
    """

    K: Any
    M: Any
    f: np.ndarray
    free: np.ndarray
    probe: Any

    @staticmethod
    def of(case: Case, count: float, mass: bool) -> Body:
        """Assembled on a grid of about `count` cells along the body; SI inside."""
        axes = [
            Axis.of(1e-3 * lines(s, case.support.cuts(i) + case.load.where.cuts(i),
                                 count * max(0.45, s / max(case.size))))
            for i, s in enumerate(case.size)
        ]  # fmt: skip
        M1 = product([a.mass for a in axes])
        M = case.density * sp.block_diag([M1] * 3, format="csr") if mass else None
        X = np.stack(np.meshgrid(*(1e3 * a.x for a in axes), indexing="ij")).reshape(3, -1)
        free = np.flatnonzero(~np.tile(inside(case.support, X, case.size), 3))
        P = np.linspace(*(1e-3 * np.array(p) for p in case.probe), 5)
        rows = np.einsum("pi,pj,pk->pijk", *(a.at(P[:, i]) for i, a in enumerate(axes))).reshape(len(P), -1)
        return Body(_stiffness(case, axes), M, _load(case, axes), free, sp.block_diag([sp.csr_matrix(rows)] * 3))

    def at_rest(self) -> np.ndarray:
        """Displacements under the full load (dofs,), m."""
        u = np.zeros(self.K.shape[0])
        u[self.free] = solved(self.K[self.free][:, self.free], self.f[self.free])
        return u

    def seen(self, u: np.ndarray) -> np.ndarray:
        """Displacements at the probe (n, 3), m."""
        found: np.ndarray = (self.probe @ u).reshape(3, -1).T
        return found


def _stiffness(case: Case, axes: list[Axis]) -> Any:
    """int sigma(u) : eps(v): blocks lam D_ij + mu (D_ji + delta_ij sum_k D_kk), D_ij = int d_i v d_j u, N/m."""
    E, nu = case.young, case.poisson
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), 0.5 * E / (1 + nu)

    def D(i: int, j: int) -> Any:  # rows v, columns u
        if i == j:
            return product([a.stiff if k == i else a.mass for k, a in enumerate(axes)])
        own = {i: axes[i].mixed.T, j: axes[j].mixed}
        return product([own.get(k, a.mass) for k, a in enumerate(axes)])

    whole = D(0, 0) + D(1, 1) + D(2, 2)
    return sp.bmat(
        [[lam * D(i, j) + mu * D(j, i) + (mu * whole if i == j else 0.0) for j in range(3)] for i in range(3)],
        format="csr",
    )


def _load(case: Case, axes: list[Axis]) -> np.ndarray:
    """Nodal forces of the full load, N: over the part of each side of the box that lies in the region."""
    where, load = case.load.where, case.load
    f = np.zeros((3, math.prod(len(a.x) for a in axes)))
    for i, side in ((i, side) for i in range(3) for side in (0, -1)):
        level = 1e3 * axes[i].x[side]
        slack = 1e-7 * max(case.size)
        if not where.low[i] - slack <= level <= where.high[i] + slack:
            continue
        if where.disc is not None and where.disc[0] != i:
            continue
        push = load.vector
        if push is None:
            push = tuple(-load.pressure * (1.0 if side else -1.0) * (k == i) for k in range(3))
        f += np.array(push)[:, None] * _over(where, axes, i, side)
    return f.ravel()


def _over(where: Region, axes: list[Axis], i: int, side: int) -> np.ndarray:
    """int N_a over the part of a side that lies in a region, m^2."""
    at = np.zeros(len(axes[i].x))
    at[side] = 1.0
    u, v = (k for k in range(3) if k != i)
    if where.disc is None:
        own = {k: axes[k].integral(1e-3 * max(where.low[k], 0.0), min(1e-3 * where.high[k], axes[k].x[-1]))
               for k in (u, v)}  # fmt: skip
        return product([at if k == i else own[k] for k in range(3)])
    _, p, q, r = (1e-3 * c for c in where.disc)
    face = np.zeros((len(axes[u].x), len(axes[v].x)))
    g, w = np.polynomial.legendre.leggauss(200)  # over the angle: smooth between the grid's lines, and nearly so across
    for angle, weight in zip(0.5 * np.pi * g, 0.5 * np.pi * w, strict=True):
        half = r * math.cos(angle)
        place = np.array([p + r * math.sin(angle)])
        face += weight * half * np.outer(axes[u].at(place)[0], axes[v].integral(q - half, q + half))
    order = "".join("iuv"[[i, u, v].index(k)] for k in range(3))
    return np.einsum(f"i,uv->{order}", at, face).ravel()


class Factored:
    """The inverse of a definite matrix: by Pardiso where it is installed, and else by SuperLU."""

    def __init__(self, A: Any) -> None:
        try:
            from pypardiso import PyPardisoSolver
        except ImportError:
            self._solve = spla.splu(A.tocsc()).solve
            return
        upper, solver = sp.csr_matrix(sp.triu(A)), PyPardisoSolver(mtype=2)
        solver.factorize(upper)
        self._solve = lambda b: solver.solve(upper, b)

    def __call__(self, b: np.ndarray) -> np.ndarray:
        return np.asarray(self._solve(np.ascontiguousarray(b, dtype=np.float64).ravel()))


def solved(A: Any, b: np.ndarray) -> np.ndarray:
    """A x = b."""
    return Factored(A)(b)


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
    inverse = spla.LinearOperator(K.shape, matvec=Factored(K))
    squares, modes = spla.eigsh(K, MODES, M, sigma=0.0, OPinv=inverse)
    pushed = modes.T @ f
    rest = np.zeros(body.K.shape[0])
    rest[body.free] = solved(K, f) - modes @ (pushed / squares)
    shapes = np.zeros((body.K.shape[0], MODES))
    shapes[body.free] = modes
    fine = _grid(case, times, 2 * np.pi / math.sqrt(squares.max()))
    q = _answer(case, squares, pushed, fine)
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


def _answer(case: Case, w2: np.ndarray, force: np.ndarray, t: np.ndarray) -> np.ndarray:
    """q(t) (m, t) of q'' + a q' + w^2 q = force c(t), from rest, c linear between the times: exact in each interval."""
    assert case.course is not None
    a = case.damping
    c = np.array([case.course.at(x) for x in t])
    root = (a * a / 4 - w2 + 0j) ** 0.5
    first, second = -a / 2 + root, -a / 2 - root
    q = v = np.zeros(len(w2), dtype=np.complex128)
    found = [q.real]
    for h, c0, c1 in zip(np.diff(t), c[:-1], c[1:], strict=True):
        slope = (c1 - c0) / h if h > 1e-9 * t[-1] / len(t) else 0.0
        # particular solution p0 + p1 s: w2 p1 = slope, a p1 + w2 p0 = c0
        p1 = force * slope / w2
        p0 = (force * c0 - a * p1) / w2
        A = ((v - p1) - second * (q - p0)) / (first - second)
        B = (q - p0) - A
        e1, e2 = A * np.exp(first * h), B * np.exp(second * h)
        q, v = e1 + e2 + p0 + p1 * h, first * e1 + second * e2 + p1
        found.append(q.real)
    return np.stack(found, axis=1)
