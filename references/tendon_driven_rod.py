"""Tendon-driven rod as a boundary-value problem: the equations of Rucker and Webster (2011) by collocation.

In axes of the section, with strains v = R^T p', u = (R^T R')^v and internal force n = C_n (v - e1) and moment m = C_m
u,

    n' + u x n + R^T f + sum of f_i = 0,   m' + u x m + v x n + sum of a_i x f_i = 0

f the weight and f_i the force of tendon i on the rod along its route: a string under a tension T at p + R a with
curvature c = R^T (p + R a)'' pushes its guides by T (|y|^2 - y y^T) c / |y|^3, y = v + u x a + a'. Since c contains v'
and u', each station has six linear equations for them. Where tendons end, the total force of rod and tendons is
continuous: the pull T y / |y| at an anchor acts on the rod. Everything is scaled by the length and the bending
stiffness.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.references.beam_centre_line import BEYOND, as_points
from softmark.references.elastica_collocation import NotSolved
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

ROUGH, FINE = 1e-4, 1e-7
"""Tolerances of the residual, on the way to the full load and there."""

NODES = 41  # collocation nodes of every load step; one that needs many more was too large
MOST_ROUGH, MOST_NODES = 400, 20_000
SHORTEST = 1.0 / 256.0  # smallest load step, relative to the load
STATES = 13  # state variables of a station: position, quaternion, force and moment


@dataclass(frozen=True)
class TendonRoute:
    """Route of a tendon: its ends along the axis, m, its positions in the sections there, m, and its tension, N.

    `winding`, rad, is its right-handed rotation about the axis from one end to the other.
    """

    begin: float
    end: float
    first: tuple[float, float]
    last: tuple[float, float]
    winding: float
    tension: float

    def section_position(self, s: Array) -> tuple[Array, Array, Array]:
        """Return the tendon's position in the section (3, k), m, and its first and second derivatives by s.

        s (k,), m, are distances along the axis.
        """
        span = self.end - self.begin
        w, line = 1j * self.winding / span, complex(*self.first)
        rate = (complex(*self.last) * np.exp(-1j * self.winding) - line) / span
        turn = np.exp(w * (s - self.begin))
        at = turn * (line + rate * (s - self.begin))
        slope = w * at + turn * rate
        bend = w * slope + w * turn * rate
        a, b, c = (np.stack([0.0 * s, z.real, z.imag]) for z in (at, slope, bend))
        return a, b, c


@dataclass(frozen=True)
class DrivenRod:
    """Straight uniform rod, clamped at `root`, with tendons, weight and a dead force at its free end. SI units.

    `frame` are unit vectors along its axis and across it, right-handed. `stiffness` is EA, GA2, GA3, GJ, EI2, EI3.
    """

    length: float
    stiffness: tuple[float, float, float, float, float, float]
    root: Vector
    frame: tuple[Vector, Vector, Vector]
    weight: Vector  # N/m
    tip: Vector  # N
    routes: tuple[TendonRoute, ...]

    def __post_init__(self) -> None:
        if not all(math.isfinite(c) and c > 0.0 for c in (self.length, *self.stiffness)):
            raise NotApplicable("a length or a stiffness is not positive", "give positive values")
        for route in self.routes:
            if not (0.0 <= route.begin < route.end <= self.length * (1.0 + BEYOND)):
                raise NotApplicable(
                    "a tendon does not run along the beam", "give it two ends at different positions along the axis"
                )


@dataclass(frozen=True)
class RodSection:
    """Part of a tendon-driven rod along which the same tendons run; its ends are scaled by the length of the rod."""

    begin: float
    end: float
    routes: tuple[TendonRoute, ...]


class RodEquations:
    """Differential equations of a tendon-driven rod, for a fraction `share` of its loads and tensions.

    All parts of the rod (`RodSection`) are solved side by side over the coordinate z in [0, 1].
    """

    def __init__(self, rod: DrivenRod, share: float) -> None:
        L, EI = rod.length, max(rod.stiffness[4:])
        scale = L * L / EI  # of forces
        self.C = np.array(rod.stiffness) * np.array([scale] * 3 + [1.0 / EI] * 3)
        across = np.array(rod.frame)  # rows: what is in space, along the rod at rest
        self.weight = share * scale * L * (across @ np.array(rod.weight))
        self.tip = share * scale * (across @ np.array(rod.tip))
        routes = tuple(_scale_route(route, L, share * scale) for route in rod.routes)
        ends = sorted({0.0, 1.0, *(e for r in routes for e in (r.begin, r.end))})
        cuts = [0.0, *(b for a, b in itertools.pairwise(ends) if b - a > BEYOND)]
        cuts[-1] = 1.0
        self.stretches = [
            RodSection(a, b, tuple(r for r in routes if r.begin < 0.5 * (a + b) < r.end))
            for a, b in itertools.pairwise(cuts)
        ]

    def undeformed_states(self, z: Array) -> Array:
        """Return the states of the undeformed rod at coordinates z (k,) of every part, (13 parts, k)."""
        y = np.zeros((len(self.stretches), STATES, len(z)))
        y[:, 3] = 1.0
        for own, part in zip(y, self.stretches, strict=True):
            own[0] = part.begin + z * (part.end - part.begin)
        return y.reshape(-1, len(z))

    def strains(self, y: Array) -> tuple[Array, Array]:
        """Return the strains v (3, k) and u (3, k) of states y (13, k), in the notation of the module."""
        v, u = y[7:10] / self.C[:3, None], y[10:13] / self.C[3:, None]
        v[0] += 1.0
        return v, u

    def rates(self, z: Array, y: Array) -> Array:
        """Return the derivatives of all states y by z, (13 parts, k)."""
        parts = []
        for own, part in zip(np.split(y, len(self.stretches)), self.stretches, strict=True):
            span = part.end - part.begin
            parts.append(span * self._part_derivatives(part.begin + z * span, own, part.routes))
        return np.concatenate(parts)

    def _part_derivatives(self, s: Array, y: Array, routes: Sequence[TendonRoute]) -> Array:
        v, u = self.strains(y)
        R = _rotation_matrices(y[3:7])
        n, m = y[7:10], y[10:13]
        left = np.zeros((len(s), 6, 6))
        left[:] = np.diag(self.C)
        force = -_cross_products(u, n) - np.einsum("jik,j->ik", R, self.weight)
        moment = -_cross_products(u, m) - _cross_products(v, n)
        for route in routes:
            a, slope, bend = route.section_position(s)
            way = v + _cross_products(u, a) + slope
            size = np.sqrt((way * way).sum(axis=0))
            A = np.einsum("ik,jk->kij", -way, way) + (size**2)[:, None, None] * np.eye(3)
            A *= (route.tension / size**3)[:, None, None]
            hat = _cross_matrices(a)
            left[:, :3, :3] += A
            left[:, :3, 3:] -= A @ hat
            left[:, 3:, :3] += hat @ A
            left[:, 3:, 3:] -= hat @ A @ hat
            known = np.einsum("kij,jk->ik", A, _cross_products(u, way) + _cross_products(u, slope) + bend)
            force -= known
            moment -= _cross_products(a, known)
        slopes = np.linalg.solve(left, np.concatenate([force, moment]).T[:, :, None])[:, :, 0].T
        turning = 0.5 * _quaternion_rate(y[3:7], u)
        return np.concatenate([np.einsum("ijk,jk->ik", R, v), turning, self.C[:, None] * slopes])

    def carried(self, s: float, y: Array, routes: Sequence[TendonRoute]) -> Array:
        """Return the total force and moment of rod and tendons (6,) at a distance s along the axis, in section axes."""
        v, u = self.strains(y[:, None])
        total = y[7:13].copy()
        for route in routes:
            a, slope, _ = (f[:, 0] for f in route.section_position(np.array([s])))
            way = v[:, 0] + np.cross(u[:, 0], a) + slope
            pull = route.tension * way / np.sqrt(way @ way)
            total += np.concatenate([pull, np.cross(a, pull)])
        return total

    def ends(self, first: Array, last: Array) -> Array:
        """Return the boundary residual (13 parts,): clamp, continuity between parts, and free end."""
        a, b = np.split(first, len(self.stretches)), np.split(last, len(self.stretches))
        found = [a[0][:7] - np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])]
        for k, (here, there) in enumerate(itertools.pairwise(self.stretches)):
            found.append(b[k][:7] - a[k + 1][:7])
            found.append(self.carried(here.end, b[k], here.routes) - self.carried(there.begin, a[k + 1], there.routes))
        tip = _rotation_matrices(b[-1][3:7, None])[:, :, 0].T @ self.tip
        free = self.carried(1.0, b[-1], self.stretches[-1].routes)
        return np.concatenate([*found, free - np.concatenate([tip, np.zeros(3)])])


@dataclass(frozen=True)
class DrivenRodSolution:
    """Tendon-driven rod in equilibrium: the solution of every part, and its error, m."""

    rod: DrivenRod
    stretches: tuple[RodSection, ...]
    solution: Callable[[Array], Array]  # of z
    estimated_error: float

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3), m, of the undeformed body, with rigid cross-sections.

        Raises NotApplicable for points beyond the ends.
        """
        points, frame = as_points(X), np.array(self.rod.frame)
        offset = (points - np.array(self.rod.root)) @ frame.T  # (n, 3): along, across
        L = self.rod.length
        if ((offset[:, 0] < -BEYOND * L) | (offset[:, 0] > (1 + BEYOND) * L)).any():
            raise NotApplicable(
                "some points lie beyond the ends of the beam", "use points between its two end sections"
            )
        s = np.clip(offset[:, 0] / L, 0.0, 1.0)
        y = states_at(self.stretches, self.solution, s)
        offset[:, 0] = 0.0
        moved = L * y[:3].T + np.einsum("ijk,kj->ki", _rotation_matrices(y[3:7]), offset)
        found: Array = np.array(self.rod.root) + moved @ frame - points
        return found


