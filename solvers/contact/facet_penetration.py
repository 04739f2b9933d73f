"""Search for facets that penetrate a rigid body between the contact points, and for the points to add there.

Contact is enforced at a finite set of points. Where facets penetrate most, points are added and the state is solved
again (an exchange method: Blankenship and Falk 1976, J. Optim. Theory Appl. 19:261; Hettich and Kortanek 1993,
"Semi-infinite programming", SIAM Rev. 35:380). An added point is the deepest point of a facet or of one of its sides:
an edge of the body that lies across a flat facet is deepest where it leaves the facet.

The depth of a part of the surface, G(u) = min g(x(xi, u)), changes with its motion by n = sum l_i n_i: normals near
the deepest point with l_i >= 0 of sum 1 that cancel along the part (Clarke 1983, theorem 2.8.6). For two crossing
edges this is the normal of both. So a point is kept in front of the plane with that normal at a depth of G / |n|, not
outside the body itself: it would slip past the edge of the body while the facet still penetrates. In each round both
are found again, as in Newton's method, until contact forces act where the part of the surface is deepest.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.contact.rigid_transform import RigidMotion
from softmark.solvers.contact.surface_points import SAME, AddedContactPoints, SurfacePoints
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.solvers.contact.rigid_contact import RigidContact

STEPS = 8  # of the first lattice, along a side
FINER = 13  # times that it is halved around the deepest point: to 2e-5 of a side
BESIDE = 1e-3  # of a side: where normals next to a point are taken
AROUND = 6  # of a point within a facet
BROAD, TURNS = 0.1, 0.3  # of the size of a facet: a body whose normal changes by no more so far around is followed
LARGE = 0.55  # of a part: what is searched around each of its corners
OFF = 3e-4  # of the size of a facet: what is farther from the body than this and presses is found anew
MOST = 10.0  # times this: where it is still farther, it presses on nothing
NEAR = 0.05  # of the size of a facet: what has joined and is no farther away stays for the next round
SHARE = 0.7  # of the way to where a part is deepest, that a point which has joined goes in a round
FLATTEST = 0.05  # of a normal: what is left of those beside a point on the body's ridge; less is no ridge
Gap = Callable[[Floats], Floats]
Has = Callable[[Floats], NDArray[np.bool_]]


@dataclass(frozen=True)
class FacetParts:
    """Parts of facets with local points a + t . way + s across, t (m,) in a domain, averaged over s = -1, 1.

    `facet` (k,) is the facet of each, `which` (k,) its number among all parts; a (k, 2), `way` (k, m, 2), `across` (k,
    2).
    """

    kind: Any
    facet: Ints
    which: Ints
    a: Floats
    way: Floats
    across: Floats
    low: float  # of t: from 0 or -1 to 1
    has: Has

    @property
    def m(self) -> int:
        """Number of local coordinates of a part."""
        return int(self.way.shape[1])

    def some(self, which: Ints) -> FacetParts:
        """Return the selected parts (k,)."""
        a, way, across = self.a[which], self.way[which], self.across[which]
        return FacetParts(self.kind, self.facet[which], self.which[which], a, way, across, self.low, self.has)

    def shapes(self, t: Floats) -> Floats:
        """Return shape functions (k, q, a) at t (k, q, m)."""
        xi, s = self.a[:, None] + np.einsum("kqm,kmj->kqj", t, self.way), self.across[:, None]
        return 0.5 * (self._at(xi - s) + self._at(xi + s)) if s.any() else self._at(xi)

    def _at(self, xi: Floats) -> Floats:
        """Return shape functions at local points of facets xi."""
        found: Floats = self.kind.shape(xi.reshape(-1, 2)).reshape(*xi.shape[:-1], -1)
        return found

    @cached_property
    def lattice(self) -> Floats:
        """Lattice of local coordinates t (l, m) in the domain."""
        line = self.low + (1.0 - self.low) * np.arange(STEPS + 1) / STEPS
        t = np.stack(np.meshgrid(*[line] * self.m, indexing="ij"), axis=-1).reshape(-1, self.m)
        return t[self.has(t)]

    @property
    def beside(self) -> Floats:
        """Small steps of t to the neighbourhood of a point (q, m)."""
        size = BESIDE * (1.0 - self.low)
        if self.m == 1:
            return size * np.array([[-1.0], [1.0]])
        angles = 2.0 * np.pi * (np.arange(AROUND) + 0.5) / AROUND
        return size * np.stack([np.cos(angles), np.sin(angles)], axis=1)


@dataclass(frozen=True)
class SearchedFacets:
    """Facets of a surface: nodes `of` (f, a), at rest X (f, a, 3), m; a point of one has the area A (f,), m^2.

    On a slice (`flat`) points are means through its thickness.
    """

    of: Ints
    X: Floats
    A: Floats
    flat: bool = False

    @cached_property
    def parts(self) -> tuple[FacetParts, ...]:
        """Parts to search separately: facets, and sides, which two facets may share.

        Curved facets may be deepest at two places, and are searched by overlapping halves and quarters.
        """
        kind: Any = FACETS[self.of.shape[1]]
        curved, each = kind.nodes > kind.corners, np.arange(len(self.of))
        if self.flat:
            z = self.X[:, :, 2]
            turned = np.abs(z[:, 1] - z[:, 0]) > 0.5 * np.ptp(z, axis=1)
            along = np.where(turned[:, None], (0.0, 1.0), (1.0, 0.0))
            across = 3.0**-0.5 * along[:, ::-1]
            line = FacetParts(kind, each, each, np.zeros_like(along), along[:, None], across, -1.0, _in_square)
            return (_split_parts(line, ((-1.0,), (1.0,))) if curved else line,)
        axes = np.broadcast_to(np.eye(2), (len(each), 2, 2))
        none, low, has = (
            np.zeros((len(each), 2)),
            -1.0 if kind.square else 0.0,
            _in_square if kind.square else _in_triangle,
        )
        whole, sides = FacetParts(kind, each, each, none, axes, none, low, has), self._sides(kind)
        if not curved:
            return whole, sides
        quarters = kind.rim if kind.square else ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), None)
        return _split_parts(whole, quarters), _split_parts(sides, ((0.0,), (1.0,)))

    def _sides(self, kind: Any) -> FacetParts:
        """Return the sides of facets, each shared side once."""
        corners = self.of[:, : kind.corners]
        ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        first = np.unique(ends, axis=0, return_index=True)[1]
        facet, side = np.divmod(first, kind.corners)
        rim = np.array(kind.rim)
        a, b = rim[side], np.roll(rim, -1, axis=0)[side]
        return FacetParts(
            kind, facet, len(self.of) + np.arange(len(first)), a, (b - a)[:, None], 0.0 * a, 0.0, _in_triangle
        )


def _split_parts(parts: FacetParts, corners: Any) -> FacetParts:
    """Return the pieces of parts around each of the corners; None stands for the inverted middle piece of triangles."""
    each = []
    for i, corner in enumerate(corners):
        size = -0.5 if corner is None else LARGE
        to = np.full(2, 0.5) if corner is None else (1.0 - LARGE) * np.array(corner)
        a = parts.a + np.einsum("m,kmj->kj", to, parts.way)
        each.append((parts.facet, len(corners) * parts.which + i, a, size * parts.way, parts.across))
    facet, which, a, way, across = (np.concatenate(columns) for columns in zip(*each, strict=True))
    return FacetParts(parts.kind, facet, which, a, way, across, parts.low, parts.has)


def _in_square(t: Floats) -> NDArray[np.bool_]:
    """Return whether t lies in a square, or a line, from -1 to 1."""
    return np.asarray((np.abs(t) <= 1.0).all(axis=-1))


def _in_triangle(t: Floats) -> NDArray[np.bool_]:
    """Return whether t lies in a triangle, or a line, from 0 to 1."""
    return np.asarray((t >= 0.0).all(axis=-1) & (t.sum(axis=-1) <= 1.0))


def find_penetrating_points(contact: RigidContact, x: Floats) -> AddedContactPoints | None:
    """Return the contact points to add where facets penetrate the rigid body in a state; None if none do.

    Points added before are found again, also if they press where the body does not touch. Of those without force, the
    near ones stay: without them facets could penetrate again. Facets may penetrate by as much as gaps were enlarged
    where bodies began in touch.
    """
    return search_penetration(contact, x)[0]


def search_penetration(contact: RigidContact, x: Floats) -> tuple[AddedContactPoints | None, bool]:
    """Return the points to add, and whether the state is acceptable.

    It is if nothing penetrates, and added points press close to the surface of the body.
    """
    if contact.facing is None:
        return None, True
    facets: SearchedFacets = contact.facing
    where = facets.X + x[3 * facets.of[:, :, None] + np.arange(3)]
    where = contact.seen((where * ((1.0, 1.0, 0.0) if contact.flat else 1.0)).reshape(-1, 3), x).reshape(where.shape)
    middle = where.mean(axis=1)
    radius = np.linalg.norm(where - middle[:, None], axis=2).max(axis=1)
    near = contact.body.gap(middle) < radius + contact.barrier.distance
    allowed, found, behind = -float(np.max(contact.sunk)), list[AddedContactPoints](), False
    known = () if contact.extra is None else contact.extra.which

    def gap(y: Floats) -> Floats:
        return contact.body.gap(y.reshape(-1, 3)).reshape(y.shape[:2])

    for each in facets.parts:
        parts = each.some(np.flatnonzero(near[each.facet]))
        if not len(parts.facet):
            continue
        t, g = _find_deepest_points(parts, where[parts.facet], gap, 1.0 / STEPS)
        inside = parts.has(t[:, None] + parts.beside).all(axis=1)
        held, deep = np.isin(parts.which, known) & (g < NEAR * radius.max()), inside & (g < allowed)
        if deep.any():
            deep[deep] = _is_sharp_there(
                contact, parts.some(np.flatnonzero(deep)), where[parts.facet][deep], t[deep], g[deep]
            )
        behind |= bool(deep.any())
        for on, plane in ((deep | (inside & held), _deepest_planes), (held & ~inside, _border_planes)):
            if on.any():
                some = np.flatnonzero(on)
                own = parts.some(some)
                found.append(
                    _make_added_points(contact, facets, own, *plane(contact, own, where[own.facet], t[some], g[some]))
                )
    if behind or presses_off_surface(contact, x):
        return _concatenate_movable(
            [one for one in found if len(one)], contact
        ), not behind and not presses_off_surface(contact, x, MOST)
    return None, True


def _is_sharp_there(contact: RigidContact, parts: FacetParts, where: Floats, t: Floats, g: Floats) -> NDArray[np.bool_]:
    """Return where the body has an edge or a tip at points of parts with gaps g (k,), m.

    On smooth bodies facets penetrate as chords of the round surface. This hardly affects forces, and points outside the
    body would act as if the body were larger. No chord of such a smooth body is deeper than the distance probed here.
    """
    x, size = np.einsum("kqa,kai->kqi", parts.shapes(t[:, None]), where), np.linalg.norm(np.ptp(where, axis=1), axis=1)
    ways = np.vstack([np.eye(3), -np.eye(3)]) * ((1.0, 1.0, 0.0) if contact.flat else 1.0)
    y = x + BROAD * size[:, None, None] * ways
    n = contact.body.look(y.reshape(-1, 3))[1].reshape(y.shape)
    if contact.flat:
        n[:, :, 2] = 0.0
    turns = np.linalg.norm(n[:, :, None] - n[:, None], axis=3).max(axis=(1, 2), initial=0.0)
    found: NDArray[np.bool_] = (turns > TURNS) | (g < -BROAD * size)
    return found


def presses_off_surface(contact: Any, x: Floats, times: float = 1.0) -> bool:
    """Return whether an added point presses off the surface of the body by more than a multiple of tolerance."""
    if contact.extra is None:
        return False
    joined, on = contact.places(x)[contact.lasting :], contact.pressures(x)[contact.lasting :] > 0.0
    size = float(np.linalg.norm(np.ptp(contact.facing.X, axis=1), axis=1).max())
    return bool(np.any(on & (np.abs(contact.body.gap(joined)) > contact.barrier.distance + times * OFF * size)))


def _find_deepest_points(parts: FacetParts, where: Floats, gap: Gap, reach: float = np.inf) -> tuple[Floats, Floats]:
    """Return the local coordinates (k, m) of the deepest points of parts at (k, a, 3), m, and their gaps (k,), m.

    `gap` maps (k, q, 3) to (k, q). Parts farther than `reach` times the size of their facets are searched only roughly:
    gaps are 1-Lipschitz.
    """
    lattice = parts.lattice
    N = parts.shapes(np.broadcast_to(lattice, (len(where), *lattice.shape)))
    g = gap(np.einsum("kqa,kai->kqi", N, where))
    t, best = lattice[g.argmin(axis=1)], g.min(axis=1)
    on = np.flatnonzero(best < reach * np.linalg.norm(np.ptp(where, axis=1), axis=1))
    if len(on):
        t[on], best[on] = _refine_deepest_points(parts.some(on), where[on], gap, t[on])
    return t, best


def _refine_deepest_points(parts: FacetParts, where: Floats, gap: Gap, t: Floats) -> tuple[Floats, Floats]:
    """Refine the deepest points from points of a lattice t (k, m)."""
    rows, steps = np.arange(len(where)), 0.5 * (1.0 - parts.low) / STEPS * np.arange(-2, 3)
    around = np.stack(np.meshgrid(*[steps] * parts.m, indexing="ij"), axis=-1).reshape(-1, parts.m)
    best = np.zeros(len(where))
    for level in range(FINER):
        near = t[:, None] + 0.5**level * around
        g = gap(np.einsum("kqa,kai->kqi", parts.shapes(near), where))
        g[~parts.has(near)] = np.inf
        first = g.argmin(axis=1)
        t, best = near[rows, first], g[rows, first]
    return t, best


Planes = tuple[tuple[Floats, Floats], Floats, Floats]  # t (k, m) and ways, c (k, 3), m, and normals (k, 3)


def _deepest_planes(contact: RigidContact, parts: FacetParts, where: Floats, t: Floats, g: Floats) -> Planes:
    """Return deepest points of parts, from t (k, m) with gaps g (k,), m, and the planes to keep them in front of."""
    x, y = (np.einsum("kqa,kai->kqi", parts.shapes(at), where) for at in (t[:, None], t[:, None] + parts.beside))
    n = contact.body.look(y.reshape(-1, 3))[1].reshape(y.shape)
    if contact.flat:
        n[:, :, 2] = 0.0
    normals = np.array([_common_normal(*both) for both in zip(y - x, n, strict=True)])
    size = np.linalg.norm(normals, axis=1)
    normals /= size[:, None]
    c = x[:, 0] - (g / size)[:, None] * normals
    left, out, _ = contact.body.look(c)  # beyond a corner that is near
    return _step_towards_deepest(contact, parts, t), c - left[:, None] * out, normals


def _border_planes(contact: RigidContact, parts: FacetParts, where: Floats, t: Floats, g: Floats) -> Planes:
    """Return points and planes of added points whose parts are now deepest at their border.

    The planes keep their points on the body. An edge that lies in a facet presses where it leaves the facet and at its
    end; one of them is barely deeper.
    """
    assert contact.extra is not None
    which = np.argmax(contact.extra.which == parts.which[:, None], axis=1)
    c, n = (own[which] for own in contact.planes(contact.body))
    t, _ = _find_deepest_points(parts, where, lambda y: np.asarray(np.linalg.norm(y - c[:, None], axis=2)))
    x, y = (np.einsum("kqa,kai->kqi", parts.shapes(at), where) for at in (t[:, None], t[:, None] + parts.beside))
    normals = np.array([_component_across(*both) for both in zip(y - x, n, strict=True)])
    return (t, np.full((len(t), 2, 2), np.nan)), c, normals / np.linalg.norm(normals, axis=1)[:, None]


def _make_added_points(
    contact: RigidContact,
    facets: SearchedFacets,
    parts: FacetParts,
    places: tuple[Floats, Floats],
    c: Floats,
    n: Floats,
) -> AddedContactPoints:
    """Return points of parts at `places` kept in front of planes; points at a border of their part are left out."""
    body: Any = contact.body
    t, ways = places
    own, N = RigidMotion() if not hasattr(body, "pose") else body.pose, parts.shapes(t[:, None])[:, 0]
    N = np.where(np.abs(N) > SAME, N, 0.0)
    points = SurfacePoints(
        facets.of[parts.facet], N, np.einsum("ka,kai->ki", N, facets.X[parts.facet]), facets.A[parts.facet]
    )
    at = own.back(c)
    found = AddedContactPoints(
        points, parts.which, np.pad(t, ((0, 0), (0, 2 - parts.m))), ways, at, own.back(c + n) - at
    )
    return found.some(np.flatnonzero(parts.has(t[:, None] + parts.beside).all(axis=1)))


def _step_towards_deepest(contact: RigidContact, parts: FacetParts, t: Floats) -> tuple[Floats, Floats]:
    """Return new places on parts (k, m) of added points on their way to the deepest points t, and their last steps.

    The part tilts towards the force, and the deepest point moves away: full steps would oscillate. So the first step is
    a fraction, and later ones use the last two steps (Anderson 1965, of depth one). Any point of a flat part is as far
    from its plane as the deepest.
    """
    new, ways = t.copy(), np.full((len(t), 2, 2), np.nan)
    if contact.extra is None:
        return new, ways
    old, m = contact.extra, parts.m
    for i, j in np.transpose(np.intersect1d(old.which, parts.which, return_indices=True)[1:]):
        now, r = old.t[i, :m], t[j] - old.t[i, :m]
        before, r0 = old.ways[i, :, :m]
        fall = r - r0
        along = float(fall @ r) / max(float(fall @ fall), 1e-300)
        step = SHARE * r - along * (now - before + SHARE * fall)
        step = step if np.linalg.norm(step) < 2.0 * np.linalg.norm(r) else SHARE * r  # nothing is known, or too little
        new[j], ways[j, 0, :m], ways[j, 1, :m] = now + step, now, r
    outside = ~parts.has(new[:, None] + parts.beside).all(axis=1)
    new[outside] = t[outside]
    return new, ways


def _common_normal(ways: Floats, n: Floats) -> Floats:
    """Return the weighted mean (3,) of the normals n around a point with the least component along the part.

    The normals n (q, 3) are those at small steps `ways` (q, 3), m, from the point along the part. The mean is never
    zero: if all normals cancel, the point is as deep as possible, half-way between sides, and any of them leads out.
    """
    from scipy.optimize import nnls  # half a second of modules, for what is sharp alone

    sides = _tangent_basis(ways)
    along = np.vstack([*(n @ side for side in sides), np.ones(len(n))])
    found = _component_across(ways, nnls(along, np.array([*np.zeros(len(sides)), 1.0]))[0] @ n)
    means = (found, np.asarray(n.mean(axis=0)))
    return next((one for one in means if float(np.linalg.norm(one)) > FLATTEST), n[0])


def _component_across(ways: Floats, n: Floats) -> Floats:
    """Return the component of a normal (3,) across a part, given vectors along it (q, 3)."""
    sides = _tangent_basis(ways)
    found: Floats = n - sides.T @ (sides @ n)
    return found


def _tangent_basis(ways: Floats) -> Floats:
    """Return orthonormal vectors along a part (1 or 2, 3)."""
    found: Floats = np.linalg.svd(ways, full_matrices=False)[2][: 1 if len(ways) == 2 else 2]
    return found


def _concatenate_movable(found: list[AddedContactPoints], contact: RigidContact) -> AddedContactPoints | None:
    """Return all found points with at least one movable node; None if there are none."""
    if not found:
        return None
    points = found[0].points
    for one in found[1:]:
        points = points.and_(one.points)
    which, t, ways, c, n = (
        np.concatenate([getattr(one, k) for one in found]) for k in ("which", "t", "ways", "c", "n")
    )
    loose = (np.isin(points.of, contact.nodes) & (points.shares != 0.0)).any(axis=1)
    every = AddedContactPoints(points, which, t, ways, c, n).some(np.flatnonzero(loose))
    return every if len(every) else None
