"""Independent forces of solids with pressure unknowns, and the residual of their volume equation.

L(u, p) = int psi_shape(F) + p g(F) - p^2 / (2 M) dV is stationary where int (P_shape + p dg/dF) : dN/dX dV balances the
loads at every node and int N_b (g - p / M) dV = 0 for every pressure. For `mixed` elements the pressures are those of
the solution under test, so that its second equation is checked as well, and 1/M = 0 needs no special case. For mean
dilatation, p is M times the mean of g over each cell. This satisfies the second equation and is inserted into the
first. For finite strain the deviatoric stress and dg/dF are differences of the energy density and of g
(stress_by_differences.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import CHUNK, EPS, Floats, Ints, Stress
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress, stress_with_error

Measure = Callable[[Floats], Floats]  # F (n, 3, 3) -> (n,), no unit


@dataclass(frozen=True)
class SplitLaw:
    """A law split into the stress of psi_shape and the volume energy M/2 g^2.

    `shape` is the stress of psi_shape, Pa, `g` the volume constraint, `dg` its derivative by F, and `grown` the
    relative change of volume. All four are functions of F (n, 3, 3). `compliance` is 1/M in 1/Pa, one for all F, or one
    for each (n,).
    """

    shape: Stress
    g: Measure
    dg: Stress
    grown: Measure
    compliance: Any


# ------------------------------------------------------------------ laws taken apart


def split_law(material: object, strain: str, young: Any, nu: Any) -> SplitLaw | None:
    """Return the law split into the part that pressures replace and the remaining part; None if it cannot be split.

    `young`, Pa, and `nu` are numbers, or arrays (n,) of points; if they are arrays, the constants of the material are
    arrays too.

    For small and corotational strain, pressures replace K = mu (r + 2/3) with r = lam/mu = 2 nu / (1 - 2 nu). For
    finite strain they replace mu (r - s) of lam, and s mu remains in the law: s = 1/3 for r >= 4/3, else the larger of
    r - 1 and -2/3.
    """
    mu, each = young / (2.0 * (1.0 + nu)), 1.0 - 2.0 * nu
    whole = each / (mu * (2.0 * nu + 2.0 / 3.0 * each))
    if strain == "small":
        return SplitLaw(
            solid_forces.small_strain_stress(mu, -2.0 / 3.0 * mu), _dilatation, _identity, _dilatation, whole
        )
    if strain == "corotational":
        return SplitLaw(
            solid_forces.corotational_stress(mu, -2.0 / 3.0 * mu),
            _corotational_dilatation,
            solid_forces.polar_rotation,
            _corotational_dilatation,
            whole,
        )
    parts = getattr(material, "finite_mixed", lambda: None)()
    if parts is None:
        return None
    shape, g = batch_constants(parts[0]).psi, parts[1].value
    with np.errstate(divide="ignore"):
        s = np.where(np.asarray(nu) >= 2.0 / 7.0, 1.0 / 3.0, np.maximum(2.0 * nu / np.asarray(each) - 1.0, -2.0 / 3.0))
    taken = each / (mu * (2.0 * nu - s * each))
    return SplitLaw(EnergyStress(shape), g, EnergyStress(g), _volume_change, taken)


def batch_constants(law: Any) -> Any:
    """Return a law that passes each batch of points its own constants, if its constants are arrays (n,).

    Other laws are returned unchanged.
    """
    from softmark.solvers.materials.heterogeneous import (
        HeterogeneousLaw,
        iterate_arrays,
    )  # imported here: not needed for uniform materials

    return HeterogeneousLaw(law) if next(iterate_arrays(law), None) is not None else law


def _identity(F: Floats) -> Floats:
    found: Floats = np.broadcast_to(np.eye(3), F.shape)
    return found


def _dilatation(F: Floats) -> Floats:
    found: Floats = np.trace(F - np.eye(3), axis1=1, axis2=2)
    return found


def _corotational_dilatation(F: Floats) -> Floats:
    R = solid_forces.polar_rotation(F)
    found: Floats = np.einsum("nij,nij->n", R, F - R)
    return found


def _volume_change(F: Floats) -> Floats:
    """Return J - 1 (n,) from the invariants of F - I, which avoids cancellation near rest."""
    H = F - np.eye(3)
    tr = np.trace(H, axis1=1, axis2=2)
    second = 0.5 * (tr**2 - np.trace(H @ H, axis1=1, axis2=2))
    found: Floats = tr + second + np.linalg.det(H)
    return found


# ------------------------------------------------------------------ forces


@dataclass(frozen=True)
class MixedBody:
    """A deformed mesh with pressures: `points` (n, 3), m, `cells` (m, a), displacements `u` (n, 3), m.

    `mu` is the shear modulus in Pa. `pressures` are those of the solution under test, Pa, positive in tension.
    Depending on the element, they are given at the corners of each cell (m, c), or once per cell (m, 1). They are None
    if they are M times the mean of g, with M finite. If `depth`, m, is given, the mesh is a slice of that thickness
    through a body of revolution about the y axis, and forces and volumes are those of whole rings. `rules` are local
    points (m, q, 3) and weights (m, q) of each cell; None if all cells have the rule of their kind.
    """

    points: Floats
    cells: Ints
    kind: str
    u: Floats
    split: SplitLaw
    mu: float
    pressures: Floats | None
    depth: float = 0.0
    rules: tuple[Floats, Floats] | None = None

    def _rule(self, some: slice) -> tuple[Floats, Floats]:
        """Return local points, (q, 3) or (c, q, 3), and weights of the cells `some`."""
        return (
            solid_forces.quadrature_rule(self.kind)
            if self.rules is None
            else (self.rules[0][some], self.rules[1][some])
        )

    def _chunks(self) -> Iterator[slice]:
        size = max(
            1, CHUNK // len(solid_forces.quadrature_rule(self.kind)[1] if self.rules is None else self.rules[1][0])
        )
        return (slice(at, at + size) for at in range(0, len(self.cells), size))

    def _deformation_and_volumes(self, some: slice) -> tuple[Floats, Floats, Floats, Floats | None]:
        """Return F (c, q, 3, 3), dN/dX (c, q, a, 3), 1/m, and volumes (c, q), m^3, at the points of the cells `some`.

        The fourth result is N_a / r (c, q, a), 1/m, for a body of revolution, and None otherwise.
        """
        xi, weights = self._rule(some)
        cells = self.cells[some]
        dNdX, det = solid_forces.gradients(self.points, cells, self.kind, xi)
        F = np.einsum("mai,mqaJ->mqiJ", self.u[cells] - self.u[cells[:, :1]], dNdX) + np.eye(3)
        if not self.depth:
            return F, dNdX, weights * det, None
        N = solid_forces.shape_functions(self.kind, xi)
        r = solid_forces.interpolate(N, self.points[cells][:, :, 0])
        F[..., 2, 2] = 1.0 + solid_forces.interpolate(N, self.u[cells][:, :, 0]) / r
        return F, dNdX, weights * det * (2.0 * np.pi * r / self.depth), N / r[..., None]

    @property
    def _pressure_indices(self) -> Ints:
        """Indices (m, b) of the pressures of each cell in the array of all pressures."""
        element = CELLS[self.kind]
        if element.pressures == "corners":  # by node: continuous, and linear between them
            return self.cells[:, : element.corners]
        return np.arange(len(self.cells))[:, None]

    def _pressure_shape_functions(self, some: slice) -> Floats:
        """Return the pressure shape functions at the points of the cells `some`, (c, q, b) or (1, q, b) for all."""
        xi, element = self._rule(some)[0], CELLS[self.kind]
        if element.pressures == "corners":
            N = solid_forces.shape_functions(element.linear, xi)
            return N if N.ndim == 3 else N[None]
        return np.ones((1, xi.shape[-2], 1))

    def forces(self) -> tuple[Floats, float, float]:
        """Return nodal forces (n, 3), the residual of the volume equations, and the rounding error of both, N.

        Residuals of the volume equations are converted to forces by mu over the mean cell edge. This gives all unknowns
        the unit of length.
        """
        f, reach, vague = np.zeros_like(self.points), np.zeros(len(self.points)), np.zeros(len(self.points))
        at = self._pressure_indices
        known = np.zeros(int(at.max()) + 1)
        lacking, V = np.zeros_like(known), np.zeros(len(self.cells))
        if self.pressures is not None:
            known[at] = self.pressures
        most = stiff = 0.0
        for some in self._chunks():
            F, dNdX, w, ring = self._deformation_and_volumes(some)
            split = self._split(some)
            whole = np.size(split.compliance) == 1
            each = np.full(w.shape, split.compliance) if whole else np.reshape(split.compliance, w.shape)
            flat, cells, V[some] = F.reshape(-1, 3, 3), self.cells[some], w.sum(axis=1)
            g = split.g(flat).reshape(w.shape)
            if self.pressures is None:
                p = np.broadcast_to(((w * g).sum(axis=1) / (w * each).sum(axis=1))[:, None], w.shape)
            else:
                N = self._pressure_shape_functions(some)
                p = solid_forces.interpolate(N, known[at[some]])
                np.add.at(lacking, at[some], solid_forces.interpolate(N.swapaxes(1, 2), w * (g - each * p)))
            stiff = max(stiff, float((1.0 / each).max())) if self.pressures is None else stiff
            P, error = stress_with_error(split.shape, flat)
            slope, off = stress_with_error(split.dg, flat)
            P = (P + p.reshape(-1, 1, 1) * slope).reshape(F.shape)
            unsure = np.abs(w) * np.broadcast_to(error + off * np.abs(p.ravel()), w.size).reshape(w.shape)
            local = np.einsum("mq,mqiJ,mqaJ->mai", w, P, dNdX, optimize=True)
            if ring is not None:  # it pulls its nodes to the axis, and nothing along z
                local[:, :, 2] = 0.0
                local[:, :, 0] += np.einsum("mq,mqa->ma", w * P[..., 2, 2], ring)
            far = np.linalg.norm(dNdX, axis=3)
            size, doubt = (np.einsum("mq,mqa->ma", part, far) for part in (np.abs(w), unsure))
            for i in range(3):
                f[:, i] += np.bincount(cells.ravel(), local[:, :, i].ravel(), minlength=len(f))
            reach += np.bincount(cells.ravel(), size.ravel(), minlength=len(f))
            vague += np.bincount(cells.ravel(), doubt.ravel(), minlength=len(f))
            most = max(most, float(np.abs(p).max()))
        rings = 2.0 * np.pi * self.points[self.cells][:, :, 0].mean() / self.depth if self.depth else 1.0
        unit = self.mu / float(np.cbrt(V.mean() / rings))
        stiff = 12.0 * self.mu + 3.0 * most + 3.0 * stiff
        noise = EPS * (stiff * float(np.linalg.norm(reach)) + unit * float(np.linalg.norm(V)))
        noise += float(np.linalg.norm(vague))
        return f, unit * float(np.linalg.norm(lacking)), noise

    def _split(self, some: slice) -> SplitLaw:
        """Return the split law at the integration points of the cells `some`."""
        return self.split

    def largest_volume_changes(self) -> tuple[float, float]:
        """Return the largest relative change of volume of a cell, and that of the whole body."""
        change, V = np.zeros(len(self.cells)), np.zeros(len(self.cells))
        for some in self._chunks():
            F, _, w, _ = self._deformation_and_volumes(some)
            change[some] = (w * self.split.grown(F.reshape(-1, 3, 3)).reshape(w.shape)).sum(axis=1)
            V[some] = w.sum(axis=1)
        return float(np.abs(change / V).max()), float(change.sum() / V.sum())