def states_at(stretches: Sequence[RodSection], solution: Callable[[Array], Array], s: Array) -> Array:
    """Return the states (13, k) at distances s along the axis (k,), scaled by the length."""
    which = np.clip(np.searchsorted([p.end for p in stretches], s), 0, len(stretches) - 1)
    found = np.empty((STATES, len(s)))
    for k, part in enumerate(stretches):
        own = which == k
        if own.any():
            found[:, own] = solution((s[own] - part.begin) / (part.end - part.begin))[STATES * k : STATES * (k + 1)]
    return found


def solve_driven_rod(rod: DrivenRod) -> DrivenRodSolution:
    """Return the rod under its full load, reached from zero in load steps. Raises NotSolved.

    Its error is the change when every collocation interval is halved, plus rounding.
    """
    z = np.linspace(0.0, 1.0, NODES)
    y = RodEquations(rod, 0.0).undeformed_states(z)
    share, step = 0.0, 0.25
    while share < 1.0:
        there = min(1.0, share + step)
        found = _solve_boundary_problem(RodEquations(rod, there), z, y, ROUGH, MOST_ROUGH)
        if found.status == 0:
            share, y, step = there, found.sol(z), 2.0 * step
        elif (step := 0.5 * step) < SHORTEST:
            raise NotSolved(f"the load could only be raised to {100 * share:.3g} %: {found.message}", (share,))
    full = RodEquations(rod, 1.0)
    coarse = _solve_boundary_problem(full, z, y, FINE)
    halved = np.sort(np.concatenate([coarse.x, 0.5 * (coarse.x[1:] + coarse.x[:-1])]))
    fine = _solve_boundary_problem(full, halved, coarse.sol(halved), FINE)
    if fine.status != 0:
        raise NotSolved(f"the residual does not reach {FINE:.0e}: {fine.message}", tuple(coarse.rms_residuals[-1:]))
    s = np.linspace(0.0, 1.0, 201)
    apart = states_at(full.stretches, coarse.sol, s) - states_at(full.stretches, fine.sol, s)
    error = float(np.abs(apart[:7]).max()) + 1e3 * float(np.finfo(float).eps)
    return DrivenRodSolution(rod, tuple(full.stretches), fine.sol, error * rod.length)


