"""Free rigid bodies: six unknowns each, the displacement of the centre of mass and the rotation since a step began.

A body with principal axes P, as columns (3, 3), sees a point x of space at y = P^T (x - c). With n0 the normal there,
and phi a rotation about the body axes, the gap changes by n0 . (P^T (dx - dc) + y x phi). The forces on the surface
act on the body with the opposite sign at the same point, so that the total momentum is conserved.
"""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_friction import RigidFriction
from softmark.solvers.contact.rigid_transform import RigidMotion, rotation_from_vector
from softmark.solvers.contact.signed_distance.distance_function import Gap, Look
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix
from softmark.solvers.mesh.shape import Vector3


@dataclass(frozen=True)
class FreeRigidBody:
    """Free rigid body: mass, kg, moments of inertia J (3,), kg m^2, about `axes` (3, 3), as columns, and its `middle`,
    m.

    Its six unknowns start at `first`: displacement of the centre of mass, m, and rotation about the body axes, rad.
    """

    first: int
    mass: float
    J: Floats
    axes: Floats
    middle: Floats


class FreeBodyChart:
    """Rotation chart of the free bodies among the unknowns (dynamics/rotational_inertia.py): rotations are relative to
    `rotated`.
    """

    def __init__(self, bodies: list[FreeRigidBody]) -> None:
        self.bodies = bodies
        self.reset()

    def reset(self) -> None:
        """Count rotations from the declared orientations."""
        self.turned = [body.axes.copy() for body in self.bodies]

    def axes(self, which: int, x: Floats) -> Floats:
        """Return the principal axes of a body in a state (3, 3), as columns."""
        first = self.bodies[which].first
        found: Floats = self.turned[which] @ rotation_from_vector(x[first + 3 : first + 6])
        return found

    def middle(self, which: int, x: Floats) -> Floats:
        """Return the centre of mass of a body in a state (3,), m."""
        body = self.bodies[which]
        found: Floats = body.middle + x[body.first : body.first + 3]
        return found

    def state(self, x: Floats) -> Floats:
        """Return centres of mass, m, and principal axes (12 per body,), independent of the rotation chart."""
        each = ((self.middle(i, x), self.axes(i, x).ravel()) for i in range(len(self.bodies)))
        return np.concatenate([part for both in each for part in both])

    def rebase(self, x: Floats) -> Floats:
        """Count rotations from the state x, and return it with zero rotations."""
        new = x.copy()
        for i, body in enumerate(self.bodies):
            self.turned[i] = _orthonormalize(self.axes(i, x))
            new[body.first + 3 : body.first + 6] = 0.0
        return new


def _orthonormalize(P: Floats) -> Floats:
    """Return a rotation matrix without accumulated rounding: one Newton step to the nearest rotation."""
    found: Floats = 1.5 * P - 0.5 * P @ P.T @ P
    return found


def right_jacobian(theta: Floats) -> Floats:
    """Return the right Jacobian (3, 3): from changes of a rotation vector to rotations about the body axes."""
    t, K = float(np.linalg.norm(theta)), cross_matrix(theta)
    if t < 1e-4:  # what is left out is below rounding
        return np.asarray(np.eye(3) - 0.5 * K + K @ K / 6.0)
    return np.asarray(np.eye(3) - 2.0 * (np.sin(0.5 * t) / t) ** 2 * K + (t - np.sin(t)) / t**3 * K @ K)


@dataclass(frozen=True)
class GapInBodyFrame:
    """Signed distance in a body frame given by its centre of mass `middle` (3,), m, and principal axes (3, 3), as
    columns.
    """

    own: Gap
    middle: Floats
    axes: Floats

    @property
    def sharpest(self) -> float:
        """Least radius of curvature of its convex edges, m."""
        return self.own.sharpest

    @property
    def centroid(self) -> Vector3 | None:
        """Centroid of its volume in the body frame, m: the origin."""
        return (0.0, 0.0, 0.0)

    def gap(self, Y: Floats) -> Floats:
        """Return the gap at points Y (n, 3), m, in the body frame."""
        return self.own.gap(self.middle + Y @ self.axes.T)

    def look(self, Y: Floats) -> Look:
        """Return gap, normal and Hessian in the body frame."""
        g, n, H = self.own.look(self.middle + Y @ self.axes.T)
        return g, n @ self.axes, self.axes.T @ H @ self.axes


