"""Exact mass properties of rigid bodies: volume, centroid and second moments of their shapes.

To add a shape: a function here, and a line in VOLUMES.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.signed_distance.distance_function import Gap
from softmark.solvers.contact.signed_distance.polyhedra import BoxGap
from softmark.solvers.contact.signed_distance.revolved_shapes import RevolvedGap
from softmark.solvers.contact.signed_distance.rounded_shapes import BallGap
from softmark.solvers.contact.signed_distance.triangle_surface import TriangleSurface
from softmark.solvers.energies.energy import Floats
from softmark.solvers.mesh.polygons import edges
from softmark.solvers.mesh.shape import transverse


@dataclass(frozen=True)
class MassProperties:
    """Mass properties of a shape of density one.

    V is the volume, m^3, `middle` (3,) the centroid, m, and C = int (X - middle) (X - middle)^T dV (3, 3), m^5.
    """

    V: float
    middle: Floats
    C: Floats

    @cached_property
    def principal(self) -> tuple[Floats, Floats]:
        """Principal moments of inertia per mass (3,), m^2, and axes (3, 3), as columns: I = tr(C) 1 - C."""
        J, axes = np.linalg.eigh((np.trace(self.C) * np.eye(3) - self.C) / self.V)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        return J, axes


def mass_properties_of(gap: Gap) -> MassProperties | None:
    """Return the mass properties of a rigid shape with a signed distance; None if they are unknown or infinite."""
    make = VOLUMES.get(type(gap))
    return None if make is None else make(gap)


def integrate_ball(gap: BallGap) -> MassProperties:
    """Return the mass properties of a ball with a concentric hollow: C = 4 pi / 15 (R^5 - r^5)."""
    V, C = (4.0 * np.pi * (gap.radius**k - gap.inner**k) / (3.0 * k) * (1.0 if k == 5 else 3.0) for k in (3, 5))
    return MassProperties(V, np.array(gap.centroid), C * np.eye(3))


def integrate_box(gap: BoxGap) -> MassProperties:
    """Return the mass properties of a box: C is V / 3 times the squares of its half edge lengths."""
    half = np.array(gap.half)
    V = 8.0 * float(half.prod())
    return MassProperties(V, np.array(gap.centroid), V / 3.0 * np.diag(half**2))


def integrate_body_of_revolution(gap: RevolvedGap) -> MassProperties:
    """Return the mass properties of a body of revolution, by Green's theorem along the edges of its half-section."""
    V, Vz, Vzz, Vrr = (2.0 * np.pi * _section_moment(gap, a, b) for a, b in ((1, 0), (1, 1), (1, 2), (3, 0)))
    axis, (e, f) = np.array(gap.axis), (np.array(t) for t in transverse(gap.axis))
    middle = np.array(gap.origin) + Vz / V * axis
    C = 0.5 * Vrr * (np.outer(e, e) + np.outer(f, f)) + (Vzz - Vz**2 / V) * np.outer(axis, axis)
    return MassProperties(float(V), middle, C)


def _section_moment(gap: RevolvedGap, a: int, b: int) -> float:
    """Return the moment int r^a z^b dA over a counter-clockwise half-section with coordinates (r, z).

    It uses three Gauss points per edge, which is exact to degree 5.
    """
    t, w = np.polynomial.legendre.leggauss(3)
    t, w, total = 0.5 * (t + 1.0), 0.5 * w, 0.0
    for (r0, z0), (r1, z1) in edges(gap.corners):
        r, z = r0 + t * (r1 - r0), z0 + t * (z1 - z0)
        total += float(w @ (r ** (a + 1) * z**b)) / (a + 1) * (z1 - z0)
    return total


def integrate_triangle_surface(gap: TriangleSurface) -> MassProperties:
    """Return the mass properties of the volume in a closed triangle surface.

    The volume is split into tetrahedra with corners v: int x x^T dV = V / 20 (sum of v v^T, plus s s^T), with s the sum
    of the corners.
    """
    own = gap.corners - (middle := np.array(gap.centroid))
    V = np.einsum("ti,ti->t", own[:, 0], np.cross(own[:, 1], own[:, 2])) / 6.0
    whole = own.sum(axis=1)
    C = np.einsum("t,tki,tkj->ij", V, own, own) + np.einsum("t,ti,tj->ij", V, whole, whole)
    return MassProperties(float(V.sum()), middle, C / 20.0)


VOLUMES: dict[type, Callable[[Any], MassProperties]] = {
    BallGap: integrate_ball,
    BoxGap: integrate_box,
    RevolvedGap: integrate_body_of_revolution,
    TriangleSurface: integrate_triangle_surface,
}
