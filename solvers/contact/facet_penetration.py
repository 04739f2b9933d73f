"""Search for facets that penetrate a rigid body between contact points, and for the points to add there.

Contact is enforced at a finite set of points. Where facets penetrate most, points are added and the state is solved
again. This is an exchange method (Blankenship and Falk 1976, J. Optim. Theory Appl. 19:261; Hettich and Kortanek 1993,
"Semi-infinite programming", SIAM Rev. 35:380). An added point is the deepest point of a facet or of one of its sides:
if an edge of the rigid body lies across a flat facet, the deepest point is on the side where the edge leaves the facet.

The depth of a facet or side is G(u) = min g(x(xi, u)), the smallest gap over its local coordinates xi. Its derivative
by a motion of the facet is n = sum l_i n_i, where the n_i are normals of the rigid body near the deepest point, and the
weights l_i >= 0 of sum 1 make n perpendicular to the facet (Clarke 1983, theorem 2.8.6). For two crossing edges n is
the normal of both. An added point is kept in front of a plane with this normal, at a depth of G / |n|. If it were kept
outside the rigid body itself, it would slip past the edge of the body while the facet still penetrates. In each round
the point and its plane are found again, as in Newton's method, until contact forces act at the deepest points.
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

STEPS = 8  # of the coarse lattice, along a side
FINER = 13  # number of halvings of the lattice around the deepest point: to 2e-5 of a side
BESIDE = 1e-3  # of a side: distance from a point to where neighbouring normals are evaluated
AROUND = 6  # number of neighbouring points of a point within a facet
BROAD, TURNS = 0.1, 0.3  # a body is smooth if its normal changes by at most TURNS over BROAD facet sizes
LARGE = 0.55  # of a region: size of the overlapping pieces at its corners
OFF = 3e-4  # of the facet size: points that press farther from the body than this are found again
MOST = 10.0  # times OFF: a state with forces still farther from the body is not accepted
NEAR = 0.05  # of the facet size: added points nearer than this stay for the next round
SHARE = 0.7  # part of the way to the deepest point that an added point moves in a round
FLATTEST = 0.05  # least length of a mean normal at an edge of the body; shorter means there is no edge
Gap = Callable[[Floats], Floats]
Has = Callable[[Floats], NDArray[np.bool_]]


@dataclass(frozen=True)
class FacetParts:
    """Regions of facets or of their sides; in each of the k regions the deepest point of contact is searched.

    A region has m coordinates t of its own, in a square, a triangle or a line. They map to the local facet
    coordinates a + t . way. In a plane body, whose slice has several layers of nodes, a position is the mean of
    those at a + t . way + across and a + t . way - across. `facet` (k,) is the facet of each region and `which`
    (k,) its number among all regions; `a` (k, 2), `way` (k, m, 2), `across` (k, 2). `kind` is the element class
    of the facets. The function `has` returns whether coordinates t lie in the region, and `low` is the lower
    limit of t.
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
        """Number of coordinates t of a region: 2 for a facet, 1 for a side."""
        return int(self.way.shape[1])

    def select_regions(self, which: Ints) -> FacetParts:
        """Return the selected regions, with the indices `which` (k,)."""
        a, way, across = self.a[which], self.way[which], self.across[which]
        return FacetParts(self.kind, self.facet[which], self.which[which], a, way, across, self.low, self.has)

    def shapes(self, t: Floats) -> Floats:
        """Return the shape functions (k, q, a) of facet nodes at the coordinates t (k, q, m) of each region."""
        xi, s = self.a[:, None] + np.einsum("kqm,kmj->kqj", t, self.way), self.across[:, None]
        return (
            0.5 * (self._facet_shape_functions(xi - s) + self._facet_shape_functions(xi + s))
            if s.any()
            else self._facet_shape_functions(xi)
        )

    def _facet_shape_functions(self, xi: Floats) -> Floats:
        """Return the shape functions (..., a) of facet nodes at local facet coordinates xi (..., 2)."""
        found: Floats = self.kind.shape(xi.reshape(-1, 2)).reshape(*xi.shape[:-1], -1)
        return found

    @cached_property
    def lattice(self) -> Floats:
        """Lattice of coordinates t (l, m) that covers a region."""
        line = self.low + (1.0 - self.low) * np.arange(STEPS + 1) / STEPS
        t = np.stack(np.meshgrid(*[line] * self.m, indexing="ij"), axis=-1).reshape(-1, self.m)
        return t[self.has(t)]

    @property
    def neighbour_offsets(self) -> Floats:
        """Small increments (q, m) of the coordinates t, from a point of a region to points around it."""
        size = BESIDE * (1.0 - self.low)
        if self.m == 1:
            return size * np.array([[-1.0], [1.0]])
        angles = 2.0 * np.pi * (np.arange(AROUND) + 0.5) / AROUND
        return size * np.stack([np.cos(angles), np.sin(angles)], axis=1)


