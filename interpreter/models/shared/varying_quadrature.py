"""Quadrature of material constants that vary within cells, with more points in cells that need them.

Constants are integrated adaptively over every cell, with bounds of their expressions and field images, so that
no narrow peak is missed (solvers/mesh/adaptive_quadrature.py). A cell keeps the points of its element if they
are accurate enough. Any other cell gets a few points with positive weights. These integrate polynomials, and
polynomials times each constant, as accurately as the adaptive rule (solvers/mesh/positive_quadrature.py). The
material law is therefore evaluated with the constants at actual points of the cell.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from softmark.interpreter.language.interval_arithmetic import bound_expression
from softmark.interpreter.language.spatial_profiles import Profile
from softmark.interpreter.problem.field_files import bounds as bounds_of_field
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.mesh.adaptive_quadrature import FineRule, adaptive_rule, reference_cell_kind
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, Rule, integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.positive_quadrature import reduce_rules

TOLERANCE = (
    1e-4  # of the integral of a constant over a cell: largest difference of two rules, of which the better is used
)
FLOOR = 1e-3  # of the mean of a constant over the body, added to its mean over a cell as the scale of errors
ENOUGH = 2e-3  # of an integral over a cell: with a smaller error a cell keeps the points of its element
PARTS = 25_000  # total number of parts of cells beyond two per cell, which take a few seconds
SPARE = 1e-9  # distance of Poisson's ratio from 0.5 below which the material is incompressible

Look = Callable[[Profile, Floats], Floats]  # function that returns a constant at points (..., 3), m


@dataclass(frozen=True)
class FunctionsOfConstants:
    """Functions of material constants to be integrated over cells.

    `values` returns the functions (g, n) at points (n, 3), m, and `bounds` their bounds over boxes. The first
    `kept` functions enter the energy. The others are inverses, whose means bound how soft a cell can be.
    """

    profiles: tuple[Profile, ...]
    values: Callable[[Floats], Floats]
    bounds: Callable[[Floats, Floats], tuple[Floats, Floats]]
    kept: int
    inverses: tuple[tuple[int, int], ...]  # pairs of indices: a function and its inverse

    @property
    def axes(self) -> Floats:
        """Mask (3,): 1 for each coordinate that a constant depends on, else 0."""
        nodes = [node for p in self.profiles for node in p.root.walk()]
        if any(node.do == "field" for node in nodes):
            return np.ones(3)
        used = {node.value for node in nodes if node.do == "axis"}
        return np.array([float(axis in used) for axis in range(3)])


def stiffness_functions(young: Any, poisson: Any, pressures: bool, look: Look) -> FunctionsOfConstants:
    """Return the moduli of a material and their inverses as functions to be integrated.

    The modulus is E if Poisson's ratio is a single number, else mu and K. With `pressures` as unknowns, the
    volumetric compliance 1/K enters the energy, and K may be infinite. `look` evaluates a varying constant at
    points.
    """
    varying = tuple(c for c in (young, poisson) if isinstance(c, Profile))
    if not isinstance(poisson, Profile):

        def alone(X: Floats) -> Floats:
            E = look(young, X)
            return np.stack([E, 1.0 / E])

        def alone_bounds(low: Floats, high: Floats) -> tuple[Floats, Floats]:
            a, b = _bounds(young, low, high)
            return np.stack([a, _safe_inverse(b)]), np.stack([b, _safe_inverse(a)])

        return FunctionsOfConstants(varying, alone, alone_bounds, 2 if pressures else 1, ((0, 1),))

    def each(X: Floats) -> Floats:
        E, nu = (look(c, X) if isinstance(c, Profile) else np.full(len(X), float(c)) for c in (young, poisson))
        return _moduli(E, np.minimum(nu, 0.5 - SPARE), pressures)

    def each_bounds(low: Floats, high: Floats) -> tuple[Floats, Floats]:
        (E0, E1), (a, b) = (_bounds(c, low, high) for c in (young, poisson))
        E0, a, b = np.maximum(E0, 0.0), np.clip(a, -1.0, 0.5 - SPARE), np.clip(b, -1.0, 0.5 - SPARE)
        with np.errstate(all="ignore"):
            mu = E0 / (2.0 + 2.0 * b), E1 / (2.0 + 2.0 * a)
            soft = 3.0 * (1.0 - 2.0 * b) / E1, 3.0 * (1.0 - 2.0 * a) / E0
        stiff = (_safe_inverse(soft[1]), _safe_inverse(soft[0]))
        second, last = (soft, stiff) if pressures else (stiff, soft)
        rows = [mu, second, (_safe_inverse(mu[1]), _safe_inverse(mu[0]))] + ([] if pressures else [last])
        return np.stack([r[0] for r in rows]), np.stack([r[1] for r in rows])

    return FunctionsOfConstants(varying, each, each_bounds, 2, ((0, 2),) if pressures else ((0, 2), (1, 3)))


def constant_functions(profile: Profile, look: Look) -> FunctionsOfConstants:
    """Return a single constant, such as a density or a muscle tension, as a function with bounds for quadrature."""

    def values(X: Floats) -> Floats:
        return look(profile, X)[None]

    def bounds(low: Floats, high: Floats) -> tuple[Floats, Floats]:
        a, b = _bounds(profile, low, high)
        return a[None], b[None]

    return FunctionsOfConstants((profile,), values, bounds, 1, ())


def _moduli(E: Floats, nu: Floats, pressures: bool) -> Floats:
    mu, K = E / (2.0 * (1.0 + nu)), E / (3.0 * (1.0 - 2.0 * nu))
    return np.stack([mu, 1.0 / K, 1.0 / mu] if pressures else [mu, K, 1.0 / mu, 1.0 / K])


def _bounds(constant: Any, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    if not isinstance(constant, Profile):
        return np.full(len(low), float(constant)), np.full(len(low), float(constant))
    found = bound_expression(constant.root, low, high, bounds_of_field)
    return found.low, found.high


def _safe_inverse(a: Floats) -> Floats:
    """Return 1 / a, infinite where a is not positive."""
    with np.errstate(all="ignore"):
        return np.where(a > 0.0, 1.0 / a, np.inf)


# ------------------------------------------------------------------ rules


@dataclass(frozen=True)
class CellRule:
    """Quadrature points of every cell: local coordinates `xi` (m, q, 3) and volumes `w` (m, q), m^3.

    Cells with fewer than q points are padded with points of zero volume at their centre. `special` (m,) marks
    cells that have other points than the quadrature of their element.
    """

    xi: Floats
    w: Floats
    special: Any

    def shape(self, mesh: Mesh) -> Floats:
        """Return shape functions N (m, q, a) at the points."""
        return mesh.element.shape(self.xi.reshape(-1, 3)).reshape(*self.w.shape, -1)

    def places(self, mesh: Mesh) -> Floats:
        """Return the positions (m, q, 3), m, of the points."""
        return np.asarray(self.shape(mesh) @ mesh.points[mesh.cells])

    def local(self, mesh: Mesh) -> tuple[Floats, Floats]:
        """Return local points (m, q, 3) and weights (m, q), which are volumes divided by the Jacobian determinant."""
        dN = mesh.element.gradient(self.xi.reshape(-1, 3)).reshape(*self.w.shape, -1, 3)
        J = np.einsum("mai,mqaj->mqij", mesh.points[mesh.cells], dN, optimize=True)
        return self.xi, self.w / np.linalg.det(J)

    def integration(self, mesh: Mesh) -> IntegrationPoints:
        """Return gradients, volumes and shape functions N (m, q, a) at the points of each cell."""
        dN = mesh.element.gradient(self.xi.reshape(-1, 3)).reshape(*self.w.shape, -1, 3)
        J = np.einsum("mai,mqaj->mqij", mesh.points[mesh.cells], dN, optimize=True)
        return IntegrationPoints(np.ascontiguousarray(dN @ np.linalg.inv(J)), self.w, self.shape(mesh))


@dataclass(frozen=True)
class CellQuadrature:
    """Quadrature of the varying constants of a material over the cells of a mesh, with its errors.

    `rule` has the quadrature points if some cells need other points than the quadrature of their element, `own`;
    otherwise it is None. `missed` (m,) is the error of the integrals over each cell, relative to `total` (kept,),
    the integrals over all cells. `unseen` (m,) is the part of that error that may be hidden between points, by
    bounds of the constants. `means` (g, m) are cell means of the functions; `least` and `largest` (g, m) are
    their extremes at points. `fine` is the adaptive rule of all cells.
    """

    rule: CellRule | None
    missed: Floats
    unseen: Floats
    means: Floats
    least: Floats
    largest: Floats
    volumes: Floats
    fine: FineRule
    own: Rule
    total: Floats


def degree_of(mesh: Mesh, mass: bool) -> int:
    """Return the polynomial degree of the integrand of stiffness or, if `mass`, of the mass matrix."""
    element = mesh.element
    simplex = reference_cell_kind(element) == "tetrahedra"
    stiff = 2 * (element.order - 1) if simplex else 2 * element.order + (element.order == 1)
    stiff = max(stiff, max(map(sum, element.monomials)) - 1)  # exact for uniform strain
    return max(2 * element.order, stiff) if mass else stiff


def polynomials(mesh: Mesh, xi: Floats, degree: int) -> Floats:
    """Return the Legendre polynomials (n, k) up to a total `degree` at local points xi (n, 3)."""
    family = reference_cell_kind(mesh.element)
    t = xi.copy()
    t[:, : {"hexahedra": 0, "wedges": 2, "tetrahedra": 3}[family]] *= 2.0
    t[:, : {"hexahedra": 0, "wedges": 2, "tetrahedra": 3}[family]] -= 1.0
    along = np.stack([np.polynomial.legendre.legval(t, np.eye(degree + 1)[k]) for k in range(degree + 1)])
    powers = [p for p in product(range(degree + 1), repeat=3) if sum(p) <= degree]
    return np.stack([along[i, :, 0] * along[j, :, 1] * along[k, :, 2] for i, j, k in powers], axis=1)


def choose_quadrature(mesh: Mesh, functions: FunctionsOfConstants, own: Rule, mass: bool) -> CellQuadrature:
    """Return quadrature points with values of constants that vary within the cells of a mesh.

    `own` is the quadrature of the element, kept in cells where it is accurate enough. `mass` states whether the
    integrand is that of the mass matrix instead of the stiffness. The result contains the integration errors, and is
    cached in the mesh. Raises the errors of evaluating a constant.
    """
    key = key_of(functions, own, mass)
    if key not in mesh.selections:
        mesh.selections[key] = _choose_quadrature(mesh, functions, own, mass)
    found: CellQuadrature = mesh.selections[key]
    return found


def key_of(functions: FunctionsOfConstants, own: Rule, mass: bool) -> Any:
    """Return the key under which the result of `choose_quadrature` is cached in `selections` of a mesh."""
    return choose_quadrature, functions.profiles, functions.kept, len(own[1]), mass


def _choose_quadrature(mesh: Mesh, functions: FunctionsOfConstants, own: Rule, mass: bool) -> CellQuadrature:
    """Return the quadrature of functions over the cells of a mesh, and its errors, without a cache."""
    count = len(mesh.cells)
    middle = np.einsum("a,mai->mi", mesh.element.shape(np.array([mesh.element.centre]))[0], mesh.points[mesh.cells])
    floor = FLOOR * np.abs(functions.values(middle)).mean(axis=1)
    degree, most = degree_of(mesh, mass), PARTS + 2 * count
    fine = adaptive_rule(mesh, functions.values, functions.bounds, TOLERANCE, most, functions.axes, floor, degree)
    sums = np.array([np.bincount(fine.cell, c * fine.w, minlength=count) for c in fine.values])
    volumes = np.bincount(fine.cell, fine.w, minlength=count).astype(np.float64)
    starts = np.searchsorted(fine.cell, np.arange(count))
    least, largest = (f.reduceat(fine.values, starts, axis=1) for f in (np.minimum, np.maximum))
    w = integrate_cells(mesh, rule=own).w
    X = np.einsum("qa,mai->mqi", mesh.element.shape(own[0]), mesh.points[mesh.cells])
    known = functions.values(X.reshape(-1, 3)).reshape(-1, *w.shape)
    kept = slice(functions.kept)
    size = np.abs(sums[kept]) + floor[kept, None] * volumes
    off = np.zeros((functions.kept, count))
    for phi_own, phi_fine in zip(
        polynomials(mesh, own[0], min(degree, mesh.element.order)).T,
        polynomials(mesh, fine.xi, min(degree, mesh.element.order)).T, strict=True,
    ):  # fmt: skip
        for g in range(functions.kept):
            there = np.bincount(fine.cell, fine.values[g] * fine.w * phi_fine, minlength=count)
            off[g] = np.maximum(off[g], np.abs((known[g] * w) @ phi_own - there))
    special = (off > ENOUGH * size).any(axis=0)
    error, hidden = fine.error[kept], fine.hidden[kept]
    wrong = np.where(special, 0.0, np.abs((known[kept] * w).sum(axis=2) - sums[kept])) + error + hidden
    total = np.abs(sums[kept]).sum(axis=1, keepdims=True)
    missed, unseen = ((each / total).max(axis=0) for each in (wrong, hidden))
    rule = None
    if special.any():
        rule, off = _rule(mesh, fine, functions.kept, own, w, special, degree)
        missed[special] += off * (size / total).max(axis=0)[special]
    means = sums / volumes
    return CellQuadrature(rule, missed, unseen, means, least, largest, volumes, fine, own, total[:, 0])


def _rule(
    mesh: Mesh, fine: FineRule, kept: int, own: Rule, w: Floats, special: Any, degree: int
) -> tuple[CellRule, Floats]:
    """Return a rule with few points in `special` cells and the element's points in others.

    The second result is the relative error of the rule in each special cell.
    """
    some = np.flatnonzero(special[fine.cell])
    numbers = np.cumsum(special) - 1
    cell = numbers[fine.cell[some]]
    phi = polynomials(mesh, fine.xi[some], degree)
    each = [phi, *(phi * (fine.values[g, some] / np.abs(fine.values[g, some]).mean())[:, None] for g in range(kept))]
    which, weights, off = reduce_rules(cell, np.concatenate(each, axis=1), fine.w[some], int(special.sum()))
    counts = np.bincount(cell[which], minlength=int(special.sum()))
    q = max(int(counts.max()), len(own[1]) if not special.all() else 0)
    xi = np.broadcast_to(np.array(mesh.element.centre), (len(w), q, 3)).copy()
    volumes = np.zeros((len(w), q))
    plain = np.flatnonzero(~special)
    if len(plain):
        xi[plain, : len(own[1])], volumes[plain, : len(own[1])] = own[0], w[plain]
    slot = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    row: Ints = np.flatnonzero(special)[cell[which]]
    xi[row, slot], volumes[row, slot] = fine.xi[some][which], weights
    return CellRule(xi, volumes, special), off
