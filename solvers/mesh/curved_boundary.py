"""Curved sides of shapes: selection of the mesh facets inscribed in them, and projection of points onto them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.shape import CurvedSide, RoundPrism, Vector3, dot, transverse

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.mesh.mesh import Floats
else:
    from softmark.solvers.runtime.lazy_modules import np

TIP = 1e-10  # relative to a cone's radius: closer to the axis the radial direction is undefined
ON = 1e-6  # relative to the size: tolerance of nodes on a curved side, for meshes from elsewhere


@dataclass(frozen=True)
class CylinderSide(CurvedSide):
    """The curved side of a cylinder of radius `radius` and length `length` around an axis from `origin`, m."""

    axis: Vector3
    origin: Vector3
    length: float
    radius: float

    @property
    def radii(self) -> tuple[float, float]:
        """Radii at both ends of the axis, m."""
        return self.radius, self.radius

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Return which facets, with nodes at (f, k, 3), m, have all their nodes on the cylinder; a mask (f,)."""
        axis, origin = np.array(self.axis), np.array(self.origin)
        along = (corners - origin) @ axis  # (f, k)
        radii = np.linalg.norm(corners - origin - along[..., None] * axis, axis=2)
        flat = np.ptp(along, axis=1) < 1e-9 * self.length  # facets of an end
        within = (along > -ON * self.length).all(axis=1) & (along < (1.0 + ON) * self.length).all(axis=1)
        found: NDArray[np.bool_] = (np.abs(radii - self.radius) < ON * self.radius).all(axis=1) & ~flat & within
        return found

    def project_points(self, place: Any) -> Any:
        """Return points projected radially from the axis onto the cylinder, m."""
        off = [p - o for p, o in zip(place, self.origin, strict=True)]
        s, u, v = (dot(off, e) for e in (self.axis, *transverse(self.axis)))
        out = (u**2 + v**2) ** -0.5 * self.radius
        frame = zip(self.origin, self.axis, *transverse(self.axis), strict=True)
        return tuple(o + s * a + u * out * b + v * out * c for o, a, b, c in frame)


@dataclass(frozen=True)
class ConeSide(CurvedSide):
    """The curved side of a cone, with radius `first` at `origin` and `last` after a `length`, m; one may be zero.

    Points are projected radially from the axis.
    """

    axis: Vector3
    origin: Vector3
    length: float
    first: float
    last: float

    @property
    def radii(self) -> tuple[float, float]:
        """Radii at both ends of the axis, m."""
        return self.first, self.last

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Return which facets, with nodes at (f, k, 3), m, have all their nodes on the cone; a mask (f,)."""
        off, largest = corners - np.array(self.origin), max(self.radii)
        along = off @ np.array(self.axis)  # (f, k)
        away = np.linalg.norm(off - along[..., None] * np.array(self.axis), axis=2)
        due = self.first + along * ((self.last - self.first) / self.length)
        size = math.hypot(largest, self.length)
        within = (along > -ON * size).all(axis=1) & (along < self.length + ON * size).all(axis=1)
        flat = np.ptp(along, axis=1) < 1e-9 * self.length
        found: NDArray[np.bool_] = (np.abs(away - due) < ON * largest).all(axis=1) & within & ~flat
        return found

    def project_points(self, place: Any) -> Any:
        """Return points projected radially from the axis onto the cone, m; the tip stays in place."""
        off = [p - o for p, o in zip(place, self.origin, strict=True)]
        s, u, v = (dot(off, e) for e in (self.axis, *transverse(self.axis)))
        least = (TIP * max(self.radii)) ** 2
        out = (u**2 + v**2 + least) ** -0.5 * (s * ((self.last - self.first) / self.length) + self.first)
        frame = zip(self.origin, self.axis, *transverse(self.axis), strict=True)
        return tuple(o + s * a + u * out * b + v * out * c for o, a, b, c in frame)


def cylinders_of_cuts(prism: RoundPrism, cuts: tuple[Cut, ...]) -> tuple[CylinderSide, ...]:
    """Return the concentric cylinders at the radial cuts of a round prism."""
    return tuple(CylinderSide(prism.axis, prism.origin, prism.length, cut.at) for cut in cuts if cut.axis == "radius")


@dataclass(frozen=True)
class EllipsoidSide(CurvedSide):
    """The surface of an ellipsoid with axes along x, y and z: semi-axes and centre, m.

    Points are projected along rays from the centre.
    """

    semiaxes: Vector3
    centre: Vector3

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Return which facets, with nodes at (f, k, 3), m, have all their nodes on the ellipsoid; a mask (f,)."""
        unit = np.linalg.norm((corners - np.array(self.centre)) / np.array(self.semiaxes), axis=2)
        found: NDArray[np.bool_] = (np.abs(unit - 1.0) < ON).all(axis=1)
        return found

    def project_points(self, place: Any) -> Any:
        """Return points projected along rays from the centre onto the ellipsoid, m."""
        off = [p - o for p, o in zip(place, self.centre, strict=True)]
        x, y, z = ((p * (1.0 / a)) ** 2 for p, a in zip(off, self.semiaxes, strict=True))
        out = (x + y + z) ** -0.5
        return tuple(p * out + o for p, o in zip(off, self.centre, strict=True))


@dataclass(frozen=True)
class TorusSide(CurvedSide):
    """The curved side of a round rod along a circle: a torus with tube radius `inner` and circle radius `radius`, m.

    The circle lies around an axis through `centre`. Points are projected along rays from the nearest point of the
    circle.
    """

    axis: Vector3
    centre: Vector3
    radius: float
    inner: float

    def of(self, corners: Floats) -> NDArray[np.bool_]:
        """Return which facets, with nodes at (f, k, 3), m, are inscribed in the torus; a mask (f,).

        All nodes of such a facet lie on the torus. Facets with all nodes in one cross-section are excluded, because
        they belong to a flat end.
        """
        off = corners - np.array(self.centre)
        up, x, y = (off @ np.array(e) for e in (self.axis, *transverse(self.axis)))
        away = np.hypot(np.hypot(x, y) - self.radius, up)
        turn = np.arctan2(y, x)
        apart = np.abs(np.remainder(turn - turn[:, :1] + np.pi, 2.0 * np.pi) - np.pi).max(axis=1)
        found: NDArray[np.bool_] = (np.abs(away - self.inner) < ON * self.inner).all(axis=1) & (apart > 1e-9)
        return found

    def project_points(self, place: Any) -> Any:
        """Return points projected from the circle onto the torus, m.

        The points must not lie on the circle or on its axis.
        """
        off = [p - o for p, o in zip(place, self.centre, strict=True)]
        up, x, y = (dot(off, e) for e in (self.axis, *transverse(self.axis)))
        square = x**2 + y**2
        back = square**-0.5
        beyond = square * back - self.radius
        out = (beyond**2 + up**2) ** -0.5 * self.inner
        along = (beyond * out + self.radius) * back
        frame = zip(self.centre, self.axis, *transverse(self.axis), strict=True)
        return tuple(o + up * out * a + x * along * b + y * along * c for o, a, b, c in frame)