@dataclass(frozen=True)
class SearchedFacets:
    """Facets of a surface that are searched for penetration: nodes `of` (f, a), at rest at X (f, a, 3), m.

    A contact point added to a facet gets the area A (f,), m^2. For a slice (`flat`) points are averaged over its
    thickness.
    """

    of: Ints
    X: Floats
    A: Floats
    flat: bool = False

    @cached_property
    def parts(self) -> tuple[FacetParts, ...]:
        """Regions that are searched separately: the facets, and their sides.

        A curved facet may be deepest at two points, so curved facets are searched in overlapping quarters and their
        sides in overlapping halves.
        """
        kind: Any = FACETS[self.of.shape[1]]
        curved, each = kind.nodes > kind.corners, np.arange(len(self.of))
        if self.flat:
            z = self.X[:, :, 2]
            turned = np.abs(z[:, 1] - z[:, 0]) > 0.5 * np.ptp(z, axis=1)
            along = np.where(turned[:, None], (0.0, 1.0), (1.0, 0.0))
            across = 3.0**-0.5 * along[:, ::-1]
            line = FacetParts(kind, each, each, np.zeros_like(along), along[:, None], across, -1.0, _is_in_square)
            return (_subdivide_regions(line, ((-1.0,), (1.0,))) if curved else line,)
        axes = np.broadcast_to(np.eye(2), (len(each), 2, 2))
        none, low, has = (
            np.zeros((len(each), 2)),
            -1.0 if kind.square else 0.0,
            _is_in_square if kind.square else _is_in_triangle,
        )
        whole, sides = FacetParts(kind, each, each, none, axes, none, low, has), self._facet_sides(kind)
        if not curved:
            return whole, sides
        quarters = kind.rim if kind.square else ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), None)
        return _subdivide_regions(whole, quarters), _subdivide_regions(sides, ((0.0,), (1.0,)))

    def _facet_sides(self, kind: Any) -> FacetParts:
        """Return the sides of facets of element class `kind`; a side shared by two facets is returned once."""
        corners = self.of[:, : kind.corners]
        ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        first = np.unique(ends, axis=0, return_index=True)[1]
        facet, side = np.divmod(first, kind.corners)
        rim = np.array(kind.rim)
        a, b = rim[side], np.roll(rim, -1, axis=0)[side]
        return FacetParts(
            kind, facet, len(self.of) + np.arange(len(first)), a, (b - a)[:, None], 0.0 * a, 0.0, _is_in_triangle
        )


def _subdivide_regions(parts: FacetParts, corners: Any) -> FacetParts:
    """Return regions split into smaller ones, one at each of the given corners.

    In the list `corners`, None stands for the inverted triangle in the middle of a triangle.
    """
    each = []
    for i, corner in enumerate(corners):
        size = -0.5 if corner is None else LARGE
        to = np.full(2, 0.5) if corner is None else (1.0 - LARGE) * np.array(corner)
        a = parts.a + np.einsum("m,kmj->kj", to, parts.way)
        each.append((parts.facet, len(corners) * parts.which + i, a, size * parts.way, parts.across))
    facet, which, a, way, across = (np.concatenate(columns) for columns in zip(*each, strict=True))
    return FacetParts(parts.kind, facet, which, a, way, across, parts.low, parts.has)


def _is_in_square(t: Floats) -> NDArray[np.bool_]:
    """Return whether coordinates t (..., m) lie in the square, or on the line, from -1 to 1."""
    return np.asarray((np.abs(t) <= 1.0).all(axis=-1))


