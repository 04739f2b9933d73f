"""Free rigid bodies: six unknowns for each, where its middle has gone and how it has turned since a step began.

A body of principal axes P, columns (3, 3), sees a point x of space at y = P^T (x - c). With n0 the normal there, and
phi a turn about its own axes, the gap changes by n0 . (P^T (dx - dc) + y x phi): what presses on the surface acts on
the body as well, opposite and at the same point, so that momentum of both together is kept.
"""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.rigid_contact import Touching
from softmark.solvers.contact.rigid_friction import Rubbing
from softmark.solvers.contact.rigid_transform import Pose, exponential
from softmark.solvers.contact.signed_distance.distance_function import Gap, Look
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix
from softmark.solvers.mesh.shape import Vector3


@dataclass(frozen=True)
class Free:
    """A rigid body: mass, kg, moments of inertia J (3,), kg m^2, about `axes` (3, 3), as columns, through `middle`, m.

    Its unknowns are the six from `first` on: of its middle, m, and of its turn about its own axes, rad.
    """

    first: int
    mass: float
    J: Floats
    axes: Floats
    middle: Floats


class Bodies:
    """The chart of free bodies among the unknowns (dynamics/rotational_inertia.py): rotations are counted from
    `turned`.
    """

    def __init__(self, bodies: list[Free]) -> None:
        self.bodies = bodies
        self.reset()

    def reset(self) -> None:
        """Count from where they are declared."""
        self.turned = [body.axes.copy() for body in self.bodies]

    def axes(self, which: int, x: Floats) -> Floats:
        """Its principal axes in a state (3, 3), as columns."""
        first = self.bodies[which].first
        found: Floats = self.turned[which] @ exponential(x[first + 3 : first + 6])
        return found

    def middle(self, which: int, x: Floats) -> Floats:
        """Where its middle is (3,), m."""
        body = self.bodies[which]
        found: Floats = body.middle + x[body.first : body.first + 3]
        return found

    def state(self, x: Floats) -> Floats:
        """What unknowns stand for, whatever turns are counted from: middles, m, and principal axes (12 each,)."""
        each = ((self.middle(i, x), self.axes(i, x).ravel()) for i in range(len(self.bodies)))
        return np.concatenate([part for both in each for part in both])

    def rebase(self, x: Floats) -> Floats:
        """Count from x from now on."""
        new = x.copy()
        for i, body in enumerate(self.bodies):
            self.turned[i] = _proper(self.axes(i, x))
            new[body.first + 3 : body.first + 6] = 0.0
        return new


def _proper(P: Floats) -> Floats:
    """The rotation that is nearest to one with the rounding of many products: one of Newton's steps for it."""
    found: Floats = 1.5 * P - 0.5 * P @ P.T @ P
    return found


def right_jacobian(theta: Floats) -> Floats:
    """By how much a body turns about its own axes as the vector of its rotation changes (3, 3)."""
    t, K = float(np.linalg.norm(theta)), cross_matrix(theta)
    if t < 1e-4:  # what is left out is below rounding
        return np.asarray(np.eye(3) - 0.5 * K + K @ K / 6.0)
    return np.asarray(np.eye(3) - 2.0 * (np.sin(0.5 * t) / t) ** 2 * K + (t - np.sin(t)) / t**3 * K @ K)


