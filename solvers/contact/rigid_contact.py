"""Contact with a rigid body: a barrier energy of the gaps between surface points and the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.interaction_state import InteractionState
from softmark.solvers.contact.surface_points import SAME, AddedContactPoints, SurfacePoints
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks

if TYPE_CHECKING:
    from softmark.solvers.contact.barrier_law import Barrier
    from softmark.solvers.contact.signed_distance.distance_function import Gap, Look


@dataclass(frozen=True)
class RigidContact(Energy):
    """Contact energy E = sum_p A_p phi(g(x_p)) of surface points x_p, with barrier phi, gaps g and areas A (p,), m^2.

    The points are x_p = sum_a N_pa x_a, with shape functions `shares` N (p, a) of the nodes `of` (p, a). By default
    they are the `nodes` (m,) of the surface, at rest at X (m, 3), m. Forces are always reported for these nodes. Only
    points are kept outside the rigid body: a facet between them may enter a convex body by its chord height. `posed`
    maps a load fraction to the rigid body in its position there, and `share` is the present load fraction. The contact
    has no friction. With `flat`, for a slice, gaps are those in the xy plane, and no force acts along z.
    """

    not_proportional: ClassVar[bool] = True  # depends on the load fraction, but is not proportional to it
    each: ClassVar[tuple[str, ...]] = ("sunk",)  # names of fields with one value per point

    nodes: Ints
    X: Floats
    A: Floats
    barrier: Barrier
    posed: Callable[[float], Gap]
    flat: bool = False
    share: float = 1.0
    facets: Ints | None = None  # (k, a) facets of the surface, on which pressures are recovered from forces
    conservative: bool = True
    earlier: Gap | None = None  # rigid body at the start of the solution
    sunk: Floats | float = 0.0  # (p,) m, enlargement of gaps: for initial touch and soft barriers
    of: Any = None  # (p, a)
    shares: Any = None  # (p, a)
    at_rest: Any = None  # (p, 3) m: positions of the points at rest
    facing: Any = None  # `SearchedFacets` that may penetrate between points; None: no search
    skin: Any = None  # `SurfaceTriangles` for the tunnelling check; None: only points are checked
    extra: AddedContactPoints | None = None  # points added during the solution; they are the last ones
    stiffening: float = 1.0  # stiffness of the barrier relative to its initial stiffness

    def __post_init__(self) -> None:
        """Use the nodes as contact points if no points are given."""
        if self.of is None:
            ones = np.ones((len(self.nodes), 1))
            known = {"of": np.asarray(self.nodes)[:, None], "shares": ones, "at_rest": self.X}
            for name, value in known.items():
                object.__setattr__(self, name, value)

    @property
    def points(self) -> SurfacePoints:
        """Contact points of the surface."""
        return SurfacePoints(self.of, self.shares, self.at_rest, self.A)

    @property
    def lasting(self) -> int:
        """Number of permanent contact points; points added during the solution are not counted."""
        return len(self.A) - (0 if self.extra is None else len(self.extra))

    def with_added_points(self, extra: AddedContactPoints | None, x: Floats) -> Self:
        """Return the same contact with the added points replaced by `extra`.

        x is the state that the solution starts from.
        """
        points, new = self.points.select_points(np.arange(self.lasting)), 0 if extra is None else len(extra)
        own: dict[str, Any] = {n: _keep_first_values(getattr(self, n), self.lasting, new) for n in self.each}
        points = points if extra is None else points.concatenate(extra.points)
        return replace(self, of=points.of, shares=points.shares, at_rest=points.X, A=points.A, extra=extra, **own)

    def loaded_regions(self, x: Floats) -> Ints:
        """Return the numbers (k,) of the facet regions whose added points have a contact force in a state x."""
        if self.extra is None:
            return np.zeros(0, dtype=np.int64)
        return self.extra.which[self.pressures(x)[self.lasting :] > 0.0]

    def without_unloaded_points(self, x: Floats) -> Self:
        """Return the same contact without the added points that have no contact force in a state x."""
        if self.extra is None:
            return self
        on = np.isin(self.extra.which, self.loaded_regions(x))
        return (
            self
            if on.all()
            else self.with_added_points(self.extra.select_points(np.flatnonzero(on)) if on.any() else None, x)
        )

    @cached_property
    def point_dofs(self) -> Ints:
        """Degrees of freedom (p, 3 a) of the nodes of each contact point."""
        found: Ints = (3 * self.of[:, :, None] + np.arange(3)).reshape(len(self.of), -1)
        return found

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom (p, 3 a) that the energy of each contact point depends on."""
        return self.point_dofs

    @cached_property
    def body(self) -> Gap:
        """Signed distance of the rigid body in its position at the present load fraction."""
        return self.posed(self.share)

    def at(self, share: float) -> RigidContact:
        """Return the same contact at the load fraction `share`."""
        return self if share == self.share else replace(self, share=share)

    def before(self) -> RigidContact:
        """Return the same contact with the rigid body in its position at the start of the solution.

        If this position is unknown, the contact is returned unchanged.
        """
        if (gap := self.earlier) is None:
            return self

        def stays(share: float) -> Gap:
            """Return the initial position of the rigid body at any load fraction."""
            return gap

        return replace(self, posed=stays, earlier=None)

    def add_force_change_of_motion(self, x: Floats, to: Gap, change: Floats) -> None:
        """Add to `change` (dofs,), N, the first-order change of forces as the rigid body moves to the position `to`.

        Nodes stay at the state x.
        """
        g, n, _ = self.look(x)
        moved = self._gaps(to, self.places(x)) - g
        self.add_nodal_forces((self.A * self.barrier.energy_second_derivative(g) * moved)[:, None] * n, change)

    def add_nodal_forces(self, push: Floats, g: Floats) -> None:
        """Distribute forces `push` (p, 3), N, on contact points to nodes, and add them to g (dofs,)."""
        np.add.at(g, self.point_dofs, (self.shares[:, :, None] * push[:, None, :]).reshape(len(push), -1))

    def stiffer(self, factor: float) -> RigidContact:
        """Return the same contact with the barrier stiffness multiplied by a factor."""
        if factor == 1.0:
            return self
        return replace(self, barrier=self.barrier.stiffer(factor), stiffening=factor * self.stiffening)

    def interaction_state(self, x: Floats, before: InteractionState | None) -> InteractionState:
        """Return the position of the rigid body, the stiffening and the added points in a solved state x."""
        return InteractionState(self.body, self.stiffening, self.extra)

    def resumed(self, state: InteractionState, x: Floats) -> Self:
        """Return the same contact, with the rigid body and the added points of `state` at the start of the solution."""
        found = replace(self, earlier=state.body)
        return found if state.added is None else found.with_added_points(state.added, x)

    def without_initial_energy(self) -> RigidContact:
        """Return the same contact without energy at rest: gaps of points that start within the barrier are enlarged.

        Otherwise bodies that touch at the start would be thrown apart by this energy in a dynamic analysis with short
        time steps.
        """
        g, d = self.gaps(np.zeros(int(self.stencils.max(initial=-1)) + 1)), self.barrier.distance
        return replace(self, sunk=np.where(np.abs(g) < d, d - g, 0.0))

    def with_scaled_stiffness(self, soft: float) -> RigidContact:
        """Return the same contact with `soft` times the stiffness; the barrier begins at the same gap.

        With a soft barrier loaded nodes lie behind the surface of the body, and full Newton steps lead there from any
        state nearby.
        """
        if soft == 1.0:
            return self
        d = self.barrier.distance
        return replace(self, barrier=replace(self.barrier, distance=d / soft), sunk=self.sunk + (d / soft - d))

    def places(self, x: Floats) -> Floats:
        """Return the positions (p, 3), m, of the contact points in the frame of the signed distance.

        For a slice z is 0.
        """
        u = np.asarray(x, dtype=np.float64)[self.point_dofs].reshape(*self.of.shape, 3)
        found: Floats = self.at_rest + np.einsum("pa,pai->pi", self.shares, u)
        return found * (1.0, 1.0, 0.0) if self.flat else found

    def point_positions(self, x: Floats) -> Floats:
        """Return the positions (p, 3), m, of the contact points in space."""
        return self.places(x)

    @cached_property
    def _points_at_nodes(self) -> tuple[Ints, Ints]:
        """Numbers (k,) of the contact points that coincide with nodes, and indices (k,) of these nodes in `nodes`."""
        points = np.flatnonzero(self.shares.max(axis=1) > 1.0 - SAME)
        own = self.of[points, self.shares[points].argmax(axis=1)]
        known = np.isin(own, self.nodes)
        return points[known], np.searchsorted(self.nodes, own[known])

    def nodal_gaps(self, x: Floats) -> Floats:
        """Return the gaps (m,), m, of the surface nodes in a state x.

        For a node that is a contact point it is the gap of this point, including an enlargement at the start.
        """
        where = self.X + np.asarray(x, dtype=np.float64)[3 * self.nodes[:, None] + np.arange(3)]
        found = self.body.gap(self.body_coordinates(where * (1.0, 1.0, 0.0) if self.flat else where, x))
        points, which = self._points_at_nodes
        found[which] = self.gaps(x)[points]
        return found

    def body_coordinates(self, where: Floats, x: Floats) -> Floats:
        """Return the coordinates (n, 3), m, of points `where` (n, 3), m, in the frame of the signed distance."""
        return where

    def gaps(self, x: Floats) -> Floats:
        """Return the gaps (p,), m, of the contact points."""
        return self.look(x)[0]

    def pressures(self, x: Floats) -> Floats:
        """Return the barrier pressures (p,), Pa, at the contact points."""
        return self.barrier.pressure(self.gaps(x))

    def presses_on_nodes(self, x: Floats) -> bool:
        """Return whether the rigid body presses on at least one mesh node in a state x (dofs,), m."""
        return bool((self.pressures(x)[self._points_at_nodes[0]] > 0.0).any())

    def point_forces(self, x: Floats) -> Floats:
        """Return the forces (p, 3), N, of the rigid body on the contact points."""
        g, n, _ = self.look(x)
        found: Floats = (self.A * self.barrier.pressure(g))[:, None] * n
        return found

    def forces(self, x: Floats) -> Floats:
        """Return the forces (m, 3), N, of the rigid body on the surface nodes, distributed by shape functions."""
        g = np.zeros(max(len(x), 3 * (int(self.of.max(initial=0)) + 1)))
        self.add_nodal_forces(self.point_forces(x), g)
        found: Floats = g[3 * self.nodes[:, None] + np.arange(3)]
        return found

    def value(self, x: Floats) -> float:
        """Return the energy of the barrier, J."""
        return float(self.A @ self.barrier.energy(self.gaps(x)))

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy, J: all of the barrier energy."""
        return self.value(x)

    def work(self, x: Floats, since: RigidContact) -> float:
        """Return the work of the rigid body, J, as it moved from its position in the contact `since`.

        It is the final contact forces times the changes of gaps.
        """
        return float(self.A @ (self.pressures(x) * (since.gaps(x) - self.gaps(x))))

    def presses(self, x: Floats, nodes: int) -> Floats:
        """Return the magnitudes (nodes,), N, of the normal forces at all mesh nodes, distributed by shape functions."""
        found = np.zeros(nodes)
        np.add.at(found, self.of, self.shares * (self.A * self.pressures(x))[:, None])
        return found

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add `scale` times the negative forces of the rigid body on nodes, N, to g (dofs,)."""
        self.add_nodal_forces(-scale * self.point_forces(x), g)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent A (phi'' n n + phi' H), with normals n and gap Hessians H.

        The second term is indefinite, and is left out if `projected`.
        """
        g, n, H = self.look(x)
        near = np.flatnonzero(g < self.barrier.distance)
        if not len(near):
            return
        g, n, H = g[near], n[near], H[near]
        blocks = self.barrier.energy_second_derivative(g)[:, None, None] * n[:, :, None] * n[:, None, :]
        if not projected:
            blocks -= self.gap_hessian_pressures(g)[:, None, None] * H
        add_blocks(self.nodal_stiffness_blocks(near, scale * self.A[near, None, None] * blocks), slots[near], data)

    def gap_hessian_pressures(self, g: Floats) -> Floats:
        """Return the pressures (p,), Pa, that multiply the gap Hessian in the tangent, at gaps g (p,), m."""
        return self.barrier.pressure(g)

    def nodal_stiffness_blocks(self, points: Ints, blocks: Floats) -> Floats:
        """Return stiffness blocks (k, 3 a, 3 a), N/m, of nodes from blocks (k, 3, 3) of contact points.

        `points` (k,) are the numbers of the contact points. The blocks are N_a N_b times the block of the point, with
        its shape functions N.
        """
        N = self.shares[points]
        k = 3 * N.shape[1]
        found: Floats = (N[:, :, None, None, None] * (N[:, None, None, :, None] * blocks[:, None, :, None, :])).reshape(
            -1, k, k
        )
        return found

    def rounding(self, x: Floats) -> float:
        """Return the error of the contact forces due to rounding of positions, N."""
        size = float(np.abs(self.places(x)).max(initial=0.0))
        stiff = self.A * self.barrier.energy_second_derivative(self.gaps(x))
        return float(np.finfo(np.float64).eps * size * np.linalg.norm(stiff))

    @cached_property
    def _gap_cache(self) -> list[tuple[Floats, Look]]:
        """Cache of the last positions and the results of `look` there, shared by energy, gradient and Hessian."""
        return []

    def look(self, x: Floats) -> Look:
        """Return gaps (p,), m, normals (p, 3) and gap Hessians (p, 3, 3), 1/m, of the contact points in a state x.

        Normals and Hessians are zero for points beyond the barrier distance.
        """
        where = self.places(x)
        for known, found in self._gap_cache:
            if np.array_equal(known, where):
                return found
        found = self._compute_gaps_normals_hessians(where)
        self._gap_cache[:] = [(where, found)]
        return found

    def _compute_gaps_normals_hessians(self, where: Floats) -> Look:
        """Return gaps (p,), m, normals (p, 3) and gap Hessians (p, 3, 3), 1/m, for points at `where` (p, 3), m."""
        g = self._gaps(self.body, where)
        n, H = np.zeros((len(g), 3)), np.zeros((len(g), 3, 3))
        near = g < self.barrier.distance
        near[self.lasting :] = False
        if near.any():
            _, n[near], H[near] = self.body.look(where[near])
        if self.extra is not None:
            n[self.lasting :] = self.added_point_planes(self.body)[1]
        if self.flat:
            n[:, 2] = H[:, 2] = H[:, :, 2] = 0.0
        return g, n, H

    def _gaps(self, body: Gap, where: Floats) -> Floats:
        """Return the gaps (p,), m, between points at `where` (p, 3), m, and a rigid body.

        The gaps of added points are distances to their planes.
        """
        g = body.gap(where) + self.sunk
        if self.extra is not None:
            c, n = self.added_point_planes(body)
            g[self.lasting :] = (
                np.einsum("pi,pi->p", where[self.lasting :] - c, n)
                + np.broadcast_to(self.sunk, g.shape)[self.lasting :]
            )
        return g

    def added_point_planes(self, body: Gap) -> tuple[Floats, Floats]:
        """Return points (p, 3), m, and normals (p, 3) of the planes of added points.

        They move with the rigid body `body`.
        """
        assert self.extra is not None
        pose = getattr(body, "pose", None)
        if pose is None:
            return self.extra.c, self.extra.n
        c = pose.moved(self.extra.c)
        return c, pose.moved(self.extra.c + self.extra.n) - c


def _keep_first_values(values: Any, lasting: int, new: int) -> Any:
    """Return the first `lasting` of the values (p, ...) of contact points, followed by zeros for `new` points.

    None, or one number for all points, is returned unchanged.
    """
    if values is None or np.ndim(values) == 0:
        return values
    return np.concatenate([values[:lasting], np.zeros((new, *values.shape[1:]))])


def node_areas(
    points: Floats, facets: Ints, triangles: tuple[tuple[int, int, int], ...], depth: float = 0.0
) -> tuple[Ints, Floats]:
    """Return the numbers (m,) of the nodes of facets (f, k), and the surface area (m,), m^2, of each node.

    `points` (n, 3), m, are all nodes, and `triangles` split a facet over its nodes. Each corner of a flat triangle gets
    a third of its area. For an axisymmetric model `depth` is the thickness of the slice, m, and areas are integrals of
    linear shape functions over whole rings.
    """
    split = facets[:, np.array(triangles)].reshape(-1, 3)
    third = corner_areas(points, split, depth).ravel()
    found = np.bincount(split.ravel(), third, minlength=len(points)).astype(np.float64)
    nodes = np.unique(split)
    return nodes, found[nodes]


def corner_areas(points: Floats, split: Ints, depth: float = 0.0) -> Floats:
    """Return integrals (t, 3), m^2, of the linear shape functions over flat triangles `split` (t, 3).

    `points` (n, 3), m, are the nodes. With a `depth`, m, of the slice of an axisymmetric model, the integrals are over
    whole rings.
    """
    a, b, c = (points[split[:, i]] for i in range(3))
    found: Floats = np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0, 3).reshape(-1, 3)
    if depth:
        from softmark.solvers.energies.axisymmetric import circumference_in_slices

        r = points[split, 0]
        found = found * circumference_in_slices(0.25 * (r + r.sum(axis=1, keepdims=True)), depth)
    return found
