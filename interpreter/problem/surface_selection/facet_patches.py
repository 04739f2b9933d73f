"""Geometry of facets and of small triangles in them, and evaluation of conditions on both."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, cached_property
from itertools import product
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.coordinate_conditions import RELATIVE_TOLERANCE, Condition
from softmark.interpreter.problem.surface_selection.gradient_intervals import Bounds
from softmark.records import dataclass
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.elements.element import Facet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Out = Callable[[Any], Any]  # (x, y, z) of a facet -> of the body's surface

ONE = 5e-7  # relative to the largest level: closer borders are the same
WITHIN = np.array([(0.11, 0.23), (0.53, 0.17), (0.29, 0.61)])  # local points of any facet
STRAIGHT = 1e-10  # relative tolerance of parallel sides


@dataclass(frozen=True)
class Patches:
    """Facets of a body by the positions of their nodes, `corners` (f, k, 3), m.

    `extent`, m, is the size of the body. The function `out` moves points of the facets onto the exact surface of
    the body.
    """

    corners: Floats
    extent: float
    out: Out | None = None

    @property
    def nodes(self) -> int:
        """Number of nodes of each facet."""
        return int(self.corners.shape[1])

    @property
    def facet(self) -> type[Facet]:
        """Class of the facets in solvers/elements/boundary_facets.py."""
        return FACETS[self.nodes]

    def at(self, f: Ints, xi: Floats) -> Floats:
        """Return the positions (n, q, 3), m, of points with local coordinates xi (n, q, 2) in the facets f (n,)."""
        N = self.facet.shape(xi.reshape(-1, 2)).reshape(*xi.shape[:2], self.nodes)
        X: Floats = N @ self.corners[f]
        return X

    def area(self, f: Ints, xi: Floats) -> Floats:
        """Return area vectors (n, 3), m^2 per unit of local area, at local points xi (n, 2) of the facets f (n,)."""
        tangents = self.facet.gradient(xi).swapaxes(1, 2) @ self.corners[f]  # (n, 2, 3)
        found: Floats = np.cross(tangents[:, 0], tangents[:, 1])
        return found

    def seen(self, X: Floats) -> tuple[Any, Any, Any]:
        """Return the coordinates x, y, z of facet points X (..., 3), m, moved onto the exact surface by `out`.

        Conditions are evaluated at these coordinates.
        """
        place = (X[..., 0], X[..., 1], X[..., 2])
        return place if self.out is None else self.out(place)

    @cached_property
    def triangles(self) -> tuple[Ints, Floats]:
        """Return triangles that cover all facets: the facet number (n,) and the local coordinates (n, 3, 2) of each."""
        each = np.array(self.facet.rim)[np.array(self.facet.halves)]
        f = np.repeat(np.arange(len(self.corners)), len(each))
        return f, np.tile(each, (len(self.corners), 1, 1))

    @cached_property
    def affine(self) -> Mask:
        """Mask of facets that are flat parallelograms or triangles, with straight local coordinate lines."""
        X = self.corners
        size, bent = np.ptp(X, axis=1).max(axis=1), np.zeros(len(X))
        if self.facet.square:
            bent = np.abs(X[:, 0] - X[:, 1] + X[:, 2] - X[:, 3]).max(axis=1)
        for node, ends in enumerate(self.facet.between, self.facet.corners):
            bent = np.maximum(bent, np.abs(X[:, node] - X[:, list(ends)].mean(axis=1)).max(axis=1))
        found: Mask = bent <= STRAIGHT * size
        return found

    def bounds(self, f: Ints, tri: Floats) -> tuple[Bounds, Bounds, Bounds]:
        """Return bounds of x, y and z, m, over triangles `tri` (n, 3, 2) in facets f (n,), with bounds of their slopes.

        The slopes are derivatives along the sides 01, 12 and 20. A triangle is a Bezier patch: it lies within the
        convex hull of its control points, and so do its slopes.
        """
        lattice, control, steps = _bezier(self.facet.bend)
        hull = np.einsum("ck,nki->cni", control, self.at(f, np.einsum("kj,njl->nkl", lattice, tri)))
        sides = self.facet.bend * (hull[steps[..., 1]] - hull[steps[..., 0]])  # (3, k, n, 3)
        low, high, least, most = hull.min(axis=0), hull.max(axis=0), sides.min(axis=1), sides.max(axis=1)
        x, y, z = (Bounds((low[:, i], high[:, i]), (least[:, :, i], most[:, :, i])) for i in range(3))
        return (x, y, z) if self.out is None else self.out((x, y, z))


@cache
def _bezier(n: int) -> tuple[Floats, Floats, Ints]:
    """Return data of a triangular Bezier patch of degree n.

    These are barycentric coordinates (k, 3), the matrix from values to control points (k, k), and for each side 01, 12,
    20 the pairs of control points (3, l, 2) whose differences, times n, are slopes along it.
    """
    powers = np.array([p for p in product(range(n + 1), repeat=3) if sum(p) == n])
    many = np.array([factorial(n) // math.prod(map(factorial, p)) for p in powers.tolist()])
    places = powers / n
    control = np.linalg.inv(many * np.prod(places[:, None, :] ** powers, axis=2))
    number = {tuple(p): i for i, p in enumerate(powers.tolist())}
    below = [p for p in product(range(n), repeat=3) if sum(p) == n - 1]
    steps = [[[number[_increment_exponent(p, i)] for i in (side, (side + 1) % 3)] for p in below] for side in range(3)]
    return places, np.asarray(control, dtype=np.float64), np.array(steps)


def _increment_exponent(powers: tuple[int, ...], i: int) -> tuple[int, ...]:
    return tuple(p + (j == i) for j, p in enumerate(powers))


@dataclass(frozen=True)
class ConditionOnPatches:
    """Condition on facets, with the inequalities of the condition that are already decided on a facet.

    A border is the surface on which one inequality of the condition becomes an equality; its level is the
    difference of both sides. A border is settled on a facet that it does not cut: its level there has one sign.
    `settled` (f, b) marks settled borders b of each facet f, and `settling` (f, b) has their levels there.
    """

    condition: Condition
    patches: Patches
    settled: Mask
    settling: Floats

    @staticmethod
    def of(condition: Condition, patches: Patches) -> ConditionOnPatches:
        """Return a condition on facets with no border settled yet."""
        size = (len(patches.corners), len(condition.borders))
        return ConditionOnPatches(condition, patches, np.zeros(size, dtype=np.bool_), np.zeros(size))

    def settle_constant_borders(self, f: Ints) -> ConditionOnPatches:
        """Return a copy in which borders are also settled on those facets f (n,) over which their level is constant.

        Such a border runs along a curved surface, for example a limit of the distance from the axis on a cylinder's
        side.
        """
        xi = moment_fitted_quadrature.point_positions(self.patches.nodes)
        X = self.patches.at(f, np.broadcast_to(xi, (len(f), *xi.shape)))
        settled, settling = self.settled.copy(), self.settling.copy()
        for b in range(len(self.condition.borders)):
            level = self.level(b, X)
            same = (np.ptp(level, axis=1) <= self.slack[b]) & ~self.settled[f, b]
            settled[f[same], b] = True
            settling[f[same], b] = level[same].mean(axis=1)
        return replace(self, settled=settled, settling=settling)

    @cached_property
    def slack(self) -> Floats:
        """Tolerances (b,) of the levels: a point with a smaller level counts as on the border."""
        return np.array([RELATIVE_TOLERANCE * self.patches.extent**b.power for b in self.condition.borders])

    def level(self, b: int, X: Floats) -> Floats:
        """Return the level of border b at points X (..., 3), m, of facets."""
        x, y, z = self.patches.seen(X)
        with np.errstate(all="ignore"):
            found: Floats = np.broadcast_to(self.condition.borders[b].at(x, y, z), X.shape[:-1])
        return found

    def holds(self, f: Ints, X: Floats) -> Mask:
        """Return a mask (n,): whether the condition holds at the point X (n, 3), m, of each facet f (n,)."""
        levels = [
            np.where(self.settled[f, b], self.settling[f, b], self.level(b, X))
            for b in range(len(self.condition.borders))
        ]
        found: Mask = np.broadcast_to(self.condition.holds_for_levels(levels, self.patches.extent), len(f))
        return found

    @cached_property
    def repeated_border_mask(self) -> Mask:
        """Mask of borders (b,) that coincide with an earlier border on these facets and need no further cuts."""
        found = np.zeros(len(self.condition.borders), dtype=np.bool_)
        if len(found) < 2 or not len(self.patches.corners):
            return found
        f = np.repeat(np.arange(len(self.patches.corners)), len(WITHIN))
        X = self.patches.at(f, np.tile(WITHIN, (len(self.patches.corners), 1))[:, None])[:, 0]
        before: list[Floats] = []
        for b in range(len(found)):
            level = self.level(b, X)
            top = level[np.abs(level).argmax()]
            if not abs(top) > self.slack[b] or not np.isfinite(top):  # the side of the body itself cuts nothing
                continue
            shape = level / top
            found[b] = any(np.abs(shape - other).max() <= ONE for other in before)
            before.append(shape)
        return found

    def crossed_facets(self) -> Ints:
        """Return the numbers of the facets that a border may cut."""
        f, tri = self.patches.triangles
        return np.unique(f[self.look(f, tri).crossed.any(axis=0)])

    def look(self, f: Ints, tri: Floats) -> BorderBounds:
        """Return the levels and the bounds of all borders over triangles `tri` (n, 3, 2) in facets f (n,)."""
        place, X = self.patches.bounds(f, tri), self.patches.at(f, tri)
        values, slopes, crossed = [], [], []
        for b, border in enumerate(self.condition.borders):
            v = self.level(b, X)
            with np.errstate(all="ignore"):
                D = Bounds.of(border.level.at(place), place[0]).steep
            low, high = bounds_over_triangles(v, D)
            values.append(v)
            slopes.append(D)
            cuts = not self.repeated_border_mask[b]
            crossed.append(cuts & (low < -self.slack[b]) & (high > self.slack[b]) & ~self.settled[f, b])
        return BorderBounds(values, slopes, np.array(crossed))


@dataclass(frozen=True)
class BorderBounds:
    """Levels of the borders of a condition over n triangles, with bounds of their slopes.

    For each border, `values` has the levels at the corners (n, 3), and `slopes` the lower and upper bounds of the
    slopes along the sides (3, n). `crossed` (b, n) is a mask of the borders that may cross a triangle.
    """

    values: Sequence[Floats]
    slopes: Sequence[tuple[Floats, Floats]]
    crossed: Mask


def bounds_over_triangles(v: Floats, D: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return lower and upper bounds (n,) over triangles, from corner values v (n, 3) and side slopes D (3, n)."""
    low, high = np.full(len(v), -np.inf), np.full(len(v), np.inf)
    for i in range(3):
        onward, back = (D[0][i], D[1][i]), (-D[1][i - 1], -D[0][i - 1])
        with np.errstate(invalid="ignore"):  # nan is no bound
            low = np.fmax(low, v[:, i] + np.minimum(0.0, np.minimum(onward[0], back[0])))
            high = np.fmin(high, v[:, i] + np.maximum(0.0, np.maximum(onward[1], back[1])))
    return low, high
