"""Free rigid bodies: each has six unknowns, the displacement of its centre of mass and its rotation in the step.

A body with the centre of mass c and the principal axes P, as columns (3, 3), has a point x of space at y = P^T (x - c)
in its own frame. With the normal n0 at this point and a rotation phi about the body axes, the gap changes by n0 . (P^T
(dx - dc) + y x phi). Forces on the surface act on the body with the opposite sign at the same point, so that the total
momentum is conserved.
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
    """Free rigid body: its mass properties, and the number `first` of its first unknown.

    `mass` is in kg, `J` (3,) are the principal moments of inertia, kg m^2, `axes` (3, 3) the principal axes, as
    columns, and `middle` (3,) is the centre of mass, m, as declared. The six unknowns are the displacement of the
    centre of mass, m, and a rotation vector about the body axes, rad.
    """

    first: int
    mass: float
    J: Floats
    axes: Floats
    middle: Floats


class FreeBodyChart:
    """Reference orientations of the free rigid bodies, from which their rotation unknowns are counted.

    `turned` holds the principal axes (3, 3), as columns, of each body in its reference orientation. See
    dynamics/rotational_inertia.py.
    """

    def __init__(self, bodies: list[FreeRigidBody]) -> None:
        self.bodies = bodies
        self.reset()

    def reset(self) -> None:
        """Make the declared orientations the reference."""
        self.turned = [body.axes.copy() for body in self.bodies]

    def axes(self, which: int, x: Floats) -> Floats:
        """Return the principal axes (3, 3), as columns, of body number `which` in a state x (dofs,)."""
        first = self.bodies[which].first
        found: Floats = self.turned[which] @ rotation_from_vector(x[first + 3 : first + 6])
        return found

    def middle(self, which: int, x: Floats) -> Floats:
        """Return the centre of mass (3,), m, of body number `which` in a state x (dofs,)."""
        body = self.bodies[which]
        found: Floats = body.middle + x[body.first : body.first + 3]
        return found

    def state(self, x: Floats) -> Floats:
        """Return centres of mass, m, and principal axes of all bodies, 12 numbers per body.

        They do not depend on the reference orientations.
        """
        each = ((self.middle(i, x), self.axes(i, x).ravel()) for i in range(len(self.bodies)))
        return np.concatenate([part for both in each for part in both])

    def rebase(self, x: Floats) -> Floats:
        """Make the orientations in the state x (dofs,) the reference, and return x with zero rotations."""
        new = x.copy()
        for i, body in enumerate(self.bodies):
            self.turned[i] = _orthonormalize(self.axes(i, x))
            new[body.first + 3 : body.first + 6] = 0.0
        return new


def _orthonormalize(P: Floats) -> Floats:
    """Return the rotation matrix nearest to P (3, 3), by one Newton step: it removes accumulated rounding."""
    found: Floats = 1.5 * P - 0.5 * P @ P.T @ P
    return found


def right_jacobian(theta: Floats) -> Floats:
    """Return the right Jacobian (3, 3) of a rotation vector theta (3,), rad.

    It maps small changes of the rotation vector to rotations about the body axes.
    """
    t, K = float(np.linalg.norm(theta)), cross_matrix(theta)
    if t < 1e-4:  # higher terms of the series are below rounding
        return np.asarray(np.eye(3) - 0.5 * K + K @ K / 6.0)
    return np.asarray(np.eye(3) - 2.0 * (np.sin(0.5 * t) / t) ** 2 * K + (t - np.sin(t)) / t**3 * K @ K)


@dataclass(frozen=True)
class GapInBodyFrame:
    """Signed distance to a rigid body in its own frame.

    The origin of the frame is the centre of mass `middle` (3,), m, and its axes are the principal axes (3, 3), as
    columns.
    """

    own: Gap
    middle: Floats
    axes: Floats

    @property
    def least_curvature_radius(self) -> float:
        """Smallest radius of curvature of convex edges of the body, m."""
        return self.own.least_curvature_radius

    @property
    def centroid(self) -> Vector3 | None:
        """Centroid of the body in its own frame, m: the origin."""
        return (0.0, 0.0, 0.0)

    def gap(self, Y: Floats) -> Floats:
        """Return the gaps (n,), m, at points Y (n, 3), m, in the body frame."""
        return self.own.gap(self.middle + Y @ self.axes.T)

    def look(self, Y: Floats) -> Look:
        """Return gaps (n,), m, normals (n, 3) and Hessians (n, 3, 3), 1/m, at points Y (n, 3), m, in the body frame."""
        g, n, H = self.own.look(self.middle + Y @ self.axes.T)
        return g, n @ self.axes, self.axes.T @ H @ self.axes


@dataclass(frozen=True)
class FreeBodyContact(RigidContact):
    """Contact with a free rigid body: E = sum_p A_p phi(g0(y_p)), with the contact points y_p in the body frame.

    The points in space are x_p = sum_a N_pa x_a. Moments are about the present body axes, as in the equations of
    rotation. The tangent is the derivative of forces and moments by the unknowns, and is not symmetric.
    """

    chart: Any = None  # FreeBodyChart
    which: int = 0

    @property
    def free(self) -> FreeRigidBody:
        """Rigid body in contact."""
        found: FreeRigidBody = self.chart.bodies[self.which]
        return found

    @cached_property
    def stencils(self) -> Ints:
        """Degrees of freedom (p, 3 a + 6) of the nodes of each point and of the rigid body."""
        body = np.broadcast_to(self.free.first + np.arange(6), (len(self.of), 6))
        return np.hstack([self.point_dofs, body])

    def point_positions(self, x: Floats) -> Floats:
        """Return the positions (p, 3), m, of the contact points in space."""
        return super().places(x)

    def places(self, x: Floats) -> Floats:
        """Return the positions (p, 3), m, of the contact points in the body frame."""
        return self.body_coordinates(self.point_positions(x), x)

    def body_coordinates(self, where: Floats, x: Floats) -> Floats:
        """Return the coordinates (n, 3), m, in the body frame of points `where` (n, 3), m, in space."""
        found: Floats = (where - self.chart.middle(self.which, x)) @ self.chart.axes(self.which, x)
        return found

    def point_forces(self, x: Floats) -> Floats:
        """Return the forces (p, 3), N, of the rigid body on the contact points, in space axes."""
        found: Floats = super().point_forces(x) @ self.chart.axes(self.which, x).T
        return found

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add to g the negative forces on nodes and body, N, and the negative moments about the body axes, N m."""
        push, first = scale * self.point_forces(x), self.free.first
        self.add_nodal_forces(-push, g)
        own = push @ self.chart.axes(self.which, x)
        g[first : first + 3] += push.sum(axis=0)
        g[first + 3 : first + 6] -= np.cross(own, self.places(x)).sum(axis=0)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent A (phi'' N N + phi' dN), with N = S n0 and S = (P^T, -P^T, [y]).

        If `projected`, only the first term is added, which is positive semidefinite.
        """
        g, n, H = self.look(x)
        near = np.flatnonzero(g < self.barrier.distance)
        if not len(near):
            return
        n, H = n[near], H[near]
        P, S = self._axes_and_motion_matrices(x, near)
        N = np.einsum("pi,pij->pj", n, S)
        K = self.barrier.energy_second_derivative(g[near])[:, None, None] * N[:, :, None] * N[:, None, :]
        if not projected:
            across = S.swapaxes(1, 2) @ H @ S
            c = cross_matrix(n)
            across[:, 0:3, 6:9] -= P @ c
            across[:, 3:6, 6:9] += P @ c
            across[:, 6:9] += c @ S
            K -= self.barrier.pressure(g[near])[:, None, None] * across
        self._add_point_stiffness(x, near, K, data, slots, scale)

    def _axes_and_motion_matrices(self, x: Floats, near: Ints) -> tuple[Floats, Floats]:
        """Return the body axes P (3, 3), and matrices S (k, 3, 9) for the contact points `near` (k,).

        S maps motions of the point (3), of the centre of mass (3) and rotations of the body (3) to the motion of the
        point in the body frame.
        """
        P = self.chart.axes(self.which, x)
        to = np.broadcast_to(P.T, (len(near), 3, 3))
        return P, np.concatenate([to, -to, cross_matrix(self.places(x)[near])], axis=2)

    def _add_point_stiffness(self, x: Floats, near: Ints, K: Floats, data: Floats, slots: Ints, scale: float) -> None:
        """Add stiffness per area K (k, 9, 9) of points, centre of mass and rotation, times areas, to the tangent."""
        first = self.free.first
        K[:, :, 6:9] = K[:, :, 6:9] @ right_jacobian(x[first + 3 : first + 6])
        E = self._point_motion_matrices(near)
        add_blocks(scale * self.A[near, None, None] * (E.swapaxes(1, 2) @ K @ E), slots[near], data)

    def _point_motion_matrices(self, near: Ints) -> Floats:
        """Return matrices (k, 9, 3 a + 6) from unknowns to the motions of contact point and rigid body.

        The unknowns are those of `stencils`. The motions are of the point (3) and of the centre of mass (3), and the
        rotation (3).
        """
        count = self.shares.shape[1]
        E = np.zeros((len(near), 9, 3 * count + 6))
        for a in range(count):
            E[:, 0:3, 3 * a : 3 * a + 3] = self.shares[near, a, None, None] * np.eye(3)
        E[:, 3:9, -6:] = np.eye(6)
        return E


@dataclass(frozen=True)
class FreeBodyFriction(RigidFriction, FreeBodyContact):
    """Frictional contact with a free rigid body: slip, anchors and tractions are in the body frame.

    Friction acts on the body with the opposite sign at the same point.
    """

    def point_forces(self, x: Floats) -> Floats:
        """Return the forces (p, 3), N, of the rigid body on the contact points, in space axes."""
        found: Floats = super().point_forces(x) @ self.chart.axes(self.which, x).T
        return found

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangents of contact and of friction.

        The tangent of friction is S^T B S, with the derivatives B of the tractions t by positions in the body frame,
        and the change of t as the body rotates.
        """
        FreeBodyContact.add_hessian(self, x, data, slots, scale, projected)
        near, B = self.stiffness(x, projected)
        if not len(near):
            return
        P, S = self._axes_and_motion_matrices(x, near)
        K = S.swapaxes(1, 2) @ B @ S
        if not projected:
            _, n, _ = self.look(x)
            t = cross_matrix(self._traction(x, n, self.friction * self.pressures(x))[near])
            K[:, 0:3, 6:9] -= P @ t
            K[:, 3:6, 6:9] += P @ t
            K[:, 6:9] += t @ S
        self._add_point_stiffness(x, near, K, data, slots, scale)


def make_contact_with_free_body(touching: RigidContact, chart: FreeBodyChart, which: int) -> FreeBodyContact:
    """Return a contact with a fixed rigid body as a contact with the free body number `which` of a chart."""
    known = {f.name: getattr(touching, f.name) for f in fields(touching)}
    body, whole = chart.bodies[which], touching.posed(0.0)
    seen = GapInBodyFrame(whole, body.middle, body.axes)
    known |= {"posed": lambda share: seen, "chart": chart, "which": which}
    if not isinstance(touching, RigidFriction):
        return FreeBodyContact(**known)
    known |= {"carries": lambda share: RigidMotion(), "anchors": (touching.at_rest - body.middle) @ body.axes}
    return FreeBodyFriction(**known)