@dataclass(frozen=True)
class Principal:
    """A gap as a body sees it that is told by its middle (3,), m, and its principal axes (3, 3), as columns."""

    own: Gap
    middle: Floats
    axes: Floats

    @property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m."""
        return self.own.sharpest

    @property
    def centroid(self) -> Vector3 | None:
        """The middle of its volume, m."""
        return (0.0, 0.0, 0.0)

    def gap(self, Y: Floats) -> Floats:
        """At points Y (n, 3), m, about its axes."""
        return self.own.gap(self.middle + Y @ self.axes.T)

    def look(self, Y: Floats) -> Look:
        """The same with normal and Hessian about its axes."""
        g, n, H = self.own.look(self.middle + Y @ self.axes.T)
        return g, n @ self.axes, self.axes.T @ H @ self.axes


@dataclass(frozen=True)
class Afloat(Touching):
    """Touching of a free body: E = sum_p A_p phi(g0(y_p)) of points x_p = sum_a N_pa x_a, seen from the body at y_p.

    Moments are those about the body's own axes where they are, as the equations of what turns take them; the tangent is
    their derivative by the unknowns, and so not symmetric.
    """

    chart: Any = None  # Bodies
    which: int = 0

    @property
    def free(self) -> Free:
        """The body."""
        found: Free = self.chart.bodies[self.which]
        return found

    @cached_property
    def stencils(self) -> Ints:
        """Degrees of freedom of the nodes of each point, and of the body (p, 3 a + 6)."""
        body = np.broadcast_to(self.free.first + np.arange(6), (len(self.of), 6))
        return np.hstack([self.carried, body])

    def spots(self, x: Floats) -> Floats:
        """Where they are in space (p, 3), m."""
        return super().places(x)

    def places(self, x: Floats) -> Floats:
        """Where they are as seen from the body, about its axes (p, 3), m."""
        return self.seen(self.spots(x), x)

    def seen(self, where: Floats, x: Floats) -> Floats:
        """Points of space (n, 3), m, as seen from the body, about its axes."""
        found: Floats = (where - self.chart.middle(self.which, x)) @ self.chart.axes(self.which, x)
        return found

    def pushes(self, x: Floats) -> Floats:
        """What the body does to its points, in space (p, 3), N."""
        found: Floats = super().pushes(x) @ self.chart.axes(self.which, x).T
        return found

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Minus the forces on nodes and body, N, and the moment on this about its own axes, N m."""
        push, first = scale * self.pushes(x), self.free.first
        self.spread(-push, g)
        own = push @ self.chart.axes(self.which, x)
        g[first : first + 3] += push.sum(axis=0)
        g[first + 3 : first + 6] -= np.cross(own, self.places(x)).sum(axis=0)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """A (phi'' N N + phi' dN), N = S n0 with S = (P^T, -P^T, [y]); `projected` the first part alone."""
        g, n, H = self.look(x)
        near = np.flatnonzero(g < self.barrier.distance)
        if not len(near):
            return
        n, H = n[near], H[near]
        P, S = self._seeing(x, near)
        N = np.einsum("pi,pij->pj", n, S)
        K = self.barrier.slope(g[near])[:, None, None] * N[:, :, None] * N[:, None, :]
        if not projected:
            across = S.swapaxes(1, 2) @ H @ S
            c = cross_matrix(n)
            across[:, 0:3, 6:9] -= P @ c
            across[:, 3:6, 6:9] += P @ c
            across[:, 6:9] += c @ S
            K -= self.barrier.pressure(g[near])[:, None, None] * across
        self._add(x, near, K, data, slots, scale)

    def _seeing(self, x: Floats, near: Ints) -> tuple[Floats, Floats]:
        """The body's axes P, and how it sees points (k,) move: S (k, 3, 9) of their ways, its own and its turn."""
        P = self.chart.axes(self.which, x)
        to = np.broadcast_to(P.T, (len(near), 3, 3))
        return P, np.concatenate([to, -to, cross_matrix(self.places(x)[near])], axis=2)

    def _add(self, x: Floats, near: Ints, K: Floats, data: Floats, slots: Ints, scale: float) -> None:
        """Add stiffness K (k, 9, 9) of points and body, per area, to that of the unknowns."""
        first = self.free.first
        K[:, :, 6:9] = K[:, :, 6:9] @ right_jacobian(x[first + 3 : first + 6])
        E = self._spread(near)
        add_blocks(scale * self.A[near, None, None] * (E.swapaxes(1, 2) @ K @ E), slots[near], data)

    def _spread(self, near: Ints) -> Floats:
        """How points and body go with the unknowns of their stencils (p, 9, 3 a + 6)."""
        count = self.shares.shape[1]
        E = np.zeros((len(near), 9, 3 * count + 6))
        for a in range(count):
            E[:, 0:3, 3 * a : 3 * a + 3] = self.shares[near, a, None, None] * np.eye(3)
        E[:, 3:9, -6:] = np.eye(6)
        return E


@dataclass(frozen=True)
class RubbingAfloat(Rubbing, Afloat):
    """The same with friction: ways, anchors and tractions are those that the body sees, about its own axes.

    What holds a point pulls at the body as well, opposite and at the same point.
    """

    def pushes(self, x: Floats) -> Floats:
        """What the body does to its points, in space (p, 3), N."""
        found: Floats = super().pushes(x) @ self.chart.axes(self.which, x).T
        return found

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """With S^T B S of the stiffness B of tractions t = dE/dy, and what a turn of the body makes of these."""
        Afloat.add_hessian(self, x, data, slots, scale, projected)
        near, B = self.stiffness(x, projected)
        if not len(near):
            return
        P, S = self._seeing(x, near)
        K = S.swapaxes(1, 2) @ B @ S
        if not projected:
            _, n, _ = self.look(x)
            t = cross_matrix(self._traction(x, n, self.friction * self.pressures(x))[near])
            K[:, 0:3, 6:9] -= P @ t
            K[:, 3:6, 6:9] += P @ t
            K[:, 6:9] += t @ S
        self._add(x, near, K, data, slots, scale)


def afloat(touching: Touching, chart: Bodies, which: int) -> Afloat:
    """A contact whose rigid body is free, where it was one that stayed."""
    known = {f.name: getattr(touching, f.name) for f in fields(touching)}
    body, whole = chart.bodies[which], touching.posed(0.0)
    seen = Principal(whole, body.middle, body.axes)
    known |= {"posed": lambda share: seen, "chart": chart, "which": which}
    if not isinstance(touching, Rubbing):
        return Afloat(**known)
    known |= {"carries": lambda share: Pose(), "anchors": (touching.at_rest - body.middle) @ body.axes}
    return RubbingAfloat(**known)