def _solve_boundary_problem(
    equations: RodEquations, z: Array, y: Array, tolerance: float, most: int = MOST_NODES
) -> Any:
    from scipy.integrate import solve_bvp

    with np.errstate(all="ignore"):
        return solve_bvp(equations.rates, equations.ends, z, y, tol=tolerance, max_nodes=most)


def _scale_route(route: TendonRoute, length: float, force: float) -> TendonRoute:
    """Return the tendon route scaled by the length, and its tension scaled by the unit of force."""
    first, last = ((u / length, v / length) for u, v in (route.first, route.last))
    return TendonRoute(route.begin / length, route.end / length, first, last, route.winding, force * route.tension)


def _cross_products(a: Array, b: Array) -> Array:
    """Return the cross products a x b (3, k)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _cross_matrices(a: Array) -> Array:
    """Return the matrices (k, 3, 3) of the cross product a x, for vectors a (3, k)."""
    found = np.zeros((a.shape[1], 3, 3))
    found[:, 0, 1], found[:, 0, 2], found[:, 1, 2] = -a[2], a[1], -a[0]
    return found - found.swapaxes(1, 2)


def _rotation_matrices(q: Array) -> Array:
    """Return the rotation matrices R (3, 3, k) of quaternions q (4, k), scalar first, of any length."""
    w, x, y, z = q / np.sqrt((q * q).sum(axis=0))
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def _quaternion_rate(q: Array, u: Array) -> Array:
    """Return the quaternion product q u (4, k).

    It is twice the rate of quaternions q whose frames rotate by u about their own axes.
    """
    w, x, y, z = q
    return np.stack([
        -x * u[0] - y * u[1] - z * u[2], w * u[0] + y * u[2] - z * u[1],
        w * u[1] + z * u[0] - x * u[2], w * u[2] + x * u[1] - y * u[0],
    ])  # fmt: skip
