"""A surface that keeps clear of a rigid body: an energy of the gaps of its nodes, or of other points of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.surface_points import SAME, Joined, Points
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks

if TYPE_CHECKING:
    from softmark.solvers.contact.barrier_law import Barrier
    from softmark.solvers.contact.signed_distance.distance_function import Gap, Look


@dataclass(frozen=True)
class Touching(Energy):
    """E = sum_p A_p phi(g(x_p)) over points x_p = sum_a N_pa x_a of a surface, with areas A (p,), m^2.

    `shares` N (p, a) are those of nodes `of` (p, a); unless they are given, points are the `nodes` (m,) of the surface,
    at rest at X (m, 3), m, which are told of forces in any case. Points alone keep clear: between them a facet may cut
    a convex body by as much as it is flat. `posed` says of a share of the load where the rigid body then is; `share` is
    the present one. Frictionless; with `flat` the gap is that of sections, and nothing acts along z.
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
    extra: Joined | None = None  # the last ones of the points, which have joined the others, in front of planes

    def __post_init__(self) -> None:
        """Where no points are given, these are the nodes."""
        if self.of is None:
            ones = np.ones((len(self.nodes), 1))
            known = {"of": np.asarray(self.nodes)[:, None], "shares": ones, "at_rest": self.X}
            for name, value in known.items():
                object.__setattr__(self, name, value)

    @property
    def points(self) -> Points:
        """What is kept clear."""
        return Points(self.of, self.shares, self.at_rest, self.A)

    @property
    def lasting(self) -> int:
        """How many points have not joined others."""
        return len(self.A) - (0 if self.extra is None else len(self.extra))

    def joining(self, extra: Joined | None, x: Floats) -> Self:
        """The same with other points that have joined, which were somewhere in the state x that it is started from."""
        points, new = self.points.some(np.arange(self.lasting)), 0 if extra is None else len(extra)
        own: dict[str, Any] = {n: _kept(getattr(self, n), self.lasting, new) for n in self.each}
        points = points if extra is None else points.and_(extra.points)
        return replace(self, of=points.of, shares=points.shares, at_rest=points.X, A=points.A, extra=extra, **own)

    def pressed(self, x: Floats) -> Ints:
        """Which parts of the surface points have joined of that something presses on in a state (k,)."""
        if self.extra is None:
            return np.zeros(0, dtype=np.int64)
        return self.extra.which[self.pressures(x)[self.lasting :] > 0.0]

    def shed(self, x: Floats) -> Self:
        """The same without points that have joined and that nothing presses on in a state."""
        if self.extra is None:
            return self
        on = np.isin(self.extra.which, self.pressed(x))
        return self if on.all() else self.joining(self.extra.some(np.flatnonzero(on)) if on.any() else None, x)

    @cached_property
    def carried(self) -> Ints:
        """Three degrees of freedom of each node of each point (p, 3 a)."""
        found: Ints = (3 * self.of[:, :, None] + np.arange(3)).reshape(len(self.of), -1)
        return found

    @property
    def stencils(self) -> Ints:
        """These."""
        return self.carried

    @cached_property
    def body(self) -> Gap:
        """The rigid body where it is."""
        return self.posed(self.share)

    def at(self, share: float) -> Touching:
        """The same at another share of the load."""
        return self if share == self.share else replace(self, share=share)

    def before(self) -> Touching:
        """The same with the rigid body where it was in the state that is started from; itself where that is unknown."""
        if (gap := self.earlier) is None:
            return self

        def stays(share: float) -> Gap:
            return gap

        return replace(self, posed=stays, earlier=None)

    def add_towed(self, x: Floats, to: Gap, change: Floats) -> None:
        """Add how the gradient changes (dofs,), N, to first order, where the body goes `to` a place and nodes stay."""
        g, n, _ = self.look(x)
        moved = self._gaps(to, self.places(x)) - g
        self.spread((self.A * self.barrier.slope(g) * moved)[:, None] * n, change)

    def spread(self, push: Floats, g: Floats) -> None:
        """Add forces on its points (p, 3), N, to those on degrees of freedom (dofs,), by their shares."""
        np.add.at(g, self.carried, (self.shares[:, :, None] * push[:, None, :]).reshape(len(push), -1))

    def stiffer(self, factor: float) -> Touching:
        """The same with a barrier so many times as stiff."""
        return self if factor == 1.0 else replace(self, barrier=self.barrier.stiffer(factor))

    def begun(self) -> Touching:
        """The same of which no point is within the barrier where all is at rest: nothing is stored there.

        What touches would be thrown off by what it takes to bring bodies together, by steps that are short enough.
        """
        g, d = self.gaps(np.zeros(int(self.stencils.max(initial=-1)) + 1)), self.barrier.distance
        return replace(self, sunk=np.where(np.abs(g) < d, d - g, 0.0))

    def softened(self, soft: float) -> Touching:
        """The same `soft` times as stiff, from the same gap on.

        Nodes that press are behind the surface then, and whole steps lead there from anywhere near.
        """
        if soft == 1.0:
            return self
        d = self.barrier.distance
        return replace(self, barrier=replace(self.barrier, distance=d / soft), sunk=self.sunk + (d / soft - d))

    def places(self, x: Floats) -> Floats:
        """Where its points are (p, 3), m; of a slice in its plane."""
        u = np.asarray(x, dtype=np.float64)[self.carried].reshape(*self.of.shape, 3)
        found: Floats = self.at_rest + np.einsum("pa,pai->pi", self.shares, u)
        return found * (1.0, 1.0, 0.0) if self.flat else found

    def spots(self, x: Floats) -> Floats:
        """Where its points are in space (p, 3), m, from wherever they are looked at."""
        return self.places(x)

    @cached_property
    def _alone(self) -> tuple[Ints, Ints]:
        """Points that are nodes (k,), and which of the nodes these are (k,)."""
        points = np.flatnonzero(self.shares.max(axis=1) > 1.0 - SAME)
        own = self.of[points, self.shares[points].argmax(axis=1)]
        known = np.isin(own, self.nodes)
        return points[known], np.searchsorted(self.nodes, own[known])

    def nodal_gaps(self, x: Floats) -> Floats:
        """Of its nodes (m,), m: those of points that are nodes among them."""
        where = self.X + np.asarray(x, dtype=np.float64)[3 * self.nodes[:, None] + np.arange(3)]
        found = self.body.gap(self.seen(where * (1.0, 1.0, 0.0) if self.flat else where, x))
        points, which = self._alone
        found[which] = self.gaps(x)[points]
        return found

    def seen(self, where: Floats, x: Floats) -> Floats:
        """Points of space (n, 3), m, as the gap takes them."""
        return where

    def gaps(self, x: Floats) -> Floats:
        """Of its points (p,), m."""
        return self.look(x)[0]

    def pressures(self, x: Floats) -> Floats:
        """What the law of the gap says at its points (p,), Pa."""
        return self.barrier.pressure(self.gaps(x))

    def presses_on_nodes(self, x: Floats) -> bool:
        """Return whether the rigid body presses on at least one node of the mesh in a state x (dofs,), m."""
        return bool((self.pressures(x)[self._alone[0]] > 0.0).any())

    def pushes(self, x: Floats) -> Floats:
        """What the rigid body does to its points (p, 3), N."""
        g, n, _ = self.look(x)
        found: Floats = (self.A * self.barrier.pressure(g))[:, None] * n
        return found

    def forces(self, x: Floats) -> Floats:
        """What the rigid body does to the nodes (m, 3), N: to each point, by its shares."""
        g = np.zeros(max(len(x), 3 * (int(self.of.max(initial=0)) + 1)))
        self.spread(self.pushes(x), g)
        found: Floats = g[3 * self.nodes[:, None] + np.arange(3)]
        return found

    def value(self, x: Floats) -> float:
        """What the barrier stores, J."""
        return float(self.A @ self.barrier.energy(self.gaps(x)))

    def stored(self, x: Floats) -> float:
        """What it gives back, J."""
        return self.value(x)

    def work(self, x: Floats, since: Touching) -> float:
        """What the rigid body does as it comes from where it was `since`, J: forces at the end times its way there."""
        return float(self.A @ (self.pressures(x) * (since.gaps(x) - self.gaps(x))))

    def presses(self, x: Floats, nodes: int) -> Floats:
        """How hard it presses at all nodes (nodes,), N, by shares: without what rubs, and of any direction."""
        found = np.zeros(nodes)
        np.add.at(found, self.of, self.shares * (self.A * self.pressures(x))[:, None])
        return found

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Minus the forces, N."""
        self.spread(-scale * self.pushes(x), g)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """A (phi'' n n + phi' H): the second part is not definite, and is left out where the first is to be alone."""
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
        """The pressures (p,), Pa, at gaps g (p,), m, by which a tangent takes what is round."""
        return self.barrier.pressure(g)

    def coupled(self, points: Ints, blocks: Floats) -> Floats:
        """Stiffness at `points` (k,), blocks (k, 3, 3), N/m, as N_a N_b of it between their nodes (k, 3 a, 3 a)."""
        N = self.shares[points]
        k = 3 * N.shape[1]
        found: Floats = (N[:, :, None, None, None] * (N[:, None, None, :, None] * blocks[:, None, :, None, :])).reshape(
            -1, k, k
        )
        return found

    def rounding(self, x: Floats) -> float:
        """What the last digits of places leave in its forces, N."""
        size = float(np.abs(self.places(x)).max(initial=0.0))
        stiff = self.A * self.barrier.slope(self.gaps(x))
        return float(np.finfo(np.float64).eps * size * np.linalg.norm(stiff))

    @cached_property
    def _seen(self) -> list[tuple[Floats, Look]]:
        """The last places that were looked at, and what was seen there: an energy, its gradient and Hessian ask."""
        return []

    def look(self, x: Floats) -> Look:
        """Gaps (p,), m, and of what is nearer than the barrier's distance normals (p, 3) and curvatures (p, 3, 3)."""
        where = self.places(x)
        for known, found in self._seen:
            if np.array_equal(known, where):
                return found
        found = self._looked(where)
        self._seen[:] = [(where, found)]
        return found

    def _looked(self, where: Floats) -> Look:
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
        """Of its points (p, 3), m, to a body (p,), m: of those that have joined to their planes."""
        g = body.gap(where) + self.sunk
        if self.extra is not None:
            c, n = self.planes(body)
            g[self.lasting :] = (
                np.einsum("pi,pi->p", where[self.lasting :] - c, n)
                + np.broadcast_to(self.sunk, g.shape)[self.lasting :]
            )
        return g

    def planes(self, body: Gap) -> tuple[Floats, Floats]:
        """Of points that have joined: points of planes (p, 3), m, and normals (p, 3), where a body has them."""
        assert self.extra is not None
        pose = getattr(body, "pose", None)
        if pose is None:
            return self.extra.c, self.extra.n
        c = pose.moved(self.extra.c)
        return c, pose.moved(self.extra.c + self.extra.n) - c


def _kept(values: Any, lasting: int, new: int) -> Any:
    """Values of the first points (p, ...), and nothing for new ones; one number for all of them stays."""
    if values is None or np.ndim(values) == 0:
        return values
    return np.concatenate([values[:lasting], np.zeros((new, *values.shape[1:]))])


def node_areas(
    points: Floats, facets: Ints, triangles: tuple[tuple[int, int, int], ...], depth: float = 0.0
) -> tuple[Ints, Floats]:
    """Nodes of facets (f, k), and the areas that they stand for (m,), m^2: a third of each flat triangle at a corner.

    `triangles` split a facet over its nodes. With the `depth`, m, of a slice through a body of revolution, the
    integrals of linear shape functions over whole rings.
    """
    split = facets[:, np.array(triangles)].reshape(-1, 3)
    third = thirds(points, split, depth).ravel()
    found = np.bincount(split.ravel(), third, minlength=len(points)).astype(np.float64)
    nodes = np.unique(split)
    return nodes, found[nodes]


def thirds(points: Floats, split: Ints, depth: float = 0.0) -> Floats:
    """Integrals of linear shape functions over flat triangles (t, 3), or whole rings of them (t, 3), m^2."""
    a, b, c = (points[split[:, i]] for i in range(3))
    found: Floats = np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0, 3).reshape(-1, 3)
    if depth:
        from softmark.solvers.energies.axisymmetric import around

        r = points[split, 0]
        found = found * around(0.25 * (r + r.sum(axis=1, keepdims=True)), depth)
    return found
