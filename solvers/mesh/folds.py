"""Where the volume of a curved cell is not positive, proved by bounds and not looked for at points.

det dX/dxi of a ten-node tetrahedron is a cubic over it, and of an eight-node hexahedron of degree two in each local
coordinate. Such a polynomial lies between its least and its largest Bernstein coefficient, which its values on a
regular lattice give; where they do not decide, the cell is cut into eight, whose coefficients are closer, and asked
again. Source: Johnen, Remacle and Geuzaine (2013), "Geometrical validity of curvilinear finite elements".
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product
from math import comb, factorial

import numpy as np

from softmark.solvers.mesh.mesh import Floats, Ints, Mesh, jacobians

DEPTH = (
    8  # cuts at most: a cell that is undecided then is within 1e-4 of a volume of zero, and counts as folded
)
CORNERS = {
    "tet10": np.vstack([np.zeros(3), np.eye(3)]),
    "hex8": np.array(list(product((-1.0, 1.0), repeat=3))),
}


@lru_cache(maxsize=2)
def _lattice(kind: str) -> tuple[Floats, Floats, Floats]:
    """Local points (k, 3), coefficients from values there (k, k), and values there in each of eight parts (8, k, k)."""
    at, basis, parts = _of_tetrahedron() if kind == "tet10" else _of_hexahedron()
    coefficients = np.asarray(np.linalg.inv(basis(at)), dtype=np.float64)
    within: Floats = np.stack([basis(part) @ coefficients for part in parts])
    return at, coefficients, within


Made = tuple[Floats, Callable[[Floats], Floats], list[Floats]]


def _of_tetrahedron() -> Made:
    """Degree three in barycentric coordinates; corners and middles of edges make the eight parts."""
    powers = np.array([p for p in product(range(4), repeat=4) if sum(p) == 3])
    many = np.array([factorial(3) / np.prod([factorial(i) for i in p]) for p in powers])

    def basis(xi: Floats) -> Floats:
        L = np.column_stack([1.0 - xi.sum(axis=1), xi])
        found: Floats = many * np.prod(L[:, None, :] ** powers, axis=2)
        return found

    at, v = powers[:, 1:] / 3.0, CORNERS["tet10"]
    m = {(a, b): 0.5 * (v[a] + v[b]) for a in range(4) for b in range(a + 1, 4)}
    inner = [(m[0, 1], m[2, 3], m[0, 2], m[1, 2]), (m[0, 1], m[2, 3], m[1, 2], m[1, 3]),
             (m[0, 1], m[2, 3], m[1, 3], m[0, 3]), (m[0, 1], m[2, 3], m[0, 3], m[0, 2])]  # fmt: skip
    outer = [tuple(v[a] if a == b else m[min(a, b), max(a, b)] for b in range(4)) for a in range(4)]
    L = powers / 3.0
    return at, basis, [L @ np.array(four) for four in (*outer, *inner)]


def _of_hexahedron() -> Made:
    """Degree two in each of three coordinates from -1 to 1."""

    def basis(xi: Floats) -> Floats:
        t = 0.5 * (1.0 + xi)  # (m, 3)
        one = np.stack([comb(2, i) * t**i * (1.0 - t) ** (2 - i) for i in range(3)])  # (3, m, 3)
        found: Floats = np.einsum("im,jm,km->mijk", one[:, :, 0], one[:, :, 1], one[:, :, 2]).reshape(
            len(xi), 27
        )
        return found

    at = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    return at, basis, [0.5 * (at + corner) for corner in CORNERS["hex8"]]


def folded(mesh: Mesh, least: Floats) -> tuple[Ints, Floats]:
    """Cells in which det dX/dxi is somewhere at most `least` (m,), m^3, and the local point of its lowest value seen.

    None for four-node tetrahedra, whose volume is the same everywhere.
    """
    if mesh.kind not in CORNERS:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    at, coefficients, within = _lattice(mesh.kind)
    values = jacobians(mesh, at) - least[:, None]
    cell, bad = np.arange(len(values)), values.min(axis=1) <= 0.0
    for _ in range(DEPTH):
        open_ = ~bad[cell] & ((values @ coefficients.T).min(axis=1) <= 0.0)
        values, cell = values[open_], cell[open_]
        if not len(cell):
            break
        values = np.einsum("pkl,ml->mpk", within, values).reshape(-1, values.shape[1])
        cell = np.repeat(cell, 8)
        np.logical_or.at(bad, cell, values.min(axis=1) <= 0.0)
    bad[cell] = True
    found = np.flatnonzero(bad)
    fine = np.concatenate([at, *_parts(mesh.kind)])
    lowest = jacobians(Mesh(mesh.points, mesh.cells[found], mesh.kind), fine).argmin(axis=1)
    return found, fine[lowest]


def _parts(kind: str) -> list[Floats]:
    """Lattices of the eight parts of a cell."""
    return (_of_tetrahedron() if kind == "tet10" else _of_hexahedron())[2]
