"""Problem 3 of Land et al. (2015) once more, by its section: a body of revolution whose rings turn, refined to the end.

    .venv/bin/python tests/benchmarks/twisted_ventricle.py 4,16 6,32 8,40

Each pair is cells through the wall and along it. A point (R, Z) of the section goes to (r, z), and its ring turns by
phi, all of (R, Z) alone: three unknowns at nine nodes of a cell, and three pressures in each. What solves the scene
`ventricle-contracting` knows no such form; law, tension and fibres are its own, which have tests of their own. The
pressure's work is p times the volume inside, and everything has a potential.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from softmark.interpreter.vocabulary.fiber_words import Helix
from softmark.records import dataclass
from softmark.solvers.materials.active_stress import ActiveTension
from softmark.solvers.materials.guccione import Guccione
from softmark.solvers.materials.heterogeneous import HeterogeneousLaw
from softmark.solvers.materials.material_axes import MaterialFrame

Floats = np.ndarray[Any, np.dtype[np.float64]]

INNER, OUTER, RIM = (0.007, 0.017), (0.010, 0.020), 0.005  # m: semi-axes across and along the axis, and where it ends
PRESSURE, TENSION = 15e3, 60e3  # Pa
TIP = 0.5  # how long cells are at the tip, beside those of an even mesh
MOST, LEFT, SMALLEST = 14, 1e-9, 1e-4  # iterations of a step, the last of them by the size, and a share of the loads
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)
LEVI = np.zeros((3, 3, 3))
LEVI[[0, 1, 2], [1, 2, 0], [2, 0, 1]], LEVI[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = 1.0, -1.0


def line(x: float) -> tuple[Floats, Floats]:
    """Quadratic shape functions of a line from -1 to 1, and their slopes (3,)."""
    return np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]), np.array([x - 0.5, -2 * x, x + 0.5])


@dataclass(frozen=True)
class Section:
    """Its nodes (n, 2), cells (m, 9), and what their points of integration (q) have."""

    points: Floats
    cells: Any
    numbers: Any  # of the nodes, through the wall and along it
    B: Floats  # (m, q, 7, 27): r, r_R, r_Z, phi_R, phi_Z, z_R, z_Z of the unknowns of a cell
    R: Floats  # (m, q)
    w: Floats  # (m, q), m^3, of whole rings
    XI: Floats  # (q, 3): 1 and the local coordinates
    law: Any
    pull: Any


def section(through: int, along: int) -> Section:
    """So many cells through the wall and along it."""
    s, q = np.linspace(0.0, 1.0, 2 * through + 1), np.linspace(0.0, 1.0, 2 * along + 1)
    S, T = np.meshgrid(s, q * (TIP + (1.0 - TIP) * q), indexing="ij")
    a, b = (INNER[i] + S * (OUTER[i] - INNER[i]) for i in range(2))
    turn = T * np.arccos(-RIM / b)
    X = np.stack([(a * np.sin(turn)).ravel(), (-b * np.cos(turn)).ravel()], axis=1)
    numbers = np.arange(len(X)).reshape(S.shape)
    X[numbers[:, 0], 0], X[numbers[:, -1], 1] = 0.0, RIM
    cells = np.array([numbers[2 * i : 2 * i + 3, 2 * j : 2 * j + 3].ravel()
                      for i in range(through) for j in range(along)])  # fmt: skip
    local = [(x, y, u * v) for x, u in zip(POINTS, WEIGHTS, strict=True) for y, v in zip(POINTS, WEIGHTS, strict=True)]
    N = np.array([np.outer(line(x)[0], line(y)[0]).ravel() for x, y, _ in local])
    D = np.array([[np.outer(line(x)[1], line(y)[0]).ravel(), np.outer(line(x)[0], line(y)[1]).ravel()]
                  for x, y, _ in local])  # fmt: skip
    J = np.einsum("mai,qja->mqij", X[cells], D)
    G = np.einsum("qja,mqji->mqai", D, np.linalg.inv(J))
    R, Z = (np.einsum("qa,ma->mq", N, X[cells][..., i]) for i in range(2))
    w = 2.0 * np.pi * R * np.abs(np.linalg.det(J)) * np.array([w for _, _, w in local])
    B = np.zeros((*R.shape, 7, 27))
    of = 3 * np.arange(9)
    B[:, :, 0, of] = N
    for row, unknown, axis in ((1, 0, 0), (2, 0, 1), (3, 1, 0), (4, 1, 1), (5, 2, 0), (6, 2, 1)):
        B[:, :, row, of + unknown] = G[..., axis]
    winding = Helix(0.5 * np.pi, -0.5 * np.pi, INNER[0], INNER[1], OUTER[0], OUTER[1])
    fibres, sheets = winding.at(np.stack([R.ravel(), 0.0 * R.ravel(), Z.ravel()], axis=1))
    frame = MaterialFrame.at(fibres, sheets, R.shape)
    law, pull = (
        HeterogeneousLaw(Guccione(2e3, 8.0, 2.0, 4.0, 1.0, frame, None)),
        HeterogeneousLaw(ActiveTension(TENSION, frame)),
    )
    return Section(X, cells, numbers, B, R, w, np.array([(1.0, x, y) for x, y, _ in local]), law, pull)


def system(of: Section, u: Floats, p: Floats, load: float) -> tuple[Floats, sparse.csc_matrix]:
    """What is left at unknowns u (3 n,) and pressures p (3 m,) under a share of the loads, and its tangent."""
    m, q = of.R.shape
    dofs, own = (3 * of.cells[:, :, None] + np.arange(3)).reshape(m, 27), len(u) + np.arange(3 * m).reshape(m, 3)
    r, r_R, r_Z, f_R, f_Z, z_R, z_Z = np.moveaxis(np.einsum("mqkd,md->mqk", of.B, u[dofs]), 2, 0)
    one, zero = np.ones_like(r), np.zeros_like(r)
    F = np.stack([r_R, zero, r_Z, r * f_R, r / of.R, r * f_Z, z_R, zero, z_Z], axis=-1).reshape(-1, 3, 3)
    dF = np.zeros((m, q, 9, 7))
    for i, k, slope in ((0, 1, one), (2, 2, one), (3, 0, f_R), (3, 3, r), (4, 0, 1.0 / of.R), (5, 0, f_Z), (5, 4, r),
                        (6, 5, one), (8, 6, one)):  # fmt: skip
        dF[..., i, k] = slope
    C = np.stack([np.cross(F[:, (i + 1) % 3], F[:, (i + 2) % 3]) for i in range(3)], axis=1)
    pressed = np.einsum("mb,qb->mq", p.reshape(m, 3), of.XI).ravel()
    curved = pressed[:, None, None, None, None] * np.einsum("ikm,JLN,nmN->niJkL", LEVI, LEVI, F)
    P = (of.law.P(F) + load * of.pull.P(F) + pressed[:, None, None] * C).reshape(m, q, 9)
    H = (of.law.dPdF(F) + load * of.pull.dPdF(F) + curved).reshape(m, q, 9, 9)
    K = np.einsum("mqik,mqij,mqjl->mqkl", dF, H, dF, optimize=True)
    for k, i in ((3, 3), (4, 5)):  # r phi_R and r phi_Z are products
        K[..., 0, k] += P[..., i]
        K[..., k, 0] += P[..., i]
    stiff = np.einsum("mq,mqkd,mqkl,mqle->mde", of.w, of.B, K, of.B, optimize=True)
    swell = np.einsum("mq,mqkd,mqik,mqi,qb->mdb", of.w, of.B, dF, C.reshape(m, q, 9), of.XI, optimize=True)
    g = np.zeros(len(u) + len(p))
    np.add.at(g, dofs, np.einsum("mq,mqkd,mqik,mqi->md", of.w, of.B, dF, P, optimize=True))
    np.add.at(g, own, np.einsum("mq,mq,qb->mb", of.w, np.linalg.det(F).reshape(m, q) - 1.0, of.XI))
    entries = [(dofs, dofs, stiff), (dofs, own, swell), (own, dofs, swell.swapaxes(1, 2))]
    entries += _inflating(of, u, g, load * PRESSURE)
    rows, columns, values = (np.concatenate(each) for each in zip(*map(_flat, entries), strict=True))
    return g, sparse.csc_matrix((values, (rows, columns)), shape=(len(g), len(g)))


def _flat(entry: tuple[Any, Any, Floats]) -> tuple[Any, Any, Floats]:
    rows, columns, values = entry
    at = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return at[0].ravel(), at[1].ravel(), values.ravel()


def _inflating(of: Section, u: Floats, g: Floats, pressure: float) -> list[tuple[Any, Any, Floats]]:
    """Adds -p dV to g, V = int pi r^2 dz along the inner side; its tangent."""
    sides = np.array([of.numbers[0, j : j + 3] for j in range(0, of.numbers.shape[1] - 1, 2)])
    found = []
    for x, weight in zip(POINTS, WEIGHTS, strict=True):
        N, D = line(x)
        r, dz, c = u[3 * sides] @ N, u[3 * sides + 2] @ D, -pressure * weight * np.pi
        np.add.at(g, 3 * sides, c * 2.0 * (r * dz)[:, None] * N)
        np.add.at(g, 3 * sides + 2, c * (r * r)[:, None] * D)
        cross = c * 2.0 * r[:, None, None] * np.outer(N, D)
        found += [(3 * sides, 3 * sides, c * 2.0 * dz[:, None, None] * np.outer(N, N)),
                  (3 * sides, 3 * sides + 2, cross), (3 * sides + 2, 3 * sides, cross.swapaxes(1, 2))]  # fmt: skip
    return found


def tips(through: int, along: int) -> tuple[float, float]:
    """Where the tips of the inner and of the outer side come, m. Raises ArithmeticError where steps get too small."""
    of = section(through, along)
    u, p = (
        np.stack([of.points[:, 0], np.zeros(len(of.points)), of.points[:, 1]], axis=1).ravel(),
        np.zeros(3 * len(of.cells)),
    )
    held = np.concatenate([3 * of.numbers[:, 0], (3 * of.numbers[:, -1][:, None] + np.arange(3)).ravel()])
    free = np.setdiff1d(np.arange(len(u) + len(p)), held)
    load, step = 0.0, 0.125
    while load < 1.0:
        found = _solved(of, u, p, min(1.0, load + step), free)
        if found is None:
            step *= 0.5
            if step < SMALLEST:
                raise ArithmeticError(f"no state beyond {100.0 * load:.3g} % of the loads")
        else:
            u, p, load, step = *found, min(1.0, load + step), 1.3 * step
    return float(u[3 * of.numbers[0, 0] + 2]), float(u[3 * of.numbers[-1, 0] + 2])


def _solved(of: Section, u: Floats, p: Floats, load: float, free: Any) -> tuple[Floats, Floats] | None:
    """Unknowns and pressures of a state, from another; None where Newton's steps do not come to an end."""
    moved = np.where(np.arange(len(u)) % 3 == 1, 0.001, 1.0)  # of angles, m that they stand for
    for _ in range(MOST):
        g, K = system(of, u, p, load)
        if not np.isfinite(K.data).all():
            return None
        d = np.zeros(len(g))
        try:
            d[free] = -splu(K[free][:, free]).solve(g[free])
        except RuntimeError:
            return None
        u, p, size = u + d[: len(u)], p + d[len(u) :], float(np.abs(d[: len(u)] * moved).max()) / OUTER[0]
        if not size < 5.0:
            return None
        if size < LEFT:
            return u, p
    return None


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "cells", nargs="*", default=["4,16", "6,32"], help="through the wall and along it, as in `4,16`"
    )
    for pair in parser.parse_args().cells:
        cells = tuple(map(int, pair.split(",")))
        inner, outer = tips(*cells)
        print(f"{cells[0]} x {cells[1]} cells: {1e3 * inner:.4f} mm, {1e3 * outer:.4f} mm")