def _is_in_triangle(t: Floats) -> NDArray[np.bool_]:
    """Return whether coordinates t (..., m) lie in the unit triangle, or on the line from 0 to 1."""
    return np.asarray((t >= 0.0).all(axis=-1) & (t.sum(axis=-1) <= 1.0))


def find_penetrating_points(contact: RigidContact, x: Floats) -> AddedContactPoints | None:
    """Return the contact points to add where facets penetrate the rigid body in a state x; None if no facet does.

    Points added earlier are found again, including points with a contact force off the surface of the body. Earlier
    points without a contact force are kept if they are near the body, since facets could penetrate again without them.
    If bodies touched at the start, gaps were enlarged there; facets may penetrate by the same amount.
    """
    return search_penetration(contact, x)[0]


def search_penetration(contact: RigidContact, x: Floats) -> tuple[AddedContactPoints | None, bool]:
    """Return the contact points to add in a state x, or None, and whether the state is acceptable.

    A state is acceptable if no facet penetrates, and contact forces on added points act close to the surface of the
    body.
    """
    if contact.facing is None:
        return None, True
    facets: SearchedFacets = contact.facing
    where = facets.X + x[3 * facets.of[:, :, None] + np.arange(3)]
    where = contact.body_coordinates((where * ((1.0, 1.0, 0.0) if contact.flat else 1.0)).reshape(-1, 3), x).reshape(
        where.shape
    )
    middle = where.mean(axis=1)
    radius = np.linalg.norm(where - middle[:, None], axis=2).max(axis=1)
    near = contact.body.gap(middle) < radius + contact.barrier.distance
    allowed, found, behind = -float(np.max(contact.sunk)), list[AddedContactPoints](), False
    known = () if contact.extra is None else contact.extra.which

    def gap(y: Floats) -> Floats:
        """Return the gaps (k, q), m, of points y (k, q, 3), m."""
        return contact.body.gap(y.reshape(-1, 3)).reshape(y.shape[:2])

    for each in facets.parts:
        parts = each.select_regions(np.flatnonzero(near[each.facet]))
        if not len(parts.facet):
            continue
        t, g = _find_deepest_points(parts, where[parts.facet], gap, 1.0 / STEPS)
        inside = parts.has(t[:, None] + parts.neighbour_offsets).all(axis=1)
        held, deep = np.isin(parts.which, known) & (g < NEAR * radius.max()), inside & (g < allowed)
        if deep.any():
            deep[deep] = _is_body_sharp_near(
                contact, parts.select_regions(np.flatnonzero(deep)), where[parts.facet][deep], t[deep], g[deep]
            )
        behind |= bool(deep.any())
        for on, plane in (
            (deep | (inside & held), _planes_at_deepest_points),
            (held & ~inside, _planes_at_region_borders),
        ):
            if on.any():
                some = np.flatnonzero(on)
                own = parts.select_regions(some)
                found.append(
                    _make_added_points(contact, facets, own, *plane(contact, own, where[own.facet], t[some], g[some]))
                )
    if behind or presses_off_surface(contact, x):
        return _concatenate_movable_points(
            [one for one in found if len(one)], contact
        ), not behind and not presses_off_surface(contact, x, MOST)
    return None, True