@dataclass(frozen=True)
class FreeBodyContact(RigidContact):
    """Contact with a free body: E = sum_p A_p phi(g0(y_p)) of points x_p = sum_a N_pa x_a, at y_p in the body frame.

    Moments are about the present body axes, as in the equations of rotation; the tangent is their derivative by the
    unknowns, and so not symmetric.
    """

    chart: Any = None  # Bodies
    which: int = 0

    @property
    def free(self) -> FreeRigidBody:
        """Free rigid body in contact."""
        found: FreeRigidBody = self.chart.bodies[self.which]
        return found

    @cached_property
    def stencils(self) -> Ints:
        """Degrees of freedom of the nodes of each point, and of the body (p, 3 a + 6)."""
        body = np.broadcast_to(self.free.first + np.arange(6), (len(self.of), 6))
        return np.hstack([self.carried, body])

    def spots(self, x: Floats) -> Floats:
        """Return positions of the points in space (p, 3), m."""
        return super().places(x)

    def places(self, x: Floats) -> Floats:
        """Return positions of the points in the body frame (p, 3), m."""
        return self.seen(self.spots(x), x)

    def seen(self, where: Floats, x: Floats) -> Floats:
        """Return points of space (n, 3), m, in the body frame."""
        found: Floats = (where - self.chart.middle(self.which, x)) @ self.chart.axes(self.which, x)
        return found

    def pushes(self, x: Floats) -> Floats:
        """Return the forces of the body on its points, in space (p, 3), N."""
        found: Floats = super().pushes(x) @ self.chart.axes(self.which, x).T
        return found

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add minus the forces on nodes and body, N, and minus the moment about the body axes, N m."""
        push, first = scale * self.pushes(x), self.free.first
        self.spread(-push, g)
        own = push @ self.chart.axes(self.which, x)
        g[first : first + 3] += push.sum(axis=0)
        g[first + 3 : first + 6] -= np.cross(own, self.places(x)).sum(axis=0)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add A (phi'' N N + phi' dN), N = S n0 with S = (P^T, -P^T, [y]); only the first part if `projected`."""
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
        """Return the body axes P, and S (k, 3, 9): motion of points (k,) in the body frame by point, body, rotation."""
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
        """Return the matrix from the unknowns of stencils to points and body (p, 9, 3 a + 6)."""
        count = self.shares.shape[1]
        E = np.zeros((len(near), 9, 3 * count + 6))
        for a in range(count):
            E[:, 0:3, 3 * a : 3 * a + 3] = self.shares[near, a, None, None] * np.eye(3)
        E[:, 3:9, -6:] = np.eye(6)
        return E


@dataclass(frozen=True)
class FreeBodyFriction(RigidFriction, FreeBodyContact):
    """Frictional contact with a free body: slip, anchors and tractions are in the body frame.

    Friction acts on the body with the opposite sign at the same point.
    """

    def pushes(self, x: Floats) -> Floats:
        """Return the forces of the body on its points, in space (p, 3), N."""
        found: Floats = super().pushes(x) @ self.chart.axes(self.which, x).T
        return found

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add S^T B S as well, with the stiffness B of tractions t = dE/dy, and the effect of the body's rotation on
        these.
        """
        FreeBodyContact.add_hessian(self, x, data, slots, scale, projected)
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


def make_contact_with_free_body(touching: RigidContact, chart: FreeBodyChart, which: int) -> FreeBodyContact:
    """Return a contact with a fixed rigid body as one whose body is free."""
    known = {f.name: getattr(touching, f.name) for f in fields(touching)}
    body, whole = chart.bodies[which], touching.posed(0.0)
    seen = GapInBodyFrame(whole, body.middle, body.axes)
    known |= {"posed": lambda share: seen, "chart": chart, "which": which}
    if not isinstance(touching, RigidFriction):
        return FreeBodyContact(**known)
    known |= {"carries": lambda share: RigidMotion(), "anchors": (touching.at_rest - body.middle) @ body.axes}
    return FreeBodyFriction(**known)
