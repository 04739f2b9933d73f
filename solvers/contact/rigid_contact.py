"""Contact with a rigid body: a barrier energy of the gaps of surface nodes, or of other points of the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.surface_points import SAME, AddedContactPoints, SurfacePoints
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks

if TYPE_CHECKING:
    from softmark.solvers.contact.barrier_law import Barrier
    from softmark.solvers.contact.signed_distance.distance_function import Gap, Look


@dataclass(frozen=True)
class RigidContact(Energy):
    """Contact energy E = sum_p A_p phi(g(x_p)) of points x_p = sum_a N_pa x_a of a surface, with areas A (p,), m^2.

    `shares` N (p, a) are the shape functions of nodes `of` (p, a). By default the points are the `nodes` (m,) of the
    surface, at rest at X (m, 3), m, for which forces are reported in any case. Only points are kept outside the body: a
    facet between them may enter a convex body by its chord height. `posed` maps a load fraction to the rigid body
    there; `share` is the present fraction. The contact is frictionless; with `flat` the gap is that of plane sections,
    and no force acts along z.
    """

    driven: ClassVar[bool] = True  # by the share of the load, to which it is not in proportion
    each: ClassVar[tuple[str, ...]] = ("sunk",)  # what it has of every point, beside these themselves

    nodes: Ints
    X: Floats
    A: Floats
    barrier: Barrier
    posed: Callable[[float], Gap]
    flat: bool = False
    share: float = 1.0
    facets: Ints | None = None  # (k, a) that it is the surface of: what presses on them is told from forces
    conservative: bool = True
    earlier: Gap | None = None  # the rigid body in the state that is started from
    sunk: Floats | float = 0.0  # (p,) m, by how much gaps are larger: of what touches at first, and of soft barriers
    of: Any = None  # (p, a)
    shares: Any = None  # (p, a)
    at_rest: Any = None  # (p, 3) m: where the points are
    facing: Any = None  # `cutting.Facets`: what may cut in between points: not looked at where it is not given
    skin: Any = None  # `passing.Skin`: all that its body may be gone through; not looked at where it is not given
    extra: AddedContactPoints | None = (
        None  # the last ones of the points, which have joined the others, in front of planes
    )

    def __post_init__(self) -> None:
        """Use the nodes as points if no points are given."""
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
        """Number of points that were not added during the solution."""
        return len(self.A) - (0 if self.extra is None else len(self.extra))

    def joining(self, extra: AddedContactPoints | None, x: Floats) -> Self:
        """Return the same contact with other added points `extra`; x is the state that the solution starts from."""
        points, new = self.points.some(np.arange(self.lasting)), 0 if extra is None else len(extra)
        own: dict[str, Any] = {n: _keep_first_values(getattr(self, n), self.lasting, new) for n in self.each}
        points = points if extra is None else points.and_(extra.points)
        return replace(self, of=points.of, shares=points.shares, at_rest=points.X, A=points.A, extra=extra, **own)

    def pressed(self, x: Floats) -> Ints:
        """Return the numbers (k,) of the surface parts whose added points have a contact force in a state."""
        if self.extra is None:
            return np.zeros(0, dtype=np.int64)
        return self.extra.which[self.pressures(x)[self.lasting :] > 0.0]

    def shed(self, x: Floats) -> Self:
        """Return the same contact without added points that have no contact force in a state."""
        if self.extra is None:
            return self
        on = np.isin(self.extra.which, self.pressed(x))
        return self if on.all() else self.joining(self.extra.some(np.flatnonzero(on)) if on.any() else None, x)

    @cached_property
    def carried(self) -> Ints:
        """Degrees of freedom of the nodes of each point (p, 3 a)."""
        found: Ints = (3 * self.of[:, :, None] + np.arange(3)).reshape(len(self.of), -1)
        return found

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom of the nodes of each point."""
        return self.carried

    @cached_property
    def body(self) -> Gap:
        """Rigid body in its present position."""
        return self.posed(self.share)

    def at(self, share: float) -> RigidContact:
        """Return the same contact at another load fraction."""
        return self if share == self.share else replace(self, share=share)

    def before(self) -> RigidContact:
        """Return the same contact with the rigid body where the solution starts from; itself where that is unknown."""
        if (gap := self.earlier) is None:
            return self

        def stays(share: float) -> Gap:
            return gap

        return replace(self, posed=stays, earlier=None)

    def add_towed(self, x: Floats, to: Gap, change: Floats) -> None:
        """Add the first-order change of the gradient (dofs,), N, for a body that moves `to` another position at fixed
        nodes.
        """
        g, n, _ = self.look(x)
        moved = self._gaps(to, self.places(x)) - g
        self.spread((self.A * self.barrier.slope(g) * moved)[:, None] * n, change)

    def spread(self, push: Floats, g: Floats) -> None:
        """Add forces on the points (p, 3), N, to those on degrees of freedom (dofs,), by their shape functions."""
        np.add.at(g, self.carried, (self.shares[:, :, None] * push[:, None, :]).reshape(len(push), -1))

    def stiffer(self, factor: float) -> RigidContact:
        """Return the same contact with the barrier stiffness multiplied by a factor."""
        return self if factor == 1.0 else replace(self, barrier=self.barrier.stiffer(factor))

    def begun(self) -> RigidContact:
        """Return the same contact with larger gaps where points start within the barrier: no energy is stored at rest.

        Otherwise bodies that touch at first would be thrown apart by this energy in a dynamic analysis with short
        steps.
        """
        g, d = self.gaps(np.zeros(int(self.stencils.max(initial=-1)) + 1)), self.barrier.distance
        return replace(self, sunk=np.where(np.abs(g) < d, d - g, 0.0))

    def softened(self, soft: float) -> RigidContact:
        """Return the same contact `soft` times as stiff, starting at the same gap.

        Loaded nodes then lie behind the surface, and full Newton steps lead there from anywhere near.
        """
        if soft == 1.0:
            return self
        d = self.barrier.distance
        return replace(self, barrier=replace(self.barrier, distance=d / soft), sunk=self.sunk + (d / soft - d))

    def places(self, x: Floats) -> Floats:
        """Return positions of the points (p, 3), m, in the frame of the gap; for a slice in its plane."""
        u = np.asarray(x, dtype=np.float64)[self.carried].reshape(*self.of.shape, 3)
        found: Floats = self.at_rest + np.einsum("pa,pai->pi", self.shares, u)
        return found * (1.0, 1.0, 0.0) if self.flat else found

    def spots(self, x: Floats) -> Floats:
        """Return positions of the points in space (p, 3), m."""
        return self.places(x)

    @cached_property
    def _alone(self) -> tuple[Ints, Ints]:
        """Indices of points that coincide with nodes (k,), and the positions of these in `nodes` (k,)."""
        points = np.flatnonzero(self.shares.max(axis=1) > 1.0 - SAME)
        own = self.of[points, self.shares[points].argmax(axis=1)]
        known = np.isin(own, self.nodes)
        return points[known], np.searchsorted(self.nodes, own[known])

    def nodal_gaps(self, x: Floats) -> Floats:
        """Return the gaps of `nodes` (m,), m; for nodes that are contact points, the gaps of these."""
        where = self.X + np.asarray(x, dtype=np.float64)[3 * self.nodes[:, None] + np.arange(3)]
        found = self.body.gap(self.seen(where * (1.0, 1.0, 0.0) if self.flat else where, x))
        points, which = self._alone
        found[which] = self.gaps(x)[points]
        return found

    def seen(self, where: Floats, x: Floats) -> Floats:
        """Return points of space (n, 3), m, in the frame of the gap."""
        return where

    def gaps(self, x: Floats) -> Floats:
        """Return the gaps of the points (p,), m."""
        return self.look(x)[0]

    def pressures(self, x: Floats) -> Floats:
        """Return the barrier pressure at the points (p,), Pa."""
        return self.barrier.pressure(self.gaps(x))

    def presses_on_nodes(self, x: Floats) -> bool:
        """Return whether the rigid body presses on at least one node of the mesh in a state x (dofs,), m."""
        return bool((self.pressures(x)[self._alone[0]] > 0.0).any())

    def pushes(self, x: Floats) -> Floats:
        """Return the forces of the rigid body on the points (p, 3), N."""
        g, n, _ = self.look(x)
        found: Floats = (self.A * self.barrier.pressure(g))[:, None] * n
        return found

    def forces(self, x: Floats) -> Floats:
        """Return the forces of the rigid body on the nodes (m, 3), N, distributed by shape functions."""
        g = np.zeros(max(len(x), 3 * (int(self.of.max(initial=0)) + 1)))
        self.spread(self.pushes(x), g)
        found: Floats = g[3 * self.nodes[:, None] + np.arange(3)]
        return found

    def value(self, x: Floats) -> float:
        """Return the energy of the barrier, J."""
        return float(self.A @ self.barrier.energy(self.gaps(x)))

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy, J."""
        return self.value(x)

    def work(self, x: Floats, since: RigidContact) -> float:
        """Return the work of the rigid body on its way from `since`, J: final forces times the change of gaps."""
        return float(self.A @ (self.pressures(x) * (since.gaps(x) - self.gaps(x))))

    def presses(self, x: Floats, nodes: int) -> Floats:
        """Return the magnitudes of the normal forces at all nodes (nodes,), N, distributed by shape functions."""
        found = np.zeros(nodes)
        np.add.at(found, self.of, self.shares * (self.A * self.pressures(x))[:, None])
        return found

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the gradient, minus the forces, N."""
        self.spread(-scale * self.pushes(x), g)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add A (phi'' n n + phi' H); the second part is indefinite, and left out if `projected`."""
        g, n, H = self.look(x)
        near = np.flatnonzero(g < self.barrier.distance)
        if not len(near):
            return
        g, n, H = g[near], n[near], H[near]
        blocks = self.barrier.slope(g)[:, None, None] * n[:, :, None] * n[:, None, :]
        if not projected:
            blocks -= self.bending(g)[:, None, None] * H
        add_blocks(self.coupled(near, scale * self.A[near, None, None] * blocks), slots[near], data)

    def bending(self, g: Floats) -> Floats:
        """Return the pressures (p,), Pa, at gaps g (p,), m, that multiply the curvature in the tangent."""
        return self.barrier.pressure(g)

    def coupled(self, points: Ints, blocks: Floats) -> Floats:
        """Return stiffness blocks (k, 3, 3), N/m, of `points` (k,) as N_a N_b times them between their nodes (k, 3 a, 3
        a).
        """
        N = self.shares[points]
        k = 3 * N.shape[1]
        found: Floats = (N[:, :, None, None, None] * (N[:, None, None, :, None] * blocks[:, None, :, None, :])).reshape(
            -1, k, k
        )
        return found

    def rounding(self, x: Floats) -> float:
        """Return the error of the forces due to rounding of positions, N."""
        size = float(np.abs(self.places(x)).max(initial=0.0))
        stiff = self.A * self.barrier.slope(self.gaps(x))
        return float(np.finfo(np.float64).eps * size * np.linalg.norm(stiff))

    @cached_property
    def _seen(self) -> list[tuple[Floats, Look]]:
        """Cache of the last positions and their gaps: energy, gradient and Hessian use the same ones."""
        return []

    def look(self, x: Floats) -> Look:
        """Return gaps (p,), m; within the barrier distance also normals (p, 3) and gap Hessians (p, 3, 3), 1/m."""
        where = self.places(x)
        for known, found in self._seen:
            if np.array_equal(known, where):
                return found
        found = self._looked(where)
        self._seen[:] = [(where, found)]
        return found

    def _looked(self, where: Floats) -> Look:
        """Compute gaps, normals and Hessians at positions of the points (p, 3), m."""
        g = self._gaps(self.body, where)
        n, H = np.zeros((len(g), 3)), np.zeros((len(g), 3, 3))
        near = g < self.barrier.distance
        near[self.lasting :] = False
        if near.any():
            _, n[near], H[near] = self.body.look(where[near])
        if self.extra is not None:
            n[self.lasting :] = self.planes(self.body)[1]
        if self.flat:
            n[:, 2] = H[:, 2] = H[:, :, 2] = 0.0
        return g, n, H

    def _gaps(self, body: Gap, where: Floats) -> Floats:
        """Return the gaps of the points (p, 3), m, to a body (p,), m; for added points those to their planes."""
        g = body.gap(where) + self.sunk
        if self.extra is not None:
            c, n = self.planes(body)
            g[self.lasting :] = (
                np.einsum("pi,pi->p", where[self.lasting :] - c, n)
                + np.broadcast_to(self.sunk, g.shape)[self.lasting :]
            )
        return g

    def planes(self, body: Gap) -> tuple[Floats, Floats]:
        """Return points (p, 3), m, and normals (p, 3) of the planes of added points, moved with a body."""
        assert self.extra is not None
        pose = getattr(body, "pose", None)
        if pose is None:
            return self.extra.c, self.extra.n
        c = pose.moved(self.extra.c)
        return c, pose.moved(self.extra.c + self.extra.n) - c


def _keep_first_values(values: Any, lasting: int, new: int) -> Any:
    """Return the values of the first points (p, ...), and zeros for new ones; a number for all points stays."""
    if values is None or np.ndim(values) == 0:
        return values
    return np.concatenate([values[:lasting], np.zeros((new, *values.shape[1:]))])


def node_areas(
    points: Floats, facets: Ints, triangles: tuple[tuple[int, int, int], ...], depth: float = 0.0
) -> tuple[Ints, Floats]:
    """Return the nodes of facets (f, k), and their areas (m,), m^2: a third of each flat triangle at a corner.

    `triangles` split a facet over its nodes. With the `depth`, m, of a slice through a body of revolution, areas are
    integrals of linear shape functions over whole rings.
    """
    split = facets[:, np.array(triangles)].reshape(-1, 3)
    third = corner_areas(points, split, depth).ravel()
    found = np.bincount(split.ravel(), third, minlength=len(points)).astype(np.float64)
    nodes = np.unique(split)
    return nodes, found[nodes]


def corner_areas(points: Floats, split: Ints, depth: float = 0.0) -> Floats:
    """Return integrals of linear shape functions over flat triangles, or over whole rings of them (t, 3), m^2."""
    a, b, c = (points[split[:, i]] for i in range(3))
    found: Floats = np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0, 3).reshape(-1, 3)
    if depth:
        from softmark.solvers.energies.axisymmetric import circumference_in_slices

        r = points[split, 0]
        found = found * circumference_in_slices(0.25 * (r + r.sum(axis=1, keepdims=True)), depth)
    return found
