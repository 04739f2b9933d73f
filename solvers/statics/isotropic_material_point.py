"""Material point of an isotropic law in principal axes, with plain numbers instead of arrays, for speed.

This solver finds the same states as `material_point.py` does for any law: Newton's method on the logarithms of at most
three stretches and on a pressure, with the law in principal stretches (materials/principal_axes_law.py). A state takes
some tens of microseconds, and less if no stretch is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.materials.principal_axes_law import add_volume_derivatives
from softmark.solvers.statics.material_point_state import (
    FARTHEST,
    HALVINGS,
    HELD,
    ROUNDING,
    SETTLED,
    STILL,
    Floats,
    ImposedDeformation,
    PointState,
)

Rows = list[list[float]]
Free = list[tuple[float, list[int]]]  # nominal stress on free axes, Pa, and the axes that have it
NEAR = 1e-5  # below this difference of logarithmic stretches, stress differences follow from the slope
INF = math.inf


def is_applicable(drive: ImposedDeformation) -> bool:
    """Return whether this solver applies to an imposed deformation.

    It applies to stretches along the axes, and to a shear if all stretches are imposed.
    """
    given = drive.stretches.tolist()
    if any(t <= 0.0 for t in given):
        return False
    return drive.shear is None or (not any(t != t for t in given) and drive.relieved not in drive.shear[:2])


@dataclass(frozen=True, eq=False)
class PrincipalStretchSolver:
    """Isotropic law at one point, solved in principal stretches.

    For an incompressible solid, `law` is its isochoric law and `constraint` its volume constraint. For a compressible
    solid `constraint` is None.
    """

    law: Any  # a law with the method `principal`
    constraint: Any  # `VolumeRatioConstraint`, or None

    # ------------------------------------------------------------------ Newton's method

    def guess(self, drive: ImposedDeformation) -> tuple[Any, float]:
        """Return initial stretches (3,), from the linear law for logarithmic strains, and zero pressure."""
        given = drive.stretches.tolist()
        free = [a for a in range(3) if given[a] != given[a]]
        if not free:
            return given, 0.0
        log = [0.0 if t != t else math.log(t) for t in given]
        H = self._stiffness_at_rest
        found = [-sum(log) / len(free)] * len(free)
        if self.constraint is None:
            right = [-sum(H[a][b] * log[b] for b in range(3)) for a in free]
            found = _solve_small_system([[H[a][b] for b in free] for a in free], right) or found
        for a, e in zip(free, found, strict=True):
            log[a] = e
        return [math.exp(e) for e in log], 0.0

    def newton(self, drive: ImposedDeformation, start: tuple[Any, float], most: int) -> Any:
        """Return logarithms of stretches, pressure, iterations and stresses of the solution; None without convergence.

        Free axes with the same prescribed stress share one unknown stretch, because the law is isotropic. `start` has
        initial stretches and pressure; `most` is the largest number of iterations.
        """
        given, pull = drive.stretches.tolist(), drive.stresses.tolist()
        e = [math.log(s if t != t else t) for t, s in zip(given, start[0], strict=True)]
        alike: dict[float, list[int]] = {}
        for a in range(3):
            if given[a] != given[a]:
                alike.setdefault(pull[a], []).append(a)
                e[a] = e[alike[pull[a]][0]]
        free = list(alike.items())
        if not free or (self.constraint is not None and len(free) == 1):
            return self._solve_imposed_stretches(drive, e, free)
        if len(free) == 1:
            return self._solve_one_stretch(e, *free[0], most)
        p = start[1]
        at = self._residual_with_jacobian(e, p, free)
        for number in range(most):
            if at is None or (step := _solve_small_system(at[1], at[0])) is None:
                return None
            moved = self._line_step((e, p, at), free, step)
            if moved is None:
                return (e, p, number, at[2]) if max(map(abs, at[0])) <= SETTLED * self._largest_stiffness else None
            e, p, at = moved
            short = max(map(abs, step[: len(free)])) <= STILL
            if short or max(map(abs, at[0])) <= ROUNDING * self._largest_stiffness:
                return e, p, number + 1, at[2]
        return None

    def _solve_one_stretch(self, e: list[float], pull: float, axes: list[int], most: int) -> Any:
        """Return the solution of `newton` for one unknown stretch and no pressure: the most frequent case.

        e are the logarithms of stretches, `pull` the prescribed stress, Pa, on the free axes `axes`.
        """
        a, known = axes[0], self._energy_with_derivatives(e, 0.0)
        left = math.nan if known is None else known[1][a] - (pull * math.exp(e[a]) if pull else 0.0)
        for number in range(most):
            if not math.isfinite(left):
                return None
            row = known[2][a]
            slope = sum([row[b] for b in axes]) - (pull * math.exp(e[a]) if pull else 0.0)
            step, part = left / slope if slope else math.inf, 1.0
            for _ in range(HALVINGS):
                now, by = e[:], max(-FARTHEST, min(FARTHEST, part * step))
                for b in axes:
                    now[b] -= by
                then = self._energy_with_derivatives(now, 0.0)
                rest = math.nan if then is None else then[1][a] - (pull * math.exp(now[a]) if pull else 0.0)
                if abs(rest) < abs(left):
                    break
                part *= 0.5
            else:
                return (e, 0.0, number, known) if abs(left) <= SETTLED * self._largest_stiffness else None
            e, known, left = now, then, rest
            if abs(step) <= STILL or abs(left) <= ROUNDING * self._largest_stiffness:
                return e, 0.0, number + 1, known
        return None

    def _line_step(self, at: Any, free: Free, step: list[float]) -> Any:
        """Return the first point with a smaller residual along a Newton step, by halving; None if there is none."""
        e, p, (left, _, _) = at
        part, size = 1.0, math.hypot(*left)
        for _ in range(HALVINGS):
            now = e[:]
            for (_, axes), d in zip(free, step, strict=False):
                by = max(-FARTHEST, min(FARTHEST, part * d))
                for a in axes:
                    now[a] -= by
            q = p if self.constraint is None else p - part * step[-1]
            then = self._residual_with_jacobian(now, q, free)
            if then is not None and math.hypot(*then[0]) < size:
                return now, q, then
            part *= 0.5
        return None

    def _solve_imposed_stretches(self, drive: ImposedDeformation, e: list[float], free: Free) -> Any:
        """Return the solution of `newton` if the stretches follow from the imposed values and the volume constraint.

        The pressure follows from the prescribed stress on a free axis. Returns None if the volume constraint cannot be
        met.
        """
        own = e if drive.shear is None else list(_PrincipalShear.of(drive, e).e)
        if self.constraint is None:
            known = self._energy_with_derivatives(own, 0.0)
            return None if known is None else (e, 0.0, 0, known)
        pull, axes = free[0] if free else (0.0, [drive.relieved])
        if free:
            spare = sum(e) / len(axes)
            for a in axes:
                own[a] -= spare
        known, (g, first, _) = self._energy_with_derivatives(own, 0.0), self.constraint.of(math.expm1(sum(own)))
        if known is None or not abs(g) <= HELD:
            return None
        J = math.exp(sum(own))
        p = (pull * math.exp(own[axes[0]]) - known[1][axes[0]]) / (first * J)
        self._add_pressure(known, p, J)
        return e, p, 0, known

    def _residual_with_jacobian(self, e: list[float], p: float, free: Free) -> Any:
        """Return the residual, its Jacobian, and the stresses, at logarithms e of stretches and a pressure p, Pa.

        The residual has the Kirchhoff stresses on free axes minus the prescribed ones, Pa, and the volume constraint.
        Returns None outside the domain of the law.
        """
        known = self._energy_with_derivatives(e, p)
        if known is None:
            return None
        _, tau, bent = known
        left, rows = [], []
        for n, (pull, axes) in enumerate(free):
            a = axes[0]
            acting = pull * math.exp(e[a]) if pull else 0.0
            left.append(tau[a] - acting)
            row = [bent[a][other[0]] if len(other) == 1 else sum(bent[a][b] for b in other) for _, other in free]
            row[n] -= acting
            rows.append(row)
        if self.constraint is not None:
            j = math.expm1(e[0] + e[1] + e[2])
            g, first, _ = self.constraint.of(j)
            slope = first * (1.0 + j)
            for row in rows:
                row.append(slope)
            rows.append([self._largest_stiffness * slope * len(axes) for _, axes in free] + [0.0])
            left.append(self._largest_stiffness * g)
        return (left, rows, known) if math.isfinite(sum(left)) else None

    def _energy_with_derivatives(self, e: Sequence[float], p: float) -> Any:
        """Return psi, Kirchhoff stresses tau and their derivatives by e, with a pressure p, Pa; None on overflow."""
        try:
            known = self.law.principal(e)
        except (OverflowError, ZeroDivisionError):
            return None
        if type(known[0]) is not float:  # a law written with numpy only
            psi, tau, bent = known
            known = float(psi), [float(t) for t in tau], [[float(b) for b in row] for row in bent]
        if self.constraint is not None and p:
            self._add_pressure(known, p, math.exp(e[0] + e[1] + e[2]))
        return known

    def _add_pressure(self, known: Any, p: float, J: float) -> None:
        """Add the stress of a pressure p, Pa, at the volume ratio J to the stresses and derivatives `known`."""
        _, first, second = self.constraint.of(J - 1.0)
        slope = p * first * J
        add_volume_derivatives(known[1], known[2], slope, slope if second is None else slope + p * second * J * J)

    @cached_property
    def _stiffness_at_rest(self) -> Rows:
        """Stiffness of the undeformed law along the axes (3, 3), Pa."""
        found: Rows = self.law.principal((0.0, 0.0, 0.0))[2]
        return found

    @cached_property
    def _largest_stiffness(self) -> float:
        """Largest stiffness of the undeformed law, Pa."""
        return max(abs(b) for row in self._stiffness_at_rest for b in row)

    @property
    def _shear_modulus(self) -> float:
        """Shear modulus mu, Pa."""
        return 0.5 * (self._stiffness_at_rest[0][0] - self._stiffness_at_rest[0][1])

    # ------------------------------------------------------------------ results

    def complete_state(self, drive: ImposedDeformation, found: Any) -> PointState:
        """Return the complete state of a solution `found` of `newton`."""
        e, p, iterations, (psi, tau, bent) = found
        if drive.shear is not None:
            return self._build_sheared_state(drive, found)
        given, pull = drive.stretches.tolist(), drive.stresses.tolist()
        t = [math.exp(a) if s != s else s for a, s in zip(e, given, strict=True)]
        P = [a / s for a, s in zip(tau, t, strict=True)]
        free = [a for a in range(3) if given[a] != given[a]]
        H = [[bent[a][b] / (t[a] * t[b]) for b in range(3)] for a in range(3)]
        for a in range(3):
            H[a][a] -= P[a] / t[a]
        normal = None if self.constraint is None else [1.0 / s for s in t]
        some = sorted({*free, *drive.driven})
        left = max((abs(P[a] - pull[a]) for a in free), default=0.0)
        largest = max(map(abs, P))
        return PointState(
            _diagonal_matrix(t),
            _diagonal_matrix(P),
            psi,
            p,
            left / largest if largest else 0.0,
            iterations,
            _least_eigenvalue(H, normal, free) / self._shear_modulus,
            _least_eigenvalue(H, normal, some) / self._shear_modulus,
        )

    def _build_sheared_state(self, drive: ImposedDeformation, found: Any) -> PointState:
        """Return the complete state of a solution `found` with shear in the plane of two axes.

        The stretches along these axes are imposed.
        """
        assert drive.shear is not None
        a, b, g = drive.shear
        e, p, _, (psi, tau, bent) = found
        sheared = _PrincipalShear.of(drive, e)
        F, P = _diagonal_matrix(drive.stretches.tolist()), _diagonal_matrix([tau[k] / math.exp(e[k]) for k in range(3)])
        F[a, b] = g
        along, across, both = sheared.stresses_along_axes(tau, bent)
        r = sheared.ta * sheared.tb
        P[a, a], P[b, b] = along / sheared.ta - g * both / r, across / sheared.tb
        P[a, b], P[b, a] = both / sheared.tb, both / sheared.ta - g * across / r
        return PointState(F, P, psi, p, 0.0, 0, INF, sheared.stiffness(tau, bent) / self._shear_modulus)


@dataclass(frozen=True)
class _PrincipalShear:
    """Shear g of the axis a along b: principal stretches exp(m + d) and exp(m - d) in their plane.

    With ta and tb on the diagonal of F, the product of the principal stretches is ta tb, and cosh 2d = (ta^2 + tb^2 +
    g^2) / (2 ta tb).
    """

    a: int
    b: int
    g: float
    ta: float
    tb: float
    d: float
    e: tuple[float, float, float]  # logarithms of principal stretches, the larger one at a

    @classmethod
    def of(cls, drive: ImposedDeformation, e: Sequence[float]) -> _PrincipalShear:
        """Return the shear of an imposed deformation; e are the logarithms of the diagonal of F."""
        assert drive.shear is not None
        a, b, g = drive.shear
        ta, tb = math.exp(e[a]), math.exp(e[b])
        d = math.asinh(math.hypot(ta - tb, g) / (2.0 * math.sqrt(ta * tb)))
        own, m = list(e), 0.5 * (e[a] + e[b])
        own[a], own[b] = m + d, m - d
        return cls(a, b, g, ta, tb, d, (own[0], own[1], own[2]))

    def stresses_along_axes(self, tau: Sequence[float], bent: Rows) -> tuple[float, float, float]:
        """Return Kirchhoff stresses along the axes a and b, and the shear stress, Pa, from principal stresses tau.

        The stress has the principal axes of B = F F^T. `bent` are the derivatives of tau.
        """
        mean, r = 0.5 * (tau[self.a] + tau[self.b]), self.ta * self.tb
        B = self.ta**2 + self.g**2, self.tb**2, self.g * self.tb
        if self.d > NEAR:
            q = self._principal_stress_difference(tau, bent) / (2.0 * r * math.sinh(2.0 * self.d))
        else:
            q = self._stress_difference_derivative(bent) / (2.0 * r)
        half = 0.5 * q * (B[0] - B[1])
        return mean + half, mean - half, q * B[2]

    def stiffness(self, tau: Sequence[float], bent: Rows) -> float:
        """Return the second derivative d2psi/dg2, Pa, of the energy by the shear.

        It follows from d(g), whose derivative is g / (2 ta tb sinh 2d).
        """
        r = self.ta * self.tb
        if self.d == 0.0:
            return self._stress_difference_derivative(bent) / (2.0 * r)
        s = 2.0 * math.sinh(2.0 * self.d)
        slope = self.g / (r * s)
        bend = (1.0 / r - 4.0 * slope**2 * math.cosh(2.0 * self.d)) / s
        return (
            2.0 * self._stress_difference_derivative(bent) * slope**2
            + self._principal_stress_difference(tau, bent) * bend
        )

    def _principal_stress_difference(self, tau: Sequence[float], bent: Rows) -> float:
        """Return the difference of the two principal stresses in the plane, Pa."""
        return tau[self.a] - tau[self.b] if self.d > NEAR else 2.0 * self.d * self._stress_difference_derivative(bent)

    def _stress_difference_derivative(self, bent: Rows) -> float:
        """Return the derivative of the difference of the principal stresses by 2d, Pa."""
        a, b = self.a, self.b
        return 0.5 * (bent[a][a] + bent[b][b]) - bent[a][b]


def _diagonal_matrix(t: Sequence[float]) -> Floats:
    """Return a diagonal matrix (3, 3) with the entries t."""
    return np.array([[t[0], 0.0, 0.0], [0.0, t[1], 0.0], [0.0, 0.0, t[2]]])


def _solve_small_system(rows: Rows, right: list[float]) -> list[float] | None:
    """Return x of the linear system rows x = right, for up to four unknowns, by elimination; None if singular."""
    n = len(right)
    if n == 1:
        x = right[0] / rows[0][0] if rows[0][0] else math.nan
        return [x] if math.isfinite(x) else None
    M = [[*row, r] for row, r in zip(rows, right, strict=True)]
    for k in range(n):
        for i in range(k + 1, n):
            if abs(M[i][k]) > abs(M[k][k]):
                M[k], M[i] = M[i], M[k]
        pivot = M[k][k]
        if pivot == 0.0 or pivot != pivot:
            return None
        for i in range(k + 1, n):
            if (f := M[i][k] / pivot) != 0.0:
                M[i] = [b - f * a for a, b in zip(M[k], M[i], strict=True)]
    found = [0.0] * n
    for k in reversed(range(n)):
        found[k] = (M[k][n] - sum(M[k][i] * found[i] for i in range(k + 1, n))) / M[k][k]
    return found if math.isfinite(sum(found)) else None


def _least_eigenvalue(H: Rows, normal: list[float] | None, some: list[int]) -> float:
    """Return the least eigenvalue of H restricted to the axes `some`; inf without axes.

    With a constraint gradient `normal`, only directions perpendicular to it count.
    """
    n = len(some)
    if n == 0 or (normal is not None and n == 1):
        return INF
    if normal is None:
        if n == 1:
            return H[some[0]][some[0]]
        if n == 2:
            a, b = some
            return _lesser_eigenvalue(H[a][a], H[a][b], H[b][b])
        return float(np.linalg.eigvalsh(H)[0])
    if n == 2:
        a, b = some
        u, v = normal[b], -normal[a]
        return (u * u * H[a][a] + 2.0 * u * v * H[a][b] + v * v * H[b][b]) / (u * u + v * v)
    x, y = _plane_basis(normal)
    Hx, Hy = ([sum(H[a][b] * w[b] for b in range(3)) for a in range(3)] for w in (x, y))
    return _lesser_eigenvalue(_dot(x, Hx), _dot(x, Hy), _dot(y, Hy))


def _lesser_eigenvalue(a: float, b: float, c: float) -> float:
    """Return the lesser eigenvalue of the matrix [[a, b], [b, c]]."""
    return 0.5 * (a + c) - math.hypot(0.5 * (a - c), b)


def _plane_basis(n: Sequence[float]) -> tuple[list[float], list[float]]:
    """Return two orthonormal vectors perpendicular to n, a vector with positive entries."""
    size = math.hypot(n[0], n[1])
    x = [-n[1] / size, n[0] / size, 0.0]
    whole = math.hypot(size, n[2])
    return x, [-n[2] * n[0] / (size * whole), -n[2] * n[1] / (size * whole), size / whole]


def _dot(x: Sequence[float], y: Sequence[float]) -> float:
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