def _is_body_sharp_near(
    contact: RigidContact, parts: FacetParts, where: Floats, t: Floats, g: Floats
) -> NDArray[np.bool_]:
    """Return whether the rigid body has an edge or a tip near a point of each region, shape (k,).

    `where` (k, a, 3), m, are the nodes of the regions, t (k, m) the coordinates of the points and g (k,), m, their
    gaps. On a smooth body a facet penetrates only as a chord of the curved surface. This hardly affects forces, and
    added points would act as if the body were larger. On a smooth body no chord is deeper than the distance probed
    here.
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
    """Return whether a contact force on an added point acts too far from the surface of the rigid body.

    The allowed distance is the barrier distance plus `times` the tolerance.
    """
    if contact.extra is None:
        return False
    joined, on = contact.places(x)[contact.lasting :], contact.pressures(x)[contact.lasting :] > 0.0
    size = float(np.linalg.norm(np.ptp(contact.facing.X, axis=1), axis=1).max())
    return bool(np.any(on & (np.abs(contact.body.gap(joined)) > contact.barrier.distance + times * OFF * size)))


def _find_deepest_points(parts: FacetParts, where: Floats, gap: Gap, reach: float = np.inf) -> tuple[Floats, Floats]:
    """Return the coordinates t (k, m) of the deepest point of each region, and the gaps (k,), m, there.

    `where` (k, a, 3), m, are the nodes of the regions, and `gap` maps points (k, q, 3) to gaps (k, q). Gaps change by
    at most the distance between points. So regions farther from the body than `reach` times the size of their facet are
    searched only on a coarse lattice.
    """
    lattice = parts.lattice
    N = parts.shapes(np.broadcast_to(lattice, (len(where), *lattice.shape)))
    g = gap(np.einsum("kqa,kai->kqi", N, where))
    t, best = lattice[g.argmin(axis=1)], g.min(axis=1)
    on = np.flatnonzero(best < reach * np.linalg.norm(np.ptp(where, axis=1), axis=1))
    if len(on):
        t[on], best[on] = _refine_deepest_points(parts.select_regions(on), where[on], gap, t[on])
    return t, best


def _refine_deepest_points(parts: FacetParts, where: Floats, gap: Gap, t: Floats) -> tuple[Floats, Floats]:
    """Return refined coordinates t (k, m) and gaps (k,), m, of deepest points, starting from lattice points t."""
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


def _planes_at_deepest_points(contact: RigidContact, parts: FacetParts, where: Floats, t: Floats, g: Floats) -> Planes:
    """Return new coordinates of added points, and the planes (points and normals) to keep them in front of.

    t (k, m) are the coordinates of the deepest points of the regions, and g (k,), m, their gaps.
    """
    x, y = (
        np.einsum("kqa,kai->kqi", parts.shapes(at), where) for at in (t[:, None], t[:, None] + parts.neighbour_offsets)
    )
    n = contact.body.look(y.reshape(-1, 3))[1].reshape(y.shape)
    if contact.flat:
        n[:, :, 2] = 0.0
    normals = np.array([_common_normal(*both) for both in zip(y - x, n, strict=True)])
    size = np.linalg.norm(normals, axis=1)
    normals /= size[:, None]
    c = x[:, 0] - (g / size)[:, None] * normals
    left, out, _ = contact.body.look(c)  # c may lie beyond a nearby corner of the body
    return _step_towards_deepest(contact, parts, t), c - left[:, None] * out, normals


def _planes_at_region_borders(contact: RigidContact, parts: FacetParts, where: Floats, t: Floats, g: Floats) -> Planes:
    """Return coordinates and planes for added points whose regions are now deepest at their border.

    t (k, m) are the coordinates of the deepest points of the regions, and g (k,), m, their gaps. The planes keep the
    points where they are on the rigid body. Reason: if an edge of the rigid body lies in a facet, it presses at its end
    and where it leaves the facet, and one of these points is barely deeper than the other.
    """
    assert contact.extra is not None
    which = np.argmax(contact.extra.which == parts.which[:, None], axis=1)
    c, n = (own[which] for own in contact.added_point_planes(contact.body))
    t, _ = _find_deepest_points(parts, where, lambda y: np.asarray(np.linalg.norm(y - c[:, None], axis=2)))
    x, y = (
        np.einsum("kqa,kai->kqi", parts.shapes(at), where) for at in (t[:, None], t[:, None] + parts.neighbour_offsets)
    )
    normals = np.array([_component_perpendicular_to_region(*both) for both in zip(y - x, n, strict=True)])
    return (t, np.full((len(t), 2, 2), np.nan)), c, normals / np.linalg.norm(normals, axis=1)[:, None]


def _make_added_points(
    contact: RigidContact,
    facets: SearchedFacets,
    parts: FacetParts,
    coordinates_and_steps: tuple[Floats, Floats],
    plane_points: Floats,
    plane_normals: Floats,
) -> AddedContactPoints:
    """Return added contact points at given surface coordinates, each kept in front of a plane.

    `coordinates_and_steps` has the coordinates t (k, m) in the regions `parts`, and their last two changes (k, 2, 2).
    The planes go through `plane_points` (k, 3), m, with the normals `plane_normals` (k, 3). Points at the border of
    their region are left out.
    """
    body: Any = contact.body
    t, ways = coordinates_and_steps
    own, N = RigidMotion() if not hasattr(body, "pose") else body.pose, parts.shapes(t[:, None])[:, 0]
    N = np.where(np.abs(N) > SAME, N, 0.0)
    points = SurfacePoints(
        facets.of[parts.facet], N, np.einsum("ka,kai->ki", N, facets.X[parts.facet]), facets.A[parts.facet]
    )
    at = own.back(plane_points)
    found = AddedContactPoints(
        points,
        parts.which,
        np.pad(t, ((0, 0), (0, 2 - parts.m))),
        ways,
        at,
        own.back(plane_points + plane_normals) - at,
    )
    return found.select_points(np.flatnonzero(parts.has(t[:, None] + parts.neighbour_offsets).all(axis=1)))


def _step_towards_deepest(contact: RigidContact, parts: FacetParts, t: Floats) -> tuple[Floats, Floats]:
    """Return new coordinates (k, m) of added points, on the way to the deepest points t (k, m), and their last steps.

    The facet tilts under the contact force, and the deepest point moves away from it, so full steps would oscillate. So
    the first step is a fraction of the way, and later ones use the last two steps (Anderson acceleration of depth one,
    Anderson 1965). On a flat region this needs no correction of the plane: all of its points are equally far from it.
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
        step = (
            step if np.linalg.norm(step) < 2.0 * np.linalg.norm(r) else SHARE * r
        )  # too little is known for a longer step
        new[j], ways[j, 0, :m], ways[j, 1, :m] = now + step, now, r
    outside = ~parts.has(new[:, None] + parts.neighbour_offsets).all(axis=1)
    new[outside] = t[outside]
    return new, ways


