"""Independent nodal forces of solid elements, by an assembly that shares nothing with the solver's.

The solver has compiled kernels, hand-written stresses and its own assembly, and a mistake in any of them would make a
wrong state look like an equilibrium. Here everything is plain numpy from the nodes of the mesh and their displacements:
shape functions from a Vandermonde matrix, rotations by Newton's iteration or by singular values, Hooke's law by its two
moduli, other laws by differences of the material's energy density (stress_by_differences.py), loads by the integrals
that define them. This is slower, but done only once per solution. An energy density that is itself wrong is not
detected here: closed forms and published stresses in tests/ verify it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import accumulate, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.independent_forces.quadrature_rules import extend_along_wedge, strang_rule
from softmark.solvers.independent_forces.stress_by_differences import stress_with_error

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Stress = Callable[[Floats], Floats]  # F (n, 3, 3) -> first Piola-Kirchhoff stress P (n, 3, 3), Pa

CHUNK = 16_384  # integration points at a time
MANY = 400_000  # integration points from which forces are found again at a sample of the nodes
SAMPLE = 20_000  # nodes of the sample
EPS = float(np.finfo(np.float64).eps)
AFFINE = 1e-12  # of the extent of a cell: nodes as near to their places in an affine cell are rounded
THROUGH = 1e-9  # relative to the largest radius: points farther beyond the axis are not rounding

# ------------------------------------------------------------------ shape functions from their nodes

Cell = str | int  # an element by its word in scenes, a facet by its number of nodes


@cache
def _cell_data(kind: Cell) -> Any:
    """Return the class of a cell or facet, of which only node positions and monomials are used here."""
    return CELLS[kind] if isinstance(kind, str) else FACETS[kind]


@cache
def node_positions(kind: Cell) -> Floats:
    """Return local positions of the nodes of a cell or facet (a, d), in VTK order: corners, then the others."""
    known, d = _cell_data(kind), len(_cell_data(kind).monomials[0])
    cube = [[-1, 1, 1, -1, -1, 1, 1, -1], [-1, -1, 1, 1, -1, -1, 1, 1], [-1, -1, -1, -1, 1, 1, 1, 1]]
    simplex, wedge = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], [[0, 1, 0] * 2, [0, 0, 1] * 2, [-1] * 3 + [1] * 3]
    rows = cube if is_tensor_product(kind) else wedge if is_wedge(kind) else simplex
    corners = np.array(rows, dtype=float).T[: known.corners, :d]
    return np.array([*corners, *(corners[list(ends)].mean(axis=0) for ends in known.between)])


def is_tensor_product(kind: Cell) -> bool:
    """Return whether a cell is a cube or a facet a square, not a wedge, tetrahedron or triangle."""
    return bool(_cell_data(kind).corners == 2 ** len(_cell_data(kind).monomials[0]))


def is_wedge(kind: Cell) -> bool:
    """Return whether a cell is a wedge."""
    return bool(_cell_data(kind).corners == 6)


def _monomials(xi: Floats, powers: Any) -> Floats:
    """Return xi^p eta^q zeta^r (q, a) at local points xi (q, d), for powers (a, d)."""
    towers = [[*accumulate([x] * max(int(powers.max()), 1), np.multiply)] for x in np.ascontiguousarray(xi.T)]
    found = np.ones((len(powers), len(xi)))
    for row, own in zip(found, powers, strict=True):
        for tower, power in zip(towers, own, strict=True):
            if power:
                row *= tower[power - 1]
    return found.T


@cache
def _shape_coefficients(kind: Cell) -> Floats:
    """Return the matrix (a, a) from monomials to shape functions: N_a is one at its node and zero at the others."""
    return np.asarray(
        np.linalg.inv(_monomials(node_positions(kind), np.array(_cell_data(kind).monomials))), dtype=np.float64
    )


def shape_functions(kind: Cell, xi: Floats) -> Floats:
    """Return the shape functions (..., a) at local points xi (..., d)."""
    found: Floats = _monomials(
        xi.reshape(-1, xi.shape[-1]), np.array(_cell_data(kind).monomials)
    ) @ _shape_coefficients(kind)
    return found.reshape(*xi.shape[:-1], found.shape[1])


def shape_derivatives(kind: Cell, xi: Floats) -> Floats:
    """Return dN/dxi (..., a, d) at local points xi (..., d)."""
    if xi.ndim > 2:
        flat = shape_derivatives(kind, xi.reshape(-1, xi.shape[-1]))
        return flat.reshape(*xi.shape[:-1], *flat.shape[1:])
    powers, columns = np.array(_cell_data(kind).monomials), []
    for axis in range(xi.shape[1]):
        lower = powers.copy()
        lower[:, axis] = np.maximum(powers[:, axis] - 1, 0)
        columns.append(powers[:, axis] * _monomials(xi, lower) @ _shape_coefficients(kind))
    return np.stack(columns, axis=2)


def affine_map(kind: Cell, points: Floats) -> tuple[Floats, Floats] | None:
    """Return origin b (3,) and matrix A (3, 3) if a cell with nodes `points` (a, 3) is x = A xi + b, else None."""
    centre = np.zeros((1, 3))
    A = points.T @ shape_derivatives(kind, centre)[0]
    b = (shape_functions(kind, centre) @ points)[0]
    off = np.abs(node_positions(kind) @ A.T + b - points).max()
    return (b, A) if off <= AFFINE * np.ptp(points, axis=0).max() else None


# ------------------------------------------------------------------ quadrature


@cache
def quadrature_rule(kind: Cell) -> tuple[Floats, Floats]:
    """Return local points (q, d) and weights (q,) that define the stiffness of a cell, or the load on a facet.

    Gauss rules for cubes and squares, Hammer, Marlowe and Stroud (1956) for ten-node tetrahedra, Strang and Fix (1973)
    for six-node triangles, one or three points of the triangle at two Gauss points along for wedges, else the centre.
    """
    d, many = len(_cell_data(kind).monomials[0]), len(_cell_data(kind).quadrature()[1])
    if is_wedge(kind):
        flat = node_positions(kind)[:3, :2]
        inner = flat.mean(axis=0, keepdims=True) if many == 2 else 1.0 / 6.0 + 0.5 * flat
        return extend_along_wedge((inner, np.full(len(inner), 0.5 / len(inner))), [-(3**-0.5), 3**-0.5])
    if is_tensor_product(kind):
        return _gauss_rule(kind, round(many ** (1 / d)))
    if many == 4:
        a = (5.0 - np.sqrt(5.0)) / 20.0
        return a + (1.0 - 4.0 * a) * node_positions(kind)[:4], np.full(4, 1.0 / 24.0)
    if many == 6:
        return strang_rule()
    return np.full((1, d), 1.0 / (d + 1)), np.array([1.0 / 6.0 if d == 3 else 0.5])


def _gauss_rule(kind: Cell, n: int) -> tuple[Floats, Floats]:
    """Return points and weights of the Gauss rule with n points along each direction of a cube or square."""
    corners = node_positions(kind)[: _cell_data(kind).corners]
    d = corners.shape[1]
    if n == 2:
        return corners / np.sqrt(3.0), np.ones(len(corners))
    t, w = {1: ([0.0], [2.0]), 3: ([-np.sqrt(0.6), 0.0, np.sqrt(0.6)], [5 / 9, 8 / 9, 5 / 9])}[n]
    xi = np.array(list(product(t, repeat=d)))
    return xi, np.prod(np.array(list(product(w, repeat=d))), axis=1)


def cofactor(J: Floats) -> tuple[Floats, Floats]:
    """Return the cofactor of J, its transposed inverse times the determinant (..., 3, 3), and the determinant (...)."""
    a, cof = np.ascontiguousarray(np.moveaxis(J, (-2, -1), (0, 1))), np.empty((3, 3, *J.shape[:-2]))
    for i in range(3):
        for j in range(3):
            k, l, m, n = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            cof[i, j] = a[k, m] * a[l, n] - a[k, n] * a[l, m]
    det = a[0, 0] * cof[0, 0] + a[0, 1] * cof[0, 1] + a[0, 2] * cof[0, 2]
    return np.moveaxis(cof, (0, 1), (-2, -1)), det


def shape_gradients_and_volumes(
    points: Floats, cells: Ints, kind: str, rule: tuple[Floats, Floats], depth: float = 0.0, mean: bool = False
) -> tuple[Floats, Floats, Any]:
    """Return dN/dX (m, q, a, 3), 1/m, volumes (m, q), m^3, and with `depth` N/r (m, q, a), 1/m; q = 1 if `mean`."""
    dNdX, det = gradients(points, cells, kind, rule[0])
    w, hoop = rule[1] * det, None
    if depth:
        r = interpolate(N := shape_functions(kind, rule[0]), points[cells][:, :, 0])
        w, hoop = w * (2.0 * np.pi * r / depth), N / r[..., None]
    if mean:
        V = w.sum(axis=1, keepdims=True)
        dNdX = np.einsum("mq,mqaJ->maJ", w / V, dNdX)[:, None]
        w, hoop = V, None if hoop is None else np.einsum("mq,mqa->ma", w / V, hoop)[:, None]
    return dNdX, w, hoop


def interpolate(N: Floats, nodal: Floats) -> Floats:
    """Return values (m, q) from nodal values (m, a), by shape functions of all cells (q, a), or each (m, q, a)."""
    found: Floats = (N @ nodal[:, :, None])[:, :, 0]
    return found


def gradients(points: Floats, cells: Ints, kind: str, xi: Floats) -> tuple[Floats, Floats]:
    """Return dN/dX (m, q, a, 3), 1/m, and det dX/dxi (m, q), m^3, at local points xi, (q, 3) or (m, q, 3)."""
    X = points[cells] - points[cells[:, :1]]  # differences of positions far from the origin would lose digits
    dN = shape_derivatives(kind, xi)
    cof, det = cofactor(X.swapaxes(1, 2)[:, None] @ dN)
    with np.errstate(divide="ignore", invalid="ignore"):
        return dN @ (cof / det[..., None, None]).swapaxes(2, 3), det


# ------------------------------------------------------------------ stress


def polar_rotation(F: Floats) -> Floats:
    """Return the rotations nearest to F (n, 3, 3): R <- (R + R^-T)/2 (Higham 1986), by SVD if det F <= 0."""
    R = F
    for _ in range(7):
        cof, det = cofactor(R)
        R = 0.5 * (R + cof / det[:, None, None])
    off = np.abs(np.einsum("nki,nkj->nij", R, R) - np.eye(3)).max(axis=(1, 2))
    lost = np.flatnonzero(~((off < 1e-14) & (cofactor(F)[1] > 0.0)))
    if len(lost):
        U, _, Vt = np.linalg.svd(F[lost])
        U[:, :, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[:, None]
        R[lost] = U @ Vt
    rotations: Floats = R
    return rotations


def small_strain_stress(mu: Any, lam: Any) -> Stress:
    """Return Hooke's law as a function of F: 2 mu eps + lam tr(eps) I, eps = sym(F) - I, Pa.

    The moduli, Pa, are numbers, or arrays (n,) with one value per F.
    """
    m, l = (np.reshape(modulus, (-1, 1, 1)) for modulus in (mu, lam))

    def stress(F: Floats) -> Floats:
        H = F - np.eye(3)
        eps = 0.5 * (H + H.transpose(0, 2, 1))
        P: Floats = 2.0 * m * eps + l * np.trace(eps, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        return P

    return stress


def corotational_stress(mu: Any, lam: Any) -> Stress:
    """Return Hooke's law in the frame of the polar rotation R as a function of F, Pa.

    It is R (2 mu eps + lam tr(eps) I) with eps = sym(R^T F) - I. The moduli, Pa, are numbers or arrays (n,).
    """
    hooke = small_strain_stress(mu, lam)

    def stress(F: Floats) -> Floats:
        R = polar_rotation(F)
        P: Floats = R @ hooke(R.transpose(0, 2, 1) @ F)
        return P

    return stress


# ------------------------------------------------------------------ forces within a solid


@dataclass(frozen=True)
class StressTerm:
    """A part of the stress, evaluated at each integration point or once per cell from the mean deformation gradient."""

    stress: Stress
    mean: bool = False


@dataclass(frozen=True)
class CheckedBody:
    """A deformed mesh under test: `points` (n, 3), m, `cells` (m, a), displacements `u` (n, 3), m.

    `stiff` is a modulus, Pa, for rounding errors. With `rotated_measure`, each cell has one rotation, that of its mean
    deformation gradient, and the forces of linear elasticity in that frame. If `depth`, m, is given, the mesh is a
    slice of that thickness through a body of revolution about the y axis, and forces are those of whole rings. `rules`
    are local points (m, q, 3) and weights (m, q) of each cell; None if all cells have the rule of their kind.
    """

    points: Floats
    cells: Ints
    kind: str
    u: Floats
    terms: tuple[StressTerm, ...]
    stiff: float
    rotated_measure: bool = False
    depth: float = 0.0
    rules: tuple[Floats, Floats] | None = None

    def _chunks(self, cells: Ints) -> Iterator[slice]:
        size = max(1, CHUNK // len(quadrature_rule(self.kind)[1] if self.rules is None else self.rules[1][0]))
        return (slice(start, start + size) for start in range(0, len(cells), size))

    def _rule(self, at: slice, mean: bool = False) -> tuple[Floats, Floats]:
        """Return local points, (q, 3) or (m, q, 3), and weights of the cells `at`; a `mean` needs no finer rule."""
        if self.rules is None or mean or len(node_positions(self.kind)) == 4:
            return quadrature_rule(self.kind)
        return self.rules[0][at], self.rules[1][at]

    def forces(self, cells: Ints) -> tuple[Floats, float]:
        """Return nodal internal forces (n, 3), N, of cells (m, a), and a bound of the norm of their rounding, N.

        If the body has `rules`, `cells` must be all of its cells.
        """
        g, reach = np.zeros_like(self.points), np.zeros(len(self.points))
        for at in self._chunks(cells):
            some = cells[at]
            for term in self.terms:
                local, size = self._cell_forces_with_errors(some, term, at)
                for i in range(3):
                    g[:, i] += np.bincount(some.ravel(), local[:, :, i].ravel(), minlength=len(g))
                reach += np.bincount(some.ravel(), size.ravel(), minlength=len(g))
        return g, float(np.linalg.norm(reach))

    def _cell_forces_with_errors(self, cells: Ints, term: StressTerm, at: slice) -> tuple[Floats, Floats]:
        """Return nodal forces of some cells (m, a, 3), N, and their errors by rounding and differences (m, a), N."""
        own = self.points, cells, self.kind, self._rule(at, term.mean)
        dNdX, w, hoop = shape_gradients_and_volumes(*own, self.depth, term.mean)
        U = self.u[cells] - self.u[cells[:, :1]]
        R = self._rotation(cells, U) if self.rotated_measure else np.broadcast_to(np.eye(3), (len(cells), 3, 3))
        if self.rotated_measure:  # displacements in the frame that rotates with the cell
            X = self.points[cells] - self.points[cells[:, :1]]
            U = (X + U) @ R - X
        F = U.swapaxes(1, 2)[:, None] @ dNdX + np.eye(3)
        if hoop is not None:
            F[..., 2, 2] = 1.0 + interpolate(hoop, self.u[cells][:, :, 0])
        P, error = self._stress(cells, term, F.reshape(-1, 3, 3), at)
        P = P.reshape(F.shape)
        f = (dNdX @ (w[..., None, None] * P).swapaxes(2, 3)).sum(axis=1)
        if hoop is not None:  # a ring pulls its nodes to the axis, and nothing along z
            f[:, :, 2] = 0.0
            f[:, :, 0] += interpolate(hoop.swapaxes(-1, -2), w * P[..., 2, 2])
        unsure = EPS * self.stiff * np.maximum(1.0, np.abs(F).max(axis=(2, 3)))
        unsure = unsure + np.broadcast_to(error, len(P.reshape(-1, 3, 3))).reshape(unsure.shape)
        size = np.einsum("mq,mqa->ma", np.abs(w) * unsure, np.linalg.norm(dNdX, axis=3))
        return (f @ R.transpose(0, 2, 1) if self.rotated_measure else f), size

    def _stress(self, cells: Ints, term: StressTerm, F: Floats, at: slice) -> tuple[Floats, Any]:
        """Return P (n, 3, 3), Pa, at the points of the cells with the numbers `at`, and the error of its entries, Pa.

        F (n, 3, 3) are the deformation gradients at these points.
        """
        return stress_with_error(term.stress, F)

    def _rotation(self, cells: Ints, U: Floats) -> Floats:
        """Return the rotation of each cell (m, 3, 3), from its mean deformation gradient."""
        G = shape_gradients_and_volumes(self.points, cells, self.kind, quadrature_rule(self.kind), mean=True)[0][:, 0]
        return polar_rotation(U.swapaxes(1, 2) @ G + np.eye(3))

    def volumes(self) -> tuple[Floats, Floats]:
        """Return the least det F of each cell at its integration points and nodes (m,), and its largest strain (m,).

        Strain is Green-Lagrange, which is independent of rotation. A ring that has moved through the axis counts as
        inverted, although det F > 0 if the cell is also reflected within its plane.
        """
        xi = np.concatenate([quadrature_rule(self.kind)[0], node_positions(self.kind)])
        if len(node_positions(self.kind)) == 4:  # uniform
            xi = xi[:1]
        least, most = [], []
        for at in self._chunks(self.cells):
            some = self.cells[at]
            dNdX, _ = gradients(self.points, some, self.kind, xi)
            F = (self.u[some] - self.u[some[:, :1]]).swapaxes(1, 2)[:, None] @ dNdX + np.eye(3)
            if self.depth:
                hoop = shape_gradients_and_volumes(
                    self.points, some, self.kind, quadrature_rule(self.kind), self.depth
                )[2]
                F[:, : hoop.shape[1], 2, 2] = 1.0 + interpolate(
                    hoop, self.u[some][:, :, 0]
                )  # no node: none on the axis
            J = cofactor(F)[1].min(axis=1)
            if self.depth:  # cells that have moved through the axis, according to their nodes
                through = (self.points + self.u)[some, 0] < -THROUGH * self.points[:, 0].max()
                J = np.where(through.any(axis=1), -np.abs(J), J)
            least.append(J)
            green = 0.5 * (F.swapaxes(2, 3) @ F - np.eye(3))
            most.append(np.sqrt((green**2).sum(axis=(2, 3))).max(axis=1))
        return np.concatenate(least), np.concatenate(most)


# ------------------------------------------------------------------ springs


def spring_forces(points: Floats, edges: Ints, k: Floats, u: Floats) -> tuple[Floats, float]:
    """Return nodal forces (nodes, 3), N, of springs k (n,), N/m, along `edges` (n, 2), and their rounding, N."""
    a, b = edges.T
    rest = points[b] - points[a]
    now = rest + (u[b] - u[a])
    l0, l = np.sqrt((rest**2).sum(axis=1)), np.sqrt((now**2).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        pull = np.where((l > 0.0)[:, None], (k * (l - l0) / l)[:, None] * now, 0.0)
    g = np.zeros_like(points)
    for i in range(3):
        g[:, i] = np.bincount(b, pull[:, i], minlength=len(g)) - np.bincount(a, pull[:, i], minlength=len(g))
    reach = np.bincount(edges.T.ravel(), np.tile(k * np.maximum(l, l0), 2), minlength=len(g))
    return g, EPS * float(np.linalg.norm(reach))


# ------------------------------------------------------------------ loads


def surface_forces(points: Floats, facets: Ints, push: Callable[[Floats], Floats], depth: float = 0.0) -> Floats:
    """Return nodal forces (nodes, 3), N, of a load on facets (f, k) of a surface through `points`.

    `push` returns the forces (f, q, 3), N, on outward area vectors dA (f, q, 3), m^2. If `depth`, m, is given, the
    surface is that of a slice through a body of revolution about the y axis, and forces are those on whole rings.
    """
    kind = facets.shape[1]
    xi, weights = quadrature_rule(kind)
    x = points[facets] - points[facets[:, :1]]
    t = np.einsum("fai,qaj->jfqi", x, shape_derivatives(kind, xi))
    on = push(np.cross(t[0], t[1]))
    if depth:
        on = on * (2.0 * np.pi / depth * (points[facets][:, :, 0] @ shape_functions(kind, xi).T))[:, :, None]
    force = np.einsum("q,qa,fqi->fai", weights, shape_functions(kind, xi), on)
    found = np.zeros_like(points)
    for i in range(3):
        found[:, i] = np.bincount(facets.ravel(), force[:, :, i].ravel(), minlength=len(points))
    return found


def part_forces(
    points: Floats, facets: Ints, xi: Floats, w: Floats, push: Callable[[Floats], Floats], depth: float = 0.0
) -> Floats:
    """Return nodal forces (nodes, 3), N, of a load on parts of facets (p, k).

    xi (p, 2) are local points and w (p,) their weights in local area. `push` and `depth` are as in `surface_forces`.
    """
    kind, found = facets.shape[1], np.zeros_like(points)
    x = points[facets] - points[facets[:, :1]]
    t = x.swapaxes(1, 2) @ shape_derivatives(kind, xi)  # (p, 3, 2)
    if depth:
        w = w * (2.0 * np.pi / depth * (points[facets][:, :, 0] * shape_functions(kind, xi)).sum(axis=1))
    force = w[:, None, None] * shape_functions(kind, xi)[:, :, None] * push(np.cross(t[..., 0], t[..., 1]))[:, None]
    for i in range(3):
        found[:, i] = np.bincount(facets.ravel(), force[:, :, i].ravel(), minlength=len(points))
    return found


# ------------------------------------------------------------------ balance


@dataclass(frozen=True)
class ForceBalance:
    """Norm of the unbalanced forces on free degrees of freedom, relative to loads and reactions.

    `rounding` is the part of it that may be rounding error, `nodes` the number of nodes that were evaluated.
    """

    residual: float
    rounding: float
    nodes: int


def force_balance(
    inside: Floats,
    outside: Floats,
    held: NDArray[np.bool_],
    noise: float,
    chosen: Ints | None = None,
    lacking: float = 0.0,
) -> ForceBalance:
    """Return the balance of internal forces `inside` and loads `outside` (n, 3), N.

    `held` (n, 3) marks components with reactions. `noise` is the rounding error of the forces, N. `chosen` are the
    nodes at which `inside` is complete; None means all. `lacking` is the residual of other equations, N.
    """
    some = np.arange(len(inside)) if chosen is None else chosen
    left, grown = (inside - outside)[some], np.sqrt(len(inside) / len(some))  # residual scaled to all nodes
    free = float(np.hypot(np.linalg.norm(left[~held[some]]) * grown, lacking))
    reactions = float(np.linalg.norm(left[held[some]])) * grown
    scale = max(float(np.linalg.norm(outside)), reactions)
    noise *= grown
    if scale <= 10.0 * noise:  # no loads: the residual is compared with rounding
        return ForceBalance(free / noise * EPS if noise else free, 100.0 * EPS, len(some))
    return ForceBalance(free / scale, noise / scale, len(some))


def sample_nodes(nodes: int, cells: Ints, points: int) -> tuple[Ints | None, Ints]:
    """Return the nodes to evaluate and their cells: all (None), or part of a large mesh, at random (seeded)."""
    if len(cells) * points <= MANY:
        return None, cells
    chosen = np.sort(np.random.default_rng(0).choice(nodes, min(SAMPLE, nodes), replace=False))
    mask = np.zeros(nodes, dtype=np.bool_)
    mask[chosen] = True
    return chosen, cells[mask[cells].any(axis=1)]


def is_finite(values: Sequence[Floats] | Floats) -> bool:
    """Return whether every number of one or several arrays is finite."""
    return all(bool(np.all(np.isfinite(v))) for v in values)