def _common_normal(ways: Floats, n: Floats) -> Floats:
    """Return the weighted mean (3,) of normals around a point with the smallest component along the region.

    The normals n (q, 3) are those of the rigid body at small steps `ways` (q, 3), m, from the point along the region.
    The result is never zero. If all normals cancel, the point is at the greatest possible depth, half-way between two
    sides of the body; any of the normals then leads outside.
    """
    from scipy.optimize import nnls  # imported here: half a second, needed only for sharp bodies

    sides = _tangent_basis(ways)
    along = np.vstack([*(n @ side for side in sides), np.ones(len(n))])
    found = _component_perpendicular_to_region(ways, nnls(along, np.array([*np.zeros(len(sides)), 1.0]))[0] @ n)
    means = (found, np.asarray(n.mean(axis=0)))
    return next((one for one in means if float(np.linalg.norm(one)) > FLATTEST), n[0])


def _component_perpendicular_to_region(ways: Floats, n: Floats) -> Floats:
    """Return the component (3,) of a vector n (3,) perpendicular to a region, given vectors `ways` (q, 3) along it."""
    sides = _tangent_basis(ways)
    found: Floats = n - sides.T @ (sides @ n)
    return found


def _tangent_basis(ways: Floats) -> Floats:
    """Return one or two orthonormal vectors (1 or 2, 3) that span the vectors `ways` (q, 3) along a region."""
    found: Floats = np.linalg.svd(ways, full_matrices=False)[2][: 1 if len(ways) == 2 else 2]
    return found


def _concatenate_movable_points(found: list[AddedContactPoints], contact: RigidContact) -> AddedContactPoints | None:
    """Return all found points that have at least one free node, as one set; None if there are none."""
    if not found:
        return None
    points = found[0].points
    for one in found[1:]:
        points = points.concatenate(one.points)
    which, t, ways, c, n = (
        np.concatenate([getattr(one, k) for one in found]) for k in ("which", "t", "ways", "c", "n")
    )
    loose = (np.isin(points.of, contact.nodes) & (points.shares != 0.0)).any(axis=1)
    every = AddedContactPoints(points, which, t, ways, c, n).select_points(np.flatnonzero(loose))
    return every if len(every) else None
